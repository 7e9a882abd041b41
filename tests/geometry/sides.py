"""What a corridor says of bodies and points in it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from geometry import Corridor
from geometry.arrays import Array, Complex
from geometry.contacts import ACROSS, ALONG, APART, AT_X, AT_Y
from geometry.corridor import space_around
from geometry.free_space import contacts_in, distances_in
from geometry.shape_grid import POINT, Body


class Contacts(NamedTuple):
    """Contacts (n, pieces, sides, 5), and what they say: along the body + i across it."""

    values: Array

    @property
    def apart(self) -> Array:
        return self.values[..., APART]

    @property
    def normal(self) -> Complex:
        return np.asarray(self.values[..., ALONG] + 1j * self.values[..., ACROSS])

    @property
    def at(self) -> Complex:
        return np.asarray(self.values[..., AT_X] + 1j * self.values[..., AT_Y])


def contacts_of(
    corridor: Corridor, part: int, body: Body, poses: Array, within: float, outward: float = 0.0
) -> Contacts:
    space = space_around(corridor, part)
    return Contacts(contacts_in(space, body, np.ascontiguousarray(poses), within, outward))


def distances(corridor: Corridor, part: int, body: Body, poses: Array) -> Array:
    return distances_in(space_around(corridor, part), body, poses, np.inf)


class Sides(NamedTuple):
    """Of n points and s sides: signed distances (n, s), normals into the allowed side and nearest points
    (n, s, 2)."""

    distance: Array
    normal: Array
    point: Array


def sides_of(corridor: Corridor, part: int, points: Array, within: float = 100.0) -> Sides:
    """The sides of points (n, 2), but for those that are farther than `within`."""
    poses = np.column_stack([points, np.zeros(len(points))])
    found = contacts_of(corridor, part, POINT, poses, within)
    distance, values = found.apart[:, 0], found.values[:, 0]
    normal = values[..., 1:3]
    with np.errstate(invalid="ignore"):
        point = np.asarray(points)[:, None, :] - distance[..., None] * normal
    return Sides(distance, normal, point)
