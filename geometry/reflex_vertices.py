"""Nearest boundary points that are corners jutting into the allowed side, or open ends.

Round such a point the boundary leaves a choice of half-planes. With t and t' the unit tangents of the
boundary to and from it, any unit normal n with n·t >= 0 and n·t' <= 0 has both segments behind it; at an open
end, where one of them is missing, its condition is missing as well.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from geometry.arrays import Complex, Index
from geometry.boundary import Boundary
from geometry.walls import HalfPlanes


class ReflexVertices(NamedTuple):
    """Those of some half-planes whose boundary points jut out.

    Attributes:
        at: (j,) which of them.
        before, after: (j,) t, t' as complex numbers; 0 where there is none.
    """

    at: Index
    before: Complex
    after: Complex


def reflex_vertices(
    sides: Sequence[Boundary | None], planes: HalfPlanes, among: Index
) -> ReflexVertices | None:
    """Return those of half-planes `among` (k,), point * sides + side; None if there are none."""
    sample, side = planes.sample.reshape(-1)[among], among % len(sides)
    found = [
        _of_side(each, planes, among, np.flatnonzero(side == i), sample)
        for i, each in enumerate(sides)
        if each is not None and each.any_juts
    ]
    some = [each for each in found if each is not None]
    if not some:
        return None
    at, before, after = (np.concatenate(each) for each in zip(*some, strict=True))
    return ReflexVertices(at, before, after)


def _of_side(
    side: Boundary, planes: HalfPlanes, among: Index, rows: Index, sample: Index
) -> ReflexVertices | None:
    """Those of one side, which `rows` of `among` are of."""
    rows = rows[side.juts.take(sample[rows], mode="clip")]
    rows = rows[sample[rows] >= 0]
    # The sample that is nearest need not be the nearest point.
    point = planes.point.view(np.complex128).reshape(-1)
    rows = rows[point[among[rows]] == side.vertex[sample[rows]]]
    if rows.size == 0:
        return None
    found = side.beside(sample[rows])
    tangents, lengths = found.segments[1:3], found.segments[3]
    return ReflexVertices(
        rows,
        np.where(lengths.real > 0.0, tangents[0], 0.0),
        np.where(lengths.imag > 0.0, tangents[1], 0.0),
    )
