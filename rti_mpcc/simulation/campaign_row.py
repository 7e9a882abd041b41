"""One row for each case of a campaign, the same on each machine and by any number of workers.

What was timed is kept apart from it, for another file.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from enum import Enum
from typing import Any

import numpy as np

from rti_mpcc.simulation.batch import DrivenCase
from rti_mpcc.simulation.metrics import untimed
from rti_mpcc.simulation.result import Cycles, RunResult
from rti_mpcc.types import Source, Status

Drawn = Mapping[str, Any]
"""What was drawn of a case: its `course` and `disturbances`."""


class CaseOutcome(Enum):
    """How a case ended; the worst last."""

    DOCKED = "docked"
    """Inside tolerance of the true goal and standing, and so at the end; and the controller says so."""
    UNCONFIRMED = "unconfirmed"
    """Docked, but the controller does not say so."""
    UNFINISHED = "unfinished"
    """The time ran out."""
    STALLED = "stalled"
    """The controller said so, and stood."""
    FAILED = "failed"
    """The controller had no plan, and stood."""
    RAISED = "raised"
    """An exception: an internal error."""
    WORKER_DIED = "worker_died"
    """The process that drove the case ended."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CampaignRow:
    """One case.

    Attributes:
        index: of the case; scenario: its name.
        outcome: how it ended; detail: of what did not dock, the controller's last reason, or the exception.
        course, disturbances: what was drawn, by name; None where it could not be.
        figures: of `metrics.summary` but those that are timed, with cycles_by_status (counts) and
            failures_driven (see there); None where nothing was driven to its end.
        timed: cycle_ms and deadline_misses as in summary.json; misses, these by status; planning_s, the time
            of all searches [s]. No part of `table`.
    """

    index: int
    scenario: str
    outcome: CaseOutcome
    detail: str
    course: Mapping[str, Any] | None = None
    disturbances: Mapping[str, Any] | None = None
    figures: Mapping[str, Any] | None = None
    timed: Mapping[str, Any] | None = None

    def table(self) -> dict[str, Any]:
        """The row for JSON, without what was timed."""
        table = asdict(self) | {"outcome": self.outcome.value}
        del table["timed"]
        return table


def row_of(index: int, driven: DrivenCase, drawn: Drawn) -> CampaignRow:
    """The row of a case that was driven."""
    result, cycles = driven.result, driven.result.cycles
    statuses = Counter(status.value for status in cycles.status)
    counts = {"cycles_by_status": dict(sorted(statuses.items())), "failures_driven": failures_driven(cycles)}
    outcome = outcome_of(result, docked=driven.figures["docked"])
    reasons = [] if outcome is CaseOutcome.DOCKED else [reason for reason in cycles.reason if reason]
    timed = {name: driven.figures[name] for name in ("cycle_ms", "deadline_misses")}
    timed["misses"] = Counter(status.value for status in cycles.status[cycles.deadline_missed])
    return CampaignRow(
        index=index,
        scenario=result.scenario.name,
        outcome=outcome,
        detail=reasons[-1] if reasons else "",
        **drawn,
        figures={**untimed(driven.figures), **counts},
        timed={**timed, "planning_s": None if result.planning is None else result.planning.seconds},
    )


def outcome_of(result: RunResult, *, docked: bool) -> CaseOutcome:
    """How a run ended, by its figures and the controller's last status."""
    last = result.cycles.status[-1] if len(result.cycles) else None
    if docked:
        return CaseOutcome.DOCKED if last is Status.DOCKED else CaseOutcome.UNCONFIRMED
    if result.ended != "stopped":
        return CaseOutcome.UNFINISHED
    return CaseOutcome.FAILED if last is Status.FAILED else CaseOutcome.STALLED


def failures_driven(cycles: Cycles) -> int:
    """Cycles whose QP was refused and whose command is its solution all the same: there must be none."""
    driven = np.array([source is Source.SOLUTION for source in cycles.source], dtype=np.bool_)
    return int(np.count_nonzero(cycles.failed & driven))
