"""Where the pieces of a body are nearest to boundaries, and the half-planes that keep them apart there.

For each piece of the body and each side it is the nearest pair of features: a corner of the piece and a
segment or its end, or an end and an edge of the piece, with its signed distance and normal. As the body moves
the distance changes by (S2) of geometry.convex: that is the half-plane that the piece is to stay in. Of pairs
that are about equally near the one farther out along the body counts, by a share `outward` of how much
farther out it is: beside a straight wall its ends are what a turn brings nearer.

Boundaries are lines that have an allowed side, the left one. What is to the right of a line is convex where
the line turns right: such a run of segments counts as one where it crosses a piece. Between the points P and
Q at which it comes in and leaves, its normals add up to Q - P turned to the left, whatever its shape. The
piece is to get out along the left normal of one of the segments, or at right angles to one of its own edges,
no way against that sum, whichever is shortest. A piece that is wholly beyond the nearest segment is to get
out along its left normal, if the origin of the body is beyond the lines or another piece crosses them. Else
the body has not come through, but is behind the wall of another stretch of its lane: it stays there.

On open ground there are solid shapes all around, and the body may have to stand between two of them: the
nearest one alone would show a slot as one wall. So the sides are the flanks of the body. By where the normal
of the nearest pair of features points, seen from the body, a shape is to the left, to the right, or at an
end, ahead or behind, and there to the left or right of the middle. Obstacles in a corridor are one side.
"""

from __future__ import annotations

from math import cos, hypot, inf, sin, sqrt
from typing import Final

import numpy as np

from geometry.arrays import Array
from geometry.compiled import Array2, Out4, copy_row, inner, kernel
from geometry.convex import NORMAL_X, NORMAL_Y, ON_A_X, ON_A_Y, VALUE, WITNESS, distance_between
from geometry.shape_grid import (
    MOST_TIED,
    SAME,
    Body,
    BodyFrame,
    ShapeGrid,
    beyond_lines,
    in_frame,
    is_among,
    is_new,
    seen_from,
    shapes_near,
)

APART, ALONG, ACROSS, AT_X, AT_Y, CONTACT = range(6)
"""Columns of a contact: signed distance [m], normal, out of the shape, and the point of the piece [m], both
in the frame of the body; how many these are. They are the first ones of what `distance_between` finds."""
LEFT, RIGHT, END_LEFT, END_RIGHT, FLANKS = range(5)
"""Sides of a body on open ground; how many these are."""
_MOST_MET: Final = 32
"""Shapes near a pose of which it is known that they were met already, in another cell."""


def no_contacts(*shape: int) -> Array:
    """Return contacts (*shape, 5) where nothing is near: +inf and 0."""
    found = np.zeros((*shape, CONTACT))
    found[..., APART] = inf
    return found


@kernel
def line_contacts(
    body: Body, poses: Array2, grid: ShapeGrid, within: float, outward: float, found: Out4
) -> None:
    """Write the contacts of a body at `poses` (n, 3) with lines into `found` (n, pieces, sides, 5).

    Args:
        grid: segments of lines, as of `ShapeGrid.of_lines`; its owners are the first sides.
        within: what is farther away is left out [m]; outward: see the module.
        found: `no_contacts` before.
    """
    segment, witness, run = np.empty((2, 2)), np.empty(WITNESS), np.empty((2, 2))
    slots = (len(body.starts) - 1) * grid.owners
    # Of each slot: by what its contact was chosen, the least distance, and what tells on which side of the
    # lines the piece is: heights over the segments, how many, how many beyond their ends, the nearest.
    chosen, least, height = np.empty(slots), np.empty(slots), np.empty(slots)
    ties, ends, nearest = np.empty(slots, np.int64), np.empty(slots, np.int64), np.empty(slots, np.int64)
    tied, seen = np.empty((slots, MOST_TIED), np.int64), np.empty(_MOST_MET, np.int64)
    depth, near = np.zeros(1), np.empty_like(grid.members)
    spread = 2.0 * outward * hypot(body.half[0], body.half[1])
    for n in range(len(poses)):
        frame = BodyFrame(poses[n, 0], poses[n, 1], cos(poses[n, 2]), sin(poses[n, 2]))
        chosen[:], least[:], nearest[:], met = inf, inf, -1, 0
        for i in near[: shapes_near(frame, body, grid, within, near)]:
            if is_among(i, seen, met):
                continue
            ahead, aside = seen_from(frame, grid.circles[i, 0], grid.circles[i, 1])
            if met < len(seen):
                seen[met], met = i, met + 1
            in_frame(grid.corners, 2 * i, 2, frame, segment)
            length, left_x, left_y = _left_of(segment)
            for j in range(len(body.starts) - 1):
                slot = j * grid.owners + grid.owner[i]
                # All that a piece overlaps is looked at: how deep, its whole run has to tell.
                limit = min(within, max(least[slot], 0.0) * (1.0 + 2.0 * SAME) + spread)
                off_x = abs(ahead - body.middles[j, 0]) - body.halves[j, 0]
                off_y = abs(aside - body.middles[j, 1]) - body.halves[j, 1]
                if max(off_x, off_y) - grid.circles[i, 2] > limit:
                    continue
                piece = body.corners[body.starts[j] : body.starts[j + 1]]
                distance_between(piece, segment, limit, witness)
                value = witness[VALUE]
                if value >= limit:
                    continue
                to_x, to_y = witness[ON_A_X] - segment[0, 0], witness[ON_A_Y] - segment[0, 1]
                over = to_x * left_y - to_y * left_x
                if value < least[slot] * (1.0 - SAME):
                    # A line of one point has no sides.
                    height[slot], ties[slot], ends[slot] = 0.0, 0, 0
                    nearest[slot] = i if length > 0.0 else -1
                tie = value <= min(least[slot], within) * (1.0 + SAME)
                if tie and is_new(i, tied[slot], ties[slot]):
                    tied[slot, ties[slot]] = i
                    height[slot] += to_x * left_x + to_y * left_y
                    ties[slot] += 1
                    ends[slot] += over < 0.0 or over > length
                least[slot] = min(least[slot], value)
                if value <= 0.0 and length > 0.0:
                    _out_of_run(piece, grid.corners, i, frame, run, witness)
                elif value > 0.0:
                    _reach_out(piece, segment, body.middle[0], outward, witness)
                key = witness[VALUE] - outward * abs(witness[ON_A_X] - body.middle[0])
                if key < chosen[slot]:
                    chosen[slot] = key
                    copy_row(witness, found[n, j, grid.owner[i]])
        for slot in range(slots):
            at_open_end = ties[slot] == 1 and ends[slot] == 1
            if nearest[slot] >= 0 and least[slot] > 0.0 > height[slot] and not at_open_end:
                if least[slot % grid.owners :: grid.owners].min() > 0.0:
                    depth[0] = 0.0
                    beyond_lines(grid, poses[n : n + 1], inf, depth)
                    if depth[0] == 0.0:  # nothing of the body went through
                        continue
                in_frame(grid.corners, 2 * nearest[slot], 2, frame, segment)
                j = slot // grid.owners
                witness[VALUE] = -inf
                _behind(body.corners[body.starts[j] : body.starts[j + 1]], segment, witness)
                copy_row(witness, found[n, j, slot % grid.owners])


@kernel
def solid_contacts(
    body: Body, poses: Array2, grid: ShapeGrid, within: float, outward: float, found: Out4
) -> None:
    """Put what is nearer of solid shapes into the contacts `found` (n, pieces, sides, 5) of a body at `poses`
    (n, 3).

    Args:
        within, outward: as of `line_contacts`.
        found: of FLANKS sides, or of others: then all shapes are the last one.
    """
    shape, witness, near = np.empty((grid.largest, 2)), np.empty(WITNESS), np.empty_like(grid.members)
    middle, sides = body.middle, found.shape[2]
    farther_out = 0.0 if sides == FLANKS else outward
    for n in range(len(poses)):
        frame = BodyFrame(poses[n, 0], poses[n, 1], cos(poses[n, 2]), sin(poses[n, 2]))
        for i in near[: shapes_near(frame, body, grid, within, near)]:
            count = grid.starts[i + 1] - grid.starts[i]
            in_frame(grid.corners, grid.starts[i], count, frame, shape)
            for j in range(len(body.starts) - 1):
                piece = body.corners[body.starts[j] : body.starts[j + 1]]
                distance_between(piece, shape[:count], within, witness)
                if witness[VALUE] >= within:
                    continue
                if witness[VALUE] > 0.0:
                    _reach_out(piece, shape[:count], middle[0], outward, witness)
                side = _flank(witness, middle[1]) if sides == FLANKS else sides - 1
                known = found[n, j, side]
                key = witness[VALUE] - farther_out * abs(witness[ON_A_X] - middle[0])
                if key < known[APART] - farther_out * abs(known[AT_X] - middle[0]):
                    copy_row(witness, known)


@inner
def _flank(witness: Array, middle: float) -> int:
    """On which flank a shape is by this witness; where the body is met straight from an end, by the place."""
    if abs(witness[NORMAL_Y]) >= abs(witness[NORMAL_X]):
        return LEFT if witness[NORMAL_Y] < 0.0 else RIGHT
    return END_LEFT if witness[ON_A_Y] > middle else END_RIGHT


@inner
def _left_of(segment: Array) -> tuple[float, float, float]:
    dx, dy = segment[1, 0] - segment[0, 0], segment[1, 1] - segment[0, 1]
    length = hypot(dx, dy)
    if length == 0.0:
        return 0.0, 0.0, 0.0
    return length, -dy / length, dx / length


@inner
def _reach_out(piece: Array, shape: Array, middle: float, outward: float, witness: Array) -> None:
    """Put a corner of the piece that stands over an edge of the shape in the place of the nearest pair, if it
    is about as near and farther out."""
    best = witness[VALUE] - outward * abs(witness[ON_A_X] - middle)
    for j in range(1 if len(shape) == 2 else len(shape)):
        m = j + 1 if j + 1 < len(shape) else 0
        edge_x, edge_y = shape[m, 0] - shape[j, 0], shape[m, 1] - shape[j, 1]
        square = edge_x * edge_x + edge_y * edge_y
        for k in range(len(piece)):
            out = outward * abs(piece[k, 0] - middle)
            to_x, to_y = piece[k, 0] - shape[j, 0], piece[k, 1] - shape[j, 1]
            along = to_x * edge_x + to_y * edge_y
            if along < 0.0 or along > square or square == 0.0:
                continue
            apart_x, apart_y = to_x - along / square * edge_x, to_y - along / square * edge_y
            apart = sqrt(apart_x * apart_x + apart_y * apart_y)
            if 0.0 < apart < best + out:
                best = apart - out
                witness[VALUE], witness[ON_A_X], witness[ON_A_Y] = apart, piece[k, 0], piece[k, 1]
                witness[NORMAL_X], witness[NORMAL_Y] = apart_x / apart, apart_y / apart


@inner
def _behind(piece: Array, segment: Array, witness: Array) -> None:
    """The corner of the piece that is farthest to the right of a segment, along the left normal."""
    _, left_x, left_y = _left_of(segment)
    least, at = inf, 0
    for k in range(len(piece)):
        height = left_x * (piece[k, 0] - segment[0, 0]) + left_y * (piece[k, 1] - segment[0, 1])
        if height < least:
            least, at = height, k
    if least > witness[VALUE]:
        witness[VALUE], witness[NORMAL_X], witness[NORMAL_Y] = least, left_x, left_y
        witness[ON_A_X], witness[ON_A_Y] = piece[at, 0], piece[at, 1]


@inner
def _out_of_run(piece: Array, corners: Array, i: int, frame: BodyFrame, run: Array, witness: Array) -> None:
    """The least way out of the run of segments, of which the i-th is one, where it crosses the piece."""
    start, end = i, i
    while start > 0 and _turns_right(corners, start - 1):
        in_frame(corners, 2 * start - 2, 2, frame, run)
        if not _clipped(piece, run):
            break
        start -= 1
    while 2 * end + 3 < len(corners) and _turns_right(corners, end):
        in_frame(corners, 2 * end + 2, 2, frame, run)
        if not _clipped(piece, run):
            break
        end += 1
    in_x, in_y, out_x, out_y = 0.0, 0.0, 0.0, 0.0
    witness[VALUE] = -inf
    for j in range(start, end + 1):
        in_frame(corners, 2 * j, 2, frame, run)
        _behind(piece, run, witness)
        _clipped(piece, run)
        if j == start:
            in_x, in_y = run[0, 0], run[0, 1]
        out_x, out_y = run[1, 0], run[1, 1]
    for k in range(len(piece)):
        m = k + 1 if k + 1 < len(piece) else 0
        edge_x, edge_y = piece[m, 0] - piece[k, 0], piece[m, 1] - piece[k, 1]
        length = hypot(edge_x, edge_y)
        if length == 0.0:
            continue
        normal_x, normal_y = -edge_y / length, edge_x / length  # inward: the way that the piece would go
        if normal_y * (out_x - in_x) - normal_x * (out_y - in_y) < 0.0:
            continue
        least, at_x, at_y = inf, 0.0, 0.0
        for j in range(start, end + 1):
            in_frame(corners, 2 * j, 2, frame, run)
            for each in range(2):
                apart = normal_x * (piece[k, 0] - run[each, 0]) + normal_y * (piece[k, 1] - run[each, 1])
                if apart < least:
                    least, at_x, at_y = apart, run[each, 0], run[each, 1]
        if least > witness[VALUE]:
            witness[VALUE], witness[NORMAL_X], witness[NORMAL_Y] = least, normal_x, normal_y
            witness[ON_A_X], witness[ON_A_Y] = at_x + least * normal_x, at_y + least * normal_y


@inner
def _turns_right(corners: Array, i: int) -> bool:
    """Whether the line goes on from the i-th segment to the next, and not to the left."""
    a, b = 2 * i, 2 * i + 2
    if corners[a + 1, 0] != corners[b, 0] or corners[a + 1, 1] != corners[b, 1]:
        return False
    first_x, first_y = corners[a + 1, 0] - corners[a, 0], corners[a + 1, 1] - corners[a, 1]
    then_x, then_y = corners[b + 1, 0] - corners[b, 0], corners[b + 1, 1] - corners[b, 1]
    turn: float = first_x * then_y - first_y * then_x
    return turn <= SAME * hypot(first_x, first_y) * hypot(then_x, then_y)  # straight on, but for rounding


@inner
def _clipped(piece: Array, segment: Array) -> bool:
    """Keep of a segment what is in the piece; where nothing is, return False and keep all."""
    edge_x, edge_y = segment[1, 0] - segment[0, 0], segment[1, 1] - segment[0, 1]
    begin, end = 0.0, 1.0
    for k in range(len(piece)):
        m = k + 1 if k + 1 < len(piece) else 0
        inward_x, inward_y = piece[k, 1] - piece[m, 1], piece[m, 0] - piece[k, 0]
        depth = inward_x * (segment[0, 0] - piece[k, 0]) + inward_y * (segment[0, 1] - piece[k, 1])
        growth = inward_x * edge_x + inward_y * edge_y
        if growth > 0.0:
            begin = max(begin, -depth / growth)
        elif growth < 0.0:
            end = min(end, -depth / growth)
        elif depth < 0.0:
            return False
    if begin > end:
        return False
    segment[1, 0], segment[1, 1] = segment[0, 0] + end * edge_x, segment[0, 1] + end * edge_y
    segment[0, 0], segment[0, 1] = segment[0, 0] + begin * edge_x, segment[0, 1] + begin * edge_y
    return True
