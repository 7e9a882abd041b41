"""Dead time: what the vehicle will be doing when a command given now begins to act."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from rti_mpcc.model.bicycle import step_one
from rti_mpcc.model.disturbance import UNDISTURBED, Disturbance
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
    disturbance: Disturbance = UNDISTURBED,
) -> Array:
    """The state (6,) at `until`, driven from `state` (6,) at `now` by the queued commands.

    Args:
        queue: ordered by `begins`; before the first one nothing acts.
        wheelbase: [m]; steering: the mechanical stop of the steering [rad].
        disturbance: what acts besides, see (O4); both states have the steering that is measured.
    """
    edges = [now, *(c.begins for c in queue if now < c.begins < until), until]
    d, o, gain = disturbance
    reached: tuple[float, ...] = tuple(disturbance.effective(state).tolist())
    for begin, end in pairwise(edges):
        acting = [c for c in queue if c.begins <= begin]
        seconds = end - begin
        if seconds <= 0.0:
            continue
        a, rate = (acting[-1].acceleration, acting[-1].steering_rate) if acting else (0.0, 0.0)
        delta = reached[DELTA] - o
        turned = min(max(delta + rate * seconds, min(-steering, delta)), max(steering, delta))
        reached = step_one(reached, (gain * a + d, (turned - delta) / seconds, 0.0), seconds, wheelbase)
    return disturbance.measured(np.array(reached))


def still_acting(queue: Sequence[QueuedCommand], now: float) -> tuple[QueuedCommand, ...]:
    """The queue without commands that another one has replaced by `now`."""
    later = [c for c in queue if c.begins > now]
    acting = [c for c in queue if c.begins <= now]
    return (*acting[-1:], *later)


def queued(queue: Sequence[QueuedCommand], sent: QueuedCommand, now: float) -> tuple[QueuedCommand, ...]:
    """The queue with the command sent at `now`, the last to begin."""
    return (*still_acting(queue, now), sent)


def mean_acceleration(queue: Sequence[QueuedCommand], begin: float, end: float) -> float:
    """Mean of what the queued commands ask for from `begin` to `end` [s] [m/s²]; before the first one 0."""
    if end <= begin:
        return 0.0
    edges = [begin, *(c.begins for c in queue if begin < c.begins < end), end]
    gained = 0.0
    for earlier, later in pairwise(edges):
        acting = [c for c in queue if c.begins <= earlier]
        gained += (later - earlier) * (acting[-1].acceleration if acting else 0.0)
    return gained / (end - begin)
