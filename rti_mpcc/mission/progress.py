"""The outcome of a step at the end of a cycle, and what follows: the next one, the same once more, the route
home, or nothing."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

from rti_mpcc.config import MissionSettings
from rti_mpcc.mission.start import order_to_undock
from rti_mpcc.mission_state import MissionState, PendingStep
from rti_mpcc.orders import Order, Stand
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

    mission_state: MissionState
    result: MissionResult
    reason: str = ""


def judge_step(
    mission_state: MissionState, command: Command, signal: bool, now: float, settings: MissionSettings
) -> StepOutcome:
    """The outcome of the step that is under way.

    Args:
        command: of this cycle; signal: whether `until` of the step says that it is over.
        now: on the controller's own clock [s].
    """
    step, started = mission_state.step, mission_state.started
    assert step is not None
    assert started is not None
    if isinstance(step, Wait):
        if signal or (step.seconds is not None and now - started >= step.seconds):
            return StepOutcome(mission_state, MissionResult.SUCCEEDED)
    else:
        mission_state = _noted(mission_state, command, now)
        if isinstance(step, Straight) and signal:
            return StepOutcome(mission_state, MissionResult.SUCCEEDED, "ended by its signal")
        if mission_state.docked_since is not None and now - mission_state.docked_since >= settings.settled:
            return StepOutcome(mission_state, MissionResult.SUCCEEDED)
        reason = command.diagnostics.reason
        if command.diagnostics.cause is Reason.NO_ROUTE and len(mission_state.undock_candidates) > 1:
            return StepOutcome(mission_state, MissionResult.NOT_REACHED, reason)
        if mission_state.trouble is not None and now - mission_state.trouble_since >= step.patience:
            return StepOutcome(mission_state, mission_state.trouble, reason)
    if now - started >= step.timeout:
        return StepOutcome(mission_state, MissionResult.TIMED_OUT, f"not over after {step.timeout:g} s")
    return StepOutcome(mission_state, MissionResult.RUNNING)


def _noted(mission_state: MissionState, command: Command, now: float) -> MissionState:
    """With the time since which the vehicle stands at the end of the step, or makes no progress."""
    since = mission_state.docked_since if mission_state.docked_since is not None else now
    mission_state = replace(mission_state, docked_since=since if command.docked else None)
    trouble = TROUBLE.get(command.status)
    if trouble is not None:
        since = now if mission_state.trouble is None else mission_state.trouble_since
        return replace(mission_state, trouble=trouble, trouble_since=since)
    if command.status in UNDECIDED and command.diagnostics.cause is not Reason.TURNS_WHEELS:
        return mission_state
    return replace(mission_state, trouble=None)


class Next(NamedTuple):
    """The agenda after a step has ended, and the order that ends it, or None."""

    mission_state: MissionState
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
        return Next(outcome.mission_state)
    mission_state, step = _closed(outcome, now), outcome.mission_state.step
    if outcome.result is MissionResult.SUCCEEDED:
        dock_state = mission_state.dock_state
        if isinstance(step, Dock) and dock_state is not None:
            mission_state = replace(
                mission_state, dock_state=replace(dock_state, reached=True, incoming_direction=direction)
            )
        elif isinstance(step, Undock):
            mission_state = mission_state.at(None)
        mission_state = replace(mission_state, pending=mission_state.pending[1:])
        if not mission_state.pending and mission_state.result is MissionResult.RUNNING:
            mission_state = replace(mission_state, result=MissionResult.SUCCEEDED)
        return Next(mission_state, Stand(at_once=True) if isinstance(step, Straight) else None)
    unreached = outcome.result in (MissionResult.NOT_REACHED, MissionResult.BLOCKED)
    if len(outcome.mission_state.undock_candidates) > 1 and unreached:
        left, log = outcome.mission_state.undock_candidates[1:], outcome.mission_state.log
        record = replace(log[-1], goal=left[0])
        mission_state = replace(
            outcome.mission_state, undock_candidates=left, trouble=None, log=(*log[:-1], record)
        )
        return Next(mission_state, order_to_undock(left[0]))
    return Next(_after_failure(mission_state, outcome.result, steps, home, back_off), Stand())


def end_mission(mission_state: MissionState, result: MissionResult, reason: str, now: float) -> Next:
    """End it, with all that is left of it: the vehicle stops as soon as possible."""
    closed = _closed(StepOutcome(mission_state, result, reason), now)
    return Next(replace(closed, pending=(), result=result, reason=reason), Stand(at_once=True))


def _after_failure(
    mission_state: MissionState,
    result: MissionResult,
    steps: tuple[AnyStep, ...],
    home: DriveTo | None,
    back_off: float,
) -> MissionState:
    pending = mission_state.pending[0]
    if pending.attempt < pending.step.retries:
        return replace(mission_state, pending=_again(mission_state, steps, back_off))
    if pending.step.then == "continue" and len(mission_state.pending) > 1:
        return replace(mission_state, pending=mission_state.pending[1:])
    left: tuple[PendingStep, ...] = ()
    if pending.step.then == "home" and home is not None and pending.step is not home:
        left = (PendingStep(step=home, place=pending.place),)
    return replace(
        mission_state,
        pending=left,
        result=result if mission_state.result is MissionResult.RUNNING else mission_state.result,
    )


def _again(
    mission_state: MissionState, steps: tuple[AnyStep, ...], back_off: float
) -> tuple[PendingStep, ...]:
    """The steps that are due if the first one is tried once more; a dock is driven out of first."""
    pending, *later = mission_state.pending
    place = pending.place if pending.step.retry_from is None else pending.step.retry_from
    repeated = [PendingStep(step=steps[k], place=k) for k in range(place, pending.place)]
    again = [*repeated, replace(pending, attempt=pending.attempt + 1)]
    dock_state, first = mission_state.dock_state, again[0].step
    if isinstance(first, Dock) and dock_state is not None:
        if dock_state.place == place:
            again[0] = replace(again[0], step=replace(first, pose=first.pose or dock_state.pose))
        approach = first.approach
        incoming = dock_state.incoming_direction or (0 if approach is None else approach.direction)
        if incoming and dock_state.reached:
            distance = -incoming * (back_off if approach is None else max(approach.length, back_off))
            again.insert(0, PendingStep(step=Undock(distance, then="continue"), place=place))
    return (*again, *later)


def _closed(outcome: StepOutcome, now: float) -> MissionState:
    """With the record of the step that has ended, and nothing else of it."""
    mission_state = outcome.mission_state
    if mission_state.started is None:
        return mission_state
    record = replace(mission_state.log[-1], end=now, result=outcome.result, reason=outcome.reason)
    return replace(
        mission_state,
        started=None,
        docked_since=None,
        trouble=None,
        undock_candidates=(),
        reason=outcome.reason,
        log=(*mission_state.log[:-1], record),
    )
