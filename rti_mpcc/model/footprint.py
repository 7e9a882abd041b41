"""The vehicle's body."""

from __future__ import annotations

from functools import lru_cache
from itertools import pairwise

import numpy as np

from geometry import Corridor
from geometry.arrays import locked
from geometry.corridor import space_around
from geometry.free_space import clearances_in
from geometry.outline import checked_polygon, convex_pieces, merge_convex
from geometry.shape_grid import Body
from rti_mpcc.config import Vehicle
from rti_mpcc.model.layout import PHI, POSE, X, Y
from rti_mpcc.types import Array

PIECES = 2
"""Boxes of equal length that the body is cut into, each with a half-plane for each side."""


@lru_cache(maxsize=64)
def body_of(vehicle: Vehicle, pieces: int = 1) -> Body:
    """The body in the vehicle's frame: the convex pieces of its outline, or a rectangle, see `box_of`."""
    if vehicle.outline is None:
        return box_of(vehicle, pieces)
    return Body.of(*merge_convex(convex_pieces(checked_polygon(vehicle.outline, "outline"))))


@lru_cache(maxsize=64)
def box_of(vehicle: Vehicle, pieces: int = 1) -> Body:
    """The rectangle that holds the body, cut across into `pieces` of equal length, the rear one first."""
    half, low, length = 0.5 * vehicle.width, -vehicle.rear, vehicle.front + vehicle.rear
    ends = low + length * np.arange(pieces + 1) / pieces
    spans = pairwise(ends.tolist())
    body = Body.of(*([(begin, -half), (end, -half), (end, half), (begin, half)] for begin, end in spans))
    return body._replace(
        middle=locked(np.array((low + 0.5 * length, 0.0))), half=locked(np.array((0.5 * length, half)))
    )


def clearances(
    states: Array, corridor: Corridor, part: int, vehicle: Vehicle, within: float = np.inf
) -> Array:
    """Signed distances (n, 1 + obstacles) [m] of the bodies at `states` (n, >= 3) to what stands, see
    `distances_in`; negative beyond a boundary as well."""
    poses = np.ascontiguousarray(states[:, :POSE])
    return clearances_in(space_around(corridor, part), body_of(vehicle), poses, within)


def body_polygons(states: Array, vehicle: Vehicle) -> Array:
    """Corners (n, m, 2) [m] of the body for states (n, >= 3) that begin with x, y, phi; counter-clockwise.

    Four, from the right rear one on, or those of its outline.
    """
    corners = box_of(vehicle).corners if vehicle.outline is None else np.array(vehicle.outline)
    along, across = corners.T
    c, s = np.cos(states[:, PHI, None]), np.sin(states[:, PHI, None])
    x = states[:, X, None] + c * along - s * across
    y = states[:, Y, None] + s * along + c * across
    return np.stack([x, y], axis=-1)
