"""The outcome of a step at the end of a cycle, and what follows: the next one, the same once more, the route
home, or nothing."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

from rti_mpcc.config import MissionSettings
from rti_mpcc.mission.start import order_to_undock
from rti_mpcc.orders import Order, Stand
from rti_mpcc.planning.agenda import Agenda, Due
from rti_mpcc.steps import AnyStep, Dock, DriveTo, Straight, Undock, Wait
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


class Next(NamedTuple):
    """The agenda after a step has ended, and the order that ends it, or None."""

    agenda: Agenda
    order: Order | None = None


def advance_mission(
    outcome: StepOutcome, steps: tuple[AnyStep, ...], home: DriveTo | None, direction: int, now: float,
    back_off: float,
) -> Next:  # fmt: skip
    """Advance a mission after a cycle with this outcome.

    Args:
        steps: of the mission; home: where to drive after a failure that asks for it.
        direction: +1 or -1, in which the vehicle drove last; now: on the controller's own clock [s].
        back_off: least distance [m] that a vehicle drives out of a dock before it tries again.
    """
    if outcome.result is MissionResult.RUNNING:
        return Next(outcome.agenda)
    agenda, step = _closed(outcome, now), outcome.agenda.step
    if outcome.result is MissionResult.SUCCEEDED:
        berth = agenda.berth
        if isinstance(step, Dock) and berth is not None:
            agenda = replace(agenda, berth=replace(berth, reached=True, came=direction))
        elif isinstance(step, Undock):
            agenda = agenda.at(None)
        agenda = replace(agenda, due=agenda.due[1:])
        if not agenda.due and agenda.result is MissionResult.RUNNING:
            agenda = replace(agenda, result=MissionResult.SUCCEEDED)
        return Next(agenda, Stand(at_once=True) if isinstance(step, Straight) else None)
    unreached = outcome.result in (MissionResult.NOT_REACHED, MissionResult.BLOCKED)
    if len(outcome.agenda.ways_out) > 1 and unreached:
        left, log = outcome.agenda.ways_out[1:], outcome.agenda.log
        record = replace(log[-1], goal=left[0])
        agenda = replace(outcome.agenda, ways_out=left, trouble=None, log=(*log[:-1], record))
        return Next(agenda, order_to_undock(left[0]))
    return Next(_after_failure(agenda, outcome.result, steps, home, back_off), Stand())


def end_mission(agenda: Agenda, result: MissionResult, reason: str, now: float) -> Next:
    """End it, with all that is left of it: the vehicle stops as soon as possible."""
    closed = _closed(StepOutcome(agenda, result, reason), now)
    return Next(replace(closed, due=(), result=result, reason=reason), Stand(at_once=True))


def _after_failure(
    agenda: Agenda, result: MissionResult, steps: tuple[AnyStep, ...], home: DriveTo | None, back_off: float
) -> Agenda:
    due = agenda.due[0]
    if due.attempt < due.step.retries:
        return replace(agenda, due=_again(agenda, steps, back_off))
    if due.step.then == "continue" and len(agenda.due) > 1:
        return replace(agenda, due=agenda.due[1:])
    left: tuple[Due, ...] = ()
    if due.step.then == "home" and home is not None and due.step is not home:
        left = (Due(step=home, place=due.place),)
    return replace(
        agenda, due=left, result=result if agenda.result is MissionResult.RUNNING else agenda.result
    )


def _again(agenda: Agenda, steps: tuple[AnyStep, ...], back_off: float) -> tuple[Due, ...]:
    """The steps that are due if the first one is tried once more; a dock is driven out of first."""
    due, *later = agenda.due
    place = due.place if due.step.retry_from is None else due.step.retry_from
    repeated = [Due(step=steps[k], place=k) for k in range(place, due.place)]
    again = [*repeated, replace(due, attempt=due.attempt + 1)]
    berth, first = agenda.berth, again[0].step
    if isinstance(first, Dock) and berth is not None:
        if berth.place == place:
            again[0] = replace(again[0], step=replace(first, pose=first.pose or berth.pose))
        approach = first.approach
        incoming = berth.came or (0 if approach is None else approach.direction)
        if incoming and berth.reached:
            distance = -incoming * (back_off if approach is None else max(approach.length, back_off))
            again.insert(0, Due(step=Undock(distance, then="continue"), place=place))
    return (*again, *later)


def _closed(outcome: StepOutcome, now: float) -> Agenda:
    """With the record of the step that has ended, and nothing else of it."""
    agenda = outcome.agenda
    if agenda.begun is None:
        return agenda
    record = replace(agenda.log[-1], end=now, result=outcome.result, reason=outcome.reason)
    return replace(
        agenda,
        begun=None,
        docked_since=None,
        trouble=None,
        ways_out=(),
        reason=outcome.reason,
        log=(*agenda.log[:-1], record),
    )
