"""Hybrid A*: a route for a car from one pose to another, past all that is solid.

After Dolgov, Thrun, Montemerlo, Diebel, "Path planning for autonomous vehicles in unknown semi-structured
environments", IJRR 2010. From a pose the vehicle drives arcs in both directions, with the wheels straight,
half and fully turned; an arc that is blocked ends where it is blocked.

Two trees grow in turn, one from the start and, against time, one from the goal: a tight end is easily left
and hard to enter. Now and then analytic expansion is tried: of the nodes of the other tree, of which its root
is one, those through which a route would be cheapest, and to each the cheapest Reeds-Shepp curves. A clear
one makes a whole route; the best so far is kept.

The remaining cost is estimated by the larger of the Reeds-Shepp cost without obstacles and the cost of a
point past them (`cost_to_go`), times a weight.
"""

from __future__ import annotations

from math import atan, hypot, inf, tan
from typing import Final, NamedTuple

import numpy as np

from geometry.arrays import Array
from geometry.compiled import IndexOut1, Out1, Out2, copy_rows, inner, kernel
from geometry.reeds_shepp import PIECES
from geometry.shape_grid import Body, ShapeGrid
from rti_mpcc.route_planner.arcs import NO_LENGTH, pose_after
from rti_mpcc.route_planner.cost_to_go import CostToGo, cost_at
from rti_mpcc.route_planner.costs import (
    ARC,
    SearchWorkspace,
    Terms,
    cheapest_curve,
    clear_at,
    closeness_of,
    least_to,
    steering_of,
    step_to_take,
    workspace_of,
)
from rti_mpcc.route_planner.tree import (
    EMPTY,
    EXPANDED,
    NODES,
    NONE,
    TARGETS_KNOWN,
    Tree,
    add_target,
    branch_to,
    enlarged,
    lattice_key,
    push,
    rooted,
    slot_of,
    take_next,
)

SEARCHING: Final = 0
EXHAUSTED: Final = 1
ENDED: Final = 2
"""How a slice of a search ended: it may continue, all is searched, no better route is expected."""

_CELL: Final = 1.2 * ARC  # [radii] length of a cell of the lattice
_EVERY: Final = 4  # nodes that are expanded between two from which curves are tried
_MORE: Final = 0.5  # after a first route so many times the nodes until then are expanded for a better one
_HALVES: Final = 3  # of an arc's last step, where it is blocked
_SHORTEST: Final = 0.3  # of the least distance between checks: a shorter arc is none
_TARGETS: Final = 3  # nodes of the other tree to which curves from a node are tried
_REACH: Final = 6.0  # [radii] curves lead no farther, but to the first two nodes
FROM_START, FROM_GOAL = 0, 1  # the trees
COST, NEAREST = 0, 1
HERE, THERE, FROM, FOUND_AT = 0, 1, 2, 3


class Connection(NamedTuple):
    """The best whole route found so far.

    Attributes:
        best: its COST, inf without one, and how far the NEAREST node of a tree is from the root of the other
            [m].
        nodes: those that it joins, HERE and THERE; the tree that the curve is FROM; FOUND_AT: the number of
            nodes that were expanded before the first one was found.
        curve: (PIECES, 2) signed lengths [m] and curvatures [1/m], from HERE to THERE.
    """

    best: Out1
    nodes: IndexOut1
    curve: Out2


class Growth(NamedTuple):
    """How one of the trees grows.

    Attributes:
        which: FROM_START or FROM_GOAL; grid: costs to the root of the other tree; terms: in the direction of
            its arcs.
        whole, work: of both trees.
    """

    which: int
    grid: CostToGo
    terms: Terms
    whole: Connection
    work: SearchWorkspace


@kernel
def _advance(tree: Tree, other: Tree, growth: Growth, budget: int) -> int:
    """Expand up to `budget` nodes; returns how that ended."""
    whole = growth.whole
    for _ in range(budget):
        node, least = take_next(tree)
        found = whole.best[COST] < inf
        if node == NONE:
            return ENDED if found else EXHAUSTED
        expanded = tree.counters[EXPANDED] + other.counters[EXPANDED]
        if found and (least >= whole.best[COST] or expanded > (1.0 + _MORE) * whole.nodes[FOUND_AT]):
            return ENDED
        tree.closed[node] = 1
        tree.counters[EXPANDED] += 1
        left = hypot(other.pose[0, 0] - tree.pose[node, 0], other.pose[0, 1] - tree.pose[node, 1])
        whole.best[NEAREST] = min(whole.best[NEAREST], left)
        add_target(tree, node, growth.terms.radius)
        if (expanded + 1) % _EVERY == 0 or tree.counters[EXPANDED] <= 2:
            _connect(tree, node, other, growth)
        _expand(tree, node, other, growth)
    return SEARCHING


@inner
def _expand(tree: Tree, node: int, other: Tree, growth: Growth) -> None:
    """Enter all that can be reached from a node by one arc."""
    incoming, bent, terms = tree.arc[node, 0], tree.arc[node, 1], growth.terms
    most = atan(terms.wheelbase / terms.radius)
    for sign in range(-1, 2, 2):
        for wheel in range(-2, 3):
            # Half and fully turned wheels, not half and full curvature.
            steering = 0.5 * wheel * most
            curvature = tan(steering) / terms.wheelbase
            if incoming != 0.0 and sign * incoming < 0.0 and curvature == bent:
                continue  # back along the arc to this node
            base = tree.cost[node]
            if incoming != 0.0:
                base += terms.steering * abs(steering - steering_of(bent, terms))
                if sign * incoming < 0.0:
                    base += terms.cusp
            driven, extra = _drive(tree, node, sign, curvature, terms, growth.work)
            if driven < _SHORTEST * terms.check:
                continue
            cost = base + (terms.ahead if sign > 0 else terms.back) * driven + extra
            if cost < growth.whole.best[COST]:
                _enter(tree, node, cost, other, growth.grid, terms)


@inner
def _drive(
    tree: Tree, node: int, sign: int, curvature: float, terms: Terms, work: SearchWorkspace
) -> tuple[float, float]:
    """Drive an arc from a node; its end is the tree's next node, if it is entered. Returns the length driven
    [m], and the cost of closeness."""
    x, y, phi, clear = tree.pose[node, 0], tree.pose[node, 1], tree.pose[node, 2], tree.clearance[node]
    longest = ARC * terms.radius * (2.0 if clear >= terms.open else 1.0)
    lever = 1.0 + terms.reach * abs(curvature)
    driven, extra, step = 0.0, 0.0, 0.0
    halves = 0  # where it is blocked the arc is driven as far as possible, by halves
    while halves <= _HALVES and driven < longest - NO_LENGTH:
        step = 0.5 * step if halves > 0 else step_to_take(clear, longest - driven, lever, terms)
        next_x, next_y, next_phi = pose_after(x, y, phi, sign * step, curvature)
        ahead = clear_at(work, next_x, next_y, next_phi, terms.open)
        if ahead >= terms.margin:
            x, y, phi, clear = next_x, next_y, next_phi, ahead
            driven += step
            extra += step * closeness_of(clear, terms)
        if halves > 0 or ahead < terms.margin:
            halves += 1
    new = tree.counters[NODES]
    tree.pose[new, 0], tree.pose[new, 1], tree.pose[new, 2] = x, y, phi
    tree.arc[new, 0], tree.arc[new, 1], tree.clearance[new] = sign * driven, curvature, clear
    return driven, extra


@inner
def _enter(tree: Tree, node: int, cost: float, other: Tree, grid: CostToGo, terms: Terms) -> None:
    """Queue the pose to which an arc from a node was driven, if it is the cheapest in its cell so far."""
    new, root, target = tree.counters[NODES], tree.pose[0], other.pose[0]
    x, y, clear = tree.pose[new, 0], tree.pose[new, 1], tree.clearance[new]
    share = 0.5 if clear >= terms.open else 1.0
    if clear < terms.tight:
        near = min(hypot(x - target[0], y - target[1]), hypot(x - root[0], y - root[1])) < terms.fine
        share = terms.finer if near else share
    key = lattice_key(tree, new, share, _CELL * terms.radius)
    at = slot_of(tree.keys, key)
    taken = tree.keys[at] != EMPTY
    if taken and tree.cost[tree.in_cell[at]] <= cost:
        return
    left = max(least_to(tree.pose[new], target, terms), cost_at(grid, x, y))
    if left == inf:
        return
    tree.counters[NODES] = new + 1
    tree.cost[new], tree.parent[new], tree.closed[new] = cost, node, 0
    push(tree.queue, cost + terms.weight * left, new)
    if taken:  # the node that had the cell is not expanded any more
        tree.closed[tree.in_cell[at]] = 1
    tree.keys[at], tree.in_cell[at] = key, new


@inner
def _connect(tree: Tree, node: int, other: Tree, growth: Growth) -> None:
    """Try curves from a node to those of the other tree by which a route may be cheapest; keep the best."""
    (which, _, terms, whole, work), pose = growth, tree.pose[node]
    count = other.counters[TARGETS_KNOWN]
    for k in range(count):  # least costs to the targets of the other tree, and on
        there = other.targets[k]
        target = other.pose[there]
        far = k > 1 and hypot(target[0] - pose[0], target[1] - pose[1]) > _REACH * terms.radius
        work.target_costs[k] = inf if far else other.cost[there] + least_to(pose, target, terms)
    for _ in range(min(count, _TARGETS)):
        k = int(np.argmin(work.target_costs[:count]))
        there, best = other.targets[k], whole.best[COST]
        if tree.cost[node] + work.target_costs[k] >= best:
            break
        work.target_costs[k] = inf
        ends = tree.cost[node] + other.cost[there], tree.arc[node], other.arc[there]
        cost, closeness = cheapest_curve(pose, other.pose[there], ends, best, terms, work)
        if cost < inf:
            if best == inf:
                whole.nodes[FOUND_AT] = tree.counters[EXPANDED] + other.counters[EXPANDED]
            whole.best[COST] = cost + closeness
            copy_rows(work.best, whole.curve)
            whole.nodes[HERE], whole.nodes[THERE], whole.nodes[FROM] = node, there, which


class Roots(NamedTuple):
    """Poses (n, 3) from which a tree grows, arcs (n, 2) between them and the start or the goal, and the costs
    (n,) and, if they are driven before the route, the clearances (n,) [m] of these."""

    poses: Array
    arcs: Array
    costs: Array
    clearances: Array | None = None


class HybridAStar:
    """A search from one of several starts to one of several goals, which continues slice by slice.

    Args:
        body, solid: the vehicle, and all that is solid; terms: see there.
        starts, goals: the two ends; arcs of length 0 are none.
        grids: estimates of the cost to the goal and, against time, to the start.
    """

    def __init__(
        self,
        body: Body,
        solid: ShapeGrid,
        terms: Terms,
        starts: Roots,
        goals: Roots,
        grids: tuple[CostToGo, CostToGo],
    ) -> None:
        self._last, work = goals.arcs, workspace_of(body, solid)
        self._trees = [rooted(*starts[:3]), rooted(goals.poses, goals.arcs * (-1.0, 1.0), goals.costs)]
        self._whole = Connection(np.array([inf, inf]), np.zeros(4, np.int64), np.zeros((PIECES, 2)))
        # Against time forward is reverse.
        against = terms._replace(ahead=terms.back, back=terms.ahead)
        own = (FROM_START, grids[0], terms), (FROM_GOAL, grids[1], against)
        self._growths = [Growth(*each, self._whole, work) for each in own]
        self.state = SEARCHING

    def advance(self, which: int, budget: int) -> None:
        """Expand up to so many nodes in a tree, FROM_START or FROM_GOAL."""
        if self.state == SEARCHING:
            tree = self._trees[which] = enlarged(self._trees[which], budget)
            self.state = _advance(tree, self._trees[1 - which], self._growths[which], budget)

    @property
    def expanded(self) -> int:
        """Nodes expanded so far."""
        return int(sum(tree.counters[EXPANDED] for tree in self._trees))

    @property
    def cost(self) -> float:
        """Of the best route found so far; inf without one."""
        return float(self._whole.best[COST])

    @property
    def nearest(self) -> float:
        """Least distance of a tree to its other end [m]."""
        return 0.0 if self.cost < inf else float(self._whole.best[NEAREST])

    def route(self) -> tuple[int, Array, Array]:
        """The index of the start of the best route, its arcs (n, 2), signed lengths [m] and curvatures [1/m],
        and the last arc that is driven after it (1, 2), or none (0, 2)."""
        whole = self._whole
        curve = whole.curve[whole.curve[:, 0] != 0.0]
        here, there = int(whole.nodes[HERE]), int(whole.nodes[THERE])
        if whole.nodes[FROM] == 1:
            here, there, curve = there, here, curve[::-1] * (-1.0, 1.0)
        to_here, start = branch_to(self._trees[0], here)
        to_there, root = branch_to(self._trees[1], there)
        last = self._last[root : root + 1]
        return start, np.vstack([to_here, curve, to_there[::-1] * (-1.0, 1.0)]), last[last[:, 0] != 0.0]
