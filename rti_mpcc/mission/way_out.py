"""Where a vehicle can be after it has driven out of where it stands: straight on, or to one side."""

from __future__ import annotations

from itertools import product

import numpy as np

from geometry import Area, Pose2
from rti_mpcc.config import ControllerConfig
from rti_mpcc.model.footprint import body_of
from rti_mpcc.route_planner.arcs import joined, poses_after, split
from rti_mpcc.types import Array


def ways_out(here: Pose2, distance: float, area: Area, config: ControllerConfig) -> tuple[Pose2, ...]:
    """Ends of ways out of a place, the best first.

    Each way is a straight piece and a bend, some of which may go to the other side. First come those on which
    the body keeps the margin of planned ways, or where it comes from less the more room it gets; then those
    whose end alone is clear: there may be a way to it with changes of direction. Of those that keep as much
    the straighter ones come first.

    Args:
        here: where the vehicle stands; distance: along the way [m], negative in reverse; area: all that
            stands.
    """
    settings, body = config.route, body_of(config.vehicle)
    start = np.array([here.x, here.y, here.phi])
    found: list[tuple[bool, float, int, Pose2]] = []
    for way in _shapes(distance, config):
        poses = poses_after(start, split(way, config.mission.spacing))
        room = np.minimum(area.grid.signed_distances(body, poses, settings.margin)[:, 0], settings.margin)
        # Beside a dock there may be little room: there must not get less of it.
        blocked = bool((room < min(settings.margin, float(room[0]))).any())
        if room[-1] >= settings.hard_minimum:
            kept = float(room[-1] if blocked else room.min())
            found.append((blocked, -kept, len(found), Pose2(*poses[-1].tolist())))
    return tuple(end for *_, end in sorted(found, key=lambda each: each[:3])[: config.mission.out_ends])


def _shapes(distance: float, config: ControllerConfig) -> list[Array]:
    """Ways (m, 2) of signed lengths [m] and curvatures [1/m], the straightest first."""
    settings = config.mission
    sharpest = config.route.curvature_share * config.max_curvature
    ways = [np.array([(distance, 0.0)])]
    for share, bend, undone in product(settings.out_straights, settings.out_bends, settings.out_undone):
        straight, bent, curvature = share * distance, (1.0 - share) * distance, bend * sharpest
        pieces = (straight, 0.0), ((1.0 - undone) * bent, curvature), (undone * bent, -curvature)
        ways.append(joined(np.array(pieces)))
    return ways
