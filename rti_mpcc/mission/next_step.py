"""What comes after a step: the next one, the same once more, the way home, or nothing."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

from rti_mpcc.config import ControllerConfig
from rti_mpcc.mission.begin import out_to
from rti_mpcc.mission.outcome import Outcome
from rti_mpcc.orders import Order, Stand
from rti_mpcc.planning.agenda import Agenda, Due
from rti_mpcc.steps import AnyStep, Dock, DriveTo, Straight, Undock
from rti_mpcc.types import MissionResult


class Next(NamedTuple):
    """The agenda after a step has ended, and the order that ends it, or None."""

    agenda: Agenda
    order: Order | None = None


def after(
    found: Outcome,
    steps: tuple[AnyStep, ...],
    home: DriveTo | None,
    came: int,
    now: float,
    config: ControllerConfig,
) -> Next:
    """What comes after a cycle in which the step under way has come to this.

    Args:
        steps: of the mission; home: where to drive after a failure that asks for it.
        came: direction, +1 or -1, in which the vehicle drove last; now: on the controller's own clock [s].
    """
    if found.result is MissionResult.RUNNING:
        return Next(found.agenda)
    if found.result is MissionResult.SUCCEEDED:
        return _on(found, came, now)
    if len(found.agenda.ways_out) > 1 and found.result in (MissionResult.NOT_REACHED, MissionResult.BLOCKED):
        left, log = found.agenda.ways_out[1:], found.agenda.log
        record = replace(log[-1], goal=left[0])
        agenda = replace(found.agenda, ways_out=left, trouble=None, log=(*log[:-1], record))
        return Next(agenda, out_to(left[0], config))
    return _failed(found, steps, home, now, config.mission.back_off)


def ended(agenda: Agenda, result: MissionResult, reason: str, now: float) -> Next:
    """The mission is over, whatever was left of it, and the vehicle stands as soon as can be."""
    closed = _closed(Outcome(agenda, result, reason), now)
    return Next(replace(closed, due=(), result=result, reason=reason), Stand(at_once=True))


def _on(found: Outcome, came: int, now: float) -> Next:
    """The next step. One that was stopped on its way stands."""
    agenda, step = _closed(found, now), found.agenda.step
    berth = agenda.berth
    if isinstance(step, Dock) and berth is not None:
        agenda = replace(agenda, berth=replace(berth, reached=True, came=came))
    elif isinstance(step, Undock):
        agenda = agenda.at(None)
    agenda = replace(agenda, due=agenda.due[1:])
    if not agenda.due and agenda.result is MissionResult.RUNNING:
        agenda = replace(agenda, result=MissionResult.SUCCEEDED)
    return Next(agenda, Stand(at_once=True) if isinstance(step, Straight) else None)


def _failed(
    found: Outcome, steps: tuple[AnyStep, ...], home: DriveTo | None, now: float, back_off: float
) -> Next:
    agenda, due = _closed(found, now), found.agenda.due[0]
    if due.attempt < due.step.retries:
        return Next(replace(agenda, due=_again(agenda, steps, back_off)), Stand())
    if due.step.then == "continue" and len(agenda.due) > 1:
        return Next(replace(agenda, due=agenda.due[1:]), Stand())
    way_home: tuple[Due, ...] = ()
    if due.step.then == "home" and home is not None and due.step is not home:
        way_home = (Due(step=home, place=due.place),)
    result = found.result if agenda.result is MissionResult.RUNNING else agenda.result
    return Next(replace(agenda, due=way_home, result=result), Stand())


def _again(agenda: Agenda, steps: tuple[AnyStep, ...], back_off: float) -> tuple[Due, ...]:
    """What is due where the first step is tried once more. Who docks again drives out of the dock first."""
    due, *later = agenda.due
    place = due.place if due.step.retry_from is None else due.step.retry_from
    repeated = [Due(step=steps[k], place=k) for k in range(place, due.place)]
    again = [*repeated, replace(due, attempt=due.attempt + 1)]
    berth, first = agenda.berth, again[0].step
    if isinstance(first, Dock) and berth is not None:
        if berth.place == place:
            again[0] = replace(again[0], step=replace(first, pose=first.pose or berth.pose))
        approach = first.approach
        came = berth.came or (0 if approach is None else approach.direction)
        if came and berth.reached:
            way = -came * (back_off if approach is None else max(approach.length, back_off))
            again.insert(0, Due(step=Undock(way, then="continue"), place=place))
    return (*again, *later)


def _closed(found: Outcome, now: float) -> Agenda:
    """With the record of the step that has ended; what was known of it is forgotten."""
    agenda = found.agenda
    if agenda.begun is None:
        return agenda
    record = replace(agenda.log[-1], end=now, result=found.result, reason=found.reason)
    return replace(
        agenda,
        begun=None,
        docked_since=None,
        trouble=None,
        ways_out=(),
        reason=found.reason,
        log=(*agenda.log[:-1], record),
    )
