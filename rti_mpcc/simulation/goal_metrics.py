"""How well the goal was known in a run: poses against the true goal, and the figures of its detections."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from estimation import GoalStatus, Judgement, Outcome
from geometry import wrap
from rti_mpcc.simulation.goal_feed import GoalSource
from rti_mpcc.simulation.plant import SAME_TIME
from rti_mpcc.simulation.result import RunResult, Tracking, Truth
from rti_mpcc.types import Array


def errors_to(goals: Array, poses: Array) -> Array:
    """(n, 3) longitudinal [m], lateral [m], heading [rad]: poses (n, 3) in the frames of goals (n, 3)."""
    difference = poses - goals
    c, s = np.cos(goals[:, 2]), np.sin(goals[:, 2])
    longitudinal = c * difference[:, 0] + s * difference[:, 1]
    lateral = -s * difference[:, 0] + c * difference[:, 1]
    return np.stack([longitudinal, lateral, wrap(difference[:, 2])], axis=-1)


def rows_at(truth: Truth, times: Array) -> NDArray[np.int64]:
    """(k,) the sample of the truth at each of `times` (k,) [s], or the first after it."""
    rows = np.searchsorted(truth.times, times - SAME_TIME)
    return np.minimum(rows, len(truth.times) - 1).astype(np.int64)


def goal_summary(result: RunResult) -> dict[str, Any] | None:
    """The figures of how the goal was known, SI units; None in a run without a detector.

    What a filter did is None where there was none in use: with another source than detections.
    """
    tracking = result.tracking
    if tracking is None:
        return None
    filtered = result.goal_source is GoalSource.DETECTED
    return {
        "source": result.goal_source.value,
        **(_counts(tracking.detections) if filtered else dict.fromkeys(_COUNTED)),
        "first_seen_s": _first_seen(tracking, result.cycles.times),
        "estimate_error": _last_error(tracking, result.cycles.times, result.truth),
        "mean_nis": _mean_nis(tracking.detections),
        "final_status": _final_status(tracking),
    }


_COUNTED = ("detections", "accepted", "rejected", "refused")


def _counts(detections: Sequence[Judgement]) -> dict[str, int]:
    """How many detections arrived, and what became of them; one that the estimate began from is accepted."""
    outcomes = [judged.outcome for judged in detections]
    accepted = sum(judged.accepted for judged in detections)
    counts = (len(outcomes), accepted, outcomes.count(Outcome.REJECTED), outcomes.count(Outcome.REFUSED))
    return dict(zip(_COUNTED, counts, strict=True))


def _first_seen(tracking: Tracking, times: Array) -> float | None:
    """Time of the first cycle that had an estimate [s]."""
    for time, status in zip(times.tolist(), tracking.status, strict=True):
        if status not in (None, GoalStatus.SEARCHING):
            return float(time)
    return None


def _last_error(tracking: Tracking, times: Array, truth: Truth) -> dict[str, float | None]:
    """The last estimate against the true goal at that time."""
    names = ("longitudinal_m", "lateral_m", "heading_rad")
    known = np.flatnonzero(np.isfinite(tracking.estimates).all(axis=1))
    if not len(known):
        return dict.fromkeys(names)
    last = known[-1:]
    (error,) = errors_to(truth.goals[rows_at(truth, times[last])], tracking.estimates[last]).tolist()
    return dict(zip(names, error, strict=True))


def _mean_nis(detections: Sequence[Judgement]) -> float | None:
    """Mean normalised innovation squared of what passed the gate; 3 where the filter knows its noise."""
    values = [judged.nis for judged in detections if judged.outcome is Outcome.ACCEPTED]
    found = [nis for nis in values if nis is not None]
    return float(np.mean(found)) if found else None


def _final_status(tracking: Tracking) -> str | None:
    last = tracking.status[-1] if tracking.status else None
    return None if last is None else last.value
