"""What a corridor holds: the walls of a part, and the obstacles."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import inf

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray

from geometry.arrays import Array, Complex
from geometry.boundary import Boundary
from geometry.lines import PartLines
from geometry.outline import checked_polygon, convex_pieces
from geometry.sampling import as_complex, as_pairs
from geometry.shape_grid import ShapeGrid

TABLED = 50_000  # samples of all walls up to which more is kept of each, for speed: 1.2 km of both sides
_NO_LINES = shapely.MultiLineString()
PIECE = 500  # points that are simplified together
FINE = 1e-4  # [m] that a curved wall may be beside itself where bodies are checked against it
SMOOTH = 1e-3  # [m] the same for its half-planes
BEHIND = 2.0  # [m] farther beyond an open wall a point is not through it but behind it, on another way


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PartWalls:
    """The boundaries of one part of a route.

    Attributes:
        left, right: None without any.
        narrowest: smallest width [m] and its theta [m].
        grid: the segments of both, as of one owner, within FINE of them; smooth: within SMOOTH, with fewer
            segments, of either side.
        is_open: whether one of them has ends, so that what is beyond them need not be outside.
        every: both as lines, if these are kept.
    """

    left: Boundary | None
    right: Boundary | None
    narrowest: tuple[float, float]
    grid: ShapeGrid
    smooth: ShapeGrid
    is_open: bool
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
        sides = (
            Boundary.from_polylines(left, leads=_leads(right[0]) if joined else None),
            Boundary.from_polylines(right, leads=_leads(left[0]) if joined else None),
        )
        # Without the points that a line runs straight past, or nearly.
        fine, smooth = (
            [_simple(side.polylines, most) if side else [] for side in sides] for most in (FINE, SMOOTH)
        )
        return cls(
            left=sides[0],
            right=sides[1],
            narrowest=narrowest,
            grid=ShapeGrid.of_lines([*fine[0], *fine[1]]),
            smooth=ShapeGrid.of_lines(*smooth),
            is_open=any(side is not None and side.is_open for side in sides),
        )

    @classmethod
    def none(cls) -> PartWalls:
        """Return no boundaries at all."""
        return cls(
            left=None,
            right=None,
            narrowest=(inf, 0.0),
            grid=ShapeGrid.of_lines([]),
            smooth=ShapeGrid.of_lines([], []),
            is_open=False,
            every=_NO_LINES,
        )

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
        return self.grid.beyond(points, BEHIND if self.is_open else inf)

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


def _simple(lines: Sequence[Array], most: float) -> list[Array]:
    """Polylines (m_i, 2) with as few points as leave them within `most` [m]."""
    return [_simplified(line, most) if len(line) > 2 else line for line in lines]


def _simplified(line: Array, most: float) -> Array:
    """Piece by piece: what it takes grows with the square of a piece's length."""
    pieces = [shapely.LineString(line[k : k + PIECE + 1]) for k in range(0, len(line) - 1, PIECE)]
    found = [
        shapely.get_coordinates(each) for each in shapely.simplify(pieces, most, preserve_topology=False)
    ]
    return np.concatenate([*(each[:-1] for each in found), found[-1][-1:]])


def _leads(other: Array) -> tuple[complex, complex]:
    """Last and first unit tangent of a polyline (k, 2), which lead to and from the one that closes it."""
    way = np.diff(as_complex(other))
    way = way[way != 0.0]
    return complex(way[-1] / abs(way[-1])), complex(way[0] / abs(way[0]))
