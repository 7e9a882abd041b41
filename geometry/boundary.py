"""Polylines with an allowed side, sampled, and the sample that is nearest to each of many points.

Polylines are stored as samples at most SPACING apart, oriented so that the allowed side is on the left. The
metrics measure with them, and with shapely; the controller does with geometry.shape_grid.

Points and tangents are complex numbers here; geometry.nearest goes on from the nearest sample to the nearest
point.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import accumulate, pairwise
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from geometry.arrays import Array, Complex, Index, Mask
from geometry.sampling import SPACING, as_complex, as_pairs, as_tree, chain, ring

if TYPE_CHECKING:
    from scipy.spatial import cKDTree


STRIDE = 4  # samples between coarse ones
_GROUP = 16  # coarse samples in a group
_GROUPS = 500  # groups that are looked at together when a boundary is built
_NEAR = 0.3  # [m] nearer than this the coarse samples are not trusted
_FEW = 32  # points up to which asking all samples is as fast
_SCANNED = 1000  # coarse samples that are looked at faster all than by groups
_BLOCK = 30_000  # numbers of a matrix product at a time
_PRODUCT = 500_000  # numbers in a matrix product, at most
_NEIGHBOURS = np.arange(1 - STRIDE, STRIDE)
_BESIDE = np.arange(-1, 2)[:, None]
_IN_GROUP = np.arange(_GROUP)
_TINY = 1e-6  # [m]


class Beside(NamedTuple):
    """n samples, and the segments before and behind them.

    At an open end the segment that is missing has length 0 and the tangent of the other; on a ring none is.

    Attributes:
        segments: (4, n) samples x + iy, unit tangents of both segments, their lengths as the real and the
            imaginary part of one number [m].
        is_end: (n,) whether a polyline begins or ends there, and nothing is forbidden beyond.
    """

    segments: Complex
    is_end: Mask

    def take(self, rows: Index) -> Beside:
        """Some of them."""
        return Beside(self.segments.take(rows, axis=1), self.is_end.take(rows))


class Coarse(NamedTuple):
    """Some of the samples of a boundary, in groups.

    Attributes:
        samples: (j,) every STRIDE-th one, and all ends.
        middle, reach: (g,) for each _GROUP of these one of them x + iy, and within what distance of it all
            samples from the first of them to the first of the next group are [m].
    """

    samples: NDArray[np.int32]
    middle: Complex
    reach: Array


@dataclass(frozen=True, kw_only=True, eq=False)
class Boundary:
    """Sampled polylines with their allowed side on the left; `from_polylines` builds it.

    A route of many kilometres has half a million samples, so a sample is no more than its place, and its
    entry in the tree once that is asked; `beside` derives tangents for the few that are asked for.
    `with_table` has those of all samples, which is faster.

    Attributes, for k samples in the order of the polylines:
        vertex: (k,) samples x + iy [m].
        begins: (p + 1,) first sample of each polyline, and k.
        is_end: (k,) whether a polyline begins or ends there.
        ends: (e,) the samples where one does; at_ends: what is beside these.
        table: what is beside all samples, if it is kept.
        added: (i,) samples between the points that the polylines were given by.
        is_closed: the polylines are rings; the first sample is there again as the last one.
        leads: unit tangents with which another boundary leads to the start and on from the end.
    """

    vertex: Complex
    begins: Index
    is_end: Mask
    ends: Index
    at_ends: Beside
    table: Beside | None
    added: NDArray[np.int32]
    is_closed: bool
    leads: tuple[complex, complex] | None

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
        chains = [ring(line) if closed else chain(line) for line in map(as_complex, polylines)]
        if not chains:
            return None
        begins = np.array(list(accumulate((each.vertex.size for each in chains), initial=0)))
        # The samples of a single polyline may be its own points.
        vertex = np.concatenate([each.vertex for each in chains]) if len(chains) > 1 else chains[0].vertex
        added = np.concatenate([each.added + at for each, at in zip(chains, begins[:-1], strict=True)])
        is_end = np.zeros(vertex.size, dtype=np.bool_)
        is_end[begins[:-1]] = is_end[begins[1:] - 1] = True
        ends = np.flatnonzero(is_end)
        at_ends = _at_ends(vertex, begins, ends, closed, leads)
        return cls(
            vertex=vertex,
            begins=begins,
            is_end=is_end,
            ends=ends,
            at_ends=at_ends,
            table=None,
            added=added.astype(np.int32),
            is_closed=closed,
            leads=leads,
        )

    @cached_property
    def tree(self) -> cKDTree[None]:
        """Of the samples, on the same numbers."""
        # Shrunk to their points, the cells of a line are so flat that a query visits most of them.
        return as_tree(self.vertex, leafsize=64, compact_nodes=False, balanced_tree=False, copy_data=False)

    @cached_property
    def coarse(self) -> Coarse:
        """Some of the samples, to look at first."""
        even = np.arange(0, self.vertex.size, STRIDE, dtype=np.int32)
        samples = np.unique(np.concatenate((even, self.ends), dtype=np.int32, casting="same_kind"))
        return Coarse(samples, *_groups(self.vertex, samples))

    def with_table(self) -> Boundary:
        """Return the same boundary with a table of what is beside all samples, 65 bytes for each."""
        return replace(self, table=self.beside(np.arange(self.vertex.size)))

    def beside(self, at: Index) -> Beside:
        """What is beside some samples (n,)."""
        if self.table is not None:
            return self.table.take(at)
        places = self.vertex.take(at + _BESIDE, mode="clip")
        rows = self.is_end.take(at).nonzero()[0]
        ways = places[1:] - places[:-1]
        if rows.size:
            # There, one of both leads to another polyline.
            ways[:, rows] = 1.0
        lengths = np.abs(ways)
        segments = np.empty((4, at.size), dtype=np.complex128)
        segments[0] = places[1]
        np.divide(ways, lengths, out=segments[1:3])
        segments[3].real, segments[3].imag = lengths
        is_end = np.zeros(at.size, dtype=np.bool_)
        if rows.size:
            which = self.ends.searchsorted(at[rows])
            segments[:, rows] = self.at_ends.segments[:, which]
            is_end[rows] = self.at_ends.is_end[which]
        return Beside(segments, is_end)

    @property
    def is_open(self) -> bool:
        """Whether the polylines have ends, so that what is beyond them need not be outside."""
        return not self.is_closed and self.leads is None

    @property
    def polylines(self) -> tuple[Array, ...]:
        """What it was built from but for repeated points (m, 2) [m]."""
        points, begins = self.vertex, self.begins
        if self.added.size:
            points, begins = np.delete(points, self.added), begins - np.searchsorted(self.added, begins)
        lines = tuple(as_pairs(points[a:b]) for a, b in pairwise(begins))
        for line in lines:
            line.setflags(write=False)
        return lines

    def nearest_sample(self, c: Complex) -> Index:
        """Index (n,) of the sample nearest to c (n,) [m]: of the coarse ones first, then of their neighbours.

        With samples h apart a point at distance d is seen at sqrt(d² + h²/4) at most. Between two pieces of
        boundary the coarse samples err only where these are equally near but for h²/(8 d), 2 cm at _NEAR;
        nearer, all samples are asked.
        """
        pairs = as_pairs(c)
        if c.size <= _FEW:
            return np.asarray(self.tree.query(pairs)[1], dtype=np.int64)
        coarse = self._nearest_coarse(c, pairs)
        if coarse is None:
            return np.asarray(self.tree.query(pairs)[1], dtype=np.int64)
        around = coarse[:, None] + _NEIGHBOURS
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

    def _nearest_coarse(self, c: Complex, pairs: Array) -> Index | None:
        """The nearest coarse samples (n,), None if too many can be the nearest one of any point.

        Else one matrix product |v - m|² - 2 (v - m).(c - m) is faster than the tree.
        """
        middle = complex(c.mean())
        offsets = pairs - (middle.real, middle.imag)
        few = self._within_reach(middle, float(np.sqrt((offsets**2).sum(axis=1).max())))
        if few.size * c.size > _PRODUCT:
            return None
        v = self.vertex[few] - middle
        # Half the digits halve the time; they err by less than the coarse samples do.
        factors = np.array((-2.0 * v.real, -2.0 * v.imag, v.real**2 + v.imag**2), dtype=np.float32)
        rows = np.ones((c.size, 3), dtype=np.float32)
        rows[:, :2] = offsets
        # In blocks that stay in the cache.
        step = max(_BLOCK // few.size, 1)
        found = [(rows[i : i + step] @ factors).argmin(axis=1) for i in range(0, c.size, step)]
        return np.asarray(few[np.concatenate(found)], dtype=np.int64)

    def _within_reach(self, middle: complex, radius: float) -> Index:
        """Coarse samples v (j,) that may be the nearest of any point within `radius` [m] of the middle m.

        These are no farther from it than min |v - m| + 2 radius. The middles of groups are samples as well.
        """
        samples = self.coarse.samples
        if samples.size > _SCANNED:
            away = np.abs(self.coarse.middle - middle)
            groups = np.flatnonzero(away <= away.min() + self.coarse.reach + (2.0 * radius + _TINY))
            among = np.minimum(groups[:, None] * _GROUP + _IN_GROUP, samples.size - 1)
            samples = samples[among.reshape(-1)]
        v = self.vertex[samples] - middle
        squared = v.real**2 + v.imag**2
        reach = np.sqrt(squared.min()) + 2.0 * radius + _TINY
        return np.asarray(samples[squared <= reach**2], dtype=np.int64)

    def pieces_near(self, middle: complex, radius: float) -> list[Complex]:
        """The pieces of the polylines (m_i,) [m] that have all of them within `radius` of a place [m]."""
        coarse = self.coarse
        groups = (np.abs(coarse.middle - middle) <= coarse.reach + radius).nonzero()[0]
        if groups.size == 0:
            return []
        runs = [groups]
        if groups[-1] - groups[0] >= groups.size:
            runs = np.split(groups, np.flatnonzero(np.diff(groups) > 1) + 1)
        begins = self.begins[1:-1]
        pieces = []
        for run in runs:
            # Up to where the following group begins.
            behind = min((int(run[-1]) + 1) * _GROUP, coarse.samples.size - 1)
            start, end = int(coarse.samples[run[0] * _GROUP]), int(coarse.samples[behind]) + 1
            inner = begins[(begins > start) & (begins < end)].tolist() if begins.size else []
            pieces += [self.vertex[a:b] for a, b in pairwise((start, *inner, end))]
        # Groups are larger than bodies.
        reach = radius + 0.5 * SPACING + _TINY
        return [piece for piece in pieces if np.abs(piece - middle).min() <= reach]


def _at_ends(
    vertex: Complex,
    begins: Index,
    at: Index,
    closed: bool,
    leads: tuple[complex, complex] | None,
) -> Beside:
    """What is beside the first and last samples `at` of polylines; see Boundary."""
    line = np.searchsorted(begins, at, side="right")
    start, end = begins[line - 1], begins[line] - 1
    alone, missing = start == end, np.stack((at == start, at == end))
    before = np.maximum(end - 1, start)
    others = np.stack((before, start) if closed else (start, before))
    # The samples that the segments begin with.
    begin = np.where(missing, others, np.stack((at - 1, at)))
    ways = vertex.take(begin + 1, mode="clip") - vertex[begin]
    ways[:, alone] = 1.0
    lengths = np.abs(ways)
    ways /= lengths
    lengths[:, alone] = 0.0
    if not closed:
        lengths[missing] = 0.0
    if leads is not None:
        ways = np.where(missing & ~alone, np.array(leads)[:, None], ways)
    is_end = alone | (not closed and leads is None)
    return Beside(np.vstack((vertex[at], ways, lengths[0] + 1j * lengths[1])), is_end)


def _groups(vertex: Complex, coarse: NDArray[np.int32]) -> tuple[Complex, Array]:
    """Middle and reach of the groups of coarse samples, see Boundary."""
    starts = np.arange(0, coarse.size, _GROUP)
    middle, reach = np.empty(starts.size, dtype=np.complex128), np.empty(starts.size)
    for i in range(0, starts.size, _GROUPS):
        some = slice(i, i + _GROUPS)
        members = np.minimum(starts[some, None] + np.arange(_GROUP + 1), coarse.size - 1)
        places = vertex[coarse[members]]
        middle[some] = places[:, _GROUP // 2]
        reach[some] = np.abs(places - middle[some, None]).max(axis=1)
    # Others are half the way between two coarse ones from the nearer of these, at most.
    return middle, reach + 0.5 * STRIDE * SPACING
