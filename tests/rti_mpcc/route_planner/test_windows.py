"""Long ways: cut into windows that lose nothing, and planned with work and memory that stay within bounds."""

from __future__ import annotations

import tracemalloc
from itertools import pairwise

import numpy as np
import pytest

from geometry import Area, Pose2
from rti_mpcc import ControllerConfig, Limits, PlanOutcome, plan_manoeuvre
from rti_mpcc.config import RoutePlanner
from rti_mpcc.route_planner import cost_to_go, drivable, shortening
from rti_mpcc.route_planner.arcs import joined
from rti_mpcc.route_planner.planner import RoutePlanning
from rti_mpcc.route_planner.windows import windows_of
from rti_mpcc.types import Array

CONFIG = ControllerConfig(limits=Limits(steering=0.6))
START = Pose2(0.0, 0.0, 0.0)
LONGEST = 10.0


def drawn_way(seed: int, count: int, longest: float) -> Array:
    """Pieces (count, 2), up to so long [m], none like the one before it."""
    rng = np.random.default_rng(seed)
    lengths = rng.uniform(0.1, longest, count) * rng.choice((-1.0, 1.0, 1.0), count)
    return np.column_stack([lengths, rng.uniform(-0.2, 0.2, count)])


@pytest.mark.parametrize(
    ("seed", "count", "longest"), [(1, 40, 1.0), (2, 30, 8.0), (3, 12, 60.0), (4, 1, 99.0)]
)
def test_windows_make_up_the_way_and_are_short(seed: int, count: int, longest: float) -> None:
    way = drawn_way(seed, count, longest)
    windows = windows_of(way, LONGEST)
    assert joined(np.concatenate([each.way for each in windows])) == pytest.approx(way)
    for each in windows:
        assert np.abs(each.way[:, 0]).sum() <= LONGEST + 1e-9 or each.alone
        assert len(each.way) == 1 or not each.alone
    for one, two in pairwise(windows):
        assert one.joints[1]
        assert two.joints[0]
        assert one.way[-1, 1] == two.way[0, 1]
        assert one.way[-1, 0] * two.way[0, 0] > 0.0
    assert not windows[0].joints[0]
    assert not windows[-1].joints[1]


def test_a_short_way_is_one_window() -> None:
    way = drawn_way(5, 6, 1.0)
    (window,) = windows_of(way, LONGEST)
    assert window.way.tolist() == way.tolist()
    assert (window.joints, window.alone) == ((False, False), False)


def test_the_middle_of_a_long_piece_stands_alone() -> None:
    way = np.array([(2.0, 0.1), (100.0, 0.0), (-3.0, -0.1)])
    first, middle, last = windows_of(way, LONGEST)
    assert (first.alone, middle.alone, last.alone) == (False, True, False)
    assert middle.way.tolist() == [[95.0, 0.0]]
    assert first.way.tolist() == [[2.0, 0.1], [2.5, 0.0]]


GOALS = [
    Pose2(1000.0, 0.0, 0.0),
    Pose2(600.0, 700.0, 2.0),
    Pose2(-900.0, 3.0, 0.0),
    Pose2(-300.0, 1900.0, -1.0),
]


@pytest.mark.parametrize("goal", GOALS, ids=str)
def test_far_goals_are_reached_without_stops_to_steer_and_in_little_memory(goal: Pose2) -> None:
    plan_manoeuvre(START, Pose2(9.0, 3.0, 0.0), Area(), CONFIG)  # loads all there is to load
    tracemalloc.start()
    manoeuvre = plan_manoeuvre(START, goal, Area(), CONFIG)
    _, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert manoeuvre.found
    assert most < 100e6
    assert len(manoeuvre.segments) == manoeuvre.cusps + 1
    assert manoeuvre.path.end.relative_to(goal).within((1e-6, 1e-6, 1e-6))
    assert manoeuvre.length < 1.1 * np.hypot(goal.x, goal.y) + 20.0


def test_a_long_way_through_obstacles_is_smooth_where_windows_meet() -> None:
    rng = np.random.default_rng(7)
    at = np.column_stack([np.arange(20.0, 400.0, 14.0), rng.uniform(-6.0, 6.0, 28)])
    corners = np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])
    area = Area(
        boundary=[(-15.0, -12.0), (430.0, -12.0), (430.0, 12.0), (-15.0, 12.0)],
        obstacles=[corners + each for each in at],
    )
    manoeuvre = plan_manoeuvre(START, Pose2(410.0, 0.0, 0.0), area, CONFIG)
    assert manoeuvre.found
    assert manoeuvre.clearance >= CONFIG.clearance.least
    assert (manoeuvre.cusps, len(manoeuvre.segments)) == (0, 1)
    part = manoeuvre.segments[0].part
    middle = 0.5 * (part.knots[1:] + part.knots[:-1])
    steering = np.arctan(CONFIG.vehicle.wheelbase * part.curvatures)
    assert np.abs(np.diff(steering) / np.diff(middle)).max() <= 1.15 * CONFIG.route.steering_slope
    assert np.abs(part.curvatures).max() > 0.1 * CONFIG.max_curvature


def test_what_is_farther_away_than_ways_are_planned_is_refused() -> None:
    goal = Pose2(30.0, 40.0, 0.0)
    config = CONFIG.model_copy(update={"route": RoutePlanner(farthest=49.9)})
    manoeuvre = plan_manoeuvre(START, goal, Area(), config)
    assert manoeuvre.outcome is PlanOutcome.GOAL_TOO_FAR
    assert manoeuvre.reason == "the goal is 50 m away, ways are planned up to 49.9 m"
    assert (manoeuvre.segments, manoeuvre.nearest) == ((), 50.0)
    config = CONFIG.model_copy(update={"route": RoutePlanner(farthest=50.1)})
    assert plan_manoeuvre(START, goal, Area(), config).found
    assert plan_manoeuvre(START, Pose2(2e7, 0.0, 0.0), Area(), CONFIG).outcome is PlanOutcome.GOAL_TOO_FAR


def test_smaller_slices_come_to_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    box = [(15.0, -3.0), (17.0, -3.0), (17.0, 2.0), (15.0, 2.0)]
    area, goal = Area(obstacles=[box]), Pose2(30.0, 2.0, 0.5)

    def planned() -> tuple[int, list[list[float]]]:
        planning, slices = RoutePlanning(START, goal, area, CONFIG), 0
        while planning.manoeuvre is None:
            planning.advance()
            slices += 1
        assert planning.manoeuvre.found
        return slices, [each.part.curvatures.tolist() for each in planning.manoeuvre.segments]

    few, whole = planned()
    for module, name in (
        (cost_to_go, "_SLICE"),
        (cost_to_go, "_POPS"),
        (shortening, "_SLICE"),
        (drivable, "_POSES"),
    ):
        monkeypatch.setattr(module, name, 100)
        many, parts = planned()
        assert many > few
        assert parts == whole
        few = many
