"""What a part is to end in: its own end, a pose beside it, a stop on it, or a goal pose."""

from __future__ import annotations

from dataclasses import replace
from math import pi

import pytest

from geometry import PathPart, Pose2, ReferencePath
from rti_mpcc.ocp.objectives import PROJECTION_REACH, TargetKind, ended_at, goal_on, path_end, stop_on
from rti_mpcc.paper.objective import StagingPose

ROUND = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(1, 0.25, 40.0)]).parts[0]
"""It comes past every place of a circle more than once."""
TURN = 8.0 * pi
REACH = PROJECTION_REACH


def part() -> PathPart:
    return ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(1, 0.0, 20.0)]).parts[0]


def test_a_part_ends_at_its_end_or_just_beside_it() -> None:
    end = path_end(part())
    assert (end.pose, end.theta, end.theta_end, end.kind) == (part().last, 20.0, 20.0, TargetKind.PATH_END)
    beside = ended_at(part(), Pose2(20.05, 0.1, 0.02 + 2.0 * pi), None, 0.0)
    assert (beside.pose.x, beside.pose.y, beside.theta, beside.goal) == (20.05, 0.1, 20.0, None)
    assert beside.pose.phi == pytest.approx(0.02)
    assert beside.kind is TargetKind.PATH_END


@pytest.mark.parametrize(("theta", "there"), [(7.0, 7.0), (20.0, 20.0), (33.0, 20.0)])
def test_a_stop_lies_on_the_path_and_not_behind_its_end(theta: float, there: float) -> None:
    stop = stop_on(part(), theta)
    assert (stop.pose, stop.theta, stop.stop, stop.goal) == (part().pose(there), there, there, None)
    assert stop.kind is TargetKind.PATH_END


def test_a_goal_is_projected_and_its_heading_on_the_branch_of_the_path() -> None:
    goal = Pose2(23.0, 1.0, 0.1 - 4.0 * pi)
    target = goal_on(part(), goal)
    assert (target.goal, target.kind) == (goal, TargetKind.POSE)
    assert target.pose.phi == pytest.approx(0.1)
    assert (target.stop, target.behind) == pytest.approx((20.0, 3.0))


def test_a_goal_that_stays_where_it_is_stays_the_same_target() -> None:
    goal = Pose2(18.0, 1.0, 0.1)
    target = goal_on(part(), goal)
    assert goal_on(part(), Pose2(18.0, 1.0, 0.1), target) is target
    assert goal_on(part(), goal, path_end(part())) == target


@pytest.mark.parametrize("theta", [5.0, 5.0 + TURN])
def test_a_goal_that_hardly_moves_is_projected_near_its_last_projection(theta: float) -> None:
    """Where the path comes there again, noise makes no jumps; a goal that leaps is projected anew."""
    last = replace(goal_on(ROUND, ROUND.pose(theta)), theta=theta)
    assert goal_on(ROUND, ROUND.pose(5.1), last).theta == pytest.approx(theta + 0.1, abs=1e-6)
    leapt = ROUND.pose(5.0 + 2.0 * REACH)
    assert goal_on(ROUND, leapt, last).theta == goal_on(ROUND, leapt).theta


def test_the_staging_pose_lies_before_the_goal_or_at_the_paths_end() -> None:
    goals = (Pose2(18.0, 1.0, 0.1), Pose2(5.0, 1.0, 0.1), Pose2(23.0, 1.0, 0.1), None)
    assert [StagingPose(7.0)(part(), goal).stop for goal in goals] == pytest.approx([11.0, 0.0, 20.0, 20.0])
