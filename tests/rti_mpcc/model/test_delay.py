from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from rti_mpcc.config import ControllerConfig
from rti_mpcc.model.actuators import Disturbance, QueuedCommand, mean_rates, roll_forward, still_acting
from rti_mpcc.model.layout import DELTA, V
from rti_mpcc.types import Array
from tests.rti_mpcc.model_steps import rates

VEHICLE = ControllerConfig()
WHEELBASE, STOP = VEHICLE.vehicle.wheelbase, VEHICLE.limits.steering
STATE = np.array([1.0, -2.0, 0.5, -1.5, 0.2, 3.0])
QUEUE = (
    QueuedCommand(0.003, 0.8, 0.5),
    QueuedCommand(0.0531, -1.2, -0.9),
    QueuedCommand(0.1029, 0.3, 0.7),
    QueuedCommand(0.1537, 2.0, 0.0),
)


def fine(
    state: Array, queue: Sequence[QueuedCommand], now: float, until: float, steps: int = 20_000
) -> Array:
    """Mid-point steps, each with the command that acts in its middle; the steering stops at its stop."""
    h = (until - now) / steps
    z = state.copy()
    for i in range(steps):
        time = now + (i + 0.5) * h
        acting = [c for c in queue if c.begins <= time]
        a, rate = (acting[-1].acceleration, acting[-1].steering_rate) if acting else (0.0, 0.0)
        if (z[DELTA] >= STOP and rate > 0.0) or (z[DELTA] <= -STOP and rate < 0.0):
            rate = 0.0
        control = np.array([a, rate, 0.0])
        z = z + h * rates(z + 0.5 * h * rates(z, control, WHEELBASE), control, WHEELBASE)
    return z


@pytest.mark.parametrize("until", [0.18, 0.1537, 0.07])
def test_queue_edges_off_the_grid_of_cycles(until: float) -> None:
    got = roll_forward(STATE, QUEUE, 0.0, until, VEHICLE)
    np.testing.assert_allclose(got, fine(STATE, QUEUE, 0.0, until), atol=1e-4)
    assert got[V] == pytest.approx(
        STATE[V] + sum(_share(k, until) * c.acceleration for k, c in enumerate(QUEUE)), abs=1e-12
    )


def test_several_states_are_driven_as_each_alone() -> None:
    states = np.array((STATE, 0.5 * STATE, -STATE))
    alone = [roll_forward(each, QUEUE, 0.0, 0.18, VEHICLE) for each in states]
    np.testing.assert_array_equal(roll_forward(states, QUEUE, 0.0, 0.18, VEHICLE), alone)


def _share(k: int, until: float) -> float:
    """How long command k acts before `until` [s]."""
    end = QUEUE[k + 1].begins if k + 1 < len(QUEUE) else until
    return max(min(end, until) - QUEUE[k].begins, 0.0)


def test_nothing_acts_before_the_first_command() -> None:
    got = roll_forward(STATE, QUEUE[1:], 0.0, 0.05, VEHICLE)
    assert got[V] == STATE[V]
    assert got[DELTA] == STATE[DELTA]


def test_the_steering_does_not_pass_its_stop() -> None:
    state = STATE.copy()
    state[DELTA] = 0.55
    got = roll_forward(state, (QueuedCommand(0.0, 0.0, 1.0),), 0.0, 0.2, VEHICLE)
    assert got[DELTA] == pytest.approx(STOP)
    state[DELTA] = 0.7  # measured beyond the stop: not pushed further, free to come back
    out = roll_forward(state, (QueuedCommand(0.0, 0.0, 1.0),), 0.0, 0.2, VEHICLE)
    back = roll_forward(state, (QueuedCommand(0.0, 0.0, -1.0),), 0.0, 0.2, VEHICLE)
    assert out[DELTA] == pytest.approx(0.7)
    assert back[DELTA] == pytest.approx(0.5)


def test_commands_that_another_has_replaced_are_forgotten() -> None:
    assert still_acting(QUEUE, 0.12) == QUEUE[2:]
    assert still_acting(QUEUE, 0.0) == QUEUE
    assert still_acting((), 0.0) == ()
    before = roll_forward(STATE, QUEUE, 0.12, 0.3, VEHICLE)
    after = roll_forward(STATE, still_acting(QUEUE, 0.12), 0.12, 0.3, VEHICLE)
    np.testing.assert_array_equal(before, after)


def test_a_disturbance_acts_all_the_time_and_the_steering_stays_as_measured() -> None:
    known = Disturbance(acceleration=-0.4, steering=0.03)
    got = roll_forward(STATE, QUEUE, 0.0, 0.18, VEHICLE, known)
    pushed = tuple(
        c._replace(acceleration=c.acceleration - 0.4) for c in (QueuedCommand(0.0, 0.0, 0.0), *QUEUE)
    )
    expected = fine(known.effective(STATE), pushed, 0.0, 0.18)
    np.testing.assert_allclose(known.effective(got), expected, atol=1e-4)


def test_the_stop_is_of_the_measured_steering() -> None:
    state = np.array([0.0, 0.0, 0.0, 1.0, 0.55, 0.0])
    left = (QueuedCommand(0.0, 0.0, 1.0),)
    known = Disturbance(steering=0.05)
    out = roll_forward(state, left, 0.0, 0.2, VEHICLE, known)
    assert out[DELTA] == pytest.approx(STOP)


def test_the_mean_of_what_was_asked_for() -> None:
    asked = sum(_share(k, 0.18) * c.acceleration for k, c in enumerate(QUEUE)) / 0.18
    assert mean_rates(QUEUE, 0.0, 0.18)[0] == pytest.approx(asked)
    assert mean_rates(QUEUE, 0.06, 0.08)[0] == pytest.approx(QUEUE[1].acceleration)
    assert mean_rates((), 0.0, 0.1) == (0.0, 0.0)
    assert mean_rates(QUEUE, 0.1, 0.1)[0] == 0.0
