"""Nearest boundary points that are corners jutting into the allowed side, or open ends.

Round such a point the boundary leaves a choice of half-planes. With t and t' the unit tangents of the
boundary to and from it, any unit normal n with n·t >= 0 and n·t' <= 0 has both segments behind it; at an open
end, where one of them is missing, its condition is missing as well.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from geometry.boundary import Boundary
from geometry.sampling import as_complex
from geometry.walls import HalfPlanes

Complex = NDArray[np.complex128]
Index = NDArray[np.int64]


class Jutting(NamedTuple):
    """Those of n points against s sides whose nearest boundary point juts out.

    Attributes:
        at: (k,) which: point * s + side.
        before, after: (k,) t, t' as complex numbers; 0 where there is none.
    """

    at: Index
    before: Complex
    after: Complex


def jutting(sides: Sequence[Boundary | None], planes: HalfPlanes) -> Jutting | None:
    """Return those of half-planes; None if there are none."""
    found = [_of_side(side, planes, i) for i, side in enumerate(sides) if side is not None and side.any_juts]
    some = [each for each in found if each is not None]
    if not some:
        return None
    at, before, after = (np.concatenate(each) for each in zip(*some, strict=True))
    return Jutting(at, before, after)


def _of_side(side: Boundary, planes: HalfPlanes, column: int) -> Jutting | None:
    sample = planes.sample[:, column]
    rows = side.juts.take(sample, mode="clip").nonzero()[0]
    if rows.size == 0:
        return None
    rows = rows[sample[rows] >= 0]
    at = sample[rows]
    on_it = as_complex(planes.point[rows, column]) == side.vertex[at]
    if not on_it.any():
        return None
    rows, found = rows[on_it], side.beside(at[on_it])
    tangents, lengths = found.segments[1:3], found.segments[3]
    return Jutting(
        rows * planes.sample.shape[1] + column,
        np.where(lengths.real > 0.0, tangents[0], 0.0),
        np.where(lengths.imag > 0.0, tangents[1], 0.0),
    )
