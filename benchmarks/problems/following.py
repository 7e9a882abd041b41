"""A motion along the middle of a route, as far as it goes, and from there to a goal on one curve or two.

Routes are arcs, on which kappa jumps. The motion follows them as a chain of integrators in its way s does,
with d the direction, w the lateral error to the left of the travel, e the heading error, c = dphi/ds = d
kappa, and c_r that of the route, averaged over SMOOTHING:

    dw/ds = sin e,   de/ds = c - c_r,   dc/ds = c_r' - 3 (c - c_r)/l - 3 e/l² - w/l³                      (1)

cut to |kappa| <= Room.curvature, |dkappa/ds| <= CURVATURE_SLOPE. From one of its poses it leaves for the
goal, on one quintic (benchmarks.problems.passages) or, where there is none, on two that meet in one of many
poses beside the route. It does not give way to what stands there: benchmarks.problems.reaching does.
"""

from __future__ import annotations

from itertools import product
from math import ceil, cos, sin

import numpy as np
from numpy.typing import NDArray

from benchmarks.problems.passages import CURVATURE_SLOPE, SPACING, SideClearance, joined
from geometry import PathPart, Pose2
from rti_mpcc.types import Array

SMOOTHING = 2.0
"""Way over which the route's curvature is averaged [m]."""
LENGTH = 1.0
"""l of (1) [m]: in about 3 l the motion is on the route again."""
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


def along(part: PathPart, start: Array, largest: float) -> Array:
    """Equation (1) from a pose with curvature (4,) to the end of a part: (n, 4) x, y, phi, kappa."""
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


def _averaged(part: PathPart) -> tuple[Array, Array, Array]:
    """theta (k,) [m], c_r [1/m] and c_r' [1/m²] of (2)."""
    theta = np.linspace(part.start, part.end, max(ceil((part.end - part.start) / SPACING), 1) + 1)
    low = np.maximum(theta - 0.5 * SMOOTHING, part.start)
    high = np.minimum(theta + 0.5 * SMOOTHING, part.end)
    c_r = (part.reference(high).phi - part.reference(low).phi) / (high - low)
    return theta, c_r, np.gradient(c_r, theta)


def to_goal(way: Array, goal: Pose2, room: SideClearance) -> tuple[int, Array] | None:
    """The pose of `way` (n, 4) at which the motion leaves for the goal, and (k, 4) what follows."""
    near = np.hypot(way[:, 0] - goal.x, way[:, 1] - goal.y) <= LONGEST
    begins = np.flatnonzero(near)[::-_LEAVE]
    ends = np.array([[goal.x, goal.y, goal.phi, bend * room.curvature] for bend in _BENDS])
    if begins.size == 0 or not room.free(ends[:1]).all():
        return None
    direct = joined(way[begins], ends, _SPEEDS, room)
    for row in range(direct.begin.size):
        if (motion := direct.motion(row, room)) is not None:
            return int(begins[direct.begin[row]]), motion
    return _by_two(way, begins, ends, _places(goal, room), room)


def _by_two(
    way: Array, begins: NDArray[np.int64], ends: Array, places: Array, room: SideClearance
) -> tuple[int, Array] | None:
    """As `to_goal`, on two curves that meet in one of `places` (k, 4)."""
    last = joined(places, ends, _FEW_SPEEDS, room, sifted=True)
    used, gentlest = np.unique(last.begin, return_index=True)
    first = joined(way[begins], places[used], _FEW_SPEEDS, room, sifted=True)
    hard = np.maximum(first.hard, last.hard[gentlest[first.end]])
    for row in np.argsort(hard, kind="stable")[:_TRIED]:
        one = first.motion(int(row), room)
        two = last.motion(int(gentlest[first.end[row]]), room)
        if one is not None and two is not None:
            return int(begins[first.begin[row]]), np.concatenate((one, two))
    return None


def _places(goal: Pose2, room: SideClearance) -> Array:
    """Poses with curvature (k, 4) beside the route before the goal where the body is free."""
    part = room.part
    to = part.project(goal.x, goal.y, heading=goal.phi)
    ahead = part.direction * goal.relative_to(part.pose(to)).x
    theta = np.arange(max(part.start + 1.0, to - LONGEST), to + max(ahead, 0.0) - 1.0, _EVERY)
    bends = np.array(_BENDS) * room.curvature
    at, beside, turned, bend = (
        grid.ravel() for grid in np.meshgrid(theta, _BESIDE, _TURNED, bends, indexing="ij")
    )
    foot = part.reference(at)
    poses = np.column_stack(
        [foot.x - beside * np.sin(foot.phi), foot.y + beside * np.cos(foot.phi), foot.phi + turned, bend]
    )
    return poses[room.free(poses)]
