"""Bodies against walls and obstacles, exactly: do they touch, and how far away or how deep are they."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray

from geometry.arrays import Array, Mask
from geometry.boundary import Boundary
from geometry.errors import InputError
from geometry.nearest import distances, is_allowed
from geometry.sampling import as_complex, as_pairs
from geometry.walls import Obstacles, PartWalls


def collides(walls: PartWalls, obstacles: Obstacles, bodies: ArrayLike, margin: float) -> Mask:
    """Return (n,) whether bodies (n, m, 2) [m] come within `margin` of something or are beyond a wall.

    Raises as `touches`.
    """
    hit = touches(walls, obstacles, bodies, margin)
    free = np.flatnonzero(~hit)
    hit[free] = _all_beyond(walls.sides, np.asarray(bodies, dtype=np.float64)[free])
    return hit


def touches(walls: PartWalls, obstacles: Obstacles, bodies: ArrayLike, margin: float) -> Mask:
    """Return (n,) whether bodies (n, m, 2) [m] come within `margin` [m] of something.

    Raises:
        InputError: wrong shape, numbers that are not finite, negative margin.
    """
    corners, shapes = _bodies(bodies)
    if not margin >= 0.0:
        raise InputError(f"margin = {margin}: must be >= 0 m.")
    return _touch(walls, obstacles, corners, shapes, margin)


def clearance(walls: PartWalls, obstacles: Obstacles, bodies: ArrayLike) -> Array:
    """Return the signed clearance (n,) of bodies (n, m, 2) [m]; +inf where there is nothing to hit.

    When something is crossed: minus the deepest penetration, the larger of the distance of body corners on
    the wrong side to the boundary and the depth in the body of boundary samples.

    Raises:
        InputError: wrong shape, numbers that are not finite.
    """
    corners, shapes = _bodies(bodies)
    distance = np.full(len(shapes), np.inf)
    if len(shapes) == 0:
        return distance
    apart = 0.0 if walls.every is not None else _apart(walls.sides, corners)
    for thing in (_lines(walls, corners, apart), *obstacles.shapes):
        # The distance to nothing is nan.
        distance = np.fmin(distance, shapely.distance(shapes, thing))
    sides = list(walls.sides)
    beyond = _beyond(sides, corners)
    outside = (beyond > 0.0).all(axis=1)
    if obstacles.boundary is not None:
        sides.append(obstacles.boundary)
        beyond = np.maximum(beyond, _beyond(sides[-1:], corners))
    crossed = np.flatnonzero((distance == 0.0) | outside)
    for i in crossed:
        distance[i] = -max(0.0, float(beyond[i].max()), _depth(sides, shapes[i]))
    return distance


def _bodies(bodies: ArrayLike) -> tuple[Array, NDArray[np.object_]]:
    corners = np.ascontiguousarray(bodies, dtype=np.float64)
    if corners.ndim != 3 or corners.shape[1] < 3 or corners.shape[2] != 2:
        raise InputError(f"bodies has shape {corners.shape}, it must be (n, m >= 3, 2).")
    if not np.isfinite(corners).all():
        raise InputError("bodies must be finite numbers.")
    return corners, np.asarray(shapely.polygons(corners), dtype=np.object_)


def _touch(
    walls: PartWalls, obstacles: Obstacles, corners: Array, shapes: NDArray[np.object_], margin: float
) -> Mask:
    """Whether bodies (n, m, 2) [m], whose shapes these are, come within `margin` of something (n,)."""
    if len(shapes) == 0:
        return np.zeros(0, dtype=np.bool_)
    hit = _near(_lines(walls, corners, margin), shapes, margin)
    for obstacle in obstacles.shapes:
        hit |= _near(obstacle, shapes, margin)
    return hit


def _lines(walls: PartWalls, corners: Array, apart: float) -> shapely.MultiLineString:
    """The walls, at least what of them is within `apart` [m] of bodies (n, m, 2) [m]."""
    if walls.every is not None:
        return walls.every
    points = as_complex(corners).reshape(-1)
    middle = complex(points.mean())
    return walls.near(middle, float(np.abs(points - middle).max()) + apart)


def _apart(sides: Sequence[Boundary], corners: Array) -> float:
    """No body (n, m, 2) is farther than this from the nearest boundary [m]; 0 without any."""
    apart = np.array([side.tree.query(corners[:, 0])[0] for side in sides])
    return float(apart.min(axis=0).max()) if sides else 0.0


def _near(thing: shapely.Geometry, shapes: NDArray[np.object_], margin: float) -> Mask:
    shapely.prepare(thing)
    near = shapely.dwithin(thing, shapes, margin) if margin > 0.0 else shapely.intersects(thing, shapes)
    return np.asarray(near, dtype=np.bool_)


def _all_beyond(sides: Sequence[Boundary], corners: Array) -> Mask:
    """Whether all corners (n, m, 2) of a body are beyond one or another boundary (n,)."""
    points = as_complex(corners)
    beyond = np.ones(len(points), dtype=np.bool_)
    # One corner answers for most bodies that touch nothing.
    for asked in (points[:, :1], points[:, 1:]):
        rows = np.flatnonzero(beyond)
        if rows.size:
            allowed = is_allowed(sides, asked[rows].reshape(-1))
            beyond[rows] = ~allowed.reshape(rows.size, -1).any(axis=1)
    return beyond


def _beyond(sides: Sequence[Boundary], corners: Array) -> Array:
    """How far corners (n, m, 2) are beyond a boundary, the nearest of those, (n, m) [m]; 0 within all."""
    points = as_complex(corners).reshape(-1)
    depth = np.full(points.size, np.inf)
    for side in sides:
        distance = distances(side, points)
        depth = np.minimum(depth, np.where(distance < 0.0, -distance, np.inf))
    return np.where(np.isfinite(depth), depth, 0.0).reshape(corners.shape[:2])


def _depth(sides: Sequence[Boundary], shape: shapely.Polygon) -> float:
    """How deep in a body the deepest boundary sample is [m], 0 if there is none in it."""
    middle = shapely.get_coordinates(shape.centroid)[0]
    radius = float(np.hypot(*(shapely.get_coordinates(shape) - middle).T).max())
    deepest = 0.0
    for side in sides:
        samples = as_pairs(
            side.vertex[np.asarray(side.tree.query_ball_point(middle, radius), dtype=np.int64)]
        )
        points = shapely.points(samples)
        inside = points[shapely.covers(shape, points)]
        if len(inside):
            deepest = max(deepest, float(shapely.distance(shape.exterior, inside).max()))
    return deepest
