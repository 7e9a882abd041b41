"""When the vehicle contours and when it arrives, and the time planned for that."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from geometry import Pose2
from rti_mpcc.baselines import segments_of
from rti_mpcc.config import ControllerConfig, Limits, Method
from rti_mpcc.model.delay import QueuedCommand
from rti_mpcc.model.layout import STATES, THETA
from rti_mpcc.ocp.targets import Target
from rti_mpcc.planning import schedule
from rti_mpcc.planning.arrival import time_to_go
from rti_mpcc.planning.context import PlanningContext
from rti_mpcc.planning.schedule import rescheduled, scheduled, scheduled_past_goal
from rti_mpcc.planning.state import Arrival, ControllerState, Halt, Phase, SuspendedSearch
from rti_mpcc.types import Array
from tests.rti_mpcc.states import (
    BACK,
    PATH,
    SEGMENTS,
    arrival_at,
    arrives_at,
    arriving,
    backing,
    backing_up,
    begun_for,
    contexts,
    contouring,
    decided,
    put,
    state,
    target_at,
)

CONFIG = ControllerConfig(dead_time=0.2)
RETRIES, LEAST = CONFIG.retries, CONFIG.arrival_timing.least_time
SEPARATED = CONFIG.model_copy(update={"method": Method.SEPARATED})
SWITCHED = CONFIG.model_copy(update={"method": Method.SWITCHED})


def arrival_of(s: ControllerState | None) -> Arrival:
    assert s is not None
    assert s.task.arrival is not None
    return s.task.arrival


def due(s: ControllerState, context: PlanningContext) -> float:
    return arrival_of(decided(s, context, CONFIG)).at


# -- the time to the arrival -----------------------------------------------------------------------------


def test_the_time_of_arrival_stays_but_not_nearer_than_the_floor() -> None:
    assert due(arriving(at=20.0), contexts()) == 20.0
    late = decided(arriving(at=10.9), contexts(distance=0.1, speed=0.3), CONFIG)
    assert arrives_at(late) == pytest.approx(10.2 + LEAST)
    assert arrival_of(late).overdue_since == 10.0
    later = decided(late, contexts(distance=0.1, speed=0.3, now=10.1, begin=10.3), CONFIG)
    assert arrives_at(later) == pytest.approx(10.3 + LEAST)
    assert arrival_of(later).overdue_since == 10.0


@pytest.mark.parametrize("phase", [phase for phase in Phase if phase is not Phase.ARRIVING])
def test_time_is_kept_of_arrivals_under_way_only(phase: Phase) -> None:
    s = arriving(phase=phase, at=10.9)
    assert rescheduled(s, contexts(distance=0.1, speed=0.3), CONFIG) is s


def test_an_arrival_is_not_overdue_any_more_when_its_target_has_moved() -> None:
    s = arriving(arrival=arrival_at(11.2, overdue_since=9.0))
    moved = contexts(target=target_at(20.5), distance=10.5)
    assert arrival_of(decided(s, moved, CONFIG)).overdue_since is None


def test_an_arrival_with_time_to_go_is_not_overdue() -> None:
    s = arriving(arrival=arrival_at(20.0, overdue_since=9.0))
    assert arrival_of(rescheduled(s, contexts(), CONFIG)) == arrival_at(20.0)


def test_an_arrival_that_lost_cycles_gets_its_time_back() -> None:
    gap = (QueuedCommand(10.2 - 5.0, 0.0, 0.0),)
    full = 10.2 + time_to_go(10.0, 1.0, CONFIG.arrival_acceleration, LEAST)
    assert due(arriving(at=16.0, queue=gap), contexts()) == pytest.approx(full)
    none = (QueuedCommand(10.2 - CONFIG.cycle, 0.0, 0.0),)
    assert due(arriving(at=16.0, queue=none), contexts()) == 16.0


def test_an_arrival_that_has_fallen_far_behind_gets_the_time_that_its_way_takes() -> None:
    """As behind something that slowed it: to catch up it would have to leave all comfort behind."""
    needed = time_to_go(10.0, 1.0, CONFIG.arrival_acceleration, LEAST)
    some, little = (10.2 + share * needed for share in (0.51, 0.49))
    assert due(arriving(at=some), contexts()) == some
    assert due(arriving(at=little), contexts()) == pytest.approx(10.2 + needed)


def test_near_its_target_a_late_arrival_keeps_its_time_and_may_try_again() -> None:
    near = RETRIES.retreat_reach
    for distance, waits in ((0.9 * near, False), (1.1 * near, True)):
        needed = time_to_go(distance, 1.0, CONFIG.arrival_acceleration, LEAST)
        at = 10.2 + 0.49 * needed
        context = contexts(distance=distance)
        assert at >= context.begin + LEAST
        assert (due(arriving(at=at), context) > at) == waits


def test_an_arrival_that_hardly_drives_keeps_its_time_so_that_it_is_overdue_one_day() -> None:
    assert due(arriving(at=12.0), contexts(speed=0.05)) == 12.0


def test_an_arrival_that_halts_gets_its_time_back() -> None:
    full = 10.2 + time_to_go(10.0, 1.0, CONFIG.arrival_acceleration, LEAST)
    assert due(arriving(at=12.0, halt=Halt()), contexts()) == pytest.approx(full)
    assert due(arriving(at=40.0, halt=Halt()), contexts()) == 40.0


def test_a_target_that_moves_is_a_new_arrival() -> None:
    moved = contexts(target=target_at(20.5), distance=10.5)
    expected = 10.2 + time_to_go(10.5, 1.0, CONFIG.arrival_acceleration, LEAST)
    assert due(arriving(), moved) == pytest.approx(expected)
    slightly = contexts(target=target_at(20.05), distance=10.05)
    assert due(arriving(), slightly) == 20.0


def test_a_target_that_creeps_away_is_a_new_arrival_too() -> None:
    s, times = arriving(), []
    for moves in range(1, 6):
        there = 20.0 + 0.03 * moves
        s = decided(s, contexts(target=target_at(there), distance=there - 10.0), CONFIG)
        times.append(arrives_at(s))
    assert times[:3] == [20.0] * 3
    assert times[3] == pytest.approx(10.2 + time_to_go(10.12, 1.0, CONFIG.arrival_acceleration, LEAST))
    assert times[4] == times[3]


def test_begin_with_an_arrival_within_reach_and_with_contouring_beyond() -> None:
    near = scheduled(state(), contexts(), CONFIG)
    assert arrives_at(near) == pytest.approx(10.2 + time_to_go(10.0, 1.0, CONFIG.arrival_acceleration, LEAST))
    assert arrival_of(near).timed_for == contexts().target.pose
    slow = ControllerConfig(limits=Limits(speed=1.0))
    assert scheduled(state(), contexts(distance=90.0), slow).task.arrival is None
    assert scheduled(state(), contexts(), ControllerConfig.paper()).task.arrival is None


# -- other methods ---------------------------------------------------------------------------------------


def at(theta: float) -> Array:
    here = np.zeros(STATES)
    here[THETA] = theta
    return here


def test_the_final_objective_is_due_so_much_of_the_path_before_the_stop() -> None:
    reach = SWITCHED.weights.transition_reach
    stop = contexts().target.stop
    near, far = (contexts(state=at(stop - reach * share)) for share in (0.99, 1.01))
    switched = contouring(segments=segments_of(PATH, SWITCHED))
    assert schedule.final_due(switched, near)
    assert not schedule.final_due(switched, far)
    assert not schedule.final_due(contouring(), near)
    assert not schedule.final_due(put(switched, final=True), near)
    assert not schedule.final_due(put(switched, segments=(BACK, *switched.task.segments)), near)
    assert not schedule.final_due(switched, replace(near, free=False))
    beside = replace(far, error=Pose2(-0.5 * reach, 0.0, 0.0))
    assert not schedule.final_due(switched, beside)


@pytest.mark.parametrize("config", [SWITCHED, SEPARATED])
def test_a_segment_with_a_final_objective_plans_no_arrival(config: ControllerConfig) -> None:
    assert schedule.arrival_due(contouring(), contexts(), CONFIG)
    assert not schedule.arrival_due(arriving(), contexts(), CONFIG)
    *before, goal = segments_of(PATH, config)
    last = contouring(segments=(goal,))
    assert not schedule.arrival_due(last, contexts(), config)
    assert scheduled(last, contexts(), config).task.arrival is None
    for segment in (BACK, *before):
        on_the_way = contouring(segments=(segment, goal))
        assert schedule.arrival_due(on_the_way, contexts(ends_at_goal=False), config)


def test_a_contouring_vehicle_without_an_arrival_yet_brakes_in_time() -> None:
    needed = 1.0 / (2.0 * CONFIG.comfort_acceleration)
    near, far = contexts(distance=0.99 * needed), contexts(distance=1.01 * needed)
    assert schedule.too_late(contouring(), near, CONFIG)
    assert not schedule.too_late(contouring(), far, CONFIG)
    assert not schedule.too_late(arriving(), near, CONFIG)
    assert not schedule.too_late(contouring(final=True), near, SEPARATED)


# -- another try -----------------------------------------------------------------------------------------


def test_backing_off_is_for_another_try_near_the_goal() -> None:
    assert schedule.retreat(arriving(), contexts.standing(19.8), CONFIG) == 0.0
    assert schedule.retreat(arriving(restarts=1), contexts.standing(19.8), CONFIG) == RETRIES.retreat_speed
    assert schedule.retreat(arriving(restarts=1), contexts.standing(17.5), CONFIG) == 0.0


def test_another_try_near_the_goal_has_time_to_back_off_first() -> None:
    near = contexts.standing(19.8)
    first, again = (arrives_at(scheduled(arriving(restarts=tries), near, CONFIG)) for tries in (0, 1))
    assert first == pytest.approx(10.2 + time_to_go(0.2, 0.0, 0.36, LEAST))
    assert again == pytest.approx(10.2 + RETRIES.retry_time)


def test_a_vehicle_that_stands_beside_its_goal_may_back_off_at_once() -> None:
    beside = contexts.standing(19.9, error=Pose2(-0.1, 0.2, 0.0))
    after = scheduled(arriving(standing_since=9.0), beside, CONFIG)
    assert after.task.restarts == 1
    assert arrives_at(after) == pytest.approx(10.2 + RETRIES.retry_time)
    before = contexts.standing(19.0)
    assert scheduled(arriving(standing_since=9.0), before, CONFIG).task.restarts == 0


# -- past the goal, and back up into it ------------------------------------------------------------------


def test_backing_up_takes_the_way_past_the_goal_and_the_way_back() -> None:
    s = arriving()
    onward, past = scheduled(s, contexts(), CONFIG), scheduled_past_goal(s, contexts(), CONFIG)
    assert past is not None
    assert past.task.segment.reverses_into_goal
    assert not onward.task.segment.reverses_into_goal
    acceleration = CONFIG.arrival_acceleration
    assert arrives_at(past) == pytest.approx(
        10.2 + time_to_go(10.0 + RETRIES.beyond_goal, 1.0, acceleration, LEAST) + RETRIES.reverse_time
    )
    assert arrival_of(past).at > arrival_of(onward).at + RETRIES.reverse_time
    assert put(past, beyond=None, at=arrival_of(onward).at) == onward


@pytest.mark.parametrize(
    "config",
    [
        ControllerConfig.paper(dead_time=0.2),
        SEPARATED,
        SWITCHED,
        CONFIG.model_copy(update={"arrival": False}),
    ],
)
def test_only_planned_arrivals_of_the_dynamic_method_back_up(config: ControllerConfig) -> None:
    assert not config.recovers
    assert scheduled_past_goal(arriving(), contexts(), config) is None


@pytest.mark.parametrize("changes", [{"ends_at_goal": False}, {"free": False}])
def test_none_backs_up_into_a_cusp_or_a_stop(changes: dict[str, bool]) -> None:
    assert CONFIG.recovers
    assert scheduled_past_goal(arriving(), contexts(**changes), CONFIG) is None


def test_none_backs_up_while_contouring_is_due() -> None:
    far = contexts(distance=200.0)
    assert scheduled(arriving(), far, CONFIG).task.arrival is None
    assert scheduled_past_goal(arriving(), far, CONFIG) is None


def begun_to(goal: Target, *, reverse_into_goal: bool) -> SuspendedSearch:
    segment = backing_up() if reverse_into_goal else SEGMENTS[0]
    return begun_for(None, target=goal, segment=segment, arrival=arrival_at(40.0), begin=10.15)


def test_a_search_for_backing_up_goes_on_with_its_time_of_arrival() -> None:
    context = contexts()
    s = arriving(suspended=begun_to(context.target, reverse_into_goal=True))
    after = scheduled_past_goal(s, context, CONFIG)
    assert after is not None
    assert after.task.segment.reverses_into_goal
    assert arrival_of(after) == arrival_at(40.0)
    assert after.plans.suspended == s.plans.suspended
    elsewhere = scheduled_past_goal(s, replace(context, target=target_at(19.0)), CONFIG)
    assert elsewhere is not None
    assert elsewhere.plans.suspended is None
    assert elsewhere.task.segment.reverses_into_goal
    assert arrival_of(elsewhere).at != 40.0


def test_a_search_onward_that_goes_on_is_not_for_backing_up() -> None:
    context = contexts()
    s = backing(suspended=begun_to(context.target, reverse_into_goal=False))
    assert arrival_of(scheduled(s, context, CONFIG)) == arrival_at(40.0)


def test_backing_up_is_not_sought_from_a_search_onward() -> None:
    context = contexts()
    s = arriving(suspended=begun_to(context.target, reverse_into_goal=False))
    after = scheduled_past_goal(s, context, CONFIG)
    assert after is not None
    assert after.task.segment.reverses_into_goal
    assert after.plans.suspended is None
    assert arrival_of(after).at != 40.0


def test_one_that_backs_up_may_go_back_wherever_its_bounds_let_it() -> None:
    for x in (19.8, 17.5, 5.0):
        assert schedule.retreat(backing(), contexts.standing(x), CONFIG) == RETRIES.retreat_speed
    assert schedule.retreat(arriving(), contexts.standing(17.5), CONFIG) == 0.0


@pytest.mark.parametrize("x", [10.0, 20.5])
def test_a_goal_that_moves_leaves_one_that_backs_up_its_time(x: float) -> None:
    """It may be past the goal already: no way is left onward, but the one back."""
    here = np.array([x, 0.0, 0.0, 0.2, 0.0, min(x, 20.0)])
    moved = contexts(target=target_at(19.8), state=here, distance=max(19.8 - x, 0.0), speed=0.2)
    assert due(backing(at=30.0), moved) == 30.0
    onward = due(arriving(at=30.0), moved)
    assert onward < 30.0
    assert due(backing(at=11.0), moved) == pytest.approx(max(onward, 11.0))
