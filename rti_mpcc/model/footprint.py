"""The vehicle's body."""

from __future__ import annotations

import numpy as np

from geometry.shape_grid import Body
from rti_mpcc.config import Vehicle
from rti_mpcc.model.layout import PHI, X, Y
from rti_mpcc.types import Array

AXLE = Body.of([(0.0, 0.0)])
"""The middle of the rear axle alone."""


def body_of(vehicle: Vehicle, pieces: int = 1) -> Body:
    """The body in the vehicle's frame, cut across into `pieces` boxes of equal length, the rear one first."""
    half, low, length = 0.5 * vehicle.width, -vehicle.rear, vehicle.front + vehicle.rear
    corners = []
    for k in range(pieces):
        begin, end = low + length * k / pieces, low + length * (k + 1) / pieces
        corners += [(begin, -half), (end, -half), (end, half), (begin, half)]
    return Body(
        corners=np.array(corners),
        starts=np.arange(0, 4 * pieces + 1, 4),
        middle=np.array((low + 0.5 * length, 0.0)),
        half=np.array((0.5 * length, half)),
    )


def body_polygons(states: Array, vehicle: Vehicle) -> Array:
    """Corners (n, 4, 2) [m] of the body for states (n, >= 3) that begin with x, y, phi; counter-clockwise."""
    half = 0.5 * vehicle.width
    along = np.array([-vehicle.rear, vehicle.front, vehicle.front, -vehicle.rear])
    across = np.array([-half, -half, half, half])
    c, s = np.cos(states[:, PHI, None]), np.sin(states[:, PHI, None])
    x = states[:, X, None] + c * along - s * across
    y = states[:, Y, None] + s * along + c * across
    return np.stack([x, y], axis=-1)
