"""What a corridor holds: the walls of a part, and the obstacles."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from math import inf

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray

from geometry.arrays import Array
from geometry.clearance import Segments
from geometry.lines import PartLines
from geometry.outline import checked_shape, convex_pieces, corners_of
from geometry.sampling import as_complex, as_pairs, merged
from geometry.shape_grid import ShapeGrid

PIECE = 500  # points that are simplified together
FINE = 1e-4  # [m] that a curved wall may be beside itself where bodies are checked against it
SMOOTH = 1e-3  # [m] the same for its half-planes
BEHIND = 2.0  # [m] farther beyond an open wall a point is not through it but behind it, on another way


@dataclass(frozen=True, kw_only=True, eq=False)
class PartWalls:
    """The boundaries of one part of a route.

    Attributes:
        left, right: polylines (k, 2), each with its allowed side on the left [m].
        narrowest: smallest width [m] and its theta [m].
        joined: one of each, and either begins where the other ends.
        grid: the segments of both, as of one owner, within FINE of them; smooth: within SMOOTH, with fewer
            segments, of either side.
    """

    left: tuple[Array, ...]
    right: tuple[Array, ...]
    narrowest: tuple[float, float]
    joined: bool
    grid: ShapeGrid
    smooth: ShapeGrid

    @classmethod
    def from_lines(
        cls,
        left: Sequence[Array],
        right: Sequence[Array],
        narrowest: tuple[float, float],
        *,
        joined: bool = False,
    ) -> PartWalls:
        """Build from polylines (k, 2) with their allowed side on the left [m], at least one point each.

        Of their points those that repeat the one before are left out, and of far too many those that a line
        runs straight past.

        Args:
            left, right: the polylines; joined: one of each, and either begins where the other ends.
            narrowest: smallest width [m] and its theta [m].
        """
        sides = tuple(tuple(as_pairs(merged(as_complex(line))) for line in lines) for lines in (left, right))
        for line in (*sides[0], *sides[1]):
            line.setflags(write=False)
        fine, smooth = ([_simple(lines, most) for lines in sides] for most in (FINE, SMOOTH))
        return cls(
            left=sides[0],
            right=sides[1],
            narrowest=narrowest,
            joined=joined,
            grid=ShapeGrid.of_lines([*fine[0], *fine[1]]),
            smooth=ShapeGrid.of_lines(*smooth),
        )

    @classmethod
    def none(cls) -> PartWalls:
        """Return no boundaries at all."""
        return cls.from_lines((), (), (inf, 0.0))

    @property
    def lines(self) -> tuple[tuple[Array, ...], tuple[Array, ...]]:
        """The left and the right boundary."""
        return self.left, self.right

    @property
    def is_open(self) -> bool:
        """Whether one of them has ends, so that what is beyond them need not be outside."""
        return not self.joined and bool(self.left or self.right)

    @cached_property
    def segments(self) -> Segments:
        """Those of both, as the metrics measure with them."""
        return Segments.of((*self.left, *self.right))

    def beyond(self, points: Array) -> Array:
        """How far points (n, 2) are beyond the nearest boundary [m]; 0 within all, and farther than BEHIND
        beyond one with open ends."""
        return self.grid.beyond(points, BEHIND if self.is_open else inf)

    def to_lines(self) -> PartLines:
        """Return what `from_lines` builds the same from."""
        return PartLines(left=self.left, right=self.right, joined=self.joined, narrowest=self.narrowest)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Obstacles:
    """Polygons, lines and points to be kept out of: corners (m, 2) each [m], their shapes, and a grid of the
    convex pieces of each."""

    corners: tuple[Array, ...]
    shapes: NDArray[np.object_]
    grid: ShapeGrid

    @classmethod
    def from_polygons(cls, polygons: Sequence[ArrayLike]) -> Obstacles:
        """Check polygons and build.

        Raises:
            CorridorError: no corner, numbers that are not finite, or an outline that crosses itself.
        """
        shapes = [checked_shape(polygon, f"obstacles[{i}]") for i, polygon in enumerate(polygons)]
        corners = tuple(_later(corners_of(shape)) for shape in shapes)
        for ring in corners:
            ring.setflags(write=False)
        pieces = [convex_pieces(shape) for shape in shapes]
        return cls(
            corners=corners,
            shapes=np.array(shapes, dtype=np.object_),
            grid=ShapeGrid.of_shapes(
                [piece for each in pieces for piece in each],
                np.repeat(np.arange(len(shapes)), [len(each) for each in pieces]),
                len(shapes),
            ),
        )

    def to_polygons(self) -> tuple[Array, ...]:
        """Return what `from_polygons` builds the same from; `corners` begin one corner later."""
        return tuple(corners_of(shape) for shape in self.shapes)


def _later(corners: Array) -> Array:
    """Corners (m, 2) of an outline from the second one on; of a line or a point as they are."""
    return np.roll(corners, -1, axis=0) if len(corners) > 2 else corners


def _simple(lines: Sequence[Array], most: float) -> list[Array]:
    """Polylines (m_i, 2) with as few points as leave them within `most` [m]."""
    return [simplified(line, most) if len(line) > 2 else line for line in lines]


def simplified(line: Array, most: float) -> Array:
    """Return a polyline (m, 2) with few points, within `most` [m] of the given one.

    Piece by piece: the time that it takes grows with the square of a piece's length.
    """
    pieces = [shapely.LineString(line[k : k + PIECE + 1]) for k in range(0, len(line) - 1, PIECE)]
    found = [
        shapely.get_coordinates(each) for each in shapely.simplify(pieces, most, preserve_topology=False)
    ]
    return np.concatenate([*(each[:-1] for each in found), found[-1][-1:]])
