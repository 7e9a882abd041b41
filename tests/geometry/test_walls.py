"""What walls keep of the lines that they are built from, and what is measured against them."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable
from math import cos, pi, sin

import numpy as np
import pytest
import shapely

from geometry import Corridor, Narrowing, PartLines, Pose2, ReferencePath
from geometry.arrays import Array
from geometry.shape_grid import Body
from geometry.walls import FINE, SMOOTH, simplified
from tests.geometry.sides import distances, sides_of

BODY = np.array([[-1.0, -1.0], [3.0, -1.0], [3.0, 1.0], [-1.0, 1.0]])
LONG = ReferencePath.from_segments(
    Pose2(0.0, 0.0, 0.0), [(1, 0.1 if i % 2 else -0.1, 10.0) for i in range(40)]
)


def kept(line: Array) -> Array:
    """What a corridor keeps of a boundary."""
    return PartLines(left=(line,), right=(), joined=False, narrowest=(5.0, 0.0)).left[0]


def test_a_line_of_far_too_many_points_is_kept_as_one_of_few() -> None:
    """A point a tenth of a millimetre, as a scan gives them, is not kept: only where the line bends."""
    corners = np.array([(0.0, 0.0), (3.0, 0.0), (4.0, 2.0), (4.0, 3.0)])
    at = np.linspace(0.0, 3.0, 30_001)
    crowded = np.column_stack([np.interp(at, range(4), corners[:, i]) for i in (0, 1)])
    np.testing.assert_allclose(kept(crowded), corners, atol=1e-12)
    for turn in np.linspace(0.0, 6.0, 13):  # it still bends where a circle of small radius does
        angle = turn + np.linspace(0.0, 4.0, 5000)
        circle = 0.3 * np.column_stack([np.cos(angle), np.sin(angle)])
        thinned = kept(circle)
        assert len(thinned) < 300
        lines = shapely.LineString(thinned), shapely.LineString(circle)
        assert shapely.hausdorff_distance(*lines) < 2e-5


@pytest.mark.parametrize("turn", [0.3, 1.9, 3.1])
def test_a_turned_wall_is_simplified_to_the_same_points(turn: float) -> None:
    """Of a symmetric bend two points are equally far from each chord: rounding must not choose."""
    angle = np.linspace(0.0, 3.0, 601)
    bend = 7.0 * np.column_stack([np.cos(angle), np.sin(angle)])
    turned = np.array([[cos(turn), sin(turn)], [-sin(turn), cos(turn)]])
    found, expected = simplified(bend @ turned, SMOOTH), simplified(bend, SMOOTH)
    np.testing.assert_allclose(found, expected @ turned, atol=1e-12)
    assert len(expected) < 120
    assert shapely.hausdorff_distance(*map(shapely.LineString, (expected, bend))) <= SMOOTH


def test_a_wall_that_turns_back_keeps_its_tip() -> None:
    there_and_back = np.array([(0.0, 0.0), (4.0, 0.0), (9.0, 0.0), (5.0, 0.0), (2.0, 0.0)])
    np.testing.assert_array_equal(simplified(there_and_back, SMOOTH), there_and_back[[0, 2, 4]])
    spike = there_and_back[[0, 2, 4]]
    np.testing.assert_array_equal(simplified(spike, SMOOTH), spike)


def test_bodies_far_and_near_against_all_lines() -> None:
    corridor = Corridor.from_offsets(LONG, left=5.0, right=-5.0)
    every = shapely.MultiLineString([line for side in corridor.lines(0) for line in side])
    random = np.random.default_rng(4)
    at = LONG.parts[0].reference(random.uniform(0.0, 400.0, 200))
    poses = np.column_stack([at.x, at.y, np.zeros(200)])
    poses[:, :2] += random.uniform(-12.0, 12.0, (200, 2))
    for some in (poses, poses[:1], poses[:0], poses + np.array([300.0, 300.0, 0.0])):
        exact = shapely.distance(shapely.polygons(some[:, None, :2] + BODY), every)
        found = distances(corridor, 0, Body.of(BODY), some)[:, 0]
        free = found > FINE
        np.testing.assert_allclose(found[free], exact[free], atol=FINE)
        assert not free[exact <= 0.0].any()


def test_walls_that_were_measured_against_can_still_be_pickled() -> None:
    corridor = Corridor.from_offsets(LONG, left=5.0, right=-5.0)
    before = distances(corridor, 0, Body.of(BODY), np.zeros((1, 3)))
    again, body = pickle.loads(pickle.dumps((corridor, Body.of(BODY))))
    np.testing.assert_array_equal(distances(again, 0, body, np.zeros((1, 3))), before)
    again, body = copy.deepcopy((corridor, body))
    np.testing.assert_array_equal(distances(again, 0, body, np.zeros((1, 3))), before)


BOX = [(-4.0, -20.0), (25.0, -20.0), (25.0, 12.0), (-4.0, 12.0)]
OBSTACLES = [
    [(2.0, 3.0), (3.0, 3.5), (2.0, 4.0)],
    [(4.0, -4.0), (4.0, -5.0), (6.0, -5.0), (6.0, -4.0), (4.0, -4.0)],
    [(7.1, 1.0), (8.0, 1.0), (8.0, 2.0), (7.1, 2.0), (7.3, 1.5)],
]
NARROWINGS = [Narrowing(22.0, 23.0, left=1.3), Narrowing(27.5, 28.4, right=-1.0)]

REVERSING = [(-1, -0.2, 10.0), (-1, 0.2, 10.0), (-1, 0.0, 5.0), (-1, 0.2, 5.0)]
ROUTE = ReferencePath.from_segments(Pose2(0.0, 0.0, pi / 2), [(1, 0.05, 8.0), *REVERSING])
ONE_WAY = ReferencePath.from_segments(Pose2(0.1, 0.2, 0.3), [(1, 0.0, 7.0), (1, 0.03, 5.0)])

CORRIDORS: dict[str, Callable[[], Corridor]] = {
    "offsets": lambda: Corridor.from_offsets(ROUTE, left=5.0, right=-5.0),
    "narrowings": lambda: Corridor.from_offsets(ROUTE, left=5.0, right=-5.0, narrowings=NARROWINGS),
    "obstacles": lambda: Corridor.from_offsets(ROUTE, left=4.0, right=-3.0, obstacles=OBSTACLES),
    "other obstacles": lambda: Corridor.from_offsets(ROUTE, left=4.0, right=-3.0).with_obstacles(OBSTACLES),
    "polygon": lambda: Corridor.from_polygon(ONE_WAY, BOX),
    "polygon and obstacles": lambda: Corridor.from_polygon(ONE_WAY, BOX, obstacles=OBSTACLES),
}


@pytest.fixture(params=CORRIDORS)
def corridor(request: pytest.FixtureRequest) -> Corridor:
    return CORRIDORS[request.param]()


def built_again(corridor: Corridor) -> Corridor:
    """The corridor built from the lines and polygons that define it."""
    walls = (
        PartLines(left=one.left, right=one.right, joined=one.joined, narrowest=one.narrowest)
        for one in corridor.walls
    )
    return Corridor(walls=tuple(walls), obstacles=corridor.obstacles)


def test_boundaries_and_obstacles_are_the_same(corridor: Corridor) -> None:
    again = built_again(corridor)
    for one, other in zip(corridor.walls, again.walls, strict=True):
        assert (len(one.left), one.joined, one.narrowest) == (len(other.left), other.joined, other.narrowest)
        assert all(map(np.array_equal, (*one.left, *one.right), (*other.left, *other.right)))
    assert len(corridor.obstacles) == len(again.obstacles)
    assert all(map(np.array_equal, corridor.obstacles, again.obstacles))


def test_half_planes_and_clearances_are_the_same(corridor: Corridor) -> None:
    again = built_again(corridor)
    points = np.random.default_rng(1).uniform((-6.0, -22.0), (27.0, 14.0), (300, 2))
    body, poses = Body.of([[0.0, 0.0], [1.0, 0.0], [1.0, 0.5]]), np.column_stack([points, np.zeros(300)])
    for part in range(len(corridor.walls)):
        before, after = (sides_of(each, part, points) for each in (corridor, again))
        np.testing.assert_array_equal(before.distance, after.distance)
        np.testing.assert_array_equal(before.normal, after.normal)
        np.testing.assert_array_equal(
            distances(corridor, part, body, poses), distances(again, part, body, poses)
        )
