"""What is remembered when something happens, and what is forgotten."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from estimation import GoalEstimate, GoalStatus, PoseHistory
from geometry import Pose2
from rti_mpcc.behaviour import moves
from rti_mpcc.behaviour.conditions import replan_due
from rti_mpcc.behaviour.transitions import ON_ITS_WAY
from rti_mpcc.config import ControllerConfig
from rti_mpcc.manoeuvre import PlannedStop, segments_of
from rti_mpcc.model.delay import QueuedCommand
from rti_mpcc.paper import with_method
from rti_mpcc.paper.objective import CartesianPose
from rti_mpcc.planning.plausibility import StateMonitor
from rti_mpcc.planning.state import (
    Arrival,
    ControllerState,
    Halt,
    Phase,
    Plans,
)
from rti_mpcc.types import GoalOrigin
from tests.rti_mpcc.states import (
    BEFORE,
    PATH,
    SEGMENTS,
    after_changes,
    arrival_at,
    arriving,
    begun_for,
    contexts,
    contouring,
    put,
    some_plan,
    state,
    stop_at,
)

CONFIG = ControllerConfig(dead_time=0.2)


def planned(**values: Any) -> ControllerState:
    """With something of everything that can be forgotten."""
    plan = some_plan()
    plans: dict[str, Any] = {"valid": plan, "driven": plan, "accepted_at": 9.9, "clear_of": 3}
    return arriving(**{**plans, "suspended": begun_for(None), "outside_since": 9.0, **values})


def begins_afresh(s: ControllerState) -> bool:
    """Whether nothing is kept of what was planned, but which obstacles that was clear of."""
    kept = s.task.arrival, s.task.outside_since, s.plans
    return s.task.phase is Phase.STARTING and kept == (None, None, Plans(clear_of=3))


# -- plans ----------------------------------------------------------------------------------------------


def test_an_accepted_plan_is_driven_and_lets_nothing_hold_the_vehicle() -> None:
    plan = some_plan()
    s = moves.plan_accepted(arriving(latched="why", looked_at=1.0, looks_past=True), plan)
    assert s.plans.valid is plan
    assert s.plans.driven is plan
    assert s.plans.accepted_at == 10.0
    assert (s.task.latched, s.task.looked_at, s.task.looks_past) == ("", None, False)
    assert s.task.phase is Phase.ARRIVING
    cruising = moves.plan_accepted(contouring(latched="why", looked_at=1.0), plan)
    assert (cruising.task.latched, cruising.task.looked_at) == ("", 1.0)


@pytest.mark.parametrize(("arrival", "phase"), [(None, Phase.CONTOURING), (arrival_at(20.0), Phase.ARRIVING)])
@pytest.mark.parametrize("before", [Phase.STARTING, Phase.CONTOURING])
def test_a_plan_that_was_found_is_driven(arrival: Arrival | None, phase: Phase, before: Phase) -> None:
    s = moves.plan_found(state(phase=before, arrival=arrival, suspended=begun_for(None)))
    assert s.task.phase is phase
    assert s.task.driving_since == 10.0
    assert s.task.arrival == arrival
    assert s.plans.suspended is None


@pytest.mark.parametrize("phase", [Phase.STARTING, Phase.CONTOURING, Phase.ARRIVING, Phase.SETTLING])
def test_without_a_plan_that_may_be_driven_it_begins_afresh_and_remembers_why(phase: Phase) -> None:
    s = moves.plan_lost(planned(phase=phase), "why")
    assert begins_afresh(s)
    assert s.task.latched == "why"


@pytest.mark.parametrize("phase", [Phase.HOLDING, Phase.STALLED])
def test_a_vehicle_that_needs_no_plan_loses_none(phase: Phase) -> None:
    s = planned(phase=phase)
    assert moves.plan_lost(s, "why") is s


@pytest.mark.parametrize("phase", ON_ITS_WAY)
def test_a_vehicle_that_overlaps_something_begins_afresh_once_its_way_is_clear(phase: Phase) -> None:
    s = moves.overlapping(planned(phase=phase, halt=Halt(clear_since=9.5)))
    assert begins_afresh(s)
    assert s.task.halt == Halt()


def test_a_vehicle_that_stands_blocked_looks_again_at_once() -> None:
    s = moves.looking_again(planned(suspended=None))
    assert begins_afresh(s)
    assert replan_due(s, contexts.standing(12.0, now=10.05), CONFIG)


@pytest.mark.parametrize(
    ("phase", "then"),
    [
        (Phase.HOLDING, Phase.HOLDING),
        (Phase.SETTLING, Phase.SETTLING),
        (Phase.STARTING, Phase.STARTING),
        (Phase.ARRIVING, Phase.STARTING),
        (Phase.CONTOURING, Phase.STARTING),
        (Phase.STALLED, Phase.STARTING),
    ],
)
def test_a_vehicle_found_after_a_gap_begins_again_unless_it_has_come_to_its_end(
    phase: Phase, then: Phase
) -> None:
    before = planned(phase=phase, begin=np.zeros(6))
    after = moves.found_elsewhere(before)
    assert (after.task.phase, after.begin) == (then, None)
    if then is Phase.STARTING:
        assert begins_afresh(after)
    else:
        assert (after.task, after.plans) == (before.task, before.plans)


def test_of_a_cycle_that_went_wrong_nothing_is_kept_but_why() -> None:
    before = planned(begin=np.zeros(6), segments=(BEFORE, *SEGMENTS))
    s = moves.begun_again(before, "why")
    assert begins_afresh(s)
    assert (s.task.latched, s.begin) == ("why", None)
    assert s.task.segment is not BEFORE  # the same again, for which a core is made anew
    assert (s.task.segment.part, s.task.segment.end) == (BEFORE.part, BEFORE.end)
    assert s.task.segments[1:] == SEGMENTS


# -- stops before what fills the way ----------------------------------------------------------------------


def test_a_stop_is_made_for_or_kept_where_it_is_near() -> None:
    s = moves.stop_before(arriving(), contexts(), CONFIG, 4.0, 7)
    assert s.task.phase is Phase.STARTING
    assert s.task.stop == PlannedStop(at=14.0, goal=None, obstacles=7, since=10.0)
    near = moves.stop_before(arriving(), contexts(), CONFIG, CONFIG.behaviour.near_stop, 7)
    assert near.task.phase is Phase.HOLDING
    behind = moves.stop_before(arriving(), contexts(), CONFIG, -1.0, 7).task.stop
    assert behind is not None
    assert behind.at == 10.0


@pytest.mark.parametrize("distance", [4.0, 0.1])
def test_a_stop_is_made_for_or_kept_with_nothing_of_what_was_planned(distance: float) -> None:
    s = moves.stop_before(planned(), contexts(), CONFIG, distance, 7)
    assert (s.task.arrival, s.task.outside_since, s.plans) == (None, None, Plans(clear_of=3))


@pytest.mark.parametrize("distance", [4.0, 0.1])
def test_a_stop_remembers_the_goal(distance: float) -> None:
    goal = Pose2(20.0, 0.0, 0.0)
    stop = moves.stop_before(arriving(pose=goal), contexts(), CONFIG, distance, 7).task.stop
    assert stop is not None
    assert stop.goal == goal


def test_what_is_sought_changes_and_its_search_goes_on() -> None:
    begun = begun_for(stop_at(9.0))
    s = moves.seeking(planned(suspended=begun), begun.segment)
    assert (s.task.stop, s.plans.suspended) == (stop_at(9.0), begun)
    assert (s.task.phase, s.plans.driven, s.task.arrival) == (Phase.STARTING, None, None)


@pytest.mark.parametrize("phase", [Phase.STARTING, Phase.SETTLING, Phase.HOLDING])
def test_a_vehicle_that_does_not_drive_looks_past_a_stop(phase: Phase) -> None:
    s = moves.released(planned(phase=phase, stop=stop_at(12.0)))
    assert begins_afresh(s)
    assert (s.task.stop, s.task.looks_past) == (None, True)


@pytest.mark.parametrize("phase", [Phase.CONTOURING, Phase.ARRIVING, Phase.STALLED])
def test_a_stop_that_is_driven_to_stays_until_another_plan_is_found(phase: Phase) -> None:
    s = planned(phase=phase, stop=stop_at(12.0))
    assert moves.released(s) is s


def test_a_look_past_a_stop_ends_with_a_plan_or_back_at_the_stop() -> None:
    looking = state(looks_past=True, standing_since=9.0)
    here = contexts.standing(12.0)
    assert not moves.stop_before(looking, here, CONFIG, CONFIG.behaviour.near_stop, 7).task.looks_past
    assert moves.stop_before(looking, here, CONFIG, 0.4, 7).task.looks_past  # drives up to it first
    assert not moves.plan_accepted(looking, some_plan()).task.looks_past


# -- goals and segments ---------------------------------------------------------------------------------


def test_another_goal_is_known_by_nothing_of_the_last_one() -> None:
    old, new = Pose2(1.0, 2.0, 3.0), Pose2(4.0, 5.0, 6.0)
    estimate = GoalEstimate(status=GoalStatus.SEARCHING)
    known = {"planned": old, "pose": old, "followed": old, "estimate": estimate, "estimated_at": 9.0}
    before = arriving(**known, refusal="why", waiting=True, suspended=begun_for(None))
    after = moves.with_goal(before, new)
    forgotten = {"estimate": None, "estimated_at": None, "followed": None}
    assert after == put(before, planned=new, dock=new, pose=new, origin=GoalOrigin.GIVEN, **forgotten)


@pytest.mark.parametrize("phase", ON_ITS_WAY)
def test_a_stop_is_not_meant_any_more_for_another_goal(phase: Phase) -> None:
    s = moves.with_goal(planned(phase=phase, stop=stop_at(12.0)), None)
    assert begins_afresh(s)
    assert s.task.stop is None
    free = moves.with_goal(planned(phase=phase), None)
    assert (free.task.phase, free.plans.driven is None) == (phase, False)


def test_a_dock_known_a_little_better_stays_the_same_dock() -> None:
    old, new, seen = Pose2(1.0, 2.0, 0.3), Pose2(1.001, 2.0, 0.3), Pose2(1.1, 2.1, 0.3)
    known = {"estimate": GoalEstimate(status=GoalStatus.SEARCHING), "estimated_at": 9.0}
    before = arriving(planned=old, pose=old, suspended=begun_for(None), **known)
    given = GoalOrigin.GIVEN
    assert moves.with_goal_corrected(before, new) == put(before, planned=new, pose=new, origin=given)
    followed = put(before, followed=seen, pose=seen)
    assert moves.with_goal_corrected(followed, new) == put(followed, planned=new, origin=given)


def test_the_next_segment_knows_the_goal_where_the_vehicle_is_and_the_queue_and_nothing_else() -> None:
    goal = Pose2(1.0, 2.0, 3.0)
    kept: dict[str, Any] = {
        "planned": goal,
        "pose": Pose2(1.1, 2.0, 3.0),
        "estimate": GoalEstimate(status=GoalStatus.SEARCHING),
        "estimated_at": 9.0,
        "poses": PoseHistory().noted(9.0, goal, length=1.0),
        "queue": (QueuedCommand(9.0, 0.1, 0.2),),
        "standing_since": 9.0,
        "time": 9.1,
        "offset": 3.0,
        "monitor": StateMonitor(at=9.1),
        "area": after_changes(5),
    }
    s = planned(**kept, stop=stop_at(3.0), waiting=True, latched="why")
    staged = segments_of(PATH, with_method(ControllerConfig(), "separated"))
    s = put(s, successor=CartesianPose())
    for segments in ((BEFORE, *SEGMENTS), staged):
        after = moves.next_segment(put(s, begin=np.zeros(6), segments=segments))
        assert after == state(**kept, segments=segments[1:])
