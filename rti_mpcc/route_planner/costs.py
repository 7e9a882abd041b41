"""What a way costs, in metres, and what the one from a pose to another costs at least.

The cost is the length, more in reverse and where the body is close to something, and something for each
change of direction and for each change of the steering. Curves between two poses are Reeds-Shepp words.
"""

from __future__ import annotations

from math import atan, cos, inf, sin
from typing import Final, NamedTuple

import numpy as np

from geometry.arrays import Array
from geometry.compiled import Out1, Out2, inner, record
from geometry.convex import WITNESS
from geometry.reeds_shepp import PIECES, WORDS, least_cost, words
from geometry.shape_grid import BodyShape, SolidShapes, clearance_at
from rti_mpcc.route_planner.arcs import after

NO_LENGTH: Final = 1e-9
"""[m] what is shorter is nothing."""
_LOOKS: Final = 7  # poses of a curve at which most that are blocked are found to be


@record
class Terms(NamedTuple):
    """What a way costs, and how it is searched.

    Attributes:
        radius: of the sharpest bend [m]; wheelbase: [m].
        arc: length of an arc; check: least distance of the poses at which it is checked; cell: of the lattice
            [m]. Where the body has `open` [m] beside it, arcs and cells are twice as long.
        reach: of the body from the rear axle [m].
        margin: that the body keeps at least; near: closer than this costs more [m].
        ahead, back: cost of a metre forward and in reverse; cusp, steering, closeness: see `RoutePlanner`.
        weight: of the estimate; finer: by this factor the lattice is finer near the ends, within a distance
            of `fine` [m], where the body has less than `tight` [m] beside it.
        more: after a first way so many times the nodes until then are expanded for a better one.
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
    more: float


@record
class Around(NamedTuple):
    """A body and all that is solid around it; shape, witness: room to compute how far they are apart."""

    body: BodyShape
    solid: SolidShapes
    shape: Out2
    witness: Out1


@record
class Curves(NamedTuple):
    """Room for the curves between two poses.

    Attributes:
        lengths, turns: (WORDS, PIECES) of their pieces, in radii and signs; order: (WORDS,) what each costs.
        curve: (PIECES, 2) signed lengths [m] and curvatures [1/m] of one of them.
    """

    lengths: Out2
    turns: Out2
    order: Out1
    curve: Out2


def around_of(body: BodyShape, solid: SolidShapes) -> Around:
    """A body and what is solid, with room to compute."""
    shape = np.empty((max(solid.largest, 2), 2))
    return Around(body=body, solid=solid, shape=shape, witness=np.empty(WITNESS))


def room_for_curves() -> Curves:
    """Room for the curves between any two poses."""
    return Curves(
        lengths=np.empty((WORDS, PIECES)),
        turns=np.empty((WORDS, PIECES)),
        order=np.empty(WORDS),
        curve=np.zeros((PIECES, 2)),
    )


@inner
def clear_at(around: Around, x: float, y: float, phi: float, within: float) -> float:
    """Clearance of the body at a pose, `within` where nothing is nearer [m]."""
    return clearance_at(around.body, around.solid, x, y, phi, within, around.shape, around.witness)


@inner
def least_between(at: Array, target: Array, terms: Terms) -> float:
    """What a way from one pose (3,) to another costs at least."""
    return least_to(at[0], at[1], at[2], target, terms)


@inner
def least_to(x: float, y: float, phi: float, target: Array, terms: Terms) -> float:
    """What a way from a pose to another one (3,) costs at least."""
    c, s = cos(phi), sin(phi)
    dx, dy, turn = target[0] - x, target[1] - y, target[2] - phi
    along, across = c * dx + s * dy, c * dy - s * dx
    if terms.ahead > terms.back:  # searched against the way it will be driven: forward there is reverse here
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
def curves_between(x: float, y: float, phi: float, target: Array, terms: Terms, curves: Curves) -> int:
    """Find the curves from a pose to another one (3,); returns how many."""
    c, s = cos(phi), sin(phi)
    dx, dy = target[0] - x, target[1] - y
    along, across = (c * dx + s * dy) / terms.radius, (c * dy - s * dx) / terms.radius
    return words(along, across, target[2] - phi, curves.lengths, curves.turns)


@inner
def take_curve(curves: Curves, i: int, radius: float) -> None:
    """Make the i-th curve that was found the one that is looked at."""
    for k in range(PIECES):
        length = curves.lengths[i, k] * radius
        curves.curve[k, 0] = length if abs(length) > NO_LENGTH else 0.0
        curves.curve[k, 1] = curves.turns[i, k] / radius


@inner
def cost_along(pieces: Array, came: float, bent: float, terms: Terms) -> float:
    """Cost of a curve, after a piece of signed length `came` [m] and curvature `bent` [1/m], but for how
    close it is to anything."""
    cost, before, steering = 0.0, came, steering_of(bent, terms)
    for k in range(len(pieces)):
        length = pieces[k, 0]
        if length == 0.0:
            continue
        turned = steering_of(pieces[k, 1], terms)
        cost += length * terms.ahead if length > 0.0 else -length * terms.back
        if before != 0.0:
            cost += terms.steering * abs(turned - steering)
            if before * length < 0.0:
                cost += terms.cusp
        before, steering = length, turned
    return cost


@inner
def joint_cost(pieces: Array, onward: float, bent: float, terms: Terms) -> float:
    """What it costs to go on from a curve with a piece of signed length `onward` [m] and curvature `bent`."""
    if onward == 0.0:
        return 0.0
    for k in range(len(pieces) - 1, -1, -1):
        if pieces[k, 0] != 0.0:
            steering = abs(steering_of(bent, terms) - steering_of(pieces[k, 1], terms))
            return terms.steering * steering + (terms.cusp if pieces[k, 0] * onward < 0.0 else 0.0)
    return 0.0


@inner
def closeness_along(
    x: float, y: float, phi: float, pieces: Array, most: float, terms: Terms, around: Around
) -> tuple[float, int]:
    """What a curve costs for being close to something, and the number of poses that were looked at for that.

    The cost is inf where it is closer than the margin, or where it costs more than `most`.
    """
    if _is_blocked(x, y, phi, pieces, terms, around):
        return inf, _LOOKS
    extra, clear, looks = 0.0, 0.0, _LOOKS
    for k in range(len(pieces)):
        if pieces[k, 0] == 0.0:
            continue
        sign, left = (1.0, pieces[k, 0]) if pieces[k, 0] > 0.0 else (-1.0, -pieces[k, 0])
        lever = 1.0 + terms.reach * abs(pieces[k, 1])
        while left > NO_LENGTH:
            step = step_to_take(clear, left, lever, terms)
            x, y, phi = after(x, y, phi, sign * step, pieces[k, 1])
            clear = clear_at(around, x, y, phi, terms.open)
            looks += 1
            extra += step * closeness_of(clear, terms)
            if clear < terms.margin or extra > most:
                return inf, looks
            left -= step
    return extra, looks


@inner
def step_to_take(clear: float, left: float, lever: float, terms: Terms) -> float:
    """How far to go on from such a clearance before it is looked at again [m], of what is left [m].

    So far no point of the body, which moves `lever` times as far as the rear axle at most, comes to the
    margin; or it is the least step.
    """
    step: float = max((clear - terms.margin) / lever, terms.check)
    return left if step >= left else min(step, 0.5 * left)


@inner
def _is_blocked(x: float, y: float, phi: float, pieces: Array, terms: Terms, around: Around) -> bool:
    """Whether a curve is blocked at one of a few poses, from its middle on: soon known of most that are."""
    whole = 0.0
    for k in range(len(pieces)):
        whole += abs(pieces[k, 0])
    for eighths in (4, 2, 6, 1, 3, 5, 7):
        at_x, at_y, at_phi, left = x, y, phi, 0.125 * eighths * whole
        for k in range(len(pieces)):
            length = min(max(pieces[k, 0], -left), left)
            if length != 0.0:
                at_x, at_y, at_phi = after(at_x, at_y, at_phi, length, pieces[k, 1])
                left -= abs(length)
        if clear_at(around, at_x, at_y, at_phi, terms.margin) < terms.margin:
            return True
    return False
