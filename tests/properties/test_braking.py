"""Braking divides by a distance, a time constant, a deceleration or a cycle: what holds around 0."""

from __future__ import annotations

from math import isfinite

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from geometry import Pose2
from rti_mpcc.config import ControllerConfig, Limits
from rti_mpcc.model.disturbance import Disturbance
from rti_mpcc.model.layout import CONTROLS, PHI, STATES, A, V, X
from rti_mpcc.ocp.horizon import stage_lengths, stage_times
from rti_mpcc.planning.context import PlanningContext
from rti_mpcc.safety import fallback
from rti_mpcc.safety.contact import stopping_distance
from rti_mpcc.safety.fallback import SETTLING_FACTOR, SETTLING_LEAST, STOP_DISTANCE
from rti_mpcc.safety.limiter import saturate
from rti_mpcc.safety.stopping import arc, stopping_along, stopping_motion
from rti_mpcc.types import Array, Source, Trajectory
from tests.properties.magnitudes import examples, from_zero, positive, signed
from tests.rti_mpcc.states import contexts

CONFIG = ControllerConfig()
COMFORT, MOST = CONFIG.comfort_acceleration, CONFIG.limits.acceleration
cycles = positive(5e-3, 0.2)
speeds = signed(1e-12, 30.0)


def state(v: float, delta: float = 0.0) -> Array:
    return np.array([0.0, 0.0, 0.0, v, delta, 0.0])


@given(speeds, positive(1e-3, 50.0), cycles, st.one_of(st.none(), st.floats(-5.0, 5.0)))
@example(0.0, 1.6, 0.05, None)
@example(0.0, 5.0, 0.05, 0.0)
@example(1e-12, 1.6, 0.005, 0.0)
@examples
def test_braking_never_speeds_up_and_never_turns_the_motion_round_in_a_cycle(
    speed: float, deceleration: float, cycle: float, before: float | None
) -> None:
    config = ControllerConfig(cycle=cycle)
    acceleration = fallback.brake(state(speed), deceleration, config, before=before).acceleration
    assert abs(acceleration) <= min(deceleration, config.limits.acceleration) * (1.0 + 1e-12)
    assert abs(acceleration) * cycle <= abs(speed) * (1.0 + 1e-12)
    assert acceleration * speed <= 0.0


@given(from_zero(1e-9, 30.0), st.floats(1.0, 5.0), positive(1e-3, 50.0))
@example(0.0, 2.0, 1.6)
@examples
def test_the_faster_the_vehicle_the_harder_it_brakes_or_as_hard(
    speed: float, faster: float, deceleration: float
) -> None:
    slow, fast = (
        -fallback.brake(state(each), deceleration, CONFIG).acceleration
        for each in (speed, faster * speed + 1e-6)
    )
    assert slow <= fast * (1.0 + 1e-12)


@given(speeds, cycles, st.floats(-5.0, 5.0))
@example(0.0, 0.05, 0.0)
@examples
def test_a_vehicle_that_holds_comes_to_rest_and_never_turns_round(
    speed: float, cycle: float, before: float
) -> None:
    config = ControllerConfig(cycle=cycle)
    acceleration = fallback.hold(state(speed), config, before).acceleration
    after = speed + cycle * acceleration
    assert abs(acceleration) <= config.limits.acceleration
    assert after * speed >= 0.0 or abs(after) <= 1e-12 * abs(speed)
    assert abs(after) <= abs(speed)


@given(st.floats(-0.6, 0.6), st.floats(-2.0, 2.0), cycles)
@example(0.0, 0.0, 0.05)
@examples
def test_wheels_that_turn_at_rest_come_nearer_to_their_angle_and_not_past_it(
    here: float, angle: float, cycle: float
) -> None:
    config = ControllerConfig(cycle=cycle)
    rate = fallback.turn_wheels(state(0.0, here), angle, config).steering_rate
    assert abs(rate) <= config.comfort_steering_rate
    assert abs(angle - here - cycle * rate) <= abs(angle - here) + 1e-12
    assert (angle - here - cycle * rate) * (angle - here) >= -1e-12


@given(from_zero(1e-9, 30.0), signed(1e-12, 1e3), st.floats(1.0, 4.0))
@example(0.0, 0.0, 2.0)
@example(0.0, STOP_DISTANCE, 2.0)
@example(1.0, STOP_DISTANCE, 2.0)
@examples
def test_what_is_braked_before_a_contact_is_within_limits_and_falls_with_the_distance(
    speed: float, distance: float, faster: float
) -> None:
    here = fallback.before_contact(speed, distance, CONFIG)
    assert COMFORT <= here <= MOST
    assert fallback.before_contact(speed, distance + 0.1, CONFIG) <= here
    assert fallback.before_contact(faster * speed, distance, CONFIG) >= here
    left = distance - STOP_DISTANCE
    if here < MOST:
        assert speed**2 / (2.0 * here) <= left * (1.0 + 1e-9)


def before_the_goal(left: float, speed: float, deceleration: float) -> PlanningContext:
    """`left` [m] before the goal at `speed` [m/s], braking already with `deceleration` [m/s²]."""
    return contexts(state=state(speed), acceleration=-deceleration, speed=speed, error=Pose2(-left, 0.0, 0.0))


@given(signed(1e-12, 10.0), from_zero(1e-12, 5.0), signed(1e-12, 5.0), cycles, positive(1e-2, 1e3))
@example(0.1, 0.0, 0.0, 0.05, 1.0)
@example(0.0, 0.0, 0.0, 0.05, 1.0)
@example(1e-9, 0.0, 0.0, 0.05, 1.0)
@example(1.0, 0.0, 0.4, 0.05, 1.0)
@example(1.0, 0.5, 0.0, 0.05, 1.0)
@examples
def test_the_deceleration_of_a_settling_vehicle_is_about_comfort(
    left: float, speed: float, deceleration: float, cycle: float, jerk: float
) -> None:
    config = ControllerConfig(cycle=cycle, comfort_jerk=jerk)
    found = fallback.settling_deceleration(before_the_goal(left, speed, deceleration), config)
    assert SETTLING_LEAST * COMFORT <= found <= SETTLING_FACTOR * COMFORT


@given(speeds, from_zero(1e-9, 1.4), positive(1e-3, 100.0), positive(0.1, 10.0), cycles)
@example(0.0, 0.0, 1e-3, 2.875, 0.05)
@example(30.0, 1.4, 1e-3, 0.1, 0.05)
@examples
def test_a_stopping_motion_drives_at_most_the_braking_distance_and_ends_at_rest(
    speed: float, steering: float, deceleration: float, wheelbase: float, cycle: float
) -> None:
    start = state(speed, steering)
    times = stage_times(0.0, stage_lengths(10.0, cycle, 70, 0.1))
    motion = stopping_motion(start, times, deceleration, wheelbase)
    assert np.isfinite(motion.states).all()
    assert np.isfinite(motion.controls).all()
    way = float(motion.states[-1, 5])
    assert way <= speed**2 / (2.0 * deceleration) * (1.0 + 1e-9)
    assert np.hypot(*motion.states[-1, :2]) <= way * (1.0 + 1e-9)
    assert (np.abs(motion.states[:, V]) <= abs(speed)).all()
    if deceleration * 10.0 >= abs(speed):
        assert motion.states[-1, V] == pytest.approx(0.0, abs=1e-9)
        assert way == pytest.approx(speed**2 / (2.0 * deceleration), rel=1e-6, abs=1e-12)
    assert np.abs(motion.controls[:, A]).max() <= deceleration * (1.0 + 1e-6)


@given(signed(1e-12, 100.0), signed(1e-12, 1.4), positive(1e-3, 10.0))
@example(0.0, 0.0, 2.875)
@example(1.0, 0.0, 2.875)
@examples
def test_on_an_arc_the_chord_is_no_longer_than_the_way_and_the_turn_is_its_curvature(
    way: float, steering: float, wheelbase: float
) -> None:
    (end,) = arc(state(1.0), np.array([way]), steering, wheelbase)
    assert np.hypot(end[0], end[1]) <= abs(way) * (1.0 + 1e-9)
    assert end[PHI] == pytest.approx(way * np.tan(steering) / wheelbase)
    if abs(end[PHI]) < 1e-6:
        assert end[X] == pytest.approx(way)


@given(from_zero(1e-12, 1.0), positive(1e-6, 10.0), positive(1e-3, 10.0))
@example(0.0, 1.0, 1.6)
@example(2e-9, 1.0, 1.6)
@examples
def test_a_plan_that_hardly_moves_can_be_braked_along(step: float, speed: float, deceleration: float) -> None:
    """Its places coincide, or nearly so."""
    times, states = 0.1 * np.arange(11.0), np.zeros((11, STATES))
    states[:, X], states[:, V] = step * np.arange(11.0), speed
    plan = Trajectory(times=times, states=states, controls=np.zeros((10, CONTROLS)))
    motion = stopping_along(plan, state(speed), times, deceleration, (0.2, 0.1))
    assert motion is not None
    assert np.isfinite(motion.states).all()
    assert motion.states[-1, X] <= speed**2 / (2.0 * deceleration) * (1.0 + 1e-6) + 1e-12
    assert (np.diff(motion.states[:, X]) >= -1e-12).all()


@given(from_zero(1e-9, 100.0), st.floats(1.0, 3.0))
@example(0.0, 2.0)
@examples
def test_the_stopping_distance_is_never_less_than_the_braking_distance_and_rises_with_speed(
    speed: float, faster: float
) -> None:
    need = stopping_distance(speed, CONFIG)
    assert need > 0.0
    assert need >= speed**2 / (2.0 * COMFORT)
    assert stopping_distance(faster * speed, CONFIG) >= need


extreme = st.one_of(signed(1e-12, 1e6), st.sampled_from((float("nan"), float("inf"), -float("inf"))))


@given(
    extreme, extreme, signed(1e-9, 40.0), signed(1e-9, 1.5), cycles, st.floats(0.7, 1.3), st.floats(0.8, 1.2)
)
@example(0.0, 0.0, 0.0, 0.0, 0.05, 1.0, 1.0)
@example(5.0, 1.0, 10.0, 0.6, 0.005, 1.0, 1.0)
@example(float("nan"), 0.0, 30.0, -1.5, 0.2, 0.7, 1.2)
@examples
def test_whatever_is_wanted_a_command_is_finite_and_within_the_limits(
    a: float, rate: float, speed: float, steering: float, cycle: float, gain: float, turn: float
) -> None:
    config = ControllerConfig(cycle=cycle)
    known = Disturbance(acceleration=0.3, steering=0.05, gain=gain, turn=turn)
    here = known.effective(state(speed, steering))
    wanted = fallback.ControlInput(acceleration=a, steering_rate=rate, source=Source.SOLUTION)
    sent = saturate(wanted, here, state(speed, steering), config, known)
    assert isfinite(sent.acceleration)
    assert isfinite(sent.steering_rate)
    assert abs(sent.acceleration) <= config.limits.acceleration
    assert abs(sent.steering_rate) <= config.limits.steering_rate
    # Beyond a limit it leads no further out.
    if abs(speed) > config.limits.speed:
        assert sent.acceleration * speed <= 0.0
    if abs(steering) > config.limits.steering:
        assert sent.steering_rate * steering <= 0.0


@given(positive(1e-3, 100.0), st.floats(1e-3, 1.0))
@example(1e-3, 1.0)
@examples
def test_braking_without_a_plan_is_between_comfort_and_the_limit(most: float, share: float) -> None:
    config = ControllerConfig(comfort_acceleration=share * most, limits=Limits(acceleration=most))
    assert share * most <= config.firm_deceleration <= most
    assert config.comfort.jerk > 0.0
