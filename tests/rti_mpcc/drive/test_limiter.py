from __future__ import annotations

from math import inf, nan

import numpy as np
import pytest

from rti_mpcc.config import ControllerConfig, Limits
from rti_mpcc.drive.fallback import ControlInput
from rti_mpcc.drive.limiter import exceeded, saturate
from rti_mpcc.model.actuators import UNDISTURBED, Disturbance
from rti_mpcc.types import Array, Source

CONFIG = ControllerConfig()
LIMITS = CONFIG.limits


def state(v: float = 1.0, delta: float = 0.0) -> Array:
    return np.array([0.0, 0.0, 0.0, v, delta, 0.0])


def gated(
    a: float,
    rate: float,
    v: float = 1.0,
    delta: float = 0.0,
    *,
    measured: tuple[float, float] | None = None,
) -> ControlInput:
    speed, steering = measured or (v, delta)
    control = ControlInput(acceleration=a, steering_rate=rate, source=Source.SOLUTION)
    return saturate(control, state(v, delta), state(speed, steering), CONFIG)


def test_what_is_within_the_limits_passes_as_it_is() -> None:
    control = gated(0.3, -0.2)
    assert (control.acceleration, control.steering_rate, control.source) == (0.3, -0.2, Source.SOLUTION)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_inputs_are_cut_to_their_limits(sign: float) -> None:
    control = gated(sign * 9.0, sign * 3.0)
    assert (control.acceleration, control.steering_rate) == (
        sign * LIMITS.acceleration,
        sign * LIMITS.steering_rate,
    )


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_speed_and_steering_do_not_pass_their_limits(sign: float) -> None:
    control = gated(sign * 1.0, sign * 1.0, sign * (LIMITS.speed - 0.01), sign * (LIMITS.steering - 0.01))
    assert control.acceleration * CONFIG.cycle == pytest.approx(sign * 0.01)
    assert control.steering_rate * CONFIG.cycle == pytest.approx(sign * 0.01)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_what_is_outside_returns_at_the_rate_limit(sign: float) -> None:
    control = gated(sign * 1.0, sign * 1.0, sign * (LIMITS.speed + 2.0), sign * (LIMITS.steering + 0.2))
    assert (control.acceleration, control.steering_rate) == (
        -sign * LIMITS.acceleration,
        -sign * LIMITS.steering_rate,
    )
    near = gated(0.0, 0.0, sign * (LIMITS.speed + 0.01), sign * (LIMITS.steering + 0.01))
    assert near.acceleration * CONFIG.cycle == pytest.approx(-sign * 0.01)
    assert near.steering_rate * CONFIG.cycle == pytest.approx(-sign * 0.01)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_what_is_measured_outside_is_not_led_further_out_whatever_it_will_be(sign: float) -> None:
    outside = (sign * (LIMITS.speed + 1.0), sign * (LIMITS.steering + 0.1))
    control = gated(sign * 1.0, sign * 0.5, 0.0, 0.0, measured=outside)
    assert (control.acceleration, control.steering_rate) == (0.0, 0.0)
    back = gated(-sign * 1.0, -sign * 0.5, 0.0, 0.0, measured=outside)
    assert (back.acceleration, back.steering_rate) == (-sign * 1.0, -sign * 0.5)


@pytest.mark.parametrize("value", [nan, inf, -inf])
def test_what_is_not_finite_becomes_braking(value: float) -> None:
    for control in (gated(value, 0.0), gated(0.0, value)):
        assert control.source is Source.BRAKING
        assert control.acceleration == pytest.approx(-4.0 * CONFIG.comfort_acceleration)
        assert control.steering_rate == 0.0


def test_a_command_takes_the_disturbance_up() -> None:
    known = Disturbance(acceleration=-0.3, steering=0.02)
    control = ControlInput(acceleration=0.2, steering_rate=0.1, source=Source.SOLUTION)
    got = saturate(control, known.effective(state()), state(), CONFIG, known)
    assert got.acceleration == pytest.approx(0.5)
    assert got.steering_rate == 0.1


def test_a_command_takes_the_gain_up() -> None:
    known = Disturbance(acceleration=-0.3, gain=1.25)
    control = ControlInput(acceleration=0.2, steering_rate=0.1, source=Source.SOLUTION)
    assert saturate(control, state(), state(), CONFIG, known).acceleration == pytest.approx(0.4)


# -- a drive or a steering that is too weak is told with figures --------------------------------------------

WEAK = ControllerConfig(limits=Limits(acceleration=0.5, steering=0.06))


def test_what_leaves_enough_is_not_remarked_on() -> None:
    assert exceeded(UNDISTURBED, WEAK) == ""
    for sign in (1.0, -1.0):
        assert exceeded(Disturbance(acceleration=sign * 0.4, steering=sign * 0.05), WEAK) == ""


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_slope_that_is_too_steep(sign: float) -> None:
    reason = exceeded(Disturbance(acceleration=sign * 0.55), WEAK)
    assert "too weak for the slope" in reason
    assert f"{-sign * 0.55:+.2f} m/s²" in reason
    assert "0.50 m/s²" in reason


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_wheels_that_stand_too_far_off(sign: float) -> None:
    reason = exceeded(Disturbance(steering=sign * 0.06), WEAK)
    assert "steering is too far off" in reason
    assert f"{-sign * 3.4:+.1f} deg" in reason
