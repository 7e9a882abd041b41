"""First guesses divide by the way over which offsets fade, and by stages: what holds near the target."""

from __future__ import annotations

from math import atan2, hypot
from typing import Literal

import numpy as np
from hypothesis import example, given
from hypothesis import strategies as st

from geometry import PathPart, Pose2, ReferencePath
from rti_mpcc.config import ControllerConfig
from rti_mpcc.model.layout import DELTA, DELTA_DOT, THETA, A, V
from rti_mpcc.ocp.horizon import stage_lengths, stage_times
from rti_mpcc.ocp.targets import Target, goal_on
from rti_mpcc.planning.arrival import arrival_time
from rti_mpcc.planning.guess import arrival_guess, cruise_guess
from rti_mpcc.planning.pace import pace_of
from rti_mpcc.types import Array, Trajectory
from tests.properties.magnitudes import few_examples, from_zero, positive, signed

Ride = Literal["smooth", "brisk"]
rides = st.sampled_from(("smooth", "brisk"))
END = 20.0
PARTS: dict[float, PathPart] = {
    curvature: ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(1, curvature, END)]).parts[0]
    for curvature in (0.0, 0.2, -0.2)
}
curvatures = st.sampled_from(tuple(PARTS))


def target_beside(part: PathPart, offset: float, turn: float) -> Target:
    """A goal beside the end of a part [m], turned by an angle [rad]."""
    return goal_on(part, part.last.compose(Pose2(0.0, offset, turn)))


def state_before(
    part: PathPart, left: float, beside: float, turn: float, speed: float, delta: float
) -> Array:
    """`left` [m] before the end of a part, `beside` it [m] and turned from it [rad]; negative: behind it."""
    theta = END - left
    pose = part.pose(theta).compose(Pose2(0.0, beside, turn))
    return np.array([pose.x, pose.y, pose.phi, speed, delta, theta])


def check(guess: Trajectory, state: Array, target: Target, config: ControllerConfig) -> None:
    """What any first guess has to be, whatever it is for."""
    limits = config.limits
    assert np.isfinite(guess.states).all()
    assert np.isfinite(guess.controls).all()
    np.testing.assert_allclose(guess.states[0], state, rtol=1e-12, atol=1e-12)
    assert np.abs(guess.states[:, DELTA]).max() <= max(limits.steering, abs(float(state[DELTA])))
    assert np.abs(guess.controls[:, A]).max() <= limits.acceleration
    assert np.abs(guess.controls[:, DELTA_DOT]).max() <= limits.steering_rate
    # The state before which nothing is planned may be behind the target.
    assert guess.states[1:, THETA].max() <= max(target.stop, float(state[THETA])) + 1e-9


@given(
    rides, curvatures, signed(1e-9, 20.0), signed(1e-9, 3.0), st.floats(-0.5, 0.5), from_zero(1e-9, 10.0),
    st.floats(-0.6, 0.6),
)  # fmt: skip
@example("smooth", 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
@example("smooth", 0.0, 0.0, 0.5, 0.0, 0.5, 0.0)
@example("smooth", 0.0, 1e-9, 2.0, 0.0, 0.0, 0.0)
@example("brisk", 0.2, -1.0, 2.0, 0.3, 1.0, 0.6)
@few_examples
def test_a_guess_is_finite_and_within_the_limits_of_the_vehicle_wherever_the_target_is(
    ride: Ride, curvature: float, left: float, offset: float, turn: float, speed: float, delta: float
) -> None:
    config, part = ControllerConfig(ride=ride), PARTS[curvature]
    state, target = state_before(part, left, 0.0, 0.0, speed, delta), target_beside(part, offset, turn)
    distance = hypot(max(left, 0.0), offset)
    time = min(arrival_time(distance, speed, config), 300.0)
    times = stage_times(0.0, stage_lengths(time, config.cycle, config.stages))
    pace = pace_of(part, config)
    check(arrival_guess(part, target, state, times, distance, pace, config), state, target, config)
    times = stage_times(0.0, stage_lengths(config.cruise_horizon, config.cycle, config.stages))
    check(cruise_guess(part, target, state, times, pace, config), state, target, config)


@given(curvatures, from_zero(1e-6, 20.0), signed(1e-6, 3.0), st.floats(-0.5, 0.5), from_zero(1e-6, 3.0))
@example(0.0, 0.0, 2.0, 0.0, 0.0)
@example(0.0, 0.01, 2.0, 0.0, 0.0)
@example(0.0, 0.1, 2.0, 0.0, 0.5)
@example(0.0, 0.1, 0.5, 0.0, 0.5)
@few_examples
def test_a_guess_to_a_target_beside_the_vehicle_is_no_faster_than_the_speed_limit(
    curvature: float, left: float, offset: float, turn: float, speed: float
) -> None:
    """Where hardly any way is left, an offset cannot fade over it."""
    config, part = ControllerConfig(), PARTS[curvature]
    state, target = state_before(part, left, 0.0, 0.0, speed, 0.0), target_beside(part, offset, turn)
    distance = hypot(left, offset)
    time = arrival_time(distance, speed, config)
    times = stage_times(0.0, stage_lengths(time, config.cycle, config.stages))
    guess = arrival_guess(part, target, state, times, distance, pace_of(part, config), config)
    assert np.abs(guess.states[:, V]).max() <= config.limits.speed


@given(positive(1e-6, 1e3), st.floats(-3.0, 3.0), st.floats(-1.5, 1.5), from_zero(1e-9, 10.0))
@example(1e-6, 3.0, 1.5, 10.0)
@example(12.0, 0.0, 0.0, 0.0)
@few_examples
def test_a_guess_from_beside_the_path_ends_at_the_target_and_looks_along_it(
    left: float, beside: float, turn: float, speed: float
) -> None:
    config = ControllerConfig()
    part = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(1, 0.0, left)]).parts[0]
    pose = Pose2(0.0, beside, turn)
    state = np.array([pose.x, pose.y, pose.phi, speed, 0.0, 0.0])
    target = goal_on(part, part.last)
    distance = hypot(left, beside)
    time = min(arrival_time(distance, speed, config), 300.0)
    times = stage_times(0.0, stage_lengths(time, config.cycle, config.stages))
    guess = arrival_guess(part, target, state, times, distance, pace_of(part, config), config)
    check(guess, state, target, config)
    steps = np.diff(guess.states[:, :2], axis=0)
    assert abs(atan2(float(steps[-1, 1]), float(steps[-1, 0]))) <= 0.5 * np.pi + 1e-9
