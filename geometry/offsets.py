"""Boundaries of one part of a path at lateral offsets from it, trimmed where they fold.

A boundary point at theta with offset o lies at p(theta) + o n(theta), n to the left of the vehicle's
heading. Its curve runs 1 - o kappa times as fast as the path. Where that is negative, or where the other
side of the wall is corridor of another stretch of the same part, the curve has folded and the point is
dropped:

    dist(p + (o +- PROBE) n, path) < |o|   and   < the offset at the nearest path point, on that side      (1)

The probe just behind the wall makes a wall without thickness, as between two lanes that touch, vanish too,
while the point to which the inside of an arc collapses at o = 1/kappa stays.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import shapely
from scipy.spatial import cKDTree

from geometry.arrays import Array, Mask
from geometry.errors import CorridorError
from geometry.part import PathPart
from geometry.sampling import SPACING, number_steps, steps, thin_out
from geometry.validation import Validated

_PROBE = 1e-3  # [m]
_AT_A_TIME = 8_000  # points that are computed together: a long route takes little memory meanwhile
_ROUNDING = 1e-9 * SPACING  # [m]: a length of whole steps has no more of them
_GAP = 3.0 * SPACING  # [m] between the ends of a fold, at most
_OVERLAP = 10  # samples behind the ends of a fold in which its crossing is sought


@dataclass(frozen=True, slots=True)
class Narrowing(Validated, error=CorridorError):
    """A stretch on which the offsets of a corridor differ; of several at one place the tightest holds.

    Attributes:
        start, end: theta on the whole route, 0 <= start < end <= its length [m].
        left, right: offsets there, left > 0 > right; None: as elsewhere [m].
    """

    start: float
    end: float
    left: float | None = None
    right: float | None = None


class Sections(NamedTuple):
    """Offsets of a part, constant between breaks.

    Attributes:
        breaks: (b+1,) theta, from the start to the end of the part [m].
        left, right: (b,) offsets, left > 0 > right [m].
    """

    breaks: Array
    left: Array
    right: Array

    def bound(self, theta: Array, lateral: Array) -> Array:
        """|offset| (n,) of the side on which the lateral deviations (n,) are [m]."""
        i = np.clip(np.searchsorted(self.breaks, theta, side="right") - 1, 0, self.left.size - 1)
        return np.where(lateral > 0.0, self.left[i], -self.right[i])


class _Raw(NamedTuple):
    """An untrimmed boundary of k points beside a part of a path, `folded` where it runs backwards; `samples`:
    (n,) theta of points of the path, in the tree."""

    part: PathPart
    sections: Sections
    samples: Array
    tree: cKDTree
    theta: Array
    offset: Array
    folded: Mask

    def points(self, start: int, stop: int) -> Array:
        return _points(self.part, self.theta[start:stop], self.offset[start:stop])

    def from_path(self, points: Array) -> tuple[Array, Array, Array]:
        """Return distance from the path [m], theta [m] and lateral deviation [m] of points (n, 2), (n,) each.

        From the samples, refined on the arcs.
        """
        part, theta = self.part, self.samples[self.tree.query(points)[1]]
        for last in (False, False, True):
            at = part.reference(theta)
            dx, dy = points[:, 0] - at.x, points[:, 1] - at.y
            c, s = np.cos(at.phi), np.sin(at.phi)
            lag, lateral = c * dx + s * dy, c * dy - s * dx
            if last:
                break
            # Newton's step; where the point is near a centre of curvature, any theta there is as near.
            pace = np.maximum(1.0 - lateral * part.direction * at.slope, 0.1)
            step = np.clip(part.direction * lag / pace, -SPACING, SPACING)
            theta = np.clip(theta + step, part.start, part.end)
        return np.hypot(lag, lateral), theta, lateral


def trimmed(part: PathPart, sections: Sections, values: Array) -> list[Array]:
    """Return the boundary at the offsets `values` (b,) as polylines (k, 2) of growing theta [m]."""
    raw = _untrimmed(part, sections, values)
    kept = ~raw.folded & ~_is_inside(raw, raw.theta, raw.offset)
    edges = np.flatnonzero(np.diff(np.concatenate(([0], kept, [0])).astype(np.int8)))
    runs = [(int(a), int(b)) for a, b in edges.reshape(-1, 2)]
    if not runs:
        return []
    lines: list[list[Array]] = [[_opened(raw, runs[0][0], -1)]]  # of each the pieces, end to end
    body = raw.points(*runs[0])
    for before, after in pairwise(runs):
        joint = _crossing(raw, before, after)
        following = raw.points(*after)
        if joint is not None:
            body, following = _cut(body, joint), _cut(following[::-1], joint)[::-1]
            lines[-1].append(body)
        elif _is_closed(raw, before, after):
            lines[-1].append(body)
        else:
            lines[-1] += [body, _opened(raw, before[1] - 1, 1)]
            lines.append([_opened(raw, after[0], -1)])
        body = following
    lines[-1] += [body, _opened(raw, runs[-1][1] - 1, 1)]
    return [thin_out(np.concatenate(pieces)) for pieces in lines]


def _untrimmed(part: PathPart, sections: Sections, values: Array) -> _Raw:
    """Sample a side at most SPACING apart, with transverse edges where the offset steps."""
    pieces: list[tuple[Array, Array, Mask]] = []
    for i, (a, b) in enumerate(pairwise(sections.breaks)):
        if i > 0 and values[i] != values[i - 1]:
            n = int(steps(abs(values[i] - values[i - 1]), SPACING, "a step of a boundary", CorridorError)[0])
            across = np.linspace(values[i - 1], values[i], n + 1)[1:-1]
            pieces.append((np.full(n - 1, a), across, np.zeros(n - 1, dtype=np.bool_)))
        inner = part.knots[(part.knots > a) & (part.knots < b)]
        ends = np.concatenate(([a], inner, [b]))
        stretch = 1.0 - values[i] * part.curvature(0.5 * (ends[1:] + ends[:-1]))
        lengths = np.diff(ends) * np.maximum(np.abs(stretch), 1.0)
        counts = steps(lengths - _ROUNDING, SPACING, "a boundary", CorridorError) + 1
        piece, step = number_steps(counts)
        theta = ends[piece] + np.diff(ends)[piece] * step / (counts[piece] - 1)
        pieces.append((theta, np.full(piece.size, values[i]), stretch[piece] < -1e-9))
    along = part.places(SPACING)
    tree = cKDTree(_points(part, along, np.zeros(along.size)), leafsize=32)
    return _Raw(part, sections, along, tree, *map(np.concatenate, zip(*pieces, strict=True)))


def _points(part: PathPart, theta: Array, offset: Array) -> Array:
    at = part.reference(theta)
    return np.column_stack([at.x - offset * np.sin(at.phi), at.y + offset * np.cos(at.phi)])


def _is_inside(raw: _Raw, theta: Array, offset: Array) -> Mask:
    """Equation (1)."""
    found = [np.zeros(0, dtype=np.bool_)]
    for i in range(0, theta.size, _AT_A_TIME):
        at, off = theta[i : i + _AT_A_TIME], offset[i : i + _AT_A_TIME]
        d, to, lateral = raw.from_path(_points(raw.part, at, off + np.copysign(_PROBE, off)))
        found.append((d < np.abs(off) - 1e-9) & (d < raw.sections.bound(to, lateral)))
    return np.concatenate(found)


def _opened(raw: _Raw, end: int, way: int) -> Array:
    """The point between the last kept sample of a run and the first dropped one where the boundary ends."""
    out = end + way
    if not 0 <= out < raw.theta.size or raw.folded[out]:
        return raw.points(end, end + 1)

    def between(share: float) -> tuple[Array, Array]:
        theta = raw.theta[end] + np.array([share]) * (raw.theta[out] - raw.theta[end])
        return theta, raw.offset[end] + np.array([share]) * (raw.offset[out] - raw.offset[end])

    low, high = 0.0, 1.0
    for _ in range(20):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if _is_inside(raw, *between(middle))[0] else (middle, high)
    return _points(raw.part, *between(low))


def _crossing(raw: _Raw, before: tuple[int, int], after: tuple[int, int]) -> Array | None:
    """Where the two ends of a fold cross, both followed a little into the dropped samples."""
    middle = (before[1] + after[0]) // 2
    stop, start = before[1], after[0]
    while stop < min(before[1] + _OVERLAP, middle) and not raw.folded[stop]:
        stop += 1
    while start > max(after[0] - _OVERLAP, middle + 1) and not raw.folded[start - 1]:
        start -= 1
    first = raw.points(max(before[0], before[1] - _OVERLAP), stop)
    second = raw.points(start, min(after[1], after[0] + _OVERLAP))
    if len(first) < 2 or len(second) < 2:
        return None
    common = shapely.intersection(shapely.LineString(first), shapely.LineString(second))
    points = shapely.get_coordinates(common)
    if len(points) == 0:
        return None
    found: Array = points[np.argmin(np.hypot(*(points - raw.points(before[1] - 1, before[1])).T))]
    return found


def _cut(line: Array, joint: Array) -> Array:
    """Let a polyline (m, 2) end at a point (2,) that is on it or shortly behind its end."""
    tail = line[-_OVERLAP - 1 :]
    (x, y), (way_x, way_y) = (joint - tail[:-1]).T, np.diff(tail, axis=0).T
    length = np.maximum(np.hypot(way_x, way_y), 1e-12)
    along, aside = (x * way_x + y * way_y) / length, (y * way_x - x * way_y) / length
    inside = (along >= 0.0) & (along <= length) & (np.abs(aside) < 1e-9)
    kept = len(line) - len(tail) + int(np.argmax(inside)) + 1 if inside.any() else len(line)
    return np.vstack([line[:kept], joint])


def _is_closed(raw: _Raw, before: tuple[int, int], after: tuple[int, int]) -> bool:
    """Whether the straight way over a gap is boundary: it is short or nowhere in the corridor.

    Where the offset steps within a fold the ends do not meet; there it has to keep half the offset only,
    so that no gap is left in the wall.
    """
    i, j = before[1] - 1, after[0]
    begin = raw.points(i, i + 1)
    way = raw.points(j, j + 1) - begin
    length = float(np.hypot(*way[0]))
    if length <= _GAP:
        return True
    n = int(steps(length, SPACING, "a gap in a boundary", CorridorError)[0]) + 1
    d, _, _ = raw.from_path(np.linspace(0.0, 1.0, n)[:, None] * way + begin)
    free = min(abs(raw.offset[i]), abs(raw.offset[j]))
    return bool((d >= (0.5 * free if raw.folded[i:j].any() else free - 2.0 * _PROBE)).all())


def sections_of(part: PathPart, left: float, right: float, narrowings: Sequence[Narrowing]) -> Sections:
    """Return the offsets of a part; `left`, `right` [m] hold where nothing narrows."""
    edges = [edge for row in narrowings for edge in (row.start, row.end) if part.start < edge < part.end]
    breaks = np.unique(np.array([part.start, *edges, part.end]))
    middle = 0.5 * (breaks[1:] + breaks[:-1])
    lefts, rights = np.full((2, middle.size), np.nan)
    for row in narrowings:
        inside = (middle > row.start) & (middle < row.end)
        if row.left is not None:
            lefts[inside] = np.fmin(lefts[inside], row.left)
        if row.right is not None:
            rights[inside] = np.fmax(rights[inside], row.right)
    return Sections(breaks, np.where(np.isnan(lefts), left, lefts), np.where(np.isnan(rights), right, rights))
