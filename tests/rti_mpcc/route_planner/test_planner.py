"""Ways that are planned: where they lead, what they keep to, and what is said where there is none."""

from __future__ import annotations

import tomllib
from dataclasses import replace
from itertools import pairwise
from math import atan, cos, pi, sin
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
from rti_mpcc.config import RoutePlanner
from rti_mpcc.model.footprint import body_polygons
from rti_mpcc.route_planner.drivable import CURVATURE_SHARE
from rti_mpcc.route_planner.planner import RoutePlanning
from rti_mpcc.types import Array

PARKING = sorted((Path(__file__).parents[4] / "shared" / "parking").glob("*.toml"))
CONFIG = ControllerConfig(limits=Limits(steering=0.6))
YARD = [(-15.0, -10.0), (25.0, -10.0), (25.0, 10.0), (-15.0, 10.0)]
START = Pose2(0.0, 0.0, 0.0)


def with_route(**values: Any) -> ControllerConfig:
    return CONFIG.model_copy(update={"route": RoutePlanner(**values)})


def config_of(scene: Scene) -> ControllerConfig:
    return ControllerConfig(
        vehicle=scene.vehicle, limits=scene.limits, comfort_acceleration=scene.comfort_acceleration
    )


def area_of(scene: Scene) -> Area:
    return Area(boundary=scene.boundary, obstacles=scene.obstacles)


def poses_along(manoeuvre: Manoeuvre, spacing: float = 0.01) -> Array:
    """Poses (n, 3) at most `spacing` [m] apart."""
    found = []
    for segment in manoeuvre.segments:
        part = segment.part
        at = part.reference(np.linspace(part.start, part.end, int((part.end - part.start) / spacing) + 2))
        found.append(np.column_stack([at.x, at.y, at.phi]))
    return np.concatenate(found)


def clearance(manoeuvre: Manoeuvre, area: Area, vehicle: Vehicle) -> float:
    """Least distance of the bodies along the way to all that is solid [m], by shapely alone."""
    states = np.zeros((len(poses := poses_along(manoeuvre)), 6))
    states[:, :3] = poses
    bodies = shapely.polygons(body_polygons(states, vehicle))
    solid = [shapely.Polygon(each) for each in area.obstacles]
    if area.boundary is not None:
        solid.append(shapely.LinearRing(area.boundary))
    return float(shapely.distance(bodies[:, None], np.array(solid)[None]).min()) if solid else np.inf


def assert_drivable(manoeuvre: Manoeuvre, area: Area, config: ControllerConfig) -> None:
    """From the start to the goal, in one piece, within all limits, clear of everything."""
    settings = config.route
    assert manoeuvre.found, manoeuvre.reason
    path, goal = manoeuvre.path, manoeuvre.goal
    rounding = 1e-6 + 1e-14 * max(abs(goal.x), abs(goal.y))
    assert path.start.relative_to(manoeuvre.start).within((rounding, rounding, 1e-6))
    assert path.end.relative_to(goal).within((rounding, rounding, 1e-6))
    assert path.max_curvature <= (CURVATURE_SHARE + 0.05) * config.max_curvature
    for before, after in pairwise(manoeuvre.segments):
        assert after.part.first.relative_to(before.part.last).within((rounding, rounding, 1e-9))
        assert after.part.start == before.part.end
    least = clearance(manoeuvre, area, config.vehicle)
    assert least >= CONFIG.clearance.least - 1e-3
    assert manoeuvre.clearance == pytest.approx(min(least, 2.0 * config.clearance.on_routes + 1.0), abs=5e-3)
    assert min(segment.margin or 0.0 for segment in manoeuvre.segments) == manoeuvre.clearance
    steered = np.array([segment.wheels for segment in manoeuvre.segments])
    first = [atan(config.vehicle.wheelbase * s.part.curvatures[0]) for s in manoeuvre.segments]
    assert steered == pytest.approx(first)
    if all(one.part.direction != two.part.direction for one, two in pairwise(manoeuvre.segments)):
        assert steepest(manoeuvre, config) <= 1.15 * settings.steering_slope


def steepest(manoeuvre: Manoeuvre, config: ControllerConfig) -> float:
    """Largest change of the steering within a stretch [rad/m]."""
    found = 0.0
    for segment in manoeuvre.segments:
        part = segment.part
        if len(part.curvatures) > 1:
            middle = 0.5 * (part.knots[1:] + part.knots[:-1])
            steering = np.arctan(config.vehicle.wheelbase * part.curvatures)
            found = max(found, float(np.abs(np.diff(steering) / np.diff(middle)).max()))
    return found


@pytest.mark.parametrize("number", range(3))
@pytest.mark.parametrize("kind", KINDS)
def test_drawn_scenes_have_a_way_that_can_be_driven(kind: str, number: int) -> None:
    scene = drawn_scene(52, number, kind)
    assert_drivable(
        plan_manoeuvre(scene.start, scene.goal, area_of(scene), config_of(scene)),
        area_of(scene),
        config_of(scene),
    )


@pytest.mark.parametrize(
    ("kind", "number"),
    [("slot", 10), ("slot", 11), ("yard", 14), ("clutter", 15), ("bay", 10), ("yard", 21), ("clutter", 0)],
)
def test_tight_ways_become_smooth_too(kind: str, number: int) -> None:
    scene = drawn_scene(99, number, kind)
    manoeuvre = plan_manoeuvre(scene.start, scene.goal, area_of(scene), config_of(scene))
    assert_drivable(manoeuvre, area_of(scene), config_of(scene))
    assert len(manoeuvre.segments) == manoeuvre.cusps + 1


@pytest.mark.parametrize("number", [5, 13, 15, 19])
def test_smooth_ways_keep_a_reserve_for_control(number: int) -> None:
    scene = drawn_scene(99, number, "slot")
    config = config_of(scene)
    manoeuvre = plan_manoeuvre(scene.start, scene.goal, area_of(scene), config)
    assert_drivable(manoeuvre, area_of(scene), config)
    if len(manoeuvre.segments) == manoeuvre.cusps + 1:
        assert manoeuvre.clearance >= config.clearance.least + config.route.reserve


@pytest.mark.acceptance
@pytest.mark.parametrize("kind", KINDS)
def test_of_a_hundred_drawn_scenes_of_a_kind_at_most_one_has_no_way(kind: str) -> None:
    found = 0
    for number in range(100):
        scene = drawn_scene(7741, number, kind)
        manoeuvre = plan_manoeuvre(scene.start, scene.goal, area_of(scene), config_of(scene))
        if manoeuvre.found:
            assert_drivable(manoeuvre, area_of(scene), config_of(scene))
            found += 1
    assert found >= 99


@pytest.mark.skipif(not PARKING, reason="the public parking cases are not beside the repository (../shared)")
def test_nine_of_ten_public_parking_cases_have_a_way() -> None:
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


def test_straight_ahead_is_straight_ahead() -> None:
    manoeuvre = plan_manoeuvre(START, Pose2(10.0, 0.0, 0.0), Area(), CONFIG)
    assert manoeuvre.length == pytest.approx(10.0, abs=1e-6)
    assert (manoeuvre.cusps, len(manoeuvre.segments)) == (0, 1)
    assert np.abs(manoeuvre.segments[0].part.curvatures).max() < 1e-6


@pytest.mark.parametrize("offset", [(0.0, 0.0, 0.0), (0.04, -0.04, 0.03), (1e-12, 0.0, 2.0 * pi)])
def test_who_is_within_the_tolerance_of_the_goal_has_nothing_to_drive(
    offset: tuple[float, float, float],
) -> None:
    start, area = Pose2(4.0, 2.0, 0.7), Area(boundary=YARD)
    goal = start.compose(Pose2(*offset))
    manoeuvre = plan_manoeuvre(start, goal, area, CONFIG)
    assert manoeuvre.found
    assert (manoeuvre.start, manoeuvre.goal, manoeuvre.nearest, manoeuvre.nodes) == (start, goal, 0.0, 0)
    (segment,) = manoeuvre.segments
    assert segment.end is SegmentEnd.GOAL
    assert segment.tolerance == CONFIG.goal_tolerance
    assert segment.part.direction == 1
    assert not segment.part.curvatures.any()
    assert segment.part.last.relative_to(goal).within((1e-9, 1e-9, 1e-9))
    assert manoeuvre.clearance == pytest.approx(1.4)  # as far as it is looked at


def test_who_stands_in_the_goal_but_too_near_to_something_is_told_so() -> None:
    bumper = CONFIG.vehicle.front
    box = [(bumper + 0.02, -2.0), (bumper + 1.0, -2.0), (bumper + 1.0, 2.0), (bumper + 0.02, 2.0)]
    area = Area(obstacles=[box])
    assert plan_manoeuvre(START, START, area, CONFIG).outcome is PlanOutcome.GOAL_IN_COLLISION


@pytest.mark.parametrize("tolerance", [0.05, 1e-12])
@pytest.mark.parametrize("apart", [1e-12, 1e-7, 1e-3, 0.01, 0.06])
@pytest.mark.parametrize("at", [(1.0, 0.0, 0.0), (-1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)])
def test_near_goals_have_a_way(at: tuple[float, float, float], apart: float, tolerance: float) -> None:
    config = CONFIG.model_copy(update={"goal_tolerance": (tolerance, tolerance, tolerance)})
    goal = Pose2(*(apart * each for each in at))
    manoeuvre = plan_manoeuvre(START, goal, Area(), config)
    assert manoeuvre.found
    assert manoeuvre.path.end.relative_to(goal).within((1e-6, 1e-6, 1e-6))


def test_behind_is_reached_in_reverse() -> None:
    manoeuvre = plan_manoeuvre(START, Pose2(-8.0, 0.0, 0.0), Area(), CONFIG)
    assert [segment.part.direction for segment in manoeuvre.segments] == [-1]


def test_the_mirrored_problem_has_the_mirrored_way() -> None:
    box = np.array([(5.0, -1.0), (7.0, -1.0), (7.0, 2.0), (5.0, 2.0)])
    goal = Pose2(14.0, 3.0, 0.4)
    one = plan_manoeuvre(START, goal, Area(boundary=YARD, obstacles=[box]), CONFIG)
    flipped = Area(boundary=np.array(YARD) * (1.0, -1.0), obstacles=[box * (1.0, -1.0)])
    other = plan_manoeuvre(START, Pose2(goal.x, -goal.y, -goal.phi), flipped, CONFIG)
    assert_drivable(other, flipped, CONFIG)
    assert other.cusps == one.cusps
    assert other.length == pytest.approx(one.length, rel=0.1)


def test_the_same_problem_elsewhere_has_about_the_same_way() -> None:
    scene = drawn_scene(52, 1, "bay")
    config, turn, shift = config_of(scene), 1.0, np.array([300.0, -200.0])

    def moved(points: Array) -> Array:
        c, s = cos(turn), sin(turn)
        turned: Array = points @ np.array([[c, s], [-s, c]]) + shift
        return turned

    def moved_pose(pose: Pose2) -> Pose2:
        x, y = moved(np.array([pose.x, pose.y]))
        return Pose2(x, y, pose.phi + turn)

    here = plan_manoeuvre(scene.start, scene.goal, area_of(scene), config)
    boundary = None if scene.boundary is None else moved(scene.boundary)
    area = Area(boundary=boundary, obstacles=[moved(each) for each in scene.obstacles])
    there = plan_manoeuvre(moved_pose(scene.start), moved_pose(scene.goal), area, config)
    assert_drivable(there, area, config)
    assert there.length == pytest.approx(here.length, rel=0.3)


def test_nothing_is_lost_far_from_the_origin() -> None:
    far = 1e9
    box = np.array([(5.0, -1.0), (7.0, -1.0), (7.0, 2.0), (5.0, 2.0)])
    area = Area(boundary=np.array(YARD) + far, obstacles=[box + far])
    manoeuvre = plan_manoeuvre(Pose2(far, far, 0.0), Pose2(far + 14.0, far + 3.0, 0.4), area, CONFIG)
    assert manoeuvre.found
    assert manoeuvre.path.end.relative_to(manoeuvre.goal).within((1e-4, 1e-4, 1e-6))
    assert clearance(manoeuvre, area, CONFIG.vehicle) >= CONFIG.clearance.least - 1e-3


def snapped(points: Any) -> Array:
    """Rounded so that no digit is lost 1e9 m away."""
    return np.asarray(np.round(np.array(points) * 2.0**18) / 2.0**18)


@pytest.mark.parametrize("far", [(1e6, -1e6), (1e9, 0.0), (-1e9, 1e9)])
@pytest.mark.parametrize(("kind", "number"), [("slot", 3), ("aisle", 1), ("clutter", 0)])
def test_far_from_the_origin_the_same_way_is_found(kind: str, number: int, far: tuple[float, float]) -> None:
    scene = drawn_scene(52, number, kind)

    def planned(place: Array) -> Manoeuvre:
        ends = [(snapped([pose.x, pose.y]) + place, pose.phi) for pose in (scene.start, scene.goal)]
        start, goal = (Pose2(float(at[0]), float(at[1]), phi) for at, phi in ends)
        boundary = None if scene.boundary is None else snapped(scene.boundary) + place
        obstacles = [snapped(each) + place for each in scene.obstacles]
        return plan_manoeuvre(start, goal, Area(boundary=boundary, obstacles=obstacles), config_of(scene))

    here, there = planned(np.zeros(2)), planned(np.array(far))
    assert (there.outcome, there.nodes, there.clearance) == (here.outcome, here.nodes, here.clearance)
    assert len(there.segments) == len(here.segments)
    rounding = np.spacing(max(abs(each) for each in far))
    for one, other in zip(here.segments, there.segments, strict=True):
        assert other.part.knots.tolist() == one.part.knots.tolist()
        assert other.part.curvatures.tolist() == one.part.curvatures.tolist()
        assert np.abs(other.part.x - far[0] - one.part.x).max() <= rounding
        assert np.abs(other.part.y - far[1] - one.part.y).max() <= rounding


def test_the_same_input_gives_the_same_way() -> None:
    scene = drawn_scene(52, 2, "slot")
    one, two = (plan_manoeuvre(scene.start, scene.goal, area_of(scene), config_of(scene)) for _ in range(2))
    assert poses_along(one).tolist() == poses_along(two).tolist()
    assert (one.nodes, one.clearance) == (two.nodes, two.clearance)


def test_slice_by_slice_comes_to_the_same() -> None:
    scene = drawn_scene(52, 0, "yard")
    planning = RoutePlanning(scene.start, scene.goal, area_of(scene), config_of(scene))
    slices = 0
    while planning.manoeuvre is None:
        planning.advance()
        slices += 1
    whole = plan_manoeuvre(scene.start, scene.goal, area_of(scene), config_of(scene))
    assert slices > 5
    assert poses_along(planning.manoeuvre).tolist() == poses_along(whole).tolist()
    planning.advance()  # it has come to its end


@pytest.mark.parametrize("length", [1.0, 3.0])
def test_the_last_stretch_is_straight(length: float) -> None:
    config = with_route(final_straight=length)
    manoeuvre = plan_manoeuvre(START, Pose2(12.0, 5.0, 0.5 * pi), Area(boundary=YARD), config)
    last = manoeuvre.segments[-1].part
    at = last.reference(np.linspace(last.end - 0.9 * length, last.end, 20))
    beside = (at.x - 12.0) * -sin(0.5 * pi) + (at.y - 5.0) * cos(0.5 * pi)
    assert np.abs(beside).max() < 0.05


@pytest.mark.parametrize("length", [0.5, 1.0, 2.0, 3.0])
@pytest.mark.parametrize("direction", [1, -1])
def test_the_last_piece_is_driven_in_the_direction_asked_for_and_without_a_stop(
    length: float, direction: int
) -> None:
    config = with_route(final_straight=length, final_direction=direction)
    area = Area(boundary=[(-10.0, -10.0), (40.0, -10.0), (40.0, 30.0), (-10.0, 30.0)])
    manoeuvre = plan_manoeuvre(START, Pose2(15.0, -5.0, 0.5 * pi), area, config)
    last = manoeuvre.segments[-1].part
    assert last.direction == direction
    assert last.end - last.start >= length - 1e-9
    assert len(manoeuvre.segments) == manoeuvre.cusps + 1
    at = last.reference(np.linspace(last.end - 0.95 * length, last.end, 20))
    assert np.abs(at.x - 15.0).max() < 1e-3


def test_a_way_keeps_out_of_a_place_but_on_its_last_piece() -> None:
    """What is docked at may be anywhere around: only the straight last piece leads there."""
    config, goal = with_route(final_straight=2.0, final_direction=-1), Pose2(15.0, -5.0, 0.5 * pi)
    around = np.array([(12.0, -10.0), (18.0, -10.0), (18.0, -4.5), (12.0, -4.5)])
    area = Area(boundary=[(-10.0, -12.0), (40.0, -12.0), (40.0, 30.0), (-10.0, 30.0)])
    planning = RoutePlanning(START, goal, area, config, keep_out=[around])
    while planning.manoeuvre is None:
        planning.advance()
    assert planning.manoeuvre.found
    bodies = body_polygons(poses_along(planning.manoeuvre), config.vehicle)
    poses = poses_along(planning.manoeuvre)
    meets = shapely.intersects(shapely.polygons(bodies), shapely.Polygon(around))
    before = np.hypot(poses[:, 0] - goal.x, poses[:, 1] - goal.y) > 2.0 + 1e-6
    assert meets.any()  # there is no other way to stand there
    assert not meets[before].any()


def test_a_straight_stretch_that_is_not_free_is_said() -> None:
    walls = [
        [(5.0, 1.0), (9.0, 1.0), (9.0, 9.0), (5.0, 9.0)],
        [(11.0, 1.0), (15.0, 1.0), (15.0, 9.0), (11.0, 9.0)],
    ]
    across = [(9.0, -3.0), (11.0, -3.0), (11.0, -2.0), (9.0, -2.0)]
    area = Area(obstacles=[*walls, across, [(9.0, 8.0), (11.0, 8.0), (11.0, 9.0), (9.0, 9.0)]])
    thin = CONFIG.vehicle.model_copy(update={"width": 1.2})
    config = with_route(final_straight=6.0).model_copy(update={"vehicle": thin})
    manoeuvre = plan_manoeuvre(START, Pose2(10.0, 3.0, 0.5 * pi), area, config)
    assert manoeuvre.outcome is PlanOutcome.NO_WAY
    assert "straight" in manoeuvre.reason


def test_the_margin_is_kept_where_there_is_room() -> None:
    box = [(6.0, -0.5), (7.0, -0.5), (7.0, 0.5), (6.0, 0.5)]
    manoeuvre = plan_manoeuvre(START, Pose2(16.0, 0.0, 0.0), Area(boundary=YARD, obstacles=[box]), CONFIG)
    assert manoeuvre.clearance >= CONFIG.clearance.on_routes - 0.02


NOT_THERE = [
    (
        "start",
        Area(boundary=YARD, obstacles=[[(1.0, -0.5), (2.0, -0.5), (2.0, 0.5), (1.0, 0.5)]]),
        Pose2(12.0, 0.0, 0.0),
        PlanOutcome.START_IN_COLLISION,
    ),
    (
        "goal",
        Area(boundary=YARD, obstacles=[[(12.0, -0.5), (14.0, -0.5), (14.0, 0.5), (12.0, 0.5)]]),
        Pose2(12.0, 0.0, 0.0),
        PlanOutcome.GOAL_IN_COLLISION,
    ),
    (
        "a wall across the yard",
        Area(boundary=YARD, obstacles=[[(8.0, -11.0), (8.5, -11.0), (8.5, 11.0), (8.0, 11.0)]]),
        Pose2(15.0, 0.0, 0.0),
        PlanOutcome.NO_WAY,
    ),
    (
        "a gap narrower than the body",
        Area(
            boundary=YARD,
            obstacles=[
                [(8.0, -11.0), (8.5, -11.0), (8.5, -0.9), (8.0, -0.9)],
                [(8.0, 0.9), (8.5, 0.9), (8.5, 11.0), (8.0, 11.0)],
            ],
        ),
        Pose2(15.0, 0.0, 0.0),
        PlanOutcome.NO_WAY,
    ),
]


@pytest.mark.parametrize(("what", "area", "goal", "outcome"), NOT_THERE, ids=[case[0] for case in NOT_THERE])
def test_where_there_is_no_way_it_is_said_why(
    what: str, area: Area, goal: Pose2, outcome: PlanOutcome
) -> None:
    small = with_route(searches=((1.0, 3.0),), nodes=4000)
    manoeuvre = plan_manoeuvre(START, goal, area, small)
    assert manoeuvre.outcome in (outcome, PlanOutcome.BUDGET_SPENT)
    assert manoeuvre.outcome is outcome or outcome is PlanOutcome.NO_WAY
    assert manoeuvre.reason
    assert (manoeuvre.found, manoeuvre.segments, manoeuvre.length, manoeuvre.cusps) == (False, (), 0.0, 0)
    with pytest.raises(PathError, match="there is no way"):
        _ = manoeuvre.path


def test_a_less_greedy_search_leaves_gaps_alone_that_the_body_does_not_fit_through() -> None:
    scene = drawn_scene(41207, 103, "clutter")
    ways = [
        plan_manoeuvre(
            scene.start,
            scene.goal,
            area_of(scene),
            config_of(scene).model_copy(
                update={"route": RoutePlanner(searches=((1.0, weight),), nodes=4000)}
            ),
        )
        for weight in (3.0, 1.5)
    ]
    assert [way.outcome for way in ways] == [PlanOutcome.BUDGET_SPENT, PlanOutcome.FOUND]


def test_the_margin_of_a_segment_is_the_clearance_along_it() -> None:
    scene = drawn_scene(41207, 81, "slot")
    area, config = area_of(scene), config_of(scene)
    manoeuvre = plan_manoeuvre(scene.start, scene.goal, area, config)
    assert len({segment.margin for segment in manoeuvre.segments}) > 3
    for segment in manoeuvre.segments:
        assert segment.margin is not None
        least = clearance(replace(manoeuvre, segments=(segment,)), area, scene.vehicle)
        assert segment.margin == pytest.approx(min(least, 2.0 * config.clearance.on_routes + 1.0), abs=5e-3)


@pytest.mark.parametrize("nodes", [2, 3])
def test_a_spent_budget_is_said_and_how_near_it_came(nodes: int) -> None:
    scene = drawn_scene(52, 3, "yard")
    config = config_of(scene).model_copy(update={"route": RoutePlanner(nodes=nodes)})
    manoeuvre = plan_manoeuvre(scene.start, scene.goal, area_of(scene), config)
    assert manoeuvre.outcome is PlanOutcome.BUDGET_SPENT
    assert "2 poses" in manoeuvre.reason
    assert 0.0 < manoeuvre.nearest < 100.0


def test_without_a_boundary_the_area_is_a_box_around_all_that_is_given() -> None:
    wall = [(8.0, -4.0), (8.5, -4.0), (8.5, 4.0), (8.0, 4.0)]
    manoeuvre = plan_manoeuvre(START, Pose2(15.0, 0.0, 0.0), Area(obstacles=[wall]), CONFIG)
    assert manoeuvre.path is not None
    assert max(float(np.abs(part.y).max()) for part in manoeuvre.path.parts) < 4.0 + 15.0


def test_short_stretches_end_within_a_share_of_the_tolerance() -> None:
    scene = drawn_scene(4711, 24, "aisle")
    manoeuvre = plan_manoeuvre(scene.start, scene.goal, area_of(scene), config_of(scene))
    for segment in manoeuvre.segments[:-1]:
        whole = segment.part.end - segment.part.start
        assert segment.tolerance[0] <= max(0.1 * min(whole, 1.0), 0.05) + 1e-9
    assert manoeuvre.segments[-1].tolerance == config_of(scene).goal_tolerance


def test_a_manoeuvre_says_the_same_in_all_its_properties() -> None:
    scene = drawn_scene(52, 1, "slot")
    manoeuvre = plan_manoeuvre(scene.start, scene.goal, area_of(scene), config_of(scene))
    assert manoeuvre.length == pytest.approx(manoeuvre.path.length)
    assert manoeuvre.nearest == 0.0
    assert manoeuvre.seconds > 0.0
    assert replace(manoeuvre, segments=()).length == 0.0
