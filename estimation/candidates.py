"""Rejected detections: when they agree well enough with each other to be the goal after all."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from estimation.measurement import Detection
from estimation.settings import GoalFilterConfig
from geometry import wrap

KEPT = 5.0
"""So long rejected detections are kept [s]."""


def still_kept(rejected: Sequence[Detection], now: float) -> tuple[Detection, ...]:
    """Those that are not too old at `now` [s]."""
    return tuple(one for one in rejected if now - one.stamp <= KEPT)


def agreeing(
    waiting: Sequence[Detection], newest: Detection, config: GoalFilterConfig, gate: float
) -> list[Detection]:
    """Those that may have seen the goal where the newest one did, and that one, by stamp.

    Two agree if their difference d passes the filter's gate, d' (R1 + R2 + W)^-1 d <= `gate`, W the
    covariance (diagonal) by which a goal may have moved between them.
    """
    if not waiting:
        return [newest]
    c = config
    seconds = newest.stamp - np.array([[one.stamp] for one in waiting])
    moved = np.square([c.position_drift, c.position_drift, c.heading_drift]) * seconds
    if c.moving:
        moved += np.square([c.velocity_std, c.velocity_std, c.turn_rate_std]) * seconds**2
        moved += np.square([c.velocity_drift, c.velocity_drift, c.turn_rate_drift]) * seconds**3 / 3.0
    spread = newest.covariance + np.array([one.covariance for one in waiting])
    spread[:, range(3), range(3)] += moved
    apart = newest.value - np.array([one.value for one in waiting])
    apart[:, 2] = wrap(apart[:, 2])
    distances = (apart * np.linalg.solve(spread, apart[..., None])[..., 0]).sum(axis=1)
    return [one for one, distance in zip(waiting, distances, strict=True) if distance <= gate] + [newest]


def prevailing(
    waiting: Sequence[Detection], agreed: Sequence[Detection], *, count: int, seconds: float
) -> Sequence[Detection]:
    """The longest run of those that agree, of `count` at least and over `seconds` [s]; empty if none is.

    At least half of all that were rejected in that time have to be in it: among enough outliers, two agree
    by chance.
    """
    for k, first in enumerate(agreed):
        if len(agreed) - k < count or agreed[-1].stamp - first.stamp < seconds:
            break
        since = 1 + sum(one.stamp >= first.stamp for one in waiting)
        if 2 * (len(agreed) - k) >= since:
            return agreed[k:]
    return ()
