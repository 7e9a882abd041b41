"""Ways made of arcs: signed lengths [m], negative in reverse, and curvatures [1/m] of pieces, as (n, 2)."""

from __future__ import annotations

from math import ceil, cos, sin

import numpy as np

from geometry.arrays import Array, Mask
from geometry.compiled import Array1, Array2, Out2, inner, kernel

_NOTHING = 1e-9  # [m], [1/m] a shorter piece is none, curvatures nearer to one another are the same


@inner
def after(x: float, y: float, phi: float, length: float, curvature: float) -> tuple[float, float, float]:
    """The pose after an arc of a signed length [m], (2) of geometry.part."""
    half = 0.5 * curvature * length
    chord = length * (sin(half) / half if abs(half) > 1e-12 else 1.0)
    return x + chord * cos(phi + half), y + chord * sin(phi + half), phi + 2.0 * half


def poses_after(start: Array, way: Array) -> Array:
    """The poses (n, 3) after each of the pieces (n, 2) of a way from `start` (3,)."""
    found = np.empty((len(way), 3))
    _trace(start, way, found)
    return found


@kernel
def _trace(start: Array1, way: Array2, found: Out2) -> None:
    x, y, phi = start[0], start[1], start[2]
    for k in range(len(way)):
        x, y, phi = after(x, y, phi, way[k, 0], way[k, 1])
        found[k, 0], found[k, 1], found[k, 2] = x, y, phi


def length_of(way: Array) -> float:
    """The length of a way [m]."""
    return float(np.abs(way[:, 0]).sum())


def split_counts(way: Array, longest: float) -> list[int]:
    """Into how many pieces no longer than `longest` [m] each of a way is split."""
    return [max(ceil(abs(length) / longest - 1e-9), 1) for length, _ in way.tolist()]


def split(way: Array, longest: float) -> Array:
    """The same way in pieces that are no longer than `longest` [m]."""
    counts = split_counts(way, longest)
    return np.repeat(way / np.column_stack([counts, np.ones(len(way))]), counts, axis=0)


def joined(way: Array) -> Array:
    """The same way with pieces that go on alike put together, and without those of no length."""
    found: list[list[float]] = []
    for length, curvature in way.tolist():
        if abs(length) < _NOTHING:
            continue
        if found and found[-1][0] * length > 0.0 and abs(found[-1][1] - curvature) < _NOTHING:
            found[-1][0] += length
        else:
            found.append([length, curvature])
    return np.array(found).reshape(-1, 2)


def turns_of(way: Array) -> Mask:
    """Whether the direction changes after each piece but the last, (n - 1,)."""
    changes: Mask = way[1:, 0] * way[:-1, 0] < 0.0
    return changes
