"""Angles on the circle and their branches on the real line [rad]."""

from __future__ import annotations

from math import ceil, pi
from typing import overload

import numpy as np
from numpy.typing import NDArray

from geometry.errors import BAD_INPUT, InputError, shown


@overload
def wrap(angle: float) -> float: ...
@overload
def wrap(angle: NDArray[np.float64]) -> NDArray[np.float64]: ...
def wrap(angle: float | NDArray[np.float64]) -> float | NDArray[np.float64]:
    """Return the same angle in (-pi, pi] [rad]; scalars give a float, arrays keep their shape.

    In an array what is not finite becomes NaN.

    Raises:
        InputError: no number, or a scalar that is not finite.
    """
    try:
        if isinstance(angle, np.ndarray):
            with np.errstate(invalid="ignore"):
                return np.asarray(angle - 2.0 * pi * np.ceil((angle - pi) / (2.0 * pi)), dtype=np.float64)
        return float(angle - 2.0 * pi * ceil((angle - pi) / (2.0 * pi)))
    except BAD_INPUT:
        raise InputError(f"angle = {shown(angle)}: must be a finite number, or an array of numbers") from None


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
def lift(
    angle: float | NDArray[np.float64], near: float | NDArray[np.float64]
) -> float | NDArray[np.float64]:
    """Return the same angle on the branch nearest to `near`, i.e. within pi of it [rad].

    Raises:
        InputError: no numbers, arrays whose shapes do not go together, or scalars that are not finite.
    """
    if isinstance(angle, float) and isinstance(near, float):
        return near + wrap(angle - near)
    try:
        with np.errstate(invalid="ignore"):
            return near + wrap(np.subtract(angle, near, dtype=np.float64))
    except BAD_INPUT:
        given = f"angle, near = {shown(angle)}, {shown(near)}"
        raise InputError(f"{given}: must be finite numbers, or arrays of them that go together") from None
