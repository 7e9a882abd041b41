"""Where a vehicle can be after it has driven out of where it stands: straight on, or along a bend."""

from __future__ import annotations

from itertools import product
from math import copysign, cos, sin

import numpy as np

from geometry import Area, Pose2
from rti_mpcc.config import ControllerConfig
from rti_mpcc.model.footprint import body_of
from rti_mpcc.types import Array


def ways_out(here: Pose2, distance: float, area: Area, config: ControllerConfig) -> tuple[Pose2, ...]:
    """Ends of ways out of a place, the best first.

    Each way is a straight piece and a bend. First come those on which the body keeps the margin of planned
    ways, or where it comes from less the more room it gets; then those whose end alone is clear: there may be
    a way to it with a change of direction.

    Args:
        here: where the vehicle stands; distance: along the way [m], negative in reverse; area: all that
            stands.
    """
    settings, mission = config.route, config.mission
    sharpest = settings.curvature_share * config.max_curvature
    length, sign = abs(distance), copysign(1.0, distance)
    shapes = [(1.0, 0.0), *product(mission.out_straights, mission.out_bends)]
    clear: list[tuple[float, Pose2]] = []
    at_end: list[tuple[float, Pose2]] = []
    for share, bend in shapes:
        poses = _along(here, share * length, length, bend * sharpest, sign, mission.spacing)
        room = area.grid.signed_distances(body_of(config.vehicle), poses, 2.0 * settings.margin)[:, 0]
        end = Pose2(*poses[-1].tolist())
        if room[-1] < settings.hard_minimum:
            continue
        # Beside a dock there may be little room: there must not get less of it.
        drives = bool((room >= min(settings.margin, float(room[0]))).all())
        least = min(float(room.min()) if drives else float(room[-1]), settings.margin)
        (clear if drives else at_end).append((-least, end))
    ranked = [end for _, end in sorted(clear, key=_rank)] + [end for _, end in sorted(at_end, key=_rank)]
    return tuple(ranked[: mission.out_ends])


def _rank(found: tuple[float, Pose2]) -> float:
    return found[0]


def _along(
    here: Pose2, straight: float, length: float, curvature: float, sign: float, spacing: float
) -> Array:
    """Poses (n, 3) on a straight piece and a bend, from the first `spacing` [m] on."""
    marks = np.linspace(0.0, length, int(np.ceil(length / spacing)) + 1)[1:]
    poses = [_at(here, mark, straight, curvature, sign) for mark in marks.tolist()]
    return np.array([[pose.x, pose.y, pose.phi] for pose in poses])


def _at(here: Pose2, mark: float, straight: float, curvature: float, sign: float) -> Pose2:
    begin = here.compose(Pose2(sign * min(mark, straight), 0.0, 0.0))
    bent = max(mark - straight, 0.0)
    if bent == 0.0 or curvature == 0.0:
        return begin.compose(Pose2(sign * bent, 0.0, 0.0))
    turn = curvature * bent
    return begin.compose(Pose2(sign * sin(turn) / curvature, (1.0 - cos(turn)) / curvature, sign * turn))
