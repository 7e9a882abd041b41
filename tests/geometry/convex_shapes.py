"""Convex shapes drawn at random, and what another library says of them."""

from __future__ import annotations

from collections.abc import Callable
from math import inf

import numpy as np
import shapely

from geometry import convex
from geometry.arrays import Array
from geometry.convex import WITNESS
from geometry.shape_grid import Body
from tests.geometry.sides import Contacts
from tests.kernels import called

distance_between = called(convex.distance_between)
FRONT = np.array([[1.5, -1.0], [3.7, -1.0], [3.7, 1.0], [1.5, 1.0]])
REAR = np.array([[-0.8, -1.0], [1.5, -1.0], [1.5, 1.0], [-0.8, 1.0]])
CAR = np.array([[-0.8, -1.0], [3.7, -1.0], [3.7, 1.0], [-0.8, 1.0]])
BODY = Body.of(REAR, FRONT)


def counter_clockwise(points: Array) -> Array:
    """The corners (m, 2) of the convex hull of points (n >= 3, 2)."""
    hull = shapely.convex_hull(shapely.multipoints(points))
    ring: Array = shapely.get_coordinates(shapely.orient_polygons(hull))[:-1]
    return np.ascontiguousarray(ring)


def drawn(random: np.random.Generator, corners: int, size: float, away: float) -> Array:
    """A point, a segment, or the hull of `corners` points, about `size` large and `away` from (0, 0)."""
    points = size * random.normal(size=(corners, 2)) * random.uniform(0.2, 1.0, 2) + away * random.normal(
        size=2
    )
    return points if corners < 3 else counter_clockwise(points)


def as_geometry(shape: Array) -> shapely.Geometry:
    if len(shape) == 1:
        return shapely.Point(shape[0])
    return shapely.LineString(shape) if len(shape) == 2 else shapely.Polygon(shape)


def between(a: Array, b: Array) -> Array:
    """What is found of two shapes: distance, normal and witnesses (WITNESS,)."""
    found = np.empty(WITNESS)
    distance_between(a, b, inf, found)
    return found


def exact(a: Array, b: Array) -> float:
    """The signed distance by shapely; of those that overlap by the depth in their Minkowski difference."""
    apart = float(shapely.distance(as_geometry(a), as_geometry(b)))
    if apart > 0.0:
        return apart
    difference = shapely.convex_hull(shapely.multipoints((b[None] - a[:, None]).reshape(-1, 2)))
    return -float(shapely.distance(difference.exterior, shapely.Point(0.0, 0.0)))


def placed(shape: Array, pose: Array) -> Array:
    """A shape (m, 2) at a pose x, y, phi."""
    c, s = np.cos(pose[2]), np.sin(pose[2])
    return np.ascontiguousarray(shape @ np.array([[c, s], [-s, c]]) + pose[:2])


def check_slopes(contacts: Callable[[Array], Contacts], asked: Array) -> None:
    """Equation (S2) by differences, but where two pairs of features or two sides are about equally near."""
    found, step = contacts(asked), 1e-6
    normal = found.normal * np.exp(1j * asked[:, 2])[:, None, None]
    gradient = np.stack((normal.real, normal.imag, (found.at.conj() * found.normal).imag), axis=-1)
    slopes, bends = np.empty_like(gradient), np.zeros(found.apart.shape)
    with np.errstate(invalid="ignore"):
        for i in range(3):
            ahead, behind = (contacts(asked + h * np.eye(3)[i]).apart for h in (step, -step))
            slopes[..., i] = (ahead - behind) / (2.0 * step)
            bends = np.maximum(bends, np.abs(ahead + behind - 2.0 * found.apart) / step)
        smooth = np.isfinite(found.apart) & (bends < 1e-3)
    assert smooth.sum() > 400
    np.testing.assert_allclose(gradient[smooth], slopes[smooth], atol=2e-4)
