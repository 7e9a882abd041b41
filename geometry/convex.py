"""The signed distance between two convex shapes, with where it is and which way.

A shape is its corners in counter-clockwise order; one corner is a point, two are a segment. The distance of
shapes A and B is the least |a - b| of points of theirs where they are apart, and minus the least way by which
one is to be moved to be apart where they overlap. Either way it is n·(a - b) for the witness points a, b and
a unit normal n from B to A. As A moves by (dx, dy) and turns by dphi about its point r, it changes by

(S2)  n_x dx + n_y dy + ((a_x - r_x) n_y - (a_y - r_y) n_x) dphi

wherever one pair of features alone is nearest (a corner and an edge, or two corners).

Where shapes overlap, the least way out is along the normal of an edge of one of them: these are the edges of
the Minkowski difference B - A that the origin is in. So the distance is the largest separation along any.
"""

from __future__ import annotations

from math import inf, sqrt
from typing import Final

from geometry.arrays import Array
from geometry.compiled import inner

VALUE, NORMAL_X, NORMAL_Y, ON_A_X, ON_A_Y, ON_B_X, ON_B_Y, WITNESS = range(8)
"""What is found: the distance [m], the normal, and a witness point on each shape [m]; how many these are."""
_TOUCHING: Final = 1e-9


@inner
def distance_between(a: Array, b: Array, most: float, found: Array) -> None:
    """Find the signed distance between two convex shapes `a` (k, 2) and `b` (m, 2) [m]: `found` (WITNESS,).

    A distance of `most` or more may be too small, but is `most` at least.
    """
    found[VALUE] = -inf
    _separate(a, b, ON_A_X, ON_B_X, found)
    _separate(b, a, ON_B_X, ON_A_X, found)
    # No normal of theirs tells whether lines and points on one line are apart.
    thin = len(a) <= 2 and len(b) <= 2
    if -inf < found[VALUE] <= (-_TOUCHING if thin else 0.0) or found[VALUE] >= most:
        return
    found[VALUE] = inf
    _approach(a, b, ON_A_X, ON_B_X, found)
    _approach(b, a, ON_B_X, ON_A_X, found)
    found[VALUE] = sqrt(found[VALUE])
    if found[VALUE] > _TOUCHING:
        found[NORMAL_X] = (found[ON_A_X] - found[ON_B_X]) / found[VALUE]
        found[NORMAL_Y] = (found[ON_A_Y] - found[ON_B_Y]) / found[VALUE]


@inner
def _separate(p: Array, q: Array, on_p: int, on_q: int, found: Array) -> None:
    """Keep the largest separation along the outward normals of edges of p, and at `on_p`, `on_q` where."""
    if len(p) == 1:
        return
    sign = 1.0 if on_q == ON_A_X else -1.0
    for i in range(len(p)):
        j = i + 1 if i + 1 < len(p) else 0
        edge_x, edge_y = p[j, 0] - p[i, 0], p[j, 1] - p[i, 1]
        length = sqrt(edge_x * edge_x + edge_y * edge_y)
        if length == 0.0:
            continue
        normal_x, normal_y = edge_y / length, -edge_x / length
        # The corner of q that is deepest behind the edge; relative to the edge's begin, as all is.
        least, at = inf, 0
        for k in range(len(q)):
            beyond = normal_x * (q[k, 0] - p[i, 0]) + normal_y * (q[k, 1] - p[i, 1])
            if beyond < least:
                least, at = beyond, k
        if least > found[VALUE]:
            found[VALUE] = least
            found[NORMAL_X], found[NORMAL_Y] = sign * normal_x, sign * normal_y
            x, y = q[at, 0], q[at, 1]
            share = ((x - p[i, 0]) * edge_x + (y - p[i, 1]) * edge_y) / (length * length)
            off = min(max(share, 0.0), 1.0) - share  # along parallel edges: to a place that is on both
            x, y = x + off * edge_x, y + off * edge_y
            found[on_q], found[on_q + 1] = x, y
            found[on_p], found[on_p + 1] = x - least * normal_x, y - least * normal_y


@inner
def _approach(p: Array, q: Array, on_p: int, on_q: int, found: Array) -> None:
    """Keep the least square of the distance of a corner of p to an edge of q, and at `on_p`, `on_q` where."""
    least = found[VALUE]
    for i in range(1 if len(q) == 2 else len(q)):
        j = i + 1 if i + 1 < len(q) else 0
        edge_x, edge_y = q[j, 0] - q[i, 0], q[j, 1] - q[i, 1]
        square = edge_x * edge_x + edge_y * edge_y
        over = 1.0 / square if square > 0.0 else 0.0
        for k in range(len(p)):
            to_x, to_y = p[k, 0] - q[i, 0], p[k, 1] - q[i, 1]
            along = min(max((to_x * edge_x + to_y * edge_y) * over, 0.0), 1.0)
            apart_x, apart_y = to_x - along * edge_x, to_y - along * edge_y
            distance = apart_x * apart_x + apart_y * apart_y
            if distance < least:
                least = distance
                found[on_p], found[on_p + 1] = p[k, 0], p[k, 1]
                found[on_q], found[on_q + 1] = p[k, 0] - apart_x, p[k, 1] - apart_y
    found[VALUE] = least


@inner
def swept(corners: Array, dx: float, dy: float, found: Array) -> int:
    """Find the corners of what a convex shape (n, 2) covers as it moves by (dx, dy): `found` (n + 2, 2).

    Returns how many these are.
    """
    count, n = 0, len(corners)
    for i in range(n):
        # Whether the edges before and behind this corner go along, or are left behind.
        before = _leads(corners, (i - 1) % n, i, dx, dy)
        behind = _leads(corners, i, (i + 1) % n, dx, dy)
        found[count, 0] = corners[i, 0] + (dx if before else 0.0)
        found[count, 1] = corners[i, 1] + (dy if before else 0.0)
        count += 1
        if behind != before:
            found[count, 0] = corners[i, 0] + (dx if behind else 0.0)
            found[count, 1] = corners[i, 1] + (dy if behind else 0.0)
            count += 1
    if count <= 2:
        # A point, or a line that moves along itself: from its hindmost end to where the other gets.
        along = (corners[n - 1, 0] - corners[0, 0]) * dx + (corners[n - 1, 1] - corners[0, 1]) * dy
        begin, end = (0, n - 1) if along >= 0.0 else (n - 1, 0)
        found[0, 0], found[0, 1] = corners[begin, 0], corners[begin, 1]
        found[1, 0], found[1, 1] = corners[end, 0] + dx, corners[end, 1] + dy
        return 2
    return count


@inner
def _leads(corners: Array, i: int, j: int, dx: float, dy: float) -> bool:
    """Whether the motion has a part along the outward normal of the edge from corner i to j."""
    outward: float = (corners[j, 1] - corners[i, 1]) * dx - (corners[j, 0] - corners[i, 0]) * dy
    return outward > 0.0
