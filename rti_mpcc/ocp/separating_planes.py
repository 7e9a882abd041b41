"""How near the pieces of the body are to half-planes, and which half-planes they are held to at corners.

The half-plane of the nearest boundary point b of a disc has its normal along c - b, as the disc needs it.
Where b is a corner that juts out, or an open end, the piece of the body in the disc may be clear of b by
much more than that half-plane tells: 0.15 m before the bumper, half-way to its end, by 0.37 m. With q the
point of the piece that is nearest to b, t and t' the tangents of the boundary to and from b,

(H7)  n = (q - b)/|q - b|  if n·t >= 0 and n·t' <= 0,  else the normal of that one whose condition it breaks,

where this leaves the piece more room than the half-plane of its disc, and only where its end points at the
wall, |n·u| >= a/r as in (H6). Only a piece that is near the half-plane of its disc, and has something to gain
by the corner itself, is held by another one: `corner_near` and `corner_gain` of `Footprint`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from geometry import HalfPlanes, ReflexVertices
from rti_mpcc.config import Footprint
from rti_mpcc.model.footprint import Discs, Reach
from rti_mpcc.model.layout import PHI
from rti_mpcc.types import Array, Complex, Index

_TINY = 1e-9  # what rounding may leave of a product that is 0


class SeparatingPlanes(NamedTuple):
    """What pieces of the body are kept apart from, for k of the half-planes of their discs' centres c.

    Attributes:
        normal: (k,) n as complex numbers, in the frame of the states.
        across: (k,) n·v.
        distance: (k,) n·(c - b) [m].
        reach: (k,) of the pieces towards there.
    """

    normal: Complex
    across: Array
    distance: Array
    reach: Reach

    @property
    def gap(self) -> Array:
        """(k,) between piece and half-plane [m]."""
        return self.distance - self.reach.value


def separating_planes(
    states: Array,
    planes: HalfPlanes,
    among: Index,
    discs: Discs,
    footprint: Footprint,
    reflex_vertices: Callable[[Index], ReflexVertices | None],
) -> SeparatingPlanes:
    """(H6) and (H7) for bodies at `states` (n, >= 3) and the half-planes of their discs' centres.

    Args:
        among: (k,) those that are asked for: (state * discs + disc) * sides + side.
        reflex_vertices: which of some of them are of points that jut out, in the frame of the states.
    """
    normal = planes.normal.view(np.complex128).reshape(-1)[among]
    heading = states[:, PHI][among // (len(discs.offsets) * planes.distance.shape[1])]
    turn = np.exp(1j * heading)
    seen = normal * turn.conj()
    value, slope = np.full(among.size, discs.radius), np.zeros(among.size)
    found = SeparatingPlanes(normal, seen.imag, planes.distance.reshape(-1)[among], Reach(value, slope))
    # Beside the body it is the disc that counts.
    ahead = discs.ahead(seen.real).nonzero()[0]
    if ahead.size:
        value[ahead], slope[ahead] = discs.reach(seen.real[ahead], seen.imag[ahead])
        _turn_to_corners(found, ahead, seen[ahead], turn, among, discs, footprint, reflex_vertices)
    return found


def _turn_to_corners(
    found: SeparatingPlanes,
    at: Index,
    n: Complex,
    turn: Complex,
    among: Index,
    discs: Discs,
    footprint: Footprint,
    reflex_vertices: Callable[[Index], ReflexVertices | None],
) -> None:
    """Put half-planes (H7) in the place of those found that are of corners.

    All of it as it is seen from the body, where u = 1 and v = i.

    Args:
        at: (j,) which may be; n: (j,) their normals; turn, among: (k,) headings of the bodies, and numbers.
    """
    distance, gap = found.distance[at], found.gap[at]
    corner, most = -distance * n, np.array((discs.half_length, discs.half_width))
    q = np.minimum(np.maximum(corner.view(np.float64).reshape(-1, 2), -most), most).view(np.complex128)[:, 0]
    apart = np.abs(q - corner)
    worth = (gap < footprint.corner_near) & (distance > 0.0)
    worth &= apart > np.maximum(gap, 0.0) + footprint.corner_gain
    some = worth.nonzero()[0]
    juts = reflex_vertices(among[at[some]]) if some.size else None
    if juts is None:
        return
    some = some[juts.at]
    at, n, corner, q, gap = at[some], n[some], corner[some], q[some], gap[some]
    turn = turn[at]
    straight = (q - corner) / apart[some]
    before, after = juts.before / turn, juts.after / turn
    normal = np.where(_dot(straight, before) < 0.0, _normal_beside(before, straight), straight)
    normal = np.where(_dot(straight, after) > 0.0, _normal_beside(after, straight), normal)
    # Straight to the corner it is q that is kept from it, and as the body turns q moves by i q.
    is_straight, reach = normal == straight, discs.reach(normal.real, normal.imag)
    value = np.where(is_straight, -_dot(normal, q), reach.value)
    slope = np.where(is_straight, -_dot(normal, 1j * q), reach.slope)
    away = distance[some] * _dot(n, normal)

    better = (away - value > gap) & discs.ahead(normal.real)
    better &= (_dot(normal, before) >= -_TINY) & (_dot(normal, after) <= _TINY)
    to = at[better]
    found.normal[to], found.across[to] = (normal * turn)[better], normal.imag[better]
    found.distance[to] = away[better]
    found.reach.value[to], found.reach.slope[to] = value[better], slope[better]


def _dot(one: Complex, other: Complex) -> Array:
    return one.real * other.real + one.imag * other.imag


def _normal_beside(tangent: Complex, n: Complex) -> Complex:
    """The normal of a tangent on the side of n."""
    return 1j * tangent * np.where(_dot(n, 1j * tangent) < 0.0, -1.0, 1.0)
