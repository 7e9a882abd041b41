"""Smooth chains of arcs through given poses or points."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from geometry.arrays import Array, Index, Mask
from geometry.errors import PathError
from geometry.pose import wrap
from geometry.sampling import number_steps, steps

_SAME_POINT = 1e-6  # [m]
_SAME_HEADING = 1e-3  # [rad] two rows of one cusp
_SPACING = 0.25  # [m] between the samples of a spline
_STRAIGHT = 1e-9  # [rad] chords that turn by less on both sides of a point do not turn there


def biarcs(poses: Array, directions: Index) -> tuple[Index, Array, Array]:
    """Return two arcs for each interval between poses (n, 3), which meet with a common tangent: directions,
    curvatures [1/m] and lengths [m] (2 n - 2,).

    With unit tangents t_1, t_2 of the travel and v from the first point to the second, both control legs
    being d long:

        |v - d (t_1 + t_2)| = 2 d,  b = v.(t_1 + t_2),  d = v.v/(b + sqrt(b² + 2 (1 - t_1.t_2) v.v))   (1)

    and the arcs meet at the mean of p_1 + d t_1 and p_2 - d t_2. An arc that leaves its chord of length c
    by the angle a turns by 2 a, has the curvature 2 sin(a)/c and the length c/sinc(a).

    Raises PathError if a heading is more than 90 deg away from the chord beside it.
    """
    turned = np.where(directions > 0, 0.0, np.pi)
    angle_1, angle_2 = poses[:-1, 2] + turned, poses[1:, 2] + turned
    t_1, t_2 = _unit(angle_1), _unit(angle_2)
    p_1, p_2 = poses[:-1, :2], poses[1:, :2]
    v = p_2 - p_1
    _check_chords(v, t_1, t_2)
    vv, b = (v * v).sum(1), (v * (t_1 + t_2)).sum(1)
    d = (vv / (b + np.sqrt(b * b + 2.0 * np.maximum(1.0 - (t_1 * t_2).sum(1), 0.0) * vv)))[:, None]
    middle = 0.5 * (p_1 + p_2 + d * (t_1 - t_2))
    first, second = middle - p_1, p_2 - middle
    a_1 = wrap(np.arctan2(first[:, 1], first[:, 0]) - angle_1)
    a_2 = wrap(angle_2 - np.arctan2(second[:, 1], second[:, 0]))
    chords = np.stack([np.hypot(*first.T), np.hypot(*second.T)], axis=1)
    a = np.stack([a_1, a_2], axis=1)
    curvatures = directions[:, None] * 2.0 * np.sin(a) / chords
    return np.repeat(directions, 2), curvatures.ravel(), (chords / np.sinc(a / np.pi)).ravel()


def pose_intervals(poses: Array, directions: Index) -> tuple[Array, Index]:
    """Return poses (k, 3) without doubled cusp rows and the directions (k-1,) of the intervals between them.

    Raises PathError for repeated points, or a cusp whose two rows differ in heading.
    """
    v, (before, after) = np.diff(poses[:, :2], axis=0), _around(poses, directions)
    doubled = _doubled(v, before, after)
    turned = doubled & (np.abs(wrap(np.diff(poses[:, 2]))) > _SAME_HEADING)
    if turned.any():
        i = int(np.argmax(turned)) + 1
        raise PathError(f"row {i}: the two rows of a cusp must have the same heading.")
    along = (v * (_unit(poses[:-1, 2]) + _unit(poses[1:, 2]))).sum(1)
    intervals = np.where(before == after, before, np.where(along >= 0.0, 1, -1))
    return _without_doubled(poses, intervals, doubled, "poses")


def spline_poses(points: Array, directions: Index) -> tuple[Array, Index]:
    """Return poses (k, 3) on a chord-length Akima spline per direction, and the directions between them.

    At a cusp both ways must have one tangent: it is the mean of those of the splines with free ends. Raises
    PathError for repeated points, or a cusp at which the way does not turn back.
    """
    points, intervals = _point_intervals(points, directions)
    cuts = [0, *(np.flatnonzero(np.diff(intervals)) + 1).tolist(), len(intervals)]
    runs = [points[a : b + 1] for a, b in pairwise(cuts)]
    ways = [int(intervals[a]) for a in cuts[:-1]]
    tangents = [_tangents(run) for run in runs]
    for i in range(1, len(runs)):
        last, first = tangents[i - 1][-1], tangents[i][0]  # views: both become the mean
        before, after = ways[i - 1] * last / np.hypot(*last), ways[i] * first / np.hypot(*first)
        if before @ after <= 0.0:
            raise PathError(f"points[{cuts[i]}]: the way does not turn back where the direction changes.")
        common = (before + after) / np.hypot(*(before + after))
        last[:], first[:] = ways[i - 1] * common, ways[i] * common
    rows = [_sampled(*each) for each in zip(runs, tangents, ways, strict=True)]
    kinds = [np.full(len(each) - 1, way) for each, way in zip(rows, ways, strict=True)]
    return np.concatenate([rows[0], *(each[1:] for each in rows[1:])]), np.concatenate(kinds)


def _point_intervals(points: Array, directions: Index) -> tuple[Array, Index]:
    """As `pose_intervals`, for points: the cusp is the row at which the way turns back more sharply."""
    v, (before, after) = np.diff(points, axis=0), _around(points, directions)
    doubled = _doubled(v, before, after)
    unit = v / np.where(doubled, 1.0, np.hypot(*v.T))[:, None]
    turn = np.concatenate(([1.0], (unit[:-1] * unit[1:]).sum(1), [1.0]))  # cosine at each row, 1 at both ends
    intervals = np.where((before == after) | (turn[1:] <= turn[:-1]), before, after)
    return _without_doubled(points, intervals, doubled, "points")


def _around(rows: Array, directions: Index) -> tuple[Index, Index]:
    """The directions of the rows before and after each interval: both its own where they are of intervals."""
    return (directions[:-1], directions[1:]) if len(directions) == len(rows) else (directions, directions)


def _doubled(v: Array, before: Index, after: Index) -> Mask:
    """Whether each interval v (n, 2) is between the two rows of a cusp. Raises PathError as its callers."""
    same = np.hypot(*v.T) < _SAME_POINT
    repeated = same & (before == after)
    if repeated.any():
        i = int(np.argmax(repeated))
        raise PathError(f"row {i + 1} repeats the point of row {i}, points must differ.")
    return np.asarray(same)


def _without_doubled(rows: Array, intervals: Index, doubled: Mask, name: str) -> tuple[Array, Index]:
    kept = rows[np.concatenate(([True], ~doubled))]
    if len(kept) < 2:
        raise PathError(f"{name} has one point only, a path needs at least 2.")
    return kept, intervals[~doubled]


def _tangents(points: Array) -> Array:
    """Tangents (k, 2) at points (k, 2), between which the chords have the directions m_i.

    After Akima, "A new method of interpolation and smooth curve fitting", J. ACM 1970, eq. (1):

        t_i = (w m_{i-1} + w' m_i)/(w + w'),  w = |m_{i+1} - m_i|,  w' = |m_{i-1} - m_{i-2}|          (2)

    and their mean where w = w' = 0. What is straight stays so up to a corner, of few points, too: a spline
    of continuous curvature swings from there to both ends. With lengths of vectors in the place of those of
    their components, so that it is the same in any frame.
    """
    chords = np.diff(points, axis=0)
    chords /= np.hypot(*chords.T)[:, None]
    if len(chords) == 1:
        return np.repeat(chords, 2, axis=0)
    before = [3.0 * chords[0] - 2.0 * chords[1], 2.0 * chords[0] - chords[1]]
    after = [2.0 * chords[-1] - chords[-2], 3.0 * chords[-1] - 2.0 * chords[-2]]
    m = np.vstack([*before, chords, *after])
    turns = np.hypot(*np.diff(m, axis=0).T)[:, None]
    w, other = turns[2:], turns[:-2]
    straight = w + other < _STRAIGHT
    w, other = np.where(straight, 1.0, w), np.where(straight, 1.0, other)
    tangents: Array = (w * m[1:-2] + other * m[2:-1]) / (w + other)
    return tangents


def _sampled(points: Array, tangents: Array, direction: int) -> Array:
    """Vehicle poses (k, 3) on cubics over the chord lengths, at most _SPACING apart; heading continuous."""
    from scipy.interpolate import CubicHermiteSpline  # here: a tenth of a second to import, and seldom needed

    lengths = np.hypot(*np.diff(points, axis=0).T)
    spline = CubicHermiteSpline(np.concatenate(([0.0], np.cumsum(lengths))), points, tangents)
    lengths = np.diff(spline.x)
    counts = steps(lengths, _SPACING, "the way through the points", PathError)
    piece, step = number_steps(counts)
    at = np.append(spline.x[piece] + step * (lengths / counts)[piece], spline.x[-1])
    slope = direction * spline(at, 1)
    return np.column_stack([spline(at), np.unwrap(np.arctan2(slope[:, 1], slope[:, 0]))])


def _check_chords(v: Array, t_1: Array, t_2: Array) -> None:
    for rows, tangent in ((0, t_1), (1, t_2)):
        against = (v * tangent).sum(1) <= 1e-9 * np.hypot(*v.T)
        if against.any():
            i = int(np.argmax(against))
            raise PathError(
                f"row {i + rows}: its heading is 90 deg or more away from the way between rows {i} and "
                f"{i + 1} in the given direction, it must be less."
            )


def _unit(angle: Array) -> Array:
    return np.stack([np.cos(angle), np.sin(angle)], axis=-1)
