"""Planned routes: their ends, their limits and clearances, and the reasons where there is none."""

from __future__ import annotations

import tomllib
import tracemalloc
from dataclasses import replace
from itertools import pairwise
from math import atan, pi
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely

from benchmarks.problems.scenes import KINDS, Scene, drawn_scene
from geometry import Area, Pose2
from rti_mpcc import (
    ControllerConfig,
    Limits,
    Manoeuvre,
    PathError,
    PlanOutcome,
    SegmentEnd,
    Vehicle,
    plan_manoeuvre,
)
from rti_mpcc.model.footprint import body_polygons
from rti_mpcc.route_planner import cost_to_go, drivable, shortening
from rti_mpcc.route_planner.planner import RoutePlanning
from rti_mpcc.route_planner.problem import RouteProblem
from rti_mpcc.route_planner.smoothing import CURVATURE_SHARE
from rti_mpcc.types import Array
from tests.lists import some_of

PARKING = sorted((Path(__file__).parents[4] / "shared" / "parking").glob("*.toml"))
CONFIG = ControllerConfig(limits=Limits(steering=0.6))
START = Pose2(0.0, 0.0, 0.0)
YARD = [(-15.0, -10.0), (25.0, -10.0), (25.0, 10.0), (-15.0, 10.0)]
WIDE = Area(boundary=[(-10.0, -12.0), (40.0, -12.0), (40.0, 30.0), (-10.0, 30.0)])


def box(x: float, y: float, to_x: float, to_y: float) -> list[tuple[float, float]]:
    return [(x, y), (to_x, y), (to_x, to_y), (x, to_y)]


def with_route(config: ControllerConfig = CONFIG, **values: Any) -> ControllerConfig:
    return config.changed(route=values)


def config_of(scene: Scene) -> ControllerConfig:
    return ControllerConfig(
        vehicle=scene.vehicle, limits=scene.limits, comfort_acceleration=scene.comfort_acceleration
    )


def area_of(scene: Scene) -> Area:
    return Area(boundary=scene.boundary, obstacles=scene.obstacles)


def planned(scene: Scene, **route: Any) -> Manoeuvre:
    return plan_manoeuvre(scene.start, scene.goal, area_of(scene), with_route(config_of(scene), **route))


def by_slices(*args: Any, **keys: Any) -> tuple[Manoeuvre, int]:
    """The manoeuvre, and the number of slices."""
    planning, slices = RoutePlanning(RouteProblem.of(*args, **keys)), 0
    while planning.manoeuvre is None:
        planning.advance()
        slices += 1
    planning.advance()  # it has come to its end
    return planning.manoeuvre, slices


def poses_along(manoeuvre: Manoeuvre, spacing: float = 0.01) -> Array:
    """Poses (n, 3) at most `spacing` [m] apart."""
    found = []
    for segment in manoeuvre.segments:
        part = segment.part
        at = part.reference(np.linspace(part.start, part.end, int((part.end - part.start) / spacing) + 2))
        found.append(np.column_stack([at.x, at.y, at.phi]))
    return np.concatenate(found)


def clearance(manoeuvre: Manoeuvre, area: Area, vehicle: Vehicle) -> float:
    """Least distance of the bodies along the route to all that is solid [m], by shapely alone."""
    bodies = shapely.polygons(body_polygons(poses_along(manoeuvre), vehicle))
    solid = [shapely.Polygon(each) for each in area.obstacles]
    if area.boundary is not None:
        solid.append(shapely.LinearRing(area.boundary))
    return float(shapely.distance(bodies[:, None], np.array(solid)[None]).min()) if solid else np.inf


def steepest(manoeuvre: Manoeuvre, config: ControllerConfig) -> float:
    """Largest change of the steering within a segment [rad/m]."""
    found = [0.0]
    for part in (segment.part for segment in manoeuvre.segments if len(segment.part.curvatures) > 1):
        middle = 0.5 * (part.knots[1:] + part.knots[:-1])
        steering = np.arctan(config.vehicle.wheelbase * part.curvatures)
        found.append(float(np.abs(np.diff(steering) / np.diff(middle)).max()))
    return max(found)


def assert_drivable(manoeuvre: Manoeuvre, area: Area, config: ControllerConfig) -> None:
    """From the start to the goal, in one piece, within all limits, clear of everything."""
    settings, segments = config.route, manoeuvre.segments
    assert manoeuvre.found, manoeuvre.reason
    path, goal = manoeuvre.path, manoeuvre.goal
    rounding = 1e-6 + 1e-14 * max(abs(goal.x), abs(goal.y))
    assert path.start.relative_to(manoeuvre.start).within((rounding, rounding, 1e-6))
    assert path.end.relative_to(goal).within((rounding, rounding, 1e-6))
    assert path.max_curvature <= (CURVATURE_SHARE + 0.05) * config.max_curvature
    for before, after in pairwise(segments):
        assert after.part.first.relative_to(before.part.last).within((rounding, rounding, 1e-9))
        assert after.part.start == before.part.end
        whole = before.part.end - before.part.start  # a short one must not be over where it starts
        assert before.tolerance[0] <= min(max(0.1 * min(whole, 1.0), 0.05), 0.5 * whole) + 1e-9
    assert segments[-1].tolerance == config.goal_tolerance
    most = 2.0 * config.clearance.on_routes + 1.0
    for segment in segments:
        assert segment.margin is not None
        least = clearance(replace(manoeuvre, segments=(segment,)), area, config.vehicle)
        assert least >= config.clearance.least - 1e-3
        assert segment.margin == pytest.approx(min(least, most), abs=5e-3)
        assert segment.wheels == pytest.approx(atan(config.vehicle.wheelbase * segment.part.curvatures[0]))
    assert min(segment.margin or 0.0 for segment in segments) == manoeuvre.clearance
    assert manoeuvre.length == pytest.approx(path.length)
    assert (manoeuvre.nearest, manoeuvre.seconds > 0.0) == (0.0, True)
    if len(segments) == manoeuvre.cusps + 1:  # it is smooth: a reserve is left to control
        assert steepest(manoeuvre, config) <= 1.15 * settings.steering_slope
        assert manoeuvre.clearance >= config.clearance.least + settings.reserve - 1e-3


SCENES = [
    (7, "aisle", 24),
    *((52, kind, number) for kind in KINDS for number in range(3)),
    *((99, "slot", number) for number in (5, 10, 11, 13, 15, 19)),
    *((99, kind, number) for kind, number in (("yard", 14), ("clutter", 15), ("bay", 10), ("yard", 21))),
    *((99, "clutter", 0), (41207, "slot", 81), (4711, "aisle", 24), (4711, "slot", 26)),
]


@pytest.mark.parametrize(("seed", "kind", "number"), some_of(SCENES))
def test_random_scenes_have_a_route_that_can_be_driven(seed: int, kind: str, number: int) -> None:
    scene = drawn_scene(seed, number, kind)
    assert_drivable(planned(scene), area_of(scene), config_of(scene))


@pytest.mark.acceptance
@pytest.mark.parametrize("kind", KINDS)
def test_of_a_hundred_random_scenes_of_a_kind_at_most_one_has_no_route(kind: str) -> None:
    scenes = [drawn_scene(7741, number, kind) for number in range(100)]
    found = [(scene, made) for scene in scenes if (made := planned(scene)).found]
    for scene, made in found:
        assert_drivable(made, area_of(scene), config_of(scene))
    assert len(found) >= 99


@pytest.mark.skipif(not PARKING, reason="the public parking cases are not beside the repository (../shared)")
def test_nine_of_ten_public_parking_cases_have_a_route() -> None:
    found = 0
    for file in PARKING:
        given = tomllib.loads(file.read_text(encoding="utf-8"))
        config = ControllerConfig(
            vehicle=Vehicle(**given["vehicle"]), limits=Limits(**given["limits"]), comfort_acceleration=1.0
        )
        area = Area(obstacles=given["area"]["obstacles"])
        start, goal = Pose2(*given["start"]["pose"]), Pose2(*given["goal"]["pose"])
        manoeuvre = plan_manoeuvre(start, goal, area, config)
        if manoeuvre.found:
            assert_drivable(manoeuvre, area, config)
            found += 1
    assert found >= 0.9 * len(PARKING)


@pytest.mark.parametrize(("x", "direction"), [(10.0, 1), (-8.0, -1)])
def test_straight_ahead_and_behind_are_straight(x: float, direction: int) -> None:
    manoeuvre = plan_manoeuvre(START, Pose2(x, 0.0, 0.0), Area(), CONFIG)
    assert manoeuvre.length == pytest.approx(abs(x), abs=1e-6)
    (segment,) = manoeuvre.segments
    assert segment.part.direction == direction
    assert np.abs(segment.part.curvatures).max() < 1e-6


@pytest.mark.parametrize("offset", [(0.0, 0.0, 0.0), (0.04, -0.04, 0.03), (1e-12, 0.0, 2.0 * pi)])
def test_within_the_tolerance_of_the_goal_there_is_nothing_to_drive(
    offset: tuple[float, float, float],
) -> None:
    start, area = Pose2(4.0, 2.0, 0.7), Area(boundary=YARD)
    goal = start.compose(Pose2(*offset))
    manoeuvre = plan_manoeuvre(start, goal, area, CONFIG)
    assert manoeuvre.found
    assert (manoeuvre.start, manoeuvre.goal, manoeuvre.nearest, manoeuvre.nodes) == (start, goal, 0.0, 0)
    (segment,) = manoeuvre.segments
    assert (segment.end, segment.tolerance) == (SegmentEnd.GOAL, CONFIG.goal_tolerance)
    assert segment.part.direction == 1
    assert not segment.part.curvatures.any()
    assert segment.part.last.relative_to(goal).within((1e-9, 1e-9, 1e-9))
    assert manoeuvre.clearance == pytest.approx(1.4)  # no farther is computed


@pytest.mark.parametrize("tolerance", [0.05, 1e-12])
@pytest.mark.parametrize("apart", [1e-12, 1e-7, 1e-3, 0.06])
@pytest.mark.parametrize("at", [(1.0, 0.0, 0.0), (-1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)])
def test_near_goals_have_a_route(at: tuple[float, float, float], apart: float, tolerance: float) -> None:
    config = CONFIG.changed(goal_tolerance=(tolerance, tolerance, tolerance))
    manoeuvre = plan_manoeuvre(START, Pose2(*(apart * each for each in at)), Area(), config)
    assert manoeuvre.found
    assert manoeuvre.path.end.relative_to(manoeuvre.goal).within((1e-6, 1e-6, 1e-6))


def test_the_mirrored_problem_has_the_mirrored_route() -> None:
    obstacle, goal = np.array(box(5.0, -1.0, 7.0, 2.0)), Pose2(14.0, 3.0, 0.4)
    one = plan_manoeuvre(START, goal, Area(boundary=YARD, obstacles=[obstacle]), CONFIG)
    flipped = Area(boundary=np.array(YARD) * (1.0, -1.0), obstacles=[obstacle * (1.0, -1.0)])
    other = plan_manoeuvre(START, Pose2(goal.x, -goal.y, -goal.phi), flipped, CONFIG)
    assert_drivable(other, flipped, CONFIG)
    assert other.cusps == one.cusps
    assert other.length == pytest.approx(one.length, rel=0.1)


def snapped(points: Any) -> Array:
    """Rounded so that no digit is lost 1e9 m away."""
    return np.asarray(np.round(np.array(points) * 2.0**18) / 2.0**18)


@pytest.mark.parametrize("far", [(1e6, -1e6), (-1e9, 1e9)])
@pytest.mark.parametrize(("kind", "number"), [("slot", 3), ("aisle", 1), ("clutter", 0)])
def test_far_from_the_origin_the_same_route_is_found(
    kind: str, number: int, far: tuple[float, float]
) -> None:
    scene = drawn_scene(52, number, kind)

    def planned_at(place: Array) -> Manoeuvre:
        ends = [(snapped([pose.x, pose.y]) + place, pose.phi) for pose in (scene.start, scene.goal)]
        start, goal = (Pose2(float(at[0]), float(at[1]), phi) for at, phi in ends)
        boundary = None if scene.boundary is None else snapped(scene.boundary) + place
        obstacles = [snapped(each) + place for each in scene.obstacles]
        return plan_manoeuvre(start, goal, Area(boundary=boundary, obstacles=obstacles), config_of(scene))

    here, there = planned_at(np.zeros(2)), planned_at(np.array(far))
    assert (there.outcome, there.nodes, there.clearance) == (here.outcome, here.nodes, here.clearance)
    rounding = np.spacing(max(abs(each) for each in far))
    for one, other in zip(here.segments, there.segments, strict=True):
        assert other.part.knots.tolist() == one.part.knots.tolist()
        assert other.part.curvatures.tolist() == one.part.curvatures.tolist()
        assert np.abs(other.part.x - far[0] - one.part.x).max() <= rounding
        assert np.abs(other.part.y - far[1] - one.part.y).max() <= rounding


def test_the_same_input_gives_the_same_route_in_slices_of_any_size(monkeypatch: pytest.MonkeyPatch) -> None:
    area, goal = Area(obstacles=[box(15.0, -3.0, 17.0, 2.0)]), Pose2(30.0, 2.0, 0.5)
    whole = plan_manoeuvre(START, goal, area, CONFIG)
    _, few = by_slices(START, goal, area, CONFIG)
    names = (cost_to_go, "_SLICE"), (cost_to_go, "_POPS"), (shortening, "_SLICE"), (drivable, "_POSES")
    for module, name in names:
        monkeypatch.setattr(module, name, 100)
        made, many = by_slices(START, goal, area, CONFIG)
        assert many > few > 5
        assert poses_along(made).tolist() == poses_along(whole).tolist()
        assert (made.nodes, made.clearance) == (whole.nodes, whole.clearance)
        few = many


@pytest.mark.parametrize("length", [0.5, 1.0, 3.0])
@pytest.mark.parametrize("direction", [0, 1, -1])
def test_the_last_arc_is_straight_in_the_direction_asked_for_and_without_a_stop(
    length: float, direction: int
) -> None:
    config = with_route(final_straight=length, final_direction=direction)
    manoeuvre = plan_manoeuvre(START, Pose2(15.0, -5.0, 0.5 * pi), WIDE, config)
    last = manoeuvre.segments[-1].part
    assert direction in (0, last.direction)
    assert last.end - last.start >= length - 1e-9
    assert len(manoeuvre.segments) == manoeuvre.cusps + 1
    at = last.reference(np.linspace(last.end - 0.95 * length, last.end, 20))
    assert np.abs(at.x - 15.0).max() < 1e-3


def test_a_route_keeps_out_of_a_place_but_on_its_last_arc() -> None:
    """A docked object may be anywhere in the place: only the straight last arc leads there."""
    config, goal = with_route(final_straight=2.0, final_direction=-1), Pose2(15.0, -5.0, 0.5 * pi)
    place = box(12.0, -10.0, 18.0, -4.5)
    manoeuvre, _ = by_slices(START, goal, WIDE, config, keep_out=[np.array(place)])
    assert manoeuvre.found
    poses = poses_along(manoeuvre)
    inside = shapely.intersects(
        shapely.polygons(body_polygons(poses, config.vehicle)), shapely.Polygon(place)
    )
    assert inside.any()  # there is no other way to stand there
    assert not inside[np.hypot(poses[:, 0] - goal.x, poses[:, 1] - goal.y) > 2.0 + 1e-6].any()


def test_the_margin_is_kept_where_there_is_room() -> None:
    area = Area(boundary=YARD, obstacles=[box(6.0, -0.5, 7.0, 0.5)])
    assert (
        plan_manoeuvre(START, Pose2(16.0, 0.0, 0.0), area, CONFIG).clearance
        >= CONFIG.clearance.on_routes - 0.02
    )


AHEAD, FRONT = Pose2(12.0, 0.0, 0.0), CONFIG.vehicle.front
NO_ROUTE = {
    "start": ([box(1.0, -0.5, 2.0, 0.5)], AHEAD, PlanOutcome.START_IN_COLLISION, "at the start"),
    "goal": ([box(12.0, -0.5, 14.0, 0.5)], AHEAD, PlanOutcome.GOAL_IN_COLLISION, "at the goal"),
    "in the goal, too near": (
        [box(FRONT + 0.02, -2.0, FRONT + 1.0, 2.0)], START, PlanOutcome.GOAL_IN_COLLISION,
        "has a clearance of 0.020 m, at least 0.05 m is required",
    ),
    "a wall": ([box(8.0, -11.0, 8.5, 11.0)], Pose2(15.0, 0.0, 0.0), PlanOutcome.NO_ROUTE, "nodes expanded"),
    "a narrow gap": (
        [box(8.0, -11.0, 8.5, -0.9), box(8.0, 0.9, 8.5, 11.0)], Pose2(15.0, 0.0, 0.0), PlanOutcome.NO_ROUTE,
        "nodes expanded",
    ),
}  # fmt: skip


@pytest.mark.parametrize(("obstacles", "goal", "outcome", "said"), NO_ROUTE.values(), ids=NO_ROUTE)
def test_where_there_is_no_route_the_reason_is_given(
    obstacles: Any, goal: Pose2, outcome: PlanOutcome, said: str
) -> None:
    small = with_route(searches=((1.0, 3.0),), nodes=4000)
    manoeuvre = plan_manoeuvre(START, goal, Area(boundary=YARD, obstacles=obstacles), small)
    spent = outcome is PlanOutcome.NO_ROUTE and manoeuvre.outcome is PlanOutcome.BUDGET_SPENT
    assert manoeuvre.outcome is outcome or spent
    assert said in manoeuvre.reason
    assert (manoeuvre.found, manoeuvre.segments, manoeuvre.length, manoeuvre.cusps) == (False, (), 0.0, 0)
    with pytest.raises(PathError, match="there is no route"):
        _ = manoeuvre.path


def test_a_last_arc_that_is_not_clear_is_the_reason() -> None:
    walls = [box(5.0, 1.0, 9.0, 9.0), box(11.0, 1.0, 15.0, 9.0), box(9.0, 8.0, 11.0, 9.0)]
    area = Area(obstacles=[*walls, box(9.0, -3.0, 11.0, -2.0)])
    config = with_route(CONFIG.changed(vehicle={"width": 1.2}), final_straight=6.0)
    manoeuvre = plan_manoeuvre(START, Pose2(10.0, 3.0, 0.5 * pi), area, config)
    assert manoeuvre.outcome is PlanOutcome.NO_ROUTE
    assert manoeuvre.reason == "no straight route of 6.0 m into the goal is clear"


def test_a_goal_that_is_too_far_away_is_refused() -> None:
    goal = Pose2(30.0, 40.0, 0.0)
    manoeuvre = plan_manoeuvre(START, goal, Area(), with_route(farthest=49.9))
    assert manoeuvre.outcome is PlanOutcome.GOAL_TOO_FAR
    assert manoeuvre.reason == "the goal is 50 m away, at most 49.9 m is allowed"
    assert (manoeuvre.segments, manoeuvre.nearest) == ((), 50.0)
    assert plan_manoeuvre(START, goal, Area(), with_route(farthest=50.1)).found
    assert plan_manoeuvre(START, Pose2(2e7, 0.0, 0.0), Area(), CONFIG).outcome is PlanOutcome.GOAL_TOO_FAR


def test_a_less_greedy_search_avoids_gaps_that_the_body_does_not_fit_through() -> None:
    scene = drawn_scene(41207, 103, "clutter")
    outcomes = [planned(scene, searches=((1.0, weight),), nodes=4000).outcome for weight in (3.0, 1.5)]
    assert outcomes == [PlanOutcome.BUDGET_SPENT, PlanOutcome.FOUND]


@pytest.mark.parametrize("nodes", [2, 3])
def test_a_spent_budget_is_the_reason_with_the_distance_that_is_left(nodes: int) -> None:
    manoeuvre = planned(drawn_scene(52, 3, "yard"), nodes=nodes)
    assert manoeuvre.outcome is PlanOutcome.BUDGET_SPENT
    assert "2 nodes expanded" in manoeuvre.reason
    assert 0.0 < manoeuvre.nearest < 100.0


def test_without_a_boundary_the_area_is_a_box_around_all_that_is_given() -> None:
    area = Area(obstacles=[box(8.0, -4.0, 8.5, 4.0)])
    manoeuvre = plan_manoeuvre(START, Pose2(15.0, 0.0, 0.0), area, CONFIG)
    assert max(float(np.abs(part.y).max()) for part in manoeuvre.path.parts) < 4.0 + 15.0


@pytest.mark.parametrize("goal", [Pose2(600.0, 700.0, 2.0), Pose2(-900.0, 3.0, 0.0)], ids=str)
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


def test_a_long_route_through_obstacles_is_smooth_where_windows_meet() -> None:
    at = zip(np.arange(20.0, 400.0, 14.0), np.random.default_rng(7).uniform(-6.0, 6.0, 28), strict=True)
    obstacles = [box(x - 1.0, y - 1.0, x + 1.0, y + 1.0) for x, y in at]
    area = Area(boundary=box(-15.0, -12.0, 430.0, 12.0), obstacles=obstacles)
    manoeuvre = plan_manoeuvre(START, Pose2(410.0, 0.0, 0.0), area, CONFIG)
    assert manoeuvre.found
    assert manoeuvre.clearance >= CONFIG.clearance.least
    assert (manoeuvre.cusps, len(manoeuvre.segments)) == (0, 1)
    assert steepest(manoeuvre, CONFIG) <= 1.15 * CONFIG.route.steering_slope
    assert np.abs(manoeuvre.segments[0].part.curvatures).max() > 0.1 * CONFIG.max_curvature
