"""How well the goal was known in a run: poses against the true goal, and the figures of its detections."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from estimation import GoalStatus, Outcome
from geometry import wrap
from rti_mpcc.simulation.goal_feed import GoalSource
from rti_mpcc.simulation.plant import SAME_TIME
from rti_mpcc.simulation.result import RunResult, Truth
from rti_mpcc.types import Array

ERRORS = ("longitudinal_m", "lateral_m", "heading_rad")


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

    Figures of the filter are None where none was in use: with another source than detections. A detection
    that the estimate started from is accepted. The mean NIS is of what passed the gate; 3 where the filter
    knows its noise.
    """
    tracking, times = result.tracking, result.cycles.times
    if tracking is None:
        return None
    outcomes = [judged.outcome for judged in tracking.detections]
    counts = {
        "detections": len(outcomes),
        "accepted": sum(judged.accepted for judged in tracking.detections),
        "rejected": outcomes.count(Outcome.REJECTED),
        "refused": outcomes.count(Outcome.REFUSED),
    }
    known = np.flatnonzero(np.isfinite(tracking.estimates).all(axis=1))[-1:]
    error = errors_to(result.truth.goals[rows_at(result.truth, times[known])], tracking.estimates[known])
    accepted = [judged.nis for judged in tracking.detections if judged.outcome is Outcome.ACCEPTED]
    nis = [value for value in accepted if value is not None]
    unseen = (None, GoalStatus.SEARCHING)
    seen = [time for time, status in zip(times, tracking.status, strict=True) if status not in unseen]
    last = tracking.status[-1] if tracking.status else None
    return {
        "source": result.goal_source.value,
        **(counts if result.goal_source is GoalSource.DETECTED else dict.fromkeys(counts)),
        "first_seen_s": float(seen[0]) if seen else None,
        "estimate_error": dict(zip(ERRORS, error[0].tolist() if len(known) else [None] * 3, strict=True)),
        "mean_nis": float(np.mean(nis)) if nis else None,
        "final_status": None if last is None else last.value,
    }
