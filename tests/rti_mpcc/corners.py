"""Which nearest points of a corridor jut out, as corridor rows ask for it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from geometry import Corridor, HalfPlanes, ReflexVertices

Index = NDArray[np.int64]


def corners_of(corridor: Corridor, planes: HalfPlanes) -> Callable[[Index], ReflexVertices | None]:
    """Of the first part."""
    return lambda among: corridor.reflex_vertices(0, planes, among)


def no_corners(among: Index) -> None:
    """None of them."""
