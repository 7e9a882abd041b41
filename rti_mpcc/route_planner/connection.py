"""A whole route from two trees, by analytic expansion: a curve from a node of the one to one of the other.

From a node the curves to those nodes are tried through which a route would be cheapest, of each the cheapest
curves first; the best whole route so far is kept.
"""

from __future__ import annotations

from math import hypot, inf
from typing import Final, NamedTuple

import numpy as np

from geometry.arrays import Array
from geometry.compiled import IndexOut1, Out1, Out2, inner, record
from geometry.reeds_shepp import PIECES
from rti_mpcc.route_planner.costs import (
    SearchWorkspace,
    Terms,
    closeness_along,
    cost_along,
    find_curves,
    joint_cost,
    least_to,
    take_curve,
)
from rti_mpcc.route_planner.tree import EXPANDED, TARGETS_KNOWN, Tree

HERE: Final = 0
THERE: Final = 1
FROM: Final = 2
FOUND_AT: Final = 3
"""Places in `Connection.nodes`: the nodes that it joins, the tree that the curve is from, and the number of
nodes that were expanded before the first one was found."""
COST: Final = 0
NEAREST: Final = 1

_CURVES: Final = 4  # tried to each node
_REACH: Final = 6.0  # [radii] curves lead no farther, but to the first two nodes


@record
class Connection(NamedTuple):
    """The best whole route found so far.

    Attributes:
        best: its cost, inf without one, and least distance of a tree to the root of the other [m].
        nodes: see above.
        curve: (PIECES, 2) signed lengths [m] and curvatures [1/m], from the one to the other.
    """

    best: Out1
    nodes: IndexOut1
    curve: Out2


def no_connection() -> Connection:
    """Nothing found yet."""
    return Connection(best=np.array([inf, inf]), nodes=np.zeros(4, np.int64), curve=np.zeros((PIECES, 2)))


@inner
def connect(
    tree: Tree, node: int, other: Tree, which: int, whole: Connection, terms: Terms, work: SearchWorkspace
) -> None:
    """Try curves from a node to the cheapest nodes of the other tree; keep the best whole route."""
    x, y, phi = tree.pose[node, 0], tree.pose[node, 1], tree.pose[node, 2]
    for k in range(_find_targets(tree, node, other, whole, terms, work)):
        there = work.targets[k]
        count = _find_priced_curves(tree, node, other, there, terms, work)
        for _ in range(min(count, _CURVES)):
            i = int(np.argmin(work.order[:count]))
            if work.order[i] >= whole.best[COST]:
                break
            take_curve(work, i, terms.radius)
            most = whole.best[COST] - work.order[i]
            extra, _ = closeness_along(x, y, phi, work.curve, most, terms, work)
            if work.order[i] + extra < whole.best[COST]:
                if whole.best[COST] == inf:
                    whole.nodes[FOUND_AT] = tree.counters[EXPANDED] + other.counters[EXPANDED]
                whole.best[COST] = work.order[i] + extra
                whole.nodes[HERE], whole.nodes[THERE], whole.nodes[FROM] = node, there, which
                whole.curve[:] = work.curve
            work.order[i] = inf


@inner
def _find_targets(
    tree: Tree, node: int, other: Tree, whole: Connection, terms: Terms, work: SearchWorkspace
) -> int:
    """Find the nodes of the other tree by which a route through a node is cheapest; returns their number."""
    x, y, phi = tree.pose[node, 0], tree.pose[node, 1], tree.pose[node, 2]
    count = 0
    for k in range(other.counters[TARGETS_KNOWN]):
        there = other.targets[k]
        if k > 1 and hypot(other.pose[there, 0] - x, other.pose[there, 1] - y) > _REACH * terms.radius:
            continue
        cost = other.cost[there] + least_to(x, y, phi, other.pose[there], terms)
        if tree.cost[node] + cost >= whole.best[COST]:
            continue
        if count < len(work.targets):
            at, count = count, count + 1
        elif cost < work.target_costs[count - 1]:
            at = count - 1
        else:
            continue
        while at > 0 and work.target_costs[at - 1] > cost:
            work.targets[at], work.target_costs[at] = work.targets[at - 1], work.target_costs[at - 1]
            at -= 1
        work.targets[at], work.target_costs[at] = there, cost
    return count


@inner
def _find_priced_curves(
    tree: Tree, node: int, other: Tree, there: int, terms: Terms, work: SearchWorkspace
) -> int:
    """Find the curves from a node to one of the other tree, with the cost of a whole route by each without
    closeness; returns their number."""
    pose: Array = tree.pose[node]
    count = find_curves(pose[0], pose[1], pose[2], other.pose[there], terms, work)
    base = tree.cost[node] + other.cost[there]
    for i in range(count):
        take_curve(work, i, terms.radius)
        work.order[i] = base + cost_along(work.curve, tree.arc[node, 0], tree.arc[node, 1], terms)
        work.order[i] += joint_cost(work.curve, -other.arc[there, 0], other.arc[there, 1], terms)
    return count
