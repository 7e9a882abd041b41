"""Bodies against many shapes in a grid, beside shapely against each of them."""

from __future__ import annotations

from math import inf

import numpy as np
import pytest
import shapely

from geometry import Corridor, InputError, Pose2, ReferencePath
from geometry.arrays import Array, Index
from geometry.shape_grid import Body, ShapeGrid
from geometry.walls import BEHIND
from tests.geometry.convex_shapes import drawn, exact, placed

BOX = np.array([[-0.8, -1.0], [3.7, -1.0], [3.7, 1.0], [-0.8, 1.0]])
BODY = Body.of(BOX)


def world(seed: int, shapes: int = 40, size: float = 2.0, spread: float = 10.0) -> tuple[list[Array], Index]:
    """Shapes, and whose they are of three."""
    random = np.random.default_rng(seed)
    found = [drawn(random, random.choice([1, 2, 2, 2, 5]), size, spread) for _ in range(shapes)]
    return found, random.integers(0, 3, shapes)


def poses(seed: int, count: int = 20) -> Array:
    random = np.random.default_rng(seed)
    return np.column_stack([random.uniform(-25.0, 25.0, (count, 2)), random.uniform(-4.0, 4.0, count)])


def nearest(body: Array, shapes: list[Array]) -> float:
    return min((exact(body, shape) for shape in shapes), default=inf)


@pytest.mark.parametrize("seed", range(12))
@pytest.mark.parametrize("within", [0.5, 4.0, inf])
def test_the_nearest_of_all_shapes_is_found(seed: int, within: float) -> None:
    shapes, owner = world(seed, shapes=[0, 1, 5, 40, 200][seed % 5], size=[0.1, 2.0, 30.0][seed % 3])
    grid = ShapeGrid.of_shapes(shapes, owner, 3)
    found = grid.signed_distances(BODY, poses(seed), within)
    for row, pose in zip(found, poses(seed), strict=True):
        for whose, value in enumerate(row):
            known = nearest(
                placed(BOX, pose), [s for s, its in zip(shapes, owner, strict=True) if its == whose]
            )
            assert value == (pytest.approx(known, abs=1e-9) if known < within else inf)


@pytest.mark.parametrize("asked", [np.zeros(3), np.zeros((2, 2)), np.array([[0.0, np.nan, 0.0]])])
def test_bad_poses_are_refused(asked: Array) -> None:
    with pytest.raises(InputError, match="poses"):
        ShapeGrid.of_lines([BOX]).signed_distances(BODY, asked)


@pytest.mark.parametrize("reach", [5.0, 500.0])
def test_in_a_closed_polygon_it_is_what_shapely_says(reach: float) -> None:
    random = np.random.default_rng(9)
    angle = np.sort(random.uniform(0.0, 2.0 * np.pi, 60))
    ring = np.column_stack([np.cos(angle), np.sin(angle)]) * random.uniform(5.0, 12.0, (60, 1))
    grid = ShapeGrid.of_lines([np.append(ring, ring[:1], axis=0)])
    points = random.uniform(-reach, reach, (2000, 2))
    inside = shapely.contains_xy(shapely.Polygon(ring), points)
    beyond = grid.beyond(points)
    np.testing.assert_array_equal(beyond == 0.0, inside)
    apart = shapely.distance(shapely.points(points), shapely.Polygon(ring))
    np.testing.assert_allclose(beyond, np.where(inside, 0.0, apart), atol=1e-9)
    for within in (0.05, 2.0):
        np.testing.assert_array_equal(grid.beyond(points, within), np.where(beyond <= within, beyond, 0.0))


def test_behind_an_open_boundary_it_is_another_way() -> None:
    path = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(1, 0.0, 40.0)])
    corridor = Corridor.from_offsets(path, left=3.0, right=-3.0)
    points = np.array([[20.0, 0.0], [20.0, 4.0], [20.0, -4.5], [20.0, 3.0 + BEHIND + 0.1]])
    lane = corridor.spaces[0]
    np.testing.assert_allclose(lane.boundary.beyond(points, lane.behind), [0.0, 1.0, 1.5, 0.0])
    inside = Corridor.from_polygon(path, [(-9.0, -3.0), (60.0, -3.0), (60.0, 3.0), (-9.0, 3.0)])
    hall = inside.spaces[0]
    np.testing.assert_allclose(hall.boundary.beyond(points, hall.behind), [0.0, 1.0, 1.5, BEHIND + 0.1])
