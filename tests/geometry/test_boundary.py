"""What a boundary keeps of its samples, and what it derives from them."""

from __future__ import annotations

import numpy as np
import pytest
import shapely

import geometry.walls
from geometry import Corridor, Pose2, ReferencePath
from geometry.boundary import Boundary
from geometry.nearest import Samples
from geometry.sampling import as_complex, as_pairs

LONG = ReferencePath.from_segments(
    Pose2(0.0, 0.0, 0.0), [(1, 0.1 if i % 2 else -0.1, 10.0) for i in range(40)]
)
SHAPES = [
    [(0.0, 0.0), (4.0, 0.0), (4.0, 2.0), (1.0, 2.5)],
    [(9.0, 1.0)],
    [(8.0, 5.0), (6.0, 5.0), (6.0, 4.0)],
]


@pytest.fixture
def without_tables(monkeypatch: pytest.MonkeyPatch) -> None:
    """All corridors are too long for more to be kept of them."""
    monkeypatch.setattr(geometry.walls, "TABLED", 0)


def built(closed: bool = False) -> Boundary:
    boundary = Boundary.from_polylines([np.array(shape) for shape in SHAPES], closed=closed)
    assert boundary is not None
    return boundary


@pytest.mark.usefixtures("without_tables")
def test_a_sample_of_a_long_corridor_takes_few_bytes() -> None:
    """16 for its place; once it is asked, 8 for its entry in the tree, and a share of the rest."""
    walls = Corridor.from_offsets(LONG, left=5.0, right=-5.0).walls[0]
    assert walls.every is None
    for side in walls.sides:
        assert not {"tree", "coarse"} & vars(side).keys()  # what drives needs neither
        kept = (side.vertex, side.is_end, side.added)
        assert side.table is None
        assert sum(values.nbytes for values in kept) < 18 * side.vertex.size
        whole = (*kept, *side.coarse, side.tree.indices)
        assert sum(values.nbytes for values in whole) < 28 * side.vertex.size
        assert np.shares_memory(side.vertex, side.tree.data)
        assert all(np.shares_memory(line, side.vertex) for line in side.polylines)


def test_polylines_are_given_back() -> None:
    for shape, line in zip(SHAPES, built().polylines, strict=True):
        np.testing.assert_array_equal(line, shape)
        assert not line.flags.writeable


def test_more_is_kept_of_short_corridors_only() -> None:
    for segments in (40, 130):
        path = ReferencePath.from_segments(
            Pose2(0.0, 0.0, 0.0), [(1, 0.1 if i % 2 else -0.1, 10.0) for i in range(segments)]
        )
        walls = Corridor.from_offsets(path, left=5.0, right=-5.0).walls[0]
        short = segments == 40
        assert (walls.every is not None) == short
        assert all((side.table is not None) == short for side in walls.sides)


@pytest.mark.parametrize("tabled", [False, True])
@pytest.mark.parametrize("closed", [False, True])
def test_what_is_beside_a_sample(closed: bool, tabled: bool) -> None:
    """Against one polyline after the other, sample by sample."""
    boundary = built(closed).with_table() if tabled else built(closed)
    found = Samples.of(boundary, np.arange(boundary.vertex.size))
    for a, b in zip(boundary.begins[:-1], boundary.begins[1:], strict=True):
        for at in range(a, b):
            ways = np.zeros(2, dtype=np.complex128)
            if at > a:
                ways[0] = boundary.vertex[at] - boundary.vertex[at - 1]
            if at < b - 1:
                ways[1] = boundary.vertex[at + 1] - boundary.vertex[at]
            if closed and b - a > 1:
                # The first sample is there again as the last one.
                ways[0] = ways[0] or boundary.vertex[b - 1] - boundary.vertex[b - 2]
                ways[1] = ways[1] or boundary.vertex[a + 1] - boundary.vertex[a]
            np.testing.assert_allclose(found.lengths[:, at], np.abs(ways), atol=1e-12)
            np.testing.assert_allclose(found.lengths[:, at] * found.tangents[:, at], ways, atol=1e-12)
            assert found.is_end[at] == (b - a == 1 or (not closed and at in (a, b - 1)))


def test_all_within_a_radius_is_in_the_pieces_near() -> None:
    walls = Corridor.from_offsets(LONG, left=5.0, right=-5.0).walls[0]
    random = np.random.default_rng(3)
    for side in (*walls.sides, built(), built(closed=True)):
        low, high = as_pairs(side.vertex).min(axis=0), as_pairs(side.vertex).max(axis=0)
        for place in random.uniform(low - 5.0, high + 5.0, (60, 2)):
            middle, radius = complex(*place), float(random.uniform(0.0, 12.0))
            pieces = side.pieces_near(middle, radius)
            got = {complex(point) for piece in pieces for point in piece}
            assert {complex(v) for v in side.vertex[np.abs(side.vertex - middle) <= radius]} <= got
            assert all(np.abs(np.diff(piece)).max(initial=0.0) < 0.06 for piece in pieces)


@pytest.mark.parametrize("tabled", [50_000, 0])
def test_bodies_far_and_near_against_all_lines(tabled: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(geometry.walls, "TABLED", tabled)
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


def test_dense_polylines_are_not_copied() -> None:
    line = np.column_stack([np.linspace(0.0, 10.0, 401), np.zeros(401)])
    boundary = Boundary.from_polylines([line])
    assert boundary is not None
    assert np.shares_memory(boundary.vertex, as_complex(line))


def test_a_line_of_far_too_many_points_is_looked_up_as_one_of_few() -> None:
    """A point a tenth of a millimetre, as a scan gives them, is not kept: only where the line bends."""
    corners = np.array([(0.0, 0.0), (3.0, 0.0), (4.0, 2.0), (4.0, 3.0)])
    at = np.linspace(0.0, 3.0, 30_001)
    crowded = np.column_stack([np.interp(at, range(4), corners[:, i]) for i in (0, 1)])
    few, many = (Boundary.from_polylines([line]) for line in (corners, crowded))
    assert few is not None
    assert many is not None
    assert many.vertex.size == few.vertex.size
    np.testing.assert_allclose(many.vertex, few.vertex, atol=1e-12)
    for turn in np.linspace(0.0, 6.0, 13):  # it still bends where a circle of small radius does
        circle = 0.3 * np.exp(1j * (turn + np.linspace(0.0, 4.0, 5000)))
        thinned = Boundary.from_polylines([as_pairs(circle)])
        assert thinned is not None
        assert thinned.vertex.size < 300
        line = shapely.LineString(as_pairs(thinned.vertex))
        assert shapely.hausdorff_distance(line, shapely.LineString(as_pairs(circle))) < 2e-5


def test_bodies_are_checked_against_the_points_that_a_boundary_was_given_by() -> None:
    """Not against all its samples, which makes exact checks many times slower."""
    path = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(1, 0.0, 20.0)])
    box = Corridor.from_polygon(path, [(-5.0, -4.0), (30.0, -4.0), (30.0, 4.0), (-5.0, 4.0)])
    every = box.walls[0].every
    assert every is not None
    assert len(shapely.get_coordinates(every)) < 12
    assert every.length == pytest.approx(86.0)
