"""The pieces of the planner, each against a plain reference."""

from __future__ import annotations

import heapq
from collections.abc import Generator
from math import hypot, inf
from typing import TypeVar

import numpy as np
import pytest
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import dijkstra

from geometry import Area
from geometry.shape_grid import Body
from rti_mpcc.config import ControllerConfig, RoutePlanner
from rti_mpcc.route_planner.cost_to_go import axle_clearances, cost_to_go
from rti_mpcc.route_planner.priority_queue import EMPTY, pop, push, slot_of
from rti_mpcc.route_planner.tree import BRANCHES, NODES, branch_to, rooted, with_room
from rti_mpcc.types import Array

Made = TypeVar("Made")
BOX = [(2.0, -1.0), (4.0, -1.0), (4.0, 3.0), (2.0, 3.0)]


def test_the_heap_gives_the_least_first() -> None:
    rng = np.random.default_rng(3)
    priority, member, size = np.empty(500), np.empty(500, np.int64), 0
    reference: list[float] = []
    for k in range(400):
        if reference and rng.random() < 0.4:
            assert priority[0] == heapq.heappop(reference)
            size = pop(priority, member, size)
        value = float(rng.random())
        heapq.heappush(reference, value)
        size = push(priority, member, size, value, k)
    while reference:
        assert priority[0] == heapq.heappop(reference)
        size = pop(priority, member, size)
    assert size == 0


def test_the_table_finds_what_was_entered() -> None:
    rng = np.random.default_rng(5)
    keys = np.full(1024, EMPTY)
    entered = rng.integers(0, 2**54, 600)
    for key in entered.tolist():
        keys[slot_of(keys, key)] = key
    for key in entered.tolist():
        assert keys[slot_of(keys, key)] == key
    assert (keys != EMPTY).sum() == len(set(entered.tolist()))


def test_a_tree_that_grows_keeps_all_that_it_has() -> None:
    tree = rooted(np.array([(1.0, 2.0, 3.0)]), np.array([(0.5, 0.1)]))
    rng = np.random.default_rng(4)
    count = 400
    tree.pose[1:count], tree.cost[1:count] = rng.random((count - 1, 3)), rng.random(count - 1)
    tree.parent[1:count], tree.counters[NODES] = np.arange(count - 1), count
    keys = 1 + rng.integers(0, 2**54, count)
    for node, key in enumerate(keys.tolist()):
        at = slot_of(tree.keys, key)
        tree.keys[at], tree.place[at] = key, node
    room = len(tree.cost)
    assert with_room(tree, 1) is tree
    larger = with_room(tree, room // BRANCHES)
    assert len(larger.cost) == len(larger.member) == 2 * room
    assert len(larger.keys) == 2 * len(tree.keys)
    assert larger.pose[:count].tolist() == tree.pose[:count].tolist()
    assert larger.cost[:count].tolist() == tree.cost[:count].tolist()
    for node, key in enumerate(keys.tolist()):
        assert larger.place[slot_of(larger.keys, key)] == node
    assert branch_to(larger, 5)[1] == 0


def whole(slices: Generator[None, None, Made]) -> Made:
    """What comes of all slices."""
    while True:
        try:
            next(slices)
        except StopIteration as ended:
            made: Made = ended.value
            return made


def grid() -> tuple[Array, Array, float]:
    low, high, cell = np.array([-5.0, -5.0]), np.array([9.0, 7.0]), 0.5
    solid = Area(obstacles=[BOX]).grid
    return whole(axle_clearances(solid, low, high, cell, 2.0)), low, cell


def test_clearances_of_the_axle_are_those_of_a_point() -> None:
    apart, low, cell = grid()
    for row, column in ((3, 4), (10, 20), (20, 27)):
        at = [[low[0] + cell * (column + 0.5), low[1] + cell * (row + 0.5), 0.0]]
        exact = float(Area(obstacles=[BOX]).signed_distances(Body.of([(0.0, 0.0)]), np.array(at))[0])
        assert apart[row, column] == pytest.approx(min(exact, 2.0))


@pytest.mark.parametrize("closeness", [0.0, 1.5])
def test_costs_to_go_are_those_of_dijkstra(closeness: float) -> None:
    apart, low, cell = grid()
    config, radius = ControllerConfig(route=RoutePlanner(closeness_cost=closeness)), 0.8
    found = whole(cost_to_go(apart, low, cell, radius, (-3.0, 1.0), config)).cost
    rows, columns = apart.shape
    least, near = radius - 0.5 * np.sqrt(2.0) * cell, radius + config.clearance.on_routes
    i, j, costs = [], [], []
    for a in range(rows):
        for b in range(columns):
            for da in (-1, 0, 1):
                for db in (-1, 0, 1):
                    k, m = a + da, b + db
                    if (da, db) == (0, 0) or not (0 <= k < rows and 0 <= m < columns) or apart[k, m] < least:
                        continue
                    lack = min(max((near - apart[k, m]) / (near - least), 0.0), 1.0)
                    i.append(a * columns + b)
                    j.append(k * columns + m)
                    costs.append(cell * hypot(da, db) * (1.0 + closeness * lack))
    first = int((1.0 - low[1]) / cell) * columns + int((-3.0 - low[0]) / cell)
    graph = coo_matrix((np.array(costs), (np.array(i), np.array(j))), shape=(rows * columns,) * 2).tocsr()
    expected = dijkstra(graph, indices=first).reshape(rows, columns)
    assert found[np.isfinite(expected)] == pytest.approx(expected[np.isfinite(expected)])
    assert (found[~np.isfinite(expected)] == inf).all()
