"""Obstacles that are lines and points: taken wherever obstacles are, and solid without any width."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
import shapely
from numpy.typing import ArrayLike

from benchmarks.encounters import body_at
from geometry import Area, Corridor, Pose2, ReferencePath
from geometry.shape_grid import Body
from rti_mpcc import DockingController, VehicleState
from rti_mpcc.types import Array, Status
from tests.geometry.convex_shapes import placed
from tests.geometry.sides import distances as of_bodies
from tests.rti_mpcc.yards import BRISK, YARD, Driver, block

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
        Corridor.in_area(YARD).with_obstacles([given]).obstacles,
    ):
        assert [sorted(map(tuple, each.tolist())) for each in found] == [sorted(map(tuple, kept))]


# -- distances -----------------------------------------------------------------------------------------------


def test_distances_are_those_of_shapely() -> None:
    random = np.random.default_rng(1)
    for _ in range(300):
        corners = random.uniform(-6.0, 6.0, (random.integers(1, 3), 2))
        pose = random.uniform(-3.0, 3.0, 3)
        (found,) = distances(corners, [tuple(pose)])
        body = shapely.Polygon(placed(Area(obstacles=[CAR.corners]).obstacles[0], pose))
        thing = shapely.LineString(corners) if len(corners) > 1 else shapely.Point(corners)
        apart = body.distance(thing)
        assert found == pytest.approx(apart, abs=1e-9) if apart > 0.0 else found <= 0.0
        corridor = Corridor.from_offsets(PATH, left=90.0, right=-90.0, obstacles=[corners])
        assert of_bodies(corridor, 0, CAR, pose[None])[0, 1] == pytest.approx(found, abs=1e-9)


# -- routes and rides ----------------------------------------------------------------------------------------


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


# -- files and pictures --------------------------------------------------------------------------------------


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
