"""Where a vehicle can be after it has driven out of where it stands: straight on, or to one side."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import product
from math import cos, sin

import numpy as np

from geometry import Area, Pose2
from rti_mpcc.config import ControllerConfig
from rti_mpcc.model.footprint import body_of
from rti_mpcc.route_planner.arcs import joined, poses_after, split
from rti_mpcc.route_planner.drivable import CURVATURE_SHARE
from rti_mpcc.types import Array

SPACING = 0.05
"""Distance of the poses on a straight move or a way out at which the clearance is checked [m]."""
_MOST_ENDS = 8  # of ways out that are tried
# In the order in which they are tried:
_STRAIGHTS = (0.75, 0.5, 0.25, 0.0)  # shares of a way out before its bend, other than all of it
_BENDS = (0.5, -0.5, 1.0, -1.0)  # as shares of the sharpest bend of routes, to the left or the right
_UNDONE = (0.0, 0.5, 0.35)  # shares of a bend that go back to the other side
_SIDES = (0.4, -0.4, 0.7, -0.7, 1.0, -1.0)  # how far off straight ahead an end may be [rad]


def ways_out(here: Pose2, distance: float, area: Area, config: ControllerConfig) -> tuple[Pose2, ...]:
    """Ends of ways out of a place, the best first.

    First come those to which the vehicle can drive straight on, round a bend, or round one that goes back to
    the other side, while the body keeps the margin of planned ways, or where it comes from less the more room
    it gets. Then those, and others ahead to either side, whose end alone is clear: there may be a way to it
    with changes of direction. Of those that keep as much the straighter ones come first.

    Args:
        here: where the vehicle stands; distance: along the way [m], negative in reverse; area: all that
            stands.
    """
    clearance, body = config.clearance, body_of(config.vehicle)
    start = np.array([here.x, here.y, here.phi])

    def room(poses: Array) -> Array:
        most = clearance.on_routes
        return np.minimum(area.grid.signed_distances(body, poses, most)[:, 0], most)

    direct, ends = [], [_beside(here, distance, *each) for each in _sides()]
    for way in _shapes(distance, config):
        poses = poses_after(start, split(way, SPACING))
        kept = room(poses)
        end = Pose2(*poses[-1].tolist())
        # Beside a dock there may be little room: there must not get less of it.
        if (kept >= min(clearance.on_routes, float(kept[0]))).all():
            direct.append((float(kept.min()), end))
        else:
            ends.append(end)
    kept = room(np.array([[end.x, end.y, end.phi] for end in ends]))
    others = zip(kept.tolist(), ends, strict=True)
    found = [*_best_first(direct, clearance.least), *_best_first(others, clearance.least)]
    return tuple(found[:_MOST_ENDS])


def _best_first(found: Iterable[tuple[float, Pose2]], least: float) -> list[Pose2]:
    """Those that keep the `least` clearance [m], the one with the most room [m] first; of equals as they
    come."""
    clear = [each for each in found if each[0] >= least]
    return [end for _, end in sorted(clear, key=lambda each: -each[0])]


def _shapes(distance: float, config: ControllerConfig) -> list[Array]:
    """Ways (m, 2) of signed lengths [m] and curvatures [1/m], the straightest first."""
    sharpest = CURVATURE_SHARE * config.max_curvature
    ways = [np.array([(distance, 0.0)])]
    for share, bend, undone in product(_STRAIGHTS, _BENDS, _UNDONE):
        straight, bent, curvature = share * distance, (1.0 - share) * distance, bend * sharpest
        pieces = (straight, 0.0), ((1.0 - undone) * bent, curvature), (undone * bent, -curvature)
        way = joined(np.array(pieces))
        ways += [way] if len(way) > 0 else []
    return ways


def _sides() -> list[tuple[float, float]]:
    """Where ends may be beside the way straight on, and how the vehicle stands there [rad]."""
    return [(side, turn * side) for side, turn in product(_SIDES, (0.0, 1.0))]


def _beside(here: Pose2, distance: float, side: float, turn: float) -> Pose2:
    """The pose at a distance [m], `side` [rad] off the way straight on, turned by `turn` [rad]."""
    return here.compose(Pose2(distance * cos(side), distance * sin(side), turn))
