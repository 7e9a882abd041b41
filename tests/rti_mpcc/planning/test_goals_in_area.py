"""What can be a goal in an area: anywhere that the body has room."""

from __future__ import annotations

from math import isnan, pi

import numpy as np
import pytest

from geometry import Area, Corridor, Pose2, ReferencePath
from rti_mpcc.config import ControllerConfig
from rti_mpcc.planning import goals, validation
from rti_mpcc.planning.goals import GoalFit
from rti_mpcc.planning.state import GoalState
from rti_mpcc.planning.surroundings import Surroundings
from rti_mpcc.rerouting import standing_route
from tests.rti_mpcc.encounters import square

CONFIG = ControllerConfig()
VEHICLE, LIMITS = CONFIG.vehicle, CONFIG.goal_limits
HALF = 0.5 * VEHICLE.width
YARD = Area(
    boundary=[(-20.0, -10.0), (40.0, -10.0), (40.0, 10.0), (-20.0, 10.0)],
    obstacles=[[(10.0, 2.0), (14.0, 2.0), (14.0, 6.0), (10.0, 6.0)]],
)
AROUND = Surroundings.in_area(YARD)
PATH, _ = standing_route(Pose2(0.0, 0.0, 0.0))
"""Of a vehicle that has no way yet."""


def check(goal: Pose2, area: Area = YARD, path: ReferencePath = PATH) -> GoalFit:
    return goals.checked(goal, path, Corridor.in_area(area), VEHICLE, LIMITS, margin=CONFIG.clearance.wanted)


@pytest.mark.parametrize(
    "goal",
    [
        Pose2(30.0, 0.0, 0.0),  # farther from the path than a goal of a path may be
        Pose2(-10.0, 5.0, pi),
        Pose2(0.0, 0.0, 2.0),
        Pose2(20.0, -7.0, 0.1 - 2.0 * pi),  # a heading on another branch
    ],
)
def test_a_goal_may_be_anywhere_and_turned_anyhow(goal: Pose2) -> None:
    fit = check(goal)
    assert (fit.problem, fit.remark, fit.excess) == ("", "", 0.0)
    assert fit.pose == fit.beside == goal
    assert fit.room > CONFIG.clearance.wanted


@pytest.mark.parametrize(
    ("goal", "deep"),
    [
        (Pose2(12.0, 6.0 + HALF - 0.3, 0.0), 0.3),
        (Pose2(30.0, 10.0 - HALF + 0.2, 0.0), 0.2),
        (Pose2(40.0 - VEHICLE.front + 0.1, 0.0, 0.0), 0.1),
    ],
    ids=["in an obstacle", "beside the boundary", "before it"],
)
def test_a_goal_without_room_is_refused_by_how_much(goal: Pose2, deep: float) -> None:
    fit = check(goal)
    assert fit.problem == f"the body there crosses a boundary or obstacle by {deep:.3g} m"
    assert fit.room == pytest.approx(-deep)
    assert fit.excess == pytest.approx(deep)
    known, taken = validation.goal_in(goal, GoalState(), PATH, AROUND, CONFIG)
    assert taken is None
    assert known.refusal.endswith(fit.problem)
    assert len(known.refusal.splitlines()) == 1


def test_a_goal_with_little_room_is_taken_and_it_is_said() -> None:
    fit = check(Pose2(30.0, 10.0 - HALF - 0.07, 0.0))
    assert fit.problem == ""
    assert fit.remark == "the goal leaves 0.07 m beside the body, less than the margin of 0.10 m"


@pytest.mark.parametrize("goal", [Pose2(500.0, 0.0, 0.0), Pose2(0.0, -1e6, 0.0), Pose2(-200.0, 300.0, 1.0)])
def test_far_beyond_the_boundary_is_no_goal_although_nothing_is_solid_there(goal: Pose2) -> None:
    fit = check(goal)
    assert fit.problem == "it is beyond the boundary of the area"
    assert isnan(fit.room)


def test_without_a_boundary_a_goal_may_be_far_away() -> None:
    assert check(Pose2(5000.0, 0.0, 0.0), Area(obstacles=YARD.obstacles)).problem == ""
    assert check(Pose2(0.0, 0.0, 0.0), Area()).problem == ""


def test_obstacles_that_are_told_count_too() -> None:
    goal = Pose2(0.0, 0.0, 0.0)
    corridor = Corridor.in_area(YARD).with_obstacles([square(VEHICLE.front, 0.0, 1.0)])
    fit = goals.checked(goal, PATH, corridor, VEHICLE, LIMITS)
    assert fit.problem == "the body there crosses a boundary or obstacle by 0.5 m"


def test_it_is_the_same_a_billion_metres_away() -> None:
    away = np.array([1e9, -1e9])
    assert YARD.boundary is not None
    there = Area(boundary=YARD.boundary + away, obstacles=[each + away for each in YARD.obstacles])
    for goal in (Pose2(12.0, 6.0 + HALF - 0.3, 0.0), Pose2(30.0, 0.0, 1.0), Pose2(500.0, 0.0, 0.0)):
        far = Pose2(goal.x + 1e9, goal.y - 1e9, goal.phi)
        path, _ = standing_route(Pose2(1e9, -1e9, 0.0))
        assert check(far, there, path).problem == check(goal).problem
        np.testing.assert_allclose(check(far, there, path).room, check(goal).room, atol=1e-6)


# -- from cycle to cycle -------------------------------------------------------------------------------------


def again(last: GoalFit | None, goal: Pose2, around: Surroundings = AROUND) -> GoalFit:
    return goals.checked_again(last, goal, PATH, around, CONFIG)


def test_one_that_was_refused_for_an_obstacle_is_taken_when_that_is_gone() -> None:
    goal = Pose2(0.0, -5.0, 0.0)
    cart = AROUND.updated([square(0.0, -5.0, 1.0)], 1.0, CONFIG)
    refused = again(None, goal, cart)
    assert refused.problem
    assert again(refused, goal, cart) is refused
    assert again(refused, goal, cart.updated([], 2.0, CONFIG)).problem == ""


def test_one_that_stays_where_it_is_is_not_looked_at_again() -> None:
    for goal in (Pose2(0.0, -5.0, 0.0), Pose2(500.0, 0.0, 0.0)):
        fit = again(None, goal)
        assert again(fit, goal) is fit
    taken = again(None, Pose2(0.0, -5.0, 0.0))
    cart = AROUND.updated([square(0.0, -5.0, 1.0)], 1.0, CONFIG)
    assert again(taken, Pose2(0.0, -5.0, 0.0), cart) is taken  # the vehicle waits before it


def test_without_any_goal_there_is_none_and_nothing_to_say_of_the_path() -> None:
    known, taken = validation.goal_in(None, GoalState(), PATH, AROUND, CONFIG)
    assert taken is None
    assert (known.fit, known.refusal) == (None, "")
