from __future__ import annotations

from dataclasses import FrozenInstanceError, replace
from typing import Any

import numpy as np
import pytest

from estimation import GoalEstimate, GoalStatus, PoseHistory
from geometry import Pose2, ReferencePath
from rti_mpcc.config import ControllerConfig, Limits, Method
from rti_mpcc.model.delay import QueuedCommand
from rti_mpcc.model.layout import CONTROLS, STATES, THETA
from rti_mpcc.ocp.targets import Target, TargetKind
from rti_mpcc.planning import legs, route, stops
from rti_mpcc.planning.arrival import FLOOR, time_to_go
from rti_mpcc.planning.guess import BACK_TIME, PASS
from rti_mpcc.planning.memory import (
    ControllerMemory,
    Halt,
    Phase,
    PlannedStop,
    PlanningContext,
    SuspendedSearch,
)
from rti_mpcc.planning.plausibility import StateMonitor
from rti_mpcc.types import Array, Trajectory

CONFIG = ControllerConfig(dead_time=0.2)
NEAR = Pose2(0.01, -0.01, 0.01)
"""Inside half the tolerance."""


def decided(
    memory: ControllerMemory, situation: PlanningContext, config: ControllerConfig
) -> ControllerMemory:
    return route.decide(route.noticed(memory, situation), situation, config)


def target_at(x: float) -> Target:
    return Target(pose=Pose2(x, 0.0, 0.0), theta=x, theta_end=20.0, kind=TargetKind.POSE)


def arriving(**changes: Any) -> ControllerMemory:
    target = target_at(20.0)
    usual: dict[str, Any] = {
        "phase": Phase.ARRIVING,
        "arrive_at": 20.0,
        "timed_for": target.pose,
        "target": target,
    }
    return ControllerMemory(**{**usual, **changes})


def stop_at(theta: float) -> PlannedStop:
    return PlannedStop(at=theta, goal=None, obstacles=0, since=0.0)


def test_an_accepted_plan_is_driven_and_lets_nothing_hold_the_vehicle(situations: Any) -> None:
    plan = Trajectory(times=np.zeros(2), states=np.zeros((2, STATES)), controls=np.zeros((1, CONTROLS)))
    memory = route.accepted(arriving(latched="why", looked_at=1.0), plan, situations())
    assert memory.fit is plan
    assert memory.driven is plan
    assert memory.accepted_at == 10.0
    assert (memory.latched, memory.looked_at) == ("", None)


# -- phases ----------------------------------------------------------------------------------------------


def test_a_plan_under_way_goes_on(situations: Any) -> None:
    memory = arriving()
    after = decided(memory, situations(), CONFIG)
    assert after == replace(memory, target=situations().target)


def test_a_slow_vehicle_that_would_stop_inside_half_the_tolerance_settles(situations: Any) -> None:
    after = decided(arriving(), situations(speed=0.2, stop_error=NEAR), CONFIG)
    assert after.phase is Phase.SETTLING


@pytest.mark.parametrize(
    "changes",
    [
        {"speed": 0.35, "stop_error": NEAR},
        {"speed": 0.2, "stop_error": Pose2(0.04, 0.0, 0.0)},
        {"speed": 0.2, "stop_error": Pose2(0.0, -0.04, 0.0)},
        {"speed": 0.2, "stop_error": Pose2(0.0, 0.0, 0.03)},
    ],
)
def test_a_fast_vehicle_or_one_off_the_goal_drives_its_plan(changes: dict[str, Any], situations: Any) -> None:
    assert decided(arriving(), situations(**changes), CONFIG).phase is Phase.ARRIVING


def test_a_settling_vehicle_that_stands_holds(situations: Any) -> None:
    memory = arriving(phase=Phase.SETTLING)
    assert decided(memory, situations.standing(), CONFIG).phase is Phase.HOLDING


def test_a_settling_vehicle_that_stands_outside_the_tolerance_does_not_hold(situations: Any) -> None:
    memory = arriving(phase=Phase.SETTLING)
    assert decided(memory, situations.standing(19.85), CONFIG).phase is Phase.STARTING
    memory = decided(memory, situations.standing(19.94), CONFIG)
    assert memory.phase is Phase.SETTLING
    assert decided(memory, situations.standing(19.96), CONFIG).phase is Phase.HOLDING
    later = situations.standing(19.94, now=10.01 + route.DOUBT_TIME)
    assert decided(memory, later, CONFIG).phase is Phase.STARTING


def test_a_settling_vehicle_whose_goal_moves_away_begins_again(situations: Any) -> None:
    memory = arriving(phase=Phase.SETTLING)
    after = decided(memory, situations(speed=0.2, stop_error=Pose2(0.3, 0.0, 0.0)), CONFIG)
    assert after.phase is Phase.STARTING
    assert after.driven is None


def test_a_holding_vehicle_holds_inside_the_tolerance_and_begins_again_outside(situations: Any) -> None:
    memory = arriving(phase=Phase.HOLDING)
    assert decided(memory, situations.standing(19.96), CONFIG).phase is Phase.HOLDING
    assert decided(memory, situations.standing(19.90), CONFIG).phase is Phase.STARTING


def test_a_holding_vehicle_measured_just_outside_for_a_moment_holds(situations: Any) -> None:
    memory = arriving(phase=Phase.HOLDING)
    for now in (10.0, 10.1, 10.2):
        memory = decided(memory, situations.standing(19.94, now=now), CONFIG)
        assert memory.phase is Phase.HOLDING
    inside = decided(memory, situations.standing(19.96, now=10.25), CONFIG)
    assert inside.outside_since is None
    after = decided(memory, situations.standing(19.94, now=10.0 + route.DOUBT_TIME), CONFIG)
    assert after.phase is Phase.STARTING


def test_noise_on_the_speed_is_no_motion(situations: Any) -> None:
    memory = arriving(standing_since=8.0)
    noisy = situations.standing(19.96, measured_speed=0.035)
    assert decided(memory, noisy, CONFIG).standing_since == 8.0
    assert decided(arriving(), noisy, CONFIG).standing_since is None
    cusp = situations.standing(20.0, last_part=False, measured_speed=0.035)
    assert not legs.may_change_direction(memory, cusp, 0.2)


def test_noise_does_not_take_a_vehicle_from_its_goal_but_a_goal_a_little_away_does(situations: Any) -> None:
    """Measured in and out of the tolerance by turns it stays; measured outside for a while it goes."""
    memory = arriving(phase=Phase.HOLDING)
    for cycle in range(100):
        x = 19.97 if cycle % 4 == 0 else 19.94
        memory = decided(memory, situations.standing(x, now=0.05 * cycle), CONFIG)
        assert memory.phase is Phase.HOLDING
    for time, x, phase in (
        (6.0, 20.0, Phase.HOLDING),
        (7.0, 19.94, Phase.HOLDING),
        (7.0 + 0.9 * route.DOUBT_TIME, 19.94, Phase.HOLDING),
        (7.0 + 1.1 * route.DOUBT_TIME, 19.94, Phase.STARTING),
    ):
        memory = decided(memory, situations.standing(x, now=time), CONFIG)
        assert memory.phase is phase
    assert memory.outside_since is None


def test_a_vehicle_held_before_something_in_the_way_holds_wherever_it_is(situations: Any) -> None:
    memory = arriving(phase=Phase.HOLDING, stop=stop_at(15.0))
    assert decided(memory, situations.standing(14.0, free=False), CONFIG).phase is Phase.HOLDING


def test_a_vehicle_that_stands_outside_the_tolerance_tries_a_few_times_more(situations: Any) -> None:
    memory = arriving(standing_since=5.0, overdue_since=9.0)
    for attempt in range(route.RESTARTS):
        memory = decided(memory, situations.standing(19.8), CONFIG)
        assert memory.phase is Phase.STARTING
        assert memory.restarts == attempt + 1
        memory = replace(memory, phase=Phase.ARRIVING, arrive_at=11.0, overdue_since=9.0)
    assert decided(memory, situations.standing(19.8), CONFIG).phase is Phase.STALLED


def test_a_plan_that_has_just_begun_is_given_time_to_move_off(situations: Any) -> None:
    memory = arriving(standing_since=5.0, driving_since=9.5)
    assert decided(memory, situations.standing(12.0), CONFIG).phase is Phase.ARRIVING


def test_a_vehicle_that_stands_has_not_stalled_while_its_arrival_has_time_to_go(situations: Any) -> None:
    """It begins slowly, or turns about: over 0.4 m in 10 s it takes a second to leave standstill."""
    after = decided(arriving(standing_since=5.0), situations.standing(19.8), CONFIG)
    assert after.phase is Phase.ARRIVING


@pytest.mark.parametrize(
    ("x", "phase"), [(19.8, Phase.STARTING), (19.96, Phase.SETTLING), (19.99, Phase.SETTLING)]
)
def test_an_arrival_long_overdue_ends_even_if_noise_hides_that_it_stands(
    x: float, phase: Phase, situations: Any
) -> None:
    memory = arriving(arrive_at=10.2)
    for cycle in range(round(route.OVERDUE / 0.05)):
        creeping = situations.standing(19.8, now=10.0 + 0.05 * cycle, begin=10.2 + 0.05 * cycle)
        memory = decided(memory, replace(creeping, measured_speed=0.03), CONFIG)
        assert memory.phase is Phase.ARRIVING
    last = situations.standing(x, now=10.01 + route.OVERDUE, begin=10.21 + route.OVERDUE, measured_speed=0.03)
    after = decided(memory, last, CONFIG)
    assert after.phase is phase
    if phase is Phase.STARTING:
        assert (after.restarts, after.overdue_since) == (1, None)


def test_an_arrival_is_not_overdue_any_more_when_its_target_has_moved(situations: Any) -> None:
    memory = arriving(arrive_at=11.2, overdue_since=9.0)
    moved = situations(target=target_at(20.5), way=10.5)
    assert decided(memory, moved, CONFIG).overdue_since is None


def test_a_stalled_vehicle_waits_for_another_target(situations: Any) -> None:
    memory = arriving(phase=Phase.STALLED, restarts=2)
    assert decided(memory, situations.standing(19.8), CONFIG).phase is Phase.STALLED
    after = decided(memory, situations.standing(19.8, target=target_at(20.5)), CONFIG)
    assert after.phase is Phase.STARTING
    assert after.restarts == 0


def test_a_stalled_vehicle_is_not_woken_by_noise_but_by_a_target_that_creeps_away(situations: Any) -> None:
    memory = arriving(phase=Phase.STALLED, restarts=2)
    for moves in range(1, 3):
        memory = decided(memory, situations.standing(19.8, target=target_at(20.0 + 0.01 * moves)), CONFIG)
        assert memory.phase is Phase.STALLED
    memory = decided(memory, situations.standing(19.8, target=target_at(20.03)), CONFIG)
    assert memory.phase is Phase.STARTING


def test_deciding_changes_nothing_but_what_it_returns(situations: Any) -> None:
    memory, situation = arriving(), situations()
    state = situation.state.copy()
    assert decided(memory, situation, CONFIG) == decided(memory, situation, CONFIG)
    np.testing.assert_array_equal(situation.state, state)
    with pytest.raises(FrozenInstanceError):
        memory.part = 1  # type: ignore[misc]


# -- standing --------------------------------------------------------------------------------------------


def test_standing_is_counted_from_its_first_cycle_and_ends_with_motion(situations: Any) -> None:
    memory = decided(arriving(), situations.standing(12.0, now=3.0), CONFIG)
    assert memory.standing_since == 3.0
    memory = decided(memory, situations.standing(12.0, now=3.5), CONFIG)
    assert memory.standing_since == 3.0
    assert route.is_stationary(memory, situations.standing(12.0, now=4.0), 1.0)
    assert not route.is_stationary(memory, situations.standing(12.0, now=3.9), 1.0)
    assert decided(memory, situations(now=4.0), CONFIG).standing_since is None


def test_a_vehicle_about_to_move_does_not_stand(situations: Any) -> None:
    """Measured at rest, but the queued commands will have it moving."""
    state = np.array([12.0, 0.0, 0.0, 0.1, 0.0, 12.0])
    after = decided(arriving(), situations.standing(12.0, state=state), CONFIG)
    assert after.standing_since is None


# -- the time to the arrival -----------------------------------------------------------------------------


def test_the_time_of_arrival_stays_but_not_nearer_than_the_floor(situations: Any) -> None:
    assert decided(arriving(arrive_at=20.0), situations(), CONFIG).arrive_at == 20.0
    near = situations(way=0.1, speed=0.3)
    late = decided(arriving(arrive_at=10.9), near, CONFIG).arrive_at
    assert late == pytest.approx(10.2 + FLOOR)


def test_an_arrival_that_lost_cycles_gets_its_time_back(situations: Any) -> None:
    gap = (QueuedCommand(10.2 - 5.0, 0.0, 0.0),)
    after = decided(replace(arriving(arrive_at=12.0), queue=gap), situations(), CONFIG).arrive_at
    assert after == pytest.approx(10.2 + time_to_go(10.0, 1.0, CONFIG.arrival_acceleration))
    none = (QueuedCommand(10.2 - CONFIG.cycle, 0.0, 0.0),)
    assert decided(replace(arriving(arrive_at=12.0), queue=none), situations(), CONFIG).arrive_at == 12.0


def test_a_target_that_moves_is_a_new_arrival(situations: Any) -> None:
    moved = situations(target=target_at(20.5), way=10.5)
    after = decided(arriving(), moved, CONFIG)
    expected = 10.2 + time_to_go(10.5, 1.0, CONFIG.arrival_acceleration)
    assert after.arrive_at == pytest.approx(expected)
    slightly = situations(target=target_at(20.05), way=10.05)
    assert decided(arriving(), slightly, CONFIG).arrive_at == 20.0


def test_a_target_that_creeps_away_is_a_new_arrival_too(situations: Any) -> None:
    memory, times = arriving(), []
    for moves in range(1, 6):
        there = 20.0 + 0.03 * moves
        memory = decided(memory, situations(target=target_at(there), way=there - 10.0), CONFIG)
        times.append(memory.arrive_at)
    assert times[:3] == [20.0] * 3
    assert times[3] == pytest.approx(10.2 + time_to_go(10.12, 1.0, CONFIG.arrival_acceleration))
    assert times[4] == times[3]


def test_begin_with_an_arrival_within_reach_and_with_contouring_beyond(situations: Any) -> None:
    memory = ControllerMemory()
    near = route.begin_phase(memory, situations(), CONFIG)
    assert near.arrive_at == pytest.approx(10.2 + time_to_go(10.0, 1.0, CONFIG.arrival_acceleration))
    slow = ControllerConfig(limits=Limits(speed=1.0))
    assert route.begin_phase(memory, situations(way=90.0), slow).arrive_at is None
    assert route.begin_phase(memory, situations(), ControllerConfig.paper()).arrive_at is None


@pytest.mark.parametrize(("arrive_at", "phase"), [(None, Phase.CONTOURING), (20.0, Phase.ARRIVING)])
def test_a_plan_that_was_found_is_driven(arrive_at: float | None, phase: Phase, situations: Any) -> None:
    after = route.begun(ControllerMemory(arrive_at=arrive_at), situations())
    assert after.phase is phase
    assert after.driving_since == 10.0


# -- parts -----------------------------------------------------------------------------------------------


def test_the_direction_changes_at_the_cusp_after_the_dead_time_at_rest(situations: Any) -> None:
    tolerance = route.CUSP_TOLERANCE
    at_cusp = situations.standing(19.95, last_part=False, tolerance=tolerance)
    assert legs.may_change_direction(ControllerMemory(standing_since=9.75), at_cusp, 0.2)
    assert not legs.may_change_direction(ControllerMemory(standing_since=9.85), at_cusp, 0.2)
    assert not legs.may_change_direction(ControllerMemory(), at_cusp, 0.2)
    last = replace(at_cusp, last_part=True)
    assert not legs.may_change_direction(ControllerMemory(standing_since=5.0), last, 0.2)
    held = replace(at_cusp, free=False)
    assert not legs.may_change_direction(ControllerMemory(standing_since=5.0), held, 0.2)


def test_a_vehicle_that_stands_near_the_cusp_for_a_second_may_go_on(situations: Any) -> None:
    near = situations.standing(19.6, last_part=False, tolerance=route.CUSP_TOLERANCE)
    assert not legs.may_change_direction(ControllerMemory(standing_since=9.5), near, 0.2)
    assert legs.may_change_direction(ControllerMemory(standing_since=9.0), near, 0.2)
    far = situations.standing(19.4, last_part=False, tolerance=route.CUSP_TOLERANCE)
    assert not legs.may_change_direction(ControllerMemory(standing_since=5.0), far, 0.2)


def test_the_next_leg_knows_the_goal_where_the_vehicle_is_and_the_queue_and_nothing_else() -> None:
    queue = (QueuedCommand(9.0, 0.1, 0.2),)
    goal = Pose2(1.0, 2.0, 3.0)
    estimate = GoalEstimate(status=GoalStatus.SEARCHING)
    poses = PoseHistory().noted(9.0, goal, length=1.0)
    kept: dict[str, Any] = {
        "planned": goal,
        "goal": Pose2(1.1, 2.0, 3.0),
        "estimate": estimate,
        "estimated_at": 9.0,
        "poses": poses,
        "queue": queue,
        "standing_since": 9.0,
        "time": 9.1,
        "clock_offset": 3.0,
        "monitor": StateMonitor(at=9.1),
    }
    memory = arriving(**kept, restarts=1, stop=stop_at(3.0), waiting=True)
    assert legs.next_leg(memory, staged=False) == ControllerMemory(part=1, **kept)
    assert legs.next_leg(memory, staged=True) == ControllerMemory(part=0, cartesian=True, **kept)


SEPARATED = CONFIG.model_copy(update={"method": Method.SEPARATED})
SWITCHED = CONFIG.model_copy(update={"method": Method.SWITCHED})


def test_the_staging_pose_lies_before_the_goal_or_at_the_paths_end() -> None:
    part = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(1, 0.0, 20.0)]).parts[0]
    assert legs.staging_stop(part, Pose2(18.0, 1.0, 0.1), SEPARATED) == pytest.approx(11.0)
    assert legs.staging_stop(part, Pose2(5.0, 1.0, 0.1), SEPARATED) == 0.0
    assert legs.staging_stop(part, Pose2(23.0, 1.0, 0.1), SEPARATED) == 20.0
    assert legs.staging_stop(part, None, SEPARATED) == 20.0


def at(theta: float) -> Array:
    state = np.zeros(STATES)
    state[THETA] = theta
    return state


def test_the_switch_to_the_goal_pose_is_within_beta_of_it_on_the_last_leg(situations: Any) -> None:
    contouring = arriving(phase=Phase.CONTOURING, arrive_at=None)
    reach = CONFIG.weights.transition_reach
    stop = situations().target.stop
    near, far = (situations(state=at(stop - reach * share)) for share in (0.99, 1.01))
    assert route.cartesian_due(contouring, near, SWITCHED)
    assert not route.cartesian_due(contouring, far, SWITCHED)
    assert not route.cartesian_due(contouring, near, CONFIG)
    assert not route.cartesian_due(replace(contouring, cartesian=True), near, SWITCHED)
    assert not route.cartesian_due(contouring, replace(near, last_part=False), SWITCHED)
    beside = replace(far, error=Pose2(-0.5 * reach, 0.0, 0.0))
    assert not route.cartesian_due(contouring, beside, SWITCHED)


def test_a_vehicle_that_makes_for_the_pose_alone_plans_no_arrival(situations: Any) -> None:
    contouring = arriving(phase=Phase.CONTOURING, arrive_at=None)
    assert route.arrival_due(contouring, situations(), CONFIG)
    assert not route.arrival_due(contouring, situations(), SWITCHED)
    assert route.arrival_due(contouring, situations(last_part=False), SWITCHED)
    posing = replace(contouring, cartesian=True)
    assert not route.arrival_due(posing, situations(), SEPARATED)
    assert route.begin_phase(posing, situations(), SEPARATED).arrive_at is None


def test_a_vehicle_that_may_turn_about_stands_longer_before_it_is_stuck(situations: Any) -> None:
    standing = situations.standing(19.0)
    posing = arriving(phase=Phase.CONTOURING, arrive_at=None, cartesian=True)
    assert decided(replace(posing, standing_since=8.0), standing, SEPARATED).phase is Phase.CONTOURING
    long = replace(posing, standing_since=10.0 - route.TURNING_TIME)
    assert decided(long, standing, SEPARATED).phase is Phase.STARTING


# -- something in the way --------------------------------------------------------------------------------


def test_a_stop_is_made_for_or_kept_where_it_is_near(situations: Any) -> None:
    memory = stops.stop_before(arriving(), situations(), 4.0, 7)
    assert memory.phase is Phase.STARTING
    assert memory.stop == PlannedStop(at=14.0, goal=None, obstacles=7, since=10.0)
    near = stops.stop_before(arriving(), situations(), stops.NEAR_STOP, 7)
    assert near.phase is Phase.HOLDING
    behind = stops.stop_before(arriving(), situations(), -1.0, 7).stop
    assert behind is not None
    assert behind.at == 10.0


def test_it_looks_again_only_when_obstacles_have_changed_and_not_at_once(situations: Any) -> None:
    memory = stops.stop_before(arriving(), situations(), 4.0, 7)
    assert not stops.way_may_be_free(memory, 30.0, 7)
    assert not stops.way_may_be_free(memory, 10.0 + 0.9 * route.LOOK_AGAIN, 8)
    assert stops.way_may_be_free(memory, 10.0 + route.LOOK_AGAIN, 8)
    assert not stops.way_may_be_free(arriving(), 30.0, 8)
    goal = Pose2(20.0, 0.0, 0.0)
    known = stops.stop_before(arriving(goal=goal), situations(), 4.0, 7)
    assert not stops.way_may_be_free(replace(known, goal=Pose2(20.05, 0.0, 0.0)), 30.0, 7)
    assert stops.way_may_be_free(replace(known, goal=Pose2(20.2, 0.0, 0.0)), 30.0, 7)
    free = legs.released(memory)
    assert free.stop is None
    assert free.phase is Phase.STARTING


def test_from_a_stop_before_something_it_looks_once_more(situations: Any) -> None:
    moving = stops.stop_before(arriving(), situations(), stops.NEAR_STOP, 7)
    assert moving.phase is Phase.HOLDING
    assert not stops.way_may_be_free(moving, 10.0 + 0.9 * route.LOOK_AGAIN, 7)
    assert stops.way_may_be_free(moving, 10.0 + route.LOOK_AGAIN, 7)
    standing = replace(legs.released(moving), standing_since=9.0)
    there = stops.stop_before(standing, situations.standing(12.0), stops.NEAR_STOP, 7)
    assert there.phase is Phase.HOLDING
    assert not stops.way_may_be_free(there, 60.0, 7)
    assert stops.way_may_be_free(there, 60.0, 8)
    # Standing elsewhere it is not the place to look from.
    far = stops.stop_before(standing, situations.standing(12.0), 4.0, 7)
    assert stops.way_may_be_free(replace(far, phase=Phase.HOLDING), 60.0, 7)


def test_a_look_past_a_stop_ends_with_a_plan_or_back_at_the_stop(situations: Any) -> None:
    looking = replace(legs.released(arriving()), looks_past=True, standing_since=9.0)
    assert not stops.stop_before(looking, situations.standing(12.0), stops.NEAR_STOP, 7).looks_past
    assert stops.stop_before(looking, situations.standing(12.0), 0.4, 7).looks_past  # drives up to it first
    plan = Trajectory(times=np.zeros(2), states=np.zeros((2, STATES)), controls=np.zeros((1, CONTROLS)))
    assert not route.accepted(looking, plan, situations()).looks_past


def begun_for(stop: PlannedStop | None) -> SuspendedSearch:
    return SuspendedSearch(
        solution=None, iterations=2, iterate=None, target=target_at(9.0), stop=stop, arrive_at=12.0, begin=9.0
    )


def test_a_stop_for_which_no_way_past_was_sought_yet_is_looked_past_soon(situations: Any) -> None:
    memory = stops.stop_before(arriving(), situations(), 4.0, None)
    assert not stops.way_may_be_free(memory, 10.0 + 0.9 * route.LOOK_AGAIN, 7)
    assert stops.way_may_be_free(memory, 10.0 + route.LOOK_AGAIN, 7)
    again = stops.still_filled(memory, situations(now=10.5))
    assert not stops.way_may_be_free(again, 10.9, 7)
    assert stops.way_may_be_free(again, 11.0, 7)
    assert stops.unconfirmed(memory)
    known = stops.confirmed(memory, situations(now=11.0), 7)
    assert not stops.unconfirmed(known)
    assert not stops.way_may_be_free(known, 30.0, 7)
    assert stops.way_may_be_free(known, 30.0, 8)
    free = arriving()
    assert not stops.unconfirmed(free)
    assert stops.still_filled(free, situations()) is free


def test_what_is_sought_changes_and_its_search_goes_on() -> None:
    begun = begun_for(stop_at(9.0))
    memory = stops.seeking(arriving(unfinished=begun), begun.stop)
    assert (memory.stop, memory.unfinished) == (stop_at(9.0), begun)
    assert (memory.phase, memory.driven, memory.arrive_at) == (Phase.STARTING, None, None)


@pytest.mark.parametrize(
    ("phase", "stop", "stays"),
    [
        (Phase.ARRIVING, None, False),  # it was for a way past
        (Phase.ARRIVING, stop_at(9.0), False),
        (Phase.CONTOURING, stop_at(9.0), False),
        (Phase.CONTOURING, None, True),  # the arrival is sought all the same
    ],
)
def test_once_the_driven_plan_is_clear_nothing_is_sought_for_that(
    phase: Phase, stop: PlannedStop | None, stays: bool
) -> None:
    memory = stops.found_clear(arriving(phase=phase, unfinished=begun_for(stop)), 7)
    assert memory.clear_of == 7
    assert (memory.unfinished is not None) == stays


def test_a_plan_driven_during_a_search_is_iterated_now_and_then(situations: Any) -> None:
    memory = arriving(unfinished=begun_for(None), accepted_at=10.0)
    assert not stops.is_old(memory, situations(now=10.0 + 0.9 * stops.NEEDS_IT))
    late = situations(now=10.0 + 1.1 * stops.NEEDS_IT)
    assert stops.is_old(memory, late)
    assert not stops.is_old(replace(memory, unfinished=None), late)
    assert not stops.is_old(replace(memory, halt=Halt()), late)  # it is not driven


def test_backing_off_is_for_another_try_near_the_goal(situations: Any) -> None:
    assert route.retreat(arriving(), situations.standing(19.8)) == 0.0
    assert route.retreat(arriving(restarts=1), situations.standing(19.8)) == route.RETREAT_SPEED
    assert route.retreat(arriving(restarts=1), situations.standing(17.5)) == 0.0


def test_another_try_near_the_goal_has_time_to_back_off_first(situations: Any) -> None:
    near = situations.standing(19.8)
    first, again = arriving(), arriving(restarts=1)
    assert route.begin_phase(first, near, CONFIG).arrive_at == pytest.approx(
        10.2 + time_to_go(0.2, 0.0, 0.36)
    )
    assert route.begin_phase(again, near, CONFIG).arrive_at == pytest.approx(10.2 + route.RETRY_TIME)


def test_a_vehicle_that_holds_has_all_its_tries_again(situations: Any) -> None:
    memory = arriving(phase=Phase.SETTLING, restarts=2)
    assert decided(memory, situations.standing(), CONFIG).restarts == 0


def test_without_a_planned_arrival_there_is_no_other_try(situations: Any) -> None:
    memory = arriving(phase=Phase.CONTOURING, arrive_at=None, standing_since=5.0)
    config = ControllerConfig.paper(dead_time=0.2)
    assert decided(memory, situations.standing(19.8), config).phase is Phase.STALLED


def test_a_blocked_vehicle_looks_again_now_and_then(situations: Any) -> None:
    looked = ControllerMemory(looked_at=10.0)
    assert route.replan_due(ControllerMemory(), situations.standing(now=10.0))
    assert not route.replan_due(looked, situations.standing(now=10.0 + 0.9 * route.LOOK_AGAIN))
    assert route.replan_due(looked, situations.standing(now=10.0 + route.LOOK_AGAIN))
    assert route.replan_due(looked, situations.standing(now=3.0))  # a clock that was set back


def test_a_vehicle_that_stands_inside_the_tolerance_at_the_begin_holds(situations: Any) -> None:
    starting = arriving(phase=Phase.STARTING)
    assert decided(starting, situations.standing(19.96), CONFIG).phase is Phase.HOLDING
    assert decided(starting, situations.standing(19.9), CONFIG).phase is Phase.STARTING
    moving = situations(error=Pose2(0.01, 0.0, 0.0))
    assert decided(starting, moving, CONFIG).phase is Phase.STARTING


def test_a_vehicle_that_stands_beside_its_goal_may_back_off_at_once(situations: Any) -> None:
    beside = situations.standing(19.9, error=Pose2(-0.1, 0.2, 0.0))
    after = route.begin_phase(arriving(standing_since=9.0), beside, CONFIG)
    assert after.restarts == 1
    assert after.arrive_at == pytest.approx(10.2 + route.RETRY_TIME)
    before = situations.standing(19.0)
    assert route.begin_phase(arriving(standing_since=9.0), before, CONFIG).restarts == 0


@pytest.mark.parametrize(
    ("phase", "then"),
    [
        (Phase.HOLDING, Phase.HOLDING),
        (Phase.SETTLING, Phase.SETTLING),
        (Phase.ARRIVING, Phase.STARTING),
        (Phase.CONTOURING, Phase.STARTING),
        (Phase.STALLED, Phase.STARTING),
    ],
)
def test_a_vehicle_found_after_a_gap_begins_again_unless_it_has_come_to_its_end(
    phase: Phase, then: Phase
) -> None:
    after = route.found(arriving(phase=phase, reached=np.zeros(6)))
    assert (after.phase, after.reached) == (then, None)


# -- past the goal, and back up into it ------------------------------------------------------------------


def test_backing_up_takes_the_way_past_the_goal_and_the_way_back(situations: Any) -> None:
    memory = arriving()
    onward = route.begin_phase(memory, situations(), CONFIG)
    backing = route.begin_reverse(memory, situations(), CONFIG)
    assert backing is not None
    assert backing.reverse_into_goal
    assert not onward.reverse_into_goal
    acceleration = CONFIG.arrival_acceleration
    assert backing.arrive_at == pytest.approx(10.2 + time_to_go(10.0 + PASS, 1.0, acceleration) + BACK_TIME)
    assert onward.arrive_at is not None
    assert backing.arrive_at is not None
    assert backing.arrive_at > onward.arrive_at + BACK_TIME
    assert replace(backing, reverse_into_goal=False, arrive_at=onward.arrive_at) == onward


@pytest.mark.parametrize(
    "config",
    [
        ControllerConfig.paper(dead_time=0.2),
        *(CONFIG.model_copy(update={"method": method}) for method in (Method.SEPARATED, Method.SWITCHED)),
        CONFIG.model_copy(update={"arrival": False}),
    ],
)
def test_only_planned_arrivals_of_the_dynamic_method_back_up(
    config: ControllerConfig, situations: Any
) -> None:
    assert not route.recovery_enabled(config)
    assert route.begin_reverse(arriving(), situations(), config) is None


@pytest.mark.parametrize("changes", [{"last_part": False}, {"free": False}])
def test_none_backs_up_into_a_cusp_or_a_stop(changes: dict[str, Any], situations: Any) -> None:
    assert route.recovery_enabled(CONFIG)
    assert route.begin_reverse(arriving(), situations(**changes), CONFIG) is None


def test_none_backs_up_while_contouring_is_due(situations: Any) -> None:
    far = situations(way=200.0)
    assert route.begin_phase(arriving(), far, CONFIG).arrive_at is None
    assert route.begin_reverse(arriving(), far, CONFIG) is None


def begun_to(goal: Target, *, reverse_into_goal: bool) -> SuspendedSearch:
    return replace(
        begun_for(None), target=goal, arrive_at=40.0, begin=10.15, reverse_into_goal=reverse_into_goal
    )


def test_a_search_for_backing_up_goes_on_with_its_time_of_arrival(situations: Any) -> None:
    situation = situations()
    memory = arriving(unfinished=begun_to(situation.target, reverse_into_goal=True))
    after = route.begin_reverse(memory, situation, CONFIG)
    assert after is not None
    assert (after.reverse_into_goal, after.arrive_at, after.unfinished) == (True, 40.0, memory.unfinished)
    moved = replace(situation, target=target_at(19.0))
    elsewhere = route.begin_reverse(memory, moved, CONFIG)
    assert elsewhere is not None
    assert elsewhere.unfinished is None
    assert elsewhere.reverse_into_goal
    assert elsewhere.arrive_at != 40.0


def test_a_search_onward_that_goes_on_is_not_for_backing_up(situations: Any) -> None:
    situation = situations()
    memory = arriving(unfinished=begun_to(situation.target, reverse_into_goal=False), reverse_into_goal=True)
    assert not route.begin_phase(memory, situation, CONFIG).reverse_into_goal


def test_what_begins_afresh_does_not_back_up(situations: Any) -> None:
    backing = arriving(reverse_into_goal=True, restarts=0)
    assert not route.restart(backing).reverse_into_goal
    assert not route.found(backing).reverse_into_goal
    assert not route.begin_phase(backing, situations(), CONFIG).reverse_into_goal
    assert not route.begin_phase(backing, situations(way=200.0), CONFIG).reverse_into_goal
    assert not stops.stop_before(backing, situations(), 4.0, 7).reverse_into_goal
    assert not stops.seeking(backing, None).reverse_into_goal
    assert not legs.next_leg(backing, staged=False).reverse_into_goal
    assert route.begun(backing, situations()).reverse_into_goal


def test_one_that_backs_up_may_go_back_wherever_its_bounds_let_it(situations: Any) -> None:
    for x in (19.8, 17.5, 5.0):
        assert route.retreat(arriving(reverse_into_goal=True), situations.standing(x)) == route.RETREAT_SPEED
    assert route.retreat(arriving(), situations.standing(17.5)) == 0.0


@pytest.mark.parametrize("x", [10.0, 20.5])
def test_a_goal_that_moves_leaves_one_that_backs_up_its_time(x: float, situations: Any) -> None:
    """It may be past the goal already: no way is left onward, but the one back."""
    state = np.array([x, 0.0, 0.0, 0.2, 0.0, min(x, 20.0)])
    moved = situations(target=target_at(19.8), state=state, way=max(19.8 - x, 0.0), speed=0.2)
    assert decided(arriving(arrive_at=30.0, reverse_into_goal=True), moved, CONFIG).arrive_at == 30.0
    onward = decided(arriving(arrive_at=30.0), moved, CONFIG).arrive_at
    assert onward is not None
    assert onward < 30.0
    soon = decided(arriving(arrive_at=11.0, reverse_into_goal=True), moved, CONFIG)
    assert soon.arrive_at == pytest.approx(max(onward, 11.0))


def test_backing_up_is_not_sought_from_a_search_onward(situations: Any) -> None:
    situation = situations()
    memory = arriving(unfinished=begun_to(situation.target, reverse_into_goal=False))
    after = route.begin_reverse(memory, situation, CONFIG)
    assert after is not None
    assert after.reverse_into_goal
    assert after.unfinished is None
    assert after.arrive_at != 40.0
