"""The boundaries of one part of a route, as plain lines, and as what bodies are measured against.

The lines define a corridor, to be stored, and to build exactly the same corridor from. The arguments of
`Corridor.from_offsets` are not enough for that: how a folded boundary is trimmed may change from version to
version, and the last bits from machine to machine.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import asin, atan2, hypot, inf

import numpy as np

from geometry.arrays import Array, locked
from geometry.compiled import Array2, IndexOut1, inner, kernel
from geometry.errors import CorridorError
from geometry.sampling import thin_out
from geometry.shape_grid import ShapeGrid
from geometry.validation import Validated, to_rows, validate

FINE = 1e-4  # [m] that a curved wall may be beside itself where bodies are checked against it
SMOOTH = 1e-3  # [m] the same for its half-planes
_STRAIGHT = 1e-6  # [rad] that a straight line may turn at a point, by rounding
BEHIND = 2.0  # [m] farther beyond an open wall a point is not through it but behind it, on another way


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PartLines(Validated, error=CorridorError):
    """The boundaries of one part of a route.

    Of their points those that repeat the one before are left out, and of far too many those that a line runs
    straight past.

    Attributes:
        left, right: polylines (k, 2), each with its allowed side on the left [m].
        joined: one of each, and either begins where the other ends.
        narrowest: smallest width [m] and its theta [m].
        grid: the segments of both, as of one owner, within FINE of them; smooth: within SMOOTH, with fewer
            segments, of either side.
    """

    left: tuple[Array, ...]
    right: tuple[Array, ...]
    joined: bool
    narrowest: tuple[float, float]
    grid: ShapeGrid = field(init=False)
    smooth: ShapeGrid = field(init=False)

    def __post_init__(self) -> None:
        validate(self)
        for side in ("left", "right"):
            rows = [
                to_rows(line, 2, f"{side}[{k}]", CorridorError) for k, line in enumerate(getattr(self, side))
            ]
            # Views: an array of the caller's stays open.
            object.__setattr__(self, side, tuple(locked(thin_out(line).view()) for line in rows))
        grid = ShapeGrid.of_lines([simplified(line, FINE) for line in self.both])
        object.__setattr__(self, "grid", grid)
        smooth = ([simplified(line, SMOOTH) for line in side] for side in (self.left, self.right))
        object.__setattr__(self, "smooth", ShapeGrid.of_lines(*smooth))

    @property
    def both(self) -> tuple[Array, ...]:
        """The polylines of both sides."""
        return self.left + self.right

    @property
    def is_open(self) -> bool:
        """Whether one of them has ends, so that what is beyond them need not be outside."""
        return not self.joined and bool(self.both)


def simplified(line: Array, most: float) -> Array:
    """Return a polyline (m, 2) with few points, within `most` [m] of the given one.

    From each point that is kept on, the line is straight as far as one ray passes all points at `most`. It
    leads neither into nor out of what is straight itself. No choice between points that are equally far off:
    rounding would decide it, and a turned corridor would have other walls.
    """
    kept = np.zeros(len(line), dtype=np.int64)
    return line[kept[: _keep(line, most, kept)]]


@inner
def _is_straight(line: Array2, j: int) -> bool:
    """Whether the line runs straight past its j-th point; it does not past its ends."""
    if j < 1 or j > len(line) - 2:
        return False
    ax, ay = line[j, 0] - line[j - 1, 0], line[j, 1] - line[j - 1, 1]
    bx, by = line[j + 1, 0] - line[j, 0], line[j + 1, 1] - line[j, 1]
    return abs(atan2(ax * by - ay * bx, ax * bx + ay * by)) < _STRAIGHT


@kernel
def _keep(line: Array2, most: float, kept: IndexOut1) -> int:
    """Put the indices of the points that are kept into `kept` (m,); returns their number."""
    count, i = min(len(line), 1), 0
    while i < len(line) - 1:
        # Rays from the i-th point: their angles to (ux, uy), the direction of its first one beyond `most`.
        low, high, ux, uy, reached, last = -inf, inf, 0.0, 0.0, 0.0, i + 1
        for j in range(i + 1, len(line)):
            dx, dy = line[j, 0] - line[i, 0], line[j, 1] - line[i, 1]
            distance = hypot(dx, dy)
            if distance < reached:
                break  # it turns back
            if distance > most:
                if high == inf:
                    ux, uy = dx, dy
                turn = atan2(ux * dy - uy * dx, ux * dx + uy * dy)
                if turn < low or turn > high:
                    break
                aside = asin(most / distance)
                low, high = max(low, turn - aside), min(high, turn + aside)
            reached, last = distance, j
            if not _is_straight(line, j) and (_is_straight(line, j - 1) or _is_straight(line, j + 1)):
                break
        kept[count], count, i = last, count + 1, last
    return count
