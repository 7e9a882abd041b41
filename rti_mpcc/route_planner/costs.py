"""Cost of a route [m], and a lower bound of it between two poses.

The cost is the length, more in reverse and where the body is close to something, and something for each
change of direction and for each change of the steering. Curves between two poses are Reeds-Shepp words.
"""

from __future__ import annotations

from math import atan, cos, inf, sin
from typing import Final, NamedTuple

import numpy as np

from geometry.arrays import Array
from geometry.compiled import IndexOut1, Out1, Out2, copy_rows, inner
from geometry.convex import VALUE, WITNESS, distance_between
from geometry.reeds_shepp import PIECES, WORDS, least_cost, words
from geometry.shape_grid import Body, BodyFrame, ShapeGrid, cells_around, in_frame, is_off, seen_from
from rti_mpcc.route_planner.arcs import NO_LENGTH, pose_after
from rti_mpcc.route_planner.tree import MOST_TARGETS

ARC: Final = 0.16
"""Length of the arcs of the search, in radii of the sharpest bend."""


class Terms(NamedTuple):
    """Costs of a route, and the steps of the search.

    Attributes:
        radius: of the sharpest bend [m]; wheelbase: [m].
        check: least distance of the poses at which an arc is checked [m]. Where the body has a clearance of
            `open` [m], arcs and cells of the lattice are twice as long.
        reach: of the body from the rear axle [m].
        margin: least clearance; near: closer than this costs more [m].
        ahead, back: cost of a metre forward and in reverse; cusp, steering, closeness: see `RoutePlanner`.
        weight: of the estimate; finer: by this factor the lattice is finer near the ends, within a distance
            of `fine` [m], where the clearance is less than `tight` [m].
        curves: number of those between two poses that are checked, the cheapest first; cheaper: by less [m]
            than this none replaces another route.
    """

    radius: float
    wheelbase: float
    check: float
    open: float
    reach: float
    margin: float
    near: float
    back: float
    cusp: float
    steering: float
    closeness: float
    fine: float
    tight: float
    ahead: float = 1.0
    weight: float = 1.0
    finer: float = 1.0
    curves: int = 4
    cheaper: float = 0.0


class SearchWorkspace(NamedTuple):
    """A body, all that is solid around it, and buffers to compute in.

    Attributes:
        shape, witness: of clearances; compared: (1,) poses that were checked, and shapes near them.
        lengths, turns: (WORDS, PIECES) of the curves between two poses, in radii and signs; order: (WORDS,)
            cost of each; curve: (PIECES, 2) signed lengths [m] and curvatures [1/m] of one of them; best:
            the same of the one that `cheapest_curve` has found.
        target_costs: (MOST_TARGETS,) least costs from a node to the targets of the other tree, and on.
    """

    body: Body
    solid: ShapeGrid
    shape: Out2
    witness: Out1
    compared: IndexOut1
    lengths: Out2
    turns: Out2
    order: Out1
    curve: Out2
    best: Out2
    target_costs: Out1


def workspace_of(body: Body, solid: ShapeGrid) -> SearchWorkspace:
    """Buffers for a body among all that is solid."""
    return SearchWorkspace(
        body=body,
        solid=solid,
        shape=np.empty((max(solid.largest, 2), 2)),
        witness=np.empty(WITNESS),
        compared=np.zeros(1, np.int64),
        lengths=np.empty((WORDS, PIECES)),
        turns=np.empty((WORDS, PIECES)),
        order=np.empty(WORDS),
        curve=np.zeros((PIECES, 2)),
        best=np.zeros((PIECES, 2)),
        target_costs=np.empty(MOST_TARGETS),
    )


@inner
def clear_at(work: SearchWorkspace, x: float, y: float, phi: float, within: float) -> float:
    """Signed distance [m] of the body at a pose to the nearest shape, `within` where none is nearer.

    `work.compared` rises by one, and by the number of shapes that are near. One pose of the kernel of
    `ShapeGrid.signed_distances`, again: to hand the body and the grid from one function to the next takes
    longer than all that is done with them.
    """
    body, grid, least, frame = work.body, work.solid, within, BodyFrame(x, y, cos(phi), sin(phi))
    work.compared[0] += 1
    first_row, last_row, first_column, last_column = cells_around(frame, body, grid, within)
    for row in range(first_row, last_row + 1):
        first_cell, last_cell = row * grid.counts[0] + first_column, row * grid.counts[0] + last_column
        work.compared[0] += grid.begins[last_cell + 1] - grid.begins[first_cell]
        for k in range(grid.begins[first_cell], grid.begins[last_cell + 1]):
            i = grid.members[k]
            ahead, aside = seen_from(frame, grid.circles[i, 0], grid.circles[i, 1])
            if is_off(ahead - body.middle[0], aside - body.middle[1], body.half, least + grid.circles[i, 2]):
                continue
            count = grid.starts[i + 1] - grid.starts[i]
            in_frame(grid.corners, grid.starts[i], count, frame, work.shape)
            for j in range(len(body.starts) - 1):
                piece = body.corners[body.starts[j] : body.starts[j + 1]]
                distance_between(piece, work.shape[:count], least, work.witness)
                least = min(least, work.witness[VALUE])
    return least


@inner
def least_to(pose: Array, target: Array, terms: Terms) -> float:
    """Least cost of a route from a pose (3,) to another one (3,)."""
    c, s = cos(pose[2]), sin(pose[2])
    dx, dy, turn = target[0] - pose[0], target[1] - pose[1], target[2] - pose[2]
    along, across = c * dx + s * dy, c * dy - s * dx
    if terms.ahead > terms.back:  # searched against the direction of driving: forward there is reverse here
        along, turn, metre, other = -along, -turn, terms.back, terms.ahead
    else:
        metre, other = terms.ahead, terms.back
    return least_cost(along, across, turn, terms.radius, other / metre, terms.cusp) * metre


@inner
def steering_of(curvature: float, terms: Terms) -> float:
    """The angle of the wheels [rad]."""
    return atan(terms.wheelbase * curvature)


@inner
def closeness_of(clearance: float, terms: Terms) -> float:
    """Extra cost of a metre at such a clearance."""
    if clearance >= terms.near:
        return 0.0
    return terms.closeness * (terms.near - clearance) / (terms.near - terms.margin + 1e-9)


@inner
def cheapest_curve(
    pose: Array,
    target: Array,
    ends: tuple[float, Array, Array],
    most: float,
    terms: Terms,
    work: SearchWorkspace,
) -> tuple[float, float]:
    """Find the clear curve from a pose (3,) to another one (3,) by which a route is cheapest: `work.best`.

    Args:
        ends: cost of the rest of the route [m], the arc before the curve and, as against time, the one behind
            it: signed length [m], 0 where there is none, and curvature [1/m].

    Returns: the cost of the route without closeness, inf where it is no less than `most`, and what closeness
    adds to that.
    """
    (base, before, behind), cost, closeness = ends, inf, 0.0
    c, s = cos(pose[2]), sin(pose[2])
    dx, dy = target[0] - pose[0], target[1] - pose[1]
    along, across = (c * dx + s * dy) / terms.radius, (c * dy - s * dx) / terms.radius
    count = words(along, across, target[2] - pose[2], work.lengths, work.turns)
    for i in range(count):
        _take_curve(work, i, terms.radius)
        work.order[i] = base + cost_along(work.curve, before, terms)
        work.order[i] += _joint_cost(work.curve, behind, terms)
    for _ in range(min(count, terms.curves)):
        i = int(np.argmin(work.order[:count]))
        if work.order[i] >= most:
            break
        _take_curve(work, i, terms.radius)
        extra = closeness_along(pose, work.curve, most - work.order[i], terms, work)
        if work.order[i] + extra < most:
            cost, closeness = work.order[i], extra
            copy_rows(work.curve, work.best)
            most = cost + closeness - terms.cheaper
        work.order[i] = inf
    return cost, closeness


@inner
def _take_curve(work: SearchWorkspace, i: int, radius: float) -> None:
    """Put the i-th of the curves that `words` found into `work.curve`."""
    for k in range(PIECES):
        length = work.lengths[i, k] * radius
        work.curve[k, 0] = length if abs(length) > NO_LENGTH else 0.0
        work.curve[k, 1] = work.turns[i, k] / radius


@inner
def cost_along(arcs: Array, incoming: Array, terms: Terms) -> float:
    """Cost of a curve without closeness, after an arc (2,) of signed length [m] and curvature [1/m]."""
    cost, before, steering = 0.0, incoming[0], steering_of(incoming[1], terms)
    for k in range(len(arcs)):
        length = arcs[k, 0]
        if length == 0.0:
            continue
        turned = steering_of(arcs[k, 1], terms)
        cost += length * terms.ahead if length > 0.0 else -length * terms.back
        if before != 0.0:
            cost += terms.steering * abs(turned - steering)
            if before * length < 0.0:
                cost += terms.cusp
        before, steering = length, turned
    return cost


@inner
def _joint_cost(arcs: Array, behind: Array, terms: Terms) -> float:
    """Cost to continue a curve with an arc (2,) that is given as against time."""
    if behind[0] == 0.0:
        return 0.0
    for k in range(len(arcs) - 1, -1, -1):
        if arcs[k, 0] != 0.0:
            steering = abs(steering_of(behind[1], terms) - steering_of(arcs[k, 1], terms))
            return terms.steering * steering + (terms.cusp if arcs[k, 0] * behind[0] > 0.0 else 0.0)
    return 0.0


@inner
def closeness_along(start: Array, arcs: Array, most: float, terms: Terms, work: SearchWorkspace) -> float:
    """Cost of a curve from a pose (3,) for being close to something.

    It is inf where the clearance is less than the margin, or where it is more than `most`.
    """
    if _is_blocked(start, arcs, terms, work):
        return inf
    x, y, phi = start[0], start[1], start[2]
    extra, clear = 0.0, 0.0
    for k in range(len(arcs)):
        if arcs[k, 0] == 0.0:
            continue
        sign, left = (1.0, arcs[k, 0]) if arcs[k, 0] > 0.0 else (-1.0, -arcs[k, 0])
        lever = 1.0 + terms.reach * abs(arcs[k, 1])
        while left > NO_LENGTH:
            step = step_to_take(clear, left, lever, terms)
            x, y, phi = pose_after(x, y, phi, sign * step, arcs[k, 1])
            clear = clear_at(work, x, y, phi, terms.open)
            extra += step * closeness_of(clear, terms)
            if clear < terms.margin or extra > most:
                return inf
            left -= step
    return extra


@inner
def step_to_take(clear: float, left: float, lever: float, terms: Terms) -> float:
    """Distance to the next pose to check from one with such a clearance, of what is `left` [m].

    Within it no point of the body, which moves at most `lever` times as far as the rear axle, comes to the
    margin; or it is the least step.
    """
    step: float = max((clear - terms.margin) / lever, terms.check)
    return left if step >= left else min(step, 0.5 * left)


@inner
def _is_blocked(start: Array, arcs: Array, terms: Terms, work: SearchWorkspace) -> bool:
    """Whether a curve is blocked at one of a few poses, from its middle on: most blocked ones are."""
    whole = 0.0
    for k in range(len(arcs)):
        whole += abs(arcs[k, 0])
    for eighths in (4, 2, 6, 1, 3, 5, 7):
        x, y, phi, left = start[0], start[1], start[2], 0.125 * eighths * whole
        for k in range(len(arcs)):
            length = min(max(arcs[k, 0], -left), left)
            if length != 0.0:
                x, y, phi = pose_after(x, y, phi, length, arcs[k, 1])
                left -= abs(length)
        if clear_at(work, x, y, phi, terms.margin) < terms.margin:
            return True
    return False
