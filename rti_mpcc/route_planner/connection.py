"""A whole way from two trees: a curve from a node of the one to a place of the other.

From a node the curves to those places are tried by which a way would be cheapest, of each place the cheapest
ones first; the best whole way so far is kept.
"""

from __future__ import annotations

from math import hypot, inf
from typing import Final, NamedTuple

import numpy as np

from geometry.arrays import Array
from geometry.compiled import IndexOut1, Out1, Out2, inner, record
from geometry.reeds_shepp import PIECES
from rti_mpcc.route_planner.costs import (
    Around,
    Curves,
    Terms,
    closeness_along,
    cost_along,
    curves_between,
    joint_cost,
    least_to,
    take_curve,
)
from rti_mpcc.route_planner.tree import EXPANDED, PLACES, Tree

HERE: Final = 0
THERE: Final = 1
FROM: Final = 2
FOUND_AT: Final = 3
"""Places in a whole way: the nodes that it joins, the tree that the curve is from, and how many nodes were
expanded before the first one was found."""
COST: Final = 0
NEAREST: Final = 1

_SHOTS: Final = 3  # places to which curves are tried
_TRIED: Final = 4  # curves to each
_REACH: Final = 6.0  # [radii] curves lead no farther, but to the first two places


@record
class Whole(NamedTuple):
    """The best whole way found so far.

    Attributes:
        best: its cost, inf without one, and how near to one another the trees came [m].
        nodes: see above.
        curve: (PIECES, 2) signed lengths [m] and curvatures [1/m], from the one to the other.
    """

    best: Out1
    nodes: IndexOut1
    curve: Out2


@record
class Shots(NamedTuple):
    """Room for the places to which curves are tried: nodes and the costs by way of them, both (_SHOTS,)."""

    node: IndexOut1
    cost: Out1


def none_found() -> Whole:
    """No way yet."""
    return Whole(best=np.array([inf, inf]), nodes=np.zeros(4, np.int64), curve=np.zeros((PIECES, 2)))


def room_for_shots() -> Shots:
    """Room for any places."""
    return Shots(node=np.empty(_SHOTS, np.int64), cost=np.empty(_SHOTS))


@inner
def connect(
    tree: Tree,
    node: int,
    other: Tree,
    which: int,
    whole: Whole,
    around: Around,
    terms: Terms,
    shots: Shots,
    curves: Curves,
) -> None:
    """Try curves from a node to the cheapest places of the other tree; keep the best whole way."""
    x, y, phi = tree.pose[node, 0], tree.pose[node, 1], tree.pose[node, 2]
    for k in range(_cheapest_places(tree, node, other, whole, terms, shots)):
        there = shots.node[k]
        count = _priced_curves(tree, node, other, there, terms, curves)
        for _ in range(min(count, _TRIED)):
            i = int(np.argmin(curves.order[:count]))
            if curves.order[i] >= whole.best[COST]:
                break
            take_curve(curves, i, terms.radius)
            most = whole.best[COST] - curves.order[i]
            extra, _ = closeness_along(x, y, phi, curves.curve, most, terms, around)
            if curves.order[i] + extra < whole.best[COST]:
                if whole.best[COST] == inf:
                    whole.nodes[FOUND_AT] = tree.counters[EXPANDED] + other.counters[EXPANDED]
                whole.best[COST] = curves.order[i] + extra
                whole.nodes[HERE], whole.nodes[THERE], whole.nodes[FROM] = node, there, which
                whole.curve[:] = curves.curve
            curves.order[i] = inf


@inner
def _cheapest_places(tree: Tree, node: int, other: Tree, whole: Whole, terms: Terms, shots: Shots) -> int:
    """Find the places of the other tree by which a way through a node would be cheapest, in order; returns
    how many."""
    x, y, phi = tree.pose[node, 0], tree.pose[node, 1], tree.pose[node, 2]
    count = 0
    for k in range(other.counters[PLACES]):
        there = other.places[k]
        if k > 1 and hypot(other.pose[there, 0] - x, other.pose[there, 1] - y) > _REACH * terms.radius:
            continue
        cost = other.cost[there] + least_to(x, y, phi, other.pose[there], terms)
        if tree.cost[node] + cost >= whole.best[COST]:
            continue
        if count < len(shots.node):
            at, count = count, count + 1
        elif cost < shots.cost[count - 1]:
            at = count - 1
        else:
            continue
        while at > 0 and shots.cost[at - 1] > cost:
            shots.node[at], shots.cost[at] = shots.node[at - 1], shots.cost[at - 1]
            at -= 1
        shots.node[at], shots.cost[at] = there, cost
    return count


@inner
def _priced_curves(tree: Tree, node: int, other: Tree, there: int, terms: Terms, curves: Curves) -> int:
    """Find the curves from a node to one of the other tree, and the cost of a whole way by each, but for how
    close it is to anything; returns how many."""
    pose: Array = tree.pose[node]
    count = curves_between(pose[0], pose[1], pose[2], other.pose[there], terms, curves)
    base = tree.cost[node] + other.cost[there]
    for i in range(count):
        take_curve(curves, i, terms.radius)
        curves.order[i] = base + cost_along(curves.curve, tree.piece[node, 0], tree.piece[node, 1], terms)
        curves.order[i] += joint_cost(curves.curve, -other.piece[there, 0], other.piece[there, 1], terms)
    return count
