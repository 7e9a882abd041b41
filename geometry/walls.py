"""What a corridor holds: the walls of its parts, and the obstacles.

`PartLines` and the polygons of obstacles are all that defines them, as plain arrays: to be stored, and to
build exactly the same corridor from. The arguments of `Corridor.from_offsets` are not enough for that: how a
folded boundary is trimmed may change from version to version, and the last bits from machine to machine.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import inf

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray

from geometry.arrays import Array
from geometry.doors import Admitted
from geometry.errors import CorridorError
from geometry.outline import checked_shape, convex_pieces, corners_of
from geometry.sampling import as_complex, as_pairs, thin_out
from geometry.shape_grid import ShapeGrid, read_only

PIECE = 500  # points that are simplified together
FINE = 1e-4  # [m] that a curved wall may be beside itself where bodies are checked against it
SMOOTH = 1e-3  # [m] the same for its half-planes
BEHIND = 2.0  # [m] farther beyond an open wall a point is not through it but behind it, on another way


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PartLines(Admitted, error=CorridorError):
    """The boundaries of one part of a route.

    Attributes:
        left, right: polylines (k, 2), each with its allowed side on the left [m].
        joined: one of each, and either begins where the other ends.
        narrowest: smallest width [m] and its theta [m].
    """

    left: tuple[Array, ...]
    right: tuple[Array, ...]
    joined: bool
    narrowest: tuple[float, float]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PartWalls:
    """The boundaries of one part of a route, ready to be measured against.

    Attributes:
        lines: the boundaries.
        grid: the segments of both, as of one owner, within FINE of them; smooth: within SMOOTH, with fewer
            segments, of either side.
    """

    lines: PartLines
    grid: ShapeGrid
    smooth: ShapeGrid

    @classmethod
    def of(cls, given: PartLines) -> PartWalls:
        """Build from lines of at least one point each.

        Of their points those that repeat the one before are left out, and of far too many those that a line
        runs straight past.
        """
        left, right = (
            tuple(read_only(as_pairs(thin_out(as_complex(line)))) for line in side)
            for side in (given.left, given.right)
        )
        smooth = ([simplified(line, SMOOTH) for line in side] for side in (left, right))
        return cls(
            lines=replace(given, left=left, right=right),
            grid=ShapeGrid.of_lines([simplified(line, FINE) for line in (*left, *right)]),
            smooth=ShapeGrid.of_lines(*smooth),
        )

    @property
    def both(self) -> tuple[Array, ...]:
        """The polylines of both sides."""
        return self.lines.left + self.lines.right

    @property
    def is_open(self) -> bool:
        """Whether one of them has ends, so that what is beyond them need not be outside."""
        return not self.lines.joined and bool(self.both)

    def beyond(self, points: Array) -> Array:
        """How far points (n, 2) are beyond the nearest boundary [m]; 0 within all, and farther than BEHIND
        beyond one with open ends."""
        return self.grid.beyond(points, BEHIND if self.is_open else inf)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Obstacles:
    """Polygons, lines and points: corners (m, 2) [m] and shape of each, and a grid of their convex pieces."""

    corners: tuple[Array, ...]
    shapes: NDArray[np.object_]
    grid: ShapeGrid

    @classmethod
    def from_polygons(cls, polygons: Sequence[ArrayLike]) -> Obstacles:
        """Check polygons and build. Raises CorridorError as `checked_shape`."""
        shapes = [checked_shape(polygon, f"obstacles[{i}]") for i, polygon in enumerate(polygons)]
        corners = [corners_of(shape) for shape in shapes]
        # From the second corner on; to_polygons gives them as they came.
        corners = [np.roll(ring, -1, axis=0) if len(ring) > 2 else ring for ring in corners]
        pieces = [convex_pieces(shape) for shape in shapes]
        owner = np.repeat(np.arange(len(shapes)), [len(each) for each in pieces])
        grid = ShapeGrid.of_shapes([piece for each in pieces for piece in each], owner, len(shapes))
        return cls(
            corners=tuple(map(read_only, corners)), shapes=np.array(shapes, dtype=np.object_), grid=grid
        )

    def to_polygons(self) -> tuple[Array, ...]:
        """Return what `from_polygons` builds the same from."""
        return tuple(corners_of(shape) for shape in self.shapes)


def simplified(line: Array, most: float) -> Array:
    """Return a polyline (m, 2) with few points, within `most` [m] of the given one.

    Piece by piece: the time that it takes grows with the square of a piece's length.
    """
    if len(line) <= 2:
        return line
    pieces = [shapely.LineString(line[k : k + PIECE + 1]) for k in range(0, len(line) - 1, PIECE)]
    found = map(shapely.get_coordinates, shapely.simplify(pieces, most, preserve_topology=False))
    return np.concatenate([*(each[:-1] for each in found), line[-1:]])
