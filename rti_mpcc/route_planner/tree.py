"""Memory of a best-first search: a tree of poses and the arcs between them, a heap, and tables of cells.

A pose is in a cell of a lattice (x, y, heading), with the direction of the arc to it. Of the poses in one
cell the cheapest one is kept, exactly.
"""

from __future__ import annotations

from math import floor, pi
from typing import Final, NamedTuple

import numpy as np

from geometry.arrays import Array, Index
from geometry.compiled import Index1, IndexOut1, Out1, Out2, inner, kernel

EMPTY: Final = 0
"""A free slot of a table: keys are larger."""
NODES, EXPANDED, TARGETS_KNOWN = range(3)
"""Places in the counters of a tree."""
NONE: Final = -1
"""No node: the parent of a root."""
BRANCHES: Final = 10
"""Children of a node, at most."""
MOST_TARGETS: Final = 1024
"""Nodes of a tree, at most, to which curves from the other one are tried."""

_FIRST: Final = 4096  # nodes that fit into a new tree, a power of 2
_HEADINGS: Final = 72
_AREA: Final = 0.5  # [radii] one target for curves in each cell of this size ...
_AREA_HEADINGS: Final = 8  # ... and each of these sectors of the heading


class Heap(NamedTuple):
    """Nodes, the one of least priority first.

    Attributes:
        priority, member: (n,) of each node, and the node; size: (1,) number of nodes.
    """

    priority: Out1
    member: IndexOut1
    size: IndexOut1


@inner
def push(heap: Heap, value: float, node: int) -> None:
    """Enter a node with its priority."""
    priority, member, i = heap.priority, heap.member, heap.size[0]
    heap.size[0] += 1
    while i > 0:
        above = (i - 1) // 2
        if priority[above] <= value:
            break
        priority[i], member[i] = priority[above], member[above]
        i = above
    priority[i], member[i] = value, node


@inner
def pop(heap: Heap) -> tuple[int, float]:
    """Take out the node of least priority; returns it and its priority."""
    priority, member, size = heap.priority, heap.member, heap.size[0] - 1
    first, least, value, node = member[0], priority[0], priority[size], member[size]
    heap.size[0] = size
    i = 0
    while 2 * i + 1 < size:
        below = 2 * i + 1
        if below + 1 < size and priority[below + 1] < priority[below]:
            below += 1
        if priority[below] >= value:
            break
        priority[i], member[i] = priority[below], member[below]
        i = below
    priority[i], member[i] = value, node
    return first, least


@inner
def slot_of(keys: Index, key: int) -> int:
    """Slot of a key in a table whose size is a power of 2, or the free slot where it belongs."""
    mask = len(keys) - 1
    at = ((key ^ (key >> 29)) * 0x9E3779B97F4A7C1) & mask
    while keys[at] != EMPTY and keys[at] != key:
        at = (at + 1) & mask
    return at


class Tree(NamedTuple):
    """Nodes, their queue, and the lattice.

    Attributes:
        pose: (n, 3); arc: (n, 2) signed length [m] and curvature [1/m] of the arc from the parent.
        cost: (n,) from the root; clearance: (n,) at the pose, as far as it is computed [m].
        parent: (n,); closed: (n,) 1 once expanded.
        queue: nodes to expand; keys, in_cell: the table of lattice cells, and the node in each.
        counters: see above; targets: nodes to which a curve from the other tree may lead; taken: the table of
            cells by which they are chosen, one of each.
    """

    pose: Out2
    arc: Out2
    cost: Out1
    clearance: Out1
    parent: IndexOut1
    closed: IndexOut1
    queue: Heap
    keys: IndexOut1
    in_cell: IndexOut1
    counters: IndexOut1
    targets: IndexOut1
    taken: IndexOut1


def rooted(roots: Array, arcs: Array, costs: Array) -> Tree:
    """A tree of roots (n, 3), to which arcs (n, 2) of these costs (n,) lead."""
    count = len(roots)
    tree = Tree(
        pose=np.empty((_FIRST, 3)),
        arc=np.empty((_FIRST, 2)),
        cost=np.empty(_FIRST),
        clearance=np.zeros(_FIRST),
        parent=np.full(_FIRST, NONE),
        closed=np.zeros(_FIRST, np.int64),
        queue=Heap(np.zeros(_FIRST), np.arange(_FIRST), np.array([count])),
        keys=np.full(2 * _FIRST, EMPTY),
        in_cell=np.empty(2 * _FIRST, np.int64),
        counters=np.array([count, 0, count]),
        targets=np.arange(MOST_TARGETS),  # the roots are the first ones
        taken=np.full(4 * MOST_TARGETS, EMPTY),
    )
    tree.pose[:count], tree.arc[:count], tree.cost[:count] = roots, arcs, costs
    return tree


def enlarged(tree: Tree, expanded: int) -> Tree:
    """The same tree if the children of so many nodes fit into it, else one of twice the size."""
    if tree.counters[NODES] + BRANCHES * expanded <= len(tree.cost):
        return tree
    keys, in_cell = np.full(2 * len(tree.keys), EMPTY), np.empty(2 * len(tree.keys), np.int64)
    _copy_cells(tree.keys, tree.in_cell, keys, in_cell)
    # What the new half holds is written before it is read.
    own = ("pose", "arc", "cost", "clearance", "parent", "closed")
    doubled = {name: np.concatenate([getattr(tree, name)] * 2) for name in own}
    priority, member, size = tree.queue
    queue = Heap(np.concatenate([priority] * 2), np.concatenate([member] * 2), size)
    return tree._replace(**doubled, queue=queue, keys=keys, in_cell=in_cell)


@kernel
def _copy_cells(keys: Index1, in_cell: Index1, new_keys: IndexOut1, new_in_cell: IndexOut1) -> None:
    for k in range(len(keys)):
        if keys[k] != EMPTY:
            at = slot_of(new_keys, keys[k])
            new_keys[at], new_in_cell[at] = keys[k], in_cell[k]


def branch_to(tree: Tree, node: int) -> tuple[Array, int]:
    """Arcs (n, 2) from a root to a node, and the root."""
    arcs = []
    while tree.parent[node] != NONE:
        arcs.append(tree.arc[node].copy())
        node = int(tree.parent[node])
    return np.array(arcs[::-1]).reshape(-1, 2), node


@inner
def take_next(tree: Tree) -> tuple[int, float]:
    """Take the node of least priority that is not closed, or none, and its priority."""
    node, least = NONE, 0.0
    while node == NONE and tree.queue.size[0] > 0:
        first, least = pop(tree.queue)
        if tree.closed[first] == 0:
            node = first
    return node, least


@inner
def lattice_key(tree: Tree, node: int, share: float, cell: float) -> int:
    """Key of the cell of a node, in the lattice that is finer by this share."""
    x, y, phi, forward = tree.pose[node, 0], tree.pose[node, 1], tree.pose[node, 2], tree.arc[node, 0] > 0.0
    size, headings = cell / share, int(_HEADINGS * share)
    i, j = floor((x - tree.pose[0, 0]) / size) & 0xFFFFF, floor((y - tree.pose[0, 1]) / size) & 0xFFFFF
    turn = floor(phi / (2.0 * pi) * headings + 0.5) % headings
    level = 0 if share < 1.0 else 1 if share == 1.0 else 2
    key: int = 1 + ((((((i << 20) | j) << 12) | turn) << 3) | (level << 1) | (1 if forward else 0))
    return key


@inner
def add_target(tree: Tree, node: int, radius: float) -> None:
    """Make a node a target of curves from the other tree, if it is the first in its area."""
    count = tree.counters[TARGETS_KNOWN]
    if count >= len(tree.targets):
        return
    x, y = tree.pose[node, 0] - tree.pose[0, 0], tree.pose[node, 1] - tree.pose[0, 1]
    size = _AREA * radius
    i, j = floor(x / size) & 0xFFFFF, floor(y / size) & 0xFFFFF
    turn = floor(tree.pose[node, 2] / (2.0 * pi) * _AREA_HEADINGS + 0.5) % _AREA_HEADINGS
    key = 1 + ((((i << 20) | j) << 3) | turn)
    at = slot_of(tree.taken, key)
    if tree.taken[at] == EMPTY:
        tree.taken[at] = key
        tree.targets[count] = node
        tree.counters[TARGETS_KNOWN] = count + 1
