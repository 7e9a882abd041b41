"""How smooth a ride was: its energy against the least possible energy, its hard braking and its jerk."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from rti_mpcc.simulation.plant import SAME_TIME
from rti_mpcc.simulation.result import DOCK_TIME, STANDSTILL_SPEED, Cycles, Truth
from rti_mpcc.types import Array

TURNING_TRAVEL = 0.05  # a change of direction counts after this travel in the new one [m]
HARD = 1.1  # braking with more than this multiple of the comfort acceleration is hard
_ROUNDING = 1e-9


def turning_points(times: Array, v: Array) -> list[int]:
    """The samples of changes of direction, cusps included: the farthest in the direction before.

    Each change has `TURNING_TRAVEL` in the new direction.
    """
    turns: list[int] = []
    travel = _travel(times, v).tolist()
    direction, lowest, highest = 0, 0, 0  # samples of the extremes since the last change
    for i, distance in enumerate(travel):
        lowest = i if distance < travel[lowest] else lowest
        highest = i if distance > travel[highest] else highest
        back = direction >= 0 and travel[highest] - distance >= TURNING_TRAVEL - _ROUNDING
        forth = direction <= 0 and distance - travel[lowest] >= TURNING_TRAVEL - _ROUNDING
        if back or forth:
            if direction != 0:
                turns.append(highest if back else lowest)
            direction = -1 if back else 1
            lowest = highest = i
    return turns


def energy_bound(truth: Truth, until: float) -> float:
    """Least acceleration energy [m²/s³] of the motion up to `until` [s].

    It is 12 D² / T³ for each distance D in one direction, from rest to rest in the time T. Standing for half
    a second and more is no part of T.
    """
    samples = max(samples_until(truth.times, until), 1)
    times, v = truth.times[:samples], truth.v[:samples]
    moving = np.append(0.0, np.cumsum(np.diff(times) * ~samples_at_rest(times, v)[1:]))
    at = [0, *turning_points(times, v), samples - 1]
    distances, spans = np.abs(np.diff(_travel(times, v)[at])), np.diff(moving[at])
    some = spans > 0.0
    return float(np.sum(12.0 * distances[some] ** 2 / spans[some] ** 3))


def samples_until(times: Array, until: float | None) -> int:
    """Number of samples up to `until` [s], by default of all."""
    return len(times) if until is None else int(np.searchsorted(times, until + SAME_TIME, side="right"))


def samples_at_rest(times: Array, v: Array) -> NDArray[np.bool_]:
    """(n,) whether a sample is of a time of DOCK_TIME at least in which |v| <= STANDSTILL_SPEED."""
    found = np.zeros(len(times), dtype=np.bool_)
    for first, last in spells(np.abs(v) <= STANDSTILL_SPEED):
        found[first : last + 1] = times[last] - times[first] >= DOCK_TIME - SAME_TIME
    return found


def spells(true: NDArray[np.bool_]) -> Iterator[tuple[int, int]]:
    """First and last sample of each time without a break in which it is true."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], true, [False]]).astype(np.int64)))
    for first, behind in edges.reshape(-1, 2).tolist():
        yield first, behind - 1


def hard_braking(truth: Truth, cycles: Cycles, comfort: float, gain: float = 1.0) -> dict[str, int]:
    """Number of cycles that braked with more than `HARD` times `comfort` [m/s²], by their reason.

    `gain`: of the drive, as a weak drive makes less of a command.
    """
    speed = np.interp(cycles.times, truth.times, truth.v)
    braking = -np.sign(speed) * gain * cycles.acceleration
    hard = (braking > HARD * comfort) & (np.abs(speed) > STANDSTILL_SPEED)
    return dict(sorted(Counter(cause.value for cause in cycles.cause[hard]).items()))


def peak_jerk(cycles: Cycles, cycle: float, until: float | None, gain: float = 1.0) -> float:
    """Largest change of the commanded acceleration from a cycle to the next, times the drive's gain, over the
    time between them, up to `until` [s] (None: the whole run) [m/s³]. `cycle`: time before the first [s]."""
    count = samples_until(cycles.times, until)
    if count < 1:
        return 0.0
    # The acceleration before the first command is 0.
    changes = np.abs(np.diff(cycles.acceleration[:count], prepend=0.0))
    spans = np.diff(cycles.times[:count], prepend=cycles.times[0] - cycle)
    return float(gain * np.max(changes / spans))


def _travel(times: Array, v: Array) -> Array:
    """(n,) signed distance driven since the start [m]."""
    return np.append(0.0, np.cumsum(0.5 * (v[1:] + v[:-1]) * np.diff(times)))
