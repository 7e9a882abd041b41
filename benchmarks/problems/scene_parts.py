"""What scenes are put together from: boxes, parked cars, polygons of any shape, and where they may stand."""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, pi, sin
from typing import Any

import numpy as np
import shapely

from benchmarks.problems.witness import Drive, Ground
from geometry import Pose2
from geometry.outline import outline_at
from rti_mpcc.config import Vehicle
from rti_mpcc.types import Array

SPARE = 0.02
"""What a drive is made with on top of the clearance that is proven in the end [m]."""
_FULL = 4.7  # [m] length of a vehicle around which things have their full size


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Layout:
    """A scene in a frame of its own.

    Attributes:
        drive: from the start to the goal.
        obstacles: corners (m, 2) [m]; boundary: outline (m, 2) [m] of what may be driven on, or None.
    """

    drive: Drive
    obstacles: list[Array]
    boundary: Array | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Draw:
    """What a scene is drawn for.

    Attributes:
        random: where all numbers come from.
        vehicle: its body; curvature: the largest of its drives [1/m].
        clearance: distance that its body keeps to all that stands [m].
    """

    random: np.random.Generator
    vehicle: Vehicle
    curvature: float
    clearance: float

    @property
    def length(self) -> float:
        """Of the body [m]."""
        return self.vehicle.front + self.vehicle.rear

    @property
    def width(self) -> float:
        """Of the body [m]."""
        return self.vehicle.width

    @property
    def scale(self) -> float:
        """Size of things around this vehicle, 1 around a car."""
        return self.length / _FULL

    def __call__(self, low: float, high: float) -> float:
        """A number between two bounds."""
        return float(self.random.uniform(low, high))

    def chance(self, share: float) -> bool:
        """True in so many of all draws."""
        return self(0.0, 1.0) < share

    def sign(self) -> int:
        """1 or -1."""
        return 1 if self.chance(0.5) else -1

    def ground(self, obstacles: list[Array], boundary: Array | None = None) -> Ground:
        """The ground on which a drive is made among obstacles (m, 2) and within a boundary (m, 2) [m]."""
        return Ground.of(self.vehicle, self.curvature, self.clearance + SPARE, obstacles, boundary)

    def axle(self, x: float, y: float, heading: float) -> Pose2:
        """Pose of the rear axle where the middle of the body is at (x, y) [m], with a heading [rad]."""
        ahead = 0.5 * (self.vehicle.front - self.vehicle.rear)
        return Pose2(x - ahead * cos(heading), y - ahead * sin(heading), heading)

    def car(self, x: float, y: float, heading: float, *, size: tuple[float, float] | None = None) -> Array:
        """A parked vehicle (m, 2), its middle at (x, y) [m]; about as large as this one, or of a size [m]."""
        length, width = size or (self(0.85, 1.08) * self.length, self(0.92, 1.04) * self.width)
        corners = box(-0.5 * length, -0.5 * width, 0.5 * length, 0.5 * width)
        if self.chance(0.5):
            corners = _cut(corners, self(0.08, 0.25) * width)
        return outline_at(corners, Pose2(x, y, heading))

    def thing(self, x: float, y: float, size: float) -> Array:
        """A polygon (m, 2) around (x, y) [m], about `size` [m] across: a box, convex, a star or an angle."""
        kind = self.random.integers(4)
        if kind == 0:
            half, high = 0.5 * size, 0.5 * size * self(0.3, 1.0)
            corners = box(-half, -high, half, high)
        elif kind == 3:
            wide, thick = 0.5 * size, size * self(0.2, 0.45)
            corners = np.array([(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)], dtype=np.float64)
            corners = np.array([0.0, thick, 2.0 * wide])[corners.astype(np.int64)] - wide
        else:
            count = int(self.random.integers(3, 8))
            angles = 2.0 * pi * (np.arange(count) + self.random.uniform(-0.3, 0.3, count)) / count
            radius = 0.5 * size * (self.random.uniform(0.4, 1.0, count) if kind == 2 else np.ones(count))
            corners = radius[:, None] * np.column_stack([np.cos(angles), np.sin(angles)])
            corners = corners * np.array([1.0, self(0.4, 1.0)])
        return outline_at(corners, Pose2(x, y, self(-pi, pi)))

    def strewn(self, drive: Drive, region: Array, count: int, size: tuple[float, float]) -> list[Array]:
        """At most `count` things of a size [m] in a region (m, 2), all of them clear of a drive."""
        swept, area = drive.swept(self.vehicle), shapely.Polygon(region)
        shapely.prepare(swept)
        low, high = region.min(axis=0), region.max(axis=0)
        found = []
        for _ in range(2 * count):
            x, y = self.random.uniform(low, high).tolist()
            thing = self.thing(x, y, self(*size))
            apart = self.clearance + 2.0 * SPARE + self(0.0, 1.0) * self.scale
            shape = shapely.Polygon(thing)
            if area.contains(shape.centroid) and not shapely.dwithin(swept, shape, apart):
                found.append(thing)
        return found[:count]


def box(left: float, low: float, right: float, high: float) -> Array:
    """Corners (4, 2) of a rectangle along the axes [m]."""
    return np.array([(left, low), (right, low), (right, high), (left, high)])


def ring(shape: Any) -> Array:
    """Corners (m, 2) of the outline of a polygon (shapely)."""
    return np.asarray(shapely.get_coordinates(shape.exterior)[:-1])


def _cut(corners: Array, much: float) -> Array:
    """A convex polygon (m, 2) with its corners cut off, (2 m, 2)."""
    onward, before = np.roll(corners, -1, axis=0) - corners, np.roll(corners, 1, axis=0) - corners
    ends = [corners + much * way / np.linalg.norm(way, axis=1, keepdims=True) for way in (before, onward)]
    return np.stack(ends, axis=1).reshape(-1, 2)
