"""A found way made cheaper: places on it joined by Reeds-Shepp curves wherever that costs less.

Dynamic programming over places along the way: to each the cheapest way from the first one, by the pieces of
the way itself or by one curve from any place before.
"""

from __future__ import annotations

from collections.abc import Generator
from math import ceil, inf
from typing import Final

import numpy as np

from geometry.arrays import Array, Index
from geometry.compiled import Array2, IndexOut1, Out1, Out2, Out3, inner, kernel
from geometry.convex import WITNESS
from geometry.reeds_shepp import PIECES, WORDS, words
from geometry.shape_grid import BodyShape, SolidShapes
from rti_mpcc.route_planner.hybrid_astar import (
    Terms,
    as_pieces,
    bound,
    closeness_along,
    cost_along,
    poses_after,
)

_SLICE = 4096  # poses that are looked at at a time, about
_FROM: Final = 0
_TO: Final = 1
"""The pair of places that is looked at next."""
_CHEAPER: Final = 1e-6  # by less no curve is [m]
_TRIED: Final = 2  # curves, the cheapest ones, that are looked at between two places


def shortened(
    start: Array, way: Array, body: BodyShape, solid: SolidShapes, terms: Terms, *, places: int
) -> Generator[None, None, Array]:
    """A way (m, 2) from the same start (3,) to the same end that costs no more than `way` (n, 2).

    It comes slice by slice. Ways are signed lengths [m] and curvatures [1/m] of pieces. `places`: on the way,
    about.
    """
    way = split(way, max(float(np.abs(way[:, 0]).sum()) / places, 2.0 * terms.check))
    count = len(way)
    at = np.vstack([start[None], poses_after(start, way)])
    cost, before = np.full(count + 1, inf), np.zeros(count + 1, np.int64)
    came, pieces = np.zeros((count + 1, 2)), np.zeros((count + 1, PIECES, 2))
    cost[0], next_pair = 0.0, np.array([0, 1])
    while next_pair[_TO] <= count:
        _shorten(at, way, body, solid, terms, _SLICE, next_pair, cost, before, came, pieces)
        yield
    found, j = [], count
    while j > 0:
        found.append(pieces[j])
        j = int(before[j])
    return joined(np.concatenate(found[::-1]))


def split(way: Array, longest: float) -> Array:
    """The same way in pieces that are no longer than `longest` [m]."""
    counts = [max(ceil(abs(length) / longest - 1e-9), 1) for length, _ in way.tolist()]
    return np.repeat(way / np.column_stack([counts, np.ones(len(way))]), counts, axis=0)


def joined(way: Array) -> Array:
    """The same way with pieces that go on alike put together, and without those of no length."""
    found: list[list[float]] = []
    for length, curvature in way.tolist():
        if abs(length) < 1e-9:
            continue
        if found and found[-1][0] * length > 0.0 and abs(found[-1][1] - curvature) < 1e-9:
            found[-1][0] += length
        else:
            found.append([length, curvature])
    return np.array(found).reshape(-1, 2)


@kernel
def _shorten(
    at: Array2,
    way: Array2,
    body: BodyShape,
    solid: SolidShapes,
    terms: Terms,
    budget: int,
    next_pair: IndexOut1,
    cost: Out1,
    before: IndexOut1,
    came: Out2,
    pieces: Out3,
) -> None:
    """Go on with the next pairs of places, until so many poses were looked at."""
    shape, witness = np.empty((max(solid.largest, 2), 2)), np.empty(WITNESS)
    lengths, turns, order = np.empty((WORDS, PIECES)), np.empty((WORDS, PIECES)), np.empty(WORDS)
    curve = np.zeros((PIECES, 2))
    looks, i, j = 0, next_pair[_FROM], next_pair[_TO]
    while j < len(cost) and looks < budget:
        if i == 0:
            looks += _go_on(at, way, j, body, solid, terms, curve, shape, witness, cost, before, came, pieces)
        if i < j - 1:
            looks += _join(
                at, i, j, body, solid, terms, lengths, turns, order, curve, shape, witness,
                cost, before, came, pieces,
            )  # fmt: skip
            i += 1
        if i >= j - 1:
            i, j = 0, j + 1
    next_pair[_FROM], next_pair[_TO] = i, j


@inner
def _go_on(
    at: Array,
    way: Array,
    j: int,
    body: BodyShape,
    solid: SolidShapes,
    terms: Terms,
    curve: Array,
    shape: Array,
    witness: Array,
    cost: Array,
    before: Index,
    came: Array,
    pieces: Array,
) -> int:
    """Come to a place by the way itself; returns the number of poses that were looked at."""
    curve[:] = 0.0
    curve[0, 0], curve[0, 1] = way[j - 1, 0], way[j - 1, 1]
    # It was found to be clear where it was checked, which need not be where it is looked at now.
    extra, looks = closeness_along(
        at[j - 1, 0], at[j - 1, 1], at[j - 1, 2], curve, terms, body, solid, shape, witness
    )
    cost[j] = cost[j - 1] + cost_along(curve, came[j - 1, 0], came[j - 1, 1], terms)
    cost[j] += extra if extra < inf else terms.closeness * abs(way[j - 1, 0])
    before[j], came[j, 0], came[j, 1] = j - 1, way[j - 1, 0], way[j - 1, 1]
    pieces[j] = curve
    return looks


@inner
def _join(
    at: Array,
    i: int,
    j: int,
    body: BodyShape,
    solid: SolidShapes,
    terms: Terms,
    lengths: Array,
    turns: Array,
    order: Array,
    curve: Array,
    shape: Array,
    witness: Array,
    cost: Array,
    before: Index,
    came: Array,
    pieces: Array,
) -> int:
    """Come to a place from one before by a curve, if that costs less; returns the number of poses that were
    looked at."""
    if cost[i] + bound(at[i], at[j], terms) >= cost[j] - _CHEAPER:
        return 0
    c, s = np.cos(at[i, 2]), np.sin(at[i, 2])
    dx, dy = at[j, 0] - at[i, 0], at[j, 1] - at[i, 1]
    count = words(
        (c * dx + s * dy) / terms.radius, (c * dy - s * dx) / terms.radius, at[j, 2] - at[i, 2],
        lengths, turns,
    )  # fmt: skip
    for k in range(count):
        as_pieces(lengths[k], turns[k], terms.radius, curve)
        order[k] = cost_along(curve, came[i, 0], came[i, 1], terms)
    looks = 0
    for _ in range(min(count, _TRIED)):
        k = int(np.argmin(order[:count]))
        if cost[i] + order[k] >= cost[j] - _CHEAPER:
            break
        as_pieces(lengths[k], turns[k], terms.radius, curve)
        extra, looked = closeness_along(
            at[i, 0], at[i, 1], at[i, 2], curve, terms, body, solid, shape, witness
        )
        looks += looked
        if cost[i] + order[k] + extra < cost[j] - _CHEAPER:
            cost[j], before[j], pieces[j] = cost[i] + order[k] + extra, i, curve
            for each in range(PIECES):
                if curve[each, 0] != 0.0:
                    came[j, 0], came[j, 1] = curve[each, 0], curve[each, 1]
        order[k] = inf
    return looks
