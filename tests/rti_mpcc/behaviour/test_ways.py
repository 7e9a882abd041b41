"""What is remembered, and forgotten, when a way is lost and when another one was planned."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from geometry import Pose2, ReferencePath
from rti_mpcc.behaviour import moves
from rti_mpcc.behaviour.status import STATUS_OF, Verdict, status_of
from rti_mpcc.behaviour.transitions import ANY, TRANSITIONS, Event, transition_on
from rti_mpcc.model.delay import QueuedCommand
from rti_mpcc.planning.state import ControllerState, Halt, Phase, Plans, RouteState, Stall, Task
from rti_mpcc.planning.surroundings import Surroundings
from rti_mpcc.rerouting import standing_route
from rti_mpcc.types import Reason, Status
from tests.rti_mpcc.planned import manoeuvre_along
from tests.rti_mpcc.states import after_changes, arriving, begun_for, put, some_plan, stop_at, target_at
from tests.rti_mpcc.yards import YARD

BACK_AND_FORTH = ReferencePath.from_segments(Pose2(1.0, 2.0, 0.3), [(-1, 0.1, 4.0), (1, 0.0, 6.0)])
WAY = manoeuvre_along(BACK_AND_FORTH)
STANDS, SEGMENTS = standing_route(Pose2(5.0, 6.0, 0.7))


def planned(phase: Phase = Phase.ARRIVING, **values: Any) -> ControllerState:
    """In a phase on a way that was planned, with something of everything that can be forgotten."""
    plan = some_plan()
    plans: dict[str, Any] = {"valid": plan, "driven": plan, "accepted_at": 9.9, "clear_of": 3}
    task: dict[str, Any] = {"outside_since": 9.0, "latched": "why", "looked_at": 9.5, "looks_past": True}
    s = arriving(phase=phase, **plans, **task, suspended=begun_for(None), begin=np.zeros(6))
    route = RouteState(
        end=s.path.end, manoeuvre=manoeuvre_along(s.path), wanted="why not", since=3.0, ways=1, seconds=0.5
    )
    return put(replace(s, route=route), **values)


def stands(s: ControllerState) -> ControllerState:
    """The same without its way."""
    return moves.without_way(s, STANDS, SEGMENTS, "why not")


# -- the rows ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("phase", ANY, ids=lambda phase: phase.name)
def test_a_way_may_be_lost_in_any_phase(phase: Phase) -> None:
    assert transition_on(planned(phase), Event.WAY_LOST).task.phase is Phase.PLANNING


@pytest.mark.parametrize("phase", ANY, ids=lambda phase: phase.name)
def test_another_way_is_begun_in_any_phase_but_by_one_that_brakes_to_rest_in_its_target(phase: Phase) -> None:
    s = planned(phase)
    after = transition_on(s, Event.WAY_PLANNED)
    if phase is Phase.SETTLING:
        assert after is s
    else:
        assert after.task.phase is Phase.STARTING
    assert transition_on(stands(s), Event.WAY_PLANNED).task.phase is Phase.STARTING


def test_while_a_way_is_planned_nothing_else_happens() -> None:
    """Not even what happens in every other phase: the body overlaps something, the goal is given."""
    s = stands(planned())
    for event in Event:
        if event not in (Event.WAY_PLANNED, Event.WAY_LOST, Event.TOLD_TO_STAND):
            assert transition_on(s, event) is s, event
    assert not [row for row in TRANSITIONS if row.when and Phase.PLANNING in row.sources]


# -- what is remembered --------------------------------------------------------------------------------------


@pytest.mark.parametrize("phase", ANY, ids=lambda phase: phase.name)
def test_without_its_way_it_keeps_no_plans_and_nothing_of_its_task(phase: Phase) -> None:
    s = planned(phase, stop=stop_at(12.0), halt=Halt())
    after = stands(s)
    assert after.path is STANDS
    assert after.task.segments is SEGMENTS
    assert (after.plans, after.begin) == (Plans(), None)
    task = after.task
    assert (task.phase, task.stop, task.halt, task.arrival, task.latched) == (
        Phase.PLANNING,
        None,
        None,
        None,
        "",
    )
    assert (task.outside_since, task.looked_at, task.looks_past) == (None, None, False)


def test_it_keeps_all_that_is_known_of_goal_vehicle_and_surroundings() -> None:
    queue = (QueuedCommand(9.0, 0.1, 0.2),)
    s = planned(
        pose=Pose2(1.0, 2.0, 3.0), standing_since=9.0, queue=queue, area=after_changes(5), waiting=True
    )
    after = stands(s)
    assert (after.goal, after.vehicle, after.area, after.queue, after.clock) == (
        s.goal,
        s.vehicle,
        s.area,
        s.queue,
        s.clock,
    )


def test_it_knows_why_since_when_and_what_was_planned_before() -> None:
    s = planned()
    after = stands(s).route
    assert s.route is not None
    assert s.route.wanted
    assert after == replace(s.route, why="why not", wanted="", since=s.now)


def test_on_another_way_it_begins_with_its_first_segment() -> None:
    route = RouteState(manoeuvre=WAY, since=10.0, ways=2, seconds=0.7)
    s = moves.onto_way(put(stands(planned()), area=Surroundings.in_area(YARD)), WAY, route)
    assert s.task.phase is Phase.STARTING
    assert s.task.segments == WAY.segments
    assert [part.end for part in s.path.parts] == [4.0, 10.0]
    assert (s.route, s.begin) == (route, None)
    assert s.plans == Plans()
    assert (s.task.arrival, s.task.stop, s.task.latched) == (None, None, "")


@pytest.mark.parametrize(
    "phase", [Phase.STARTING, Phase.HOLDING, Phase.STALLED], ids=lambda phase: phase.name
)
def test_on_another_way_nothing_is_kept_of_the_task_on_the_given_path(phase: Phase) -> None:
    s = planned(phase, stop=stop_at(12.0), halt=Halt(), stall=Stall(target=target_at(20.0), obstacles=()))
    after = moves.onto_way(s, WAY, RouteState(manoeuvre=WAY))
    assert after.task == Task.begun(WAY.segments)
    assert after.path.parts == WAY.path.parts
    assert (after.plans, after.begin) == (Plans(), None)


def test_the_end_of_the_given_path_is_the_goal_on_another_way_to_it() -> None:
    """It was the goal while there was no other one, and is no pose of that way's own."""
    s = planned(Phase.STALLED)
    assert s.goal.pose is None
    goal = moves.onto_way(s, WAY, RouteState(manoeuvre=WAY)).goal
    assert (goal.pose, goal.planned, goal.dock) == (WAY.goal, WAY.goal, WAY.goal)
    told, followed = Pose2(1.0, 2.0, 3.0), Pose2(1.1, 2.0, 3.0)
    known = put(s, planned=told, dock=told, pose=followed, followed=followed)
    assert moves.onto_way(known, WAY, RouteState(manoeuvre=WAY)).goal == known.goal


def test_a_vehicle_that_stood_for_long_has_not_looked_for_a_plan_yet() -> None:
    """It is taken to stand for as long as it did: wheels may be turned at once."""
    s = put(stands(planned()), standing_since=2.0)
    after = moves.onto_way(s, WAY, RouteState(manoeuvre=WAY))
    assert after.task.looked_at is None
    assert after.vehicle.standing_since == 2.0


# -- what is said --------------------------------------------------------------------------------------------


def test_the_statuses_of_planning() -> None:
    s = stands(planned())
    assert status_of(Verdict(Reason.PLANS_WAY, "the first one"), s.task) is Status.PLANNING
    assert status_of(Verdict(Reason.NO_WAY, "too narrow"), s.task) is Status.STALLED
    assert status_of(Verdict(Reason.TURNS_WHEELS, "0.30"), s.task) is Status.STARTING
    assert {Reason.PLANS_WAY, Reason.NO_WAY, Reason.TURNS_WHEELS} <= set(STATUS_OF)
    assert str(Verdict(Reason.PLANS_WAY, "the first one")) == "planning a way: the first one"
    assert str(Verdict(Reason.NO_WAY, "too narrow")) == "too narrow"
