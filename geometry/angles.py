"""Angles on the circle and their branches on the real line [rad]."""

from __future__ import annotations

from math import ceil, pi
from typing import overload

import numpy as np
from numpy.typing import NDArray

from geometry.doors import door
from geometry.errors import InputError


@overload
def wrap(angle: float) -> float: ...
@overload
def wrap(angle: NDArray[np.float64]) -> NDArray[np.float64]: ...
@door(late=True)
def wrap(angle: float | NDArray[np.float64]) -> float | NDArray[np.float64]:
    """Return the same angle in (-pi, pi] [rad]; scalars give a float, arrays keep their shape.

    In an array what is not finite becomes NaN.

    Raises:
        InputError: a scalar that is not finite.
    """
    if isinstance(angle, np.ndarray):
        with np.errstate(invalid="ignore"):
            return np.asarray(angle - 2.0 * pi * np.ceil((angle - pi) / (2.0 * pi)), dtype=np.float64)
    try:
        return float(angle - 2.0 * pi * ceil((angle - pi) / (2.0 * pi)))
    except (ValueError, OverflowError):
        raise InputError(f"angle = {angle}: must be finite") from None


def degrees_hint(what: str, heading: float) -> str:
    """What to say of a heading of more than a full turn [rad], which may be meant in degrees, or ""."""
    if abs(heading) <= 2.0 * pi:
        return ""
    return f"{what} {heading:.6g}: in degrees? radians are expected"


@overload
def lift(angle: float, near: float) -> float: ...
@overload
def lift(angle: NDArray[np.float64], near: float | NDArray[np.float64]) -> NDArray[np.float64]: ...
@overload
def lift(angle: float, near: NDArray[np.float64]) -> NDArray[np.float64]: ...
@door(late=True)
def lift(
    angle: float | NDArray[np.float64], near: float | NDArray[np.float64]
) -> float | NDArray[np.float64]:
    """Return the same angle on the branch nearest to `near`, i.e. within pi of it [rad]."""
    if isinstance(angle, float) and isinstance(near, float):
        return near + wrap(angle - near)
    try:
        with np.errstate(invalid="ignore"):
            return near + wrap(angle - near)
    except InputError:
        raise
    except ValueError:
        shapes = np.shape(angle), np.shape(near)
        raise InputError(f"angle, near: their shapes {shapes} do not go together") from None
