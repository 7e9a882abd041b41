"""Where the pieces of the body are nearest to what stands, at the stages of a plan and on the way to them.

Between two stages a body that passes a corner aslant can come nearer to it with a corner of its own than it
is at either of them, by a centimetre where they are 0.2 m apart. How much of that the QP is told would change
from cycle to cycle, as stages move on. So where corners pass each other the way between stages counts, too.
"""

from __future__ import annotations

from math import cos, hypot, radians, sin, sqrt, tan

import numpy as np

from geometry.compiled import Array2, Array4, Index1, Out1, Out4, kernel
from geometry.contacts import ACROSS, ALONG, APART, AT_X, AT_Y
from geometry.free_space import FreeSpace, contacts_in
from geometry.shape_grid import Body
from rti_mpcc.model.layout import DELTA, PHI, POSE, X, Y
from rti_mpcc.ocp.horizon import PlanArrays, interpolated
from rti_mpcc.ocp.side_clearance import OUTWARD
from rti_mpcc.types import Array

NEAR = 1.0
"""What is farther from a piece of the body than the margin and this acts on it in no way [m]."""
CORNER = radians(18.0)
"""Where a half-plane turns by more than this between two stages a corner is passed [rad]."""
BETWEEN = 7
"""So many poses on the way there are looked at, too."""
_SHARES = np.arange(1, BETWEEN + 1) / (BETWEEN + 1)


def stage_contacts(space: FreeSpace, body: Body, plan: PlanArrays, margin: float, wheelbase: float) -> Array:
    """Contacts (N, pieces, sides, 5) of the body at stages 1..N of a plan, or nearer ones on the way there.

    Normals and points are in the frame of the body at the stage.

    Args:
        space: around the part of the route that is driven.
        margin: distance that is kept [m]; wheelbase: [m].
    """
    (times, states, controls), within = plan, margin + NEAR
    found = contacts_in(space, body, states[1:, :POSE].copy(), within, OUTWARD)
    stages = np.flatnonzero(_passes_corner(found, states, margin))
    if not len(stages):
        return found
    begins, ends = times[stages, None], times[stages + 1, None]
    passed = (begins + (ends - begins) * _SHARES).ravel()
    between = interpolated(times, states, controls, passed, wheelbase)
    more = contacts_in(space, body, between[:, :POSE].copy(), within, OUTWARD)
    return _nearer(found, states, more, between, stages, wheelbase)


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
    contacts: Array4, states: Array2, more: Array4, between: Array2, stages: Index1, wheelbase: float
) -> Out4:
    """Of each interval the nearest contact, as seen from the body at its end."""
    values, each = contacts.copy(), len(between) // len(stages)
    for i in range(len(between)):
        k = stages[i // each]
        turned = between[i, PHI] - states[k + 1, PHI]
        c, s = cos(turned), sin(turned)
        curvature = tan(between[i, DELTA]) / wheelbase
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
