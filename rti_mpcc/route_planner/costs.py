"""Cost of a route [m], and a lower bound of it between two poses.

The cost is the length, more in reverse and where the body is close to something, and something for each
change of direction and for each change of the steering. Curves between two poses are Reeds-Shepp words.
"""

from __future__ import annotations

from math import atan, cos, inf, sin
from typing import Final, NamedTuple

import numpy as np

from geometry.arrays import Array
from geometry.compiled import IndexOut1, Out1, Out2, inner
from geometry.convex import WITNESS
from geometry.reeds_shepp import PIECES, WORDS, least_cost, words
from geometry.shape_grid import Body, ShapeGrid, clearance_at
from rti_mpcc.route_planner.arcs import pose_after

NO_LENGTH: Final = 1e-9
"""[m] what is shorter is nothing."""
TARGETS: Final = 3
"""Nodes of the other tree to which curves from a node are tried."""
_PROBES: Final = 7  # poses of a curve at which most that are blocked are found to be


class Terms(NamedTuple):
    """Costs of a route, and the steps of the search.

    Attributes:
        radius: of the sharpest bend [m]; wheelbase: [m].
        arc: length of an arc; check: least distance of the poses at which it is checked; cell: of the lattice
            [m]. Where the body has a clearance of `open` [m], arcs and cells are twice as long.
        reach: of the body from the rear axle [m].
        margin: least clearance; near: closer than this costs more [m].
        ahead, back: cost of a metre forward and in reverse; cusp, steering, closeness: see `RoutePlanner`.
        weight: of the estimate; finer: by this factor the lattice is finer near the ends, within a distance
            of `fine` [m], where the clearance is less than `tight` [m].
    """

    radius: float
    wheelbase: float
    arc: float
    check: float
    cell: float
    open: float
    reach: float
    margin: float
    near: float
    ahead: float
    back: float
    cusp: float
    steering: float
    closeness: float
    weight: float
    finer: float
    fine: float
    tight: float


class SearchWorkspace(NamedTuple):
    """A body, all that is solid around it, and buffers to compute in.

    Attributes:
        shape, witness: of clearances.
        lengths, turns: (WORDS, PIECES) of the curves between two poses, in radii and signs; order: (WORDS,)
            cost of each; curve: (PIECES, 2) signed lengths [m] and curvatures [1/m] of one of them.
        targets, target_costs: (TARGETS,) nodes of the other tree, and the costs of routes through them.
    """

    body: Body
    solid: ShapeGrid
    shape: Out2
    witness: Out1
    lengths: Out2
    turns: Out2
    order: Out1
    curve: Out2
    targets: IndexOut1
    target_costs: Out1


def workspace_of(body: Body, solid: ShapeGrid) -> SearchWorkspace:
    """Buffers for a body among all that is solid."""
    return SearchWorkspace(
        body=body,
        solid=solid,
        shape=np.empty((max(solid.largest, 2), 2)),
        witness=np.empty(WITNESS),
        lengths=np.empty((WORDS, PIECES)),
        turns=np.empty((WORDS, PIECES)),
        order=np.empty(WORDS),
        curve=np.zeros((PIECES, 2)),
        targets=np.empty(TARGETS, np.int64),
        target_costs=np.empty(TARGETS),
    )


@inner
def clear_at(work: SearchWorkspace, x: float, y: float, phi: float, within: float) -> float:
    """Clearance of the body at a pose, `within` where nothing is nearer [m]."""
    return clearance_at(work.body, work.solid, x, y, phi, within, work.shape, work.witness)


@inner
def least_to(x: float, y: float, phi: float, target: Array, terms: Terms) -> float:
    """Least cost of a route from a pose to another one (3,)."""
    c, s = cos(phi), sin(phi)
    dx, dy, turn = target[0] - x, target[1] - y, target[2] - phi
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
def find_curves(x: float, y: float, phi: float, target: Array, terms: Terms, work: SearchWorkspace) -> int:
    """Find the curves from a pose to another one (3,); returns their number."""
    c, s = cos(phi), sin(phi)
    dx, dy = target[0] - x, target[1] - y
    along, across = (c * dx + s * dy) / terms.radius, (c * dy - s * dx) / terms.radius
    return words(along, across, target[2] - phi, work.lengths, work.turns)


@inner
def take_curve(work: SearchWorkspace, i: int, radius: float) -> None:
    """Put the i-th curve that was found into `work.curve`."""
    for k in range(PIECES):
        length = work.lengths[i, k] * radius
        work.curve[k, 0] = length if abs(length) > NO_LENGTH else 0.0
        work.curve[k, 1] = work.turns[i, k] / radius


@inner
def cost_along(arcs: Array, incoming: float, bent: float, terms: Terms) -> float:
    """Cost of a curve without closeness, after an arc of length `incoming` [m] and curvature `bent` [1/m]."""
    cost, before, steering = 0.0, incoming, steering_of(bent, terms)
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
def joint_cost(arcs: Array, onward: float, bent: float, terms: Terms) -> float:
    """Cost to continue a curve with an arc of signed length `onward` [m] and curvature `bent`."""
    if onward == 0.0:
        return 0.0
    for k in range(len(arcs) - 1, -1, -1):
        if arcs[k, 0] != 0.0:
            steering = abs(steering_of(bent, terms) - steering_of(arcs[k, 1], terms))
            return terms.steering * steering + (terms.cusp if arcs[k, 0] * onward < 0.0 else 0.0)
    return 0.0


@inner
def closeness_along(
    x: float, y: float, phi: float, arcs: Array, most: float, terms: Terms, work: SearchWorkspace
) -> tuple[float, int]:
    """Cost of a curve for being close to something, and the number of poses that were checked for it.

    The cost is inf where the clearance is less than the margin, or where it costs more than `most`.
    """
    if _is_blocked(x, y, phi, arcs, terms, work):
        return inf, _PROBES
    extra, clear, checked = 0.0, 0.0, _PROBES
    for k in range(len(arcs)):
        if arcs[k, 0] == 0.0:
            continue
        sign, left = (1.0, arcs[k, 0]) if arcs[k, 0] > 0.0 else (-1.0, -arcs[k, 0])
        lever = 1.0 + terms.reach * abs(arcs[k, 1])
        while left > NO_LENGTH:
            step = step_to_take(clear, left, lever, terms)
            x, y, phi = pose_after(x, y, phi, sign * step, arcs[k, 1])
            clear = clear_at(work, x, y, phi, terms.open)
            checked += 1
            extra += step * closeness_of(clear, terms)
            if clear < terms.margin or extra > most:
                return inf, checked
            left -= step
    return extra, checked


@inner
def step_to_take(clear: float, left: float, lever: float, terms: Terms) -> float:
    """Distance to the next pose to check from one with such a clearance, of what is `left` [m].

    Within it no point of the body, which moves at most `lever` times as far as the rear axle, comes to the
    margin; or it is the least step.
    """
    step: float = max((clear - terms.margin) / lever, terms.check)
    return left if step >= left else min(step, 0.5 * left)


@inner
def _is_blocked(x: float, y: float, phi: float, arcs: Array, terms: Terms, work: SearchWorkspace) -> bool:
    """Whether a curve is blocked at one of a few poses, from its middle on: most blocked ones are."""
    whole = 0.0
    for k in range(len(arcs)):
        whole += abs(arcs[k, 0])
    for eighths in (4, 2, 6, 1, 3, 5, 7):
        at_x, at_y, at_phi, left = x, y, phi, 0.125 * eighths * whole
        for k in range(len(arcs)):
            length = min(max(arcs[k, 0], -left), left)
            if length != 0.0:
                at_x, at_y, at_phi = pose_after(at_x, at_y, at_phi, length, arcs[k, 1])
                left -= abs(length)
        if clear_at(work, at_x, at_y, at_phi, terms.margin) < terms.margin:
            return True
    return False
