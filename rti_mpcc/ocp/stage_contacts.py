"""Where the pieces of the body are nearest to what stands, at the stages of a plan and on the way to them.

Between two stages a body that passes a corner aslant can come nearer to it with a corner of its own than it
is at either of them, by a centimetre where they are 0.2 m apart. How much of that the QP is told would change
from cycle to cycle, as stages move on. So where corners pass each other the way between stages counts, too.
"""

from __future__ import annotations

from math import cos

import numpy as np

from geometry import Corridor
from geometry.contacts import ALONG, APART, AT_X, Contacts
from geometry.shape_grid import Body
from rti_mpcc.config import Footprint
from rti_mpcc.model.layout import PHI, POSE, X, Y
from rti_mpcc.ocp.horizon import states_at
from rti_mpcc.types import Array, Index, Trajectory


def stage_contacts(
    corridor: Corridor, index: int, body: Body, plan: Trajectory, footprint: Footprint, wheelbase: float
) -> Contacts:
    """Contacts of the body at stages 1..N of a plan, or those on the way there that are nearer.

    Normals and points are in the frame of the body at the stage.

    Args:
        index: of the part of the route whose boundaries act; wheelbase: [m].
    """
    within = footprint.margin + footprint.near
    found = corridor.contacts(index, body, plan.states[1:, :POSE], within=within, outward=footprint.outward)
    stages = _passing(found, plan.states, footprint)
    if not stages.size:
        return found
    shares = np.arange(1, footprint.between + 1) / (footprint.between + 1)
    begins, lengths = plan.times[stages, None], np.diff(plan.times)[stages, None]
    between = states_at(plan, (begins + lengths * shares).ravel(), wheelbase)
    more = corridor.contacts(index, body, between[:, :POSE], within=within, outward=footprint.outward)
    turned = between[:, PHI].reshape(len(stages), -1) - plan.states[stages + 1, PHI, None]
    every = np.concatenate((found.values[stages, None], _in_frames(more, turned)), axis=1)
    nearest = every[..., APART].argmin(axis=1)[:, None, ..., None]
    values = found.values.copy()
    values[stages] = np.take_along_axis(every, nearest, axis=1)[:, 0]
    return Contacts(values=values)


def _passing(found: Contacts, states: Array, footprint: Footprint) -> Index:
    """The intervals (m,), from the second on, over which a normal turns, and the margin may be missed."""
    way = np.hypot(np.diff(states[1:, X]), np.diff(states[1:, Y]))[:, None, None]
    near = np.minimum(found.apart[:-1], found.apart[1:]) <= footprint.margin + way
    normals = found.normal * np.exp(1j * states[1:, PHI])[:, None, None]
    turns = (normals[:-1].conj() * normals[1:]).real < cos(footprint.corner)
    seen = np.maximum(found.apart[:-1], found.apart[1:]) < np.inf
    return 1 + np.flatnonzero((near & turns & seen).any(axis=(1, 2)))


def _in_frames(found: Contacts, turned: Array) -> Array:
    """Contacts (m, shares, pieces, sides, 5) as seen from bodies turned by so much less (m, shares) [rad]."""
    values = found.values.reshape(*turned.shape, *found.values.shape[1:]).copy()
    c, s = np.cos(turned)[..., None, None], np.sin(turned)[..., None, None]
    for along in (ALONG, AT_X):
        ahead, aside = values[..., along].copy(), values[..., along + 1].copy()
        values[..., along], values[..., along + 1] = c * ahead - s * aside, s * ahead + c * aside
    return values
