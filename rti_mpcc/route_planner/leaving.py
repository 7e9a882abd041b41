"""How a vehicle leaves a start that is nearer to something than the hard minimum.

It leaves as it came to stand there: on one arc, on which the body never comes nearer to anything than it is
at the start, until it keeps the margin of the search. From there a way is searched for as from any start. The
wheels are turned at rest before the arc and behind it.
"""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass, replace

import numpy as np

from geometry.arrays import Array
from rti_mpcc.route_planner.arcs import poses_after
from rti_mpcc.route_planner.costs import Terms
from rti_mpcc.route_planner.drivable import Drivable
from rti_mpcc.route_planner.problem import CHECK, Problem

_SHARES = (0.0, 0.25, -0.25, 0.5, -0.5, 1.0, -1.0)
"""Curvatures that are tried, as shares of the sharpest one of the search."""
_SWING = 1e-3
"""On a gentle arc an end of the body may swing out by so much [m], or by a tenth of what the start leaves."""
_ROUNDING = 1e-9  # [m]
_FARTHEST = 3.0
"""Longest arc, in lengths of the body."""
_SHORTEST = 0.5
"""An arc goes on to this length where the margin is kept: a shorter one is within the tolerance of its end
[m]."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Begins:
    """Where a search begins.

    Attributes:
        poses: (n, 3) of them; pieces: (n, 2) signed lengths [m] and curvatures [1/m] of the arcs that lead
            there; costs: (n,) of these arcs [m].
        room: (n,) least clearance of the body on each [m], for arcs that are a part of the way; or none (0,).
    """

    poses: Array
    pieces: Array
    costs: Array
    room: Array

    @classmethod
    def at_start(cls, problem: Problem) -> Begins:
        """At the start, with nothing to leave first."""
        return cls(poses=problem.start[None], pieces=problem.came[None], costs=np.zeros(1), room=np.zeros(0))

    def problem_from(self, problem: Problem, k: int) -> Problem:
        """The problem that is left from the k-th one."""
        return replace(problem, start=self.poses[k]) if len(self.room) else problem

    def whole(self, driven: Drivable, k: int) -> Drivable:
        """A way from the k-th one with the arc that leads there."""
        if len(self.room) == 0:
            return driven
        return Drivable(
            way=np.vstack([self.pieces[k], driven.way]),
            stops=np.append(True, driven.stops),
            room=np.append(self.room[k], driven.room),
        )


def arcs_out(problem: Problem, room: float, terms: Terms) -> Generator[None, None, Begins]:
    """Where arcs lead on which the body is never nearer to anything than `room` [m], as it is at the start.

    None lead anywhere: there are no poses.
    """
    body = problem.config.vehicle
    ends, pieces, costs, least = [], [], [], []
    swing = min(_SWING, 0.1 * room)
    count = round(_FARTHEST * (body.front + body.rear) / CHECK)
    for sign in (1.0, -1.0):
        behind = body.rear if sign > 0.0 else body.front
        # On an arc as gentle as this the end that is left behind swings out by so much.
        gentle = min(2.0 * swing / max(behind, CHECK) ** 2, 1.0 / terms.radius)
        for curvature in (*(share / terms.radius for share in _SHARES), gentle, -gentle):
            way = np.tile((sign * CHECK, curvature), (count, 1))
            poses = poses_after(problem.start, way)
            apart = problem.clearances(poses, problem.within)
            yield
            last = _last(apart, room - swing - _ROUNDING, terms.margin, terms.near)
            if last is None:
                continue
            length = (last + 1) * CHECK
            ends.append(poses[last])
            pieces.append((sign * length, curvature))
            costs.append(length * (terms.ahead if sign > 0.0 else terms.back))
            least.append(min(float(apart[: last + 1].min()), room))
    return Begins(
        poses=np.array(ends).reshape(-1, 3),
        pieces=np.array(pieces).reshape(-1, 2),
        costs=np.array(costs),
        room=np.array(least),
    )


def _last(apart: Array, least: float, kept: float, wanted: float) -> int | None:
    """The pose at which an arc with clearances (n,) [m] has left; None: it is nearer than `least` before.

    That is where the clearance is `wanted`, if the arc leads there, and at least what is to be `kept`.
    """
    out, nearer = np.flatnonzero(apart >= kept), np.flatnonzero(apart < least)
    if len(out) == 0 or (len(nearer) and nearer[0] < out[0]):
        return None
    first = int(out[0])
    blocked = np.flatnonzero(apart[first:] < kept)
    free = apart[: first + int(blocked[0]) if len(blocked) else len(apart)]
    roomy = np.flatnonzero(free >= wanted)
    last = int(roomy[0]) if len(roomy) else first
    return min(max(last, round(_SHORTEST / CHECK) - 1), len(free) - 1)
