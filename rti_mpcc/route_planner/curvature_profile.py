"""Curvature of a route along its length: where it leads, and how that changes with the curvature.

Each segment, driven in one direction without a stop, has a length S and curvatures at evenly spaced knots,
linear in between. So the steering is continuous within it. It is driven in short arcs of equal length h, each
of the curvature in its middle. A pose is where the arcs up to it lead, exactly, and it changes, but for terms
of the order of h³, by

(R3)  dp = sum over arcs j before it of  d h R (p - m_j) dkappa_j  +  (t_j + kappa_j d R (p - m_j)) dh_j

with the arcs' midpoints m, tangents t, curvatures kappa and direction d, and R a turn by 90 degrees to the
left; the heading changes by d (h dkappa + kappa dh).
"""

from __future__ import annotations

from math import ceil, cos, sin
from typing import NamedTuple

import numpy as np

from geometry.arrays import Array
from geometry.compiled import Array1, Index1, IndexOut1, Out1, Out2, Out3, inner, kernel
from rti_mpcc.route_planner.arcs import find_cusps, length_of, pose_after

MIDDLE_X, MIDDLE_Y, TANGENT_X, TANGENT_Y, CURVATURE, SHARE, ARC = range(7)
"""Columns of the arcs: m, t and kappa of (R3), and the share of the distance between two knots at which the
middle of the arc is; how many these are."""
_LEAST_LENGTH = 0.02
"""No segment becomes shorter [m]."""
_SPREADS = 300
"""Number of times that the excess over the largest curvature is moved to both sides."""


class Traced(NamedTuple):
    """Poses (n, 3) after each arc, `arcs` (n, ARC), and the knot (n,) before the middle of each."""

    poses: Out2
    arcs: Out2
    knot: IndexOut1


class CurvatureProfile(NamedTuple):
    """Segments that follow one another.

    Attributes:
        direction: (m,) +1 or -1; length: (m,) [m]; first: (m + 1,) index of the first knot of each.
        knots: (k,) curvatures [1/m]; arcs: (m + 1,) index of the first arc of each.
    """

    direction: Out1
    length: Out1
    first: IndexOut1
    knots: Out1
    arcs: IndexOut1

    @classmethod
    def of(cls, route: Array, spacing: float, arc: float) -> CurvatureProfile:
        """Build from a route (n, 2) of signed lengths [m] and curvatures [1/m]: means around the knots, at
        most `spacing` [m] apart; its arcs have at most the length `arc` [m]."""
        segments = np.split(route, np.flatnonzero(find_cusps(route)) + 1)
        lengths = [length_of(each) for each in segments]
        knots = [
            _means(each, whole, max(ceil(whole / spacing), 2) + 1)
            for each, whole in zip(segments, lengths, strict=True)
        ]
        arcs = [max(ceil(whole / arc), 2) for whole in lengths]
        return cls(
            direction=np.array([np.sign(each[0, 0]) for each in segments]),
            length=np.array(lengths),
            first=np.concatenate(([0], np.cumsum([len(each) for each in knots]))),
            knots=np.concatenate(knots),
            arcs=np.concatenate(([0], np.cumsum(arcs))),
        )

    @property
    def variables(self) -> int:
        """Number of curvatures and lengths."""
        return len(self.knots) + len(self.length)

    def bounded(self, most: float) -> CurvatureProfile:
        """The same with curvatures of at most `most` [1/m]: the excess of a knot is moved to its neighbours,
        so that the heading turns by as much, where they have room for it."""
        segments = [_spread(each, most) for each in np.split(self.knots, self.first[1:-1])]
        return self._replace(knots=np.concatenate(segments))

    def changed(self, change: Array) -> CurvatureProfile:
        """The same with curvatures and lengths changed by (k + m,)."""
        count = len(self.knots)
        length = np.maximum(self.length + change[count:], _LEAST_LENGTH)
        return self._replace(knots=self.knots + change[:count], length=length)

    def route(self, at: Traced) -> Array:
        """Signed lengths [m] and curvatures [1/m] of the arcs (n, 2)."""
        counts = np.diff(self.arcs)
        return np.column_stack(
            (np.repeat(self.direction * self.length / counts, counts), at.arcs[:, CURVATURE])
        )


def _means(route: Array, whole: float, count: int) -> Array:
    """Mean curvatures (count,) around evenly spaced knots on a route of this length [m]."""
    lengths = np.abs(route[:, 0])
    ends = np.concatenate(([0.0], np.cumsum(lengths)))
    turned = np.concatenate(([0.0], np.cumsum(lengths * route[:, 1])))
    at, half = np.linspace(0.0, whole, count), 0.5 * whole / (count - 1)
    low, high = np.maximum(at - half, 0.0), np.minimum(at + half, whole)
    means: Array = (np.interp(high, ends, turned) - np.interp(low, ends, turned)) / (high - low)
    return means


def _spread(knots: Array, most: float) -> Array:
    """Curvatures (k,) with the excess over `most` [1/m] spread to both sides."""
    spread = knots.copy()
    for _ in range(_SPREADS):
        beyond = spread - np.clip(spread, -most, most)
        if not beyond.any():
            return spread
        spread -= beyond
        spread[1:] += 0.5 * beyond[:-1]
        spread[:-1] += 0.5 * beyond[1:]
    return np.clip(spread, -most, most)


@kernel
def traced(profile: CurvatureProfile, start: Array1) -> Traced:
    """The arcs of a profile from a start (3,)."""
    x, y, phi = start[0], start[1], start[2]
    segments, first, knots = profile.arcs, profile.first, profile.knots
    poses, arcs = np.empty((segments[-1], 3)), np.empty((segments[-1], ARC))
    knot = np.empty(segments[-1], np.int64)
    for m in range(len(profile.direction)):
        count, d = segments[m + 1] - segments[m], profile.direction[m]
        h = profile.length[m] / count
        for j in range(count):
            i, last = segments[m] + j, first[m + 1] - first[m] - 1
            place = (j + 0.5) / count * last
            k = min(int(place), last - 1)
            share, at = place - k, first[m] + k
            curvature = (1.0 - share) * knots[at] + share * knots[at + 1]
            middle_x, middle_y, middle_phi = pose_after(x, y, phi, 0.5 * d * h, curvature)
            x, y, phi = pose_after(x, y, phi, d * h, curvature)
            poses[i, 0], poses[i, 1], poses[i, 2] = x, y, phi
            arcs[i, MIDDLE_X], arcs[i, MIDDLE_Y] = middle_x, middle_y
            arcs[i, TANGENT_X], arcs[i, TANGENT_Y] = d * cos(middle_phi), d * sin(middle_phi)
            arcs[i, CURVATURE], arcs[i, SHARE], knot[i] = curvature, share, at
    return Traced(poses, arcs, knot)


@kernel
def slopes_of(profile: CurvatureProfile, at: Traced, rows: Index1) -> Out3:
    """Derivatives of the poses with these indices (n,) by curvatures and lengths, (n, 3, k + m), (R3)."""
    (poses, arcs, knot), segments, knots = at, profile.arcs, len(profile.knots)
    slopes = np.zeros((len(rows), 3, knots + len(profile.length)))
    for r in range(len(rows)):
        x, y = poses[rows[r], 0], poses[rows[r], 1]
        for m in range(len(profile.direction)):
            count, d = segments[m + 1] - segments[m], profile.direction[m]
            h, slope = profile.length[m] / count, slopes[r]
            for j in range(segments[m], min(segments[m + 1], rows[r] + 1)):
                # R (p - m_j), and kappa_j d.
                across_x, across_y = -(y - arcs[j, MIDDLE_Y]), x - arcs[j, MIDDLE_X]
                turn = arcs[j, CURVATURE] * d
                _add(slope, knot[j], d * h * (1.0 - arcs[j, SHARE]), across_x, across_y)
                _add(slope, knot[j] + 1, d * h * arcs[j, SHARE], across_x, across_y)
                slope[0, knots + m] += (arcs[j, TANGENT_X] + turn * across_x) / count
                slope[1, knots + m] += (arcs[j, TANGENT_Y] + turn * across_y) / count
                slope[2, knots + m] += turn / count
    return slopes


@inner
def _add(slope: Array, variable: int, turn: float, across_x: float, across_y: float) -> None:
    slope[0, variable] += turn * across_x
    slope[1, variable] += turn * across_y
    slope[2, variable] += turn
