"""What a step has come to by the end of a cycle."""

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
"""What a step comes to that goes on like this."""
UNDECIDED = (Status.PLANNING, Status.STARTING)
"""They follow on trouble, and on none: what was known before holds."""


class Outcome(NamedTuple):
    """What a step has come to, and why, or ""; the agenda with what was seen of it."""

    agenda: Agenda
    result: MissionResult
    reason: str = ""


def outcome(agenda: Agenda, command: Command, signal: bool, now: float, settings: MissionSettings) -> Outcome:
    """What the step that is under way has come to.

    Args:
        command: of this cycle; signal: what tells that a wait or a straight move is over has done so.
        now: on the controller's own clock [s].
    """
    step, begun = agenda.step, agenda.begun
    assert step is not None
    assert begun is not None
    if isinstance(step, Wait):
        over = signal or (step.seconds is not None and now - begun >= step.seconds)
        return _unless_late(Outcome(agenda, MissionResult.SUCCEEDED if over else MissionResult.RUNNING), now)
    agenda = _noted(agenda, command, now)
    if isinstance(step, Straight) and signal:
        return Outcome(agenda, MissionResult.SUCCEEDED, "it was told to stop")
    if agenda.docked_since is not None and now - agenda.docked_since >= settings.settled:
        return Outcome(agenda, MissionResult.SUCCEEDED)
    if command.diagnostics.cause is Reason.NO_WAY and len(agenda.ways_out) > 1:
        return Outcome(agenda, MissionResult.NOT_REACHED, command.diagnostics.reason)
    if agenda.trouble is not None and now - agenda.trouble_since >= step.patience:
        return Outcome(agenda, agenda.trouble, command.diagnostics.reason)
    return _unless_late(Outcome(agenda, MissionResult.RUNNING), now)


def _unless_late(found: Outcome, now: float) -> Outcome:
    step, begun = found.agenda.step, found.agenda.begun
    assert step is not None
    assert begun is not None
    if found.result is MissionResult.RUNNING and now - begun >= step.timeout:
        return found._replace(result=MissionResult.TIMED_OUT, reason=f"it took {step.timeout:g} s")
    return found


def _noted(agenda: Agenda, command: Command, now: float) -> Agenda:
    """With since when the vehicle stands where the step ends, or does not get on."""
    since = agenda.docked_since if agenda.docked_since is not None else now
    agenda = replace(agenda, docked_since=since if command.docked else None)
    trouble = TROUBLE.get(command.status)
    if trouble is not None:
        if agenda.trouble is None:
            agenda = replace(agenda, trouble_since=now)
        return replace(agenda, trouble=trouble)
    if command.status in UNDECIDED and command.diagnostics.cause is not Reason.TURNS_WHEELS:
        return agenda
    return replace(agenda, trouble=None)
