"""Stretches of a way, each driven in one direction without a stop: where they lead, and what changes that.

Each stretch has a length S and curvatures at evenly spaced knots, linear in between. So the steering is
continuous within it. It is driven in short arcs of equal length h, each of the curvature in its middle. A
pose is where the arcs up to it lead, exactly, and it changes, but for terms of the order of h³, by

(R1)  dp = sum over arcs j before it of  d h R (p - m_j) dkappa_j  +  (t_j + kappa_j d R (p - m_j)) dh_j

with the arcs' midpoints m, tangents t, curvatures kappa and direction d, and R a turn by 90 degrees to the
left; the heading changes by d (h dkappa + kappa dh).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import ceil, cos, sin
from typing import Final

import numpy as np

from geometry.arrays import Array, Index
from geometry.compiled import Array1, Array2, Index1, IndexOut1, Out2, Out3, inner, kernel
from rti_mpcc.route_planner.arcs import after, length_of, turns_of

MIDDLE_X: Final = 0
MIDDLE_Y: Final = 1
TANGENT_X: Final = 2
TANGENT_Y: Final = 3
CURVATURE: Final = 4
SHARE: Final = 5
ARC: Final = 6
"""What is known of an arc: m, t and kappa of (R1), and which share of the way from the knot before it to the
next one its middle is at."""
_LEAST_LENGTH = 0.02
"""No stretch becomes shorter [m]."""
_SPREADS = 300
"""So often what is beyond the largest curvature is given on to both sides."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Traced:
    """Where the arcs lead: poses (n, 3) after each, `arcs` (n, ARC), and the knot (n,) before the middle of
    each."""

    poses: Array
    arcs: Array
    knot: Index


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Stretches:
    """Stretches that follow one another.

    Attributes:
        direction: (m,) +1 or -1; length: (m,) [m]; first: (m + 1,) where the knots of each begin.
        knots: (k,) curvatures [1/m]; pieces: (m + 1,) where the arcs of each begin.
    """

    direction: Array
    length: Array
    first: Index
    knots: Array
    pieces: Index

    @classmethod
    def of(cls, way: Array, spacing: float, arc: float) -> Stretches:
        """Build from a way (n, 2) of signed lengths [m] and curvatures [1/m]: means around the knots.

        Args:
            spacing: of the knots [m]; arc: length of the arcs [m]; both at most.
        """
        parts = np.split(way, np.flatnonzero(turns_of(way)) + 1)
        lengths = [length_of(part) for part in parts]
        knots = [
            _means(part, whole, max(ceil(whole / spacing), 2) + 1)
            for part, whole in zip(parts, lengths, strict=True)
        ]
        arcs = [max(ceil(whole / arc), 2) for whole in lengths]
        return cls(
            direction=np.array([np.sign(part[0, 0]) for part in parts]),
            length=np.array(lengths),
            first=np.concatenate(([0], np.cumsum([len(each) for each in knots]))),
            knots=np.concatenate(knots),
            pieces=np.concatenate(([0], np.cumsum(arcs))),
        )

    @property
    def variables(self) -> int:
        """So many curvatures and lengths there are."""
        return len(self.knots) + len(self.length)

    def way(self) -> Array:
        """Signed lengths [m] and curvatures [1/m] of the arcs (n, 2)."""
        found = np.empty((int(self.pieces[-1]), 2))
        _arcs(self.direction, self.length, self.first, self.knots, self.pieces, found)
        return found

    def bounded(self, most: float) -> Stretches:
        """The same with curvatures of at most so much [1/m]: what a knot has beyond that its neighbours get,
        so that the heading turns by as much, if there is room for it."""
        parts = [_spread(part, most) for part in np.split(self.knots, self.first[1:-1])]
        return replace(self, knots=np.concatenate(parts))

    def changed(self, change: Array) -> Stretches:
        """The same with other curvatures and lengths: by so much (k + m,)."""
        count = len(self.knots)
        length = np.maximum(self.length + change[count:], _LEAST_LENGTH)
        return replace(self, knots=self.knots + change[:count], length=length)

    def traced(self, start: Array) -> Traced:
        """Where they lead from a start (3,)."""
        arcs = int(self.pieces[-1])
        found = Traced(poses=np.empty((arcs, 3)), arcs=np.empty((arcs, ARC)), knot=np.empty(arcs, np.int64))
        _trace(
            start, self.direction, self.length, self.first, self.knots, self.pieces,
            found.poses, found.arcs, found.knot,
        )  # fmt: skip
        return found

    def slopes(self, at: Traced, rows: Index) -> Array:
        """How the poses with these indices (n,) change with curvatures and lengths, (n, 3, k + m), (R1)."""
        found = np.zeros((len(rows), 3, self.variables))
        _slopes(
            self.direction, self.length, self.pieces, len(self.knots), at.poses, at.arcs, at.knot, rows, found
        )
        return found


def _means(way: Array, whole: float, count: int) -> Array:
    """Mean curvatures (count,) around evenly spaced knots on a way of this length [m]."""
    lengths = np.abs(way[:, 0])
    ends = np.concatenate(([0.0], np.cumsum(lengths)))
    turned = np.concatenate(([0.0], np.cumsum(lengths * way[:, 1])))
    at, half = np.linspace(0.0, whole, count), 0.5 * whole / (count - 1)
    low, high = np.maximum(at - half, 0.0), np.minimum(at + half, whole)
    means: Array = (np.interp(high, ends, turned) - np.interp(low, ends, turned)) / (high - low)
    return means


def _spread(knots: Array, most: float) -> Array:
    """Curvatures (k,) with what is beyond `most` [1/m] spread to both sides."""
    spread = knots.copy()
    for _ in range(_SPREADS):
        beyond = spread - np.clip(spread, -most, most)
        if not beyond.any():
            return spread
        spread -= beyond
        spread[1:] += 0.5 * beyond[:-1]
        spread[:-1] += 0.5 * beyond[1:]
    return np.clip(spread, -most, most)


@inner
def _between(j: int, count: int, knots: int) -> tuple[int, float]:
    """Before which knot the middle of the j-th arc is, and by which share of the way to the next one."""
    at = (j + 0.5) / count * (knots - 1)
    k = min(int(at), knots - 2)
    return k, at - k


@kernel
def _arcs(
    direction: Array1, length: Array1, first: Index1, knots: Array1, pieces: Index1, found: Out2
) -> None:
    for m in range(len(direction)):
        count = pieces[m + 1] - pieces[m]
        for j in range(count):
            k, share = _between(j, count, first[m + 1] - first[m])
            at = first[m] + k
            found[pieces[m] + j, 0] = direction[m] * length[m] / count
            found[pieces[m] + j, 1] = (1.0 - share) * knots[at] + share * knots[at + 1]


@kernel
def _trace(
    start: Array1,
    direction: Array1,
    length: Array1,
    first: Index1,
    knots: Array1,
    pieces: Index1,
    poses: Out2,
    arcs: Out2,
    knot: IndexOut1,
) -> None:
    x, y, phi = start[0], start[1], start[2]
    for m in range(len(direction)):
        count, d = pieces[m + 1] - pieces[m], direction[m]
        h = length[m] / count
        for j in range(count):
            i = pieces[m] + j
            k, share = _between(j, count, first[m + 1] - first[m])
            at = first[m] + k
            curvature = (1.0 - share) * knots[at] + share * knots[at + 1]
            middle_x, middle_y, middle_phi = after(x, y, phi, 0.5 * d * h, curvature)
            x, y, phi = after(x, y, phi, d * h, curvature)
            poses[i, 0], poses[i, 1], poses[i, 2] = x, y, phi
            arcs[i, MIDDLE_X], arcs[i, MIDDLE_Y] = middle_x, middle_y
            arcs[i, TANGENT_X], arcs[i, TANGENT_Y] = d * cos(middle_phi), d * sin(middle_phi)
            arcs[i, CURVATURE], arcs[i, SHARE], knot[i] = curvature, share, at


@kernel
def _slopes(
    direction: Array1,
    length: Array1,
    pieces: Index1,
    knots: int,
    poses: Array2,
    arcs: Array2,
    knot: Index1,
    rows: Index1,
    found: Out3,
) -> None:
    for r in range(len(rows)):
        x, y = poses[rows[r], 0], poses[rows[r], 1]
        for m in range(len(direction)):
            count, d = pieces[m + 1] - pieces[m], direction[m]
            h, slope = length[m] / count, found[r]
            for j in range(pieces[m], min(pieces[m + 1], rows[r] + 1)):
                # R (p - m_j), and kappa_j d.
                across_x, across_y = -(y - arcs[j, MIDDLE_Y]), x - arcs[j, MIDDLE_X]
                turn = arcs[j, CURVATURE] * d
                _add(slope, knot[j], d * h * (1.0 - arcs[j, SHARE]), across_x, across_y)
                _add(slope, knot[j] + 1, d * h * arcs[j, SHARE], across_x, across_y)
                slope[0, knots + m] += (arcs[j, TANGENT_X] + turn * across_x) / count
                slope[1, knots + m] += (arcs[j, TANGENT_Y] + turn * across_y) / count
                slope[2, knots + m] += turn / count


@inner
def _add(slope: Array, variable: int, turn: float, across_x: float, across_y: float) -> None:
    slope[0, variable] += turn * across_x
    slope[1, variable] += turn * across_y
    slope[2, variable] += turn
