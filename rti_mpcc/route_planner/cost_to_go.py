"""Cost from every place to one past all that is solid, for a point: Dijkstra on a grid.

The point is the middle of the rear axle, with the largest disc around it that is inside the body. So the grid
is a lower bound for any vehicle. A metre close to something costs more: the body is larger than that disc.
"""

from __future__ import annotations

from collections.abc import Generator
from math import hypot, inf, sqrt
from typing import NamedTuple

import numpy as np

from geometry.arrays import Array, locked
from geometry.compiled import Array1, Array2, Out2, inner, kernel
from geometry.shape_grid import POINT, ShapeGrid
from rti_mpcc.config import ControllerConfig
from rti_mpcc.route_planner.tree import Heap, pop, push

_SLICE = 1024  # places that are checked at a time
_POPS = 8192  # cells that are taken from the heap at a time


class CostToGo(NamedTuple):
    """Costs at the middles of square cells.

    Attributes:
        cost: (rows, columns) [m]; inf where there is no route.
        origin: (2,) of the first cell's corner [m]; cell: [m].
    """

    cost: Array2
    origin: Array1
    cell: float


def axle_clearances(
    solid: ShapeGrid, low: Array, high: Array, cell: float, reach: float
) -> Generator[None, None, Array]:
    """Distances (rows, columns) of the rear axle to all that is solid, up to `reach` [m], at the middles of
    cells from `low` (2,) to `high` (2,) [m]; slice by slice."""
    columns, rows = np.maximum(np.ceil((high - low) / cell).astype(int), 1)
    x, y = low[0] + cell * (np.arange(columns) + 0.5), low[1] + cell * (np.arange(rows) + 0.5)
    points = np.zeros((rows * columns, 3))
    points[:, 0], points[:, 1] = np.tile(x, rows), np.repeat(y, columns)
    clear = np.empty(rows * columns)
    for first in range(0, len(points), _SLICE):
        some = slice(first, first + _SLICE)
        clear[some] = solid.signed_distances(POINT, points[some], reach)[:, 0]
        yield
    return np.minimum(clear, reach).reshape(rows, columns)


def cost_to_go(
    clear: Array, low: Array, cell: float, radius: float, to: Array, config: ControllerConfig
) -> Generator[None, None, CostToGo]:
    """The costs to a pose, from distances as `axle_clearances` gives them; slice by slice.

    Args:
        radius: of the disc that has to fit [m].
    """
    rows, columns = clear.shape
    row = min(max(int((to[1] - low[1]) / cell), 0), rows - 1)
    column = min(max(int((to[0] - low[0]) / cell), 0), columns - 1)
    cost = np.full(clear.shape, inf)
    cost[row, column] = 0.0
    # Each cell is entered by each of its neighbours at most.
    most = 8 * clear.size + 1
    queue = Heap(np.empty(most), np.empty(most, np.int64), np.ones(1, np.int64))
    queue.priority[0], queue.member[0] = 0.0, row * columns + column
    # A cell counts as free if any place in it may be.
    least, near = radius - 0.5 * sqrt(2.0) * cell, radius + config.clearance.on_routes
    lack = np.clip((near - clear) / (near - least), 0.0, 1.0)
    price = locked(np.where(clear < least, inf, 1.0 + config.route.closeness_cost * lack))
    while queue.size[0] > 0:
        _dijkstra(price, cell, queue, _POPS, cost)
        yield
    return CostToGo(cost=locked(cost), origin=locked(low.copy()), cell=cell)


@kernel
def _dijkstra(price: Array2, cell: float, queue: Heap, budget: int, cost: Out2) -> None:
    """Take up to `budget` cells from the queue; `price`: of a metre in each cell."""
    rows, columns = price.shape
    for _ in range(budget):
        if queue.size[0] == 0:
            break
        node, value = pop(queue)
        i, j = node // columns, node % columns
        if value > cost[i, j]:
            continue
        for di in range(-1, 2):
            for dj in range(-1, 2):
                k, m = i + di, j + dj
                if (di == 0 and dj == 0) or k < 0 or m < 0 or k >= rows or m >= columns:
                    continue
                there = value + cell * hypot(di, dj) * price[k, m]
                if there < cost[k, m]:
                    cost[k, m] = there
                    push(queue, there, k * columns + m)


@inner
def cost_at(known: CostToGo, x: float, y: float) -> float:
    """Cost at a place, of its cell less the largest error within a cell [m]; inf outside."""
    row, column = int((y - known.origin[1]) / known.cell), int((x - known.origin[0]) / known.cell)
    rows, columns = known.cost.shape
    if y < known.origin[1] or x < known.origin[0] or row >= rows or column >= columns:
        return inf
    left: float = max(known.cost[row, column] - known.cell, 0.0)
    return left
