"""Braking divides by a distance, a time constant, a deceleration or a cycle: what holds around 0."""

from __future__ import annotations

from math import isfinite

import numpy as np
from hypothesis import example, given
from hypothesis import strategies as st

from rti_mpcc.config import ControllerConfig
from rti_mpcc.course.collision_check import stopping_distance
from rti_mpcc.drive import fallback
from rti_mpcc.drive.fallback import STOP_DISTANCE
from rti_mpcc.drive.limiter import saturate
from rti_mpcc.model.actuators import Disturbance
from rti_mpcc.types import Array, Source
from tests.properties.magnitudes import examples, from_zero, positive, signed

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
