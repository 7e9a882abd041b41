"""How far points are from the boundaries of a corridor."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from geometry import Corridor
from geometry.arrays import Array
from geometry.shape_grid import Body

POINT = Body.of([(0.0, 0.0)])


class Sides(NamedTuple):
    """Of n points and s sides: signed distances (n, s), normals into the allowed side and nearest points
    (n, s, 2)."""

    distance: Array
    normal: Array
    point: Array


def sides_of(corridor: Corridor, part: int, points: Array, within: float = 100.0) -> Sides:
    """The sides of points (n, 2), but for those that are farther than `within`."""
    poses = np.column_stack([points, np.zeros(len(points))])
    found = corridor.contacts(part, POINT, poses, within=within, outward=0.0)
    distance, values = found.apart[:, 0], found.values[:, 0]
    normal = values[..., 1:3]
    with np.errstate(invalid="ignore"):
        point = np.asarray(points)[:, None, :] - distance[..., None] * normal
    return Sides(distance, normal, point)
