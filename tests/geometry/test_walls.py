"""What walls keep of the lines that they are built from, and what is measured against them."""

from __future__ import annotations

import pickle

import numpy as np
import pytest
import shapely

from geometry import Corridor, Pose2, ReferencePath
from geometry.clearance import Segments
from geometry.walls import FINE, SMOOTH, PartWalls

LONG = ReferencePath.from_segments(
    Pose2(0.0, 0.0, 0.0), [(1, 0.1 if i % 2 else -0.1, 10.0) for i in range(40)]
)
SHAPES = [
    np.array([(0.0, 0.0), (4.0, 0.0), (4.0, 2.0), (1.0, 2.5)]),
    np.array([(9.0, 1.0)]),
    np.array([(8.0, 5.0), (6.0, 5.0), (6.0, 4.0)]),
]
WIDTH = (5.0, 0.0)


def test_polylines_are_kept_read_only_and_without_repeated_points() -> None:
    repeated = [np.repeat(shape, 2, axis=0) for shape in SHAPES]
    for lines in (SHAPES, repeated):
        walls = PartWalls.from_lines(lines, [], WIDTH)
        for shape, line in zip(SHAPES, walls.left, strict=True):
            np.testing.assert_array_equal(line, shape)
            assert not line.flags.writeable
    assert walls.right == ()
    assert walls.is_open


def test_a_line_of_far_too_many_points_is_kept_as_one_of_few() -> None:
    """A point a tenth of a millimetre, as a scan gives them, is not kept: only where the line bends."""
    corners = np.array([(0.0, 0.0), (3.0, 0.0), (4.0, 2.0), (4.0, 3.0)])
    at = np.linspace(0.0, 3.0, 30_001)
    crowded = np.column_stack([np.interp(at, range(4), corners[:, i]) for i in (0, 1)])
    np.testing.assert_allclose(PartWalls.from_lines([crowded], [], WIDTH).left[0], corners, atol=1e-12)
    for turn in np.linspace(0.0, 6.0, 13):  # it still bends where a circle of small radius does
        angle = turn + np.linspace(0.0, 4.0, 5000)
        circle = 0.3 * np.column_stack([np.cos(angle), np.sin(angle)])
        thinned = PartWalls.from_lines([circle], [], WIDTH).left[0]
        assert len(thinned) < 300
        lines = shapely.LineString(thinned), shapely.LineString(circle)
        assert shapely.hausdorff_distance(*lines) < 2e-5


def test_what_is_checked_and_what_gives_rows_is_near_the_lines() -> None:
    walls = Corridor.from_offsets(LONG, left=5.0, right=-5.0).walls[0]
    given = shapely.MultiLineString([line for lines in walls.lines for line in lines])
    for grid, most in ((walls.grid, FINE), (walls.smooth, SMOOTH)):
        kept = shapely.MultiLineString(list(grid.corners.reshape(-1, 2, 2)))
        assert shapely.hausdorff_distance(kept, given) <= 1.5 * most
        assert len(kept.geoms) < len(shapely.get_coordinates(given))


def test_bodies_far_and_near_against_all_lines() -> None:
    corridor = Corridor.from_offsets(LONG, left=5.0, right=-5.0)
    every = shapely.MultiLineString([line for side in corridor.lines(0) for line in side])
    random = np.random.default_rng(4)
    at = LONG.parts[0].reference(random.uniform(0.0, 400.0, 200))
    middle = np.column_stack([at.x, at.y]) + random.uniform(-12.0, 12.0, (200, 2))
    bodies = middle[:, None] + np.array([[-1.0, -1.0], [3.0, -1.0], [3.0, 1.0], [-1.0, 1.0]])
    for some in (bodies, bodies[:1], bodies[:0], bodies + 300.0):
        exact = shapely.distance(shapely.polygons(some), every)
        clearance = corridor.clearance(0, some)
        free = clearance > 0.0
        np.testing.assert_allclose(clearance[free], exact[free], atol=1e-12)
        for margin in (0.0, 0.7):
            touching = corridor.collides(0, some, margin)
            assert touching[exact <= margin].all()
            assert not touching[free & (exact > margin)].any()


def test_in_a_closed_outline_a_point_is_beyond_where_shapely_says_it_is_outside() -> None:
    random = np.random.default_rng(2)
    angle = np.sort(random.uniform(0.0, 2.0 * np.pi, 40))
    ring = random.uniform(3.0, 9.0, 40)[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    half = 17  # both lines together, whichever way they are cut
    lines = [ring[: half + 1], np.concatenate((ring[half:], ring[:1]))]
    points = random.uniform(-11.0, 11.0, (2000, 2))
    outline = shapely.Polygon(ring)
    outside = ~shapely.covers(outline, shapely.points(points))
    expected = np.where(outside, shapely.distance(shapely.points(points), outline), 0.0)
    np.testing.assert_allclose(Segments.of(lines).beyond(points), expected, atol=1e-12)


@pytest.mark.parametrize(
    ("point", "expected"), [((2.0, -1.5), 1.5), ((2.0, 1.5), 0.0), ((-1.0, -1.5), 0.0), ((5.0, -1.0), 0.0)]
)
def test_beside_an_open_line_only_what_is_beside_it_is_beyond(
    point: tuple[float, float], expected: float
) -> None:
    line = Segments.of([np.array([(0.0, 0.0), (4.0, 0.0)])])
    assert line.beyond(np.array([point]))[0] == pytest.approx(expected)


def test_walls_that_were_measured_against_can_still_be_pickled() -> None:
    corridor = Corridor.from_offsets(LONG, left=5.0, right=-5.0)
    body = np.array([[(0.0, -1.0), (3.0, -1.0), (3.0, 1.0), (0.0, 1.0)]])
    again = pickle.loads(pickle.dumps(corridor))
    before = corridor.clearance(0, body)
    np.testing.assert_array_equal(again.clearance(0, body), before)
    np.testing.assert_array_equal(pickle.loads(pickle.dumps(corridor)).clearance(0, body), before)
