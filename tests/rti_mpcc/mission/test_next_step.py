"""What comes after a step: the next one, the same once more, the way home, or nothing."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from geometry import Pose2
from rti_mpcc.config import ControllerConfig
from rti_mpcc.mission.next_step import Next, after, ended
from rti_mpcc.mission.outcome import Outcome
from rti_mpcc.orders import GoTo, Stand
from rti_mpcc.planning.agenda import Agenda, Berth
from rti_mpcc.steps import AnyStep, Approach, Dock, DriveTo, Straight, Undock, Wait
from rti_mpcc.types import MissionResult
from tests.rti_mpcc.mission.agendas import HERE, under_way

CONFIG = ControllerConfig()
HOME = DriveTo(Pose2(9.0, 9.0, 0.0))
AT, BACK_OFF = Pose2(5.0, 1.0, 0.2), CONFIG.mission.back_off
FAILURES = [
    MissionResult.NOT_DETECTED,
    MissionResult.NOT_REACHED,
    MissionResult.BLOCKED,
    MissionResult.TIMED_OUT,
]


def then(
    agenda: Agenda, result: MissionResult, *steps: AnyStep, home: DriveTo | None = None, came: int = 1
) -> Next:
    return after(Outcome(agenda, result, "why"), steps, home, came, 12.0, CONFIG)


def due(agenda: Agenda) -> list[tuple[str, int, int]]:
    return [(each.step.word, each.place, each.attempt) for each in agenda.due]


def at_dock(agenda: Agenda, dock: Dock, place: int = 0, **values: Any) -> Agenda:
    return replace(agenda, berth=Berth(dock=dock, place=place, pose=AT, body_at=AT, **values))


def test_while_it_is_running_nothing_comes() -> None:
    agenda = under_way(Wait(1.0))
    assert then(agenda, MissionResult.RUNNING, Wait(1.0)) == (agenda, None)


def test_after_success_comes_the_next_one_and_after_the_last_one_the_end() -> None:
    steps = Wait(1.0), DriveTo(AT)
    agenda, order = then(under_way(*steps), MissionResult.SUCCEEDED, *steps)
    assert (due(agenda), order, agenda.begun, agenda.result) == (
        [("drive_to", 1, 0)],
        None,
        None,
        MissionResult.RUNNING,
    )
    (record,) = agenda.log
    assert (record.begin, record.end, record.result, record.reason) == (
        10.0,
        12.0,
        MissionResult.SUCCEEDED,
        "why",
    )
    agenda, order = then(under_way(*steps, place=1), MissionResult.SUCCEEDED, *steps)
    assert (agenda.due, agenda.result, order) == ((), MissionResult.SUCCEEDED, None)


def test_a_straight_move_ends_at_rest() -> None:
    steps = Straight(1.0), Wait(1.0)
    assert then(under_way(*steps), MissionResult.SUCCEEDED, *steps).order == Stand(at_once=True)


@pytest.mark.parametrize("came", [1, -1])
def test_who_has_docked_knows_how_it_came_and_who_undocked_is_at_no_dock(came: int) -> None:
    dock, out = Dock(AT, body=[(1, 0), (2, 0), (2, 1)]), Undock(3.0)
    agenda = at_dock(under_way(dock, out), dock)
    there = then(agenda, MissionResult.SUCCEEDED, dock, out, came=came).agenda
    assert there.berth is not None
    assert (there.berth.reached, there.berth.came) == (True, came)
    away = then(replace(there, begun=11.0), MissionResult.SUCCEEDED, dock, out).agenda
    assert away.berth is None
    assert len(away.standing) == 1  # the dock is where it was


# -- failures ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("result", FAILURES)
def test_after_failure_the_mission_is_over_with_a_vehicle_that_stands(result: MissionResult) -> None:
    steps = Wait(1.0), Wait(2.0)
    agenda, order = then(under_way(*steps), result, *steps, home=HOME)
    assert (agenda.due, agenda.result, agenda.reason, order) == ((), result, "why", Stand())
    assert agenda.log[-1].result is result


@pytest.mark.parametrize("result", FAILURES)
def test_or_goes_on_with_the_next_one(result: MissionResult) -> None:
    steps = Wait(1.0, then="continue"), Wait(2.0)
    agenda, order = then(under_way(*steps), result, *steps)
    assert (due(agenda), agenda.result, order) == ([("wait", 1, 0)], MissionResult.RUNNING, Stand())
    last = then(under_way(Wait(1.0, then="continue")), result, Wait(1.0, then="continue")).agenda
    assert (last.due, last.result) == ((), result)


@pytest.mark.parametrize("result", FAILURES)
def test_or_drives_home_which_does_not_make_it_a_success(result: MissionResult) -> None:
    steps = Wait(1.0, then="home"), Wait(2.0)
    agenda, order = then(under_way(*steps), result, *steps, home=HOME)
    assert ([each.step for each in agenda.due], agenda.result, order) == ([HOME], result, Stand())
    for ends in (MissionResult.SUCCEEDED, MissionResult.TIMED_OUT):
        home_run = replace(agenda, begun=11.0)
        home = then(home_run, ends, *steps, home=HOME).agenda
        assert (home.due, home.result) == ((), result)


def test_home_that_says_home_is_driven_to_once() -> None:
    home = DriveTo(AT, then="home")
    agenda = replace(under_way(home), result=MissionResult.BLOCKED)
    assert then(agenda, MissionResult.TIMED_OUT, Wait(1.0), home=home).agenda.due == ()


# -- tried again ---------------------------------------------------------------------------------------------


def test_it_is_tried_again_as_often_as_it_says_and_then_fails() -> None:
    steps = Wait(1.0, retries=2), Wait(2.0)
    for attempt in (0, 1):
        agenda, order = then(under_way(*steps, attempt=attempt), MissionResult.TIMED_OUT, *steps)
        assert due(agenda) == [("wait", 0, attempt + 1), ("wait", 1, 0)]
        assert (order, agenda.result, agenda.begun) == (Stand(), MissionResult.RUNNING, None)
    last = then(under_way(*steps, attempt=2), MissionResult.TIMED_OUT, *steps).agenda
    assert (last.due, last.result) == ((), MissionResult.TIMED_OUT)


def test_from_an_earlier_step_all_in_between_are_done_once_more() -> None:
    steps = Wait(1.0), DriveTo(AT), Undock(2.0), Wait(4.0, retries=1, retry_from=1), Wait(5.0)
    agenda = then(under_way(*steps, place=3), MissionResult.TIMED_OUT, *steps).agenda
    assert due(agenda) == [("drive_to", 1, 0), ("undock", 2, 0), ("wait", 3, 1), ("wait", 4, 0)]
    assert [each.step for each in agenda.due] == list(steps[1:])


@pytest.mark.parametrize("came", [1, -1])
@pytest.mark.parametrize("length", [None, 1.0, 7.0])
def test_who_docks_again_drives_out_of_the_dock_first(came: int, length: float | None) -> None:
    dock = Dock(AT, approach=None if length is None else Approach(length, came))
    steps = dock, Wait(1.0), Straight(0.5 * came, retries=1, retry_from=0)
    agenda = at_dock(under_way(*steps, place=2), dock, reached=True, came=came)
    agenda = then(agenda, MissionResult.NOT_REACHED, *steps).agenda
    assert due(agenda) == [("undock", 0, 0), ("dock", 0, 0), ("wait", 1, 0), ("straight", 2, 1)]
    out = agenda.due[0].step
    assert isinstance(out, Undock)
    assert out.distance == -came * max(BACK_OFF, length or 0.0)
    assert out.then == "continue"


def test_where_it_is_not_known_how_it_came_the_approach_tells_or_it_does_not_drive_out() -> None:
    for approach, first in ((Approach(2.0, -1), "undock"), (None, "dock")):
        dock = Dock(AT, approach=approach)
        steps = dock, Wait(1.0, retries=1, retry_from=0)
        agenda = at_dock(under_way(*steps, place=1), dock, reached=True)
        assert then(agenda, MissionResult.TIMED_OUT, *steps).agenda.due[0].step.word == first


def test_a_dock_that_was_not_reached_is_not_driven_out_of_and_docked_at_where_it_was_found() -> None:
    steps = (Dock(retries=1),)
    agenda = then(at_dock(under_way(*steps), steps[0]), MissionResult.NOT_REACHED, *steps).agenda
    (again,) = agenda.due
    assert isinstance(again.step, Dock)
    assert (again.attempt, again.step.pose) == (1, AT)


@pytest.mark.parametrize("reached", [False, True])
def test_another_dock_is_not_taken_for_the_one_without_a_pose(reached: bool) -> None:
    steps = Dock(), Undock(3.0), Dock(AT, retries=1, retry_from=0)
    agenda = at_dock(under_way(*steps, place=2), steps[2], place=2, reached=reached)
    found = then(agenda, MissionResult.NOT_REACHED, *steps).agenda.due
    (first, *_) = [each.step for each in found if each.place == 0 and isinstance(each.step, Dock)]
    assert first.pose is None


# -- ways out ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("result", FAILURES)
def test_where_one_way_out_cannot_be_driven_the_next_one_is_tried(result: MissionResult) -> None:
    ends, step = (HERE, AT, Pose2(7.0, 0.0, 0.0)), Undock(4.0)
    agenda = replace(under_way(step), ways_out=ends, trouble=MissionResult.BLOCKED, trouble_since=3.0)
    found, order = then(agenda, result, step)
    if result not in (MissionResult.NOT_REACHED, MissionResult.BLOCKED):
        assert (found.due, found.result) == ((), result)
        return
    assert (found.ways_out, found.trouble, found.begun) == (ends[1:], None, 10.0)
    assert isinstance(order, GoTo)
    assert order.goal == AT
    assert order.terms.tolerance == (0.2, 0.2, 0.1)
    assert found.log[-1].goal == AT
    last = then(replace(found, ways_out=ends[2:]), result, step).agenda
    assert (last.due, last.result, last.ways_out) == ((), result, ())


# -- ended from outside --------------------------------------------------------------------------------------


def test_whatever_was_left_is_dropped() -> None:
    steps = Wait(1.0), Wait(2.0)
    agenda, order = ended(under_way(*steps), MissionResult.CANCELLED, "", 11.0)
    assert (agenda.due, agenda.result, order) == ((), MissionResult.CANCELLED, Stand(at_once=True))
    assert (agenda.log[-1].end, agenda.log[-1].result) == (11.0, MissionResult.CANCELLED)
    between = ended(under_way(*steps, begun=None), MissionResult.CANCELLED, "", 11.0).agenda
    assert (between.log, between.result) == ((), MissionResult.CANCELLED)
