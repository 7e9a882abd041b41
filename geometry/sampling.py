"""Polylines sampled densely, with all that a search on them needs to know."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi
from typing import TYPE_CHECKING, Any

import numpy as np
import shapely
from numpy.typing import NDArray

from geometry.arrays import Array, Complex, Mask

if TYPE_CHECKING:
    from scipy.spatial import cKDTree

Index = NDArray[np.integer]

SPACING = 0.05  # [m] at most, between samples
CORNER = pi / 9.0  # [rad]
_REVERSAL = (
    pi - 1e-6
)  # [rad] a turn back on itself juts into the allowed side, whatever sign rounding gives it
_BLOCK = 10_000  # points at a time: what a route of many kilometres takes meanwhile stays small
_MERGED = 1e-6  # [m] samples nearer to each other are one
_CROWDED = 4  # points of a line in each SPACING, above which it is thinned
_THINNED = 1e-5  # [m] no point that is left out is farther from the line than this


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Chain:
    """One sampled polyline; attributes as in geometry.boundary.Boundary, indices from 0.

    `reflex_vertices` (j,) are the samples at corners that jut into the allowed side.
    """

    vertex: Complex
    added: Index
    first: Index
    last: Index
    is_loop: Mask
    reflex_vertices: Index


def ring(line: Complex) -> Chain:
    """Sample a ring from a receding corner on, so that only a loop without any runs over its seam."""
    line = merged(line)
    if line.size > 1 and abs(line[-1] - line[0]) <= _MERGED:
        line = line[:-1]
    way = np.roll(line, -1) - line
    corner = recedes(way * np.roll(way, 1).conj())
    line = np.roll(line, -int(np.argmax(corner)))
    return chain(np.append(line, line[0]), is_ring=True)


def chain(line: Complex, *, is_ring: bool = False) -> Chain:
    """Sample a polyline (m,); a ring repeats its first point at its end. One that is dense is not copied."""
    line = merged(line)
    vertex, given = _dense(line)
    receding, reflex_vertices = _corners(line)
    starts = np.append(0, given[receding])
    smooth_seam = line.size > 1 and not bool(recedes((line[1] - line[0]) * (line[-1] - line[-2]).conj()))
    return Chain(
        vertex=vertex,
        added=given[:0] if given.size == vertex.size else np.delete(np.arange(vertex.size), given),
        first=starts,
        last=np.append(starts[1:], vertex.size - 1),
        is_loop=np.full(starts.size, is_ring and smooth_seam and starts.size == 1),
        reflex_vertices=given[reflex_vertices],
    )


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


def _corners(line: Complex) -> tuple[Index, Index]:
    """The points of a polyline (m,) at which it recedes, and at which it juts out."""
    receding, reflex_vertices = [np.zeros(0, dtype=np.int64)], [np.zeros(0, dtype=np.int64)]
    for i in range(0, line.size - 2, _BLOCK):
        way = np.diff(line[i : i + _BLOCK + 2])
        turn = way[1:] * way[:-1].conj()
        receding.append(np.flatnonzero(recedes(turn)) + i + 1)
        reflex_vertices.append(np.flatnonzero(juts_out(turn)) + i + 1)
    return np.concatenate(receding), np.concatenate(reflex_vertices)


def recedes(turn: Complex) -> Mask:
    """Which turns, complex numbers with that angle, are corners that recede from the allowed side.

    Only there does the nearest boundary point jump as a point goes by. Round a corner that juts out it
    moves on without a break, so both sides of such a corner are one feature.
    """
    angle = np.angle(turn)
    return np.asarray((angle > CORNER) & (angle < _REVERSAL))


def juts_out(turn: Complex) -> Mask:
    """Which turns are corners that jut into the allowed side."""
    return np.asarray((np.abs(np.angle(turn)) > CORNER) & ~recedes(turn))


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
