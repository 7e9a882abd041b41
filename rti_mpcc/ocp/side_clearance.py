"""Clearance of the body between opposing walls, and the speed allowed there.

(P2)  room = (rho + rho')/2,   v <= speed + max(room - d_min, 0) / reaction_time

with the gaps rho, rho' between a body on the path and two opposing walls, `speed` = `NARROW_SPEED` and
`reaction_time` = `REACTION_TIME`. An obstacle that leaves a body on the path no gap at all is passed on its
other side, and does not count.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import inf

import numpy as np

from geometry import Corridor, PathPart
from geometry.compiled import Array4, Out1, inner, kernel
from geometry.contacts import ACROSS, ALONG, APART
from geometry.corridor import space_around
from geometry.free_space import contacts_in
from geometry.shape_grid import POINT
from rti_mpcc.config import ControllerConfig
from rti_mpcc.config.controller import PLANNED_SHARE
from rti_mpcc.model.footprint import PIECES, body_of
from rti_mpcc.types import Array

OUTWARD = 0.02
"""Of the points of a piece of the body that are about equally near to a side the one farther out along the
body counts, by so much of how much farther out it is: a turn that brings nearer which of them is nearer, in
rad (docs/decisions, 8)."""
FACING = -0.5
"""Walls face each other if the cosine between their normals is below this."""
NARROW_SPEED = 0.3
"""With which the least room is driven through [m/s], (P2) (docs/decisions, 11)."""
REACTION_TIME = 0.1
"""So much faster a vehicle drives for each metre of room more, 1 / reaction time [s]: who drives with a
heading that is off by 0.1 rad for a second comes nearer to a wall by 0.1 s times the speed."""
SPACING = 0.5
"""Between the places on a part at which the room is looked up [m]; the pieces of the body are longer."""
OBSTACLE_REACH = 8.0
"""Obstacles farther than this from the path leave it its room [m]."""


@inner
def between(contacts: Array, n: int, side: int) -> float:
    """Half of what one side and the nearest one that faces it leave to the n-th body [m]; inf without one.

    `contacts`: (n, pieces, sides, 5), see geometry.contacts.
    """
    side_clearance = inf
    here = _nearest(contacts, n, side)
    for other in range(contacts.shape[2]):
        there = _nearest(contacts, n, other)
        cosine = contacts[n, here, side, ALONG] * contacts[n, there, other, ALONG]
        cosine += contacts[n, here, side, ACROSS] * contacts[n, there, other, ACROSS]
        if other != side and cosine < FACING:
            side_clearance = min(
                side_clearance, 0.5 * (contacts[n, here, side, APART] + contacts[n, there, other, APART])
            )
    return side_clearance


@inner
def _nearest(contacts: Array, n: int, side: int) -> int:
    """The piece that is nearest to a side."""
    nearest = 0
    for piece in range(1, contacts.shape[1]):
        if contacts[n, piece, side, APART] < contacts[n, nearest, side, APART]:
            nearest = piece
    return nearest


@kernel
def _least_clearance(contacts: Array4) -> Out1:
    side_clearance = np.empty(len(contacts))
    for n in range(len(contacts)):
        side_clearance[n] = inf
        for side in range(contacts.shape[2]):
            side_clearance[n] = min(side_clearance[n], between(contacts, n, side))
    return side_clearance


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SideClearance:
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


def side_clearance_along(
    part: PathPart, corridor: Corridor, index: int, config: ControllerConfig
) -> SideClearance:
    """The room on a part, which is the route's `index`-th, and the speeds that it allows."""
    theta = part.places(SPACING)
    walls = _side_clearance(part, corridor.with_obstacles(()), index, theta, config)
    found = SideClearance(theta=theta, walls=walls, speed=walls)
    return with_obstacles(found, part, corridor, index, config)


def with_obstacles(
    side_clearance: SideClearance, part: PathPart, corridor: Corridor, index: int, config: ControllerConfig
) -> SideClearance:
    """The same beside the obstacles of another corridor with the same boundaries."""
    left: Array = side_clearance.walls
    if corridor.obstacles:
        at = part.reference(side_clearance.theta)
        poses = np.column_stack([at.x, at.y, at.phi])
        apart = corridor.spaces[0].obstacles.signed_distances(POINT, poses, OBSTACLE_REACH)
        near = np.flatnonzero((apart < OBSTACLE_REACH).any(axis=1))
        beside = _side_clearance(part, corridor, index, side_clearance.theta[near], config)
        # Where the body does not fit the way leads past the other side of what stands on the path.
        fits = beside >= 0.0
        left = left.copy()
        left[near[fits]] = np.minimum(left[near], beside)[fits]
    return replace(side_clearance, speed=_speeds(side_clearance.theta, left, config))


def _side_clearance(
    part: PathPart, corridor: Corridor, index: int, theta: Array, config: ControllerConfig
) -> Array:
    """Room (n,) beside bodies that stand on the path at `theta` (n,) [m]."""
    at = part.reference(theta)
    poses = np.column_stack([at.x, at.y, at.phi])
    # On either side what could slow the vehicle down.
    most = config.clearance.least + REACTION_TIME * config.limits.speed
    within = 2.0 * max(most, config.clearance.wanted)
    body = body_of(config.vehicle, PIECES)
    return _least_clearance(contacts_in(space_around(corridor, index), body, poses, within, OUTWARD))


def _speeds(theta: Array, side_clearance: Array, config: ControllerConfig) -> Array:
    """Equation (P2) at `theta` (n,) [m], and what comfort asks for before that."""
    speed = NARROW_SPEED + np.maximum(side_clearance - config.clearance.least, 0.0) / REACTION_TIME
    squares = np.minimum(speed, config.limits.speed / PLANNED_SHARE) ** 2
    gains = 2.0 * config.comfort_acceleration * theta
    # v² <= v_j² + 2 a (theta_j - theta) for all that lies ahead.
    ahead = np.minimum.accumulate((squares + gains)[::-1])[::-1]
    found: Array = np.sqrt(np.minimum(squares, ahead - gains))
    return found
