from __future__ import annotations

from collections.abc import Callable
from math import pi

import numpy as np
import pytest

from geometry import Corridor, Pose2, ReferencePath
from rti_mpcc.config import ControllerConfig, Limits
from rti_mpcc.controller import RtiMpcc
from rti_mpcc.model.layout import DELTA, DELTA_DOT, PHI, THETA, THETA_DOT, A, V, X, Y
from rti_mpcc.ocp.horizon import stage_lengths, stage_times
from rti_mpcc.ocp.room import Room
from rti_mpcc.planning.arrival import time_to_go
from rti_mpcc.planning.guess import arrival_guess, cruise_guess
from rti_mpcc.planning.pace import Pace, pace_of
from rti_mpcc.planning.search import defect
from rti_mpcc.types import Array, Trajectory

CONFIG = ControllerConfig(limits=Limits(speed=2.0, steering_rate=0.5))


def core(direction: int) -> RtiMpcc:
    segments = [(direction, 0.1, 12.0), (direction, -0.1, 12.0)]
    path = ReferencePath.from_segments(Pose2(3.0, -1.0, 2.0), segments)
    mpcc = RtiMpcc(path.parts[0], Corridor.from_offsets(path, left=4.0, right=-4.0), CONFIG)
    mpcc.set_goal(path.end.compose(Pose2(-0.5, 0.8, 0.2)))
    return mpcc


def beside(mpcc: RtiMpcc, speed: float) -> Array:
    """A state 0.6 m beside the path and turned against it."""
    pose = mpcc.part.pose(2.0).compose(Pose2(0.0, 0.6, -0.2))
    return np.array([pose.x, pose.y, pose.phi, mpcc.part.direction * speed, 0.1, 2.0])


def on_path(mpcc: RtiMpcc, speed: float) -> Array:
    """A state on the path that is steered along it."""
    pose, d = mpcc.part.pose(2.0), mpcc.part.direction
    steering = np.arctan(CONFIG.vehicle.wheelbase * 0.1)
    return np.array([pose.x, pose.y, pose.phi, d * speed, steering, 2.0])


def arrival(
    mpcc: RtiMpcc, state: Array, horizon: float = 20.0, of: Callable[..., Trajectory] = arrival_guess
) -> Trajectory:
    times = stage_times(5.0, stage_lengths(horizon, CONFIG.cycle, CONFIG.stages))
    distance = mpcc.target.theta - float(state[THETA])
    return of(mpcc.part, mpcc.target, state, times, distance, pace_of(mpcc.part, CONFIG), CONFIG)


def cruise(mpcc: RtiMpcc, state: Array) -> Trajectory:
    times = stage_times(5.0, stage_lengths(10.0, CONFIG.cycle, CONFIG.stages))
    return cruise_guess(mpcc.part, mpcc.target, state, times, pace_of(mpcc.part, CONFIG), CONFIG)


@pytest.mark.parametrize("speed", [0.0, 1.0])
@pytest.mark.parametrize("direction", [1, -1])
def test_an_arrival_leads_from_the_state_to_rest_at_the_target(direction: int, speed: float) -> None:
    mpcc = core(direction)
    state = beside(mpcc, speed)
    guess = arrival(mpcc, state)
    np.testing.assert_allclose(guess.states[0], state, atol=1e-12)
    target = mpcc.target.pose
    np.testing.assert_allclose(guess.states[-1, [X, Y]], [target.x, target.y], atol=1e-9)
    assert guess.states[-1, PHI] == pytest.approx(target.phi, abs=0.03)
    assert guess.states[-1, V] == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("make", [arrival, cruise])
@pytest.mark.parametrize("direction", [1, -1])
def test_a_guess_keeps_direction_and_input_limits(direction: int, make: type) -> None:
    mpcc = core(direction)
    guess = make(mpcc, beside(mpcc, 1.0))
    assert (direction * guess.states[:, V] >= 0.0).all()
    assert (np.diff(guess.states[:, THETA]) >= 0.0).all()
    assert guess.states[:, THETA].max() <= mpcc.target.stop
    assert np.abs(guess.controls[:, A]).max() <= CONFIG.limits.acceleration
    assert np.abs(guess.controls[:, DELTA_DOT]).max() <= CONFIG.limits.steering_rate
    assert np.abs(guess.states[1:, DELTA]).max() <= CONFIG.limits.steering
    assert guess.controls[:, THETA_DOT].min() >= 0.0


def progress_rate(guess: Trajectory) -> Array:
    """Mean rate of progress over each stage [m/s]."""
    return np.diff(guess.states[:, THETA]) / np.diff(guess.times)


@pytest.mark.parametrize("direction", [1, -1])
@pytest.mark.parametrize("speed", [0.0, 1.0, 3.0])
def test_a_cruise_changes_at_the_comfort_acceleration_to_the_cruise_speed(
    speed: float, direction: int
) -> None:
    mpcc = core(direction)
    guess = cruise(mpcc, on_path(mpcc, speed))
    change = CONFIG.comfort_acceleration * (guess.times - guess.times[0])
    expected = speed + np.clip(CONFIG.cruise_speed - speed, -change, change)
    elapsed = guess.times - guess.times[0]
    expected = np.minimum(expected, np.maximum(2.0, speed - CONFIG.limits.acceleration * elapsed))
    driving = guess.states[1:, THETA] < mpcc.target.theta - 1e-9
    means = 0.5 * (expected[1:] + expected[:-1])
    np.testing.assert_allclose(progress_rate(guess)[driving], means[driving], atol=1e-9)
    assert driving.sum() > 30


NARROW = Room(
    theta=np.array([0.0, 8.0, 12.0, 16.0]),
    walls=np.full(4, 1.0),
    speed=np.array([2.0, 2.0, 0.5, 2.0]),
)
"""Lets nobody through in the middle at more than 0.5 m/s."""


@pytest.mark.parametrize("speed", [0.0, 0.8])
@pytest.mark.parametrize("direction", [1, -1])
def test_an_arrival_is_begun_no_faster_than_the_qp_allows(direction: int, speed: float) -> None:
    mpcc = core(direction)
    pace = pace_of(mpcc.part, CONFIG, NARROW)
    state = on_path(mpcc, speed)
    way = mpcc.target.theta - float(state[THETA])
    highest = pace.ahead(float(state[THETA]), way, CONFIG)
    duration = time_to_go(way, speed, CONFIG.arrival_acceleration, 1.0, highest)
    times = stage_times(5.0, stage_lengths(duration, CONFIG.cycle, CONFIG.stages))
    guess = arrival_guess(mpcc.part, mpcc.target, state, times, way, pace, CONFIG)
    assert (progress_rate(guess) <= NARROW.speed_at(guess.states[1:, THETA]) + 0.05).all()
    assert guess.states[-1, THETA] == pytest.approx(min(mpcc.target.theta, mpcc.target.stop), abs=0.05)


@pytest.mark.parametrize("speed", [0.0, 0.8, 1.8])
@pytest.mark.parametrize("direction", [1, -1])
def test_a_cruise_is_begun_no_faster_than_the_qp_allows(direction: int, speed: float) -> None:
    """And is the same as without anything narrow where it comes to nothing that is."""
    mpcc = core(direction)
    state, part = on_path(mpcc, speed), mpcc.part
    times = stage_times(5.0, stage_lengths(20.0, CONFIG.cycle, CONFIG.stages))
    free, narrow = (
        cruise_guess(part, mpcc.target, state, times, pace_of(part, CONFIG, room), CONFIG)
        for room in (None, NARROW)
    )
    highest = NARROW.bounds(narrow.states[:, THETA], times - times[0], speed, CONFIG)
    assert (progress_rate(narrow) <= np.maximum(highest[1:], highest[:-1])).all()
    assert (progress_rate(free) > NARROW.speed_at(free.states[1:, THETA]) + 0.3).any()
    before = free.states[:, THETA] < 3.0
    np.testing.assert_allclose(narrow.states[before], free.states[before], atol=1e-9)


def test_comfort_alone_leaves_the_guess_the_cubic_that_begins_without_a_step() -> None:
    """Faster than (P1) is for the QP to weigh; (T3) begins at once with all of its acceleration."""
    mpcc = core(1)
    state = on_path(mpcc, 0.8)
    way = mpcc.target.theta - float(state[THETA])
    times = stage_times(5.0, stage_lengths(20.0, CONFIG.cycle, CONFIG.stages))
    slow = Pace(theta=np.array([0.0, 30.0]), speed=np.array([0.3, 0.3]))
    guesses = [
        arrival_guess(mpcc.part, mpcc.target, state, times, way, pace, CONFIG)
        for pace in (slow, pace_of(mpcc.part, CONFIG))
    ]
    np.testing.assert_array_equal(guesses[0].states, guesses[1].states)


def test_a_heading_on_another_branch_gives_the_same_guess() -> None:
    mpcc = core(1)
    state = beside(mpcc, 0.0)
    lifted = state.copy()
    lifted[PHI] += 2.0 * pi
    one, other = arrival(mpcc, state), arrival(mpcc, lifted)
    np.testing.assert_allclose(other.states[:, [X, Y]], one.states[:, [X, Y]], atol=1e-9)
    assert np.abs(np.diff(other.states[:, PHI])).max() < 1.0


@pytest.mark.parametrize("direction", [1, -1])
def test_a_vehicle_steered_away_turns_its_steering_first(direction: int) -> None:
    mpcc = core(direction)
    pose = mpcc.part.pose(2.0).compose(Pose2(0.0, 1.0, direction * 0.5))
    state = np.array([pose.x, pose.y, pose.phi, direction * 2.0, direction * 0.6, 2.0])
    guess = cruise(mpcc, state)
    turning = np.diff(guess.states[:, DELTA]) / np.diff(guess.times)
    led = int(np.argmax(np.abs(direction * turning + CONFIG.limits.steering_rate) > 1e-6))
    assert guess.times[led] - guess.times[0] >= 1.0
    begin = Trajectory(
        times=guess.times[: led + 1], states=guess.states[: led + 1], controls=guess.controls[:led]
    )
    position, heading = defect(begin, CONFIG)
    assert position < 1e-9
    assert heading < 1e-9
    apart = np.hypot(*(guess.states[-1, [X, Y]] - [mpcc.target.pose.x, mpcc.target.pose.y]))
    assert apart < 8.0


@pytest.mark.parametrize("direction", [1, -1])
def test_steering_that_takes_longer_to_turn_than_there_is_time_leaves_a_stage_for_the_fade(
    direction: int,
) -> None:
    mpcc = core(direction)
    state = on_path(mpcc, 2.0)
    state[DELTA] = -0.6
    times = stage_times(5.0, stage_lengths(1.0, CONFIG.cycle, CONFIG.stages))
    guess = arrival_guess(mpcc.part, mpcc.target, state, times, 1.0, pace_of(mpcc.part, CONFIG), CONFIG)
    assert guess.states.shape == (CONFIG.stages + 1, 6)
    assert np.isfinite(guess.states).all()
    turning = np.diff(guess.states[:-1, DELTA]) / np.diff(guess.times[:-1])
    np.testing.assert_allclose(np.abs(turning), CONFIG.limits.steering_rate)


@pytest.mark.parametrize("direction", [1, -1])
def test_a_standing_vehicle_begins_on_the_fade_wherever_it_steers(direction: int) -> None:
    mpcc = core(direction)
    state = beside(mpcc, 0.0)
    other = state.copy()
    other[DELTA] = -0.6
    np.testing.assert_array_equal(cruise(mpcc, state).states[1:], cruise(mpcc, other).states[1:])


def test_a_plan_too_short_for_turning_the_steering_first_is_a_guess_all_the_same() -> None:
    mpcc = core(1)
    state = on_path(mpcc, 2.0)
    state[DELTA] = 0.6
    times = np.linspace(5.0, 5.2, CONFIG.stages + 1)
    guess = arrival_guess(mpcc.part, mpcc.target, state, times, 14.0, pace_of(mpcc.part, CONFIG), CONFIG)
    assert np.isfinite(guess.states).all()
    assert np.isfinite(guess.controls).all()
