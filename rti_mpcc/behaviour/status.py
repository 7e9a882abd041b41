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
    Reason.STANDS_BEFORE_SOMETHING: Status.BLOCKED,
    Reason.LOOKS_SOON: Status.FAILED,
    Reason.GOAL_UNCERTAIN: Status.GOAL_LOST,
    Reason.LATE: Status.STARTING,
    Reason.TURNS_WHEELS: Status.STARTING,
    Reason.SEARCHES_PLAN: Status.STARTING,
    Reason.SETTLES: Status.SETTLING,
    Reason.STANDS_AT_CUSP: Status.CHANGING_DIRECTION,
    Reason.STANDS_AT_STAGING_POSE: Status.CHANGING_DIRECTION,
    Reason.STANDS_AT_WAY_BACK_END: Status.CHANGING_DIRECTION,
    Reason.NOT_DETECTED: Status.SEARCHING,
    Reason.DOCKED: Status.DOCKED,
    Reason.STALLED: Status.STALLED,
    Reason.PLANS_WAY: Status.PLANNING,
    Reason.NO_WAY: Status.STALLED,
}
"""Of all verdicts but those that drive a plan."""
_AS_PULLING_OUT = (
    Status.FOLLOWING,
    Status.ARRIVING,
    Status.SETTLING,
    Status.STARTING,
    Status.CHANGING_DIRECTION,
    Status.STALLED,
)
"""What is not said of a way back: it has one status of its own."""


@dataclass(frozen=True, slots=True)
class Verdict:
    """What a cycle came to.

    Attributes:
        reason: why; detail: what its message tells.
        pull_out: it is on, or just before, the way back that is driven for the first or second time; 0: none.
    """

    reason: Reason
    detail: str = ""
    pull_out: int = 0

    def __str__(self) -> str:
        said = [self.reason.message.format(self.detail)]
        if self.pull_out:
            said.append(f"pulling out, to come again ({self.pull_out}. time)")
        return "; ".join(filter(None, said))


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
    if verdict.pull_out and status in _AS_PULLING_OUT:
        return Status.PULLING_OUT
    return status
