"""Ways past either side of an obstacle, for first guesses: along the path a guess drives into it.

From there half-planes push a plan to the side of its boundary that happens to be nearest, which may be the
one without room.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from geometry import PathPart
from rti_mpcc.config import ControllerConfig
from rti_mpcc.types import Array

CLEAR = 0.3
"""Kept from the obstacle beside it [m]."""
SWING = 10.0
"""Way over which a guess swings out, and back, at most [m]."""
SHORTEST = 1.0
"""And at least [m]: from a guess that breaks the dynamics the iterations come to one that obeys them."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Detour:
    """A way beside the path.

    Attributes:
        begin, end: where the guess is on the path again [m]; first, last: where it is all beside it [m], all
            of them progress.
        offset: so far [m], positive to the left of the vehicle on the path.
    """

    begin: float
    first: float
    last: float
    end: float
    offset: float

    def beside(self, theta: Array) -> tuple[Array, Array]:
        """Offset at progress (n,) [m], and its slope by progress, (n,) each."""
        out, back = self.first - self.begin, self.end - self.last
        ahead, behind = (self.first - theta) / out, (theta - self.last) / back
        share = np.clip(np.maximum(ahead, behind), 0.0, 1.0)
        sign = np.where(ahead > behind, 1.0 / out, -1.0 / back)
        half = 0.5 * np.pi
        return (
            self.offset * np.cos(half * share) ** 2,
            self.offset * half * np.sin(np.pi * share) * sign,
        )


def detours(
    part: PathPart,
    here: float,
    target: float,
    obstacles: Sequence[Array],
    config: ControllerConfig,
) -> tuple[Detour, ...]:
    """Both ways past the first obstacle that the body meets on the path, the shorter one first; none without.

    Args:
        here: progress of the vehicle [m]; target: where it is to end.
        obstacles: polygons (m, 2) [m].
    """
    vehicle = config.vehicle
    room, reach = 0.5 * vehicle.width, max(vehicle.front, vehicle.rear)
    met = []
    for polygon in obstacles:
        at = part.project(*polygon.mean(axis=0).tolist())
        pose = part.pose(at)
        away = (polygon - (pose.x, pose.y)) @ np.array(
            [[np.cos(pose.phi), -np.sin(pose.phi)], [np.sin(pose.phi), np.cos(pose.phi)]]
        )
        (_, right), (_, left) = away.min(axis=0).tolist(), away.max(axis=0).tolist()
        half = 0.5 * float(np.ptp(away[:, 0]))
        ahead = here <= at + half and at - half <= target + reach
        if ahead and right < room and left > -room:
            met.append((at, half, left, right))
    if not met:
        return ()
    at, half, left, right = min(met)
    first, last = at - half, at + half
    span = {
        "begin": max(here, first - SWING) if first - here > SHORTEST else first - SHORTEST,
        "first": first,
        "last": last,
        "end": min(max(target, last + SHORTEST), last + SWING),
    }
    sides = sorted((left + room + CLEAR, right - room - CLEAR), key=abs)
    return tuple(Detour(offset=offset, **span) for offset in sides)
