"""Polylines with an allowed side, sampled, and the sample that is nearest to each of many points.

Polylines are stored as samples at most SPACING apart, oriented so that the allowed side is on the left. A
corner is a vertex where the boundary recedes from the allowed side, turning left by more than CORNER; a
feature is a run of segments between corners or open ends: on it the nearest point moves without jumps.

Points and tangents are complex numbers here; geometry.nearest goes on from the nearest sample to the nearest
point.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from hashlib import blake2b
from itertools import accumulate

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from geometry.sampling import as_complex, as_pairs, chain, ring

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
Index = NDArray[np.int64]
Mask = NDArray[np.bool_]

STRIDE = 4  # samples between those of the coarse tree
_NEAR = 0.3  # [m] nearer than this the coarse tree is not trusted
_FEW = 32  # points up to which asking all samples is as fast
_MANY = 30  # points from which on a matrix product may be faster than the tree
_SCANNED = 1000  # coarse samples that are looked at faster all than by the tree
_BLOCK = 30_000  # of them at a time
_PRODUCT = 500_000  # numbers in a matrix product, at most
_NEIGHBOURS = np.arange(1 - STRIDE, STRIDE)
_TINY = 1e-6  # [m]
_TANGENTS = ("tangent_in", "tangent_out")
_FEATURES = ("feature_in", "feature_out")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Boundary:
    """Sampled polylines with their allowed side on the left; `from_polylines` builds it.

    A sample of a ring knows the segments to both sides; at an open end the one that is missing has length 0
    and the tangent of the other.

    Attributes, for k samples in the order of the polylines:
        vertex: (k,) samples x + iy [m].
        segments: (k, 3) unit tangents of the segments before and behind a sample, and their lengths as the
            real and the imaginary part of one number [m].
        features: (k, 2) of those segments.
        is_end: (k,) whether a polyline begins or ends there.
        first, last: (F,) first and last sample of each feature.
        is_loop: (F,) whether the feature closes on itself.
        is_open: the polylines have ends, so what is beyond them need not be outside.
        tree: of the samples.
        mark: a number that tells this boundary from others.
        coarse, coarse_tree: every STRIDE-th sample, all ends of features and all sharp turns (j,), and their
            tree.
    """

    vertex: Complex
    segments: Complex
    features: Index
    is_end: Mask
    first: Index
    last: Index
    is_loop: Mask
    is_open: bool
    mark: int
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
        is_end = np.concatenate([each.is_end for each in chains])
        lengths = np.concatenate([each.length_in + 1j * each.length_out for each in chains])
        tangents = [np.concatenate([getattr(each, name) for each in chains]) for name in _TANGENTS]
        features_of = [
            np.concatenate([getattr(each, name) + f for each, _, f in shifts]) for name in _FEATURES
        ]
        return cls(
            vertex=vertex,
            segments=np.stack([*tangents, lengths], axis=1),
            features=np.stack(features_of, axis=1),
            is_end=is_end,
            first=first,
            last=last,
            is_loop=np.concatenate([each.is_loop for each in chains]),
            is_open=not closed and leads is None,
            mark=_mark(vertex, is_end, bytes((closed, leads is not None))),
            tree=cKDTree(as_pairs(vertex), leafsize=32),
            coarse=coarse,
            coarse_tree=cKDTree(as_pairs(vertex[coarse]), leafsize=16),
        )

    def nearest_sample(self, c: Complex) -> Index:
        """Index (n,) of the sample nearest to c (n,) [m]: of the coarse ones first, then of their neighbours.

        With samples h apart a point at distance d is seen at sqrt(d² + h²/4) at most. Between two pieces of
        boundary the coarse samples err only where these are equally near but for h²/(8 d), 2 cm at _NEAR;
        nearer, all samples are asked.
        """
        pairs = as_pairs(c)
        if c.size <= _FEW:
            return np.asarray(self.tree.query(pairs)[1], dtype=np.int64)
        around = self.coarse[self._nearest_coarse(c, pairs)][:, None] + _NEIGHBOURS
        r = self.vertex.take(around, mode="clip")
        r -= c[:, None]
        squared = r.real**2 + r.imag**2
        column = squared.argmin(axis=1)
        rows = np.arange(c.size)
        at: Index = np.minimum(np.maximum(around[rows, column], 0), self.vertex.size - 1)
        near = (squared[rows, column] < _NEAR**2).nonzero()[0]
        if near.size:
            at[near] = self.tree.query(pairs[near])[1]
        return at

    def _nearest_coarse(self, c: Complex, pairs: Array) -> Index:
        """Index (n,) of the nearest coarse sample.

        Where not too many samples can be the nearest one of any point, one matrix product
        |v - m|² - 2 (v - m).(c - m) is faster than the tree.
        """
        if c.size >= _MANY:
            middle = complex(c.mean())
            offsets = pairs - (middle.real, middle.imag)
            few = self._within_reach(middle, float(np.sqrt((offsets**2).sum(axis=1).max())))
            if few.size * c.size <= _PRODUCT:
                v = self.vertex[self.coarse[few]] - middle
                # Half the digits halve the time; they err by less than the coarse samples do.
                factors = np.array((-2.0 * v.real, -2.0 * v.imag, v.real**2 + v.imag**2), dtype=np.float32)
                rows = np.ones((c.size, 3), dtype=np.float32)
                rows[:, :2] = offsets
                # In blocks that stay in the cache.
                step = max(_BLOCK // few.size, 1)
                found = [(rows[i : i + step] @ factors).argmin(axis=1) for i in range(0, c.size, step)]
                return np.asarray(few[np.concatenate(found)], dtype=np.int64)
        return np.asarray(self.coarse_tree.query(pairs)[1], dtype=np.int64)

    def _within_reach(self, middle: complex, radius: float) -> Index:
        """Coarse samples v (j,) that may be the nearest of any point within `radius` [m] of the middle m.

        These are no farther from it than min |v - m| + 2 radius.
        """
        if self.coarse.size <= _SCANNED:
            v = self.vertex[self.coarse] - middle
            squared = v.real**2 + v.imag**2
            reach = np.sqrt(squared.min()) + 2.0 * radius
            return np.flatnonzero(squared <= (reach + _TINY) ** 2)
        place = (middle.real, middle.imag)
        reach = float(self.coarse_tree.query(place)[0]) + 2.0 * radius + _TINY
        return np.array(self.coarse_tree.query_ball_point(place, reach, return_sorted=True), dtype=np.int64)


def _mark(vertex: Complex, is_end: Mask, kind: bytes) -> int:
    """A number of 48 bits that hardly any two boundaries share; any float64 holds it."""
    digest = blake2b(vertex.tobytes() + is_end.tobytes() + kind, digest_size=6).digest()
    return int.from_bytes(digest, "little")
