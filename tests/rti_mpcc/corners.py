"""Which nearest points of a corridor jut out, as corridor rows ask for it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from geometry import Corridor, HalfPlanes, Jutting

Index = NDArray[np.int64]


def corners_of(corridor: Corridor, planes: HalfPlanes) -> Callable[[Index], Jutting | None]:
    """Of the first part."""
    return lambda among: corridor.jutting(0, planes, among)


def no_corners(among: Index) -> None:
    """None of them."""
