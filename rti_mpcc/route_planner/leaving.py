"""How a vehicle leaves a start that is nearer to something than the hard minimum.

It drives one arc, on which the body never comes nearer to anything than it is at the start, until it keeps
the margin of the search. From there a route is searched for as from any start. The wheels are turned at rest
before the arc and behind it.
"""

from __future__ import annotations

from collections.abc import Generator

import numpy as np

from geometry.arrays import Array
from rti_mpcc.route_planner.arcs import poses_after
from rti_mpcc.route_planner.costs import Terms
from rti_mpcc.route_planner.hybrid_astar import Roots
from rti_mpcc.route_planner.problem import CHECK, RouteProblem

_SHARES = (0.0, 0.25, -0.25, 0.5, -0.5, 1.0, -1.0)
"""Curvatures that are tried, as shares of the sharpest one of the search."""
_SWING = 1e-3
"""Length [m] by which an end of the body may swing out on a gentle arc, or a tenth of the clearance at the
start."""
_ROUNDING = 1e-9  # [m]
_FARTHEST = 3.0
"""Longest arc, in lengths of the body."""
_SHORTEST = 0.5
"""Length [m] that an arc has where the margin is kept: a shorter one is within the tolerance of its end."""


def leaving_arcs(
    problem: RouteProblem, clearance: float, terms: Terms
) -> Generator[None, None, tuple[Roots, Array]]:
    """Ends of the arcs on which the clearance never falls below `clearance` [m], that of the start, or none;
    and the least clearance (n,) on each [m]."""
    body = problem.config.vehicle
    found, least = [], []
    swing = min(_SWING, 0.1 * clearance)
    count = round(_FARTHEST * (body.front + body.rear) / CHECK)
    for sign in (1.0, -1.0):
        behind = body.rear if sign > 0.0 else body.front
        # On an arc as gentle as this the end that is left behind swings out by that.
        gentle = min(2.0 * swing / max(behind, CHECK) ** 2, 1.0 / terms.radius)
        for curvature in (*(share / terms.radius for share in _SHARES), gentle, -gentle):
            poses = poses_after(problem.start, np.tile((sign * CHECK, curvature), (count, 1)))
            apart = problem.clearances(poses)
            yield
            last = _last(apart, clearance - swing - _ROUNDING, terms)
            if last is None:
                continue
            length = (last + 1) * CHECK
            cost = length * (terms.ahead if sign > 0.0 else terms.back)
            found.append((*poses[last], sign * length, curvature, cost))
            least.append(min(float(apart[: last + 1].min()), clearance))
    rows = np.array(found).reshape(-1, 6)
    return Roots(poses=rows[:, :3], arcs=rows[:, 3:5], costs=rows[:, 5]), np.array(least)


def _last(apart: Array, least: float, terms: Terms) -> int | None:
    """Index of the last pose of an arc with clearances (n,) [m]; None: one is less than `least` too early.

    There the clearance costs nothing, if the arc leads so far, and it is at least the margin.
    """
    out, nearer = np.flatnonzero(apart >= terms.margin), np.flatnonzero(apart < least)
    if len(out) == 0 or (len(nearer) and nearer[0] < out[0]):
        return None
    first = int(out[0])
    blocked = np.flatnonzero(apart[first:] < terms.margin)
    free = apart[: first + int(blocked[0]) if len(blocked) else len(apart)]
    roomy = np.flatnonzero(free >= terms.near)
    last = int(roomy[0]) if len(roomy) else first
    return min(max(last, round(_SHORTEST / CHECK) - 1), len(free) - 1)
