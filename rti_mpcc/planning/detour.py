"""Ways past either side of an obstacle, for first guesses: along the path a guess drives into it.

From there half-planes push a plan to the side of its boundary that happens to be nearest, which may be the
one without room.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from geometry import PathPart
from rti_mpcc.config import ControllerConfig
from rti_mpcc.types import Array


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
    placed = (_placed(part, polygon) for polygon in obstacles)
    met = [
        each
        for each in placed
        if here <= each.last and each.first <= target + reach and each.right < room and each.left > -room
    ]
    if not met:
        return ()
    first, last, right, left = min(met)
    settings = config.guesses
    longest, shortest, clear = settings.longest_swing, settings.shortest_swing, settings.detour_clearance
    begin = min(max(here, first - longest), first - shortest)
    end = max(min(target, last + longest), last + shortest)
    sides = sorted((left + room + clear, right - room - clear), key=abs)
    return tuple(Detour(begin=begin, first=first, last=last, end=end, offset=offset) for offset in sides)


class _Placed(NamedTuple):
    """Where an obstacle is on the path: progress from `first` to `last`, from `right` to `left` of it [m]."""

    first: float
    last: float
    right: float
    left: float


def _placed(part: PathPart, polygon: Array) -> _Placed:
    at = part.project(*polygon.mean(axis=0).tolist())
    pose = part.pose(at)
    seen = (polygon - (pose.x, pose.y)) @ np.array([1.0, 1j]) * np.exp(-1j * pose.phi)
    along = at + part.direction * seen.real
    return _Placed(*(float(end) for end in (along.min(), along.max(), seen.imag.min(), seen.imag.max())))
