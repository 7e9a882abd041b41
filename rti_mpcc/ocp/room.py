"""What walls that face each other leave beside the body, and how fast it is driven through there.

(P2)  room = (g + g')/2,   v <= speed + max(room - d_min, 0) / reaction_time

with the gaps g, g' between a body on the path and two walls that face each other, on either side of it, and
`speed` and `reaction_time` of `NarrowPassage`. Where it does not fit there by d_min it is driven beside the
path, or not at all: the room counts as the margin.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from geometry import Corridor, PathPart
from rti_mpcc.config import ControllerConfig
from rti_mpcc.model.footprint import cover, disc_centres
from rti_mpcc.types import Array, Complex


def between(gaps: Array, normals: Complex, facing: float) -> Array:
    """Half of what each side (n, s) and the nearest one that faces it leave to the body [m]; inf without one.

    Args:
        gaps: (n, d, s) of the pieces of the body to the sides [m]; normals: (n, d, s), complex.
        facing: see `NarrowPassage`.
    """
    nearest = gaps.argmin(axis=1)[:, None]
    gap = np.take_along_axis(gaps, nearest, axis=1)[:, 0]
    normal = np.take_along_axis(normals, nearest, axis=1)[:, 0]
    room = np.full(gap.shape, np.inf)
    for one, other in combinations(range(gap.shape[1]), 2):
        both = 0.5 * (gap[:, one] + gap[:, other])
        face = (normal[:, one] * normal[:, other].conj()).real < facing
        for side in (one, other):
            np.minimum(room[:, side], both, out=room[:, side], where=face)
    return room


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Room:
    """Room beside the body along a part.

    Attributes:
        theta: (n,) [m], increasing.
        walls: (n,) room between the boundaries alone [m].
        speed: (n,) highest by (P2), and from which comfort brakes down to it in time [m/s].
    """

    theta: Array
    walls: Array
    speed: Array

    @property
    def least(self) -> tuple[float, float]:
        """The least room between the boundaries, and its theta [m]."""
        i = int(np.argmin(self.walls))
        return float(self.walls[i]), float(self.theta[i])

    def speed_at(self, theta: Array) -> Array:
        """Highest speeds (m,) [m/s] at `theta` (m,) [m]."""
        return np.interp(theta, self.theta, self.speed)

    def bounds(self, theta: Array, elapsed: Array | float, speed: float, config: ControllerConfig) -> Array:
        """Highest speeds (m,) [m/s] that the QP allows at `theta` (m,) [m], so long after being at `speed`
        [m/s]: who is faster brakes in comfort."""
        return np.maximum(self.speed_at(theta), speed - config.comfort_acceleration * elapsed)


def room_along(part: PathPart, corridor: Corridor, index: int, config: ControllerConfig) -> Room:
    """The room on a part, which is the route's `index`-th, and the speeds that it allows."""
    count = max(int(np.ceil((part.end - part.start) / config.narrow_passage.spacing)), 1)
    theta = np.linspace(part.start, part.end, count + 1)
    walls = _room(part, corridor.with_obstacles(()), index, theta, config)
    found = Room(theta=theta, walls=walls, speed=walls)
    return with_obstacles(found, part, corridor, index, config)


def with_obstacles(
    room: Room, part: PathPart, corridor: Corridor, index: int, config: ControllerConfig
) -> Room:
    """The same beside the obstacles of another corridor with the same boundaries."""
    left: Array = room.walls
    if corridor.obstacles:
        at = part.reference(room.theta)
        near = corridor.near_obstacles(np.column_stack([at.x, at.y]), config.narrow_passage.obstacle_reach)
        beside = _room(part, corridor, index, room.theta[near], config)
        # Where the body does not fit the way leads past the other side of what stands on the path.
        fits = beside >= config.caution.hard_minimum
        left = left.copy()
        left[near[fits]] = np.minimum(left[near], beside)[fits]
    return replace(room, speed=_speeds(room.theta, left, config))


def _room(part: PathPart, corridor: Corridor, index: int, theta: Array, config: ControllerConfig) -> Array:
    """Room (n,) beside bodies that stand on the path at `theta` (n,) [m]."""
    discs, at = cover(config.vehicle, config.footprint), part.reference(theta)
    poses = np.column_stack([at.x, at.y, at.phi])
    planes = corridor.half_planes(index, disc_centres(poses, discs).reshape(-1, 2))
    shape = (len(theta), len(discs.offsets), planes.distance.shape[1])
    normals = planes.normal.view(np.complex128).reshape(shape)
    seen = normals * np.exp(-1j * at.phi)[:, None, None]
    along, across = np.abs(seen.real), np.abs(seen.imag)
    distance = planes.distance.reshape(shape)
    gaps = distance - discs.half_length * along - discs.half_width * across
    juts = corridor.reflex_vertices(index, planes, np.arange(gaps.size))
    if juts is not None:  # there the wall ends or turns away, and it is the point that counts
        to, u, v = (each.reshape(-1)[juts.at] for each in (distance, along, across))
        ahead, beside = (
            np.maximum(to * u - discs.half_length, 0.0),
            np.maximum(to * v - discs.half_width, 0.0),
        )
        gaps.reshape(-1)[juts.at] = np.maximum(gaps.reshape(-1)[juts.at], np.hypot(ahead, beside))
    room: Array = between(gaps, normals, config.narrow_passage.facing).min(axis=1)
    return room


def _speeds(theta: Array, room: Array, config: ControllerConfig) -> Array:
    """Equation (P2) at `theta` (n,) [m], and what comfort asks for before that."""
    least, passage = config.caution.hard_minimum, config.narrow_passage
    beyond = np.where(room >= least, room, config.footprint.margin) - least
    speed = passage.speed + beyond / passage.reaction_time
    squares = np.minimum(speed, config.limits.speed / config.arrival_timing.planned_share) ** 2
    gains = 2.0 * config.comfort_acceleration * theta
    # v² <= v_j² + 2 a (theta_j - theta) for all that lies ahead.
    ahead = np.minimum.accumulate((squares + gains)[::-1])[::-1]
    found: Array = np.sqrt(np.minimum(squares, ahead - gains))
    return found
