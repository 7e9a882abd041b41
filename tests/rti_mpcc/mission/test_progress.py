"""The outcome of a step, and what follows: the next one, the same once more, the route home, or nothing."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from geometry import Pose2
from rti_mpcc import DockingController
from rti_mpcc.config import MissionSettings
from rti_mpcc.mission import Approach, Dock, DriveTo, Step, Straight, Undock, Wait
from rti_mpcc.mission.progress import advance_mission
from rti_mpcc.mission.state import DockState, MissionState, PendingStep, StepRecord
from rti_mpcc.mission.step import TROUBLE, UNDECIDED, MissionCycle, Next, StepOutcome
from rti_mpcc.orders import GoTo, Stand
from rti_mpcc.types import Command, MissionResult, Reason, Status, VehicleState
from tests.rti_mpcc.yards import BRISK, YARD

SETTLED = MissionSettings().settled
HERE, AT, BACK_OFF = Pose2(0.0, 0.0, 0.0), Pose2(5.0, 1.0, 0.2), 3.0
HOME = DriveTo(Pose2(9.0, 9.0, 0.0))
RUNNING, SUCCEEDED = MissionResult.RUNNING, MissionResult.SUCCEEDED
NOT_REACHED, BLOCKED, TIMED_OUT = MissionResult.NOT_REACHED, MissionResult.BLOCKED, MissionResult.TIMED_OUT
FAILURES = [MissionResult.NOT_DETECTED, NOT_REACHED, BLOCKED, TIMED_OUT]
DRIVES: list[Step] = [DriveTo(HERE), Dock(HERE), Undock(1.0), Straight(1.0)]


def under_way(*steps: Step, place: int = 0, attempt: int = 0, started: float | None = 10.0) -> MissionState:
    """A mission of these steps, with the one at `place` under way."""
    pending = tuple(PendingStep(step=step, place=k) for k, step in enumerate(steps))[place:]
    record = StepRecord(kind=steps[place].word, place=place, attempt=attempt, begin=started or 0.0)
    pending = (replace(pending[0], attempt=attempt), *pending[1:])
    return MissionState(pending=pending, started=started, log=() if started is None else (record,))


# -- the outcome ---------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def some() -> Command:
    controller = DockingController.in_area(YARD, BRISK)
    return controller.step(VehicleState(x=0.0, y=0.0, phi=0.0, v=0.0, delta=0.0), now=0.0)


def command(some: Command, status: Status, cause: Reason = Reason.DRIVES, *, docked: bool = False) -> Command:
    diagnostics = replace(some.diagnostics, cause=cause, reason="why")
    return replace(some, status=status, docked=docked, diagnostics=diagnostics)


def judge_step(mission_state: MissionState, sent: Command, signal: bool, now: float) -> StepOutcome:
    assert mission_state.step is not None
    return mission_state.step.judged(mission_state, MissionCycle(sent, signal, now, SETTLED))


def lasting(
    some: Command, step: Step, seconds: float, *statuses: Status, **values: Any
) -> tuple[MissionResult, float]:
    """Result of a step with these statuses in turn, and its time [s] after the start."""
    mission_state = under_way(step)
    for k in range(round(seconds / 0.5)):
        sent = command(some, statuses[k % len(statuses)], **values)
        outcome = judge_step(mission_state, sent, False, 10.0 + 0.5 * k)
        if outcome.result is not RUNNING:
            assert outcome.reason in ("why", "", f"not over after {step.timeout:g} s")
            return outcome.result, 0.5 * k
        mission_state = outcome.mission_state
    return RUNNING, seconds


@pytest.mark.parametrize("step", DRIVES, ids=lambda step: step.word)
@pytest.mark.parametrize("status", list(Status), ids=str)
def test_a_step_without_progress_fails_after_its_patience_and_each_has_a_timeout(
    some: Command, step: Step, status: Status
) -> None:
    patient, late = replace(step, patience=4.0), replace(step, timeout=3.0)
    if status in TROUBLE:
        assert lasting(some, patient, 20.0, status) == (TROUBLE[status], 4.0)
        assert lasting(some, patient, 20.0, status, *[Status.PLANNING] * 3) == (TROUBLE[status], 4.0)
        assert lasting(some, patient, 20.0, *[status] * 4, Status.FOLLOWING) == (RUNNING, 20.0)
    else:
        assert lasting(some, patient, 30.0, status) == (RUNNING, 30.0)
        assert lasting(some, late, 30.0, status) == (TIMED_OUT, 3.0)


def test_while_wheels_are_turned_there_is_no_trouble(some: Command) -> None:
    mission_state = replace(under_way(DriveTo(HERE)), trouble=BLOCKED, trouble_since=9.0)
    for status in UNDECIDED:
        kept = judge_step(mission_state, command(some, status), False, 11.0).mission_state
        assert kept.trouble is BLOCKED
        turns = command(some, status, Reason.TURNS_WHEELS)
        assert judge_step(mission_state, turns, False, 11.0).mission_state.trouble is None


@pytest.mark.parametrize("step", DRIVES, ids=lambda step: step.word)
def test_it_succeeds_once_the_vehicle_has_stood_there_for_a_moment(some: Command, step: Step) -> None:
    assert lasting(some, step, 5.0, Status.DOCKED, docked=True) == (SUCCEEDED, SETTLED)
    mission_state = replace(under_way(step), docked_since=9.9)
    away = judge_step(mission_state, command(some, Status.STARTING), False, 11.0)
    assert (away.result, away.mission_state.docked_since) == (RUNNING, None)


# -- the next step -------------------------------------------------------------------------------------------


def then(
    mission_state: MissionState,
    result: MissionResult,
    *steps: Step,
    home: DriveTo | None = None,
    direction: int = 1,
) -> Next:
    return advance_mission(StepOutcome(mission_state, result, "why"), steps, home, direction, 12.0, BACK_OFF)


def pending(mission_state: MissionState) -> list[tuple[str, int, int]]:
    return [(each.step.word, each.place, each.attempt) for each in mission_state.pending]


def at_dock(mission_state: MissionState, dock: Dock, place: int = 0, **values: Any) -> MissionState:
    return replace(mission_state, dock_state=DockState(dock=dock, place=place, pose=AT, body_at=AT, **values))


@pytest.mark.parametrize("direction", [1, -1])
def test_a_docked_vehicle_knows_its_direction_and_an_undocked_one_is_at_no_dock(direction: int) -> None:
    dock, out = Dock(AT, body=[(1, 0), (2, 0), (2, 1)]), Undock(3.0)
    there = then(at_dock(under_way(dock, out), dock), SUCCEEDED, dock, out, direction=direction).mission_state
    assert there.dock_state is not None
    assert (there.dock_state.reached, there.dock_state.incoming_direction) == (True, direction)
    away = then(replace(there, started=11.0), SUCCEEDED, dock, out).mission_state
    assert away.dock_state is None
    assert len(away.standing) == 1  # the dock is where it was


@pytest.mark.parametrize("result", FAILURES)
def test_after_failure_the_mission_ends_continues_or_drives_home(result: MissionResult) -> None:
    steps = Wait(1.0), Wait(2.0)
    mission_state, order = then(under_way(*steps), result, *steps, home=HOME)
    assert (mission_state.pending, mission_state.result, mission_state.reason, order) == (
        (),
        result,
        "why",
        Stand(),
    )
    assert mission_state.log[-1].result is result
    steps = Wait(1.0, then="continue"), Wait(2.0)
    mission_state, order = then(under_way(*steps), result, *steps)
    assert (pending(mission_state), mission_state.result, order) == ([("wait", 1, 0)], RUNNING, Stand())
    last = then(under_way(steps[0]), result, steps[0]).mission_state
    assert (last.pending, last.result) == ((), result)
    steps = Wait(1.0, then="home"), Wait(2.0)
    mission_state, order = then(under_way(*steps), result, *steps, home=HOME)
    assert ([each.step for each in mission_state.pending], mission_state.result, order) == (
        [HOME],
        result,
        Stand(),
    )
    for ends in (SUCCEEDED, TIMED_OUT):  # home is no success
        home = then(replace(mission_state, started=11.0), ends, *steps, home=HOME).mission_state
        assert (home.pending, home.result) == ((), result)


def test_home_that_says_home_is_driven_to_once() -> None:
    home = DriveTo(AT, then="home")
    mission_state = replace(under_way(home), result=BLOCKED)
    assert then(mission_state, TIMED_OUT, Wait(1.0), home=home).mission_state.pending == ()


def test_a_step_is_tried_again_as_often_as_it_says_and_then_fails() -> None:
    steps = Wait(1.0, retries=2), Wait(2.0)
    for attempt in (0, 1):
        mission_state, order = then(under_way(*steps, attempt=attempt), TIMED_OUT, *steps)
        assert pending(mission_state) == [("wait", 0, attempt + 1), ("wait", 1, 0)]
        assert (order, mission_state.result, mission_state.started) == (Stand(), RUNNING, None)
    last = then(under_way(*steps, attempt=2), TIMED_OUT, *steps).mission_state
    assert (last.pending, last.result) == ((), TIMED_OUT)


def test_from_an_earlier_step_all_in_between_are_done_once_more() -> None:
    steps = Wait(1.0), DriveTo(AT), Undock(2.0), Wait(4.0, retries=1, retry_from=1), Wait(5.0)
    mission_state = then(under_way(*steps, place=3), TIMED_OUT, *steps).mission_state
    assert pending(mission_state) == [("drive_to", 1, 0), ("undock", 2, 0), ("wait", 3, 1), ("wait", 4, 0)]
    assert [each.step for each in mission_state.pending] == list(steps[1:])


@pytest.mark.parametrize("direction", [1, -1])
@pytest.mark.parametrize("length", [None, 1.0, 7.0])
def test_before_docking_again_the_vehicle_drives_out_of_the_dock(
    direction: int, length: float | None
) -> None:
    dock = Dock(AT, approach=None if length is None else Approach(length, direction))
    steps = dock, Wait(1.0), Straight(0.5 * direction, retries=1, retry_from=0)
    mission_state = at_dock(under_way(*steps, place=2), dock, reached=True, incoming_direction=direction)
    mission_state = then(mission_state, NOT_REACHED, *steps).mission_state
    assert pending(mission_state) == [("undock", 0, 0), ("dock", 0, 0), ("wait", 1, 0), ("straight", 2, 1)]
    out = mission_state.pending[0].step
    assert isinstance(out, Undock)
    assert (out.distance, out.then) == (-direction * max(BACK_OFF, length or 0.0), "continue")


def test_without_a_known_direction_the_approach_tells_or_it_does_not_drive_out() -> None:
    for approach, first in ((Approach(2.0, -1), "undock"), (None, "dock")):
        dock = Dock(AT, approach=approach)
        steps = dock, Wait(1.0, retries=1, retry_from=0)
        mission_state = at_dock(under_way(*steps, place=1), dock, reached=True)
        assert then(mission_state, TIMED_OUT, *steps).mission_state.pending[0].step.word == first


def test_a_dock_that_was_not_reached_is_docked_at_where_it_was_found() -> None:
    steps = (Dock(retries=1),)
    (again,) = then(at_dock(under_way(*steps), steps[0]), NOT_REACHED, *steps).mission_state.pending
    assert isinstance(again.step, Dock)
    assert (again.attempt, again.step.pose) == (1, AT)


@pytest.mark.parametrize("reached", [False, True])
def test_another_dock_is_not_taken_for_the_one_without_a_pose(reached: bool) -> None:
    steps = Dock(), Undock(3.0), Dock(AT, retries=1, retry_from=0)
    mission_state = at_dock(under_way(*steps, place=2), steps[2], place=2, reached=reached)
    found = then(mission_state, NOT_REACHED, *steps).mission_state.pending
    (first, *_) = [each.step for each in found if each.place == 0 and isinstance(each.step, Dock)]
    assert first.pose is None


@pytest.mark.parametrize("result", FAILURES)
def test_if_one_end_of_an_undocking_is_not_reached_the_next_one_is_tried(result: MissionResult) -> None:
    ends, step = (HERE, AT, Pose2(7.0, 0.0, 0.0)), Undock(4.0)
    mission_state = replace(under_way(step), data=ends, trouble=BLOCKED, trouble_since=3.0)
    found, order = then(mission_state, result, step)
    if result not in (NOT_REACHED, BLOCKED):
        assert (found.pending, found.result) == ((), result)
        return
    assert (found.data, found.trouble, found.started) == (ends[1:], None, 10.0)
    assert isinstance(order, GoTo)
    assert (order.goal, order.terms.tolerance, found.log[-1].goal) == (AT, (0.2, 0.2, 0.1), AT)
    last = then(replace(found, data=ends[2:]), result, step).mission_state
    assert (last.pending, last.result, last.data) == ((), result, None)
