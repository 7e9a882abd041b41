"""Polylines sampled densely, with all that a search on them needs to know of each sample."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
Index = NDArray[np.int64]
Mask = NDArray[np.bool_]

SPACING = 0.05  # [m] at most, between samples
CORNER = pi / 9.0  # [rad]
_REVERSAL = (
    pi - 1e-6
)  # [rad] a turn back on itself juts into the allowed side, whatever sign rounding gives it
_MERGED = 1e-6  # [m] samples nearer to each other are one


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Chain:
    """One sampled polyline; attributes as in geometry.boundary.Boundary, indices from 0.

    `sharp` (j,) are the samples at turns of more than CORNER to either side.
    """

    vertex: Complex
    tangent_in: Complex
    tangent_out: Complex
    length_in: Array
    length_out: Array
    feature_in: Index
    feature_out: Index
    is_end: Mask
    first: Index
    last: Index
    is_loop: Mask
    sharp: Index


def ring(line: Complex) -> Chain:
    """Sample a ring from a receding corner on, so that only a loop without any runs over its seam."""
    line = merged(line)
    if line.size > 1 and abs(line[-1] - line[0]) <= _MERGED:
        line = line[:-1]
    way = np.roll(line, -1) - line
    corner = recedes(way * np.roll(way, 1).conj())
    line = np.roll(line, -int(np.argmax(corner)))
    return chain(np.append(line, line[0]), is_ring=True)


def chain(line: Complex, *, is_ring: bool = False, leads: tuple[complex, complex] | None = None) -> Chain:
    """Sample a polyline (m,); a ring repeats its first point at its end. For `leads` see Boundary."""
    line = merged(line)
    if line.size == 1:
        return _point(line)
    way = np.diff(line)
    counts = np.maximum(np.ceil(np.abs(way) / SPACING - 1e-9), 1.0).astype(np.int64)
    step = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    share = np.repeat(way / counts, counts)
    vertex = np.append(np.repeat(line[:-1], counts) + step * share, line[-1])
    length = np.repeat(np.abs(way) / counts, counts)
    tangent = np.repeat(way / np.abs(way), counts)
    turn = tangent[1:] * tangent[:-1].conj()
    corner = recedes(turn)
    feature = np.concatenate(([0], np.cumsum(corner)))
    before, after = (-1, 0) if is_ring else (0, -1)
    starts = np.concatenate(([0], np.flatnonzero(corner) + 1))
    smooth_seam = not bool(recedes(tangent[0] * tangent[-1].conj()))
    ends = np.zeros(vertex.size, dtype=np.bool_)
    ends[[0, -1]] = not is_ring and leads is None
    lead_in = tangent[before] if leads is None else leads[0]
    lead_out = tangent[after] if leads is None else leads[1]
    return Chain(
        vertex=vertex,
        tangent_in=np.concatenate(([lead_in], tangent)),
        tangent_out=np.concatenate((tangent, [lead_out])),
        length_in=np.concatenate(([length[-1] if is_ring else 0.0], length)),
        length_out=np.concatenate((length, [length[0] if is_ring else 0.0])),
        feature_in=np.concatenate((feature[[before]], feature)),
        feature_out=np.concatenate((feature, feature[[after]])),
        is_end=ends,
        first=starts,
        last=np.append(starts[1:], vertex.size - 1),
        is_loop=np.full(starts.size, is_ring and smooth_seam and starts.size == 1),
        sharp=np.flatnonzero(np.abs(np.angle(turn)) > CORNER) + 1,
    )


def recedes(turn: Complex) -> Mask:
    """Which turns, complex numbers with that angle, are corners that recede from the allowed side.

    Only there does the nearest boundary point jump as a point goes by. Round a corner that juts out it
    moves on without a break, so both sides of such a corner are one feature.
    """
    angle = np.angle(turn)
    return np.asarray((angle > CORNER) & (angle < _REVERSAL))


def _point(line: Complex) -> Chain:
    """A boundary that is one point: without extent and without a forbidden side."""
    one, zero, index = np.ones(1, dtype=np.complex128), np.zeros(1), np.zeros(1, dtype=np.int64)
    return Chain(
        vertex=line,
        tangent_in=one,
        tangent_out=one,
        length_in=zero,
        length_out=zero,
        feature_in=index,
        feature_out=index,
        is_end=np.ones(1, dtype=np.bool_),
        first=index,
        last=index,
        is_loop=np.zeros(1, dtype=np.bool_),
        sharp=index[:0],
    )


def merged(line: Complex) -> Complex:
    """Drop points that repeat the one before."""
    return line[np.concatenate(([True], np.abs(np.diff(line)) > _MERGED))]


def as_complex(points: Array) -> Complex:
    """(m, 2) as (m,) x + iy."""
    return np.ascontiguousarray(points, dtype=np.float64).view(np.complex128)[..., 0]


def as_pairs(points: Complex) -> Array:
    """(...) x + iy as (..., 2)."""
    return np.ascontiguousarray(points).view(np.float64).reshape(*points.shape, 2)
