"""What keeps a body where it may be, on one part of a route, and the questions that kernels ask of it.

Corridors, areas and maps build a `FreeSpace`; rows of the QP, checks of plans and figures of rides ask it.
"""

from __future__ import annotations

from math import inf
from typing import NamedTuple

import numpy as np

from geometry.compiled import Array2, Out2, Out4, kernel
from geometry.contacts import APART, CONTACT, line_contacts
from geometry.flanks import FLANKS, solid_contacts
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


@kernel
def contacts_in(space: FreeSpace, body: Body, poses: Array2, within: float, outward: float) -> Out4:
    """Return contacts (n, pieces, sides, 5) of a body at `poses` (n, 3), see `Corridor.contacts`."""
    pieces, obstacles = len(body.starts) - 1, space.sides - 2
    found = np.zeros((len(poses), pieces, space.sides, CONTACT))
    found[:, :, :, APART] = inf
    if space.sides == FLANKS:
        solid_contacts(body, poses, space.boundary, within, outward, found)
        solid_contacts(body, poses, space.obstacles, within, outward, found)
        return found
    slots = np.zeros((len(poses), pieces * 2, CONTACT))
    slots[:, :, APART] = inf
    line_contacts(body, poses, space.smooth, within, outward, slots)
    found[:, :, :2] = slots.reshape(len(poses), pieces, 2, CONTACT)
    if obstacles > 0:
        nearest = found[:, :, 2:].copy()
        solid_contacts(body, poses, space.obstacles, within, outward, nearest)
        found[:, :, 2:] = nearest
    return found


@kernel
def distances_in(space: FreeSpace, body: Body, poses: Array2, within: float) -> Out2:
    """Return signed distances (n, 1 + k) [m] of a body at `poses` (n, 3), see `Corridor.signed_distances`."""
    apart, found = np.empty((len(poses), 1 + space.obstacles.owners)), np.empty((len(poses), 1))
    signed_distances_to(space.boundary, body, poses, within, found)
    apart[:, :1] = found
    if space.obstacles.owners > 0:
        others = np.empty((len(poses), space.obstacles.owners))
        signed_distances_to(space.obstacles, body, poses, within, others)
        apart[:, 1:] = others
    return apart


@kernel
def clearances_in(space: FreeSpace, body: Body, poses: Array2, within: float) -> Out2:
    """Return the same, negative as well where the body's origin is beyond a boundary."""
    apart, depths = distances_in(space, body, poses, within), np.zeros(len(poses))
    if space.sides != FLANKS:
        beyond_lines(space.boundary, poses, space.behind, depths)
    for n in range(len(poses)):
        if depths[n] > 0.0:
            apart[n, 0] = min(apart[n, 0], -depths[n])
    return apart
