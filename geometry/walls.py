"""What a corridor holds: the walls of a part, the obstacles, and half-planes against them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import inf
from typing import NamedTuple

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray

from geometry.arrays import Array, Complex, Index, Mask
from geometry.boundary import Boundary
from geometry.errors import InputError
from geometry.lines import PartLines
from geometry.nearest import Last, Nearest, keep, nearest
from geometry.outline import checked_polygon, convex_pieces
from geometry.sampling import as_complex, as_pairs
from geometry.shape_grid import ShapeGrid

TABLED = 50_000  # samples of all walls up to which more is kept of each, for speed: 1.2 km of both sides
_NO_LINES = shapely.MultiLineString()
BEHIND = 2.0  # [m] farther beyond an open wall a point is not through it but behind it, on another way


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DistanceCache:
    """Where n points were when their distance to each of s sides was looked up last.

    A distance changes by no more than its point moves, so it tells how far away a boundary is at least.

    Attributes:
        place: (n, s, 2) [m].
        distance: (n, s) to the side; 0 on its forbidden side, +inf without any [m].
        marks: (s,) of the boundaries, None without any.
    """

    place: Array
    distance: Array
    marks: tuple[int | None, ...]

    def lower_bound(self, points: Complex) -> Array:
        """Distances (m, s) [m] that the first m <= n of the points have at least now that they are at
        x + iy (m,) [m]; if positive, they have crossed nothing on a straight way there."""
        moved: Array = np.abs(as_complex(self.place[: points.size]) - points[:, None])
        return self.distance[: points.size] - moved


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class HalfPlanes:
    """Half-planes at n points c against s sides: normal . (p - point) >= 0 is allowed near c.

    A side without any boundary has distance +inf, normal and point 0, feature and sample -1. One that is
    known to be farther away than what was asked for has only a lower bound as its distance, the rest alike.

    Attributes:
        point: (n, s, 2) nearest boundary points b [m].
        normal: (n, s, 2) unit normals into the allowed side, along c - b.
        distance: (n, s) normal . (c - b), negative where c is on the forbidden side [m], but at most BEHIND
            beyond a wall with open ends: what is farther is taken to be on another way behind it.
        feature, sample: (n, s) where on the boundary b is; memory for the next call.
        seen: memory for the next call as well; None: there is none.
    """

    point: Array
    normal: Array
    distance: Array
    feature: Index
    sample: Index
    seen: DistanceCache | None = None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PartWalls:
    """The boundaries of one part of a route.

    Attributes:
        left, right: None without any.
        narrowest: smallest width [m] and its theta [m].
        grid: the segments of both.
        every: both as lines, if these are kept.
    """

    left: Boundary | None
    right: Boundary | None
    narrowest: tuple[float, float]
    grid: ShapeGrid
    every: shapely.MultiLineString | None = None

    @classmethod
    def from_lines(
        cls,
        left: Sequence[Array],
        right: Sequence[Array],
        narrowest: tuple[float, float],
        *,
        joined: bool = False,
    ) -> PartWalls:
        """Build from polylines (k, 2) with their allowed side on the left [m].

        Args:
            left, right: the polylines; joined: one of each, and either begins where the other ends.
            narrowest: smallest width [m] and its theta [m].
        """
        # Boundaries go on with the same numbers.
        for line in (*left, *right):
            line.setflags(write=False)
        return cls(
            left=Boundary.from_polylines(left, leads=_leads(right[0]) if joined else None),
            right=Boundary.from_polylines(right, leads=_leads(left[0]) if joined else None),
            narrowest=narrowest,
            grid=ShapeGrid.of_lines([*left, *right]),
        )

    @classmethod
    def none(cls) -> PartWalls:
        """Return no boundaries at all."""
        return cls(left=None, right=None, narrowest=(inf, 0.0), grid=ShapeGrid.of_lines([]), every=_NO_LINES)

    def with_tables(self) -> PartWalls:
        """Return the same walls with more kept of them, so that looking at them is faster."""
        left, right = (None if side is None else side.with_table() for side in (self.left, self.right))
        # Of their own points: bodies are checked against a straight side at once, not sample by sample.
        every = _as_lines([as_complex(line) for lines in self.lines for line in lines])
        return replace(self, left=left, right=right, every=every)

    @property
    def sides(self) -> tuple[Boundary, ...]:
        """The boundaries that there are."""
        return tuple(side for side in (self.left, self.right) if side is not None)

    @property
    def lines(self) -> tuple[tuple[Array, ...], tuple[Array, ...]]:
        """Polylines (k, 2) of the left and the right boundary, with their allowed side on the left [m]."""
        left, right = (() if side is None else side.polylines for side in (self.left, self.right))
        return left, right

    def beyond(self, points: Array) -> Array:
        """How far points (n, 2) are beyond the nearest boundary [m]; 0 within all, and farther than BEHIND
        beyond one with open ends."""
        return self.grid.beyond(points, BEHIND if any(side.is_open for side in self.sides) else inf)

    def near(self, middle: complex, radius: float) -> shapely.MultiLineString:
        """The boundaries, at least what of them is within `radius` of a place [m]."""
        if self.every is not None:
            return self.every
        return _as_lines([piece for side in self.sides for piece in side.pieces_near(middle, radius)])

    def to_lines(self) -> PartLines:
        """Return what `from_lines` builds the same from."""
        left, right = self.lines
        return PartLines(
            left=left,
            right=right,
            joined=self.left is not None and not self.left.is_open,
            narrowest=self.narrowest,
        )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Obstacles:
    """Polygons to be kept out of: corners (m, 2) each [m], their sampled outlines, their shapes, and a grid
    of the convex pieces of each."""

    corners: tuple[Array, ...]
    boundary: Boundary | None
    shapes: NDArray[np.object_]
    grid: ShapeGrid

    @classmethod
    def from_polygons(cls, polygons: Sequence[ArrayLike]) -> Obstacles:
        """Check polygons and build.

        Raises:
            CorridorError: fewer than 3 corners, numbers that are not finite, or an outline that crosses
                itself.
        """
        shapes = [checked_polygon(polygon, f"obstacles[{i}]") for i, polygon in enumerate(polygons)]
        # Clockwise, so that the outside is on the left.
        rings = [shapely.get_coordinates(shape)[::-1][:-1] for shape in shapes]
        corners = tuple(np.ascontiguousarray(ring[::-1]) for ring in rings)
        for ring in corners:
            ring.setflags(write=False)
        boundary = Boundary.from_polylines(rings, closed=True)
        pieces = [convex_pieces(shape) for shape in shapes]
        if boundary is not None and boundary.vertex.size <= TABLED:
            boundary = boundary.with_table()
        return cls(
            corners=corners,
            boundary=boundary,
            shapes=np.array(shapes, dtype=np.object_),
            grid=ShapeGrid.of_shapes(
                [piece for each in pieces for piece in each],
                np.repeat(np.arange(len(shapes)), [len(each) for each in pieces]),
                len(shapes),
            ),
        )

    def to_polygons(self) -> tuple[Array, ...]:
        """Return what `from_polygons` builds the same from; `corners` begin one corner later."""
        return tuple(shapely.get_coordinates(shape)[:-1] for shape in self.shapes)


def _as_lines(pieces: Sequence[Complex]) -> shapely.MultiLineString:
    """Pieces (m_i,) x + iy as lines. A point alone is one too (an arc's collapsed inside): a line of two."""
    if not pieces:
        return _NO_LINES
    pieces = [piece if piece.size > 1 else np.repeat(piece, 2) for piece in pieces]
    line = np.repeat(np.arange(len(pieces)), [piece.size for piece in pieces])
    return shapely.multilinestrings(shapely.linestrings(as_pairs(np.concatenate(pieces)), indices=line))


def with_tables(walls: Sequence[PartWalls]) -> tuple[PartWalls, ...]:
    """Return the walls of all parts with more kept of them unless they are too long for that."""
    samples = sum(side.vertex.size for each in walls for side in each.sides)
    return tuple(walls) if samples > TABLED else tuple(each.with_tables() for each in walls)


def half_planes(
    sides: Sequence[Boundary | None],
    points: Array,
    previous: HalfPlanes | None,
    hysteresis: float,
    within: float = inf,
) -> HalfPlanes:
    """Return the half-planes of points (n, 2) against each side [m].

    Points farther than BEHIND beyond a wall with open ends are allowed where they are. A point that was on
    the allowed side of a boundary is looked up again only where that can be as near as `within` [m] by now,
    beside an open wall BEHIND at least. So it is on the allowed side still: to get to the other one it had
    to come nearer, or to go round an open end, behind which what is farther than BEHIND is allowed as well.
    (The halves of a polygon go by the lines that each ends with: what has left the polygon through one half
    may be on either side of the other. There the side that it was seen on stays.)

    Raises:
        InputError: wrong shape, numbers that are not finite, `previous` of other points, `within` negative.
    """
    c = _checked(points, previous, within)
    marks = marks_of(sides)
    far, planes = _from_memory(c, sides, marks, previous, within)
    asked = [_Asked(i, side, np.flatnonzero(~far[:, i])) for i, side in enumerate(sides) if side is not None]
    asked = [each for each in asked if each.rows.size]
    if asked:
        best = nearest([(each.side, c[each.rows]) for each in asked])
        if previous is not None:
            _keep(best, c, asked, previous, hysteresis)
        _fill(planes, best, c, asked)
    assert planes.seen is not None
    for values in (planes.point, planes.normal, planes.distance, planes.feature, planes.sample):
        values.setflags(write=False)
    for values in (planes.seen.place, planes.seen.distance):
        values.setflags(write=False)
    return planes


def marks_of(sides: Sequence[Boundary | None]) -> tuple[int | None, ...]:
    """What tells these boundaries from others."""
    return tuple(None if side is None else side.mark for side in sides)


class _Asked(NamedTuple):
    """A side, which column it has, and the points whose distance to it is looked up."""

    column: int
    side: Boundary
    rows: Index


def _checked(points: Array, previous: HalfPlanes | None, within: float) -> Complex:
    """Points (n, 2) as x + iy (n,), or why they are refused."""
    points = np.ascontiguousarray(points, dtype=np.float64)
    if points.ndim != 2 or points.shape[1] != 2:
        raise InputError(f"points has shape {points.shape}, it must be (n, 2).")
    if not np.isfinite(points).all():
        raise InputError("points must be finite numbers.")
    if previous is not None and len(previous.feature) != len(points):
        raise InputError(
            f"previous has {len(previous.feature)} points, it must have as many as points: {len(points)}."
        )
    if not within >= 0.0:
        raise InputError(f"within = {within}: must be >= 0 m.")
    return as_complex(points)


def _from_memory(
    c: Complex,
    sides: Sequence[Boundary | None],
    marks: tuple[int | None, ...],
    previous: HalfPlanes | None,
    within: float,
) -> tuple[Mask, HalfPlanes]:
    """Which sides are known to be farther than `within` (n, s), and half-planes that are right there."""
    shape = (c.size, len(sides))
    seen = None if previous is None or within == inf else previous.seen
    if seen is None or seen.marks != marks:
        far = np.zeros(shape, dtype=np.bool_)
        bound = np.full(shape, inf)
        seen = DistanceCache(place=np.zeros((*shape, 2)), distance=bound.copy(), marks=marks)
    else:
        bound = seen.lower_bound(c)
        far = bound > [max(within, BEHIND) if side is not None and side.is_open else within for side in sides]
        if not far.all():  # else nothing of it will be written to
            seen = DistanceCache(place=seen.place.copy(), distance=seen.distance.copy(), marks=marks)
    none = np.full((2, *shape), -1, dtype=np.int64)
    zero = np.zeros((2, *shape, 2))
    return far, HalfPlanes(
        point=zero[0], normal=zero[1], distance=bound, feature=none[0], sample=none[1], seen=seen
    )


def _keep(
    best: Nearest, c: Complex, asked: Sequence[_Asked], previous: HalfPlanes, hysteresis: float
) -> None:
    """Put points back onto the features they were on, of the sides that there were."""
    columns, none = previous.feature.shape[1], np.full(c.size, -1, dtype=np.int64)
    last = [
        Last(side, c[rows], previous.feature[rows, i], previous.sample[rows, i])
        if i < columns
        else Last(side, c[rows], none[rows], none[rows])
        for i, side, rows in asked
    ]
    keep(best, last, hysteresis)


def _fill(planes: HalfPlanes, best: Nearest, c: Complex, asked: Sequence[_Asked]) -> None:
    """Write what was found into half-planes, what is far beyond an open wall turned round."""
    known = np.maximum(best.distance, 0.0)
    # A route that comes back beside itself sees the wall of an earlier way from behind.
    elsewhere = best.distance < -BEHIND
    if elsewhere.any():
        elsewhere &= np.concatenate([np.full(each.rows.size, each.side.is_open) for each in asked])
        best.distance[elsewhere] *= -1.0
        best.normal[elsewhere] *= -1.0
    count, seen = planes.distance.shape[1], planes.seen
    assert seen is not None
    places = np.concatenate([each.rows * count + each.column for each in asked])
    as_complex(planes.point).reshape(-1)[places] = best.point
    as_complex(planes.normal).reshape(-1)[places] = best.normal
    planes.distance.reshape(-1)[places] = best.distance
    planes.feature.reshape(-1)[places] = best.feature
    planes.sample.reshape(-1)[places] = best.sample
    as_complex(seen.place).reshape(-1)[places] = np.concatenate([c[each.rows] for each in asked])
    seen.distance.reshape(-1)[places] = known


def _leads(other: Array) -> tuple[complex, complex]:
    """Last and first unit tangent of a polyline (k, 2), which lead to and from the one that closes it."""
    way = np.diff(as_complex(other))
    way = way[way != 0.0]
    return complex(way[-1] / abs(way[-1])), complex(way[0] / abs(way[0]))
