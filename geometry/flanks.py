"""Where the pieces of a body are nearest to what is solid on each flank: half-planes on open ground.

In a corridor a side is a boundary. On open ground there are solid shapes all around, and the body may have to
stand between two of them: the nearest one alone would show a slot as one wall. So the sides are those of the
body. By where the normal of the nearest pair of features points, seen from the body, a shape is to the left,
to the right, or at an end, ahead or behind, and there to the left or right of the middle. Of each piece and
side the nearest one counts, as in geometry.contacts. Obstacles in a corridor are one side.
"""

from __future__ import annotations

from math import cos, sin
from typing import Final

import numpy as np

from geometry.arrays import Array
from geometry.compiled import Array2, Out4, inner, kernel
from geometry.contacts import APART, AT_X, keep, reach_out
from geometry.convex import NORMAL_X, NORMAL_Y, ON_A_X, ON_A_Y, VALUE, WITNESS, distance_between
from geometry.shape_grid import Body, BodyFrame, ShapeGrid, cells_around, in_frame, is_off, seen_from

LEFT: Final = 0
RIGHT: Final = 1
END_LEFT: Final = 2
END_RIGHT: Final = 3
FLANKS: Final = 4


@kernel
def solid_contacts(
    body: Body, poses: Array2, grid: ShapeGrid, within: float, outward: float, found: Out4
) -> None:
    """Put what is nearer of solid shapes into the contacts `found` (n, pieces, sides, 5) of a body at `poses`
    (n, 3).

    Args:
        within: what is farther away is left out [m]; outward: see geometry.contacts.
        found: of FLANKS sides, or of others: then all shapes are the last one.
    """
    shape, witness = np.empty((grid.largest, 2)), np.empty(WITNESS)
    middle, sides = body.middle, found.shape[2]
    farther_out = 0.0 if sides == FLANKS else outward
    for n in range(len(poses)):
        frame = BodyFrame(poses[n, 0], poses[n, 1], cos(poses[n, 2]), sin(poses[n, 2]))
        first_row, last_row, first_column, last_column = cells_around(frame, body, grid, within)
        for row in range(first_row, last_row + 1):
            first_cell, last_cell = row * grid.counts[0] + first_column, row * grid.counts[0] + last_column
            for k in range(grid.begins[first_cell], grid.begins[last_cell + 1]):
                i = grid.members[k]  # once more in a later cell, which does no harm
                ahead, aside = seen_from(frame, grid.circles[i, 0], grid.circles[i, 1])
                if is_off(ahead - middle[0], aside - middle[1], body.half, within + grid.circles[i, 2]):
                    continue
                count = grid.starts[i + 1] - grid.starts[i]
                in_frame(grid.corners, grid.starts[i], count, frame, shape)
                for j in range(len(body.starts) - 1):
                    piece = body.corners[body.starts[j] : body.starts[j + 1]]
                    distance_between(piece, shape[:count], within, witness)
                    if witness[VALUE] >= within:
                        continue
                    if witness[VALUE] > 0.0:
                        reach_out(piece, shape[:count], middle[0], outward, witness)
                    side = _flank(witness, middle[1]) if sides == FLANKS else sides - 1
                    known = found[n, j, side]
                    key = witness[VALUE] - farther_out * abs(witness[ON_A_X] - middle[0])
                    if key < known[APART] - farther_out * abs(known[AT_X] - middle[0]):
                        keep(witness, known)


@inner
def _flank(witness: Array, middle: float) -> int:
    """On which flank a shape is by this witness; where the body is met straight from an end, by the place."""
    if abs(witness[NORMAL_Y]) >= abs(witness[NORMAL_X]):
        return LEFT if witness[NORMAL_Y] < 0.0 else RIGHT
    return END_LEFT if witness[ON_A_Y] > middle else END_RIGHT
