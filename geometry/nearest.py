"""Nearest boundary points: from the nearest sample of a boundary to the point on the segments beside it.

Points and tangents are complex numbers here: with r = c - vertex and a unit tangent t, conj(t) r has the
way along the segment as its real part and the distance to its left, the allowed side, as its imaginary
part.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from geometry.arrays import Array, Complex, Index, Mask
from geometry.boundary import Boundary

WINDOW = 24  # samples to either side in which a kept feature is searched
_WINDOW = np.arange(-WINDOW, WINDOW + 1)
_TINY = 1e-6  # [m] nearer than this the direction to the boundary is noise


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Nearest:
    """Nearest boundary points of n points.

    Attributes:
        point: (n,) boundary point x + iy [m].
        normal: (n,) unit normal into the allowed side, along c - point wherever that has a direction.
        distance: (n,) normal . (c - point), negative on the forbidden side [m].
        feature, sample: (n,) where on the boundary that is.
    """

    point: Complex
    normal: Complex
    distance: Array
    feature: Index
    sample: Index

    def arrays(self) -> tuple[NDArray[Any], ...]:
        """All of them, in this order."""
        return self.point, self.normal, self.distance, self.feature, self.sample


class Samples(NamedTuple):
    """The samples that are nearest to n points, and the segments before and behind them.

    Attributes:
        vertex: (n,) samples x + iy [m].
        tangents: (2, n) unit tangents of both segments; at an open end the one that is missing has that of
            the other.
        lengths: (2, n) [m]; 0 if missing.
        features: (2, n) that they belong to.
        is_end: (n,) whether a polyline begins or ends there.
    """

    vertex: Complex
    tangents: Complex
    lengths: Array
    features: Index
    is_end: Mask

    @classmethod
    def of(cls, asked: Sequence[tuple[Boundary, Index]]) -> Samples:
        """Those of the samples `at` (n_i,) of each boundary, one boundary after the other."""
        found = [boundary.beside(at) for boundary, at in asked]
        segments = np.concatenate([each.segments for each in found], axis=1)
        features = np.concatenate([each.features for each in found], axis=1)
        lengths = segments[3].view(np.float64).reshape(-1, 2).T
        return cls(segments[0], segments[1:3], lengths, features[:2], features[2] != 0)


class _Foot(NamedTuple):
    """Where beside its sample the nearest point of each of n points is.

    inward: on the segment before the sample; along: way from the sample, in the sense of the boundary [m];
    distance: >= 0 [m]; side: negative on the forbidden side.
    """

    inward: Mask
    along: Array
    distance: Array
    side: Array


def nearest(asked: Sequence[tuple[Boundary, Complex]]) -> Nearest:
    """Return the nearest points of each boundary to its points c (n_i,) [m], one boundary after the other.

    All of them pass through the same few array operations, whose number is what costs time.
    """
    found = [(boundary, boundary.nearest_sample(c)) for boundary, c in asked]
    at = np.concatenate([samples for _, samples in found])
    return _on_segments(np.concatenate([c for _, c in asked]), at, Samples.of(found))


def is_allowed(sides: Sequence[Boundary], c: Complex) -> Mask:
    """Return (n,) whether the signed distances of c (n,) [m] to all sides are >= 0."""
    if not sides:
        return np.ones(c.size, dtype=np.bool_)
    samples = Samples.of([(side, side.nearest_sample(c)) for side in sides])
    r = np.concatenate([c] * len(sides)) - samples.vertex
    allowed = _foot(r, samples, samples.lengths).side >= 0.0
    return np.asarray(allowed.reshape(len(sides), -1).all(axis=0))


def _on_segments(c: Complex, at: Index, samples: Samples, only: Index | None = None) -> Nearest:
    """Nearest points (n,) on the segments beside samples `at`, on one feature if `only` is given."""
    lengths, tangents, features = samples.lengths, samples.tangents, samples.features
    if only is not None:
        lengths = np.where(features == only, lengths, 0.0)
    foot = _foot(c - samples.vertex, samples, lengths)
    tangent = np.where(foot.inward, tangents[0], tangents[1])
    on_vertex = (foot.along == 0.0).nonzero()[0]
    if on_vertex.size:
        tangent[on_vertex] = _mean_tangent(*tangents[:, on_vertex])
    point = samples.vertex + foot.along * tangent
    signed = np.where(foot.side >= 0.0, foot.distance, -foot.distance)
    apart = foot.distance > _TINY
    if apart.all():
        normal = (c - point) / signed
    else:
        normal = np.where(apart, (c - point) / np.where(apart, signed, 1.0), 1j * tangent)
    feature = np.where(foot.inward, features[0], features[1]) if only is None else only
    return Nearest(point=point, normal=normal, distance=signed, feature=feature, sample=at)


def _foot(r: Complex, samples: Samples, lengths: Array) -> _Foot:
    """Where the nearest points are, for r (n,) from the sample to the point [m].

    The sign is that of the segment, at a vertex that of both tangents together (the pseudo-normal).
    Beyond an open end nothing is forbidden: positive.
    """
    z_in, z_out = samples.tangents.conj() * r
    length_in, length_out = lengths
    along_in = np.minimum(np.maximum(z_in.real, -length_in), 0.0)
    along_out = np.maximum(np.minimum(z_out.real, length_out), 0.0)
    d_in = (z_in.real - along_in) ** 2 + z_in.imag**2
    d_out = (z_out.real - along_out) ** 2 + z_out.imag**2
    inward = d_in < d_out
    along = np.where(inward, along_in, along_out)
    side = np.where(inward, z_in.imag, z_out.imag)
    on_vertex = (along == 0.0).nonzero()[0]
    if on_vertex.size:
        both = z_in.imag[on_vertex] + z_out.imag[on_vertex]
        beyond = samples.is_end[on_vertex]
        if beyond.any():
            beyond &= (z_out.real[on_vertex] != 0.0) | (length_in + length_out == 0.0)[on_vertex]
        side[on_vertex] = np.where(beyond, 1.0, both)
    return _Foot(inward, along, np.sqrt(np.minimum(d_in, d_out)), side)


def _mean_tangent(before: Complex, after: Complex) -> Complex:
    """Unit tangent between two, the latter where they are opposite."""
    total = before + after
    size = np.abs(total)
    opposite = size < 1e-9
    return np.where(opposite, after, total / np.where(opposite, 1.0, size))
