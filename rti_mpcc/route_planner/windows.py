"""A long route cut into windows that are made smooth one by one: work and memory grow with its length only.

A route is cut inside of an arc, never between two, so both windows know the curvature that it has there, and
keep it. The middle of a long arc is a window of its own: it is smooth as it is.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from geometry.arrays import Array
from rti_mpcc.route_planner.arcs import length_of

_ALONE = 0.5  # of the longest window: length of a long arc that is left to its neighbours
_EARLIEST = 0.5  # of the longest window: no cut between two windows is nearer to the start of the first


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Window:
    """A piece of a route.

    Attributes:
        arcs: (n, 2) signed lengths [m] and curvatures [1/m].
        joints: whether another window comes before it, and after it: its first and last arc go on there.
        alone: whether it is the middle of a long arc, which is smooth as it is.
    """

    arcs: Array
    joints: tuple[bool, bool]
    alone: bool


def windows_of(route: Array, longest: float) -> list[Window]:
    """The windows of a route (n, 2), none longer than `longest` [m] but those that are alone."""
    cuts = [route]
    if length_of(route) > longest:
        outside = _cut_long_arcs(route, _ALONE * longest)
        cuts = [each for piece in outside for each in ([piece] if len(piece) == 1 else _cut(piece, longest))]
    last = len(cuts) - 1
    return [
        Window(arcs=each, joints=(k > 0, k < last), alone=len(each) == 1 and 0 < k < last)
        for k, each in enumerate(cuts)
    ]


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
