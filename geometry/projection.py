"""Closest point on a chain of arcs and straights, in closed form per piece."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import atan2, ceil, cos, inf, pi, sin

import numpy as np

from geometry.arrays import Array

# 90 deg are met up to rounding: a candidate put exactly on that limit has to pass.
_HEADING_LIMIT = 0.5 * pi + 1e-9
FEW = 6
"""So many pieces are searched faster one by one than by arrays."""


def closest_on_pieces(
    dx: Array,
    dy: Array,
    *,
    heading: Array,
    slope: Array,
    direction: int,
    knots: Array,
    window: tuple[float, float],
    wanted: float | None,
) -> float:
    """Return the theta of the point closest to a given one on m consecutive pieces [m].

    In the frame of a piece's first pose (u along the travel, w to its left) an arc of slope k = dphi/dtheta
    is nearest or farthest where

        theta - theta_0 = atan2(k u, 1 - k w)/k,          u on a straight,                             (1)

    the nearest being the branch atan2 gives. Besides it, only the ends of the window on that piece can be
    closest and, if a heading is wanted, the two places where the heading is 90 deg off. Of equals the first
    wins.

    Args:
        dx, dy: (m,) the point minus the first position of each piece [m].
        heading, slope: (m,) heading of the vehicle at the first pose [rad], dphi/dtheta [rad/m].
        direction: +1 or -1.
        knots: (m+1,) theta at the ends of the pieces [m].
        window: lowest and highest theta allowed [m].
        wanted: heading that the path must have within 90 deg, ignored if it has it nowhere [rad].
    """
    c, s = direction * np.cos(heading), direction * np.sin(heading)
    u, w = c * dx + s * dy, c * dy - s * dx
    low = np.maximum(knots[:-1], window[0]) - knots[:-1]
    high = np.maximum(np.minimum(knots[1:], window[1]) - knots[:-1], low)
    straight = slope == 0.0
    k = np.where(straight, 1.0, slope)
    period = np.where(straight, np.inf, 2.0 * pi / np.abs(k))
    stationary = np.where(straight, u, np.arctan2(slope * u, 1.0 - slope * w) / k)
    candidates = [stationary]
    if wanted is not None:
        candidates += [
            np.where(straight, low, (wanted + side - heading) / k) for side in (-0.5 * pi, 0.5 * pi)
        ]
    local = np.stack([_into(candidate, low, high, period) for candidate in candidates] + [low, high])

    half = 0.5 * slope * local
    chord = local * np.sinc(half / pi)
    squared = (u - chord * np.cos(half)) ** 2 + (w - chord * np.sin(half)) ** 2
    if wanted is not None:
        off = heading + slope * local - wanted
        allowed = np.abs(off - 2.0 * pi * np.round(off / (2.0 * pi))) <= _HEADING_LIMIT
        if allowed.any():
            squared = np.where(allowed, squared, np.inf)
    theta = local + knots[:-1]
    best = squared == squared.min()
    return float(min(max(theta[best].min(), window[0]), window[1]))


def _into(value: Array, low: Array, high: Array, period: Array) -> Array:
    """The first value + j period that is >= low, cut at high; without a period just clipped."""
    finite = np.isfinite(period)
    turns = np.where(finite, np.ceil((low - value) / np.where(finite, period, 1.0)), 0.0)
    shifted = value + turns * np.where(finite, period, 0.0)
    return np.asarray(np.minimum(np.maximum(shifted, low), high), dtype=np.float64)


def closest_on_few(
    dx: Sequence[float],
    dy: Sequence[float],
    *,
    heading: Sequence[float],
    slope: Sequence[float],
    direction: int,
    knots: Sequence[float],
    window: tuple[float, float],
    wanted: float | None,
) -> float:
    """Do what `closest_on_pieces` does, piece by piece."""
    best = anywhere = (inf, inf)
    for i, (phi, k) in enumerate(zip(heading, slope, strict=True)):
        c, s = direction * cos(phi), direction * sin(phi)
        u, w = c * dx[i] + s * dy[i], c * dy[i] - s * dx[i]
        low = max(knots[i], window[0]) - knots[i]
        high = max(min(knots[i + 1], window[1]) - knots[i], low)
        for local in _candidates(u, w, k, low, high, None if wanted is None else wanted - phi):
            half = 0.5 * k * local
            chord = local * (sin(half) / half if half != 0.0 else 1.0)
            found = ((u - chord * cos(half)) ** 2 + (w - chord * sin(half)) ** 2, local + knots[i])
            anywhere = min(anywhere, found)
            if wanted is not None:
                off = phi + k * local - wanted
                if abs(off - 2.0 * pi * round(off / (2.0 * pi))) <= _HEADING_LIMIT:
                    best = min(best, found)
    theta = (anywhere if best[0] == inf else best)[1]
    return min(max(theta, window[0]), window[1])


def _candidates(u: float, w: float, k: float, low: float, high: float, turn: float | None) -> Iterator[float]:
    """Where a piece may be closest [m]; `turn`: from its first heading to the one that is wanted [rad]."""
    yield low
    yield high
    if k == 0.0:
        yield min(max(u, low), high)
        return
    period = 2.0 * pi / abs(k)
    inner = [atan2(k * u, 1.0 - k * w) / k]
    if turn is not None:
        inner += [(turn - 0.5 * pi) / k, (turn + 0.5 * pi) / k]
    for value in inner:
        yield min(max(value + ceil((low - value) / period) * period, low), high)
