"""Angles on the circle and their branches on the real line [rad]."""

from __future__ import annotations

from math import ceil, pi
from typing import overload

import numpy as np
from numpy.typing import NDArray


@overload
def wrap(angle: float) -> float: ...
@overload
def wrap(angle: NDArray[np.float64]) -> NDArray[np.float64]: ...
def wrap(angle: float | NDArray[np.float64]) -> float | NDArray[np.float64]:
    """Return the same angle in (-pi, pi] [rad]; scalars give a float, arrays keep their shape."""
    if isinstance(angle, np.ndarray):
        return np.asarray(angle - 2.0 * pi * np.ceil((angle - pi) / (2.0 * pi)), dtype=np.float64)
    return float(angle - 2.0 * pi * ceil((angle - pi) / (2.0 * pi)))


@overload
def lift(angle: float, near: float) -> float: ...
@overload
def lift(angle: NDArray[np.float64], near: float | NDArray[np.float64]) -> NDArray[np.float64]: ...
@overload
def lift(angle: float, near: NDArray[np.float64]) -> NDArray[np.float64]: ...
def lift(
    angle: float | NDArray[np.float64], near: float | NDArray[np.float64]
) -> float | NDArray[np.float64]:
    """Return the same angle on the branch nearest to `near`, i.e. within pi of it [rad]."""
    return near + wrap(angle - near)
