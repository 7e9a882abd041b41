"""How near the pieces of the body are to half-planes, and which half-planes they are held to at corners.

The half-plane of the nearest boundary point b of a disc has its normal along c - b, as the disc needs it.
Where b is a corner that juts out, or an open end, the piece of the body in the disc may be clear of b by
much more than that half-plane tells: 0.15 m before the bumper, half-way to its end, by 0.37 m. With q the
point of the piece that is nearest to b, t and t' the tangents of the boundary to and from b,

(H7)  n = (q - b)/|q - b|  if n·t >= 0 and n·t' <= 0,  else the normal of that one whose condition it breaks,

where this leaves the piece more room than the half-plane of its disc, and only where its end points at the
wall, |n·u| >= a/r as in (H6).
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from geometry import HalfPlanes, Jutting
from rti_mpcc.model.footprint import Discs, Reach
from rti_mpcc.model.layout import PHI
from rti_mpcc.types import Array

Complex = NDArray[np.complex128]
Index = NDArray[np.int64]
Mask = NDArray[np.bool_]
_TINY = 1e-9  # what rounding may leave of a product that is 0


class Facing(NamedTuple):
    """What the pieces of the body are kept apart from, at m = states * discs centres c, s sides.

    Attributes:
        normal: (m, s) n of the half-planes as complex numbers, in the frame of the states.
        across: (m, s) n·v.
        distance: (m, s) n·(c - b) [m].
        reach: (m, s) of the pieces towards there.
    """

    normal: Complex
    across: Array
    distance: Array
    reach: Reach

    @property
    def gap(self) -> Array:
        """(m, s) between piece and half-plane [m]."""
        return self.distance - self.reach.value


def facing(states: Array, planes: HalfPlanes, juts: Jutting | None, discs: Discs) -> Facing:
    """(H6) and (H7) for bodies at `states` (n, >= 3) and the half-planes of their discs' centres."""
    turn = np.repeat(np.exp(1j * states[:, PHI]), len(discs.offsets))
    normal = planes.normal.view(np.complex128)[..., 0]
    seen = normal * turn.conj()[:, None]
    found = Facing(normal, seen.imag, planes.distance, discs.reach(seen.real, seen.imag))
    return found if juts is None else _turned(found, seen, turn[juts.at // len(seen[0])], juts, discs)


def _turned(found: Facing, seen: Complex, turn: Complex, juts: Jutting, discs: Discs) -> Facing:
    """The same with half-planes (H7) at corners.

    Args:
        seen: (m, s) normals as seen from the body, where u = 1 and v = i, as all is here; turn: (k,) its
            heading at the corners.
    """
    a, b, at = discs.half_length, discs.half_width, juts.at
    n, distance = seen.flat[at], found.distance.flat[at]
    corner = -distance * n
    q = np.clip(corner.real, -a, a) + 1j * np.clip(corner.imag, -b, b)
    apart = np.abs(q - corner)
    straight = np.divide(q - corner, apart, out=n.copy(), where=apart > 0.0)
    before, after = juts.before / turn, juts.after / turn
    normal = np.where(_dot(straight, before) < 0.0, _normal_beside(before, straight), straight)
    normal = np.where(_dot(straight, after) > 0.0, _normal_beside(after, straight), normal)
    # Straight to the corner it is q that is kept from it, and as the body turns q moves by i q.
    is_straight, reach = normal == straight, discs.reach(normal.real, normal.imag)
    value = np.where(is_straight, -_dot(normal, q), reach.value)
    slope = np.where(is_straight, -_dot(normal, 1j * q), reach.slope)
    away = distance * _dot(n, normal)

    better = (away - value > found.gap.flat[at]) & (distance > 0.0) & (apart > 0.0)
    better &= np.abs(normal.real) >= a / discs.radius
    better &= (_dot(normal, before) >= -_TINY) & (_dot(normal, after) <= _TINY)
    return Facing(
        _but(found.normal, at, better, normal * turn),
        _but(found.across, at, better, normal.imag),
        _but(found.distance, at, better, away),
        Reach(_but(found.reach.value, at, better, value), _but(found.reach.slope, at, better, slope)),
    )


def _but(values: NDArray[Any], at: Index, where: Mask, others: NDArray[Any]) -> NDArray[Any]:
    """Values (m, s) but for `others` (k,) at some of the places (k,)."""
    mixed = values.copy()
    mixed.flat[at[where]] = others[where]
    return mixed


def _dot(one: Complex, other: Complex) -> Array:
    return one.real * other.real + one.imag * other.imag


def _normal_beside(tangent: Complex, n: Complex) -> Complex:
    """The normal of a tangent on the side of n."""
    return 1j * tangent * np.where(_dot(n, 1j * tangent) < 0.0, -1.0, 1.0)
