"""What defines a corridor, as plain arrays: to be stored, and to build exactly the same corridor from.

The arguments of `Corridor.from_offsets` don't do that: how a boundary is trimmed where it folds may change
from version to version, and the last bits from machine to machine.
"""

from __future__ import annotations

from dataclasses import dataclass

from geometry.area import Area
from geometry.arrays import Array
from geometry.doors import Admitted, admit
from geometry.errors import CorridorError


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PartLines(Admitted):
    """The boundaries of one part of a route.

    Attributes:
        left, right: polylines (k, 2), each with its allowed side on the left [m].
        joined: one of each, and either begins where the other ends.
        narrowest: smallest width [m] and its theta [m].
    """

    left: tuple[Array, ...]
    right: tuple[Array, ...]
    joined: bool
    narrowest: tuple[float, float]

    def __post_init__(self) -> None:
        admit(self, CorridorError)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CorridorLines(Admitted):
    """The boundaries of every part of a route, and the obstacles.

    Attributes:
        parts: in the order of the route.
        obstacles: polygons (m, 2), counter-clockwise, from the corner on that they were given from [m].
        area: in the place of boundaries, or None.
    """

    parts: tuple[PartLines, ...]
    obstacles: tuple[Array, ...]
    area: Area | None = None

    def __post_init__(self) -> None:
        admit(self, CorridorError)
