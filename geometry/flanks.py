"""Where the pieces of a body are nearest to what is solid on each flank: half-planes on open ground.

In a corridor a side is a boundary. On open ground there are solid shapes all around, and the body may have to
stand between two of them: the nearest one alone would show a slot as one wall. So the sides are those of the
body. By where the normal of the nearest pair of features points, seen from the body, a shape is to the left,
to the right, or at an end, ahead or behind, and there to the left or right of the middle. Of each piece and
side the nearest one counts, as in geometry.contacts.
"""

from __future__ import annotations

from math import cos, inf, sin
from typing import Final

import numpy as np

from geometry.arrays import Array
from geometry.compiled import Array2, Out3, inner, kernel
from geometry.contacts import ACROSS, ALONG, APART, AT_X, AT_Y, CONTACT, reach_out
from geometry.convex import NORMAL_X, NORMAL_Y, ON_A_X, ON_A_Y, VALUE, WITNESS, distance_between
from geometry.shape_grid import (
    Body,
    BodyShape,
    ShapeGrid,
    SolidShapes,
    cells_around,
    in_frame,
    least_to_box,
    to_box,
)

LEFT: Final = 0
RIGHT: Final = 1
END_LEFT: Final = 2
END_RIGHT: Final = 3
FLANKS: Final = 4


def flank_contacts(
    body: Body, poses: Array, grids: tuple[ShapeGrid, ...], *, within: float, outward: float
) -> Array:
    """Return the `Contacts.values` (n, pieces, FLANKS, 5) of a body at `poses` (n, 3) with solid shapes.

    Args:
        within: what is farther away is left out [m]; outward: see geometry.contacts.
    """
    found = np.zeros((len(poses), body.pieces * FLANKS, CONTACT))
    found[:, :, APART] = inf
    for grid in grids:
        if len(grid.owner):
            _flank_contacts(body.shape, poses, grid.solid, within, outward, found)
    return found.reshape(len(poses), body.pieces, FLANKS, CONTACT)


@kernel
def _flank_contacts(
    body: BodyShape, poses: Array2, solid: SolidShapes, within: float, outward: float, found: Out3
) -> None:
    shape, witness = np.empty((max(solid.largest, 2), 2)), np.empty(WITNESS)
    for n in range(len(poses)):
        x, y, c, s = poses[n, 0], poses[n, 1], cos(poses[n, 2]), sin(poses[n, 2])
        first_row, last_row, first_column, last_column = cells_around(x, y, c, s, body, solid, within)
        for row in range(first_row, last_row + 1):
            first_cell = row * solid.counts[0] + first_column
            last_cell = row * solid.counts[0] + last_column
            for k in range(solid.begins[first_cell], solid.begins[last_cell + 1]):
                i = solid.members[k]  # once more in a later cell, which does no harm
                dx, dy = solid.circles[i, 0] - x, solid.circles[i, 1] - y
                ahead, aside = c * dx + s * dy - body.middle[0], c * dy - s * dx - body.middle[1]
                limit = within + solid.circles[i, 2]
                if least_to_box(ahead, aside, body.half) >= limit or to_box(ahead, aside, body.half) >= limit:
                    continue
                count = solid.starts[i + 1] - solid.starts[i]
                in_frame(solid.corners, solid.starts[i], count, x, y, c, s, shape)
                for piece in range(len(body.starts) - 1):
                    first, stop = body.starts[piece], body.starts[piece + 1]
                    distance_between(body.corners, first, stop, shape, 0, count, within, witness)
                    if witness[VALUE] >= within:
                        continue
                    if witness[VALUE] > 0.0:
                        reach_out(body.corners, first, stop, shape, count, body.middle[0], outward, witness)
                    slot = piece * FLANKS + _flank(witness, body.middle[1])
                    if witness[VALUE] < found[n, slot, APART]:
                        found[n, slot, APART] = witness[VALUE]
                        found[n, slot, ALONG], found[n, slot, ACROSS] = witness[NORMAL_X], witness[NORMAL_Y]
                        found[n, slot, AT_X], found[n, slot, AT_Y] = witness[ON_A_X], witness[ON_A_Y]


@inner
def _flank(witness: Array, middle: float) -> int:
    """On which flank a shape is by this witness; where the body is met straight from an end, by the place."""
    if abs(witness[NORMAL_Y]) >= abs(witness[NORMAL_X]):
        return LEFT if witness[NORMAL_Y] < 0.0 else RIGHT
    return END_LEFT if witness[ON_A_Y] > middle else END_RIGHT
