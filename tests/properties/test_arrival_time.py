"""The time of an arrival divides by an acceleration, a distance and a speed: what holds around 0."""

from __future__ import annotations

from math import inf, isfinite
from typing import Literal

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from geometry import Pose2, ReferencePath
from rti_mpcc.config import ControllerConfig, Limits
from rti_mpcc.model.layout import CONTROLS, DELTA, STATES, THETA, A, V
from rti_mpcc.planning.arrival import (
    LEAST_TIME,
    arrival_time,
    cubic_motion,
    paced_motion,
    peak_speed,
    time_along,
    time_to_go,
    within_reach,
)
from rti_mpcc.planning.pace import Pace, pace_of
from rti_mpcc.planning.schedule import CATCHING_UP, own_time, pressed, rescheduled
from rti_mpcc.planning.stops import SEEN_SHARE, in_view
from rti_mpcc.types import Array, Trajectory
from tests.properties.magnitudes import examples, few_examples, from_zero, positive
from tests.rti_mpcc.states import arrival_at, arrives_at, arriving, contexts, contouring, some_plan

LEAST = LEAST_TIME
STRAIGHT = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(1, 0.0, 50.0)]).parts[0]
PACES: dict[str, Pace] = {
    ride: pace_of(STRAIGHT, ControllerConfig(ride=ride)) for ride in ("smooth", "brisk")
}

Ride = Literal["smooth", "brisk"]
rides = st.sampled_from(("smooth", "brisk"))
distances = from_zero(1e-9, 1e3)
speeds = from_zero(1e-9, 30.0)
comforts = positive(1e-2, 10.0)
jerks = st.one_of(st.just(inf), positive(1e-2, 1e3))
brisk = st.booleans()


@given(st.one_of(distances, distances.map(lambda d: -d)), speeds, comforts, jerks, brisk)
@example(0.0, 0.0, 0.4, 1.0, False)
@example(0.0, 1.0, 0.4, 1.0, False)
@example(0.0, 1.0, 0.4, 1.0, True)
@example(0.01, 1.0, 0.4, 1.0, False)
@examples
def test_the_time_of_an_arrival_is_between_the_floor_and_the_time_from_rest(
    distance: float, speed: float, comfort: float, jerk: float, brisk: bool
) -> None:
    from_rest = time_to_go(distance, 0.0, comfort, LEAST, jerk=jerk, brisk=brisk)
    time = time_to_go(distance, speed, comfort, LEAST, jerk=jerk, brisk=brisk)
    assert isfinite(from_rest)
    assert LEAST <= time <= from_rest * (1.0 + 1e-9)


@given(distances, st.floats(1.0, 10.0), speeds, comforts, jerks, brisk)
@example(0.0, 2.0, 1.0, 0.4, 1.0, False)
@example(1e-3, 10.0, 1.0, 0.4, 1.0, False)
@examples
def test_the_time_of_an_arrival_never_falls_with_the_distance(
    distance: float, farther: float, speed: float, comfort: float, jerk: float, brisk: bool
) -> None:
    near, far = (
        time_to_go(each, speed, comfort, LEAST, jerk=jerk, brisk=brisk)
        for each in (distance, farther * distance + 1e-3 * (farther - 1.0))
    )
    assert near <= far * (1.0 + 1e-9)


@given(distances, speeds, st.floats(1.0, 10.0), comforts, jerks, brisk)
@example(0.0, 0.0, 2.0, 0.4, 1.0, False)
@example(0.01, 0.1, 10.0, 0.4, 1.0, False)
@example(0.01, 0.1, 10.0, 0.4, 1.0, True)
@examples
def test_the_time_of_an_arrival_never_rises_with_the_speed(
    distance: float, speed: float, faster: float, comfort: float, jerk: float, brisk: bool
) -> None:
    slow, fast = (
        time_to_go(distance, each, comfort, LEAST, jerk=jerk, brisk=brisk)
        for each in (speed, faster * speed + 1e-3 * (faster - 1.0))
    )
    assert fast <= slow * (1.0 + 1e-9)


@given(distances, speeds, comforts, positive(1e-3, 10.0), st.floats(0.1, 1.0), brisk)
@example(0.0, 1.0, 0.4, 1.0, 0.5, False)
@example(1.0, 0.0, 0.4, 1e-3, 1.0, False)
@example(1e-6, 1.0, 0.4, 1e-3, 1.0, True)
@few_examples
def test_a_lower_speed_limit_on_the_way_never_shortens_the_arrival(
    distance: float, speed: float, comfort: float, bound: float, share: float, brisk: bool
) -> None:
    free = time_to_go(distance, speed, comfort, LEAST, brisk=brisk)
    high, low = (
        time_to_go(distance, speed, comfort, LEAST, np.full(64, each), brisk=brisk)
        for each in (bound, share * bound)
    )
    # In 64 pieces of the way the motion is known to a percent.
    assert free <= high * (1.0 + 1e-9)
    assert high <= low * 1.01
    assert distance / max(speed, bound) <= high * (1.0 + 1e-9)
    # No longer than to change speed at either end, in a piece at least, and to drive at the limit in between.
    if speed <= bound:
        pieces = 1.0 + 2.0 / 64.0
        assert high <= max(LEAST, pieces * distance / bound + 4.0 * bound / comfort) * 1.01


@pytest.mark.parametrize("ride", ["smooth", "brisk"])
@pytest.mark.parametrize("speed", [0.0, 0.01, 1.0, 10.0])
def test_at_the_target_the_arrival_takes_the_shortest_time(ride: Ride, speed: float) -> None:
    assert arrival_time(0.0, speed, ControllerConfig(ride=ride)) == pytest.approx(LEAST)


@given(rides, distances, speeds)
@example("smooth", 0.0, 0.0)
@example("smooth", 0.0, 10.0)
@example("brisk", 0.0, 10.0)
@few_examples
def test_at_the_target_an_arrival_is_within_reach_and_what_is_in_reach_stays_so_nearer_by(
    ride: Ride, distance: float, speed: float
) -> None:
    config = ControllerConfig(ride=ride)
    assert within_reach(0.0, speed, config, PACES[ride], 0.0)
    if within_reach(distance, speed, config, PACES[ride], 0.0):
        assert within_reach(0.5 * distance, speed, config, PACES[ride], 0.0)


@given(distances, speeds, positive(1e-3, 1e3))
@example(0.0, 0.0, 1.0)
@example(0.0, 1.0, 1.0)
@example(1.0, 1.0, 2.0)  # an even deceleration: the parabola of the speed has no vertex
@example(1.0, 1.0, 1.5)
@examples
def test_the_peak_speed_is_no_lower_than_the_speed_and_bounded_by_the_mean(
    distance: float, speed: float, duration: float
) -> None:
    peak = peak_speed(distance, speed, duration)
    assert speed <= peak <= (speed + 1.5 * distance / duration) * (1.0 + 1e-9)


def stages(duration: float) -> Array:
    """Times (31,) [s] whose first interval is one cycle."""
    return np.append(0.0, np.linspace(0.01 * duration, duration, 30))


@given(distances, speeds, positive(1e-2, 1e3))
@example(0.0, 0.0, 1.0)
@example(0.0, 1.0, 1.0)
@example(1e-9, 10.0, 1.0)
@examples
def test_the_motion_of_an_arrival_never_goes_back_and_ends_at_rest(
    distance: float, speed: float, duration: float
) -> None:
    driven, rate = cubic_motion(stages(duration), distance, speed)
    assert driven[0] == 0.0
    assert (np.diff(driven) >= 0.0).all()
    assert (rate >= 0.0).all()
    assert rate[0] == pytest.approx(speed)
    assert rate[-1] == pytest.approx(0.0, abs=1e-9 * (1.0 + speed + distance / duration))
    # A vehicle too fast for its way passes the target by 4/27 of what it would drive at that speed, at most.
    assert driven[-1] <= (distance + 4.0 / 27.0 * speed * duration) * (1.0 + 1e-9)
    if speed * duration <= 3.0 * distance:
        assert driven[-1] == pytest.approx(distance)


@given(distances, speeds, comforts, positive(1e-3, 10.0), brisk)
@example(0.0, 0.0, 0.4, 1.0, False)
@example(0.0, 1.0, 0.4, 1.0, False)
@example(0.0, 1.0, 0.4, 1.0, True)
@example(5.0, 0.0, 0.4, 1e-3, False)
@few_examples
def test_the_motion_under_a_speed_limit_covers_the_way_and_keeps_to_the_limit(
    distance: float, speed: float, comfort: float, bound: float, brisk: bool
) -> None:
    highest = np.full(64, bound)
    time = time_to_go(distance, speed, comfort, 1e-9, highest, brisk=brisk)
    driven, rate = paced_motion(stages(time), distance, speed, comfort, highest, brisk=brisk)
    way = max(distance, 1e-6)  # a way of 0 is taken for a micrometre
    assert (np.diff(driven) >= -1e-12 * way).all()
    assert driven[-1] == pytest.approx(way, rel=1e-6)
    assert (rate >= 0.0).all()
    assert rate[-1] == pytest.approx(0.0, abs=1e-6 * (1.0 + speed))
    assert rate.max() <= max(speed, bound) * 1.01


@given(
    st.lists(st.tuples(positive(1e-9, 10.0), positive(1e-9, 20.0)), min_size=1, max_size=20), speeds, comforts
)
@example([(1e-9, 1e-9)], 0.0, 0.4)
@example([(1e-9, 10.0)] * 20, 0.0, 0.4)
@examples
def test_the_time_over_unequal_pieces_is_finite_and_no_shorter_than_at_the_highest_speed(
    pieces: list[tuple[float, float]], speed: float, comfort: float
) -> None:
    ways, highest = (np.array(column) for column in zip(*pieces, strict=True))
    time = time_along(ways, speed, comfort, highest)
    # Two neighbouring speeds add up to a micrometre per second at least.
    assert ways.sum() / max(speed, highest.max(), 5e-7) <= time * (1.0 + 1e-9)
    assert time <= 2e6 * ways.sum() * (1.0 + 1e-9)


def plan_at(speed: float, steering: float, acceleration: float = 0.0) -> Trajectory:
    """Ten stages of a tenth of a second at one speed [m/s], steering [rad] and acceleration [m/s²]."""
    states, controls = np.zeros((11, STATES)), np.zeros((10, CONTROLS))
    states[:, V], states[:, DELTA], controls[:, A] = speed, steering, acceleration
    return Trajectory(times=0.1 * np.arange(11.0), states=states, controls=controls)


@given(from_zero(1e-9, 10.0), from_zero(1e-9, 0.6), from_zero(1e-9, 5.0))
@example(0.0, 0.0, 0.0)
@examples
def test_a_plan_is_pressed_by_what_it_takes_of_comfort_and_one_at_rest_by_nothing(
    speed: float, steering: float, acceleration: float
) -> None:
    config = ControllerConfig()
    factor = pressed(plan_at(speed, steering, acceleration), config)
    lateral = speed**2 * np.tan(steering) / config.vehicle.wheelbase
    shares = acceleration / config.comfort_acceleration, lateral / config.comfort_lateral_acceleration
    assert factor**2 == pytest.approx(max(shares))


@given(from_zero(1e-9, 10.0), from_zero(1e-9, 0.6))
@example(0.0, 0.0)
@example(0.0, 0.6)
@examples
def test_the_own_time_of_a_plan_is_finite_and_none_for_one_that_stands(speed: float, steering: float) -> None:
    config = ControllerConfig(ride="brisk")
    time = own_time(plan_at(speed, steering), speed, config)
    assert speed * 1.0 / config.limits.speed <= time * (1.0 + 1e-9)
    if speed == 0.0:
        assert time <= 0.1


@given(rides, from_zero(1e-9, 50.0), from_zero(1e-9, 10.0), from_zero(1e-9, 5.0), st.floats(1.0, 10.0))
@example("smooth", 0.0, 0.0, 0.0, 1.0)
@example("smooth", 2.0 + 1e-9, 0.0, 0.0, 1.0)
@example("brisk", 10.0, 1.0, 5.0, 1.0)
@few_examples
def test_the_time_of_an_arrival_that_has_enough_moves_by_no_more_than_the_clock_in_a_cycle(
    ride: Ride, distance: float, speed: float, acceleration: float, share: float
) -> None:
    config = ControllerConfig(ride=ride)
    context = contexts(distance=distance, speed=speed, measured_speed=speed)
    at = context.begin + share * arrival_time(max(distance, 10.0), 0.0, config)
    s = arriving(driven=plan_at(speed, 0.1, acceleration), arrival=arrival_at(at))
    then = arrives_at(rescheduled(s, context, config))
    assert then is not None
    catching_up = CATCHING_UP
    assert -catching_up * config.cycle - 1e-9 <= then - at <= config.cycle + 1e-9


@given(from_zero(1e-9, 30.0), positive(1e-6, 10.0), st.floats(1.0, 120.0))
@example(0.0, 1e-6, 10.0)
@example(30.0, 0.4, 10.0)
@examples
def test_a_cruise_sees_no_farther_than_it_drives_at_its_own_speed(
    speed: float, comfort: float, horizon: float
) -> None:
    config = ControllerConfig(
        comfort_acceleration=comfort, limits=Limits(acceleration=10.0), cruise_horizon=horizon
    )
    s, context = contouring(driven=some_plan()), contexts(speed=speed)
    seen = in_view(s, context, config) - float(context.state[THETA])
    most = SEEN_SHARE * horizon * config.cruise_speed
    assert -1e-9 * (1.0 + most) <= seen <= most * (1.0 + 1e-9)
