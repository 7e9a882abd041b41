"""Orders to a controller: what each makes of its state."""

from __future__ import annotations

from dataclasses import replace

import pytest

from geometry import InputError, Pose2, ReferencePath
from rti_mpcc.behaviour.transitions import ANY, Event, transition_on
from rti_mpcc.config import ControllerConfig
from rti_mpcc.orders import Follow, GoOn, GoTo, Stand, carried_out
from rti_mpcc.planning.goals import GoalTerms
from rti_mpcc.planning.state import ControllerState, Phase, RouteState
from rti_mpcc.planning.surroundings import Surroundings
from rti_mpcc.rerouting import Rerouter, standing_route
from tests.rti_mpcc.planned import manoeuvre_along
from tests.rti_mpcc.states import NOW, arriving, put, some_plan, stop_at
from tests.rti_mpcc.yards import YARD

CONFIG = ControllerConfig(dead_time=0.2)
WAY = manoeuvre_along(ReferencePath.from_segments(Pose2(1.0, 2.0, 0.3), [(-1, 0.0, 2.0)]))
GOAL = Pose2(4.0, 5.0, 0.6)


def rerouter() -> Rerouter:
    return Rerouter(YARD, CONFIG)


def state_in(phase: Phase, **values: object) -> ControllerState:
    s = arriving(phase=phase, driven=some_plan(), **values)
    return replace(s, route=RouteState(end=s.path.end), area=Surroundings.in_area(YARD))


@pytest.mark.parametrize("phase", ANY, ids=lambda phase: phase.name)
def test_told_to_stand_it_waits_and_keeps_the_plan_that_it_brakes_along(phase: Phase) -> None:
    s = state_in(phase)
    after = carried_out(s, Stand(), rerouter())
    assert after.task.phase is Phase.WAITING
    assert (after.plans, after.goal, after.task.segments) == (s.plans, s.goal, s.task.segments)
    assert carried_out(s, Stand(), None).task.phase is Phase.WAITING


@pytest.mark.parametrize("phase", ANY, ids=lambda phase: phase.name)
def test_told_to_go_on_only_one_that_waits_begins_again(phase: Phase) -> None:
    s = state_in(phase, standing_since=NOW - 60.0)
    after = carried_out(s, GoOn(), rerouter())
    if phase is not Phase.WAITING:
        assert after is s
        return
    assert after.task.phase is Phase.STARTING
    assert (after.task.arrival, after.plans.driven) == (None, None)
    assert after.task.segments == s.task.segments
    # It has not looked for a plan for a minute: that it stood was meant.
    assert after.vehicle.standing_since == s.now
    assert put(after, standing_since=None).vehicle.standing_since is None


def test_told_to_go_on_where_there_is_no_way_it_plans_one() -> None:
    _, segments = standing_route(GOAL)
    s = put(state_in(Phase.WAITING), segments=segments)
    assert carried_out(s, GoOn(), rerouter()).task.phase is Phase.PLANNING
    stopped = put(state_in(Phase.WAITING), stop=stop_at(12.0))
    assert carried_out(stopped, GoOn(), rerouter()).task.phase is Phase.STARTING


@pytest.mark.parametrize("phase", ANY, ids=lambda phase: phase.name)
def test_told_to_go_to_a_goal_it_plans_a_way_and_knows_nothing_else_of_that(phase: Phase) -> None:
    terms = GoalTerms(tolerance=(0.1, 0.1, 0.1), detected=True)
    s = put(state_in(phase, stop=stop_at(12.0)), followed=Pose2(9.0, 9.0, 0.0), refusal="no", waiting=True)
    s = replace(s, route=replace(s.route, fixed=True)) if s.route else s
    after = carried_out(s, GoTo(goal=GOAL, terms=terms), rerouter())
    goal = after.goal
    assert after.task.phase is Phase.PLANNING
    assert (goal.planned, goal.dock, goal.pose, goal.terms) == (GOAL, GOAL, GOAL, terms)
    assert (goal.followed, goal.estimate, goal.refusal, goal.waiting) == (None, None, "", False)
    assert after.route is not None
    assert (after.route.why, after.route.fixed) == ("another goal", False)
    assert (after.task.stop, after.plans.driven) == (None, None)


@pytest.mark.parametrize("phase", ANY, ids=lambda phase: phase.name)
def test_told_to_follow_a_manoeuvre_it_drives_that_and_plans_no_other(phase: Phase) -> None:
    after = carried_out(state_in(phase), Follow(manoeuvre=WAY), rerouter())
    assert after.task.phase is Phase.STARTING
    assert after.task.segments == WAY.segments
    assert after.goal.planned == WAY.goal
    assert after.route is not None
    assert (after.route.fixed, after.route.manoeuvre, after.route.ways) == (True, WAY, 1)
    # Whoever stands comes to rest on it, and another goal is free to plan again.
    later = carried_out(carried_out(after, Stand(), rerouter()), GoTo(goal=GOAL), rerouter())
    assert later.route is not None
    assert not later.route.fixed


@pytest.mark.parametrize("order", [GoTo(goal=GOAL), Follow(manoeuvre=WAY)], ids=["go to", "follow"])
def test_a_controller_that_plans_no_ways_refuses_goals_and_manoeuvres(order: GoTo | Follow) -> None:
    with pytest.raises(
        InputError, match="this controller drives its path only: its settings have no recovery"
    ):
        carried_out(arriving(), order, None)


@pytest.mark.parametrize("phase", ANY, ids=lambda phase: phase.name)
def test_nothing_but_an_order_ends_the_waiting(phase: Phase) -> None:
    """Not an obstacle, nor another goal, nor a mistake."""
    waiting = transition_on(state_in(phase), Event.TOLD_TO_STAND)
    assert waiting.task.phase is Phase.WAITING
    ends = (Event.TOLD_TO_GO_ON, Event.WAY_LOST, Event.WAY_PLANNED)
    for event in Event:
        if event not in ends:
            assert transition_on(waiting, event).task.phase is Phase.WAITING, event
