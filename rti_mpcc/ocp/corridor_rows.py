"""Half-plane rows that keep every piece of the body inside the corridor.

With rho the signed distance of a piece to a side, n the normal from there to the nearest point of the piece,
and p that point from the rear axle, all in the frame of the states (geometry.contacts),

(H1)  rho >= margin
(H2)  n_x dx + n_y dy + (p_x n_y - p_y n_x) dphi + slack >= margin - rho

Between two sides that face each other the margin is at most what they leave to the body as it stands at that
stage, less a strip to steer in, but no less than the body's hard minimum, where a thin strip is left to it:

(H8)  margin' = max(min(margin, room - STRIP), min(d_min, room - THIN)),    room = (rho + rho')/2

over all pieces. A slack that nothing can make smaller would cost by the time spent in it: the narrower the
lane, the more it would pay to hurry. Neither side's multiplier would be known, and the QP takes a thousand
iterations.

Between two stages a body that passes a corner aslant can come nearer to it with a corner of its own than it
is at either of them, by a centimetre where they are 0.2 m apart. How much of that the QP is told would change
from cycle to cycle, as stages move on. So where corners pass each other the way between stages counts, too.
"""

from __future__ import annotations

from math import cos, hypot, inf, radians, sin, sqrt, tan
from typing import NamedTuple

import numpy as np

from geometry.compiled import Array1, Array2, Array3, Array4, Index1, Out1, Out3, Out4, kernel
from geometry.contacts import ACROSS, ALONG, APART, AT_X, AT_Y
from geometry.free_space import FreeSpace, contacts_in
from geometry.shape_grid import Body
from rti_mpcc.model.layout import DELTA, PHI, POSE, V, X, Y
from rti_mpcc.ocp.horizon import states_at
from rti_mpcc.ocp.side_clearance import OUTWARD, between
from rti_mpcc.types import Array, Trajectory

NEAR = 1.0
"""What is farther from a piece of the body than the margin and this acts on it in no way [m]."""
CORNER = radians(18.0)
"""Where a half-plane turns by more than this between two stages a corner is passed [rad]."""
BETWEEN = 7
"""So many poses on the way there are looked at, too."""
_SHARES = np.arange(1, BETWEEN + 1) / (BETWEEN + 1)
LOOSE = -100.0
"""Lower bound of a row that must not act [m]; finite, so that the solver keeps its factorisation. Its slopes
are 0 besides: a row that never binds still drags on the solver's steps."""
STRIP = 0.03
"""Left to either side to steer in, of what is between two walls [m]: rows that all bind say the same."""
THIN = 0.01
"""The same where d_min gives way [m]; whether a motion keeps the least clearance says the exact check."""
MARGIN_TIME = 1.5
"""T, so long the plan may take to give back the corridor's margin [s], (H4). Over 3 s or 5 s the vehicle came
nearer to walls, and steered harder all the same (docs/decisions, 9)."""
MARGIN_DISTANCE = 3.5
"""S, over which it is given back, as far as the room that the trailing end needs for that goes [m]."""
BOUNDARY_DISTANCE = 10.0
"""W, over which a body that is over a boundary is brought back, once it has turned [m]."""
MEASURED = DELTA + 1
"""Of a state all but its progress is measured: x, y, phi, v, delta."""


class CorridorRows(NamedTuple):
    """Slopes (N, pieces, sides, 3) to x, y, phi of stages 1..N, lower bounds (N, pieces, sides) of (H2)."""

    slopes: Out4
    lower: Out3


class Deficit(NamedTuple):
    """What the vehicle lacks of the corridor and its margin.

    Attributes:
        margin: [m]; missing: (n, pieces, sides) of stages 1..n, see `margin_deficit` [m].
        most: (sides,) that a plan may leave of it at most [m]: it is not to come nearer than may be driven.
        over: (sides,) what the vehicle lacks beyond the margin [m].
    """

    margin: float
    missing: Out3
    most: Out1
    over: Out1


class Trailing(NamedTuple):
    """How far (pieces,) each piece reaches behind the rear axle, or 0, and the body's end [m]."""

    pieces: Out1
    body: float


NO_ROWS = CorridorRows(np.empty((0, 0, 0, POSE)), np.empty((0, 0, 0)))
"""Where none acts."""


def stage_contacts(space: FreeSpace, body: Body, plan: Trajectory, margin: float, wheelbase: float) -> Array:
    """Contacts (N, pieces, sides, 5) of the body at stages 1..N of a plan, or nearer ones on the way there.

    Normals and points are in the frame of the body at the stage.

    Args:
        space: around the part of the route that is driven.
        margin: distance that is kept [m]; wheelbase: [m].
    """
    states, within = plan.states, margin + NEAR
    found = contacts_in(space, body, states[1:, :POSE].copy(), within, OUTWARD)
    stages = np.flatnonzero(_passes_corner(found, states, margin))
    if not len(stages):
        return found
    begins, ends = plan.times[stages, None], plan.times[stages + 1, None]
    passed = (begins + (ends - begins) * _SHARES).ravel()
    on_way = states_at(plan, passed, wheelbase)
    more = contacts_in(space, body, on_way[:, :POSE].copy(), within, OUTWARD)
    return _nearer(found, states, more, on_way, stages, wheelbase)


@kernel
def _passes_corner(contacts: Array4, states: Array2, margin: float) -> Out1:
    """Whether, 1 or 0, a normal turns over each interval (N,), and the margin may be missed; the first one
    does not count."""
    passes, alike = np.zeros(len(contacts)), cos(CORNER)
    for k in range(1, len(contacts)):
        way = hypot(states[k + 1, X] - states[k, X], states[k + 1, Y] - states[k, Y])
        turned = states[k + 1, PHI] - states[k, PHI]
        c, s = cos(turned), sin(turned)
        for piece in range(contacts.shape[1]):
            for side in range(contacts.shape[2]):
                begin, end = contacts[k - 1, piece, side], contacts[k, piece, side]
                arm = max(hypot(begin[AT_X], begin[AT_Y]), hypot(end[AT_X], end[AT_Y]))
                # No point of the piece moves farther than that: so near may it come in the meantime.
                least = 0.5 * (begin[APART] + end[APART] - way - arm * abs(turned))
                along = c * end[ALONG] - s * end[ACROSS]
                across = s * end[ALONG] + c * end[ACROSS]
                if least < margin and begin[ALONG] * along + begin[ACROSS] * across < alike:
                    passes[k] = 1.0
    return passes


@kernel
def _nearer(
    contacts: Array4, states: Array2, more: Array4, on_way: Array2, stages: Index1, wheelbase: float
) -> Out4:
    """Of each interval the nearest contact, as seen from the body at its end."""
    values, each = contacts.copy(), len(on_way) // len(stages)
    for i in range(len(on_way)):
        k = stages[i // each]
        turned = on_way[i, PHI] - states[k + 1, PHI]
        c, s = cos(turned), sin(turned)
        curvature = tan(on_way[i, DELTA]) / wheelbase
        spacing = hypot(states[k + 1, X] - states[k, X], states[k + 1, Y] - states[k, Y]) / (each + 1)
        for piece in range(values.shape[1]):
            for side in range(values.shape[2]):
                found, nearer = values[k, piece, side], more[i, piece, side]
                if nearer[APART] >= found[APART]:
                    continue
                # Of the way of the point: at its nearest it moves at right angles to the normal.
                ahead, aside = 1.0 - curvature * nearer[AT_Y], curvature * nearer[AT_X]
                way = hypot(ahead, aside)
                along = nearer[APART] * (nearer[ALONG] * ahead + nearer[ACROSS] * aside) / way
                apart, normal_x, normal_y = nearer[APART], nearer[ALONG], nearer[ACROSS]
                if 0.0 < abs(along) < min(apart, way * spacing):
                    apart = sqrt(apart * apart - along * along)
                    normal_x = (nearer[APART] * nearer[ALONG] - along * ahead / way) / apart
                    normal_y = (nearer[APART] * nearer[ACROSS] - along * aside / way) / apart
                found[APART] = apart
                found[ALONG] = c * normal_x - s * normal_y
                found[ACROSS] = s * normal_x + c * normal_y
                found[AT_X] = c * nearer[AT_X] - s * nearer[AT_Y]
                found[AT_Y] = s * nearer[AT_X] + c * nearer[AT_Y]
    return values


def corridor_rows(
    headings: Array, contacts: Array, margin: float, least: float = inf, near: float = NEAR
) -> CorridorRows | None:
    """Rows (H2) of N stages with these `headings` (N,) [rad]; None if none acts.

    Args:
        contacts: (N, pieces, sides, 5), see geometry.contacts.
        margin: [m]; least: d_min of (H8) [m], inf: the margin is kept whatever is left.
        near: rows act on what is nearer than the margin and this [m].
    """
    shape = contacts.shape[:3]
    rows = CorridorRows(np.zeros((*shape, POSE)), np.full(shape, LOOSE))
    return rows if _corridor_rows(headings, contacts, margin, near, least, rows) else None


@kernel
def _corridor_rows(
    headings: Array1, contacts: Array4, margin: float, near: float, least: float, rows: CorridorRows
) -> bool:
    """Equations (H2), (H8). Returns whether any row acts."""
    acting, (slopes, lower) = False, rows
    stages, pieces, sides = lower.shape
    for k in range(stages):
        c, s = cos(headings[k]), sin(headings[k])
        for side in range(sides):
            room = between(contacts, k, side)
            floor = min(least, room - THIN) if least < inf else margin
            kept = min(margin, max(room - STRIP, floor))
            for piece in range(pieces):
                apart = contacts[k, piece, side, APART]
                if apart >= margin + near:
                    continue
                acting = True
                along, across = contacts[k, piece, side, ALONG], contacts[k, piece, side, ACROSS]
                slopes[k, piece, side, X] = c * along - s * across
                slopes[k, piece, side, Y] = s * along + c * across
                slopes[k, piece, side, PHI] = (
                    contacts[k, piece, side, AT_X] * across - contacts[k, piece, side, AT_Y] * along
                )
                lower[k, piece, side] = kept - apart
    return acting


@kernel
def free_response(states: Array2, lengths: Array1, wheelbase: float) -> Out3:
    """How x, y, phi of the first n stages follow what the plan begins with, its controls kept: (n, 3, 5).

    (H5)  dphi_k = dphi + s_k ddelta (1 + tan²delta)/L
          d(x, y)_k = d(x, y) + t_k dv (cos phi_k, sin phi_k)
                      + (s_k dphi + s_k²/2 ddelta (1 + tan²delta)/L) (-sin phi_k, cos phi_k)

    with s_k the way driven by then, negative in reverse, and delta the steering that the plan begins with.
    The n stages are those that end within `MARGIN_TIME`, and the first one whenever it ends.

    Args:
        states: (N+1, 6); lengths: (N,) of the stages [s]; wheelbase: L [m].
    """
    stages = max(int((np.cumsum(lengths) < MARGIN_TIME).sum()), 1)
    by = np.zeros((stages, POSE, MEASURED))
    per_way = (1.0 + tan(states[0, DELTA]) ** 2) / wheelbase
    elapsed, travelled = 0.0, 0.0
    for k in range(stages):
        elapsed += lengths[k]
        travelled += lengths[k] * states[k, V]
        c, s = cos(states[k + 1, PHI]), sin(states[k + 1, PHI])
        turn = travelled * per_way
        aside = 0.5 * travelled * turn
        by[k, X, X] = by[k, Y, Y] = by[k, PHI, PHI] = 1.0
        by[k, X, V], by[k, Y, V] = elapsed * c, elapsed * s
        by[k, X, PHI], by[k, Y, PHI] = -travelled * s, travelled * c
        by[k, X, DELTA], by[k, Y, DELTA], by[k, PHI, DELTA] = -aside * s, aside * c, turn
    return by


@kernel
def margin_deficit(rows: CorridorRows, drift: Array3, change: Array1) -> Out3:
    """What of the corridor and its margin is missing at the first n stages (n, pieces, sides) [m]: m of (H4).

    Args:
        drift: (n, 3, 5) of the plan linearised about, see `free_response`.
        change: (5,) in x, y, phi, v, delta that the plan begins with beside it.
    """
    slopes, lower = rows
    missing, moved = np.empty((len(drift), lower.shape[1], lower.shape[2])), np.empty(POSE)
    for k in range(len(drift)):
        for i in range(POSE):
            moved[i] = 0.0
            for j in range(MEASURED):
                moved[i] += drift[k, i, j] * change[j]
        for piece in range(lower.shape[1]):
            for side in range(lower.shape[2]):
                lack = lower[k, piece, side]
                for i in range(POSE):
                    lack -= slopes[k, piece, side, i] * moved[i]
                missing[k, piece, side] = max(lack, 0.0)
    return missing


@kernel
def relaxed_bounds(
    lower: Array3, deficit: Deficit, elapsed: Array1, travelled: Array1, trails: Trailing, noise: float
) -> Out3:
    """Lower bounds (N, pieces, sides) that give back step by step what is missing (docs/decisions, 9).

    Steering turned at a rate moves the vehicle aside with the cube of time; so much is asked back, and of a
    slow vehicle with the cube of its way. To get a piece aside by m over the way S the body turns by 3m/2S,
    and what trails it by l swings out by l times that. A boundary that the vehicle is `over` is taken to be
    where the vehicle has it now, and to come back from there as the vehicle drives.

    (H4)  lower - r - (1 - (s - 2 far) / W) (over + min(over, margin - r)),
          r_i = min(most, max(1 - (t / T)³, 1 - (s / S)³) m_i
                            + (1 - (s / (S + 2 l_i))³) max over pieces j of 3 w_ij / 2S),
          w_ij = max(0, l_i - l_j) max m_j,   w_ii = l_i max(0, max m_i - noise),
          m = missing = min(margin, max(0, lower - slopes d_k)), (H5)

    T, S and W being `MARGIN_TIME`, `MARGIN_DISTANCE` and `BOUNDARY_DISTANCE`, each share
    0 to 1, m_i beyond the stages that it is known for that of the last of them, and max m_j the most that is
    missing of that side at piece j at any stage.

    Args:
        lower: (N, pieces, sides) of the rows; deficit: with r at most.
        elapsed: (N,) time t of stages 1..N [s].
        travelled: (N,) distance s driven by then [m]; trails: l of the pieces, far of the body.
        noise: so much may seem to be missing [m].
    """
    (margin, missing, most, over), (trailing, far) = deficit, trails
    bounds = np.empty(lower.shape)
    stages, pieces, sides = lower.shape
    last = len(missing) - 1
    for side in range(sides):
        for piece in range(pieces):
            swing = 0.0
            for other in range(pieces):
                behind = trailing[piece] if other == piece else max(trailing[piece] - trailing[other], 0.0)
                for k in range(last + 1):
                    lack = min(missing[k, other, side], margin) - (noise if other == piece else 0.0)
                    swing = max(swing, 1.5 * behind / MARGIN_DISTANCE * lack)
            for k in range(stages):
                lack = min(missing[min(k, last), piece, side], margin)
                returned = min(elapsed[k] / MARGIN_TIME, travelled[k] / MARGIN_DISTANCE, 1.0)
                swung_back = min(travelled[k] / (MARGIN_DISTANCE + 2.0 * trailing[piece]), 1.0)
                relief = (1.0 - returned**3) * lack + (1.0 - swung_back**3) * swing
                relief = min(relief, most[side])
                if over[side] > 0.0:
                    left = 1.0 - (travelled[k] - 2.0 * far) / BOUNDARY_DISTANCE
                    beyond = over[side] + min(over[side], margin - relief)
                    relief += min(max(left, 0.0), 1.0) * beyond
                bounds[k, piece, side] = lower[k, piece, side] - relief
    return bounds
