"""The outcome of a step at the end of a cycle."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

from rti_mpcc.config import MissionSettings
from rti_mpcc.planning.agenda import Agenda
from rti_mpcc.steps import Straight, Wait
from rti_mpcc.types import Command, MissionResult, Reason, Status

TROUBLE = {
    Status.STALLED: MissionResult.NOT_REACHED,
    Status.GOAL_BEHIND: MissionResult.NOT_REACHED,
    Status.FAILED: MissionResult.NOT_REACHED,
    Status.GOAL_REJECTED: MissionResult.NOT_REACHED,
    Status.BLOCKED: MissionResult.BLOCKED,
    Status.SEARCHING: MissionResult.NOT_DETECTED,
    Status.GOAL_LOST: MissionResult.NOT_DETECTED,
}
"""Result of a step whose status stays like this."""
UNDECIDED = (Status.PLANNING, Status.STARTING)
"""They follow on trouble, and on none: what was known before holds."""


class StepOutcome(NamedTuple):
    """Result of a step, and why, or ""; the agenda with what was noted of it."""

    agenda: Agenda
    result: MissionResult
    reason: str = ""


def judge_step(
    agenda: Agenda, command: Command, signal: bool, now: float, settings: MissionSettings
) -> StepOutcome:
    """The outcome of the step that is under way.

    Args:
        command: of this cycle; signal: whether `until` of the step says that it is over.
        now: on the controller's own clock [s].
    """
    step, started = agenda.step, agenda.begun
    assert step is not None
    assert started is not None
    if isinstance(step, Wait):
        if signal or (step.seconds is not None and now - started >= step.seconds):
            return StepOutcome(agenda, MissionResult.SUCCEEDED)
    else:
        agenda = _noted(agenda, command, now)
        if isinstance(step, Straight) and signal:
            return StepOutcome(agenda, MissionResult.SUCCEEDED, "ended by its signal")
        if agenda.docked_since is not None and now - agenda.docked_since >= settings.settled:
            return StepOutcome(agenda, MissionResult.SUCCEEDED)
        reason = command.diagnostics.reason
        if command.diagnostics.cause is Reason.NO_WAY and len(agenda.ways_out) > 1:
            return StepOutcome(agenda, MissionResult.NOT_REACHED, reason)
        if agenda.trouble is not None and now - agenda.trouble_since >= step.patience:
            return StepOutcome(agenda, agenda.trouble, reason)
    if now - started >= step.timeout:
        return StepOutcome(agenda, MissionResult.TIMED_OUT, f"not over after {step.timeout:g} s")
    return StepOutcome(agenda, MissionResult.RUNNING)


def _noted(agenda: Agenda, command: Command, now: float) -> Agenda:
    """With the time since which the vehicle stands at the end of the step, or makes no progress."""
    since = agenda.docked_since if agenda.docked_since is not None else now
    agenda = replace(agenda, docked_since=since if command.docked else None)
    trouble = TROUBLE.get(command.status)
    if trouble is not None:
        since = now if agenda.trouble is None else agenda.trouble_since
        return replace(agenda, trouble=trouble, trouble_since=since)
    if command.status in UNDECIDED and command.diagnostics.cause is not Reason.TURNS_WHEELS:
        return agenda
    return replace(agenda, trouble=None)
