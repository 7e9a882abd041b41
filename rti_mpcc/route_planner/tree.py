"""A tree of a search: nodes that are poses, how each was come to, and in which order they are to be expanded.

A pose is in a cell of a lattice (x, y, heading), with the direction in which it was come to. Of the poses in
one cell the cheapest one is kept, exactly.
"""

from __future__ import annotations

from math import floor, pi
from typing import Any, Final, NamedTuple, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from geometry.arrays import Array
from geometry.compiled import Index1, IndexOut1, Out1, Out2, inner, kernel, record
from rti_mpcc.route_planner.costs import Terms
from rti_mpcc.route_planner.priority_queue import EMPTY, pop, push, slot_of

Values = TypeVar("Values", bound=NDArray[Any])

NODES: Final = 0
QUEUED: Final = 1
EXPANDED: Final = 2
PLACES: Final = 3
COUNTERS: Final = 4
"""Places in the counters of a tree."""
NONE: Final = -1
"""No node: the parent of a root."""
BRANCHES: Final = 10
"""Nodes that come from one, at most."""

_FIRST: Final = 4096  # nodes that a tree has room for at first, a power of 2
_MOST_PLACES: Final = 1024
_HEADINGS: Final = 72
_PLACE: Final = 0.5  # [radii] a place for curves to lead to in each cell of this size ...
_PLACE_HEADINGS: Final = 8  # ... and each of these parts of a turn


@record
class Tree(NamedTuple):
    """Nodes: how each was come to, and what it costs.

    Attributes:
        pose: (n, 3); piece: (n, 2) signed length [m] and curvature [1/m] of the arc from the parent.
        cost: (n,) from the root; room: (n,) clearance at the pose, as far as it is looked at [m].
        parent: (n,); closed: (n,) 1 once expanded.
        priority, member: the heap; keys, place: the table of lattice cells.
        counters: see above; places: nodes that a curve from the other tree may lead to; taken: the table of
            cells by which they are chosen, one of each.
    """

    pose: Out2
    piece: Out2
    cost: Out1
    room: Out1
    parent: IndexOut1
    closed: IndexOut1
    priority: Out1
    member: IndexOut1
    keys: IndexOut1
    place: IndexOut1
    counters: IndexOut1
    places: IndexOut1
    taken: IndexOut1


def rooted(roots: Array, came: Array) -> Tree:
    """A tree of roots (n, 3), which were come to by pieces (n, 2)."""
    count = len(roots)
    tree = Tree(
        pose=np.empty((_FIRST, 3)),
        piece=np.empty((_FIRST, 2)),
        cost=np.empty(_FIRST),
        room=np.empty(_FIRST),
        parent=np.empty(_FIRST, np.int64),
        closed=np.empty(_FIRST, np.int64),
        priority=np.empty(_FIRST),
        member=np.empty(_FIRST, np.int64),
        keys=np.full(2 * _FIRST, EMPTY),
        place=np.empty(2 * _FIRST, np.int64),
        counters=np.zeros(COUNTERS, np.int64),
        places=np.empty(_MOST_PLACES, np.int64),
        taken=np.full(4 * _MOST_PLACES, EMPTY),
    )
    tree.pose[:count], tree.piece[:count] = roots, came
    tree.cost[:count], tree.room[:count] = 0.0, 0.0
    tree.parent[:count], tree.closed[:count] = NONE, 0
    tree.priority[:count], tree.member[:count] = 0.0, np.arange(count)
    tree.counters[NODES] = tree.counters[QUEUED] = count
    # Curves lead to a root from the first on.
    tree.places[:count], tree.counters[PLACES] = np.arange(count), count
    return tree


def with_room(tree: Tree, expanded: int) -> Tree:
    """The same tree, with room for what comes of so many nodes that are expanded: twice of all, or itself."""
    if tree.counters[NODES] + BRANCHES * expanded <= len(tree.cost):
        return tree
    keys, place = np.full(2 * len(tree.keys), EMPTY), np.empty(2 * len(tree.place), np.int64)
    _enter_again(tree.keys, tree.place, keys, place)
    return tree._replace(
        pose=_doubled(tree.pose),
        piece=_doubled(tree.piece),
        cost=_doubled(tree.cost),
        room=_doubled(tree.room),
        parent=_doubled(tree.parent),
        closed=_doubled(tree.closed),
        priority=_doubled(tree.priority),
        member=_doubled(tree.member),
        keys=keys,
        place=place,
    )


def _doubled(values: Values) -> Values:
    """The same values, and as much room again."""
    found = np.empty((2 * len(values), *values.shape[1:]), values.dtype)
    found[: len(values)] = values
    return cast("Values", found)


@kernel
def _enter_again(keys: Index1, place: Index1, new_keys: IndexOut1, new_place: IndexOut1) -> None:
    """Enter all that is in one table into another one."""
    for k in range(len(keys)):
        if keys[k] != EMPTY:
            at = slot_of(new_keys, keys[k])
            new_keys[at], new_place[at] = keys[k], place[k]


def branch_to(tree: Tree, node: int) -> tuple[Array, int]:
    """Pieces (n, 2) from a root to a node, and the root."""
    found = []
    while tree.parent[node] != NONE:
        found.append(tree.piece[node].copy())
        node = int(tree.parent[node])
    return np.array(found[::-1]).reshape(-1, 2), node


@inner
def take_next(tree: Tree) -> tuple[int, float]:
    """Take the node of least priority that is not closed, or none, and its priority."""
    node, least = NONE, 0.0
    while node == NONE and tree.counters[QUEUED] > 0:
        first, least = tree.member[0], tree.priority[0]
        tree.counters[QUEUED] = pop(tree.priority, tree.member, tree.counters[QUEUED])
        if tree.closed[first] == 0:
            node = first
    return node, least


@inner
def lattice_key(tree: Tree, x: float, y: float, phi: float, forward: bool, share: float, cell: float) -> int:
    """Of the cell that a pose is in, in the lattice that is finer by this share."""
    size, headings = cell / share, int(_HEADINGS * share)
    i, j = floor((x - tree.pose[0, 0]) / size) & 0xFFFFF, floor((y - tree.pose[0, 1]) / size) & 0xFFFFF
    turn = floor(phi / (2.0 * pi) * headings + 0.5) % headings
    level = 0 if share < 1.0 else 1 if share == 1.0 else 2
    key: int = 1 + ((((((i << 20) | j) << 12) | turn) << 3) | (level << 1) | (1 if forward else 0))
    return key


@inner
def add(
    tree: Tree,
    parent: int,
    x: float,
    y: float,
    phi: float,
    length: float,
    curvature: float,
    cost: float,
    room: float,
    priority: float,
) -> int:
    """Queue a new node, which is come to from its parent by an arc; returns it."""
    new: int = tree.counters[NODES]
    tree.counters[NODES] = new + 1
    tree.pose[new, 0], tree.pose[new, 1], tree.pose[new, 2] = x, y, phi
    tree.piece[new, 0], tree.piece[new, 1] = length, curvature
    tree.cost[new], tree.room[new], tree.parent[new], tree.closed[new] = cost, room, parent, 0
    tree.counters[QUEUED] = push(tree.priority, tree.member, tree.counters[QUEUED], priority, new)
    return new


@inner
def put_in_cell(tree: Tree, at: int, key: int, node: int) -> None:
    """Let a node have the place `at` of the table; one that had it before is not expanded any more."""
    if tree.keys[at] != EMPTY:
        tree.closed[tree.place[at]] = 1
    tree.keys[at], tree.place[at] = key, node


@inner
def take_place(tree: Tree, node: int, terms: Terms) -> None:
    """Let curves from the other tree lead to this node, if it is the first in its place."""
    count = tree.counters[PLACES]
    if count >= len(tree.places):
        return
    x, y = tree.pose[node, 0] - tree.pose[0, 0], tree.pose[node, 1] - tree.pose[0, 1]
    size = _PLACE * terms.radius
    i, j = floor(x / size) & 0xFFFFF, floor(y / size) & 0xFFFFF
    turn = floor(tree.pose[node, 2] / (2.0 * pi) * _PLACE_HEADINGS + 0.5) % _PLACE_HEADINGS
    key = 1 + ((((i << 20) | j) << 3) | turn)
    at = slot_of(tree.taken, key)
    if tree.taken[at] == EMPTY:
        tree.taken[at] = key
        tree.places[count] = node
        tree.counters[PLACES] = count + 1
