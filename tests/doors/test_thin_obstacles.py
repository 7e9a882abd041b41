"""Obstacles that are lines and points: taken wherever obstacles are, and solid without any width."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf, nan, pi
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely
from numpy.typing import ArrayLike

from geometry import Area, AreaError, Corridor, CorridorError, Pose2, ReferencePath
from geometry.convex import swept
from geometry.lines import CorridorLines
from geometry.shape_grid import Body
from rti_mpcc import ControllerConfig, DockingController, VehicleState, plan_manoeuvre
from rti_mpcc.config import RoutePlanner
from rti_mpcc.recording import Recorder, replay
from rti_mpcc.recording.codec import structured
from rti_mpcc.recording.lines import from_line, to_line
from rti_mpcc.report.files import write_files
from rti_mpcc.report.ground import drawn_outlines
from rti_mpcc.report.ride import ride_of_run
from rti_mpcc.simulation import scenario_from_dict, simulate, summary
from rti_mpcc.types import Array, Status
from tests.rti_mpcc.encounters import body_at
from tests.rti_mpcc.yards import BEYOND, BRISK, YARD, Drive, Driver, block

PATH = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(1, 0.0, 14.0)])
CAR = Body.of([(-1.0, -1.0), (3.0, -1.0), (3.0, 1.0), (-1.0, 1.0)])
DOOR: list[Any] = [[(7.0, 1.5), (7.0, 8.0)], [(7.0, -8.0), (7.0, -1.5)]]
"""Two walls without width, 3 m apart."""
POSTS: list[Any] = [[(7.0, 1.6)], [(7.0, -1.6)]]


def distances(obstacle: ArrayLike, poses: Sequence[tuple[float, float, float]]) -> Array:
    """Of the car to an obstacle of an area."""
    return Area(obstacles=[obstacle]).signed_distances(CAR, np.array(poses))


# -- what they are -------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("given", "kept"),
    [
        ([(1, 2)], [(1, 2)]),
        ([(1, 2), (1, 2)], [(1, 2)]),
        ([(1, 2), (1, 2), (1, 2)], [(1, 2)]),
        ([(1, 2), (4, 2)], [(1, 2), (4, 2)]),
        ([(1, 2), (4, 2), (1, 2)], [(1, 2), (4, 2)]),
        ([(2, 2), (1, 1), (4, 4), (3, 3)], [(4, 4), (1, 1)]),
        ([(0.1, 0.1), (0.1 + 0.2, 0.1 + 0.2), (0.7, 0.7)], [(0.1, 0.1), (0.7, 0.7)]),
        ([(1e9, 5), (1e9, 8), (1e9, 6)], [(1e9, 5), (1e9, 8)]),
    ],
)
def test_polygons_without_area_are_lines_and_points(given: Any, kept: Any) -> None:
    for found in (
        Area(obstacles=[given]).obstacles,
        YARD.with_obstacles([given]).obstacles,
        Corridor.from_offsets(PATH, left=5, right=-5, obstacles=[given]).obstacles,
        Corridor.in_area(YARD).with_obstacles([given]).to_lines().obstacles,
    ):
        assert [sorted(map(tuple, each.tolist())) for each in found] == [sorted(map(tuple, kept))]


def test_a_thin_polygon_stays_one() -> None:
    sliver = [(0.0, 0.0), (10.0, 0.0), (10.0, 1e-4)]
    assert Area(obstacles=[sliver]).obstacles[0].shape == (3, 2)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (np.zeros((0, 2)), "no corner"),
        ((1.0, 2.0), r"shape \(2,\)"),
        ([(1.0, nan)], "finite"),
        ([(0, 0), (2, 2), (2, 0), (0, 2)], "not a simple polygon"),
        ([(0, 0), (1, 0), (1, 1), (1, 0)], "not a simple polygon"),
    ],
)
def test_what_is_no_obstacle_is_refused(given: Any, said: str) -> None:
    with pytest.raises(AreaError, match=said):
        Area(obstacles=[given])
    with pytest.raises(CorridorError, match=said):
        Corridor.from_offsets(PATH, left=5.0, right=-5.0, obstacles=[given])


def test_bodies_and_boundaries_need_an_area() -> None:
    with pytest.raises(AreaError, match="needs at least 3"):
        Area(boundary=[(0.0, 0.0), (9.0, 0.0)])
    with pytest.raises(CorridorError, match="needs at least 3"):
        Corridor.from_polygon(PATH, [(0.0, 0.0), (9.0, 0.0)])


# -- distances -----------------------------------------------------------------------------------------------


def test_distances_to_a_point() -> None:
    found = distances([(5.0, 0.5)], [(0, 0, 0), (0, 4, 0), (3, 0, 0), (5, 0.5, 0), (8.0, 0.5, pi)])
    np.testing.assert_allclose(found, [2.0, np.hypot(2.0, 2.5), -0.5, -1.0, 0.0], atol=1e-12)


def test_distances_to_a_line() -> None:
    wall = [(5.0, -4.0), (5.0, 4.0)]
    found = distances(wall, [(0, 0, 0), (1.9, 3.0, 0), (3, 0, 0), (0, 6.5, 0), (5.0, 8.0, -0.5 * pi)])
    np.testing.assert_allclose(found, [2.0, 0.1, -1.0, 2.5, 1.0], atol=1e-12)


def test_distances_are_those_of_shapely() -> None:
    random = np.random.default_rng(1)
    for _ in range(300):
        corners = random.uniform(-6.0, 6.0, (random.integers(1, 3), 2))
        pose = random.uniform(-3.0, 3.0, 3)
        (found,) = distances(corners, [tuple(pose)])
        body = shapely.Polygon(Area(obstacles=[CAR.corners]).obstacles[0] @ _turned(pose[2]) + pose[:2])
        thing = shapely.LineString(corners) if len(corners) > 1 else shapely.Point(corners)
        apart = body.distance(thing)
        assert found == pytest.approx(apart, abs=1e-9) if apart > 0.0 else found <= 0.0
        corridor = Corridor.from_offsets(PATH, left=90.0, right=-90.0, obstacles=[corners])
        exact = corridor.clearance(0, np.array([shapely.get_coordinates(body)[:-1]]))
        assert (exact[0] > 0.0) == (found > 0.0)
        assert exact[0] == pytest.approx(found, abs=1e-9) or found <= 0.0


def _turned(angle: float) -> Array:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([(c, s), (-s, c)])


@pytest.mark.parametrize(
    ("body", "pose", "expected"),
    [
        ([(0.0, 0.0)], (9.0, 0.0, 0.0), 4.0),
        ([(0.0, 0.0)], (5.0, 0.0, 0.0), 0.0),
        ([(0.0, 0.0)], (3.0, 0.0, 0.3), 0.0),
        ([(0.0, 0.0), (1.0, 0.0)], (-2.0, 0.0, 0.0), 1.0),
        ([(0.0, 0.0), (1.0, 0.0)], (-1.0, 0.0, 0.0), 0.0),
        ([(0.0, 0.0), (1.0, 0.0)], (7.0, 7.0, 0.0), np.hypot(2.0, 7.0)),
    ],
)
def test_thin_bodies_on_the_line_of_a_wall(body: Any, pose: Any, expected: float) -> None:
    area = Area(obstacles=[[(0.0, 0.0), (5.0, 0.0)]])
    assert area.signed_distances(Body.of(body), np.array([pose]))[0] == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize("corners", [[(1.0, 2.0)], [(1.0, 2.0), (4.0, 3.0)]])
@pytest.mark.parametrize("way", [(2.0, 0.0), (-1.0, 5.0), (3.0, 1.0), (-6.0, -2.0), (0.0, 0.0)])
def test_what_they_cover_as_they_move(corners: Any, way: tuple[float, float]) -> None:
    shape, found = np.array(corners), np.empty((len(corners) + 2, 2))
    count = swept(shape, *way, found)
    covered = shapely.convex_hull(shapely.MultiPoint(np.vstack([shape, shape + way])))
    made = shapely.convex_hull(shapely.MultiPoint(found[:count]))
    assert shapely.hausdorff_distance(covered, made) < 1e-12
    if count > 2:
        assert shapely.is_ccw(shapely.LinearRing(found[:count]))


# -- routes and rides ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("things", [DOOR, POSTS, [*DOOR, *POSTS]])
def test_a_route_leads_between_them(things: Any) -> None:
    found = plan_manoeuvre(Pose2(0.0, 0.0, 0.0), BEYOND, YARD.with_obstacles(things))
    assert found.found, found.reason
    assert least(found.path, things) == pytest.approx(found.clearance, abs=0.01)
    assert found.clearance >= 0.05


def test_no_route_leads_through_a_wall() -> None:
    area = YARD.with_obstacles([[(7.0, -8.0), (7.0, 8.0)]])
    config = ControllerConfig(route=RoutePlanner(nodes=3000))
    assert not plan_manoeuvre(Pose2(0.0, 0.0, 0.0), BEYOND, area, config).found


def test_in_line_with_a_wall_there_is_room() -> None:
    """A wall ends 3 m ahead of the start, the goal is beyond its other end."""
    area = YARD.with_obstacles([[(7.0, 0.0), (9.0, 0.0)]])
    found = plan_manoeuvre(Pose2(0.0, 0.0, 0.0), Pose2(14.0, 0.0, 0.0), area)
    assert found.found
    assert found.cusps == 0


def least(path: ReferencePath, things: Any) -> float:
    """Clearance of the body on a path to lines and points, by shapely."""
    shapes = [shapely.LineString(each) if len(each) > 1 else shapely.Point(each[0]) for each in things]
    found = inf
    for at in path.sample(0.02):
        for x, y, phi in zip(at.x, at.y, at.phi, strict=True):
            body = body_at(x, y, phi, ControllerConfig().vehicle)
            found = min(found, *(body.distance(shape) for shape in shapes))
    return found


@pytest.mark.parametrize("given", ["area", "step"])
def test_a_ride_between_walls_and_posts(given: str) -> None:
    things = [*DOOR, *POSTS]
    area = YARD.with_obstacles(things) if given == "area" else YARD
    driver = Driver(
        area=YARD,
        controller=DockingController.in_area(area, BRISK),
        obstacles_at=(lambda now: [np.array(each) for each in things]) if given == "step" else None,
        standing_at=lambda now: [],
    )
    drive = driver.drive(60.0)
    assert drive.docked, drive.reasons[-1]
    shapes = [shapely.LineString(each) for each in DOOR]
    for x, y, phi in drive.states[:, :3]:
        body = body_at(x, y, phi, BRISK.vehicle)
        assert min(body.distance(shape) for shape in shapes) > 0.02


@pytest.mark.parametrize("thing", [[(8.0, -0.4)], [(8.0, -0.6), (8.0, 0.0)], [(6.0, -0.2), (8.5, -0.1)]])
def test_on_a_path_they_are_passed(thing: Any) -> None:
    corridor = Corridor.from_offsets(PATH, left=6.0, right=-6.0, obstacles=[thing])
    controller = DockingController(PATH, corridor, BRISK)
    driver = Driver(area=YARD, controller=controller, goal_at=lambda now: None, standing_at=lambda now: [])
    drive = driver.drive(60.0)
    assert drive.docked, drive.reasons[-1]
    shape = shapely.LineString(thing) if len(thing) > 1 else shapely.Point(thing)
    nearest = min(body_at(x, y, phi, BRISK.vehicle).distance(shape) for x, y, phi in drive.states[:, :3])
    assert nearest > 0.02


@pytest.mark.parametrize("thing", [[(0.0, 0.0)], [(0.0, -0.6), (0.0, 0.6)], [(-0.6, 0.0), (0.6, 0.0)]])
def test_one_that_crosses_is_waited_for(thing: Any) -> None:
    """As for a box that is 2 mm wider."""
    box = shapely.get_coordinates(shapely.convex_hull(shapely.MultiPoint(thing)).buffer(1e-3).exterior)
    thin, wide = crossed(np.array(thing)), crossed(box)
    assert Status.BLOCKED in thin.statuses
    assert thin.docked
    assert thin.times[-1] == pytest.approx(wide.times[-1], abs=0.3)


def crossed(thing: Array) -> Drive:
    """A ride that something crosses at 1 m/s."""
    driver = Driver(
        area=YARD,
        controller=DockingController.in_area(YARD, BRISK),
        obstacles_at=lambda now: [thing + np.array((9.0, -8.0 + now))],
        standing_at=lambda now: [],
    )
    return driver.drive(60.0)


def test_a_body_on_a_wall_is_told_what_it_overlaps() -> None:
    controller = DockingController.in_area(YARD, BRISK)
    for k in range(3):
        command = controller.step(
            VehicleState(x=0.0, y=0.0, phi=0.0, v=0.0, delta=0.0),
            now=0.05 * k,
            goal=BEYOND,
            obstacles=[[(2.0, 0.5), (2.0, 6.0)]],
        )
    assert "overlaps obstacles[0] by 0.53 m at (2.00, 0.77)" in command.diagnostics.reason


# -- files and pictures --------------------------------------------------------------------------------------


HALL: dict[str, Any] = {
    "name": "hall",
    "start": {"pose": [0.0, 0.0, 0.0]},
    "area": {
        "boundary": [[-5.0, -6.0], [25.0, -6.0], [25.0, 6.0], [-5.0, 6.0]],
        "obstacles": [[[8.0, 4.0], [10.0, 4.0]], [[8.0, -4.0]], [[3.0, 3.0], [4.0, 3.0], [3.0, 3.0]]],
    },
    "goal": {"pose": [7.0, 0.0, 0.0]},
    "simulation": {"duration": 2.0, "cycle": 0.1},
}
LANE: dict[str, Any] = {
    "name": "lane",
    "path": {
        "start": [0.0, 0.0, 0.0],
        "segments": [{"direction": 1, "curvature": 0.0, "length": 12.0}],
    },
    "corridor": {"left": 4.0, "right": -4.0, "obstacles": [[[5.0, 2.0], [7.0, 2.0]], [[5.0, -2.0]]]},
    "simulation": {"duration": 2.0, "cycle": 0.1},
}


@pytest.mark.parametrize("data", [HALL, LANE], ids=["area", "path"])
def test_scenario_files_have_them(data: dict[str, Any], tmp_path: Path) -> None:
    scenario = scenario_from_dict(data)
    things = data["corridor"]["obstacles"] if "path" in data else []
    known = [np.array(each) for each in things]
    come = [np.array([(9.0, 5.0), (9.5, 5.5)]), np.array([(9.0, -3.0)])]
    result = simulate(scenario, obstacles_at=lambda now: [*known, *come] if now > 0.45 else known)
    assert 0.0 < summary(result)["min_clearance_m"] < 3.2
    assert 1.0 < summary(result)["min_clearance_m"] < 1.97
    write_files(ride_of_run(result), summary(result), tmp_path)
    assert (tmp_path / "overview.png").stat().st_size > 1000


@pytest.mark.parametrize("thing", [[(2.0, -1.0), (2.0, 1.0)], [(2.0, 0.0)]], ids=["a line", "a point"])
def test_one_that_the_body_stands_on_is_named(thing: list[tuple[float, float]]) -> None:
    apart = block(1.0, 2.0, 7.0, 8.0)
    controller = DockingController.in_area(YARD.with_obstacles([apart, thing]))
    for k in range(3):
        command = controller.step(
            VehicleState(0.0, 0.0, 0.0, 0.0, 0.0), now=0.05 * k, goal=Pose2(12.0, 0.0, 0.0)
        )
    assert command.status is Status.BLOCKED
    assert "the body overlaps area.obstacles[1]" in command.diagnostics.reason


def test_they_are_drawn_4_cm_wide() -> None:
    shapes = [
        shapely.Polygon(each) for each in drawn_outlines([np.array(each) for each in (POSTS[0], DOOR[0])])
    ]
    assert [shape.area for shape in shapes] == pytest.approx([0.04**2, 0.04 * (6.5 + 0.04)])
    (drawn,) = Area(obstacles=[POSTS[0]]).polygons
    assert shapely.Polygon(drawn).area == pytest.approx(0.04**2, rel=1e-3)


def test_a_bad_one_in_a_file_is_named() -> None:
    area = HALL["area"] | {"obstacles": [[[1.0, 1.0]], []]}
    with pytest.raises(ValueError, match=r"area\.obstacles\[1\]"):
        scenario_from_dict(HALL | {"area": area})


def test_corridors_with_them_are_stored_and_read() -> None:
    things = [*DOOR, *POSTS, block(1.0, 3.0, 2.0, 4.0)]
    for corridor in (
        Corridor.from_offsets(PATH, left=9.0, right=-9.0, obstacles=things),
        Corridor.in_area(YARD.with_obstacles(things)).with_obstacles(POSTS),
    ):
        line = to_line(corridor.to_lines()).rstrip()
        again = Corridor.from_lines(structured(from_line(line)[0], CorridorLines))
        assert len(again.obstacles) == len(corridor.obstacles)
        assert all(map(np.array_equal, again.obstacles, corridor.obstacles))
        if corridor.area is not None and again.area is not None:
            assert all(map(np.array_equal, again.area.obstacles, corridor.area.obstacles))


def test_rides_with_them_are_recorded_and_replayed(tmp_path: Path) -> None:
    area, file = YARD.with_obstacles(DOOR), tmp_path / "ride.jsonl"
    with Recorder(DockingController.in_area(area, BRISK), file) as recorder:
        driver = Driver(
            area=YARD, controller=recorder, obstacles_at=lambda now: [np.array(each) for each in POSTS],
            standing_at=lambda now: [],
        )  # fmt: skip
        driver.drive(3.0)
    report = replay(file)
    assert report.mismatch is None
    assert report.complete
