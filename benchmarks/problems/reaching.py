"""A search for a motion on one part of a route that gives way to what stands beside it.

Two trees of short steps (benchmarks.problems.lattice) grow towards one another: one from the poses of a
motion along the route, as far as that is free, the other backwards from where it has to end. One quintic
joins them. Budgets are numbers of nodes, so that the same problem has the same answer on any machine.

All of it drives in the direction of the part. Into a goal it may also drive beyond it, stop, and back up by
at most BACK: that is how a vehicle comes into a goal behind which there is more room than before it. Wherever
the vehicle stands (at the begin of the part, at its end, where it turns back) it may turn its steering first.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.problems.lattice import LEVELS, STEP, Rank, Tree
from benchmarks.problems.passages import SideClearance, among
from geometry import wrap
from rti_mpcc.types import Array, Index

SLOPE = 1.0
"""Largest |dkappa/ds| [1/m²]: the default vehicle steers so fast below 0.34 m/s."""
BACK = 1.0
"""Farthest that the vehicle backs up into a goal [m]."""
FORWARD, BACKWARD = 15_000, 6_000
"""Nodes of the two trees, about, roots of the second not counted."""
FEW = 4_000
"""Nodes of the first, from which on the motion may back up into the goal."""
_BATCH = 128  # nodes grown at a time
_CHUNK = 500  # nodes that are joined at a time
_TARGETS = 1500  # nodes of the backward tree that are joined to
_LOOKED = 25.0  # [m] before the end of the motion from where on they are
_PAIRS = 200  # pairs of nodes that look best, of a batch
_TRIED = 12  # curves looked at closely, of a batch
_HARD = 3.0  # share of the limits by a rough guess, from which on a pair is none
_REACH = (1.5, 10.0)  # [m] from one node of a pair to the other
_SPEEDS = np.array([[1.0, 1.0], [1.25, 1.25], [1.0, 1.3], [1.3, 1.0]])  # of a quintic, as in its module
_GREED = 1.2  # of the way left, against the way driven
_OFF_ROUTE = np.array([0.3, 0.5])  # [1], [m] cost of being beside the route, of being turned to it
_TO_ROUTE = np.array([1.5, 4.0])  # likewise where the way to the route is sought


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Reached:
    """A motion on one part.

    Attributes:
        root: index of the root at which it begins.
        onward: (n, 4) its poses in the direction of the part, without that of the root.
        back: (m, 4) those of backing up, from where it turns back to the end; m is 0 or above 1.
    """

    root: int
    onward: Array
    back: Array


def reach(
    roots: Array, along: Array, ends: Array, theta: float, room: SideClearance, *, backs: bool
) -> Reached | None:
    """A motion from one of `roots` (k, 4) to one of `ends` (e, 4), None where none was found.

    Args:
        along: (k,) theta of the roots [m]; theta: of the ends [m].
        room: of the part; its slope is not used, SLOPE is.
        backs: whether it may back up into the ends, where it is not soon found that it need not.
    """
    room = replace(room, slope=SLOPE)
    driven = np.asarray(along - room.part.start, dtype=np.float64)
    first = Tree(roots, along, room=room, sense=1, rank=_nearer(theta), cost=driven)
    for back, most in ((0.0, FEW), (BACK, FORWARD)) if backs else ((0.0, FORWARD),):
        last, leg = _backward(ends, theta, back, room)
        targets = np.arange(len(last))[:: len(last) // _TARGETS + 1]
        for new in _batches(first, most):
            near = new[first.beside[new, 0] > theta - _LOOKED]
            met = _joined(first, near, last, targets, leg, room)
            if met is not None:
                return met
    return None


def _batches(tree: Tree, most: int) -> Iterator[Index]:
    """All nodes of a tree, some at a time, and those that it grows until it has about so many."""
    for begin in range(0, len(tree), _CHUNK):
        yield np.arange(begin, min(begin + _CHUNK, len(tree)))
    while len(tree) < most and not tree.exhausted:
        yield tree.grow(_BATCH)


def _nearer(theta: float) -> Rank:
    """Nodes from which the way to theta [m] seems short come first."""
    return lambda cost, where: np.asarray(
        cost + _GREED * (np.abs(theta - where[:, 0]) + np.abs(where[:, 1:]) @ _OFF_ROUTE)
    )


def _to_route(cost: Array, where: Array) -> Array:
    """Nodes near their root and near the route come first."""
    return np.asarray(cost + np.abs(where[:, 1:]) @ _TO_ROUTE)


def _backward(ends: Array, theta: float, back: float, room: SideClearance) -> tuple[Tree, Tree | None]:
    """The tree from which `ends` (e, 4) are driven to, and that of backing up, whose nodes are its roots."""
    leg = None
    roots, at, cost = ends, np.full(len(ends), theta), np.zeros(len(ends))
    if back > 0.0:
        leg = Tree(ends, at, room=room, sense=1, rank=_to_route)
        for _ in range(round(back / STEP)):
            leg.grow(len(leg))
        roots = np.repeat(leg.poses, LEVELS.size, axis=0)
        roots[:, 3] = np.tile(LEVELS * room.curvature, len(leg))
        # It backs up only where that is of use.
        at, cost = (np.repeat(values, LEVELS.size) for values in (leg.beside[:, 0], 3.0 * leg.cost))
    tree = Tree(roots, at, room=room, sense=-1, rank=_to_route, cost=cost)
    while len(tree) < len(roots) + BACKWARD and not tree.exhausted:
        tree.grow(_BATCH)
    return tree, leg


def _joined(
    first: Tree, new: Index, last: Tree, targets: Index, leg: Tree | None, room: SideClearance
) -> Reached | None:
    """A motion by way of one of the nodes `new` of one tree and one of `targets` of the other."""
    begins, ends = first.poses[new], last.poses[targets]
    found = among(begins, ends, *_pairs(begins, ends, room), _SPEEDS, room, sifted=True)
    for row in range(min(_TRIED, found.begin.size)):
        curve = found.motion(row, room)
        if curve is None:
            continue
        root, before = first.branch(int(new[found.begin[row]]))
        end, behind = last.branch(int(targets[found.end[row]]))
        onward = np.concatenate((before, curve, _driven_back(last, end, behind)[1:]))
        back = np.zeros((0, 4))
        if leg is not None:
            back = _driven_back(leg, *leg.branch(end // LEVELS.size))
        onward[:, 2] = _continued(first.poses[root, 2], onward[:, 2])
        back[:, 2] = _continued(onward[-1, 2], back[:, 2])
        return Reached(root=root, onward=onward, back=back if len(back) > 1 else back[:0])
    return None


def _driven_back(tree: Tree, root: int, branch: Array) -> Array:
    """The poses (k, 4) of a branch in the order from its node to its root, with that."""
    return np.concatenate((branch[::-1], tree.poses[[root]]))


def _continued(before: float, headings: Array) -> Array:
    """Headings (k,) that go on from the one before them [rad]."""
    return np.unwrap(np.append(before, headings))[1:]


def _pairs(begins: Array, ends: Array, room: SideClearance) -> tuple[Index, Index]:
    """Which poses (b, 4) may be joined to which (e, 4), those that look best.

    A cubic y(x) ahead of the first pose has at its ends, X on, Y to the left and turned by psi:

        y''(0) = (6 Y - 2 X tan psi)/X²,   y''(X) = (4 X tan psi - 6 Y)/X²                               (1)
    """
    direction = room.part.direction
    way = (ends[:, 0] + 1j * ends[:, 1])[None, :] - (begins[:, 0] + 1j * begins[:, 1])[:, None]
    way *= direction * np.exp(-1j * begins[:, 2])[:, None]
    turned = wrap(ends[None, :, 2] - begins[:, None, 2])
    ahead = (way.real > _REACH[0]) & (way.real < _REACH[1]) & (np.abs(way.imag) < way.real)
    begin, end = np.nonzero(ahead & (np.abs(turned) < 1.0))
    x, y, tangent = way.real[begin, end], way.imag[begin, end], np.tan(turned[begin, end])
    bent = np.stack([6.0 * y - 2.0 * x * tangent, 4.0 * x * tangent - 6.0 * y]) / x**2
    off = np.abs(bent - direction * np.stack([begins[begin, 3], ends[end, 3]])).sum(axis=0)
    slope = (2.0 * off + np.abs(bent[1] - bent[0])) / x
    hard = np.maximum(np.abs(bent).max(axis=0) / room.curvature, slope / room.slope)
    best = np.argsort(hard, kind="stable")[:_PAIRS]
    best = best[hard[best] < _HARD]
    return begin[best], end[best]
