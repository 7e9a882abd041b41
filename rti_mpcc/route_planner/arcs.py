"""Routes made of arcs: signed lengths [m], negative in reverse, and curvatures [1/m], as (n, 2)."""

from __future__ import annotations

from math import ceil, cos, sin
from typing import Final

import numpy as np

from geometry.arrays import Array, Mask
from geometry.compiled import Array1, Array2, Out2, inner, kernel

NO_LENGTH: Final = 1e-9
"""[m] what is shorter is nothing; curvatures that are nearer to one another [1/m] are the same."""
_ALONE = 0.5  # of the longest window: length of a long arc that is left to its neighbours
_EARLIEST = 0.5  # of the longest window: no cut between two windows is nearer to the start of the first


@inner
def pose_after(x: float, y: float, phi: float, length: float, curvature: float) -> tuple[float, float, float]:
    """The pose after an arc of a signed length [m], (2) of geometry.part."""
    half = 0.5 * curvature * length
    chord = length * (sin(half) / half if abs(half) > 1e-12 else 1.0)
    return x + chord * cos(phi + half), y + chord * sin(phi + half), phi + 2.0 * half


@kernel
def poses_after(start: Array1, route: Array2) -> Out2:
    """The poses (n, 3) after each of the arcs (n, 2) of a route from `start` (3,)."""
    poses, x, y, phi = np.empty((len(route), 3)), start[0], start[1], start[2]
    for k in range(len(route)):
        x, y, phi = pose_after(x, y, phi, route[k, 0], route[k, 1])
        poses[k, 0], poses[k, 1], poses[k, 2] = x, y, phi
    return poses


def length_of(route: Array) -> float:
    """The length of a route [m]."""
    return float(np.abs(route[:, 0]).sum())


def split_counts(route: Array, longest: float) -> list[int]:
    """Number of arcs no longer than `longest` [m] into which each arc of a route is split."""
    return [max(ceil(abs(length) / longest - 1e-9), 1) for length, _ in route.tolist()]


def split_arcs(route: Array, longest: float) -> Array:
    """The same route in arcs that are no longer than `longest` [m]."""
    counts = split_counts(route, longest)
    return np.repeat(route / np.column_stack([counts, np.ones(len(route))]), counts, axis=0)


def merge_arcs(route: Array) -> Array:
    """The same route with equal neighbours merged, and without arcs of no length."""
    merged: list[list[float]] = []
    for length, curvature in route.tolist():
        if abs(length) < NO_LENGTH:
            continue
        if merged and merged[-1][0] * length > 0.0 and abs(merged[-1][1] - curvature) < NO_LENGTH:
            merged[-1][0] += length
        else:
            merged.append([length, curvature])
    return np.array(merged).reshape(-1, 2)


def find_cusps(route: Array) -> Mask:
    """Whether the direction changes after each arc but the last, (n - 1,)."""
    changes: Mask = route[1:, 0] * route[:-1, 0] < 0.0
    return changes


def windows_of(route: Array, longest: float) -> list[Array]:
    """A route (n, 2) cut into windows that are made smooth one by one: work and memory grow with its length
    only.

    It is cut inside of an arc, never between two, so both windows know the curvature that it has there, and
    keep it. No window is longer than `longest` [m] but the middle of a long arc, a window of its own.
    """
    if length_of(route) <= longest:
        return [route]
    outside = _cut_long_arcs(route, _ALONE * longest)
    return [each for piece in outside for each in ([piece] if len(piece) == 1 else _cut(piece, longest))]


def _cut_long_arcs(route: Array, long: float) -> list[Array]:
    """A route cut twice inside of each arc that is longer than twice `long` [m]: a half of that is left to
    either side."""
    cuts: list[Array] = []
    started: list[Array] = []
    for length, curvature in route:
        if abs(length) <= 2.0 * long:
            started.append(np.array([length, curvature]))
            continue
        side = 0.5 * np.sign(length) * long
        cuts += [np.array([*started, (side, curvature)]), np.array([(length - 2.0 * side, curvature)])]
        started = [np.array([side, curvature])]
    return [*cuts, np.array(started)]


def _cut(route: Array, longest: float) -> list[Array]:
    """A route cut into pieces of at most `longest` [m], each in the middle of the longest arc there."""
    cuts = []
    while length_of(route) > longest:
        ends = np.cumsum(np.abs(route[:, 0]))
        first = np.maximum(ends - np.abs(route[:, 0]), _EARLIEST * longest)
        last = np.minimum(ends, longest)
        k = int(np.argmax(last - first))
        at = 0.5 * float(first[k] + last[k])
        left = np.sign(route[k, 0]) * (ends[k] - at)
        cuts.append(np.vstack([route[:k], [route[k, 0] - left, route[k, 1]]]))
        route = np.vstack([[left, route[k, 1]], route[k + 1 :]])
    return [*cuts, route]
