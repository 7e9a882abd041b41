"""Hybrid A*: a way for a car from one pose to another, past all that stands.

After Dolgov, Thrun, Montemerlo, Diebel, "Path planning for autonomous vehicles in unknown semi-structured
environments", IJRR 2010. From a pose the vehicle drives arcs in both directions, with the wheels straight,
half and fully turned; one that is blocked on the way ends where it is blocked.

Two trees grow in turn, one from the start and, against time, one from the goal: what is tight at one end is
easily left and hard to come into. Now and then the cheapest Reeds-Shepp curves from a node to places of the
other tree are tried, of which its root is one; a clear one makes a whole way (`connection`).

What is left of a way is estimated by the larger of the Reeds-Shepp cost without obstacles and the cost of a
point past them (`cost_to_go`), times a weight.
"""

from __future__ import annotations

from math import atan, hypot, inf, tan
from typing import Final

import numpy as np

from geometry.arrays import Array
from geometry.compiled import inner, kernel
from geometry.shape_grid import BodyShape, SolidShapes
from rti_mpcc.route_planner.arcs import after
from rti_mpcc.route_planner.connection import (
    COST,
    FOUND_AT,
    FROM,
    HERE,
    NEAREST,
    THERE,
    Shots,
    Whole,
    connect,
    none_found,
    room_for_shots,
)
from rti_mpcc.route_planner.cost_to_go import CostToGo, looked_up
from rti_mpcc.route_planner.costs import (
    NO_LENGTH,
    Around,
    Curves,
    Terms,
    around_of,
    clear_at,
    closeness_of,
    least_to,
    room_for_curves,
    steering_of,
    step_to_take,
)
from rti_mpcc.route_planner.priority_queue import EMPTY, slot_of
from rti_mpcc.route_planner.tree import (
    EXPANDED,
    NONE,
    Tree,
    add,
    branch_to,
    lattice_key,
    put_in_cell,
    rooted,
    take_next,
    take_place,
    with_room,
)

SEARCHING: Final = 0
EXHAUSTED: Final = 1
ENDED: Final = 2
"""How a slice of a search ended: it may go on, all is searched, no better way is expected."""

_EVERY: Final = 4  # nodes that are expanded between two from which curves are tried
_HALVES: Final = 3  # of an arc's last step, where it is blocked
_SHORTEST: Final = 0.3  # of the least distance between checks: a shorter arc is none


@kernel
def _advance(
    tree: Tree,
    other: Tree,
    which: int,
    whole: Whole,
    around: Around,
    grid: CostToGo,
    terms: Terms,
    shots: Shots,
    curves: Curves,
    budget: int,
) -> int:
    """Expand up to `budget` nodes; returns how that ended."""
    for _ in range(budget):
        node, least = take_next(tree)
        found = whole.best[COST] < inf
        if node == NONE:
            return ENDED if found else EXHAUSTED
        expanded = tree.counters[EXPANDED] + other.counters[EXPANDED]
        if found and (least >= whole.best[COST] or expanded > (1.0 + terms.more) * whole.nodes[FOUND_AT]):
            return ENDED
        tree.closed[node] = 1
        tree.counters[EXPANDED] += 1
        left = hypot(other.pose[0, 0] - tree.pose[node, 0], other.pose[0, 1] - tree.pose[node, 1])
        whole.best[NEAREST] = min(whole.best[NEAREST], left)
        take_place(tree, node, terms)
        if (expanded + 1) % _EVERY == 0 or tree.counters[EXPANDED] <= 2:
            connect(tree, node, other, which, whole, around, terms, shots, curves)
        _branch(tree, node, other, whole, around, grid, terms)
    return SEARCHING


@inner
def _branch(
    tree: Tree, node: int, other: Tree, whole: Whole, around: Around, grid: CostToGo, terms: Terms
) -> None:
    """Enter what can be come to from a node by one arc."""
    came, bent = tree.piece[node, 0], tree.piece[node, 1]
    most = atan(terms.wheelbase / terms.radius)
    for sign in range(-1, 2, 2):
        for wheel in range(-2, 3):
            # Half and fully turned wheels, not half and full curvature.
            steering = 0.5 * wheel * most
            curvature = tan(steering) / terms.wheelbase
            if came != 0.0 and sign * came < 0.0 and curvature == bent:
                continue  # the way that it came
            base = tree.cost[node]
            if came != 0.0:
                base += terms.steering * abs(steering - steering_of(bent, terms))
                if sign * came < 0.0:
                    base += terms.cusp
            x, y, phi, clear, driven, extra = _driven(tree, node, sign, curvature, around, terms)
            if driven < _SHORTEST * terms.check:
                continue
            cost = base + (terms.ahead if sign > 0 else terms.back) * driven + extra
            if cost < whole.best[COST]:
                _enter(tree, node, x, y, phi, clear, sign * driven, curvature, cost, other, grid, terms)


@inner
def _driven(
    tree: Tree, node: int, sign: int, curvature: float, around: Around, terms: Terms
) -> tuple[float, float, float, float, float, float]:
    """Where the vehicle gets from a node on an arc: pose, clearance there [m], how far that is [m], and what
    it costs to be close to something on the way."""
    x, y, phi, clear = tree.pose[node, 0], tree.pose[node, 1], tree.pose[node, 2], tree.room[node]
    longest = terms.arc * (2.0 if clear >= terms.open else 1.0)
    lever = 1.0 + terms.reach * abs(curvature)
    driven, extra, step = 0.0, 0.0, 0.0
    halves = 0  # where it is blocked it goes as far as it gets, by halves
    while halves <= _HALVES and driven < longest - NO_LENGTH:
        step = 0.5 * step if halves > 0 else step_to_take(clear, longest - driven, lever, terms)
        next_x, next_y, next_phi = after(x, y, phi, sign * step, curvature)
        ahead = clear_at(around, next_x, next_y, next_phi, terms.open)
        if ahead >= terms.margin:
            x, y, phi, clear = next_x, next_y, next_phi, ahead
            driven += step
            extra += step * closeness_of(clear, terms)
        if halves > 0 or ahead < terms.margin:
            halves += 1
    return x, y, phi, clear, driven, extra


@inner
def _enter(
    tree: Tree,
    node: int,
    x: float,
    y: float,
    phi: float,
    clear: float,
    length: float,
    curvature: float,
    cost: float,
    other: Tree,
    grid: CostToGo,
    terms: Terms,
) -> None:
    """Enter a pose that was come to from a node, if it is the cheapest in its cell so far."""
    root, target = tree.pose[0], other.pose[0]
    share = 0.5 if clear >= terms.open else 1.0
    if clear < terms.tight and min(_apart(x, y, target), _apart(x, y, root)) < terms.fine:
        share = terms.finer
    key = lattice_key(tree, x, y, phi, length > 0.0, share, terms.cell)
    at = slot_of(tree.keys, key)
    if tree.keys[at] != EMPTY and tree.cost[tree.place[at]] <= cost:
        return
    left = max(least_to(x, y, phi, target, terms), looked_up(grid, x, y))
    if left < inf:
        priority = cost + terms.weight * left
        new = add(tree, node, x, y, phi, length, curvature, cost, clear, priority)
        put_in_cell(tree, at, key, new)


@inner
def _apart(x: float, y: float, pose: Array) -> float:
    return hypot(x - pose[0], y - pose[1])


class HybridAStar:
    """A search from a start to one of several goals, which goes on slice by slice.

    Args:
        body, solid: the vehicle, and all that is solid; terms: see there.
        starts: (m, 3); came: (m, 2) signed length [m] and curvature [1/m] of a piece that leads to each, or
            zeros; costs: (m,) of these [m].
        goals: (n, 3); last: (n, 2) signed length [m] and curvature [1/m] of a piece that leads
            on from each of the goals.
        grids: estimates of the cost to the goal and, against time, to the start.
    """

    def __init__(
        self,
        body: BodyShape,
        solid: SolidShapes,
        terms: Terms,
        starts: Array,
        came: Array,
        costs: Array,
        goals: Array,
        last: Array,
        grids: tuple[CostToGo, CostToGo],
    ) -> None:
        self._around, self._grids, self._last = around_of(body, solid), grids, last
        # Against time forward is reverse.
        self._terms = terms, terms._replace(ahead=terms.back, back=terms.ahead)
        self._trees = [rooted(starts, came), rooted(goals, last * (-1.0, 1.0))]
        self._trees[0].cost[: len(costs)] = costs
        self._whole, self._shots, self._curves = none_found(), room_for_shots(), room_for_curves()
        self.state = SEARCHING

    def advance(self, budget: int) -> None:
        """Expand up to so many nodes in each tree."""
        for which in (1, 0):
            if self.state == SEARCHING:
                self._trees[which] = with_room(self._trees[which], budget)
                self.state = _advance(
                    self._trees[which], self._trees[1 - which], which, self._whole, self._around,
                    self._grids[which], self._terms[which], self._shots, self._curves, budget,
                )  # fmt: skip

    @property
    def expanded(self) -> int:
        """Nodes expanded so far."""
        return int(sum(tree.counters[EXPANDED] for tree in self._trees))

    @property
    def cost(self) -> float:
        """Of the best way found so far; inf without one."""
        return float(self._whole.best[COST])

    @property
    def nearest(self) -> float:
        """How near to its other end a tree came [m]."""
        return 0.0 if self.cost < inf else float(self._whole.best[NEAREST])

    def way(self) -> tuple[int, Array, Array]:
        """From which start the best way leads, (n, 2) signed lengths [m] and curvatures [1/m] of its pieces,
        and the last piece that comes after it (1, 2), or none (0, 2)."""
        whole = self._whole
        curve = whole.curve[whole.curve[:, 0] != 0.0]
        here, there = int(whole.nodes[HERE]), int(whole.nodes[THERE])
        if whole.nodes[FROM] == 1:
            here, there, curve = there, here, curve[::-1] * (-1.0, 1.0)
        to_here, start = branch_to(self._trees[0], here)
        to_there, root = branch_to(self._trees[1], there)
        last = self._last[root : root + 1]
        return start, np.vstack([to_here, curve, to_there[::-1] * (-1.0, 1.0)]), last[last[:, 0] != 0.0]
