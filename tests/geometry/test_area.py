"""Areas, beside what shapely says of the same polygons."""

from __future__ import annotations

from math import inf, nan
from typing import Any

import numpy as np
import pytest
import shapely

from geometry import Area, AreaError, InputError
from geometry.arrays import Array
from geometry.shape_grid import Body
from tests.geometry.convex_shapes import placed

CAR = np.array([[-0.8, -1.0], [3.7, -1.0], [3.7, 1.0], [-0.8, 1.0]])
BODY = Body.of(CAR)
BEND = [(0.0, 0.0), (20.0, 0.0), (20.0, 10.0), (12.0, 10.0), (12.0, 4.0), (0.0, 4.0)]
BLOCK = [(4.0, 2.0), (6.0, 2.0), (6.0, 4.0), (4.0, 4.0)]


def star(random: np.random.Generator, corners: int, size: float, middle: Array) -> Array:
    """A polygon (corners, 2), not convex."""
    angle = 2.0 * np.pi * (np.arange(corners) + random.uniform(0.1, 0.9, corners)) / corners
    radius = size * random.uniform(0.3, 1.0, corners)
    return np.asarray(middle + radius[:, None] * np.column_stack([np.cos(angle), np.sin(angle)]))


def drawn(seed: int) -> tuple[Array | None, list[Array]]:
    """A boundary, mostly, and obstacles, which may overlap and cross it."""
    random = np.random.default_rng(seed)
    boundary = star(random, int(random.integers(3, 30)), 30.0, random.uniform(-5.0, 5.0, 2))
    obstacles = [
        star(random, int(random.integers(3, 12)), random.uniform(0.5, 6.0), random.uniform(-20.0, 20.0, 2))
        for _ in range(random.integers(0, 9))
    ]
    return (None if seed % 4 == 0 else boundary), obstacles


def poses(seed: int, count: int = 60) -> Array:
    random = np.random.default_rng(1000 + seed)
    return np.column_stack([random.uniform(-40.0, 40.0, (count, 2)), random.uniform(-4.0, 4.0, count)])


def solid(boundary: Array | None, obstacles: list[Array]) -> shapely.Geometry:
    """All of it as one."""
    shapes = [shapely.Polygon(ring) for ring in obstacles]
    if boundary is not None:
        shapes.append(shapely.box(-200.0, -200.0, 200.0, 200.0).difference(shapely.Polygon(boundary)))
    return shapely.union_all(shapes)


@pytest.mark.parametrize("seed", range(24))
def test_distances_are_those_of_shapely(seed: int) -> None:
    boundary, obstacles = drawn(seed)
    area, whole = Area(boundary=boundary, obstacles=obstacles), solid(boundary, obstacles)
    for value, pose in zip(area.signed_distances(BODY, poses(seed)), poses(seed), strict=True):
        car = shapely.Polygon(placed(CAR, pose))
        if whole.is_empty:
            assert value == inf
        elif shapely.distance(car, whole) > 0.0:
            assert value == pytest.approx(shapely.distance(car, whole), abs=1e-9)
        else:
            assert value <= 1e-9
            assert (value < -1e-9) == (shapely.area(shapely.intersection(car, whole)) > 1e-6)


def test_without_anything_solid_nothing_is_near() -> None:
    area = Area()
    assert area.boundary is None
    assert area.obstacles == ()
    assert (area.signed_distances(BODY, np.zeros((2, 3))) == inf).all()


def test_its_arrays_are_read_only_and_it_cannot_be_changed() -> None:
    corners = np.array(BEND)
    area = Area(boundary=corners, obstacles=[BLOCK])
    corners[:] = 0.0
    np.testing.assert_array_equal(area.boundary, BEND)
    for each in (area.boundary, *area.obstacles, area.grid.corners):
        assert each is not None
        assert not each.flags.writeable
    with pytest.raises(AttributeError):
        area.boundary = None  # type: ignore[misc]


def test_more_obstacles_are_the_same_as_given_at_once() -> None:
    area = Area(boundary=BEND).with_obstacles([BLOCK]).with_obstacles([[(15, 5), (16, 5), (16, 6)]])
    once = Area(boundary=BEND, obstacles=[BLOCK, [(15, 5), (16, 5), (16, 6)]])
    assert len(area.obstacles) == 2
    np.testing.assert_array_equal(
        area.signed_distances(BODY, poses(0)), once.signed_distances(BODY, poses(0))
    )
    assert area.with_obstacles([]) is area
    np.testing.assert_array_equal(
        Area().with_obstacles([BLOCK]).signed_distances(BODY, poses(0)),
        Area(obstacles=[BLOCK]).signed_distances(BODY, poses(0)),
    )


def test_a_box_around_all_that_is_given_bounds_it() -> None:
    area = Area(obstacles=[BLOCK]).bounded([(-1.0, 3.0), (5.0, 12.0)], 15.0)
    np.testing.assert_array_equal(area.boundary, [(-16, -13), (21, -13), (21, 27), (-16, 27)])
    np.testing.assert_array_equal(area.obstacles, [BLOCK])
    np.testing.assert_allclose(
        area.signed_distances(BODY, np.array([[16.0, 0.0, 0.0], [16.0, -15.0, 0.0]])), [1.3, -3.0]
    )
    assert area.bounded([(100.0, 100.0)], 15.0) is area
    np.testing.assert_array_equal(
        Area(obstacles=[BLOCK]).bounded([], 1.0).boundary, [(3, 1), (7, 1), (7, 5), (3, 5)]
    )
    np.testing.assert_array_equal(
        Area().bounded([(2.0, 3.0)], 1.0).boundary, [(1, 2), (3, 2), (3, 4), (1, 4)]
    )


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"boundary": [(0, 0), (1, 0)]}, r"^boundary has 2 corner\(s\), a polygon needs at least 3\.$"),
        (
            {"boundary": [(0, 0), (1, 0), (0, 0)]},
            r"^boundary has 2 corner\(s\), a polygon needs at least 3\.$",
        ),
        ({"boundary": [(0, 0), (2, 2), (2, 0), (0, 2)]}, r"^boundary is not a simple polygon \(Self-inter.*"),
        (
            {"boundary": [(0, 0), (1, nan), (2, 2)]},
            r"^boundary\[1\] = \[1.0, nan\]: must be finite numbers\.$",
        ),
        ({"boundary": [(0, 0, 0), (1, 0, 0), (1, 1, 0)]}, r"^boundary has shape \(3, 3\), it must be"),
        ({"boundary": "yard"}, r"^boundary = 'yard': must be an array of numbers or None$"),
        ({"obstacles": [BLOCK, BLOCK, BLOCK, np.zeros((0, 2))]}, r"^obstacles\[3\] has no corner"),
        ({"obstacles": [[(1.0, nan)]]}, r"^obstacles\[0\]\[0\] = \[1.0, nan\]: must be finite numbers\.$"),
        ({"obstacles": [[(0, 0), (2, 2), (2, 0), (0, 2)]]}, r"^obstacles\[0\] is not a simple polygon \("),
        ({"obstacles": [[(0, 0), (1, 0), (1, 1), (1, 0)]]}, r"^obstacles\[0\] is not a simple polygon \("),
        ({"obstacles": BLOCK}, r"^obstacles\[0\] has shape \(2,\), it must be \(n, 2\)\.$"),
        ({"obstacles": 5}, r"^obstacles = 5: must be a sequence$"),
    ],
)
def test_bad_polygons_are_refused(given: dict[str, Any], message: str) -> None:
    with pytest.raises(AreaError, match=message):
        Area(**given)


def test_bad_arguments_are_refused() -> None:
    area = Area()
    with pytest.raises(AreaError, match=r"^polygons\[1\] has no corner"):
        area.with_obstacles([BLOCK, np.zeros((0, 2))])
    with pytest.raises(AreaError, match=r"^beyond = 0.0: must be > 0 m and finite, at most 1e\+12 m\.$"):
        area.bounded([(0, 0)], 0.0)
    with pytest.raises(AreaError, match=r"^points is empty and there are no obstacles"):
        area.bounded([], 1.0)
    with pytest.raises(AreaError, match=r"^points has shape \(2,\), it must be \(n, 2\)\.$"):
        area.bounded([0.0, 1.0], 1.0)
    with pytest.raises(AreaError, match=r"^points\[0\] = \[0.0, nan\]: must be finite numbers\.$"):
        area.bounded([(0.0, nan)], 1.0)
    with pytest.raises(AreaError, match=r"points = .*: must be an array of numbers"):
        area.bounded([(0.0, 1.0), (2.0,)], 1.0)
    with pytest.raises(InputError, match="poses"):
        area.signed_distances(BODY, np.zeros((2, 2)))
