"""When the vehicle contours and when it arrives, and the time planned for that."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from geometry import Pose2
from rti_mpcc.config import ControllerConfig, Limits
from rti_mpcc.manoeuvre import segments_of
from rti_mpcc.model.delay import QueuedCommand
from rti_mpcc.model.layout import STATES, THETA
from rti_mpcc.paper import with_method
from rti_mpcc.paper.objective import CartesianPose
from rti_mpcc.planning import schedule
from rti_mpcc.planning.arrival import arrival_time
from rti_mpcc.planning.context import PlanningContext
from rti_mpcc.planning.pace import Pace
from rti_mpcc.planning.schedule import rescheduled, scheduled
from rti_mpcc.planning.state import Arrival, ControllerState, Halt, Phase
from rti_mpcc.types import Array, Trajectory
from tests.rti_mpcc.states import (
    BEFORE,
    PATH,
    arrival_at,
    arrives_at,
    arriving,
    begun_for,
    contexts,
    contouring,
    decided,
    put,
    state,
    target_at,
)

CONFIG = ControllerConfig(dead_time=0.2)
TIMING = CONFIG.arrival_timing
LEAST = TIMING.least_time
SEPARATED = with_method(CONFIG, "separated")
SWITCHED = with_method(CONFIG, "switched")


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
    full = 10.2 + arrival_time(10.0, 1.0, CONFIG)
    assert due(arriving(at=16.0, queue=gap), contexts()) == pytest.approx(full)
    none = (QueuedCommand(10.2 - CONFIG.cycle, 0.0, 0.0),)
    assert due(arriving(at=16.0, queue=none), contexts()) == 16.0


def planned(acceleration: float = 0.36, lateral: float = 0.1, steering_rate: float = 0.1) -> Trajectory:
    """A plan of one stage with these peaks."""
    wheelbase = CONFIG.vehicle.wheelbase
    states = np.tile((10.0, 0.0, 0.0, 1.0, np.arctan(lateral * wheelbase), 10.0), (2, 1))
    controls = np.array([[-acceleration, steering_rate, 1.0]])
    return Trajectory(times=np.array([10.2, 10.25]), states=states, controls=controls)


@pytest.mark.parametrize(
    ("peaks", "factor"),
    [
        ({"acceleration": 1.6}, 2.0),
        ({"lateral": 2.25}, 1.5),
        ({"steering_rate": 0.9}, 1.8),
        ({"acceleration": 0.1, "lateral": 0.01}, 0.5),
    ],
)
def test_a_plan_is_pressed_by_what_it_has_beyond_comfort(peaks: dict[str, float], factor: float) -> None:
    assert schedule.pressed(planned(**peaks), CONFIG) == pytest.approx(factor)


def test_the_time_of_arrival_follows_the_plan() -> None:
    cycle = CONFIG.cycle
    # Within comfort it stays; beyond it there is more time, never more than passes.
    assert due(arriving(at=20.0, driven=planned(0.41)), contexts()) == 20.0
    later = due(arriving(at=20.0, driven=planned(0.484)), contexts())
    assert later == pytest.approx(20.0 + cycle * 0.5)
    assert due(arriving(at=20.0, driven=planned(4.0)), contexts()) == pytest.approx(20.0 + cycle)
    # With slack there is less, as long as there is more than the way takes.
    slow, slower = (planned((share * TIMING.slack) ** 2 * 0.4, 0.0, 0.0) for share in (0.95, 0.5))
    sooner = due(arriving(at=30.0, driven=slow), contexts())
    assert sooner == pytest.approx(30.0 - cycle * 0.05 / TIMING.hurry)
    most = due(arriving(at=30.0, driven=slower), contexts())
    assert most == pytest.approx(30.0 - cycle * TIMING.catching_up)
    assert due(arriving(at=20.0, driven=slower), contexts()) == 20.0


BRISK = ControllerConfig(dead_time=0.2, ride="brisk")


def driving(speed: float, duration: float) -> Trajectory:
    """Straight on from 10 m at one speed, in 50 stages."""
    times = 10.2 + np.linspace(0.0, duration, 51)
    way = 10.0 + speed * (times - times[0])
    states = np.column_stack([way, 0 * way, 0 * way, np.full(51, speed), 0 * way, way])
    return Trajectory(times=times, states=states, controls=np.zeros((50, 3)))


def test_the_own_time_of_a_plan_is_that_of_its_way() -> None:
    a = BRISK.arrival_acceleration
    assert schedule.own_time(driving(1.0, 20.0), 0.0, BRISK) == pytest.approx(
        2.0 * (20.0 / a) ** 0.5, rel=0.02
    )
    # A bend of 0.2 1/m is driven at 2.2 m/s, for the lateral acceleration.
    bent = driving(1.0, 40.0)
    states = bent.states.copy()
    states[:, 4] = np.arctan(0.2 * BRISK.vehicle.wheelbase)
    top = (BRISK.comfort_lateral_acceleration / 0.2) ** 0.5
    expected = 2.0 * top / a + (40.0 - top**2 / a) / top
    assert schedule.own_time(replace(bent, states=states), 0.0, BRISK) == pytest.approx(expected, rel=0.02)


def test_the_time_of_a_brisk_arrival_follows_the_own_time_of_its_plan() -> None:
    plan, begin = driving(1.0, 10.0), 10.2
    ramp = BRISK.arrival_acceleration / BRISK.comfort.jerk
    own = schedule.own_time(plan, 1.0, BRISK)

    def due_brisk(spare: float) -> float:
        at = begin + own + spare
        return arrival_of(decided(arriving(at=at, driven=plan), contexts(), BRISK)).at - at

    assert due_brisk(ramp) == pytest.approx(0.0, abs=1e-12)
    assert due_brisk(ramp + 2.0) == pytest.approx(-BRISK.cycle * TIMING.catching_up)
    assert due_brisk(ramp - 0.1) == pytest.approx(0.5 * BRISK.cycle)
    assert due_brisk(-3.0) == pytest.approx(BRISK.cycle)


@pytest.mark.parametrize(
    ("miss", "left", "later"),
    [
        (0.9, 10.0, 1.0),  # no more than a smooth ride takes
        (0.9, 20.0, 0.0),
        (0.75, 10.0, 0.0),
        (0.7, 20.0, -TIMING.catching_up),
    ],
)
def test_a_brisk_arrival_whose_plan_misses_gets_more_time_up_to_that_of_a_smooth_one(
    miss: float, left: float, later: float
) -> None:
    """By the share of the tolerance that the plan misses its target by."""
    context, at = contexts(), 10.2 + left
    assert 10.0 < arrival_time(10.0, 1.0, BRISK, calm=True) < 20.0
    plan = driving((10.0 + miss * context.tolerance[0]) / 9.0, 9.0)
    changed = arrival_of(decided(arriving(at=at, driven=plan), context, BRISK)).at - at
    assert changed == pytest.approx(later * BRISK.cycle, abs=1e-12)


def test_the_first_plan_of_a_brisk_ride_gets_the_time_of_a_smooth_one_once() -> None:
    calm = schedule.calmed(arriving(at=12.0), contexts(), BRISK)
    assert arrival_of(calm).at == pytest.approx(10.2 + arrival_time(10.0, 1.0, CONFIG), rel=0.05)
    assert schedule.calmed(calm, contexts(distance=12.0), BRISK) is calm
    assert arrival_of(schedule.calmed(arriving(at=50.0), contexts(), BRISK)).at == 50.0
    for s, config in ((arriving(), CONFIG), (contouring(), BRISK)):
        assert schedule.calmed(s, contexts(), config) is s


def test_near_its_target_or_slow_for_its_way_an_arrival_keeps_its_time_to_be_overdue_one_day() -> None:
    pressed = arriving(at=20.0, driven=planned(4.0))
    assert due(pressed, contexts(distance=0.9 * TIMING.late_reach, speed=0.5)) == 20.0
    assert due(pressed, contexts(distance=10.0, speed=0.1)) == 20.0
    assert due(pressed, contexts(distance=10.0, speed=0.9)) > 20.0


def test_one_that_is_slow_for_want_of_room_gets_on_and_its_time_follows() -> None:
    pressed = arriving(at=20.0, driven=planned(4.0))
    narrow = Pace(theta=np.array([0.0, 20.0]), speed=np.array([0.3, 0.3]))
    assert due(pressed, contexts(distance=10.0, speed=0.2, pace=narrow)) > 20.0
    assert due(pressed, contexts(distance=10.0, speed=0.1, pace=narrow)) == 20.0


def test_an_arrival_that_halts_gets_its_time_back() -> None:
    full = 10.2 + arrival_time(10.0, 1.0, CONFIG)
    assert due(arriving(at=12.0, halt=Halt()), contexts()) == pytest.approx(full)
    assert due(arriving(at=25.0, halt=Halt()), contexts()) == 25.0
    longest = schedule.longest_arrival(contexts(), CONFIG)
    assert due(arriving(at=1e5, halt=Halt()), contexts()) == 10.2 + longest < 60.0


def test_a_target_that_moves_is_a_new_arrival() -> None:
    moved = contexts(target=target_at(20.5), distance=10.5)
    expected = 10.2 + arrival_time(10.5, 1.0, CONFIG)
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
    assert times[3] == pytest.approx(10.2 + arrival_time(10.12, 1.0, CONFIG))
    assert times[4] == times[3]


def test_begin_with_an_arrival_within_reach_and_with_contouring_beyond() -> None:
    near = scheduled(state(), contexts(), CONFIG)
    assert arrives_at(near) == pytest.approx(10.2 + arrival_time(10.0, 1.0, CONFIG))
    assert arrival_of(near).timed_for == contexts().target.pose
    slow = ControllerConfig(limits=Limits(speed=1.0))
    assert scheduled(state(), contexts(distance=90.0), slow).task.arrival is None
    assert scheduled(state(), contexts(), ControllerConfig.paper()).task.arrival is None


@pytest.mark.parametrize("x", [20.0, 19.8])
def test_near_the_goal_it_has_the_time_that_its_way_takes_even_beside_it(x: float) -> None:
    """It need not back off first: where there is no getting there another way is planned."""
    for across in (0.0, 0.2):
        beside = contexts.standing(x, error=Pose2(x - 20.0, across, 0.0))
        for since in (None, 9.0):
            after = scheduled(arriving(standing_since=since), beside, CONFIG)
            assert arrives_at(after) == pytest.approx(10.2 + arrival_time(20.0 - x, 0.0, CONFIG))


def test_a_search_that_goes_on_keeps_its_time_of_arrival() -> None:
    context = contexts()
    begun = begun_for(None, target=context.target, arrival=arrival_at(40.0), begin=10.15)
    after = scheduled(arriving(suspended=begun), context, CONFIG)
    assert arrival_of(after) == arrival_at(40.0)
    assert after.plans.suspended == begun
    elsewhere = scheduled(arriving(suspended=begun), replace(context, target=target_at(19.0)), CONFIG)
    assert elsewhere.plans.suspended is None
    assert arrival_of(elsewhere).at != 40.0


# -- other methods ---------------------------------------------------------------------------------------


def at(theta: float) -> Array:
    here = np.zeros(STATES)
    here[THETA] = theta
    return here


def test_another_objective_takes_over_so_much_of_the_path_before_the_stop() -> None:
    reach = SWITCHED.weights.transition_reach
    stop = contexts().target.stop
    near, far = (contexts(state=at(stop - reach * share)) for share in (0.99, 1.01))
    switched = contouring(segments=segments_of(PATH, SWITCHED))
    assert schedule.successor_due(switched, near)
    assert not schedule.successor_due(switched, far)
    assert not schedule.successor_due(contouring(), near)
    assert not schedule.successor_due(put(switched, successor=CartesianPose()), near)
    assert not schedule.successor_due(put(switched, segments=(BEFORE, *switched.task.segments)), near)
    assert not schedule.successor_due(switched, replace(near, free=False))
    beside = replace(far, error=Pose2(-0.5 * reach, 0.0, 0.0))
    assert not schedule.successor_due(switched, beside)


@pytest.mark.parametrize("config", [SWITCHED, SEPARATED])
def test_a_segment_that_is_not_arrived_at_plans_no_arrival(config: ControllerConfig) -> None:
    assert schedule.arrival_due(contouring(), contexts(), CONFIG)
    assert not schedule.arrival_due(arriving(), contexts(), CONFIG)
    *before, goal = segments_of(PATH, config)
    last = contouring(segments=(goal,))
    assert not schedule.arrival_due(last, contexts(), config)
    assert scheduled(last, contexts(), config).task.arrival is None
    for segment in (BEFORE, *before):
        on_the_way = contouring(segments=(segment, goal))
        assert schedule.arrival_due(on_the_way, contexts(ends_at_goal=False), config)


def test_a_contouring_vehicle_without_an_arrival_yet_brakes_in_time() -> None:
    needed = 1.0 / (2.0 * CONFIG.comfort_acceleration)
    near, far = contexts(distance=0.99 * needed), contexts(distance=1.01 * needed)
    assert schedule.too_late(contouring(), near, CONFIG)
    assert not schedule.too_late(contouring(), far, CONFIG)
    assert not schedule.too_late(arriving(), near, CONFIG)
    assert not schedule.too_late(contouring(successor=CartesianPose()), near, SEPARATED)
