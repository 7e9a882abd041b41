"""What detections up to some time say about the goal, as a value, and how far others are from it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from estimation.measurement import Detection
from estimation.types import Array, Judgement
from geometry import lift, wrap


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Recent:
    """A detection of the last moments, and what was believed before it."""

    detection: Detection
    before: Belief | None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Belief:
    """What the detections up to `time` [s] say.

    Attributes:
        mean: (n,) x, y, heading and for a moving goal their rates; None before the goal was seen.
        covariance: (n, n); seen_at: stamp of the last accepted detection [s].
        recent: the detections of the last moments, accepted or not, by stamp.
        judged: the last detection set against a prediction.
    """

    time: float
    mean: Array | None = None
    covariance: Array | None = None
    seen_at: float | None = None
    recent: tuple[Recent, ...] = ()
    judged: Judgement | None = None


def innovation_of(mean: Array, covariance: Array, detection: Detection) -> tuple[Array, float]:
    """Detection minus mean (3,), heading on the mean's branch, and its square in units of S = H P H' + R."""
    innovation = detection.value - mean[:3]
    innovation[2] = lift(float(detection.value[2]), float(mean[2])) - mean[2]
    innovation.flags.writeable = False
    spread = covariance[:3, :3] + detection.covariance
    return innovation, float(innovation @ np.linalg.solve(spread, innovation))


def innovations(mean: Array, detections: Sequence[Detection]) -> Array:
    """Detections minus a mean (n,), of a moving goal too, headings on its branch: (k, 3)."""
    values = np.array([detection.value for detection in detections])
    predicted = mean[:3]
    if len(mean) > 3:
        seconds = np.array([detection.stamp for detection in detections]) - detections[-1].stamp
        predicted = predicted + seconds[:, None] * mean[3:]
    innovations = values - predicted
    innovations[:, 2] = wrap(innovations[:, 2])
    return innovations


def contradiction(mean: Array, covariance: Array, detections: Sequence[Detection]) -> float:
    """How far the weighted mean of detections is from what is believed at the last one's stamp, Eq. (E5).

    Squared, in units of the sum of both covariances: chi-square of 3 if the goal has not moved.
    """
    weights = np.linalg.inv(np.array([detection.covariance for detection in detections]))
    spread = np.linalg.inv(weights.sum(axis=0))
    average = spread @ np.einsum("kij,kj->i", weights, innovations(mean, detections))
    return float(average @ np.linalg.solve(spread + covariance[:3, :3], average))


def prevailing(recent: Sequence[Recent], agreeing: Sequence[Recent], count: int) -> Sequence[Recent]:
    """The longest run up to the last of those that agree, `count` at least; empty if there is none.

    At least half of all detections in that time have to be in it: among enough outliers, two agree by chance.
    """
    for k in range(len(agreeing) - count + 1):
        first = agreeing[k].detection.stamp
        since = sum(one.detection.stamp >= first for one in recent)
        if 2 * (len(agreeing) - k) >= since:
            return agreeing[k:]
    return ()


def bare(belief: Belief) -> Belief:
    """Without its past, which would hold the whole run."""
    return replace(belief, recent=(), judged=None)


def shifted(belief: Belief, seconds: float) -> Belief:
    """The same belief on a clock that was set by `seconds`; recent detections are forgotten."""
    if belief.mean is None:
        return Belief(time=-np.inf)
    assert belief.seen_at is not None
    return replace(belief, time=belief.time + seconds, seen_at=belief.seen_at + seconds, recent=())
