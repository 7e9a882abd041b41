"""The start of the step that is due, and what follows a step: the next one, the same once more, the route
home, or nothing."""

from __future__ import annotations

from dataclasses import replace

from rti_mpcc.mission.state import MissionState, PendingStep, StepRecord
from rti_mpcc.mission.step import Next, Started, Step, StepOutcome, StepStart
from rti_mpcc.orders import Stand
from rti_mpcc.state import Phase
from rti_mpcc.types import MissionResult


def start_step(at: StepStart) -> Started:
    """Start the step that is due; one that has to start at rest once the vehicle stands.

    If it does not come to rest in the step's time, or patience, the step cannot be started.
    """
    mission_state, s = at.mission_state, at.s
    pending = mission_state.pending[0]
    step = pending.step
    if step.from_rest and (s.vehicle.monitor.state is None or not s.vehicle.stands):
        since = s.clock.now if mission_state.stopping_since is None else mission_state.stopping_since
        mission_state = replace(mission_state, stopping_since=since)
        if s.clock.now - since < min(step.timeout, step.patience):
            return Started(mission_state, None if s.task.phase is Phase.WAITING else Stand())
        started = Started(mission_state, Stand(), problem="the vehicle does not come to rest")
    else:
        started = step.start(at)
    record = StepRecord(
        kind=step.word, place=pending.place, attempt=pending.attempt, begin=s.clock.now,
        goal=started.goal, dock=started.dock,
    )  # fmt: skip
    mission_state = replace(
        started.mission_state,
        started=s.clock.now,
        stopping_since=None,
        reason="",
        log=(*mission_state.log, record),
    )
    return started._replace(mission_state=mission_state)


def advance_mission(
    outcome: StepOutcome, steps: tuple[Step, ...], home: Step | None, direction: int, now: float,
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
    step = outcome.mission_state.step
    assert step is not None
    if outcome.result is MissionResult.SUCCEEDED:
        mission_state, order = step.succeeded(_closed(outcome, now), direction)
        mission_state = replace(mission_state, pending=mission_state.pending[1:])
        if not mission_state.pending and mission_state.result is MissionResult.RUNNING:
            mission_state = replace(mission_state, result=MissionResult.SUCCEEDED)
        return Next(mission_state, order)
    another = step.another_try(outcome)
    if another is not None:
        return another
    failed = outcome._replace(mission_state=_closed(outcome, now))
    return Next(_after_failure(failed, steps, home, back_off), Stand())


def end_mission(mission_state: MissionState, result: MissionResult, reason: str, now: float) -> Next:
    """End it, with all that is left of it: the vehicle stops as soon as possible."""
    closed = _closed(StepOutcome(mission_state, result, reason), now)
    return Next(replace(closed, pending=(), result=result, reason=reason), Stand(at_once=True))


def _after_failure(
    outcome: StepOutcome, steps: tuple[Step, ...], home: Step | None, back_off: float
) -> MissionState:
    mission_state, result, _ = outcome
    pending, *later = mission_state.pending
    if pending.attempt < pending.step.retries:
        place = pending.place if pending.step.retry_from is None else pending.step.retry_from
        repeated = [PendingStep(step=steps[k], place=k) for k in range(place, pending.place)]
        first, *rest = [*repeated, replace(pending, attempt=pending.attempt + 1)]
        before = first.step.before_retry(first, mission_state, back_off)
        return replace(mission_state, pending=(*before, *rest, *later))
    if pending.step.then == "continue" and later:
        return replace(mission_state, pending=tuple(later))
    if mission_state.result is MissionResult.RUNNING:
        mission_state = replace(mission_state, result=result)
    if pending.step.then == "home" and home is not None and pending.step is not home:
        return replace(mission_state, pending=(PendingStep(step=home, place=pending.place),))
    return replace(mission_state, pending=())


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
        data=None,
        reason=outcome.reason,
        log=(*mission_state.log[:-1], record),
    )
