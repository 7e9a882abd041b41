"""Trees of short steps from poses, of all that a vehicle can do, as far as a body has room.

A step is STEP long and changes the curvature evenly to one of five levels, no faster than Room.slope:

    kappa_end in {-1, -1/2, 0, 1/2, 1} kappa_max,   |kappa_end - kappa_begin| <= slope STEP              (1)

Heading and place follow from it by integration, so curvature is continuous along a branch. Of steps that end
in the same cell of way along the route, lateral error, heading error and curvature the tree keeps the one
that comes first: what it does not reach may still be reachable, what it reaches is.
"""

from __future__ import annotations

from collections.abc import Callable
from math import ceil

import numpy as np
from numpy.typing import NDArray

from benchmarks.problems.passages import SPACING, SideClearance
from geometry import PathPart, wrap
from rti_mpcc.types import Array, Index

STEP = 0.5
"""Length of a step [m]."""
LEVELS = np.linspace(-1.0, 1.0, 5)
"""Curvatures at which steps end, in shares of the largest."""
_CELL = np.array([0.5, 0.15, 0.07, 0.25])  # theta [m], lateral [m], heading [rad], share of the curvature
_AROUND = np.array([10.0, 6.0, 1.3, 1.0])  # how far beside the route, and beyond both its ends, cells reach

_CHANGE = 0.5  # cost of a change of curvature by its largest, in shares of the step

Rank = Callable[[Array, Array], Array]
"""From the costs of nodes (k,) [m] and where they are beside the route (k, 3) to what is grown first."""


class Tree:
    """Poses that are reached from some roots; grows with every call of `grow`.

    Attributes:
        poses: (n, 4) x [m], y [m], heading [rad], curvature [1/m] of its nodes.
        parent: (n,) index of the node before, -1 for roots.
        cost: (n,) way from the root [m], more where the steering is turned.
        beside: (n, 3) theta [m], lateral [m] and heading error [rad] to the route.
    """

    def __init__(
        self,
        roots: Array,
        theta: Array,
        *,
        room: SideClearance,
        sense: int,
        rank: Rank,
        cost: Array | None = None,
    ) -> None:
        """Begin with roots (k, 4) at about theta (k,) [m], of which `cost` is the cost.

        Args:
            sense: +1: nodes are driven to from the roots, -1: the roots are driven to from the nodes.
            rank: nodes with the least are grown first.
        """
        self._room, self._rank = room, rank
        self._direction, self._onward = room.part.direction * sense, sense * STEP
        span = np.array([room.part.end - room.part.start, 0.0, 0.0, 0.0])
        self._low = np.array([room.part.start, 0.0, 0.0, 0.0]) - _AROUND
        self._shape = np.ceil((span + 2.0 * _AROUND) / _CELL).astype(np.int64) + 1
        self._seen = np.zeros(int(self._shape.prod()), dtype=np.bool_)
        self.poses = roots
        self.parent: Index = np.full(len(roots), -1)
        self.cost = np.zeros(len(roots)) if cost is None else cost
        self.beside = beside(roots, theta, room.part)
        self._open = rank(self.cost, self.beside)
        cell, inside = self._cells(roots, self.beside)
        self._seen[cell[inside]] = True

    def __len__(self) -> int:
        return len(self.poses)

    def grow(self, most: int) -> Index:
        """Grow the best nodes that have not been, `most` of them; the new nodes (k,)."""
        grown = np.flatnonzero(np.isfinite(self._open))
        if grown.size > most:
            grown = np.sort(grown[np.argpartition(self._open[grown], most - 1)[:most]])
        self._open[grown] = np.inf
        motions, parent = steps(self.poses[grown], self._direction, self._room)
        parent, ends = grown[parent], motions[:, -1]
        where = beside(ends, self.beside[parent, 0] + self._onward, self._room.part)
        turned = np.abs(ends[:, 3] - self.poses[parent, 3]) / self._room.curvature
        cost = self.cost[parent] + STEP * (1.0 + _CHANGE * turned)
        kept = self._first_in_cells(ends, where, cost)
        kept = kept[np.abs(where[kept, 0] - self.beside[parent[kept], 0]) < 4.0 * STEP]
        kept = kept[self._room.free(motions[kept]).all(axis=1)]
        self._seen[self._cells(ends[kept], where[kept])[0]] = True
        before = len(self)
        self._add(ends[kept], parent[kept], cost[kept], where[kept])
        return np.arange(before, len(self))

    def branch(self, node: int) -> tuple[int, Array]:
        """The root of a node, and (k, 4) the poses from there, without its own, to the node."""
        found = [np.zeros((0, 4))]
        while self.parent[node] >= 0:
            before = int(self.parent[node])
            motions, _ = steps(self.poses[before : before + 1], self._direction, self._room)
            found.append(motions[np.argmin(np.abs(motions[:, -1, 3] - self.poses[node, 3]))])
            node = before
        return node, np.concatenate(found[::-1])

    @property
    def exhausted(self) -> bool:
        """Whether no node is left to grow."""
        return not bool(np.isfinite(self._open).any())

    def _first_in_cells(self, ends: Array, where: Array, cost: Array) -> Index:
        """Of poses (k, 4) those in cells that have none yet, the cheapest of each."""
        cell, inside = self._cells(ends, where)
        rows = np.flatnonzero(inside)
        rows = rows[~self._seen[cell[rows]]]
        rows = rows[np.argsort(cost[rows], kind="stable")]
        _, first = np.unique(cell[rows], return_index=True)
        return np.sort(rows[first])

    def _cells(self, poses: Array, where: Array) -> tuple[Index, NDArray[np.bool_]]:
        """The cell of each pose (k, 4), and whether there is one."""
        place = np.column_stack([where, poses[:, 3] / self._room.curvature])
        at = np.rint((place - self._low) / _CELL).astype(np.int64)
        inside = ((at >= 0) & (at < self._shape)).all(axis=1)
        return np.ravel_multi_index(tuple(at.T), tuple(self._shape), mode="clip"), inside

    def _add(self, poses: Array, parent: Index, cost: Array, where: Array) -> None:
        self.poses = np.concatenate((self.poses, poses))
        self.parent = np.concatenate((self.parent, parent))
        self.cost = np.concatenate((self.cost, cost))
        self.beside = np.concatenate((self.beside, where))
        self._open = np.concatenate((self._open, self._rank(cost, where)))


def steps(begins: Array, direction: int, room: SideClearance) -> tuple[Array, Index]:
    """All steps by (1) from poses (k, 4): their poses without the first (m, 5, 4), and (m,) where they begin.

    Poses are SPACING apart; the places are Simpson's integral from one to the next.
    """
    levels = LEVELS * room.curvature
    begin, level = np.nonzero(np.abs(levels - begins[:, 3:]) <= room.slope * STEP + 1e-9)
    at, count = begins[begin], ceil(STEP / SPACING)
    u = np.linspace(0.0, 1.0, 2 * count + 1)
    change = levels[level][:, None] - at[:, 3:]
    phi = at[:, 2:3] + direction * STEP * (at[:, 3:] * u + 0.5 * change * u**2)
    points = []
    for start, slope in ((at[:, :1], np.cos(phi)), (at[:, 1:2], np.sin(phi))):
        weighed = slope[:, :-2:2] + 4.0 * slope[:, 1::2] + slope[:, 2::2]
        points.append(start + direction * STEP / (6.0 * count) * np.cumsum(weighed, axis=1))
    return np.stack([*points, phi[:, 2::2], (at[:, 3:] + change * u)[:, 2::2]], axis=-1), begin


def beside(poses: Array, theta: Array, part: PathPart) -> Array:
    """theta [m], lateral error to the left of the travel [m], heading error [rad] (k, 3) of poses (k, >= 3).

    `theta` (k,) is where about they are.
    """
    theta = np.array(theta, dtype=np.float64)
    for _ in range(3):
        way = part.reference(theta)
        d_x, d_y = poses[:, 0] - way.x, poses[:, 1] - way.y
        t_x, t_y = part.direction * np.cos(way.phi), part.direction * np.sin(way.phi)
        lateral = t_x * d_y - t_y * d_x
        ahead = t_x * d_x + t_y * d_y
        theta += ahead / np.maximum(1.0 - lateral * way.slope, 0.3)
    way = part.reference(theta)
    return np.column_stack([theta, lateral, wrap(poses[:, 2] - way.phi)])
