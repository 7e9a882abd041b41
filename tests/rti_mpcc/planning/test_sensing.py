from __future__ import annotations

from dataclasses import replace
from math import pi

import numpy as np
import pytest

from estimation import PoseHistory
from geometry import PathPart, Pose2, ReferencePath
from rti_mpcc.behaviour.moves import STOP_TOLERANCE
from rti_mpcc.config import ControllerConfig
from rti_mpcc.manoeuvre import CUSP_TOLERANCE, PlannedStop, Segment, SegmentEnd
from rti_mpcc.model.delay import QueuedCommand
from rti_mpcc.ocp.targets import Target, TargetKind, path_end
from rti_mpcc.planning import sensing
from rti_mpcc.planning.context import PlanningContext
from rti_mpcc.planning.pace import pace_of
from rti_mpcc.planning.plausibility import StateMonitor
from rti_mpcc.types import Array
from tests.rti_mpcc.states import state

CONFIG = ControllerConfig(dead_time=0.2)
CUSP_TOLERANCE = CUSP_TOLERANCE


def part(direction: int = 1) -> PathPart:
    return ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(direction, 0.0, 20.0)]).parts[0]


def assess(
    reached: Array,
    on: PathPart,
    target: Target | None = None,
    *,
    ends_at_goal: bool = True,
    free: bool = True,
) -> PlanningContext:
    segment = Segment(part=on, index=0)
    if ends_at_goal:
        segment = replace(segment, end=SegmentEnd.GOAL, tolerance=CONFIG.goal_tolerance)
    pace, target = pace_of(on, CONFIG), target or path_end(on)
    if not free:
        stop = PlannedStop(at=on.end, goal=None, obstacles=0, since=0.0)
        segment = segment.stopped(stop, STOP_TOLERANCE)
    s = state(time=1.0, monitor=StateMonitor(state=reached), segments=(segment,))
    return sensing.context_of(s, reached, pace, target, CONFIG)


def test_the_state_is_rolled_over_the_queued_commands() -> None:
    queue = (QueuedCommand(0.9, 0.5, 0.0), QueuedCommand(1.1, -0.5, 0.1))
    monitor = StateMonitor(state=np.array([3.0, 0.0, 0.0, 1.0, 0.0, 0.0]))
    reached = sensing.start_of(state(time=1.0, monitor=monitor, queue=queue), part(), CONFIG)
    assert reached[3] == pytest.approx(1.0)
    assert reached[4] == pytest.approx(0.01)
    assert reached[0] == pytest.approx(3.0 + 0.2 + 0.5 * 0.1**2, abs=1e-4)
    assert reached[5] == pytest.approx(reached[0], abs=1e-4)


@pytest.mark.parametrize("turns", [-2, 0, 1])
def test_the_heading_is_set_on_the_branch_of_the_route(turns: int) -> None:
    monitor = StateMonitor(state=np.array([3.0, 0.2, 0.1 + 2.0 * pi * turns, 0.0, 0.0, 0.0]))
    first = sensing.start_of(state(time=1.0, monitor=monitor), part(), CONFIG)
    assert first[2] == pytest.approx(0.1)
    later = sensing.start_of(state(time=1.0, monitor=monitor, begin=first), part(), CONFIG)
    assert later[2] == pytest.approx(0.1)


def test_the_progress_follows_the_last_cycles_where_the_route_comes_back_near_itself() -> None:
    loop = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(1, 0.25, 40.0)]).parts[0]
    twice_round = loop.pose(5.0 + 8.0 * pi)
    monitor = StateMonitor(state=np.array([twice_round.x, twice_round.y, twice_round.phi, 0.0, 0.0, 0.0]))
    for theta in (5.0, 5.0 + 8.0 * pi):
        last = np.array([twice_round.x, twice_round.y, loop.pose(theta).phi, 0.0, 0.0, theta - 0.3])
        reached = sensing.start_of(state(time=1.0, monitor=monitor, begin=last), loop, CONFIG)
        assert reached[5] == pytest.approx(theta, abs=1e-6)


@pytest.mark.parametrize("direction", [1, -1])
def test_way_and_speed_count_in_the_direction_of_the_part(direction: int) -> None:
    reached = np.array([direction * 12.0, 0.0, 0.0, direction * 1.5, 0.0, 12.0])
    context = assess(reached, part(direction))
    assert context.distance == pytest.approx(8.0)
    assert context.speed == pytest.approx(1.5)
    assert context.begin == pytest.approx(1.2)


def test_the_way_goes_on_straight_behind_the_end_and_across_to_the_goal() -> None:
    on = part()
    goal = Target(pose=Pose2(24.0, 3.0, 0.0), theta=24.0, theta_end=20.0, kind=TargetKind.POSE)
    context = assess(np.array([20.0, 0.0, 0.0, 0.0, 0.0, 20.0]), on, goal)
    assert context.distance == pytest.approx(5.0)


def test_a_goal_that_was_passed_is_no_way_ahead() -> None:
    on = part()
    goal = Target(pose=Pose2(10.0, 0.0, 0.0), theta=10.0, theta_end=20.0, kind=TargetKind.POSE)
    assert assess(np.array([12.0, 0.0, 0.0, 0.0, 0.0, 12.0]), on, goal).distance == 0.0
    assert assess(np.array([10.3, 0.0, 0.0, 0.0, 0.0, 10.3]), on, goal).distance == pytest.approx(0.3)


def test_where_it_would_stop_is_one_braking_distance_on() -> None:
    context = assess(np.array([19.0, 0.1, 0.0, 0.8, 0.0, 19.0]), part())
    assert context.error.x == pytest.approx(-1.0)
    assert context.stop_error.x == pytest.approx(-1.0 + 0.8**2 / (2.0 * CONFIG.comfort_acceleration))
    assert context.stop_error.y == pytest.approx(0.1)


def test_the_tolerance_is_the_goals_the_cusps_or_a_stops() -> None:
    reached = np.array([12.0, 0.0, 0.0, 0.0, 0.0, 12.0])
    assert assess(reached, part()).tolerance == CONFIG.goal_tolerance
    assert assess(reached, part(), ends_at_goal=False).tolerance == CUSP_TOLERANCE
    assert assess(reached, part(), free=False).tolerance == STOP_TOLERANCE


def test_what_is_far_off_the_path_is_doubted() -> None:
    assert assess(np.array([10.0, 99.0, 0.0, 0.0, 0.0, 10.0]), part()).doubt == ""
    assert "101 m off the path" in assess(np.array([10.0, 101.0, 0.0, 0.0, 0.0, 10.0]), part()).doubt


def test_what_is_doubted_is_said_and_nothing_known_is_the_begin_of_the_part() -> None:
    s = state(monitor=StateMonitor(why="not a finite state"))
    start = sensing.start_of(s, part(), CONFIG)
    context = sensing.context_of(s, start, pace_of(part(), CONFIG), path_end(part()), CONFIG)
    assert context.doubt == "not a finite state"
    assert context.state.tolist() == [0.0] * 6


@pytest.mark.parametrize("stands", [True, False])
def test_a_vehicle_that_stands_is_where_the_mean_of_the_last_moments_is(stands: bool) -> None:
    on, poses = part(), PoseHistory()
    for cycle in range(20):
        noise = 0.04 if cycle % 2 else -0.04
        poses = poses.noted(0.05 * cycle, Pose2(20.0 + noise, 0.5 * noise, noise), length=5.0)
    last = np.array([20.04, 0.02, 0.04, 0.0, 0.0, 20.04])
    s = state(
        time=1.0,
        monitor=StateMonitor(state=last),
        segments=(Segment(part=on, index=0, end=SegmentEnd.GOAL),),
        poses=poses,
        standing_since=0.0 if stands else None,
    )
    context = sensing.context_of(s, last, pace_of(on, CONFIG), path_end(on), CONFIG)
    now = pytest.approx((0.04, 0.02, 0.04))
    assert (context.error.x, context.error.y, context.error.phi) == now
    mean = context.standing_error
    assert (mean.x, mean.y, mean.phi) == (pytest.approx((0.0, 0.0, 0.0), abs=1e-9) if stands else now)
