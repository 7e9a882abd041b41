"""Closest point on a chain of arcs and straights, in closed form per piece."""

from __future__ import annotations

from math import atan2, ceil, cos, inf, pi, sin
from typing import Final

from geometry.compiled import Array1, inner, kernel

# 90 deg are met up to rounding: a candidate put exactly on that limit has to pass.
_HEADING_LIMIT: Final = 0.5 * pi + 1e-9


@kernel
def closest(
    x: float,
    y: float,
    knots: Array1,
    curvatures: Array1,
    begin_x: Array1,
    begin_y: Array1,
    heading: Array1,
    direction: float,
    lowest: float,
    highest: float,
    wants: bool,
    wanted: float,
) -> float:
    """Return the theta in [lowest, highest] of the point of a part that is closest to (x, y) [m].

    In the frame of a piece's first pose (u along the travel, w to its left) an arc of slope k = dphi/dtheta
    is nearest or farthest where

        theta - theta_0 = atan2(k u, 1 - k w)/k,          u on a straight,                             (1)

    the nearest being the branch atan2 gives. Besides it, only the ends of the window on that piece can be
    closest and, if a heading is wanted, the two places where the heading is 90 deg off. Of equals the first
    wins.

    Args:
        knots, curvatures, begin_x, begin_y, heading, direction: of a `PathPart`.
        wants: whether the path must have a heading within 90 deg of the `wanted` one [rad]; ignored if it has
            that nowhere.
    """
    best_square, best_theta, any_square, any_theta = inf, lowest, inf, lowest
    for i in range(piece_at(knots, lowest), len(curvatures)):
        if knots[i] > highest:
            break
        phi, k = heading[i], direction * curvatures[i]
        c, s = direction * cos(phi), direction * sin(phi)
        dx, dy = x - begin_x[i], y - begin_y[i]
        u, w = c * dx + s * dy, c * dy - s * dx
        low = max(knots[i], lowest) - knots[i]
        high = max(min(knots[i + 1], highest) - knots[i], low)
        for candidate in range(5 if wants and k != 0.0 else 3):
            if candidate == 0:
                local = low
            elif candidate == 1:
                local = high
            elif k == 0.0:
                local = min(max(u, low), high)
            elif candidate == 2:
                local = _into(atan2(k * u, 1.0 - k * w) / k, k, low, high)
            else:
                side = -0.5 * pi if candidate == 3 else 0.5 * pi
                local = _into((wanted - phi + side) / k, k, low, high)
            half = 0.5 * k * local
            chord = local * (sin(half) / half if half != 0.0 else 1.0)
            square = (u - chord * cos(half)) ** 2 + (w - chord * sin(half)) ** 2
            theta = local + knots[i]
            if square < any_square or (square == any_square and theta < any_theta):
                any_square, any_theta = square, theta
            if wants:
                off = phi + k * local - wanted
                if abs(off - 2.0 * pi * round(off / (2.0 * pi))) > _HEADING_LIMIT:
                    continue
                if square < best_square or (square == best_square and theta < best_theta):
                    best_square, best_theta = square, theta
    found = best_theta if best_square < inf else any_theta
    return min(max(found, lowest), highest)


@inner
def piece_at(knots: Array1, theta: float) -> int:
    """The last piece that begins at theta or before."""
    first, last = 0, len(knots) - 2
    while first < last:
        middle = (first + last + 1) // 2
        if knots[middle] <= theta:
            first = middle
        else:
            last = middle - 1
    return first


@inner
def _into(value: float, k: float, low: float, high: float) -> float:
    """The first value + j 2 pi/|k| that is >= low, cut at high."""
    period = 2.0 * pi / abs(k)
    turns = ceil((low - value) / period)
    return min(max(value + turns * period if turns != 0 else value, low), high)
