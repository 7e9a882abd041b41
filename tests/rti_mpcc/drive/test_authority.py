"""A drive or a steering that is too weak is told with figures."""

from __future__ import annotations

import pytest

from rti_mpcc.config import ControllerConfig, Limits
from rti_mpcc.drive.limiter import exceeded
from rti_mpcc.model.disturbance import UNDISTURBED, Disturbance

CONFIG = ControllerConfig(limits=Limits(acceleration=0.5, steering=0.06))


def test_what_leaves_enough_is_not_remarked_on() -> None:
    assert exceeded(UNDISTURBED, CONFIG) == ""
    for sign in (1.0, -1.0):
        assert exceeded(Disturbance(acceleration=sign * 0.4, steering=sign * 0.05), CONFIG) == ""


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_slope_that_is_too_steep(sign: float) -> None:
    reason = exceeded(Disturbance(acceleration=sign * 0.55), CONFIG)
    assert "too weak for the slope" in reason
    assert f"{-sign * 0.55:+.2f} m/s²" in reason
    assert "0.50 m/s²" in reason


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_wheels_that_stand_too_far_off(sign: float) -> None:
    reason = exceeded(Disturbance(steering=sign * 0.06), CONFIG)
    assert "steering is too far off" in reason
    assert f"{-sign * 3.4:+.1f} deg" in reason
