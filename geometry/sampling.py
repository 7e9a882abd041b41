"""Polylines sampled densely, with all that a search on them needs to know."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import shapely
from numpy.typing import NDArray

from geometry.arrays import Array, Complex

if TYPE_CHECKING:
    from scipy.spatial import cKDTree

Index = NDArray[np.integer]

SPACING = 0.05  # [m] at most, between samples
_BLOCK = 10_000  # points at a time: what a route of many kilometres takes meanwhile stays small
_MERGED = 1e-6  # [m] samples nearer to each other are one
_CROWDED = 4  # points of a line in each SPACING, above which it is thinned
_THINNED = 1e-5  # [m] no point that is left out is farther from the line than this


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Chain:
    """One sampled polyline; attributes as in geometry.boundary.Boundary, indices from 0."""

    vertex: Complex
    added: Index


def ring(line: Complex) -> Chain:
    """Sample a ring: its first point is there again as its last one."""
    line = merged(line)
    if line.size > 1 and abs(line[-1] - line[0]) <= _MERGED:
        line = line[:-1]
    return chain(np.append(line, line[0]))


def chain(line: Complex) -> Chain:
    """Sample a polyline (m,). One that is dense is not copied."""
    vertex, given = _dense(merged(line))
    dense = given.size == vertex.size
    return Chain(vertex=vertex, added=given[:0] if dense else np.delete(np.arange(vertex.size), given))


def _dense(line: Complex) -> tuple[Complex, Index]:
    """Points at most SPACING apart, the line itself if its are; which of them are those of the line (m,)."""
    pieces, given = [], [np.zeros(1, dtype=np.int32)]
    for i in range(0, line.size - 1, _BLOCK):
        some = line[i : i + _BLOCK + 1]
        way = np.diff(some)
        counts = np.maximum(np.ceil(np.abs(way) / SPACING - 1e-9), 1.0).astype(np.int32)
        given.append(given[-1][-1] + np.cumsum(counts, dtype=np.int32))
        if counts.max() == 1:
            pieces.append(some[:-1])
            continue
        step = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
        pieces.append(np.repeat(some[:-1], counts) + step * np.repeat(way / counts, counts))
    index = np.concatenate(given)
    dense = index[-1] == line.size - 1
    return line if dense else np.concatenate([*pieces, line[-1:]]), index


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
    from scipy.spatial import cKDTree  # here: a fifth of a second to import, and needed for corridors only

    return cKDTree(as_pairs(points), **options)
