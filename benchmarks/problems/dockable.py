"""Proof that a scenario can be docked in: a motion that does it, found without the controller or its solver.

First a motion is sought that runs along the route, one direction a part, and leaves the last part for the
goal on a curve that never turns back (benchmarks.problems.following). Three things make it one that a vehicle
can drive without stopping to steer:

    |kappa| <= CURVATURE_SHARE kappa_max,   |dkappa/ds| <= CURVATURE_SLOPE,   kappa continuous            (1)

over the whole way, cusps included: it begins with the steering straight and turns it nowhere at a standstill.
By delta = atan(L kappa) the steering rate at speed v is at most v L CURVATURE_SLOPE: with the default vehicle
and 0.5 m/s a good third of its limit. The body keeps CLEARANCE to all boundaries and obstacles.

Where there is none, one is searched for that gives way to what stands beside the route
(benchmarks.problems.reaching). It takes more of the vehicle, and that slowly: |dkappa/ds| <= SLOPE in place
of CURVATURE_SLOPE; where it stands (at its begin, at cusps, where it backs up) it may turn its steering
first; and it may drive beyond the goal and back up into it by at most BACK. Curvature and clearance are those
of (1).

That none is found does not prove that there is none; but where the body has no room by CLEARANCE at the
start, at a cusp or at the goal there is none (`cramped`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise, product
from math import tan

import numpy as np
from numpy.typing import NDArray

from benchmarks.problems.following import along, to_goal
from benchmarks.problems.lattice import LEVELS
from benchmarks.problems.passages import CURVATURE_SHARE, SPACING, SideClearance
from benchmarks.problems.reaching import reach
from geometry import Pose2, ReferencePath
from rti_mpcc.simulation.scenario import Scenario
from rti_mpcc.types import Array

CUSP = (0.1, 0.1, 0.05)
"""How near to a cusp's pose the motion has to come there: longitudinal, lateral [m], heading [rad]."""
_NEAR_CUSP = 0.9 * np.array(sorted(product((0.0, -1.0, 1.0), repeat=3), key=np.linalg.norm)) * CUSP
_LEAVE = 5  # poses between two at which a motion that is searched for may leave the route


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Witness:
    """A motion that docks. Arrays are read-only, their n poses at most SPACING apart.

    Attributes:
        poses: (n, 3) x [m], y [m], heading of the vehicle [rad], continuous.
        curvature: (n,) kappa = tan(steering)/wheelbase [1/m].
        part: (n,) index of the part of the route; at a cusp both have a pose.
        direction: (n,) of the motion, +1 forward, -1 reverse; where it changes both have a pose.
        leaves: index of the pose at which the motion leaves the middle of the last part for the goal.
        searched: whether it is one that was searched for.
    """

    poses: Array
    curvature: Array
    part: NDArray[np.int64]
    direction: NDArray[np.int64]
    leaves: int
    searched: bool

    def __post_init__(self) -> None:
        for values in (self.poses, self.curvature, self.part, self.direction):
            values.setflags(write=False)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Piece:
    """Of a motion, driven in one direction: poses with curvature (n, 4), part of the route, direction."""

    poses: Array
    part: int
    direction: int


def find_witness(scenario: Scenario) -> Witness | None:
    """A motion from the start of the scenario to its true goal; None where none was found."""
    path, goal, rooms = _problem(scenario)
    found = _followed(path, goal, rooms)
    if found is not None:
        return _witness(*found, searched=False)
    found = None if cramped(scenario) else _searched(path, goal, rooms)
    return None if found is None else _witness(*found, searched=True)


def cramped(scenario: Scenario) -> bool:
    """Whether the body has no room by CLEARANCE at start, cusp or goal, so that there is no motion."""
    path, goal, rooms = _problem(scenario)
    at_ends = rooms[0].free(_poses(path.start)).all() and rooms[-1].free(_poses(goal)).all()
    return not (at_ends and all(_free_at_cusp(*pair).size for pair in pairwise(rooms)))


def _problem(scenario: Scenario) -> tuple[ReferencePath, Pose2, list[SideClearance]]:
    """Route, true goal, and the room on each part."""
    path, vehicle = scenario.build_path(), scenario.vehicle
    corridor, goal = scenario.build_corridor(path), scenario.goal_pose()
    largest = CURVATURE_SHARE * tan(scenario.limits.steering) / vehicle.wheelbase
    rooms = [
        SideClearance(vehicle=vehicle, corridor=corridor, curvature=largest, index=index, part=part)
        for index, part in enumerate(path.parts)
    ]
    return path, goal, rooms


def _witness(pieces: list[Piece], leaves: int, *, searched: bool) -> Witness:
    motion = np.concatenate([piece.poses for piece in pieces])
    counts = [len(piece.poses) for piece in pieces]
    return Witness(
        poses=motion[:, :3].copy(),
        curvature=motion[:, 3].copy(),
        part=np.repeat([piece.part for piece in pieces], counts),
        direction=np.repeat([piece.direction for piece in pieces], counts),
        leaves=leaves,
        searched=searched,
    )


def _followed(path: ReferencePath, goal: Pose2, rooms: list[SideClearance]) -> tuple[list[Piece], int] | None:
    """A motion by (1), (2) along the route and from there to the goal; and where it leaves the route."""
    at = _poses(path.start)[0]
    pieces: list[Piece] = []
    for room in rooms:
        way = along(room.part, at, room.curvature)
        at, free = way[-1], room.free(way)
        if room is not rooms[-1] and not (free.all() and _arrives(at, room.part.last)):
            return None
        pieces.append(Piece(poses=way, part=room.index, direction=room.part.direction))
    reached = way if free.all() else way[: int(np.argmin(free))]
    found = to_goal(reached, goal, rooms[-1])
    if found is None:
        return None
    leaves, curve = found
    pieces[-1] = replace(pieces[-1], poses=np.concatenate((reached[: leaves + 1], curve)))
    return pieces, sum(len(piece.poses) for piece in pieces[:-1]) + leaves


def _searched(path: ReferencePath, goal: Pose2, rooms: list[SideClearance]) -> tuple[list[Piece], int] | None:
    """As `_followed`, by a search on the last part and on all others that cannot be followed."""
    at = _poses(path.start)[0]
    pieces: list[Piece] = []
    for room, after in zip(rooms, [*rooms[1:], None], strict=True):
        way = along(room.part, at, room.curvature)
        free = room.free(way)
        driven = sum(len(piece.poses) for piece in pieces)
        if after is None:
            ends = _poses(goal)
        elif free.all() and _arrives(way[-1], room.part.last) and after.free(way[-1:]).all():
            ends = way[:0]
        else:
            ends = _free_at_cusp(room, after)
        if len(ends) == 0:
            pieces.append(Piece(poses=way, part=room.index, direction=room.part.direction))
        else:
            reached = way if free.all() else way[: int(np.argmin(free))]
            found = _round(reached, ends, room, backs=after is None)
            if found is None:
                return None
            leaves, part = found
            pieces.extend(part)
        at = pieces[-1].poses[-1]
    return pieces, driven + leaves


def _round(way: Array, ends: Array, room: SideClearance, *, backs: bool) -> tuple[int, list[Piece]] | None:
    """The pose of `way` (n, 4) at which a motion leaves it for one of `ends` (e, 4), and that motion."""
    part = room.part
    begins = np.append(np.arange(0, len(way), _LEAVE), np.zeros(LEVELS.size, dtype=np.int64))
    roots = way[begins]
    roots[-LEVELS.size :, 3] = LEVELS * room.curvature
    aims = np.repeat(ends, LEVELS.size, axis=0)
    aims[:, 3] = np.tile(LEVELS * room.curvature, len(ends))
    to = part.project(*ends[0, :2].tolist(), heading=float(ends[0, 2]))
    beyond = part.direction * Pose2(*ends[0, :3]).relative_to(part.pose(to)).x
    theta = np.asarray(part.start + SPACING * begins, dtype=np.float64)
    found = reach(roots, theta, aims, to + beyond, room, backs=backs)
    if found is None:
        return None
    leaves = int(begins[found.root])
    onward = np.concatenate((way[:leaves], roots[[found.root]], found.onward))
    pieces = [Piece(poses=onward, part=room.index, direction=part.direction)]
    if len(found.back):
        pieces.append(Piece(poses=found.back, part=room.index, direction=-part.direction))
    return leaves, pieces


def _arrives(at: Array, cusp: Pose2) -> bool:
    """Whether a pose with curvature (4,) is one to change direction at."""
    return Pose2(*at[:3]).relative_to(cusp).within(CUSP)


def _free_at_cusp(before: SideClearance, after: SideClearance) -> Array:
    """Poses (k, 4) within CUSP of a cusp where the body has room on both parts, the nearest first."""
    cusp = before.part.last
    poses = np.concatenate([_poses(cusp.compose(Pose2(*offset))) for offset in _NEAR_CUSP])
    return poses[before.free(poses) & after.free(poses)]


def _poses(pose: Pose2) -> Array:
    """With the steering straight, (1, 4)."""
    return np.array([[pose.x, pose.y, pose.phi, 0.0]])
