"""The memory of the search and its estimate, each against a plain reference."""

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
from rti_mpcc.route_planner import tree
from rti_mpcc.route_planner.cost_to_go import axle_clearances, cost_to_go
from rti_mpcc.route_planner.tree import EMPTY, Heap
from tests.kernels import called

Made = TypeVar("Made")
pop, push, slot_of = called(tree.pop), called(tree.push), called(tree.slot_of)
AREA = Area(obstacles=[[(2.0, -1.0), (4.0, -1.0), (4.0, 3.0), (2.0, 3.0)]])


def test_the_heap_gives_the_least_first() -> None:
    rng = np.random.default_rng(3)
    heap = Heap(np.empty(500), np.empty(500, np.int64), np.zeros(1, np.int64))
    reference: list[float] = []
    for k in range(400):
        if reference and rng.random() < 0.4:
            assert pop(heap)[1] == heapq.heappop(reference)
        value = float(rng.random())
        heapq.heappush(reference, value)
        push(heap, value, k)
    while reference:
        assert pop(heap)[1] == heapq.heappop(reference)
    assert heap.size[0] == 0


def test_the_table_finds_what_was_entered() -> None:
    keys = np.full(1024, EMPTY)
    entered = np.random.default_rng(5).integers(0, 2**54, 600).tolist()
    for key in entered:
        keys[slot_of(keys, key)] = key
    assert all(keys[slot_of(keys, key)] == key for key in entered)
    assert (keys != EMPTY).sum() == len(set(entered))


def run(slices: Generator[None, None, Made]) -> Made:
    """The result of all slices."""
    while True:
        try:
            next(slices)
        except StopIteration as ended:
            made: Made = ended.value
            return made


@pytest.mark.parametrize("closeness", [0.0, 1.5])
def test_costs_to_go_are_those_of_dijkstra(closeness: float) -> None:
    low, high, cell = np.array([-5.0, -5.0]), np.array([9.0, 7.0]), 0.5
    clear = run(axle_clearances(AREA.grid, low, high, cell, 2.0))
    for row, column in ((3, 4), (10, 20), (20, 27)):
        at = [[low[0] + cell * (column + 0.5), low[1] + cell * (row + 0.5), 0.0]]
        exact = float(AREA.signed_distances(Body.of([(0.0, 0.0)]), np.array(at))[0])
        assert clear[row, column] == pytest.approx(min(exact, 2.0))
    config, radius = ControllerConfig(route=RoutePlanner(closeness_cost=closeness)), 0.8
    cost = run(cost_to_go(clear, low, cell, radius, np.array([-3.0, 1.0, 0.0]), config)).cost
    rows, columns = clear.shape
    least, near = radius - 0.5 * np.sqrt(2.0) * cell, radius + config.clearance.on_routes
    edges = []
    for a, b in np.ndindex(rows, columns):
        for k, m in ((a + da, b + db) for da in (-1, 0, 1) for db in (-1, 0, 1) if da or db):
            if 0 <= k < rows and 0 <= m < columns and clear[k, m] >= least:
                lack = min(max((near - clear[k, m]) / (near - least), 0.0), 1.0)
                price = cell * hypot(k - a, m - b) * (1.0 + closeness * lack)
                edges.append((price, a * columns + b, k * columns + m))
    prices, i, j = zip(*edges, strict=True)
    first = int((1.0 - low[1]) / cell) * columns + int((-3.0 - low[0]) / cell)
    graph = coo_matrix((np.array(prices), (np.array(i), np.array(j))), shape=(rows * columns,) * 2).tocsr()
    expected = dijkstra(graph, indices=first).reshape(rows, columns)
    assert cost[np.isfinite(expected)] == pytest.approx(expected[np.isfinite(expected)])
    assert (cost[~np.isfinite(expected)] == inf).all()
