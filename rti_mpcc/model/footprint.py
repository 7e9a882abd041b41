"""The vehicle's body, and the discs along its axis that cover it for the corridor rows."""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot

import numpy as np

from rti_mpcc.config import Vehicle
from rti_mpcc.model.layout import PHI, X, Y
from rti_mpcc.types import Array


@dataclass(frozen=True, slots=True, kw_only=True)
class Discs:
    """Equal discs whose union covers the body.

    Attributes:
        offsets: (n,) centres along the body axis, ahead of the rear axle [m].
        radius: [m].
    """

    offsets: Array
    radius: float


def cover(vehicle: Vehicle, count: int) -> Discs:
    """The smallest `count` equal discs on the body axis that cover the body rectangle."""
    length = vehicle.front + vehicle.rear
    offsets = -vehicle.rear + (np.arange(count) + 0.5) * length / count
    return Discs(offsets=offsets, radius=disc_radius(vehicle, count))


def disc_radius(vehicle: Vehicle, count: int) -> float:
    """Radius [m] of the discs of `cover`."""
    return 0.5 * hypot((vehicle.front + vehicle.rear) / count, vehicle.width)


def disc_centres(states: Array, discs: Discs) -> Array:
    """Centres (n, discs, 2) [m] of the discs for states (n, >= 3) that begin with x, y, phi."""
    axis = np.stack([np.cos(states[:, PHI]), np.sin(states[:, PHI])], axis=-1)
    centres: Array = states[:, None, [X, Y]] + discs.offsets[None, :, None] * axis[:, None, :]
    return centres


def body_polygons(states: Array, vehicle: Vehicle) -> Array:
    """Corners (n, 4, 2) [m] of the body for states (n, >= 3) that begin with x, y, phi; counter-clockwise."""
    half = 0.5 * vehicle.width
    along = np.array([-vehicle.rear, vehicle.front, vehicle.front, -vehicle.rear])
    across = np.array([-half, -half, half, half])
    c, s = np.cos(states[:, PHI, None]), np.sin(states[:, PHI, None])
    x = states[:, X, None] + c * along - s * across
    y = states[:, Y, None] + s * along + c * across
    return np.stack([x, y], axis=-1)
