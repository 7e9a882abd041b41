"""Occupancy grids as arrays: which cells are solid, and where they are.

A grid is laid out as the data of a ROS OccupancyGrid: axis 0 is the row, and the first row is the lowest one,
at the origin; axis 1 is the column, along x of the origin. A value is

- a bool: True is occupied, or
- a number from 0 (free) to 1 (occupied), or -1 or NaN: unknown; or,
- where any value is larger than 1, a percentage from 0 to 100, or -1 or NaN: unknown.

A cell is occupied from 65 % on, free up to 25 %, and unknown in between, as in ROS.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite
from typing import TypeGuard

import numpy as np
from numpy.typing import ArrayLike

from geometry.arrays import Mask
from geometry.errors import AreaError
from geometry.map_file import COARSEST, FINEST, OccupancyMap, map_of
from geometry.outline import FARTHEST
from geometry.pose import Pose2

_OCCUPIED, _FREE = 0.65, 0.25
_PERCENT = 100.0


def grid_map(
    array: ArrayLike,
    resolution: float,
    origin: Pose2 | Sequence[float],
    *,
    unknown_is_free: bool = False,
) -> OccupancyMap:
    """Return the map of a grid (rows, columns); unknown cells count as occupied, unless `unknown_is_free`.

    Args:
        array: see the module.
        resolution: length of a cell [m].
        origin: pose of the lower left corner of the first cell: x, y [m] and, if given, yaw [rad].

    Raises:
        AreaError: another shape, no cell, a value, resolution or origin out of range, or no free cell.
    """
    cells = _solid(array, unknown_is_free)
    if not (_is_number(resolution) and FINEST <= resolution <= COARSEST):
        raise AreaError(f"resolution = {resolution!r}: must be a number from {FINEST:g} to {COARSEST:g} m.")
    return map_of(cells, float(resolution), _pose(origin))


def _solid(array: ArrayLike, unknown_is_free: bool) -> Mask:
    """Which cells (rows, columns) are solid."""
    try:
        given = np.asarray(array)
    except (TypeError, ValueError) as error:
        raise AreaError("array must be numbers or bools of shape (rows, columns).") from error
    if given.dtype.kind not in "biuf":
        raise AreaError(f"array has values of type {given.dtype}, they must be numbers or bools.")
    if given.ndim != 2 or given.size == 0:
        raise AreaError(f"array has shape {given.shape}, it must be (rows, columns), one cell at least.")
    with np.errstate(over="ignore"):
        values = given.astype(np.float32)
    unknown = np.isnan(values) | (values == -1.0)
    most = _PERCENT if (values > 1.0).any() else 1.0
    odd = ~unknown & ~((values >= 0.0) & (values <= most))
    if odd.any():
        row, column = np.argwhere(odd)[0].tolist()
        raise AreaError(
            f"array[{row}, {column}] = {given[row, column]}: must be 0 to 1, or 0 to 100, or -1 for unknown."
        )
    unknown |= (values > _FREE * most) & (values < _OCCUPIED * most)
    solid: Mask = np.where(unknown, not unknown_is_free, values >= _OCCUPIED * most)
    if solid.all():
        raise AreaError("array: no cell is free, at least one must be.")
    return solid


def _pose(origin: Pose2 | Sequence[float]) -> tuple[float, float, float]:
    try:
        given = (origin.x, origin.y, origin.phi) if isinstance(origin, Pose2) else tuple(origin)
    except TypeError:
        given = ()
    pose = (*given, 0.0) if len(given) == 2 else given
    if len(pose) != 3 or not all(_is_number(value) and abs(value) <= FARTHEST for value in pose):
        raise AreaError(f"origin = {origin!r}: must be (x, y) or (x, y, yaw), at most {FARTHEST:g}.")
    x, y, yaw = map(float, pose)
    return x, y, yaw


def _is_number(value: object) -> TypeGuard[float]:
    if isinstance(value, bool) or not isinstance(value, int | float | np.integer | np.floating):
        return False
    return isfinite(value)
