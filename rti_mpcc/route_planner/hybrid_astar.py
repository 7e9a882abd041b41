"""Hybrid A*: a way for a car from one pose to another, past all that stands.

After Dolgov, Thrun, Montemerlo, Diebel, "Path planning for autonomous vehicles in unknown semi-structured
environments", IJRR 2010. Nodes are poses (x, y, heading) with the direction in which they were reached; of
the poses in one cell of a lattice the cheapest one is kept, exactly. From a node the vehicle drives arcs in
both directions, with the wheels straight, half and fully turned; one that is blocked on the way ends where it
is blocked.

Two trees grow in turn, one from the start and, against time, one from the goal: what is tight at one end is
easily left and hard to come into. Now and then the cheapest Reeds-Shepp curves from a node to places of the
other tree are tried, of which its root is one; a clear one makes a whole way.

The cost of a way, in metres: its length, more in reverse and where it is close to something, for each change
of direction, and for each change of the steering. What is left is estimated by the larger of the Reeds-Shepp
cost without obstacles and the cost of a point past them (`cost_to_go`), times a weight.
"""

from __future__ import annotations

from math import atan, cos, floor, hypot, inf, pi, sin, tan
from typing import Any, Final, NamedTuple, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from geometry.arrays import Array, Index
from geometry.compiled import Array1, Array2, Index1, IndexOut1, Out1, Out2, inner, kernel, record
from geometry.convex import WITNESS
from geometry.reeds_shepp import PIECES, WORDS, least_cost, words
from geometry.shape_grid import BodyShape, SolidShapes, clearance_at
from rti_mpcc.route_planner.cost_to_go import CostToGo, looked_up
from rti_mpcc.route_planner.priority_queue import EMPTY, pop, push, slot_of

Values = TypeVar("Values", bound=NDArray[Any])

SEARCHING: Final = 0
EXHAUSTED: Final = 1
ENDED: Final = 2
"""How a slice of a search ended: it may go on, all is searched, no better way is expected."""

_NODES: Final = 0
_QUEUED: Final = 1
_EXPANDED: Final = 2
_PLACES: Final = 3
COUNTERS: Final = 4
"""Places in the counters of a tree."""
_NONE: Final = -1
"""No node: the parent of a root."""
_HERE: Final = 0
_THERE: Final = 1
_FOUND_AT: Final = 2
_ASKED: Final = 3
"""Places in the whole way that was found: the nodes that it joins, and after how many it was found."""

_HEADINGS: Final = 72
_BRANCHES: Final = 10
_FIRST: Final = 4096  # nodes that a tree has room for at first, a power of 2
_SHOTS: Final = 3
_WORDS_TRIED: Final = 4
_SHOOTS: Final = 4
_REACH: Final = 6.0
_MOST_PLACES: Final = 1024
_LOOKS: Final = 7


@record
class Terms(NamedTuple):
    """What a way costs, and how it is searched.

    Attributes:
        radius: of the sharpest bend [m]; wheelbase: [m].
        arc: length of an arc; check: least distance of the poses at which it is checked; cell: of the lattice
            [m]. Where the body has `open` [m] beside it, arcs and cells are twice as long.
        reach: of the body from the rear axle [m].
        margin: that the body keeps at least; near: closer than this costs more [m].
        ahead, back: cost of a metre forward and in reverse; cusp, steering, closeness: see `RoutePlanner`.
        weight: of the estimate; finer: by this factor the lattice is finer near the ends, within a distance
            of `fine` [m], where the body has less than `tight` [m] beside it.
        more: after a first way so many times the nodes until then are expanded for a better one.
    """

    radius: float
    wheelbase: float
    arc: float
    check: float
    cell: float
    open: float
    reach: float
    margin: float
    near: float
    ahead: float
    back: float
    cusp: float
    steering: float
    closeness: float
    weight: float
    finer: float
    fine: float
    tight: float
    more: float


@record
class Tree(NamedTuple):
    """Nodes: how each was reached, and what it costs.

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


@record
class Whole(NamedTuple):
    """The best whole way found so far.

    Attributes:
        best: its cost, inf without one, and how near to one another the trees came [m].
        nodes: see above, of the tree that the curve is from, of the other one; which: 0 where it is from the
            start's tree.
        curve: (PIECES, 2) signed lengths [m] and curvatures [1/m], from the one to the other.
    """

    best: Out1
    nodes: IndexOut1
    which: IndexOut1
    curve: Out2


@inner
def _key(x: float, y: float, phi: float, forward: bool, share: float, cell: float) -> int:
    """Of a place in the lattice that is finer by this share."""
    size, headings = cell / share, int(_HEADINGS * share)
    i, j = floor(x / size) & 0xFFFFF, floor(y / size) & 0xFFFFF
    turn = floor(phi / (2.0 * pi) * headings + 0.5) % headings
    level = 0 if share < 1.0 else 1 if share == 1.0 else 2
    return 1 + ((((((i << 20) | j) << 12) | turn) << 3) | (level << 1) | (1 if forward else 0))


@inner
def _estimate(x: float, y: float, phi: float, target: Array, terms: Terms, grid: CostToGo) -> float:
    """Cost from a pose to the target, about: never inf where the lattice may just be too coarse."""
    return max(_free_cost(x, y, phi, target, terms), looked_up(grid, x, y))


@inner
def bound(at: Array, target: Array, terms: Terms) -> float:
    """What a way from one pose (3,) to another costs at least."""
    return _free_cost(at[0], at[1], at[2], target, terms)


@inner
def _free_cost(x: float, y: float, phi: float, target: Array, terms: Terms) -> float:
    c, s = cos(phi), sin(phi)
    dx, dy, turn = target[0] - x, target[1] - y, target[2] - phi
    along, across = c * dx + s * dy, c * dy - s * dx
    if terms.ahead > terms.back:  # searched against the way it will be driven: forward there is reverse here
        return (
            least_cost(-along, across, -turn, terms.radius, terms.ahead / terms.back, terms.cusp) * terms.back
        )
    return least_cost(along, across, turn, terms.radius, terms.back / terms.ahead, terms.cusp) * terms.ahead


@inner
def _closeness(clearance: float, terms: Terms) -> float:
    """Extra cost of a metre at such a clearance."""
    if clearance >= terms.near:
        return 0.0
    return terms.closeness * (terms.near - clearance) / (terms.near - terms.margin + 1e-9)


@kernel
def advance(
    tree: Tree,
    other: Tree,
    whole: Whole,
    which: int,
    body: BodyShape,
    solid: SolidShapes,
    grid: CostToGo,
    terms: Terms,
    budget: int,
) -> int:
    """Expand up to `budget` nodes; returns how that ended."""
    counters = tree.counters
    shape, witness = np.empty((max(solid.largest, 2), 2)), np.empty(WITNESS)
    lengths, turns, order = np.empty((WORDS, PIECES)), np.empty((WORDS, PIECES)), np.empty(WORDS)
    near, near_cost = np.empty(_SHOTS, np.int64), np.empty(_SHOTS)
    for _ in range(budget):
        node, least = _NONE, inf
        while counters[_QUEUED] > 0:
            first, least = tree.member[0], tree.priority[0]
            counters[_QUEUED] = pop(tree.priority, tree.member, counters[_QUEUED])
            if tree.closed[first] == 0:
                node = first
                break
        if node == _NONE:
            return ENDED if whole.best[0] < inf else EXHAUSTED
        if whole.best[0] < inf:
            expanded = counters[_EXPANDED] + other.counters[_EXPANDED]
            if least >= whole.best[0] or expanded > (1.0 + terms.more) * whole.nodes[_FOUND_AT]:
                return ENDED
        tree.closed[node] = 1
        counters[_EXPANDED] += 1
        x, y = tree.pose[node, 0], tree.pose[node, 1]
        left = hypot(other.pose[0, 0] - x, other.pose[0, 1] - y)
        whole.best[1] = min(whole.best[1], left)
        _take_place(tree, node, terms)
        whole.nodes[_ASKED] += 1
        if whole.nodes[_ASKED] % _SHOOTS == 0 or counters[_EXPANDED] <= 2:
            _shoot(
                tree, node, other, whole, which, body, solid, terms, lengths, turns, order, near, near_cost,
                shape, witness,
            )  # fmt: skip
        _branch(tree, node, other, whole, body, solid, grid, terms, shape, witness)
    return SEARCHING


@inner
def _take_place(tree: Tree, node: int, terms: Terms) -> None:
    """Let curves from the other tree lead to this node, if it is the first in its place."""
    x, y = tree.pose[node, 0] - tree.pose[0, 0], tree.pose[node, 1] - tree.pose[0, 1]
    size = 0.5 * terms.radius
    i, j = floor(x / size) & 0xFFFFF, floor(y / size) & 0xFFFFF
    turn = floor(tree.pose[node, 2] / (2.0 * pi) * 8.0 + 0.5) % 8
    key = 1 + ((((i << 20) | j) << 3) | turn)
    count = tree.counters[_PLACES]
    if count >= len(tree.places):
        return
    at = slot_of(tree.taken, key)
    if tree.taken[at] == EMPTY:
        tree.taken[at] = key
        tree.places[count] = node
        tree.counters[_PLACES] = count + 1


@inner
def _branch(
    tree: Tree,
    node: int,
    other: Tree,
    whole: Whole,
    body: BodyShape,
    solid: SolidShapes,
    grid: CostToGo,
    terms: Terms,
    shape: Array,
    witness: Array,
) -> None:
    """Enter what can be reached from a node by one arc."""
    came, bent = tree.piece[node, 0], tree.piece[node, 1]
    root, target = tree.pose[0], other.pose[0]
    for sign in range(-1, 2, 2):  # _BRANCHES in all
        for wheel in range(-2, 3):
            # Half and fully turned wheels, not half and full curvature.
            steering = 0.5 * wheel * atan(terms.wheelbase / terms.radius)
            curvature = tan(steering) / terms.wheelbase
            if came != 0.0 and sign * came < 0.0 and curvature == bent:
                continue  # the way that it came
            base = tree.cost[node]
            if came != 0.0:
                base += terms.steering * abs(steering - atan(terms.wheelbase * bent))
                if sign * came < 0.0:
                    base += terms.cusp
            x, y, phi = tree.pose[node, 0], tree.pose[node, 1], tree.pose[node, 2]
            clear, extra, driven = tree.room[node], 0.0, 0.0
            longest = terms.arc * (2.0 if clear >= terms.open else 1.0)
            lever = 1.0 + terms.reach * abs(curvature)
            step = 0.0
            while driven < longest - 1e-9:
                # So far no point of the body comes to the margin, or as far as it is looked at.
                step = max((clear - terms.margin) / lever, terms.check)
                left = longest - driven
                step = left if step >= left else min(step, 0.5 * left)
                next_x, next_y, next_phi = after(x, y, phi, sign * step, curvature)
                ahead = clearance_at(body, solid, next_x, next_y, next_phi, terms.open, shape, witness)
                if ahead < terms.margin:
                    break
                x, y, phi, clear = next_x, next_y, next_phi, ahead
                driven += step
                extra += step * _closeness(clear, terms)
            if driven < longest - 1e-9:
                # As far as it gets: by halves.
                for _ in range(3):
                    step *= 0.5
                    next_x, next_y, next_phi = after(x, y, phi, sign * step, curvature)
                    ahead = clearance_at(body, solid, next_x, next_y, next_phi, terms.open, shape, witness)
                    if ahead >= terms.margin:
                        x, y, phi, clear = next_x, next_y, next_phi, ahead
                        driven += step
                        extra += step * _closeness(clear, terms)
            if driven < 0.3 * terms.check:
                continue
            metre = terms.ahead if sign > 0 else terms.back
            cost = base + metre * driven + extra
            if cost >= whole.best[0]:
                continue
            ends = min(hypot(x - target[0], y - target[1]), hypot(x - root[0], y - root[1]))
            share = (
                terms.finer
                if clear < terms.tight and ends < terms.fine
                else 0.5
                if clear >= terms.open
                else 1.0
            )
            key = _key(x - root[0], y - root[1], phi, sign > 0, share, terms.cell)
            at = slot_of(tree.keys, key)
            if tree.keys[at] != EMPTY and tree.cost[tree.place[at]] <= cost:
                continue
            left = _estimate(x, y, phi, target, terms, grid)
            if left == inf:
                continue
            new = tree.counters[_NODES]
            tree.counters[_NODES] = new + 1
            tree.pose[new, 0], tree.pose[new, 1], tree.pose[new, 2] = x, y, phi
            tree.piece[new, 0], tree.piece[new, 1] = sign * driven, curvature
            tree.cost[new], tree.room[new], tree.parent[new], tree.closed[new] = cost, clear, node, 0
            if tree.keys[at] != EMPTY:
                tree.closed[tree.place[at]] = 1
            tree.keys[at] = key
            tree.place[at] = new
            tree.counters[_QUEUED] = push(
                tree.priority, tree.member, tree.counters[_QUEUED], cost + terms.weight * left, new
            )


@inner
def after(x: float, y: float, phi: float, length: float, curvature: float) -> tuple[float, float, float]:
    """The pose after an arc of a signed length [m], (2) of geometry.part."""
    half = 0.5 * curvature * length
    chord = length * (sin(half) / half if abs(half) > 1e-12 else 1.0)
    return x + chord * cos(phi + half), y + chord * sin(phi + half), phi + 2.0 * half


@inner
def _shoot(
    tree: Tree,
    node: int,
    other: Tree,
    whole: Whole,
    which: int,
    body: BodyShape,
    solid: SolidShapes,
    terms: Terms,
    lengths: Array,
    turns: Array,
    order: Array,
    near: Index,
    near_cost: Array,
    shape: Array,
    witness: Array,
) -> None:
    """Try curves from a node to the cheapest places of the other tree; keep the best whole way."""
    x, y, phi = tree.pose[node, 0], tree.pose[node, 1], tree.pose[node, 2]
    c, s = cos(phi), sin(phi)
    count = 0
    for k in range(other.counters[_PLACES]):
        there = other.places[k]
        dx, dy = other.pose[there, 0] - x, other.pose[there, 1] - y
        if k > 1 and hypot(dx, dy) > _REACH * terms.radius:
            continue
        cost = other.cost[there] + _free_cost(x, y, phi, other.pose[there], terms)
        if tree.cost[node] + cost >= whole.best[0]:
            continue
        # The cheapest ones, in order.
        if count < len(near):
            at, count = count, count + 1
        elif cost < near_cost[count - 1]:
            at = count - 1
        else:
            continue
        while at > 0 and near_cost[at - 1] > cost:
            near[at], near_cost[at] = near[at - 1], near_cost[at - 1]
            at -= 1
        near[at], near_cost[at] = there, cost
    curve = np.zeros((PIECES, 2))
    for k in range(count):
        there = near[k]
        dx, dy = other.pose[there, 0] - x, other.pose[there, 1] - y
        found = words(
            (c * dx + s * dy) / terms.radius, (c * dy - s * dx) / terms.radius, other.pose[there, 2] - phi,
            lengths, turns,
        )  # fmt: skip
        base = tree.cost[node] + other.cost[there]
        onward, onward_bent = -other.piece[there, 0], other.piece[there, 1]
        for i in range(found):
            as_pieces(lengths[i], turns[i], terms.radius, curve)
            order[i] = base + cost_along(curve, tree.piece[node, 0], tree.piece[node, 1], terms)
            order[i] += _joint_cost(curve, onward, onward_bent, terms)
        for _ in range(min(found, _WORDS_TRIED)):
            i = int(np.argmin(order[:found]))
            if order[i] >= whole.best[0]:
                break
            as_pieces(lengths[i], turns[i], terms.radius, curve)
            extra, _ = closeness_along(x, y, phi, curve, terms, body, solid, shape, witness)
            if order[i] + extra < whole.best[0]:
                if whole.best[0] == inf:
                    whole.nodes[_FOUND_AT] = tree.counters[_EXPANDED] + other.counters[_EXPANDED]
                whole.best[0] = order[i] + extra
                whole.nodes[_HERE], whole.nodes[_THERE], whole.which[0] = node, there, which
                whole.curve[:] = curve
            order[i] = inf


@inner
def _joint_cost(curve: Array, onward: float, bent: float, terms: Terms) -> float:
    """What it costs to go on from a curve with a piece of signed length `onward` [m] and curvature `bent`."""
    if onward == 0.0:
        return 0.0
    for k in range(len(curve) - 1, -1, -1):
        if curve[k, 0] != 0.0:
            steering = abs(atan(terms.wheelbase * bent) - atan(terms.wheelbase * curve[k, 1]))
            return terms.steering * steering + (terms.cusp if curve[k, 0] * onward < 0.0 else 0.0)
    return 0.0


@inner
def as_pieces(lengths: Array, turns: Array, radius: float, pieces: Array) -> None:
    """A word as signed lengths [m] and curvatures [1/m] of its pieces (PIECES, 2)."""
    for k in range(PIECES):
        pieces[k, 0] = lengths[k] * radius if abs(lengths[k]) * radius > 1e-9 else 0.0
        pieces[k, 1] = turns[k] / radius


@inner
def cost_along(pieces: Array, came: float, bent: float, terms: Terms) -> float:
    """Cost of a curve, after a piece of signed length `came` [m] and curvature `bent` [1/m], but for how
    close it is to anything."""
    cost, before, steering = 0.0, came, atan(terms.wheelbase * bent)
    for k in range(len(pieces)):
        length = pieces[k, 0]
        if length == 0.0:
            continue
        turned = atan(terms.wheelbase * pieces[k, 1])
        cost += length * terms.ahead if length > 0.0 else -length * terms.back
        if before != 0.0:
            cost += terms.steering * abs(turned - steering)
            if before * length < 0.0:
                cost += terms.cusp
        before, steering = length, turned
    return cost


@inner
def closeness_along(
    x: float,
    y: float,
    phi: float,
    pieces: Array,
    terms: Terms,
    body: BodyShape,
    solid: SolidShapes,
    shape: Array,
    witness: Array,
) -> tuple[float, int]:
    """What a curve costs for being close to something, inf where it is closer than the margin, and the number
    of poses that were looked at for that."""
    if _is_blocked(x, y, phi, pieces, terms, body, solid, shape, witness):
        return inf, _LOOKS
    extra, clear, looks = 0.0, 0.0, _LOOKS
    for k in range(len(pieces)):
        if pieces[k, 0] == 0.0:
            continue
        sign, left = (1.0, pieces[k, 0]) if pieces[k, 0] > 0.0 else (-1.0, -pieces[k, 0])
        lever = 1.0 + terms.reach * abs(pieces[k, 1])
        while left > 1e-9:
            step = max((clear - terms.margin) / lever, terms.check)
            step = left if step >= left else min(step, 0.5 * left)
            x, y, phi = after(x, y, phi, sign * step, pieces[k, 1])
            clear = clearance_at(body, solid, x, y, phi, terms.open, shape, witness)
            looks += 1
            if clear < terms.margin:
                return inf, looks
            extra += step * _closeness(clear, terms)
            left -= step
    return extra, looks


@inner
def _is_blocked(
    x: float,
    y: float,
    phi: float,
    pieces: Array,
    terms: Terms,
    body: BodyShape,
    solid: SolidShapes,
    shape: Array,
    witness: Array,
) -> bool:
    """Whether a curve is blocked at one of a few poses, from its middle on: soon known of most that are."""
    whole = 0.0
    for k in range(len(pieces)):
        whole += abs(pieces[k, 0])
    for eighths in (4, 2, 6, 1, 3, 5, 7):
        at_x, at_y, at_phi, left = x, y, phi, 0.125 * eighths * whole
        for k in range(len(pieces)):
            length = min(max(pieces[k, 0], -left), left)
            if length != 0.0:
                at_x, at_y, at_phi = after(at_x, at_y, at_phi, length, pieces[k, 1])
                left -= abs(length)
        if clearance_at(body, solid, at_x, at_y, at_phi, terms.margin, shape, witness) < terms.margin:
            return True
    return False


def poses_after(start: Array, way: Array) -> Array:
    """The poses (n, 3) after each of the pieces (n, 2) of a way from `start` (3,)."""
    found = np.empty((len(way), 3))
    _trace(start, way, found)
    return found


@kernel
def _trace(start: Array1, way: Array2, found: Out2) -> None:
    x, y, phi = start[0], start[1], start[2]
    for k in range(len(way)):
        x, y, phi = after(x, y, phi, way[k, 0], way[k, 1])
        found[k, 0], found[k, 1], found[k, 2] = x, y, phi


class HybridAStar:
    """A search from a start to one of several goals, which goes on slice by slice.

    Args:
        body, solid: the vehicle, and all that is solid; terms: see there.
        start: (3,); goals: (n, 3); last: (n, 2) signed length [m] and curvature [1/m] of a piece that leads
            on from each of the goals.
        grids: estimates of the cost to the goal and, against time, to the start.
    """

    def __init__(
        self,
        body: BodyShape,
        solid: SolidShapes,
        terms: Terms,
        start: Array,
        goals: Array,
        last: Array,
        grids: tuple[CostToGo, CostToGo],
    ) -> None:
        self._body, self._solid, self._grids = body, solid, grids
        # Against time forward is reverse.
        self._terms = terms, terms._replace(ahead=terms.back, back=terms.ahead)
        self._last = last
        self._trees = [_rooted(start[None], np.zeros((1, 2))), _rooted(goals, last * (-1.0, 1.0))]
        self._whole = Whole(
            best=np.array([inf, inf]),
            nodes=np.zeros(4, np.int64),
            which=np.zeros(1, np.int64),
            curve=np.zeros((PIECES, 2)),
        )
        self.state = SEARCHING

    def advance(self, budget: int) -> None:
        """Expand up to so many nodes in each tree."""
        for which in (1, 0):
            if self.state == SEARCHING:
                self._trees[which] = _with_room(self._trees[which], budget)
                self.state = advance(
                    self._trees[which], self._trees[1 - which], self._whole, which, self._body, self._solid,
                    self._grids[which], self._terms[which], budget,
                )  # fmt: skip

    @property
    def expanded(self) -> int:
        """Nodes expanded so far."""
        return int(sum(tree.counters[_EXPANDED] for tree in self._trees))

    @property
    def cost(self) -> float:
        """Of the best way found so far; inf without one."""
        return float(self._whole.best[0])

    @property
    def nearest(self) -> float:
        """How near to its other end a tree came [m]."""
        return 0.0 if self.cost < inf else float(self._whole.best[1])

    def way(self) -> tuple[Array, Array]:
        """The best way, (n, 2) signed lengths [m] and curvatures [1/m] of its pieces, and the last piece that
        comes after it (1, 2), or none (0, 2)."""
        whole = self._whole
        curve = whole.curve[whole.curve[:, 0] != 0.0]
        here, there = int(whole.nodes[_HERE]), int(whole.nodes[_THERE])
        if whole.which[0] == 1:
            here, there, curve = there, here, curve[::-1] * (-1.0, 1.0)
        to_here, _ = _branch_to(self._trees[0], here)
        to_there, root = _branch_to(self._trees[1], there)
        last = self._last[root : root + 1]
        return np.vstack([to_here, curve, to_there[::-1] * (-1.0, 1.0)]), last[last[:, 0] != 0.0]


def _rooted(roots: Array, came: Array) -> Tree:
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
    tree.parent[:count], tree.closed[:count] = _NONE, 0
    tree.priority[:count], tree.member[:count] = 0.0, np.arange(count)
    tree.counters[_NODES] = tree.counters[_QUEUED] = count
    # Curves lead to a root from the first on.
    tree.places[:count], tree.counters[_PLACES] = np.arange(count), count
    return tree


def _with_room(tree: Tree, expanded: int) -> Tree:
    """The same tree, with room for what comes of so many nodes that are expanded: twice of all, or itself."""
    if tree.counters[_NODES] + _BRANCHES * expanded <= len(tree.cost):
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


def _branch_to(tree: Tree, node: int) -> tuple[Array, int]:
    """Pieces (n, 2) from a root to a node, and the root."""
    found = []
    while tree.parent[node] != _NONE:
        found.append(tree.piece[node].copy())
        node = int(tree.parent[node])
    return np.array(found[::-1]).reshape(-1, 2), node
