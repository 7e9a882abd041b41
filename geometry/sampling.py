"""Points of lines: how densely they are sampled, which of them say nothing, and trees of them."""

from __future__ import annotations

from typing import Any

import numpy as np
import shapely
from scipy.spatial import cKDTree

from geometry.arrays import Array, Complex

SPACING = 0.05  # [m] at most, between samples
_BLOCK = 10_000  # points at a time: what a route of many kilometres takes meanwhile stays small
_MERGED = 1e-6  # [m] samples nearer to each other are one
_CROWDED = 4  # points of a line in each SPACING, above which it is thinned
_THINNED = 1e-5  # [m] no point that is left out is farther from the line than this


def merged(line: Complex) -> Complex:
    """Drop points that repeat the one before, and of a line of far too many those that it runs straight past.

    Every sample is looked at again and again: what is drawn or scanned a point a millimetre is not seen
    better for it.
    """
    line = _distinct(line)
    if line.size < _CROWDED or line.size <= _CROWDED * np.abs(np.diff(line)).sum() / SPACING:
        return line
    return as_complex(shapely.get_coordinates(shapely.LineString(as_pairs(line)).simplify(_THINNED)))


def _distinct(line: Complex) -> Complex:
    """Drop points that repeat the one before."""
    blocks = (line[i : i + _BLOCK + 1] for i in range(0, line.size - 1, _BLOCK))
    kept = np.concatenate([np.ones(1, dtype=np.bool_), *(np.abs(np.diff(some)) > _MERGED for some in blocks)])
    return line if kept.all() else line[kept]


def as_complex(points: Array) -> Complex:
    """(m, 2) as (m,) x + iy."""
    return np.ascontiguousarray(points, dtype=np.float64).view(np.complex128)[..., 0]


def as_pairs(points: Complex) -> Array:
    """(...) x + iy as (..., 2)."""
    return np.ascontiguousarray(points).view(np.float64).reshape(*points.shape, 2)


def as_tree(points: Complex, **options: Any) -> cKDTree[None]:
    """The tree in which a point's nearest ones of (n,) are found."""
    return cKDTree(as_pairs(points), **options)
