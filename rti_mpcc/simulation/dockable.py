"""Proof that a scenario can be docked in: a motion that does it, found without the controller or its solver.

The motion runs along the route, one direction a part, and leaves the last part for the goal on a curve that
never turns back. Three things make it one that a vehicle can drive without stopping to steer:

    |kappa| <= CURVATURE_SHARE kappa_max,   |dkappa/ds| <= CURVATURE_SLOPE,   kappa continuous            (1)

over the whole way, cusps included: it begins with the steering straight and turns it nowhere at a standstill.
By delta = atan(L kappa) the steering rate at speed v is at most v L CURVATURE_SLOPE: with the default vehicle
and 0.5 m/s a good third of its limit. The body keeps CLEARANCE to all boundaries and obstacles.

Routes are arcs, on which kappa jumps. The motion follows them as a chain of integrators in its way s does,
with d the direction, w the lateral error to the left of the travel, e the heading error,
c = dphi/ds = d kappa, and c_r that of the route, averaged over SMOOTHING:

    dw/ds = sin e,   de/ds = c - c_r,   dc/ds = c_r' - 3 (c - c_r)/l - 3 e/l² - w/l³,   cut to (1)         (2)

From one of its poses it leaves for the goal, on one quintic (rti_mpcc.simulation.quintics) or, where there is
none, on two that meet in one of many poses beside the route. That none is found does not prove that there is
none: docking_behind, which takes all the curvature that the vehicle has, is not proven dockable.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from math import ceil, cos, sin, tan

import numpy as np
from numpy.typing import NDArray

from geometry import PathPart, Pose2
from rti_mpcc.simulation.passages import CURVATURE_SHARE, CURVATURE_SLOPE, SPACING, Room, joined
from rti_mpcc.simulation.scenario import Scenario
from rti_mpcc.types import Array

SMOOTHING = 2.0
"""Way over which the route's curvature is averaged [m]."""
LENGTH = 1.0
"""l of (2) [m]: in about 3 l the motion is on the route again."""
CUSP = (0.1, 0.1, 0.05)
"""How near to a cusp's pose the motion has to come there: longitudinal, lateral [m], heading [rad]."""
LONGEST = 25.0
"""Farthest from the goal that the motion may leave the route [m]."""
_LEAVE = 5  # poses between two at which it may
_SPEEDS = np.array(list(product((0.8, 1.0, 1.3, 1.7), repeat=2)))  # of a quintic, in shares of the chord
_FEW_SPEEDS = np.array([[1.0, 1.0], [1.25, 1.25]])  # where two of them are sought
_BENDS = (-0.5, 0.0, 0.5)  # of the largest curvature, what it may be where two curves meet and at the goal
_BESIDE = np.linspace(-1.5, 1.5, 7)  # [m] where two curves meet, from the route
_TURNED = np.linspace(-0.5, 0.5, 5)  # [rad] there
_EVERY = 1.5  # [m] between two such places along the route
_TRIED = 40  # pairs of curves looked at closely


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Witness:
    """A motion that docks. Arrays are read-only, their n poses at most SPACING apart.

    Attributes:
        poses: (n, 3) x [m], y [m], heading of the vehicle [rad], continuous.
        curvature: (n,) kappa = tan(steering)/wheelbase [1/m].
        part: (n,) index of the part of the route; at a cusp both have a pose.
        leaves: index of the pose at which the motion leaves the route for the goal.
    """

    poses: Array
    curvature: Array
    part: NDArray[np.int64]
    leaves: int

    def __post_init__(self) -> None:
        for values in (self.poses, self.curvature, self.part):
            values.setflags(write=False)


def find_witness(scenario: Scenario) -> Witness | None:
    """A motion by (1) from the start of the scenario to its true goal; None where none was found."""
    path, vehicle = scenario.build_path(), scenario.build_vehicle()
    corridor, goal = scenario.build_corridor(path), scenario.goal_pose(path)
    largest = CURVATURE_SHARE * tan(scenario.limits.steering) / vehicle.wheelbase
    at = np.array([path.start.x, path.start.y, path.start.phi, 0.0])
    pieces: list[Array] = []
    for index, part in enumerate(path.parts):
        room = Room(vehicle=vehicle, corridor=corridor, curvature=largest, index=index, part=part)
        pieces.append(_along(part, at, largest))
        at = pieces[-1][-1]
        free = room.free(pieces[-1])
        if index < len(path.parts) - 1 and not (free.all() and _arrives(at, part.last)):
            return None
    reached = pieces[-1] if free.all() else pieces[-1][: int(np.argmin(free))]
    found = _to_goal(reached, goal, room)
    if found is None:
        return None
    leaves, curve = found
    pieces[-1] = np.concatenate((reached[: leaves + 1], curve))
    motion = np.concatenate(pieces)
    return Witness(
        poses=motion[:, :3].copy(),
        curvature=motion[:, 3].copy(),
        part=np.repeat(np.arange(len(pieces)), [len(piece) for piece in pieces]),
        leaves=len(motion) - len(curve) - 1,
    )


def _along(part: PathPart, start: Array, largest: float) -> Array:
    """Equation (2) from a pose with curvature (4,) to the end of a part: (n, 4) x, y, phi, kappa."""
    d = part.direction
    x, y, phi, c = (start * (1.0, 1.0, 1.0, d)).tolist()
    theta, rows = part.start, [(x, y, phi, c)]
    known, c_known, slope_known = _averaged(part)
    for _ in range(2 * ceil((part.end - part.start) / SPACING)):
        at = part.reference(theta)
        dx, dy, e = x - at.x[0], y - at.y[0], phi - at.phi[0]
        t_x, t_y = d * cos(at.phi[0]), d * sin(at.phi[0])
        w = t_x * dy - t_y * dx
        theta += (t_x * dx + t_y * dy) / max(1.0 - w * at.slope[0], 0.2)
        step = min(SPACING, part.end - theta)
        if step <= 1e-6:
            break
        c_r, slope = np.interp(theta, known, c_known), np.interp(theta, known, slope_known)
        turn = float(slope - 3.0 * (c - c_r) / LENGTH - 3.0 * e / LENGTH**2 - w / LENGTH**3)
        last, c = c, c + step * min(max(turn, -CURVATURE_SLOPE), CURVATURE_SLOPE)
        c = min(max(c, -largest), largest)
        middle = phi + 0.25 * step * (last + c)
        x, y, phi = x + d * step * cos(middle), y + d * step * sin(middle), phi + 0.5 * step * (last + c)
        rows.append((x, y, phi, c))
    return np.array(rows) * (1.0, 1.0, 1.0, d)


def _arrives(at: Array, cusp: Pose2) -> bool:
    """Whether a pose with curvature (4,) is one to change direction at."""
    error = Pose2(*at[:3]).relative_to(cusp)
    return bool(np.all(np.abs([error.x, error.y, error.phi]) <= CUSP))


def _averaged(part: PathPart) -> tuple[Array, Array, Array]:
    """theta (k,) [m], c_r [1/m] and c_r' [1/m²] of (2)."""
    theta = np.linspace(part.start, part.end, max(ceil((part.end - part.start) / SPACING), 1) + 1)
    low = np.maximum(theta - 0.5 * SMOOTHING, part.start)
    high = np.minimum(theta + 0.5 * SMOOTHING, part.end)
    c_r = (part.reference(high).phi - part.reference(low).phi) / (high - low)
    return theta, c_r, np.gradient(c_r, theta)


def _to_goal(along: Array, goal: Pose2, room: Room) -> tuple[int, Array] | None:
    """The pose of `along` (n, 4) at which the motion leaves for the goal, and (k, 4) what follows."""
    near = np.hypot(along[:, 0] - goal.x, along[:, 1] - goal.y) <= LONGEST
    begins = np.flatnonzero(near)[::-_LEAVE]
    ends = np.array([[goal.x, goal.y, goal.phi, bend * room.curvature] for bend in _BENDS])
    if begins.size == 0 or not room.free(ends[:1]).all():
        return None
    direct = joined(along[begins], ends, _SPEEDS, room)
    for row in range(direct.begin.size):
        if (motion := direct.motion(row, room)) is not None:
            return int(begins[direct.begin[row]]), motion
    return _by_two(along, begins, ends, _places(goal, room), room)


def _by_two(
    along: Array, begins: NDArray[np.int64], ends: Array, places: Array, room: Room
) -> tuple[int, Array] | None:
    """As `_to_goal`, on two curves that meet in one of `places` (k, 4)."""
    last = joined(places, ends, _FEW_SPEEDS, room, sifted=True)
    used, gentlest = np.unique(last.begin, return_index=True)
    first = joined(along[begins], places[used], _FEW_SPEEDS, room, sifted=True)
    hard = np.maximum(first.hard, last.hard[gentlest[first.end]])
    for row in np.argsort(hard, kind="stable")[:_TRIED]:
        one = first.motion(int(row), room)
        two = last.motion(int(gentlest[first.end[row]]), room)
        if one is not None and two is not None:
            return int(begins[first.begin[row]]), np.concatenate((one, two))
    return None


def _places(goal: Pose2, room: Room) -> Array:
    """Poses with curvature (k, 4) beside the route before the goal where the body is free."""
    part = room.part
    to = part.project(goal.x, goal.y, heading=goal.phi)
    ahead = part.direction * goal.relative_to(part.pose(to)).x
    theta = np.arange(max(part.start + 1.0, to - LONGEST), to + max(ahead, 0.0) - 1.0, _EVERY)
    bends = np.array(_BENDS) * room.curvature
    at, beside, turned, bend = (
        grid.ravel() for grid in np.meshgrid(theta, _BESIDE, _TURNED, bends, indexing="ij")
    )
    way = part.reference(at)
    poses = np.column_stack(
        [way.x - beside * np.sin(way.phi), way.y + beside * np.cos(way.phi), way.phi + turned, bend]
    )
    return poses[room.free(poses)]
