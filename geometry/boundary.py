"""Polylines with an allowed side, and the nearest of their points to many others.

Polylines are stored as samples at most SPACING apart, oriented so that the allowed side is on the left. A
corner is a vertex where the boundary recedes from the allowed side, turning left by more than CORNER; a
feature is a run of segments between corners or open ends: on it the nearest point moves without jumps.

Points and tangents are complex numbers here: with r = c - vertex and a unit tangent t, conj(t) r has the
way along the segment as its real part and the distance to its left, the allowed side, as its imaginary
part.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import accumulate

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from geometry.sampling import as_complex, as_pairs, chain, ring

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
Index = NDArray[np.int64]
Mask = NDArray[np.bool_]

WINDOW = 24  # samples to either side in which a kept feature is searched
STRIDE = 4  # samples between those of the coarse tree
_NEAR = 0.3  # [m] nearer than this the coarse tree is not trusted
_MANY = 100  # points from which on that may be worth it
_BLOCK = 30_000  # of them at a time
_PRODUCT = 500_000  # numbers in a matrix product, at most
_NEIGHBOURS = np.arange(1 - STRIDE, STRIDE)
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


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Boundary:
    """Sampled polylines with their allowed side on the left; `from_polylines` builds it.

    A sample of a ring knows the segments to both sides; at an open end the one that is missing has length 0
    and the tangent of the other.

    Attributes, for k samples in the order of the polylines:
        vertex: (k,) samples x + iy [m].
        tangent_in, tangent_out: (k,) unit tangents of the segments before and behind a sample.
        length_in, length_out: (k,) lengths of those segments [m].
        feature_in, feature_out: (k,) features of those segments.
        is_end: (k,) whether a polyline begins or ends there.
        first, last: (F,) first and last sample of each feature.
        is_loop: (F,) whether the feature closes on itself.
        is_open: the polylines have ends, so what is beyond them need not be outside.
        tree: of the samples.
        coarse, coarse_tree: every STRIDE-th sample, all ends of features and all sharp turns (j,), and their
            tree.
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
    is_open: bool
    tree: cKDTree[None]
    coarse: Index
    coarse_tree: cKDTree[None]

    @classmethod
    def from_polylines(
        cls,
        polylines: Sequence[Array],
        *,
        closed: bool = False,
        leads: tuple[complex, complex] | None = None,
    ) -> Boundary | None:
        """Sample polylines (m, 2) [m] with their allowed side on the left; None if there are none.

        Args:
            polylines: at least one point each; a single point is a boundary without extent.
            closed: the polylines are rings, the first point follows the last.
            leads: unit tangents with which another boundary leads to their start and on from their end, so
                that these are not open.
        """
        chains = [ring(line) if closed else chain(line, leads=leads) for line in map(as_complex, polylines)]
        if not chains:
            return None
        samples = list(accumulate((each.vertex.size for each in chains), initial=0))
        features = list(accumulate((each.first.size for each in chains), initial=0))
        shifts = list(zip(chains, samples[:-1], features[:-1], strict=True))
        vertex = np.concatenate([each.vertex for each in chains])
        first = np.concatenate([each.first + s for each, s, _ in shifts])
        last = np.concatenate([each.last + s for each, s, _ in shifts])
        sharp = np.concatenate([each.sharp + s for each, s, _ in shifts])
        coarse = np.unique(np.concatenate((np.arange(0, vertex.size, STRIDE), first, last, sharp)))
        return cls(
            vertex=vertex,
            tangent_in=np.concatenate([each.tangent_in for each in chains]),
            tangent_out=np.concatenate([each.tangent_out for each in chains]),
            length_in=np.concatenate([each.length_in for each in chains]),
            length_out=np.concatenate([each.length_out for each in chains]),
            feature_in=np.concatenate([each.feature_in + f for each, _, f in shifts]),
            feature_out=np.concatenate([each.feature_out + f for each, _, f in shifts]),
            is_end=np.concatenate([each.is_end for each in chains]),
            first=first,
            last=last,
            is_loop=np.concatenate([each.is_loop for each in chains]),
            is_open=not closed and leads is None,
            tree=cKDTree(as_pairs(vertex), leafsize=32),
            coarse=coarse,
            coarse_tree=cKDTree(as_pairs(vertex[coarse]), leafsize=16),
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
            feature, sample: (n,) those of the last call, -1 where there was none. A point keeps its feature
                unless another is nearer by more than hysteresis; on it, samples near the last one are
                searched.
            hysteresis: [m].
        """
        best = self._on_segments(c, self._nearest_sample(c, pairs))
        if feature is not None and sample is not None:
            best = self._keep(c, best, feature, sample, hysteresis)
        return best

    def _nearest_sample(self, c: Complex, pairs: Array) -> Index:
        """Index (n,) of the nearest sample: of the coarse ones first, then of their neighbours.

        With samples h apart a point at distance d is seen at sqrt(d² + h²/4) at most. Between two pieces of
        boundary the coarse samples err only where these are equally near but for h²/(8 d), 2 cm at _NEAR;
        nearer, all samples are asked.
        """
        around = self.coarse[self._nearest_coarse(c, pairs)][:, None] + _NEIGHBOURS
        around = np.minimum(np.maximum(around, 0), self.vertex.size - 1)
        r = self.vertex[around] - c[:, None]
        squared = r.real**2 + r.imag**2
        column = np.argmin(squared, axis=1)
        rows = np.arange(c.size)
        at: Index = around[rows, column]
        near = np.flatnonzero(squared[rows, column] < _NEAR**2)
        if near.size:
            at[near] = self.tree.query(pairs[near])[1]
        return at

    def _nearest_coarse(self, c: Complex, pairs: Array) -> Index:
        """Index (n,) of the nearest coarse sample.

        All points lie within R of their middle m, so their nearest samples do within min |v - m| + 2 R of
        it. Where these are few, one matrix product |v - m|² - 2 (v - m).(c - m) is faster than the tree.
        """
        if c.size >= _MANY:
            middle = complex(c.mean())
            v = self.vertex[self.coarse] - middle
            squared = v.real**2 + v.imag**2
            offsets = pairs - (middle.real, middle.imag)
            reach = np.sqrt(squared.min()) + 2.0 * np.sqrt((offsets**2).sum(axis=1).max())
            few = np.flatnonzero(squared <= (reach + _TINY) ** 2)
            if few.size * c.size <= _PRODUCT:
                factors = np.stack((-2.0 * v[few].real, -2.0 * v[few].imag, squared[few]))
                rows = np.column_stack((offsets, np.ones(c.size)))
                # In blocks that stay in the cache.
                step = max(_BLOCK // few.size, 1)
                found = [(rows[i : i + step] @ factors).argmin(axis=1) for i in range(0, c.size, step)]
                return np.asarray(few[np.concatenate(found)], dtype=np.int64)
        return np.asarray(self.coarse_tree.query(pairs)[1], dtype=np.int64)

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
        # At the rim of its window the search has not arrived; the nearest point overall has, if it is on the
        # same feature.
        lost = ((at == s - WINDOW) & (at > low)) | ((at == s + WINDOW) & (at < high))
        lost |= self.is_loop[f] & ((at == low) | (at == high))
        keep = np.abs(kept.distance) <= np.abs(best.distance[ask]) + hysteresis
        keep &= ~(lost & same[ask])
        to = ask[keep]
        best.point[to], best.normal[to] = kept.point[keep], kept.normal[keep]
        best.distance[to] = kept.distance[keep]
        best.feature[to], best.sample[to] = kept.feature[keep], kept.sample[keep]
        return best

    def _on_segments(self, c: Complex, at: Index, only: Index | None = None) -> Nearest:
        """Nearest points (n,) on the segments beside samples `at`, on one feature if `only` is given.

        The sign is that of the segment, at a vertex that of both tangents together (the pseudo-normal).
        Beyond an open end nothing is forbidden: positive.
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
        d_in = (z_in.real - along_in) ** 2 + z_in.imag**2
        d_out = (z_out.real - along_out) ** 2 + z_out.imag**2
        inward = d_in < d_out
        distance = np.sqrt(np.minimum(d_in, d_out))
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


def _mean_tangent(before: Complex, after: Complex) -> Complex:
    """Unit tangent between two, the latter where they are opposite."""
    total = before + after
    size = np.abs(total)
    opposite = size < 1e-9
    return np.where(opposite, after, total / np.where(opposite, 1.0, size))
