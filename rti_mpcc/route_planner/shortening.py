"""A found way made cheaper: places on it joined by Reeds-Shepp curves wherever that costs less.

Dynamic programming over places along the way: to each the cheapest way from the first one, by the pieces of
the way itself or by one curve from any place before.
"""

from __future__ import annotations

from collections.abc import Generator
from math import inf
from typing import Final, NamedTuple

import numpy as np

from geometry.arrays import Array
from geometry.compiled import Array2, IndexOut1, Out1, Out2, Out3, inner, kernel, record
from geometry.reeds_shepp import PIECES
from geometry.shape_grid import BodyShape, SolidShapes
from rti_mpcc.route_planner.arcs import joined, length_of, poses_after, split
from rti_mpcc.route_planner.costs import (
    Around,
    Curves,
    Terms,
    around_of,
    closeness_along,
    cost_along,
    curves_between,
    least_between,
    room_for_curves,
    take_curve,
)

_SLICE = 4096  # poses that are looked at at a time, about
_TRIED: Final = 2  # curves, the cheapest ones, that are looked at between two places
_CHEAPER: Final = 1e-6  # by less no curve is [m]
_FROM: Final = 0
_TO: Final = 1
"""The pair of places that is looked at next."""


@record
class _Places(NamedTuple):
    """Places along a way, and the cheapest ways to them.

    Attributes:
        at: (n, 3) poses; way: (n - 1, 2) the pieces of the way between them.
        cost: (n,) of the cheapest way; before: (n,) the place before on that; came: (n, 2) its last piece;
            pieces: (n, PIECES, 2) the curve from there.
        next_pair: (2,) see above.
    """

    at: Array2
    way: Array2
    cost: Out1
    before: IndexOut1
    came: Out2
    pieces: Out3
    next_pair: IndexOut1


def shortened(
    start: Array,
    way: Array,
    body: BodyShape,
    solid: SolidShapes,
    terms: Terms,
    *,
    places: int,
    came: Array,
) -> Generator[None, None, Array]:
    """A way (m, 2) from the same start (3,) to the same end that costs no more than `way` (n, 2).

    It comes slice by slice. Ways are signed lengths [m] and curvatures [1/m] of pieces. `places`: on the way,
    about; `came`: (2,) the piece before the first one, or zeros.
    """
    if len(way) == 0:
        return way
    way = split(way, max(length_of(way) / places, 2.0 * terms.check))
    count, at = len(way), np.vstack([start[None], poses_after(start, way)])
    for each in (way, at):
        each.setflags(write=False)
    known = _Places(
        at=at,
        way=way,
        cost=np.full(count + 1, inf),
        before=np.zeros(count + 1, np.int64),
        came=np.zeros((count + 1, 2)),
        pieces=np.zeros((count + 1, PIECES, 2)),
        next_pair=np.array([0, 1]),
    )
    known.cost[0], known.came[0] = 0.0, came
    around, curves = around_of(body, solid), room_for_curves()
    while known.next_pair[_TO] <= count:
        _shorten(known, around, terms, curves, _SLICE)
        yield
    found, j = [], count
    while j > 0:
        found.append(known.pieces[j])
        j = int(known.before[j])
    return joined(np.concatenate(found[::-1]))


@kernel
def _shorten(known: _Places, around: Around, terms: Terms, curves: Curves, budget: int) -> None:
    """Go on with the next pairs of places, until so many poses were looked at."""
    looks, i, j = 0, known.next_pair[_FROM], known.next_pair[_TO]
    while j < len(known.cost) and looks < budget:
        if i == 0:
            looks += _go_on(known, j, around, terms, curves)
        if i < j - 1:
            looks += _join(known, i, j, around, terms, curves)
            i += 1
        if i >= j - 1:
            i, j = 0, j + 1
    known.next_pair[_FROM], known.next_pair[_TO] = i, j


@inner
def _go_on(known: _Places, j: int, around: Around, terms: Terms, curves: Curves) -> int:
    """Come to a place by the way itself; returns the number of poses that were looked at."""
    before, piece, curve = known.at[j - 1], known.way[j - 1], curves.curve
    curve[:] = 0.0
    curve[0, 0], curve[0, 1] = piece[0], piece[1]
    extra, looks = closeness_along(before[0], before[1], before[2], curve, inf, terms, around)
    # It was found to be clear where it was checked, which need not be where it is looked at now.
    extra = extra if extra < inf else terms.closeness * abs(piece[0])
    known.cost[j] = known.cost[j - 1] + cost_along(curve, known.came[j - 1, 0], known.came[j - 1, 1], terms)
    known.cost[j] += extra
    known.before[j], known.pieces[j] = j - 1, curve
    known.came[j, 0], known.came[j, 1] = piece[0], piece[1]
    return looks


@inner
def _join(known: _Places, i: int, j: int, around: Around, terms: Terms, curves: Curves) -> int:
    """Come to a place from one before by a curve, if that costs less; returns the number of poses that were
    looked at."""
    here, there, curve, order = known.at[i], known.at[j], curves.curve, curves.order
    if known.cost[i] + least_between(here, there, terms) >= known.cost[j] - _CHEAPER:
        return 0
    count, looks = curves_between(here[0], here[1], here[2], there, terms, curves), 0
    for k in range(count):
        take_curve(curves, k, terms.radius)
        order[k] = cost_along(curve, known.came[i, 0], known.came[i, 1], terms)
    for _ in range(min(count, _TRIED)):
        k = int(np.argmin(order[:count]))
        most = known.cost[j] - _CHEAPER - known.cost[i] - order[k]
        if most <= 0.0:
            break
        take_curve(curves, k, terms.radius)
        extra, looked = closeness_along(here[0], here[1], here[2], curve, most, terms, around)
        looks += looked
        if extra < most:
            known.cost[j] = known.cost[i] + order[k] + extra
            known.before[j], known.pieces[j] = i, curve
            for each in range(PIECES):
                if curve[each, 0] != 0.0:
                    known.came[j, 0], known.came[j, 1] = curve[each, 0], curve[each, 1]
        order[k] = inf
    return looks
