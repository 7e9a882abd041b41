from __future__ import annotations

import numpy as np
import pytest

from rti_mpcc.config import ControllerConfig, Limits, Vehicle
from rti_mpcc.model.actuators import UNDISTURBED, Disturbance, QueuedCommand, roll_forward
from rti_mpcc.model.layout import DELTA

WHEELBASE, STOP = 2.8, 0.6
VEHICLE = ControllerConfig(vehicle=Vehicle(wheelbase=WHEELBASE), limits=Limits(steering=STOP))
ANGLES = (-0.6, -0.1, 0.0, 0.25, 0.6)


@pytest.mark.parametrize("turn", [0.9, 1.0, 1.08])
@pytest.mark.parametrize("angle", ANGLES)
def test_a_rate_is_commanded_that_brings_what_acts_where_it_is_to_be(angle: float, turn: float) -> None:
    known = Disturbance(steering=-0.03, turn=turn)
    acting = known.acting_steering(angle)
    rate = known.commanded_rate(0.4, acting, 0.05)
    assert known.acting_steering(angle + 0.05 * rate) == pytest.approx(acting + 0.02)
    assert 0.4 / abs(rate) >= min(turn, 1.0 / turn) - 1e-12


def test_without_anything_that_acts_nothing_is_changed() -> None:
    assert UNDISTURBED.acting_steering(0.3) == UNDISTURBED.measured_steering(0.3) == 0.3
    assert UNDISTURBED.commanded_rate(0.3, 0.1, 0.05) == 0.3


def test_to_turn_too_tightly_is_to_have_a_shorter_wheelbase() -> None:
    queue = (QueuedCommand(0.0, 0.5, 0.8), QueuedCommand(0.1, -0.2, -0.5))
    state = np.array([1.0, -2.0, 0.3, 1.5, 0.2, 0.0])
    got = roll_forward(state, queue, 0.0, 0.3, VEHICLE, Disturbance(turn=1.1))
    expected = roll_forward(state, queue, 0.0, 0.3, VEHICLE.changed(vehicle={"wheelbase": WHEELBASE / 1.1}))
    np.testing.assert_allclose(got, expected, atol=2e-5)
    assert got[DELTA] == expected[DELTA]
