"""What a corridor holds: the walls of a part, the obstacles, and half-planes against them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray

from geometry.boundary import Boundary
from geometry.errors import InputError
from geometry.lines import PartLines
from geometry.outline import checked_polygon
from geometry.sampling import as_complex, as_pairs

Array = NDArray[np.float64]
Index = NDArray[np.int64]

BEHIND = 2.0  # [m] farther beyond an open wall a point is not through it but behind it, on another way


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class HalfPlanes:
    """Half-planes at n points c against s sides: normal . (p - point) >= 0 is allowed near c.

    A side without any boundary has distance +inf, normal and point 0, feature and sample -1.

    Attributes:
        point: (n, s, 2) nearest boundary points b [m].
        normal: (n, s, 2) unit normals into the allowed side, along c - b.
        distance: (n, s) normal . (c - b), negative where c is on the forbidden side [m], but at most BEHIND
            beyond a wall with open ends: what is farther is taken to be on another way behind it.
        feature, sample: (n, s) where on the boundary b is; memory for the next call.
    """

    point: Array
    normal: Array
    distance: Array
    feature: Index
    sample: Index


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PartWalls:
    """The boundaries of one part of a route.

    Attributes:
        left_lines, right_lines: polylines (k, 2), each with its allowed side on the left [m].
        left, right: the same, sampled; None without any.
        lines: all of them as one shapely geometry.
        narrowest: smallest width [m] and its theta [m].
    """

    left_lines: tuple[Array, ...]
    right_lines: tuple[Array, ...]
    left: Boundary | None
    right: Boundary | None
    lines: shapely.MultiLineString
    narrowest: tuple[float, float]

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
        for line in (*left, *right):
            line.setflags(write=False)
        # One point is a boundary too (an arc's collapsed inside), but a line needs two.
        lines = [line if len(line) > 1 else np.repeat(line, 2, axis=0) for line in (*left, *right)]
        return cls(
            left_lines=tuple(left),
            right_lines=tuple(right),
            left=Boundary.from_polylines(left, leads=_leads(right[0]) if joined else None),
            right=Boundary.from_polylines(right, leads=_leads(left[0]) if joined else None),
            lines=shapely.multilinestrings([shapely.linestrings(line) for line in lines]),
            narrowest=narrowest,
        )

    def to_lines(self) -> PartLines:
        """Return what `from_lines` builds the same from."""
        return PartLines(
            left=self.left_lines,
            right=self.right_lines,
            joined=self.left is not None and not self.left.is_open,
            narrowest=self.narrowest,
        )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Obstacles:
    """Polygons to be kept out of: corners (m, 2) each [m], their sampled outlines, their shapes."""

    corners: tuple[Array, ...]
    boundary: Boundary | None
    shapes: NDArray[np.object_]

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
        return cls(
            corners=corners,
            boundary=Boundary.from_polylines(rings, closed=True),
            shapes=np.array(shapes, dtype=np.object_),
        )

    def to_polygons(self) -> tuple[Array, ...]:
        """Return what `from_polygons` builds the same from; `corners` begin one corner later."""
        return tuple(shapely.get_coordinates(shape)[:-1] for shape in self.shapes)


def half_planes(
    sides: Sequence[Boundary | None],
    points: Array,
    previous: HalfPlanes | None,
    hysteresis: float,
    *,
    behind: float = BEHIND,
) -> HalfPlanes:
    """Return the half-planes of points (n, 2) against each side [m].

    Points farther than `behind` [m] beyond a wall with open ends are allowed where they are.

    Raises:
        InputError: wrong shape, numbers that are not finite, `previous` of other points.
    """
    points = np.ascontiguousarray(points, dtype=np.float64)
    if points.ndim != 2 or points.shape[1] != 2:
        raise InputError(f"points has shape {points.shape}, it must be (n, 2).")
    if not np.isfinite(points).all():
        raise InputError("points must be finite numbers.")
    n, s = len(points), len(sides)
    if previous is not None and len(previous.feature) != n:
        raise InputError(f"previous has {len(previous.feature)} points, it must have as many as points: {n}.")
    point, normal = np.zeros((n, s), dtype=np.complex128), np.zeros((n, s), dtype=np.complex128)
    distance = np.full((n, s), np.inf)
    feature, sample = np.full((n, s), -1, dtype=np.int64), np.full((n, s), -1, dtype=np.int64)
    c = as_complex(points)
    for i, side in enumerate(sides):
        if side is None:
            continue
        if previous is not None and i < previous.feature.shape[1]:
            best = side.nearest(c, points, previous.feature[:, i], previous.sample[:, i], hysteresis)
        else:
            best = side.nearest(c, points)
        if side.is_open:
            # A route that comes back beside itself sees the wall of an earlier way from behind.
            elsewhere = np.flatnonzero(best.distance < -behind)
            best.distance[elsewhere] *= -1.0
            best.normal[elsewhere] *= -1.0
        point[:, i], normal[:, i], distance[:, i] = best.point, best.normal, best.distance
        feature[:, i], sample[:, i] = best.feature, best.sample
    planes = HalfPlanes(
        point=as_pairs(point), normal=as_pairs(normal), distance=distance, feature=feature, sample=sample
    )
    for values in (planes.point, planes.normal, planes.distance, planes.feature, planes.sample):
        values.setflags(write=False)
    return planes


def _leads(other: Array) -> tuple[complex, complex]:
    """Last and first unit tangent of a polyline (k, 2), which lead to and from the one that closes it."""
    way = np.diff(as_complex(other))
    way = way[way != 0.0]
    return complex(way[-1] / abs(way[-1])), complex(way[0] / abs(way[0]))
