"""The vehicle's body, and the discs along its axis that cover it for the corridor rows.

A disc covers a piece of the body, a rectangle of half length a and half width b, and reaches far beyond its
ends: it may touch a wall that the body is still clear of. So towards a wall that lies ahead of the piece, or
behind it, not the disc's radius counts but how far the piece itself reaches. With n the wall's normal, u and
v the axis of the body and what is at right angles to it,

(H6)  h = min(r, a |n·u| + b sqrt((n·v)² + e²))  where |n·u| >= a/r,   h = r elsewhere,   r = hypot(a, b).

At |n·u| = a/r the corner of the piece points at the wall, and there disc and piece reach equally far. Beside
the body the disc's radius stays, which is r - b more than it needs. e makes (H6) smooth where a wall is
exactly ahead, at the price of b e.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from geometry.shape_grid import Body
from rti_mpcc.config import Footprint, Vehicle
from rti_mpcc.model.layout import PHI, X, Y
from rti_mpcc.types import Array


class Reach(NamedTuple):
    """How far pieces of the body reach towards walls [m], and how that changes as the body turns [m/rad]."""

    value: Array
    slope: Array


@dataclass(frozen=True, slots=True, kw_only=True)
class Discs:
    """Equal discs whose union covers the body.

    Attributes:
        offsets: (n,) centres along the body axis, ahead of the rear axle [m].
        half_length, half_width: a, b of the piece of the body that each of them covers [m].
        rounding: e of (H6), a sine.
    """

    offsets: Array
    half_length: float
    half_width: float
    rounding: float

    @property
    def radius(self) -> float:
        """r [m]."""
        return hypot(self.half_length, self.half_width)

    def ahead(self, along: Array) -> NDArray[np.bool_]:
        """Where (H6) counts the piece, |n·u| >= a/r, for components `along` n·u of the walls' normals."""
        return np.asarray(np.abs(along) >= self.half_length / self.radius)

    def reach(self, along: Array, across: Array) -> Reach:
        """Equation (H6) for walls whose normals have the components `along` n·u and `across` n·v."""
        wide = np.hypot(across, self.rounding)
        value = self.half_length * np.abs(along) + self.half_width * wide
        radius = self.radius
        ahead = self.ahead(along) & (value < radius)
        # d(n·u)/dphi = n·v, d(n·v)/dphi = -n·u
        slope = self.half_length * np.sign(along) * across - self.half_width * across * along / wide
        return Reach(np.where(ahead, value, radius), np.where(ahead, slope, 0.0))


def cover(vehicle: Vehicle, footprint: Footprint) -> Discs:
    """The smallest equal discs on the body axis, as many as wanted, that cover the body rectangle."""
    length, count = vehicle.front + vehicle.rear, footprint.discs
    offsets = -vehicle.rear + (np.arange(count) + 0.5) * length / count
    return Discs(
        offsets=offsets,
        half_length=0.5 * length / count,
        half_width=0.5 * vehicle.width,
        rounding=footprint.rounding,
    )


def disc_centres(states: Array, discs: Discs) -> Array:
    """Centres (n, discs, 2) [m] of the discs for states (n, >= 3) that begin with x, y, phi."""
    axis = np.stack([np.cos(states[:, PHI]), np.sin(states[:, PHI])], axis=-1)
    centres: Array = states[:, None, [X, Y]] + discs.offsets[None, :, None] * axis[:, None, :]
    return centres


def body_of(vehicle: Vehicle) -> Body:
    """The body, in the vehicle's frame."""
    half = 0.5 * vehicle.width
    low, high = -vehicle.rear, vehicle.front
    return Body.of([(low, -half), (high, -half), (high, half), (low, half)])


def body_polygons(states: Array, vehicle: Vehicle) -> Array:
    """Corners (n, 4, 2) [m] of the body for states (n, >= 3) that begin with x, y, phi; counter-clockwise."""
    half = 0.5 * vehicle.width
    along = np.array([-vehicle.rear, vehicle.front, vehicle.front, -vehicle.rear])
    across = np.array([-half, -half, half, half])
    c, s = np.cos(states[:, PHI, None]), np.sin(states[:, PHI, None])
    x = states[:, X, None] + c * along - s * across
    y = states[:, Y, None] + s * along + c * across
    return np.stack([x, y], axis=-1)
