"""A route made cheaper: places on it joined by Reeds-Shepp curves wherever that costs less.

Dynamic programming over places along the route: to each the cheapest route from the first one, by the arcs of
the given route or by one curve from any place before.
"""

from __future__ import annotations

from collections.abc import Generator
from math import inf
from typing import Final, NamedTuple

import numpy as np

from geometry.arrays import Array
from geometry.compiled import IndexOut1, Out1, Out2, Out3, copy_row, copy_rows, inner, kernel
from geometry.reeds_shepp import PIECES
from geometry.shape_grid import Body, ShapeGrid
from rti_mpcc.route_planner.arcs import length_of, merge_arcs, poses_after, split_arcs
from rti_mpcc.route_planner.costs import (
    SearchWorkspace,
    Terms,
    cheapest_curve,
    closeness_along,
    cost_along,
    least_to,
    workspace_of,
)

_PLACES = 40  # on a route, about
_SLICE = 60_000  # poses that are checked at a time, and shapes near them, about
_WORDS: Final = 1000  # so many of them take as long as the curves between two places
_CURVES = 2  # the cheapest ones, that are checked between two places
_CHEAPER = 1e-6  # by less no curve is [m]


class _Places(NamedTuple):
    """Places along a route, and the cheapest routes to them.

    Attributes:
        pose: (n, 3); route: (n - 1, 2) the arcs of the given route between them. Both are as writable as the
            search's own, so that numba compiles what works on them once.
        cost: (n,) of the cheapest route; before: (n,) the place before on that; incoming: (n, 2) its last
            arc; arcs: (n, PIECES, 2) the curve from there.
    """

    pose: Out2
    route: Out2
    cost: Out1
    before: IndexOut1
    incoming: Out2
    arcs: Out3


def shorten(
    start: Array, route: Array, incoming: Array, body: Body, solid: ShapeGrid, terms: Terms
) -> Generator[None, None, Array]:
    """A route (m, 2) with the same ends that costs no more than `route` (n, 2), slice by slice.

    Args:
        start: (3,); incoming: (2,) the arc to it, or zeros. Arcs are signed lengths [m] and curvatures [1/m].
    """
    route = merge_arcs(route)
    if len(route) == 0:
        return route
    route = split_arcs(route, max(length_of(route) / _PLACES, 2.0 * terms.check))
    count, pose = len(route), np.vstack([start[None], poses_after(start, route)])
    places = _Places(
        pose=pose,
        route=route,
        cost=np.full(count + 1, inf),
        before=np.zeros(count + 1, np.int64),
        incoming=np.zeros((count + 1, 2)),
        arcs=np.zeros((count + 1, PIECES, 2)),
    )
    places.cost[0], places.incoming[0] = 0.0, incoming
    terms = terms._replace(curves=_CURVES, cheaper=_CHEAPER)
    work, i, j = workspace_of(body, solid), 0, 1
    while j <= count:
        i, j = _advance(places, i, j, terms, work, _SLICE)
        yield
    found, j = [], count
    while j > 0:
        found.append(places.arcs[j])
        j = int(places.before[j])
    return merge_arcs(np.concatenate(found[::-1]))


@kernel
def _advance(
    places: _Places, i: int, j: int, terms: Terms, work: SearchWorkspace, budget: int
) -> tuple[int, int]:
    """Try pairs of places from i and j on, until `budget` is compared; returns the next pair."""
    work.compared[0] = 0
    while j < len(places.cost) and work.compared[0] < budget:
        if i == 0:
            _follow(places, j, terms, work)
        if i < j - 1:
            _join(places, i, j, terms, work)
            i += 1
        if i >= j - 1:
            i, j = 0, j + 1
    return i, j


@inner
def _follow(places: _Places, j: int, terms: Terms, work: SearchWorkspace) -> None:
    """Reach a place by the given route."""
    before, arc, curve = places.pose[j - 1], places.route[j - 1], work.curve
    curve[:] = 0.0
    curve[0, 0], curve[0, 1] = arc[0], arc[1]
    extra = closeness_along(before, curve, inf, terms, work)
    # It was found to be clear at the poses of the search, which need not be those of this check.
    extra = extra if extra < inf else terms.closeness * abs(arc[0])
    places.cost[j] = places.cost[j - 1] + cost_along(curve, places.incoming[j - 1], terms)
    places.cost[j] += extra
    places.before[j] = j - 1
    copy_rows(curve, places.arcs[j])
    copy_row(arc, places.incoming[j])


@inner
def _join(places: _Places, i: int, j: int, terms: Terms, work: SearchWorkspace) -> None:
    """Reach a place from one before by a curve, if that costs less."""
    here, there, most = places.pose[i], places.pose[j], places.cost[j] - terms.cheaper
    if places.cost[i] + least_to(here, there, terms) >= most:
        return
    work.compared[0] += _WORDS
    ends = 0.0, places.incoming[i], np.zeros(2)  # no arc behind it
    cost, closeness = cheapest_curve(here, there, ends, most - places.cost[i], terms, work)
    if cost < inf:
        places.cost[j] = places.cost[i] + cost + closeness
        places.before[j] = i
        copy_rows(work.best, places.arcs[j])
        for each in range(PIECES):
            if work.best[each, 0] != 0.0:
                copy_row(work.best[each], places.incoming[j])
