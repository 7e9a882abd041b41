"""From what a cycle came to, to its status: the one place where statuses are chosen."""

from __future__ import annotations

from dataclasses import dataclass

from rti_mpcc.planning.state import Task
from rti_mpcc.types import Objective, Reason, Status

STATUS_OF = {
    Reason.STATE_DOUBTED: Status.FAILED,
    Reason.NO_PLAN: Status.FAILED,
    Reason.MISTAKE: Status.FAILED,
    Reason.OVERLAP: Status.BLOCKED,
    Reason.CREEPS_OUT: Status.BLOCKED,
    Reason.CONTACT_AHEAD: Status.BLOCKED,
    Reason.WAITS_UNTIL_CLEAR: Status.BLOCKED,
    Reason.OUT_OF_TIME: Status.FAILED,
    Reason.STANDS_BEFORE_SOMETHING: Status.BLOCKED,
    Reason.LOOKS_SOON: Status.FAILED,
    Reason.GOAL_UNCERTAIN: Status.GOAL_LOST,
    Reason.LATE: Status.STARTING,
    Reason.TURNS_WHEELS: Status.STARTING,
    Reason.SEARCHES_PLAN: Status.STARTING,
    Reason.SETTLES: Status.SETTLING,
    Reason.STANDS_AT_CUSP: Status.CHANGING_DIRECTION,
    Reason.GOAL_REJECTED: Status.GOAL_REJECTED,
    Reason.NOT_DETECTED: Status.SEARCHING,
    Reason.DOCKED: Status.DOCKED,
    Reason.STALLED: Status.STALLED,
    Reason.GOAL_BEHIND: Status.GOAL_BEHIND,
    Reason.TOLD_TO_STAND: Status.WAITING,
    Reason.PLANS_WAY: Status.PLANNING,
    Reason.NO_WAY: Status.STALLED,
}
"""Of all verdicts but those that drive a plan."""


@dataclass(frozen=True, slots=True)
class Verdict:
    """What a cycle came to: the reason, and the detail that its message tells."""

    reason: Reason
    detail: str = ""

    def __str__(self) -> str:
        return self.reason.message.format(self.detail)


def status_of(verdict: Verdict, task: Task) -> Status:
    """The status of a cycle with this verdict, after which the task is `task`."""
    status = STATUS_OF.get(verdict.reason)
    if status is None:
        status = Status.FOLLOWING if task.objective.kind is Objective.CONTOURING else Status.ARRIVING
    if verdict.reason is Reason.SEARCHES_PLAN:
        if task.latched:
            status = Status.FAILED
        elif task.looks_past:
            status = Status.BLOCKED
    return status
