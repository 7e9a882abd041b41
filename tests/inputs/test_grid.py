"""Areas from occupancy grids that are arrays: which cells are solid, and where they are."""

from __future__ import annotations

from math import nan, pi
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from geometry import Area, AreaError, Pose2
from geometry.shape_grid import Body
from tests.rti_mpcc.simulation.conftest import write_map

POINT = Body.of([(0.0, 0.0)])


def solid(area: Area, shape: tuple[int, int], resolution: float) -> list[list[int]]:
    """Which cells of a grid at (0, 0) are solid, as points in their middles tell."""
    row, column = np.indices(shape)
    middles = np.column_stack([resolution * (column.ravel() + 0.5), resolution * (row.ravel() + 0.5)])
    found = area.signed_distances(POINT, np.column_stack([middles, np.zeros(len(middles))]))
    return (found < 0.0).astype(int).reshape(shape).tolist()


def test_the_first_row_is_at_the_origin_and_columns_run_along_x() -> None:
    area = Area.from_grid(np.array([[False, True, False], [False, False, False]]), 0.5, (10.0, -3.0, 0.0))
    assert area.boundary is not None
    np.testing.assert_allclose(area.boundary, [(10.0, -3.0), (11.5, -3.0), (11.5, -2.0), (10.0, -2.0)])
    np.testing.assert_allclose(area.obstacles, [[(10.5, -3.0), (11.0, -3.0), (11.0, -2.5), (10.5, -2.5)]])


@pytest.mark.parametrize("origin", [(1.0, 2.0, 0.5 * pi), [1, 2, 0.5 * pi], Pose2(1.0, 2.0, 0.5 * pi)])
def test_the_origin_may_be_turned(origin: Any) -> None:
    area = Area.from_grid([[1, 0]], resolution=1, origin=origin)
    np.testing.assert_allclose(area.obstacles, [[(1.0, 2.0), (1.0, 3.0), (0.0, 3.0), (0.0, 2.0)]], atol=1e-12)


@pytest.mark.parametrize(
    ("array", "expected"),
    [
        ([[True, False]], [[1, 0]]),
        (np.array([[1, 0]], dtype=np.uint8), [[1, 0]]),
        (np.array([[1, 0, -1]], dtype=np.int8), [[1, 0, 1]]),
        (np.array([[100, 0, -1, 65, 64, 26, 25, 1]], dtype=np.int8), [[1, 0, 1, 1, 1, 1, 0, 0]]),
        (np.array([[0.65, 0.25, nan, 0.5]], dtype=np.float32), [[1, 0, 1, 1]]),
    ],
)
def test_values(array: Any, expected: list[list[int]]) -> None:
    area = Area.from_grid(array, 0.2)
    assert solid(area, np.shape(array), 0.2) == expected


def test_it_is_the_same_as_the_map_with_these_cells(tmp_path: Path) -> None:
    cells = np.random.default_rng(0).random((20, 30)) < 0.3
    pixels = np.where(cells[::-1], 0, 255).astype(np.uint8)
    file = write_map(tmp_path, pixels, 0.1, (3.0, -4.0, 0.7))
    read, built = Area.from_map(file), Area.from_grid(cells, 0.1, (3.0, -4.0, 0.7))
    np.testing.assert_array_equal(built.boundary, read.boundary)
    np.testing.assert_array_equal(built.obstacles, read.obstacles)


EMPTY: NDArray[np.bool_] = np.zeros((2, 2), dtype=bool)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (([True, False], 0.1), r"shape \(2,\), it must be \(rows, columns\)"),
        ((np.zeros((0, 3)), 0.1), r"shape \(0, 3\)"),
        ((np.zeros((2, 2, 3)), 0.1), r"shape \(2, 2, 3\)"),
        (([["free"]], 0.1), "numbers or bools"),
        (([[1.0], [1.0, 2.0]], 0.1), "numbers or bools"),
        (([[None]], 0.1), "numbers or bools"),
        (([[1j]], 0.1), "numbers or bools"),
        (([[0, 255]], 0.1), r"array\[0, 1\] = 255: must be 0 to 1, or 0 to 100, or -1 for unknown"),
        (([[0, -2]], 0.1), r"array\[0, 1\] = -2"),
        (([[0.0, np.inf]], 0.1), r"array\[0, 1\] = inf"),
        (([[1, -1]], 0.1), "no cell of the map is free"),
        ((EMPTY, 0.0), "resolution = 0.0: must be a number from 1e-06 to 1e"),
        ((EMPTY, nan), "resolution = nan"),
        ((EMPTY, "0.1"), "resolution = '0.1'"),
        ((EMPTY, 0.1, (0.0,)), r"origin = \(0.0,\): must be \(x, y\) or \(x, y, yaw\)"),
        ((EMPTY, 0.1, (0.0, 0.0, 0.0, 0.0)), "origin"),
        ((EMPTY, 0.1, (0.0, nan, 0.0)), "origin"),
        ((EMPTY, 0.1, "abc"), "origin"),
        ((EMPTY, 0.1, None), "origin"),
    ],
)
def test_what_is_no_grid_is_refused(arguments: Any, said: str) -> None:
    with pytest.raises(AreaError, match=said):
        Area.from_grid(*arguments)
