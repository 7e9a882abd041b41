"""Corridors: what keeps a vehicle beside a route, and what it has to keep out of."""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass, field, replace
from functools import cache
from math import inf, isfinite

import numpy as np
import shapely
from numpy.typing import ArrayLike

from geometry.area import Area
from geometry.arrays import Array
from geometry.contacts import FLANKS
from geometry.errors import CorridorError, InputError
from geometry.free_space import FreeSpace
from geometry.offsets import Narrowing, sections_of, trimmed
from geometry.outline import (
    CheckedShape,
    checked_polygon,
    checked_shapes,
    narrowest_in,
    path_line,
    split_outline,
)
from geometry.part import PathPart
from geometry.path import ReferencePath
from geometry.shape_grid import Body, ShapeGrid
from geometry.validation import Validated, to_rows, validate, validated
from geometry.walls import BEHIND, PartLines

_CHECKED = 0.05  # [m] between the path points that are checked against boundaries
_WIDEST = 1e6  # [m] that an offset may be


@cache
def _no_lines() -> PartLines:
    """Of an area; made when it is needed, as it takes compiled kernels."""
    return PartLines(left=(), right=(), joined=False, narrowest=(inf, 0.0))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Corridor(Validated, error=CorridorError):
    """Boundaries for each part of a route, left and right of the vehicle's heading, and obstacles.

    The boundaries of a part act on that part only. Built by `from_offsets` or `from_polygon`; pickles. Of one
    `in_area` no part has boundaries: there is an area instead, the same for all of them.

    Attributes:
        walls: the boundaries of each part of the route.
        obstacles: corners (m, 2) of each, counter-clockwise [m]; two of a line, one of a point.
        area: all that is solid besides, or None.
        spaces: all of this around each part of the route, each obstacle an owner; in an area around any.
    """

    walls: tuple[PartLines, ...]
    obstacles: tuple[Array, ...] = ()
    area: Area | None = None
    spaces: tuple[FreeSpace, ...] = field(init=False)

    def __post_init__(self) -> None:
        validate(self)
        self._keep_out_of(checked_shapes(self.obstacles, "obstacles"))

    def _keep_out_of(self, shapes: Sequence[CheckedShape]) -> None:
        counts = np.array([len(shape.pieces) for shape in shapes], dtype=np.int64)
        pieces, owner = [piece for shape in shapes for piece in shape.pieces], np.arange(len(shapes))
        grid = ShapeGrid.of_shapes(pieces, np.repeat(owner, counts), len(shapes))
        object.__setattr__(self, "obstacles", tuple(shape.corners for shape in shapes))
        object.__setattr__(self, "spaces", tuple(self._around(walls, grid) for walls in self.walls))

    def _around(self, walls: PartLines, obstacles: ShapeGrid) -> FreeSpace:
        behind = BEHIND if walls.is_open else inf
        if self.area is not None:
            return FreeSpace(self.area.grid, walls.smooth, obstacles, behind, FLANKS)
        return FreeSpace(walls.grid, walls.smooth, obstacles, behind, 3 if obstacles.owners else 2)

    @classmethod
    @validated(CorridorError)
    def from_offsets(
        cls,
        path: ReferencePath,
        *,
        left: float,
        right: float,
        narrowings: Sequence[Narrowing] = (),
        obstacles: Sequence[ArrayLike] = (),
    ) -> Corridor:
        """Build boundaries at lateral offsets from the path, positive to the left of the vehicle's heading.

        Where the offsets change there are transverse edges. Boundaries are trimmed where they fold
        (geometry.offsets). There is none before the start of a part and none behind its end.

        Args:
            path: the route.
            left: offset, > 0 [m].
            right: offset, < 0 [m].
            narrowings: where they differ.
            obstacles: polygons (m, 2), lines (2, 2) and points (1, 2) to keep out of [m].

        Raises:
            CorridorError: an offset that is not finite or leaves the path out of the corridor; a narrowing
                outside the route or with start >= end; a boundary that crosses the path; a bad obstacle.
        """
        _check_offsets("", left, right)
        for i, row in enumerate(narrowings):
            _check_narrowing(f"narrowings[{i}]", row, path.length, left, right)
        walls = [_walls(i, part, left, right, narrowings) for i, part in enumerate(path.parts)]
        return cls(walls=tuple(walls), obstacles=tuple(map(np.asarray, obstacles)))

    @classmethod
    @validated(CorridorError)
    def from_polygon(
        cls, path: ReferencePath, polygon: ArrayLike, *, obstacles: Sequence[ArrayLike] = ()
    ) -> Corridor:
        """Build the boundaries from the outline (m, 2) of the drivable area [m].

        Every part of the route gets all of it, split into left and right where the tangents at the ends of
        the part meet it.

        Raises:
            CorridorError: the polygon crosses itself or does not contain the path; a bad obstacle.
        """
        shape = checked_polygon(polygon, "polygon")
        walls = []
        for i, part in enumerate(path.parts):
            if not shape.covers(path_line(part, _CHECKED)):
                raise CorridorError(f"polygon does not contain the path: part {i} leaves it.")
            left, right = split_outline(part, shape)
            narrowest = narrowest_in(part, shape)
            walls.append(PartLines(left=(left,), right=(right,), joined=True, narrowest=narrowest))
        return cls(walls=tuple(walls), obstacles=tuple(map(np.asarray, obstacles)))

    @classmethod
    @validated(CorridorError)
    def in_area(cls, area: Area) -> Corridor:
        """Return the corridor of any route in an area: all of it, and no boundaries along the route."""
        return cls(walls=(_no_lines(),), area=area)

    @validated(CorridorError)
    def with_obstacles(self, obstacles: Sequence[ArrayLike]) -> Corridor:
        """Return the same boundaries with other obstacles: polygons (m, 2), lines (2, 2), points (1, 2) [m].

        Raises:
            CorridorError: a bad obstacle.
        """
        return replace(self, obstacles=tuple(map(np.asarray, obstacles)))

    @validated(late=True)
    def cut_off(self, part: int, one: tuple[float, float], other: tuple[float, float]) -> bool:
        """Return whether a boundary with open ends lies across the straight way between two points [m].

        What is far beyond such a boundary counts as behind it, on another way, and not as outside. Beyond one
        without ends everything is outside.
        """
        walls = self.walls[self._index(part)]
        one, other = to_rows((one, other), 2, "one, other").tolist()
        if not walls.is_open:
            return False
        way = Body.of([(0.0, 0.0), (other[0] - one[0], other[1] - one[1])])
        return bool(walls.grid.signed_distances(way, np.array([[*one, 0.0]]), _CHECKED)[0, 0] <= 0.0)

    def narrowest(self) -> tuple[float, float]:
        """Return the smallest distance of left and right along the path's normals [m] and its theta [m].

        Obstacles don't count.
        """
        return min(walls.narrowest for walls in self.walls)

    @validated(late=True)
    def lines(self, part: int) -> tuple[tuple[Array, ...], tuple[Array, ...]]:
        """Return the left and the right boundaries of a part, polylines (k, 2) [m]."""
        walls = self.walls[self._index(part)]
        return walls.left, walls.right

    def _index(self, part: int) -> int:
        if self.area is not None:
            return 0
        if not 0 <= part < len(self.walls):
            raise InputError(f"part = {part}: must be 0 to {len(self.walls) - 1}.")
        return part


def _walls(
    index: int, part: PathPart, left: float, right: float, narrowings: Sequence[Narrowing]
) -> PartLines:
    sections = sections_of(part, left, right, narrowings)
    # They come with growing theta; the allowed side has to be on their left.
    left_lines, right_lines = (
        tuple(line[:: -part.direction * side] for line in trimmed(part, sections, values))
        for side, values in ((1, sections.left), (-1, sections.right))
    )
    width = sections.left - sections.right
    i = int(np.argmin(width))
    narrowest = float(width[i]), float(sections.breaks[i])
    walls = PartLines(left=left_lines, right=right_lines, joined=False, narrowest=narrowest)
    lines = shapely.MultiLineString([line for line in walls.both if len(line) > 1])
    if shapely.intersects(lines, path_line(part, _CHECKED)):
        raise CorridorError(f"part {index}: a boundary crosses the path, offsets must leave the path inside.")
    return walls


def space_around(corridor: Corridor, part: int) -> FreeSpace:
    """Return what is around a part of the route. Raises InputError for one that does not exist."""
    return corridor.spaces[corridor._index(part)]


def with_shapes(corridor: Corridor, shapes: Sequence[CheckedShape]) -> Corridor:
    """Return the same boundaries with other obstacles, which are checked already."""
    other = copy(corridor)
    other._keep_out_of(shapes)
    return other


def _check_offsets(where: str, left: float, right: float) -> None:
    for name, value, sign, allowed in (("left", left, 1.0, "> 0 m"), ("right", right, -1.0, "< 0 m")):
        if not abs(value) <= _WIDEST:
            raise CorridorError(f"{where}{name} = {value}: must be a number of at most {_WIDEST:g} m.")
        if sign * value <= 0.0:
            raise CorridorError(
                f"{where}{name} = {value}: must be {allowed}, else the boundary crosses the path."
            )


def _check_narrowing(where: str, row: Narrowing, length: float, left: float, right: float) -> None:
    for name, value in (("start", row.start), ("end", row.end)):
        # Lengths of paths are sums: a narrowing may end where the path does but for rounding.
        if not (isfinite(value) and -1e-6 <= value <= length + 1e-6):
            raise CorridorError(f"{where}.{name} = {value}: must be between 0 and the length {length:g} m.")
    if row.start >= row.end:
        raise CorridorError(f"{where}.start = {row.start}: must be less than end = {row.end}.")
    _check_offsets(
        f"{where}.", left if row.left is None else row.left, right if row.right is None else row.right
    )
