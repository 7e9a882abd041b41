"""Paths in CSV files."""

from __future__ import annotations

import csv
from math import isfinite
from os import PathLike

import numpy as np
from numpy.typing import NDArray

from geometry.errors import PathError

_COLUMNS = ("x", "y", "heading", "direction")


def read_poses(file: str | PathLike[str]) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Read vehicle poses (n, 3) [m, m, rad] and directions (n,) from the columns x, y, heading, direction.

    Raises:
        PathError: the file cannot be read, a column is missing, an entry is no finite number; rows are
            counted as the lines of the file, the header being row 1.
    """
    try:
        with open(file, newline="", encoding="utf-8-sig") as stream:
            lines = [
                (i, row) for i, row in enumerate(csv.reader(stream), start=1) if any(map(str.strip, row))
            ]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise PathError(f"{file}: cannot be read ({error}).") from error
    header = [name.strip() for name in lines[0][1]] if lines else []
    for name in _COLUMNS:
        if name not in header:
            raise PathError(f"{file}: column {name} is missing, a path needs {', '.join(_COLUMNS)}.")
    columns = [header.index(name) for name in _COLUMNS]
    rows = np.array([[_number(file, i, row, j, header[j]) for j in columns] for i, row in lines[1:]])
    rows = rows.reshape(-1, 4)
    for (i, _), direction in zip(lines[1:], rows[:, 3], strict=True):
        if direction not in (1.0, -1.0):
            raise PathError(f"{file}: row {i}, column direction: {direction:g} must be 1 or -1.")
    return rows[:, :3], rows[:, 3].astype(np.int64)


def _number(file: str | PathLike[str], line: int, row: list[str], column: int, name: str) -> float:
    text = row[column].strip() if column < len(row) else ""
    try:
        value = float(text)
    except ValueError:
        value = float("nan")
    if not isfinite(value):
        raise PathError(f"{file}: row {line}, column {name}: '{text}' is not a finite number.")
    return value
