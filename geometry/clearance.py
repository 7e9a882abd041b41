"""Bodies against walls and obstacles, by shapely alone: how far away or how deep are they.

What drives goes by geometry.shape_grid. This measures what was driven, and knows nothing of that.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray

from geometry.arrays import Array
from geometry.errors import InputError

SPACING = 0.05  # [m] at most, between the places of a boundary at which it is looked how deep it is in a body


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Segments:
    """Segments of lines that have their allowed side on the left.

    Attributes:
        ends: (n, 2, 2) where each begins and ends [m]; tree: of them, in this order; lines: all of them.
    """

    ends: Array
    tree: shapely.STRtree
    lines: shapely.MultiLineString

    @classmethod
    def of(cls, lines: Sequence[Array]) -> Segments:
        """Those of polylines (m_i, 2), m_i >= 1 [m]; a point alone is a segment without length."""
        longer = [line if len(line) > 1 else np.repeat(line, 2, axis=0) for line in lines]
        pairs = [np.stack((line[:-1], line[1:]), axis=1) for line in longer]
        ends = np.concatenate([np.zeros((0, 2, 2)), *pairs])
        return cls(
            ends=ends,
            tree=shapely.STRtree(shapely.linestrings(ends)),
            lines=shapely.MultiLineString(longer),
        )

    def beyond(self, points: Array) -> Array:
        """How far points (n, 2) are to the right of the nearest segment (n,) [m]; 0 to its left, and beyond
        an open end.

        At a vertex both its segments tell: the sum of the distances to their left.
        """
        nearest = self.tree.query_nearest(shapely.points(points), return_distance=True)
        (at, segment), distance = nearest
        begin, way = self.ends[segment, 0], self.ends[segment, 1] - self.ends[segment, 0]
        to, length = points[at] - begin, np.hypot(*way.T)
        unit = way / np.where(length > 0.0, length, 1.0)[:, None]
        left = unit[:, 0] * to[:, 1] - unit[:, 1] * to[:, 0]
        along = (unit * to).sum(axis=1)
        past_end = (along < 0.0) | (along > length)
        count, n = np.bincount(at, minlength=len(points)), len(points)
        at_open_end = (count == 1) & (np.bincount(at, past_end, n) == 1)
        depth = np.zeros(n)
        depth[at] = distance
        return np.where((np.bincount(at, left, n) < 0.0) & ~at_open_end, depth, 0.0)

    def depth(self, shape: shapely.Polygon) -> float:
        """How deep in a shape the deepest place of them is [m], to within SPACING; 0 if none is in it."""
        met = self.ends[self.tree.query(shape, predicate="intersects")]
        # Also their ends by themselves: of a segment without length shapely finds nothing within a shape.
        parts = np.concatenate((shapely.linestrings(met), shapely.points(met.reshape(-1, 2))))
        return _deepest(shape, shapely.intersection(parts, shape))


def clearance(walls: Segments, obstacles: NDArray[np.object_], bodies: ArrayLike) -> Array:
    """Return the signed clearance (n,) of bodies (n, m, 2) [m]; +inf where there is nothing to hit.

    When something is crossed: minus the deepest penetration, the larger of the distance of body corners on
    the wrong side to the boundary and the depth in the body of the boundary.

    Raises:
        InputError: wrong shape, numbers that are not finite.
    """
    corners, shapes = _bodies(bodies)
    distance = np.full(len(shapes), inf)
    for thing in (walls.lines, *obstacles):
        distance = np.fmin(distance, shapely.distance(shapes, thing))  # to nothing it is nan
    asked = np.flatnonzero((distance == 0.0) | (walls.beyond(corners[:, 0]) > 0.0))
    for i, beyond in zip(asked, _beyond(walls, corners[asked]), strict=True):
        if distance[i] == 0.0 or beyond.all():
            inside = [walls.depth(shapes[i]), *(_overlap(shapes[i], obstacle) for obstacle in obstacles)]
            distance[i] = -max(float(beyond.max()), *inside)
    return distance


def _bodies(bodies: ArrayLike) -> tuple[Array, NDArray[np.object_]]:
    corners = np.ascontiguousarray(bodies, dtype=np.float64)
    if corners.ndim != 3 or corners.shape[1] < 3 or corners.shape[2] != 2:
        raise InputError(f"bodies has shape {corners.shape}, it must be (n, m >= 3, 2).")
    if not np.isfinite(corners).all():
        raise InputError("bodies must be finite numbers.")
    return corners, np.asarray(shapely.polygons(corners), dtype=np.object_)


def _beyond(walls: Segments, corners: Array) -> Array:
    """How far corners (n, m, 2) are beyond the nearest boundary (n, m) [m]; 0 within all."""
    return walls.beyond(corners.reshape(-1, 2)).reshape(corners.shape[:2])


def _overlap(body: shapely.Polygon, obstacle: shapely.Geometry) -> float:
    """How deep a corner of the body is in an obstacle, or the obstacle's outline in the body [m]."""
    corners = shapely.points(shapely.get_coordinates(body))
    inside = corners[shapely.covers(obstacle, corners)]
    outline = getattr(obstacle, "exterior", obstacle)
    deepest = float(shapely.distance(inside, outline).max(initial=0.0))
    return max(deepest, _deepest(body, shapely.intersection(outline, body)))


def _deepest(shape: shapely.Polygon, within: ArrayLike) -> float:
    """How far from the outline of a shape what is within it gets [m], to within SPACING."""
    places = shapely.points(shapely.get_coordinates(shapely.segmentize(within, SPACING)))
    return float(shapely.distance(places, shape.exterior).max(initial=0.0))
