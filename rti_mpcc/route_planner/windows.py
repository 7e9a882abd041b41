"""A long way cut into windows that are made smooth one by one: work and memory grow with its length only.

A way is cut inside of a piece, never between two, so both windows know the curvature that it has there, and
keep it. The middle of a long piece stands alone: it is smooth as it is.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from geometry.arrays import Array
from rti_mpcc.route_planner.arcs import length_of

_ALONE = 0.5  # of the longest window: so much of a long piece is left to its neighbours
_EARLIEST = 0.5  # of the longest window: no cut between two windows is nearer to the begin of the first


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Window:
    """A part of a way.

    Attributes:
        way: (n, 2) signed lengths [m] and curvatures [1/m] of its pieces.
        joints: whether another part comes before it, and after it: it begins and ends with a piece of that.
        alone: whether it is the middle of a long piece, which is smooth as it is.
    """

    way: Array
    joints: tuple[bool, bool]
    alone: bool


def windows_of(way: Array, longest: float) -> list[Window]:
    """The parts of a way (n, 2), none longer than `longest` [m] but those that stand alone."""
    if length_of(way) <= longest:
        return [Window(way=way, joints=(False, False), alone=False)]
    parts = []
    for part in _between_long_pieces(way, _ALONE * longest):
        parts += [part] if len(part) == 1 else _cut(part, longest)
    last = len(parts) - 1
    return [
        Window(way=part, joints=(k > 0, k < last), alone=len(part) == 1 and 0 < k < last)
        for k, part in enumerate(parts)
    ]


def _between_long_pieces(way: Array, long: float) -> list[Array]:
    """A way cut twice inside of each piece that is longer than twice `long` [m]: a half of it is left to
    either side."""
    parts: list[Array] = []
    begun: list[Array] = []
    for length, curvature in way:
        if abs(length) <= 2.0 * long:
            begun.append(np.array([length, curvature]))
            continue
        side = 0.5 * np.sign(length) * long
        parts.append(np.array([*begun, (side, curvature)]))
        parts.append(np.array([(length - 2.0 * side, curvature)]))
        begun = [np.array([side, curvature])]
    return [*parts, np.array(begun)]


def _cut(way: Array, longest: float) -> list[Array]:
    """A way cut into parts of at most `longest` [m], each in the middle of the longest piece there."""
    parts = []
    while length_of(way) > longest:
        ends = np.cumsum(np.abs(way[:, 0]))
        first = np.maximum(ends - np.abs(way[:, 0]), _EARLIEST * longest)
        last = np.minimum(ends, longest)
        k = int(np.argmax(last - first))
        at = 0.5 * float(first[k] + last[k])
        left = np.sign(way[k, 0]) * (ends[k] - at)
        parts.append(np.vstack([way[:k], [way[k, 0] - left, way[k, 1]]]))
        way = np.vstack([[left, way[k, 1]], way[k + 1 :]])
    return [*parts, way]
