"""Paths in CSV files."""

from __future__ import annotations

import csv
from array import array
from io import TextIOWrapper
from math import isfinite

import numpy as np
from numpy.typing import NDArray

from geometry.errors import PathError, shown
from geometry.files import TABLE, File, opened

_COLUMNS = ("x", "y", "heading", "direction")


def read_poses(file: File) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Read vehicle poses (n, 3) [m, m, rad] and directions (n,) from the columns x, y, heading, direction.

    Raises:
        PathError: the file cannot be read, a column is missing, an entry is no finite number; rows are
            counted as the lines of the file, the header being row 1.
    """
    try:
        with TextIOWrapper(opened(file, TABLE), encoding="utf-8-sig", newline="") as stream:
            lines = enumerate(csv.reader(stream), start=1)
            filled = ((i, row) for i, row in lines if any(map(str.strip, row)))
            columns = _columns(file, next(filled, (1, []))[1])
            values = array("d")  # a row at a time: as text it takes far more
            for i, row in filled:
                numbers = [_number(file, i, row, j, name) for name, j in columns.items()]
                if numbers[-1] not in (1.0, -1.0):
                    raise PathError(f"{file}: row {i}, column direction: {numbers[-1]:g} must be 1 or -1.")
                values.extend(numbers)
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise PathError(f"{file}: cannot be read ({error}).") from error
    rows = np.array(values).reshape(-1, len(_COLUMNS))
    return rows[:, :3].copy(), rows[:, 3].astype(np.int64)


def _columns(file: File, row: list[str]) -> dict[str, int]:
    """Where in a row each column is."""
    header = [name.strip() for name in row]
    for name in _COLUMNS:
        if name not in header:
            raise PathError(f"{file}: column {name} is missing, a path needs {', '.join(_COLUMNS)}.")
    return {name: header.index(name) for name in _COLUMNS}


def _number(file: File, line: int, row: list[str], column: int, name: str) -> float:
    text = row[column].strip() if column < len(row) else ""
    try:
        value = float(text)
    except ValueError:
        value = float("nan")
    if not isfinite(value):
        raise PathError(f"{file}: row {line}, column {name}: {shown(text)} is not a finite number.")
    return value
