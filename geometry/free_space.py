"""What keeps a body where it may be, on one part of a route, and the questions that are asked of it.

Corridors, areas and maps build a `FreeSpace`; rows of the QP, checks of plans and figures of rides ask it.
Numbers are not checked here: `Corridor` does so for its users.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from geometry.arrays import Array
from geometry.contacts import CONTACT, line_contacts, no_contacts
from geometry.flanks import FLANKS, flank_contacts
from geometry.shape_grid import Body, ShapeGrid, beyond_lines, signed_distances_to


class FreeSpace(NamedTuple):
    """What is solid around one part of a route.

    Attributes:
        boundary: the lines beside the part, or all that is solid in an area, of one owner.
        smooth: the lines with fewer segments, left and right, for half-planes.
        obstacles: each is an owner.
        behind: a point farther than this beyond the lines is on another way [m].
        sides: number of sides of `contacts_in`; FLANKS in an area.
    """

    boundary: ShapeGrid
    smooth: ShapeGrid
    obstacles: ShapeGrid
    behind: float
    sides: int


def contacts_in(space: FreeSpace, body: Body, poses: Array, within: float, outward: float) -> Array:
    """Return contacts (n, pieces, sides, 5) of a body at `poses` (n, 3), see `Corridor.contacts`."""
    if space.sides == FLANKS:
        grids = space.boundary, space.obstacles
        return flank_contacts(body, poses, *grids, within=within, outward=outward)
    pieces, owners = body.pieces, space.smooth.owners
    slots = no_contacts(len(poses), pieces * owners)
    line_contacts(body, poses, space.smooth, within, outward, slots)
    found = slots.reshape(len(poses), pieces, owners, CONTACT)
    if not space.obstacles.owners:
        return found
    nearest = flank_contacts(body, poses, space.obstacles, within=within, outward=outward, sides=1)
    return np.concatenate((found, nearest), axis=2)


def distances_in(space: FreeSpace, body: Body, poses: Array, within: float) -> Array:
    """Return signed distances (n, 1 + k) [m] of a body at `poses` (n, 3), see `Corridor.signed_distances`."""
    apart = np.empty((len(poses), 1))
    signed_distances_to(space.boundary, body, poses, within, apart)
    if not space.obstacles.owners:
        return apart
    others = np.empty((len(poses), space.obstacles.owners))
    signed_distances_to(space.obstacles, body, poses, within, others)
    return np.concatenate((apart, others), axis=1)


def clearances_in(space: FreeSpace, body: Body, poses: Array, within: float) -> Array:
    """Return the same, negative as well where the body's origin is beyond a boundary."""
    apart = distances_in(space, body, poses, within)
    if space.sides != FLANKS:
        depths = np.zeros(len(poses))
        beyond_lines(space.boundary, poses, space.behind, depths)
        deeper = depths > 0.0
        apart[deeper, 0] = np.minimum(apart[deeper, 0], -depths[deeper])
    return apart
