"""Dead time: what the vehicle will be doing when a command given now begins to act."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from itertools import chain
from operator import attrgetter
from typing import NamedTuple

import numpy as np

from geometry.compiled import Array2, Out2, kernel
from rti_mpcc.config import ControllerConfig
from rti_mpcc.model.bicycle import propagate
from rti_mpcc.model.disturbance import UNDISTURBED, Disturbance, acting_steering
from rti_mpcc.model.layout import CONTROLS, DELTA, DELTA_DOT, STATES, A
from rti_mpcc.types import Array


class QueuedCommand(NamedTuple):
    """A command on its way to the actuators: it acts from `begins` [s] on, until the next one does."""

    begins: float
    acceleration: float
    steering_rate: float


def roll_forward(
    states: Array,
    queue: Sequence[QueuedCommand],
    now: float,
    until: float,
    config: ControllerConfig,
    disturbance: Disturbance = UNDISTURBED,
) -> Array:
    """One state (6,), or several (n, 6), at `until`, driven from `now` on by the queued commands, (D1).

    Args:
        queue: ordered by `begins`; before the first one nothing acts.
        config: with the wheelbase, and the mechanical stop of the steering.
        disturbance: what acts besides, see (O4); all states have the steering that is measured.
    """
    columns = len(QueuedCommand._fields)
    numbers = np.fromiter(chain.from_iterable(queue), np.float64, columns * len(queue))
    reached, most, wheelbase = states.copy(), config.limits.steering, config.vehicle.wheelbase
    rows = reached.reshape(-1, STATES)
    _roll_forward(numbers.reshape(-1, columns), (now, until), disturbance, most, wheelbase, rows)
    return reached


@kernel
def _roll_forward(
    commands: Array2, span: tuple[float, float], disturbance: Disturbance, most: float, wheelbase: float,
    states: Out2,
) -> None:  # fmt: skip
    """Drive all states on over a `span` of time, by (O4) and (M1), from one command's begin to the next's.

    Their steering is the measured one, on the way the one that acts.
    """
    control = np.zeros(CONTROLS)
    for state in states:
        (begin, until), coming = span, 0
        delta = state[DELTA]
        state[DELTA] = acting_steering(disturbance, delta)
        while begin < until:
            while coming < len(commands) and commands[coming, 0] <= begin:
                coming += 1
            end = min(commands[coming, 0], until) if coming < len(commands) else until
            a = commands[coming - 1, 1] if coming > 0 else 0.0
            rate = commands[coming - 1, 2] if coming > 0 else 0.0
            seconds = end - begin
            delta = min(max(delta + rate * seconds, min(-most, delta)), max(most, delta))
            control[A] = disturbance.gain * a + disturbance.acceleration
            control[DELTA_DOT] = (acting_steering(disturbance, delta) - state[DELTA]) / seconds
            propagate(state, control, seconds, wheelbase, state)
            begin = end
        state[DELTA] = delta


def still_acting(queue: Sequence[QueuedCommand], now: float) -> tuple[QueuedCommand, ...]:
    """The queue without commands that another one has replaced by `now`."""
    begun = bisect_right(queue, now, key=attrgetter("begins"))
    return tuple(queue[max(begun - 1, 0) :])


def mean_rates(queue: Sequence[QueuedCommand], begin: float, end: float) -> tuple[float, float]:
    """Mean acceleration [m/s²] and steering rate [rad/s] that act from `begin` to `end` [s]; before the first
    command 0."""
    if end <= begin:
        return 0.0, 0.0
    speed, steering, ends = 0.0, 0.0, end  # each acts until the next one begins
    for command in reversed(queue):
        begins = max(command.begins, begin)
        if begins < ends:
            speed += (ends - begins) * command.acceleration
            steering += (ends - begins) * command.steering_rate
            ends = begins
    return speed / (end - begin), steering / (end - begin)
