"""What keeps a body where it may be, on one part of a route, and the questions that are asked of it.

Corridors, areas and maps build a `FreeSpace`; rows of the QP, checks of plans and figures of rides ask it.
Numbers are not checked here.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from geometry.arrays import Array
from geometry.contacts import FLANKS, line_contacts, no_contacts, solid_contacts
from geometry.shape_grid import Body, ShapeGrid, beyond_lines, signed_distances_to


class FreeSpace(NamedTuple):
    """What is solid around one part of a route.

    Attributes:
        boundary: the lines beside the part, or all that is solid in an area, of one owner.
        smooth: the lines with fewer segments, left and right, for half-planes.
        obstacles: each is an owner.
        behind: a point farther than this beyond the lines is on another way [m].
        sides: number of sides of `contacts_in`.
    """

    boundary: ShapeGrid
    smooth: ShapeGrid
    obstacles: ShapeGrid
    behind: float
    sides: int


def contacts_in(space: FreeSpace, body: Body, poses: Array, within: float, outward: float) -> Array:
    """Return the contacts (n, pieces, sides, 5), see geometry.contacts, of a body at `poses` (n, 3).

    Sides: 0 left, 1 right and, only if there are obstacles, 2 the nearest one. In an area these are the
    flanks of the body.

    Args:
        within: what is farther away is left out [m]. A piece so far beyond a boundary is left alone, too: it
            is taken to be on another way, behind it.
        outward: see geometry.contacts.
    """
    found = no_contacts(len(poses), body.pieces, space.sides)
    if space.sides == FLANKS:
        solid_contacts(body, poses, space.boundary, within, outward, found)
    else:
        line_contacts(body, poses, space.smooth, within, outward, found)
    if space.obstacles.owners:
        solid_contacts(body, poses, space.obstacles, within, outward, found)
    return found


def distances_in(space: FreeSpace, body: Body, poses: Array, within: float) -> Array:
    """Return signed distances (n, 1 + k) [m] of a body at `poses` (n, 3) to the boundary and k obstacles.

    Negative where they overlap: the least way out. +inf without anything nearer than `within` [m]. On the far
    side of lines they are positive again, see `clearances_in`.
    """
    apart = np.empty((len(poses), 1))
    signed_distances_to(space.boundary, body, poses, within, apart)
    if not space.obstacles.owners:
        return apart
    others = np.empty((len(poses), space.obstacles.owners))
    signed_distances_to(space.obstacles, body, poses, within, others)
    return np.concatenate((apart, others), axis=1)


def clearances_in(space: FreeSpace, body: Body, poses: Array, within: float) -> Array:
    """Return the distances (n, 1 + k) [m] of `distances_in`, negative as well where the origin of the body is
    beyond a boundary. Farther than `behind` beyond one with open ends the body is on another way.
    """
    apart = distances_in(space, body, poses, within)
    if space.sides != FLANKS:
        depths = np.zeros(len(poses))
        beyond_lines(space.boundary, poses, space.behind, depths)
        deeper = depths > 0.0
        apart[deeper, 0] = np.minimum(apart[deeper, 0], -depths[deeper])
    return apart
