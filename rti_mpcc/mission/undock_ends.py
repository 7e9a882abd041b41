"""Poses in which an undocking can end: straight on, or to one side."""

from __future__ import annotations

from itertools import product
from math import cos, sin

import numpy as np

from geometry import Area, Pose2
from rti_mpcc.config import ControllerConfig
from rti_mpcc.model.footprint import body_of
from rti_mpcc.route_planner.arcs import merge_arcs, poses_after, split_arcs
from rti_mpcc.route_planner.smoothing import CURVATURE_SHARE
from rti_mpcc.types import Array

SPACING = 0.05
"""Distance of the poses on a straight move or a route out at which the clearance is checked [m]."""
_MOST_ENDS = 8  # that are tried
# In the order in which they are tried:
_STRAIGHTS = (0.75, 0.5, 0.25, 0.0)  # shares of a route before its bend, other than all of it
_BENDS = (0.5, -0.5, 1.0, -1.0)  # as shares of the sharpest bend of routes, to the left or the right
_UNDONE = (0.0, 0.5, 0.35)  # shares of a bend that go back to the other side
_SIDES = (0.4, -0.4, 0.7, -0.7, 1.0, -1.0)  # how far off straight ahead an end may be [rad]


def undock_ends(here: Pose2, distance: float, area: Area, config: ControllerConfig) -> tuple[Pose2, ...]:
    """Ends of an undocking, the best first.

    First come those to which the vehicle can drive straight on, round a bend, or round one that goes back to
    the other side, while the body keeps the margin of planned routes, or the clearance at the start if that
    is less. Then those, and others ahead to either side, whose end alone is clear: a route with changes of
    direction may lead there. Of those that keep as much the straighter ones come first.

    Args:
        here: where the vehicle stands; distance: along the route [m], negative in reverse; area: all that is
            solid.
    """
    clearance, body = config.clearance, body_of(config.vehicle)

    def clearances(poses: Array) -> Array:
        return np.minimum(
            area.grid.signed_distances(body, poses, clearance.on_routes)[:, 0], clearance.on_routes
        )

    def best_first(found: list[tuple[float, Pose2]]) -> list[Pose2]:
        clear = [each for each in found if each[0] >= clearance.least]
        return [end for _, end in sorted(clear, key=lambda each: -each[0])]

    start, direct = np.array([here.x, here.y, here.phi]), []
    ends = [
        here.compose(Pose2(distance * cos(side), distance * sin(side), turn * side))
        for side, turn in product(_SIDES, (0.0, 1.0))
    ]
    for route in _routes(distance, CURVATURE_SHARE * config.max_curvature):
        poses = poses_after(start, split_arcs(route, SPACING))
        kept, end = clearances(poses), Pose2(*poses[-1].tolist())
        # In a dock the clearance may be small: it must not become less.
        if (kept >= min(clearance.on_routes, float(kept[0]))).all():
            direct.append((float(kept.min()), end))
        else:
            ends.append(end)
    kept = clearances(np.array([[end.x, end.y, end.phi] for end in ends]))
    found = [*best_first(direct), *best_first(list(zip(kept.tolist(), ends, strict=True)))]
    return tuple(found[:_MOST_ENDS])


def _routes(distance: float, sharpest: float) -> list[Array]:
    """Routes (m, 2) of signed lengths [m] and curvatures [1/m], the straightest first."""
    routes = [np.array([(distance, 0.0)])]
    for share, bend, undone in product(_STRAIGHTS, _BENDS, _UNDONE):
        straight, bent, curvature = share * distance, (1.0 - share) * distance, bend * sharpest
        arcs = (straight, 0.0), ((1.0 - undone) * bent, curvature), (undone * bent, -curvature)
        route = merge_arcs(np.array(arcs))
        routes += [route] if len(route) > 0 else []
    return routes
