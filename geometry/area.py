"""Areas: where a vehicle may be, inside a boundary and outside of obstacles, drawn or read from a map."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import inf
from os import PathLike
from typing import Any, Self

import numpy as np
import shapely
from numpy.typing import ArrayLike

from geometry.arrays import Array, locked
from geometry.errors import AreaError
from geometry.outline import (
    FARTHEST,
    CheckedShape,
    checked_polygon,
    checked_shapes,
    convex_pieces,
    corners_of,
)
from geometry.pose import Pose2
from geometry.shape_grid import Body, ShapeGrid
from geometry.validation import to_rows, validated

_FRAME = 100.0  # [m] so far around the bounding box of its boundary an area is solid


@dataclass(frozen=True, slots=True, init=False, eq=False, repr=False)
class Area:
    """Where a vehicle may be: inside a boundary, if there is any, and outside of all obstacles.

    What is solid is kept as convex shapes: the obstacles, and what is outside the boundary, up to 100 m
    around its bounding box. With coordinates of 1e9 m nothing is lost but what they are rounded by. Pickles.

    Attributes:
        boundary: corners (m, 2) of the outline, counter-clockwise [m]; None: there is none.
        obstacles: corners (m, 2) of each, counter-clockwise [m]; two of a line, one of a point.
        grid: all that is solid, as convex shapes of one owner.
    """

    boundary: Array | None
    obstacles: tuple[Array, ...]
    grid: ShapeGrid

    @validated(AreaError)
    def __init__(self, *, boundary: ArrayLike | None = None, obstacles: Sequence[ArrayLike] = ()) -> None:
        """Check and build.

        Args:
            boundary: corners (m, 2) of the outline [m].
            obstacles: polygons (m, 2), lines (2, 2) and points (1, 2) to keep out of [m]; they may overlap,
                and cross the boundary. A polygon without area is a line.

        Raises:
            AreaError: a boundary of fewer than 3 corners, an obstacle of none, another shape, numbers that
                are not finite, or an outline that crosses itself.
        """
        outline = None if boundary is None else _outline(boundary, "boundary")
        shapes = checked_shapes(obstacles, "obstacles", AreaError)
        solid = ShapeGrid.of_shapes([*_outside(outline), *_pieces(shapes)])
        self._hold(outline, [shape.corners for shape in shapes], solid)

    @classmethod
    @validated(AreaError)
    def from_map(cls, file: str | PathLike[str], *, unknown_is_free: bool = False) -> Area:
        """Read an occupancy grid in the format of the ROS map_server, see geometry.map_file.

        Its boundary is the outline of the map, its obstacles are rectangles of occupied cells.

        Args:
            file: the YAML file.
            unknown_is_free: whether cells that are neither occupied nor free count as free.

        Raises:
            AreaError: a file is missing or cannot be read, or an entry is not usable.
        """
        from geometry.map_file import read_map  # what reads pictures is loaded with the first map

        return cls._of_map(*read_map(file, unknown_is_free=unknown_is_free))

    @classmethod
    @validated(AreaError)
    def from_grid(
        cls,
        array: Any,
        resolution: float,
        origin: Pose2 | Sequence[float] = (0.0, 0.0, 0.0),
        *,
        unknown_is_free: bool = False,
    ) -> Area:
        """Build from an occupancy grid (rows, columns), laid out as the data of a ROS OccupancyGrid.

        The first row is the lowest one, at the origin. So a picture, whose first row is its top, is given as
        `array[::-1]`. Boundary and obstacles are as of `from_map`.

        Args:
            array: bools, True is occupied; or numbers from 0, free, to 1, occupied, or to 100 where any is
                larger than 1. -1 and NaN are unknown, as is all between 25 and 65 %.
            resolution: length of a cell [m].
            origin: pose x, y [m] and, if given, yaw [rad] of the lower left corner of the first cell.
            unknown_is_free: whether unknown cells count as free.

        Raises:
            AreaError: another shape, a value, resolution or origin out of range, or no free cell.
        """
        from geometry.map_file import grid_map  # as above

        return cls._of_map(*grid_map(array, resolution, origin, unknown_is_free=unknown_is_free))

    @validated(AreaError)
    def bounded(self, points: ArrayLike, beyond: float) -> Area:
        """Return the same area with a boundary: a box so far beyond its obstacles and points (n, 2) [m].

        An area that has a boundary is returned itself.

        Raises:
            AreaError: there are neither obstacles nor points, points of another shape or not finite, or
                beyond <= 0.
        """
        if self.boundary is not None:
            return self
        if not 0.0 < beyond <= FARTHEST:
            raise AreaError(f"beyond = {beyond}: must be > 0 m and finite, at most {FARTHEST:g} m.")
        given = to_rows(points, 2, "points", AreaError) if np.size(points) else np.zeros((0, 2))
        around = np.concatenate([given, *self.obstacles])
        if len(around) == 0:
            raise AreaError("points is empty and there are no obstacles: there is nothing to be bounded.")
        (left, bottom), (right, top) = around.min(axis=0) - beyond, around.max(axis=0) + beyond
        corners = [(left, bottom), (right, bottom), (right, top), (left, top)]
        outline = _outline(corners, "points")
        return Area.__new__(Area)._hold(outline, self.obstacles, self.grid.with_shapes(_outside(outline)))

    @validated(AreaError)
    def with_obstacles(self, polygons: Sequence[ArrayLike]) -> Area:
        """Return the same area with more obstacles: polygons (m, 2), lines (2, 2), points (1, 2) [m].

        Raises:
            AreaError: as the constructor does.
        """
        return with_checked(self, checked_shapes(polygons, "polygons", AreaError))

    @validated(AreaError, late=True)
    def signed_distances(self, body: Body, poses: Array, within: float = inf) -> Array:
        """Return the signed distances (n,) [m] of a body at `poses` (n, 3) to all that is solid.

        Exact where they are apart. Negative where they overlap: the least way out of the convex shape that
        the body is deepest in. +inf without anything nearer than `within` [m].

        Raises:
            InputError: wrong shape, or poses that are not finite.
        """
        return self.grid.signed_distances(body, poses, within)[:, 0]

    @validated(AreaError)
    def solid_beside(self, other: Area, least: float) -> list[Array]:
        """Return the convex shapes (m_i, 2) that are solid here and not in the other area [m].

        Where both areas have as many shapes, one whose corners are within `least` [m] is the same.
        """
        known = {shape.tobytes() for shape in other._solid()}
        shapes = self._solid()
        found = np.array([shape.tobytes() not in known for shape in shapes], dtype=np.bool_)
        if found.any() and np.array_equal(self.grid.starts, other.grid.starts):
            apart = np.abs(self.grid.corners - other.grid.corners).max(axis=1)
            found &= np.maximum.reduceat(apart, self.grid.starts[:-1]) > least
        return [shapes[k] for k in np.flatnonzero(found)]

    @classmethod
    def _of_map(cls, outline: Array, rectangles: Array) -> Area:
        solid = ShapeGrid.of_shapes([*_outside(outline), rectangles])
        return cls.__new__(cls)._hold(outline, rectangles, solid)

    def _solid(self) -> list[Array]:
        return np.split(self.grid.corners, self.grid.starts[1:-1]) if len(self.grid.owner) else []

    def _hold(self, boundary: Array | None, obstacles: Iterable[Array], grid: ShapeGrid) -> Self:
        """Set all attributes, once."""
        for name, value in (("boundary", boundary), ("obstacles", tuple(obstacles)), ("grid", grid)):
            object.__setattr__(self, name, value)
        return self


def with_checked(area: Area, shapes: Sequence[CheckedShape]) -> Area:
    """Return the same area with more obstacles, which are checked already."""
    if not shapes:
        return area
    grid = area.grid.with_shapes(_pieces(shapes))
    return Area.__new__(Area)._hold(
        area.boundary, (*area.obstacles, *(each.corners for each in shapes)), grid
    )


def _outline(corners: ArrayLike, name: str) -> Array:
    return locked(corners_of(checked_polygon(corners, name, AreaError)))


def _pieces(shapes: Sequence[CheckedShape]) -> list[Array]:
    return [piece for shape in shapes for piece in shape.pieces]


def _outside(boundary: Array | None) -> list[Array]:
    """Convex pieces (m_i, 2) of what is outside a boundary: beside its bounding box, and between the two."""
    if boundary is None:
        return []
    origin = np.round(boundary[0])
    inside = shapely.Polygon(boundary - origin)
    left, bottom, right, top = inside.bounds
    low_x, low_y, high_x, high_y = left - _FRAME, bottom - _FRAME, right + _FRAME, top + _FRAME
    beside = [
        (low_x, low_y, left, high_y),
        (right, low_y, high_x, high_y),
        (low_x, low_y, high_x, bottom),
        (low_x, top, high_x, high_y),
    ]
    # What is left of the box has no holes: the boundary meets each side of it.
    between = shapely.get_parts(shapely.difference(shapely.box(left, bottom, right, top), inside))
    corners = [corners_of(shapely.box(*sides)) for sides in beside]
    for part in shapely.orient_polygons(between):
        corners += [] if part.is_empty else convex_pieces(part)
    return [piece + origin for piece in corners]
