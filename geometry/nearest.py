"""Nearest boundary points: from the nearest sample of a boundary to the point on the segments beside it.

Points and tangents are complex numbers here: with r = c - vertex and a unit tangent t, conj(t) r has the
way along the segment as its real part and the distance to its left, the allowed side, as its imaginary
part.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from geometry.arrays import Array, Complex, Index, Mask
from geometry.boundary import Boundary


class Samples(NamedTuple):
    """The samples that are nearest to n points, and the segments before and behind them.

    Attributes:
        vertex: (n,) samples x + iy [m].
        tangents: (2, n) unit tangents of both segments; at an open end the one that is missing has that of
            the other.
        lengths: (2, n) [m]; 0 if missing.
        is_end: (n,) whether a polyline begins or ends there.
    """

    vertex: Complex
    tangents: Complex
    lengths: Array
    is_end: Mask

    @classmethod
    def of(cls, boundary: Boundary, at: Index) -> Samples:
        """Those of the samples `at` (n,) of a boundary."""
        segments, is_end = boundary.beside(at)
        lengths = segments[3].view(np.float64).reshape(-1, 2).T
        return cls(segments[0], segments[1:3], lengths, is_end)


def distances(boundary: Boundary, c: Complex) -> Array:
    """Return the signed distances (n,) of points c (n,) to a boundary [m], negative on the forbidden side."""
    samples = Samples.of(boundary, boundary.nearest_sample(c))
    distance, side = _foot(c - samples.vertex, samples)
    return np.where(side >= 0.0, distance, -distance)


def is_allowed(sides: Sequence[Boundary], c: Complex) -> Mask:
    """Return (n,) whether the signed distances of c (n,) [m] to all sides are >= 0."""
    allowed = np.ones(c.size, dtype=np.bool_)
    for side in sides:
        allowed &= distances(side, c) >= 0.0
    return allowed


def _foot(r: Complex, samples: Samples) -> tuple[Array, Array]:
    """How far the nearest points are (n,) [m], and what is negative on the forbidden side (n,).

    r: (n,) from the samples to the points [m]. The sign is that of the segment, at a vertex that of both
    tangents together (the pseudo-normal). Beyond an open end nothing is forbidden: positive.
    """
    z_in, z_out = samples.tangents.conj() * r
    length_in, length_out = samples.lengths
    along_in = np.minimum(np.maximum(z_in.real, -length_in), 0.0)
    along_out = np.maximum(np.minimum(z_out.real, length_out), 0.0)
    d_in = (z_in.real - along_in) ** 2 + z_in.imag**2
    d_out = (z_out.real - along_out) ** 2 + z_out.imag**2
    inward = d_in < d_out
    side = np.where(inward, z_in.imag, z_out.imag)
    on_vertex = (np.where(inward, along_in, along_out) == 0.0).nonzero()[0]
    if on_vertex.size:
        both = z_in.imag[on_vertex] + z_out.imag[on_vertex]
        beyond = samples.is_end[on_vertex]
        if beyond.any():
            beyond &= (z_out.real[on_vertex] != 0.0) | (length_in + length_out == 0.0)[on_vertex]
        side[on_vertex] = np.where(beyond, 1.0, both)
    return np.sqrt(np.minimum(d_in, d_out)), side
