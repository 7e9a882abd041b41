"""Dead time: what the vehicle will be doing when a command given now begins to act."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from rti_mpcc.model.bicycle import step_one
from rti_mpcc.model.layout import DELTA
from rti_mpcc.types import Array


class QueuedCommand(NamedTuple):
    """A command on its way to the actuators: it acts from `begins` [s] on, until the next one does."""

    begins: float
    acceleration: float
    steering_rate: float


def roll_forward(
    state: Array,
    queue: Sequence[QueuedCommand],
    now: float,
    until: float,
    *,
    wheelbase: float,
    steering: float,
) -> Array:
    """The state (6,) at `until`, driven from `state` (6,) at `now` by the queued commands.

    Args:
        queue: ordered by `begins`; before the first one nothing acts.
        wheelbase: [m]; steering: the mechanical stop of the steering [rad].
    """
    edges = [now, *(c.begins for c in queue if now < c.begins < until), until]
    reached: tuple[float, ...] = tuple(state.tolist())
    for begin, end in pairwise(edges):
        acting = [c for c in queue if c.begins <= begin]
        seconds = end - begin
        if seconds <= 0.0:
            continue
        a, rate = (acting[-1].acceleration, acting[-1].steering_rate) if acting else (0.0, 0.0)
        delta = reached[DELTA]
        turned = min(max(delta + rate * seconds, min(-steering, delta)), max(steering, delta))
        reached = step_one(reached, (a, (turned - delta) / seconds, 0.0), seconds, wheelbase)
    return np.array(reached)


def still_acting(queue: Sequence[QueuedCommand], now: float) -> tuple[QueuedCommand, ...]:
    """The queue without commands that another one has replaced by `now`."""
    later = [c for c in queue if c.begins > now]
    acting = [c for c in queue if c.begins <= now]
    return (*acting[-1:], *later)


def queued(queue: Sequence[QueuedCommand], sent: QueuedCommand, now: float) -> tuple[QueuedCommand, ...]:
    """The queue with the command sent at `now`, the last to begin."""
    return (*still_acting(queue, now), sent)
