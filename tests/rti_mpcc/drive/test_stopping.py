from __future__ import annotations

import numpy as np
import pytest

from rti_mpcc.drive.fallback import stopping_motion
from rti_mpcc.types import Array
from tests.rti_mpcc.model_steps import step

WHEELBASE = 2.875


def integrated(state: Array, until: float, deceleration: float) -> Array:
    """The same motion by the model in 2000 small steps."""
    moving = min(until, abs(state[3]) / deceleration)
    steps = 2000
    control = np.array([[-np.sign(state[3]) * deceleration, 0.0, 0.0]])
    for _ in range(steps):
        state = step(state[None], control, np.array([moving / steps]), WHEELBASE)[0]
    return state


@pytest.mark.parametrize("delta", [0.0, 1e-9, 0.3, -0.6])
@pytest.mark.parametrize("speed", [3.0, -1.2])
@pytest.mark.parametrize("until", [0.7, 2.0, 9.0])
def test_it_is_the_models_motion(until: float, speed: float, delta: float) -> None:
    state = np.array([5.0, -2.0, 1.1, speed, delta, 7.0])
    motion = stopping_motion(state, np.array([2.0, 2.0 + until]), 0.8, WHEELBASE)
    np.testing.assert_allclose(motion.states[0], state)
    expected = integrated(state, until, 0.8)
    np.testing.assert_allclose(motion.states[-1, :5], expected[:5], atol=1e-8)
    travelled = abs(speed) * min(until, abs(speed) / 0.8) - 0.4 * min(until, abs(speed) / 0.8) ** 2
    assert motion.states[-1, 5] == pytest.approx(7.0 + travelled)


def test_at_rest_it_stays_where_it_is() -> None:
    state = np.array([5.0, -2.0, 1.1, 0.0, 0.2, 7.0])
    motion = stopping_motion(state, np.linspace(0.0, 3.0, 31), 0.8, WHEELBASE)
    np.testing.assert_array_equal(motion.states, np.tile(state, (31, 1)))
    np.testing.assert_array_equal(motion.controls, 0.0)


def test_speed_and_acceleration_agree_and_nothing_can_be_written() -> None:
    times = np.linspace(0.0, 4.0, 41)
    motion = stopping_motion(np.array([0.0, 0.0, 0.0, 2.0, 0.1, 0.0]), times, 0.8, WHEELBASE)
    np.testing.assert_allclose(np.diff(motion.states[:, 3]), 0.1 * motion.controls[:, 0])
    assert motion.states[:, 3].min() >= 0.0
    assert not motion.states.flags.writeable
    assert not motion.controls.flags.writeable
