"""Polylines with an allowed side, and the nearest of their points to many others.

Polylines are stored as samples at most SPACING apart, oriented so that the allowed side is on the left. A corner is
a vertex that turns by more than CORNER; a feature is a smooth run of segments between corners or open ends.

Points and tangents are complex numbers here: with r = c - vertex and a unit tangent t, conj(t) r has the way along
the segment as its real part and the distance to its left, the allowed side, as its imaginary part.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import accumulate
from math import pi

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
Index = NDArray[np.int64]
Mask = NDArray[np.bool_]

SPACING = 0.05  # [m] at most, between samples
CORNER = pi / 9.0  # [rad]
WINDOW = 24  # samples to either side in which a kept feature is searched
_TINY = 1e-6  # [m] nearer than this the direction to the boundary is noise
_MERGED = 1e-6  # [m] samples nearer to each other are one


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


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Boundary:
    """Sampled polylines with their allowed side on the left; `from_polylines` builds it.

    A sample of a ring knows the segments to both sides; at an open end the one that is missing has length 0 and
    the tangent of the other.

    Attributes, for k samples in the order of the polylines:
        vertex: (k,) samples x + iy [m].
        tangent_in, tangent_out: (k,) unit tangents of the segments before and behind a sample.
        length_in, length_out: (k,) lengths of those segments [m].
        feature_in, feature_out: (k,) features of those segments.
        is_end: (k,) whether a polyline begins or ends there.
        first, last: (F,) first and last sample of each feature.
        is_loop: (F,) whether the feature closes on itself.
        tree: of the samples.
    """

    vertex: Complex
    tangent_in: Complex
    tangent_out: Complex
    length_in: Array
    length_out: Array
    feature_in: Index
    feature_out: Index
    is_end: Mask
    first: Index
    last: Index
    is_loop: Mask
    tree: cKDTree[None]

    @classmethod
    def from_polylines(cls, polylines: Sequence[Array], *, closed: bool = False) -> Boundary | None:
        """Sample polylines (m, 2) [m] with their allowed side on the left; None if there are none.

        Args:
            polylines: at least one point each; a single point is a boundary without extent.
            closed: the polylines are rings, the first point follows the last.
        """
        chains = [
            _ring(line) if closed else _chain(line, is_ring=False) for line in map(as_complex, polylines)
        ]
        if not chains:
            return None
        samples = list(accumulate((chain.vertex.size for chain in chains), initial=0))
        features = list(accumulate((chain.first.size for chain in chains), initial=0))
        shifts = list(zip(chains, samples[:-1], features[:-1], strict=True))
        vertex = np.concatenate([chain.vertex for chain in chains])
        return cls(
            vertex=vertex,
            tangent_in=np.concatenate([chain.tangent_in for chain in chains]),
            tangent_out=np.concatenate([chain.tangent_out for chain in chains]),
            length_in=np.concatenate([chain.length_in for chain in chains]),
            length_out=np.concatenate([chain.length_out for chain in chains]),
            feature_in=np.concatenate([chain.feature_in + f for chain, _, f in shifts]),
            feature_out=np.concatenate([chain.feature_out + f for chain, _, f in shifts]),
            is_end=np.concatenate([chain.is_end for chain in chains]),
            first=np.concatenate([chain.first + s for chain, s, _ in shifts]),
            last=np.concatenate([chain.last + s for chain, s, _ in shifts]),
            is_loop=np.concatenate([chain.is_loop for chain in chains]),
            tree=cKDTree(as_pairs(vertex), leafsize=32),
        )

    def nearest(
        self,
        c: Complex,
        pairs: Array,
        feature: Index | None = None,
        sample: Index | None = None,
        hysteresis: float = 0.0,
    ) -> Nearest:
        """Return the nearest boundary points of c (n,) [m], the same points being given as pairs (n, 2).

        Args:
            feature, sample: (n,) those of the last call, -1 where there was none. A point keeps its feature unless
                another is nearer by more than hysteresis; on it, samples near the last one are searched.
            hysteresis: [m].
        """
        at = np.asarray(self.tree.query(pairs)[1], dtype=np.int64)
        best = self._on_segments(c, at)
        if feature is not None and sample is not None:
            best = self._keep(c, best, feature, sample, hysteresis)
        return best

    def _keep(self, c: Complex, best: Nearest, feature: Index, sample: Index, hysteresis: float) -> Nearest:
        """Put each point back onto its last feature where that is as near but for hysteresis."""
        known = (feature >= 0) & (feature < self.first.size) & (sample >= 0) & (sample < self.vertex.size)
        same = best.feature == feature
        ask = np.flatnonzero(known & ~(same & (np.abs(best.sample - sample) <= WINDOW)))
        if ask.size == 0:
            return best
        f, s, points = feature[ask], sample[ask], c[ask]
        low, high = self.first[f], self.last[f]
        window = np.minimum(
            np.maximum(s[:, None] + np.arange(-WINDOW, WINDOW + 1), low[:, None]), high[:, None]
        )
        r = self.vertex[window] - points[:, None]
        rows = np.arange(ask.size)
        at = window[rows, np.argmin(r.real**2 + r.imag**2, axis=1)]
        kept = self._on_segments(points, at, only=f)
        # At the rim of the window the search has not arrived, there the kept feature's own nearest point is right.
        lost = ((at == s - WINDOW) & (at > low)) | ((at == s + WINDOW) & (at < high))
        lost |= self.is_loop[f] & ((at == low) | (at == high))
        keep = np.abs(kept.distance) <= np.abs(best.distance[ask]) + hysteresis
        keep &= ~(lost & same[ask])
        to, source = ask[keep], keep
        best.point[to], best.normal[to] = kept.point[source], kept.normal[source]
        best.distance[to] = kept.distance[source]
        best.feature[to], best.sample[to] = kept.feature[source], kept.sample[source]
        return best

    def _on_segments(self, c: Complex, at: Index, only: Index | None = None) -> Nearest:
        """Nearest points (n,) on the segments to both sides of samples `at`, of one feature if `only` is given.

        The sign is that of the segment, at a vertex that of both tangents together (the pseudo-normal). Beyond an
        open end nothing is forbidden: positive.
        """
        vertex, tangent_in, tangent_out = self.vertex[at], self.tangent_in[at], self.tangent_out[at]
        length_in, length_out = self.length_in[at], self.length_out[at]
        if only is not None:
            length_in = np.where(self.feature_in[at] == only, length_in, 0.0)
            length_out = np.where(self.feature_out[at] == only, length_out, 0.0)
        r = c - vertex
        z_in, z_out = r * tangent_in.conj(), r * tangent_out.conj()
        along_in = np.minimum(np.maximum(z_in.real, -length_in), 0.0)
        along_out = np.maximum(np.minimum(z_out.real, length_out), 0.0)
        d_in, d_out = np.abs(z_in - along_in), np.abs(z_out - along_out)
        inward = d_in < d_out
        distance = np.where(inward, d_in, d_out)
        along = np.where(inward, along_in, along_out)
        tangent = np.where(inward, tangent_in, tangent_out)
        side = np.where(inward, z_in.imag, z_out.imag)
        on_vertex = np.flatnonzero(along == 0.0)
        if on_vertex.size:
            both = z_in.imag[on_vertex] + z_out.imag[on_vertex]
            beyond = self.is_end[at[on_vertex]] & (
                (z_out.real[on_vertex] != 0.0) | (length_in + length_out == 0.0)[on_vertex]
            )
            side[on_vertex] = np.where(beyond, 1.0, both)
            tangent[on_vertex] = _mean_tangent(tangent_in[on_vertex], tangent_out[on_vertex])
        point = vertex + along * tangent
        signed = np.where(side >= 0.0, distance, -distance)
        apart = distance > _TINY
        normal = np.where(apart, (c - point) / np.where(apart, signed, 1.0), 1j * tangent)
        feature = np.where(inward, self.feature_in[at], self.feature_out[at])
        if only is not None:
            feature = only
        return Nearest(point=point, normal=normal, distance=signed, feature=feature, sample=at)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Chain:
    """One sampled polyline; attributes as in Boundary, indices from 0."""

    vertex: Complex
    tangent_in: Complex
    tangent_out: Complex
    length_in: Array
    length_out: Array
    feature_in: Index
    feature_out: Index
    is_end: Mask
    first: Index
    last: Index
    is_loop: Mask


def _ring(line: Complex) -> _Chain:
    """Sample a ring from a corner on, so that no feature but a smooth loop runs over its seam."""
    line = _merged(line)
    if line.size > 1 and abs(line[-1] - line[0]) <= _MERGED:
        line = line[:-1]
    way = np.roll(line, -1) - line
    corner = np.abs(np.angle(way * np.roll(way, 1).conj())) > CORNER
    line = np.roll(line, -int(np.argmax(corner)))
    return _chain(np.append(line, line[0]), is_ring=True)


def _chain(line: Complex, *, is_ring: bool) -> _Chain:
    """Sample a polyline (m,); a ring repeats its first point at its end."""
    line = _merged(line)
    if line.size == 1:
        return _point(line)
    way = np.diff(line)
    counts = np.maximum(np.ceil(np.abs(way) / SPACING - 1e-9), 1.0).astype(np.int64)
    step = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    share = np.repeat(way / counts, counts)
    vertex = np.append(np.repeat(line[:-1], counts) + step * share, line[-1])
    length = np.repeat(np.abs(way) / counts, counts)
    tangent = np.repeat(way / np.abs(way), counts)
    corner = np.abs(np.angle(tangent[1:] * tangent[:-1].conj())) > CORNER
    feature = np.concatenate(([0], np.cumsum(corner)))
    before, after = (-1, 0) if is_ring else (0, -1)
    starts = np.concatenate(([0], np.flatnonzero(corner) + 1))
    smooth_seam = bool(np.abs(np.angle(tangent[0] * tangent[-1].conj())) <= CORNER)
    ends = np.zeros(vertex.size, dtype=np.bool_)
    ends[[0, -1]] = not is_ring
    return _Chain(
        vertex=vertex,
        tangent_in=np.concatenate((tangent[before : before + 1 or None], tangent)),
        tangent_out=np.concatenate((tangent, tangent[after : after + 1 or None])),
        length_in=np.concatenate(([length[-1] if is_ring else 0.0], length)),
        length_out=np.concatenate((length, [length[0] if is_ring else 0.0])),
        feature_in=np.concatenate((feature[before : before + 1 or None], feature)),
        feature_out=np.concatenate((feature, feature[after : after + 1 or None])),
        is_end=ends,
        first=starts,
        last=np.append(starts[1:], vertex.size - 1),
        is_loop=np.full(starts.size, is_ring and smooth_seam and starts.size == 1),
    )


def _point(line: Complex) -> _Chain:
    """A boundary that is one point: without extent and without a forbidden side."""
    one, zero, index = np.ones(1, dtype=np.complex128), np.zeros(1), np.zeros(1, dtype=np.int64)
    return _Chain(
        vertex=line,
        tangent_in=one,
        tangent_out=one,
        length_in=zero,
        length_out=zero,
        feature_in=index,
        feature_out=index,
        is_end=np.ones(1, dtype=np.bool_),
        first=index,
        last=index,
        is_loop=np.zeros(1, dtype=np.bool_),
    )


def _merged(line: Complex) -> Complex:
    """Drop points that repeat the one before."""
    return line[np.concatenate(([True], np.abs(np.diff(line)) > _MERGED))]


def _mean_tangent(before: Complex, after: Complex) -> Complex:
    """Unit tangent between two, the latter where they are opposite."""
    total = before + after
    size = np.abs(total)
    opposite = size < 1e-9
    return np.where(opposite, after, total / np.where(opposite, 1.0, size))


def as_complex(points: Array) -> Complex:
    """(m, 2) as (m,) x + iy."""
    return np.ascontiguousarray(points, dtype=np.float64).view(np.complex128)[..., 0]


def as_pairs(points: Complex) -> Array:
    """(...) x + iy as (..., 2)."""
    return np.ascontiguousarray(points).view(np.float64).reshape(*points.shape, 2)
