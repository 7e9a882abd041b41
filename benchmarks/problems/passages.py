"""Curves between poses along which a body has room and a vehicle can steer while it drives."""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil

import numpy as np
import shapely
from numpy.typing import NDArray

from geometry import Corridor, PathPart, lift, wrap
from geometry.outline import shape_of
from rti_mpcc.config import Vehicle
from rti_mpcc.model.footprint import body_polygons
from rti_mpcc.types import Array, Complex, Index

CURVATURE_SHARE = 0.95
"""Of the vehicle's largest curvature, what the motion may take."""
CURVATURE_SLOPE = 0.25
"""Largest |dkappa/ds| of the motion [1/m²]."""
CLEARANCE = 0.1
"""Distance that the body keeps to boundaries and obstacles [m]."""
SPACING = 0.1
"""Between the poses of the motion, at most [m]."""
_NEAREST = 2.0  # [m] between the ends of a curve
_TURN = 1.5  # [rad] from one end to the other, at most
_ASIDE = 0.8  # cosine of the angle between the way to the end and the headings at both ends, at least
_SHAPE = np.linspace(0.0, 1.0, 41)  # u at which a curve is looked at first
_COARSE = slice(None, None, 4)  # of these, where its body is
_BLOCK = 5000  # curves at a time


@dataclass(frozen=True, slots=True, kw_only=True)
class SideClearance:
    """The body and where it has to stay on one part of the route.

    Attributes:
        vehicle: the body; corridor: of the route; index: of its part.
        part: of the route.
        curvature: the largest that is allowed [1/m]; slope: of it, likewise [1/m²].
    """

    vehicle: Vehicle
    corridor: Corridor
    index: int
    part: PathPart
    curvature: float
    slope: float = CURVATURE_SLOPE

    def free(self, motion: Array) -> NDArray[np.bool_]:
        """(...) whether the body at poses (..., >= 3) keeps CLEARANCE."""
        rows = motion.reshape(-1, motion.shape[-1])
        if len(rows) == 0:
            return np.zeros(motion.shape[:-1], dtype=np.bool_)
        bodies, walls = body_polygons(rows, self.vehicle), self.corridor.walls[self.index]
        lines = shapely.MultiLineString([line for line in walls.both if len(line) > 1])
        hit, shapes = np.zeros(len(rows), dtype=np.bool_), shapely.polygons(bodies)
        for thing in (lines, *map(shape_of, self.corridor.obstacles)):
            shapely.prepare(thing)
            hit |= shapely.dwithin(thing, shapes, CLEARANCE)
        # One corner answers for most bodies that touch nothing.
        asked = np.flatnonzero(~hit)
        asked = asked[walls.grid.beyond(bodies[asked, 0]) > 0.0]
        beyond = walls.grid.beyond(bodies[asked].reshape(-1, 2)) > 0.0
        hit[asked[beyond.reshape(bodies[asked].shape[:2]).all(axis=1)]] = True
        return np.asarray(~hit).reshape(motion.shape[:-1])

    def hardness(self, motion: Array, slope: Array) -> Array:
        """(k,) largest share of the limits on curvature and slope that motions (k, m, 4), (k, m) take."""
        bent, turned = np.abs(motion[..., 3]).max(axis=1), np.abs(slope).max(axis=1)
        return np.asarray(np.maximum(bent / self.curvature, turned / self.slope))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Joined:
    """k curves that are gentle enough by a first look, gentlest first.

    Attributes:
        begin, end: (k,) which poses they join.
        curves: (k, 6) quintics.
        heading: (k,) of the vehicle at their begin [rad].
        hard: (k,) share of the limits that they take.
    """

    begin: Index
    end: Index
    curves: NDArray[np.complex128]
    heading: Array
    hard: Array

    def motion(self, row: int, room: SideClearance) -> Array | None:
        """Poses with curvature (n, 4) of a curve behind its begin; None where a close look finds it bad."""
        curve, heading = self.curves[row : row + 1], self.heading[row : row + 1]
        shape, _ = driven(room.part.direction, curve, _SHAPE, heading)
        if not room.free(shape[:, _COARSE]).all():
            return None
        length = float(np.hypot(*np.diff(shape[0, :, :2], axis=0).T).sum())
        # The speed along a curve may be twice its mean.
        fine = np.linspace(0.0, 1.0, 2 * ceil(length / SPACING) + 1)
        motion, slope = driven(room.part.direction, curve, fine, heading)
        if room.hardness(motion, slope)[0] > 1.0 or not room.free(motion).all():
            return None
        return motion[0, 1:]


def joined(begins: Array, ends: Array, speeds: Array, room: SideClearance, *, sifted: bool = False) -> Joined:
    """All curves from poses with curvature (b, 4) to others (e, 4) that are gentle enough.

    Args:
        speeds: (s, 2) those that are tried for each, see `quintics`.
        sifted: only those along which there seems to be room, by a coarse look.
    """
    begin, end = _pairs(begins, ends, room.part.direction)
    return among(begins, ends, begin, end, speeds, room, sifted=sifted)


def among(
    begins: Array, ends: Array, begin: Index, end: Index, speeds: Array, room: SideClearance, *, sifted: bool
) -> Joined:
    """As `joined`, of the pairs begin, end (p,) alone."""
    begin, end = np.repeat(begin, len(speeds)), np.repeat(end, len(speeds))
    tried = np.tile(speeds, (len(begin) // len(speeds), 1))
    found = []
    for first in range(0, max(len(begin), 1), _BLOCK):
        rows = slice(first, first + _BLOCK)
        found.append(_looked_at(begins, ends, begin[rows], end[rows], tried[rows], room, sifted))
    columns = [np.concatenate(column) for column in zip(*found, strict=True)]
    order = np.argsort(columns[-1], kind="stable")
    names = ("begin", "end", "curves", "heading", "hard")
    return Joined(**{name: column[order] for name, column in zip(names, columns, strict=True)})


def _looked_at(
    begins: Array, ends: Array, begin: Index, end: Index, speeds: Array, room: SideClearance, sifted: bool
) -> tuple[NDArray[np.generic], ...]:
    """Those of the curves that do so far, as the columns of `Joined`."""
    heading = begins[begin, 2]
    curves = quintics(room.part.direction, begins[begin], ends[end], speeds)
    motion, slope = driven(room.part.direction, curves, _SHAPE, heading)
    hard = room.hardness(motion, slope)
    same = np.abs(wrap(motion[:, -1, 2] - ends[end, 2])) < 1e-6
    kept = np.flatnonzero((hard <= 1.0) & same)
    if sifted:
        kept = kept[room.free(motion[kept, _COARSE]).all(axis=1)]
    return begin[kept], end[kept], curves[kept], heading[kept], hard[kept]


def _pairs(begins: Array, ends: Array, direction: int) -> tuple[Index, Index]:
    """Which begins (b, 4) and ends (e, 4) one quintic may join: neither too near nor too much aside."""
    way = (ends[:, 0] + 1j * ends[:, 1])[None, :] - (begins[:, 0] + 1j * begins[:, 1])[:, None]
    chord = np.abs(way)
    from_begin = direction * (way * np.exp(-1j * begins[:, 2])[:, None]).real
    from_end = direction * (way * np.exp(-1j * ends[:, 2])[None, :]).real
    turn = np.abs(wrap(ends[None, :, 2] - begins[:, None, 2]))
    ahead = np.minimum(from_begin, from_end) >= _ASIDE * chord
    begin, end = np.nonzero(ahead & (chord >= _NEAREST) & (turn <= _TURN))
    return begin, end


def quintics(direction: int, begins: Array, ends: Array, speeds: Array) -> Complex:
    """Coefficients (k, 6) of powers of u of quintics between two poses, many at a time.

    A quintic in u = 0 ... 1 has the position p, unit tangent t of the travel, left normal n and curvature
    c = dphi/ds of a motion at either end, and free speeds m there:

        p' = m t,   p'' = m² c n   at u = 0 and u = 1                                                    (1)

    In the direction d of motion t = d (cos phi, sin phi) and c = d kappa. Points are complex numbers x + iy.

    Args:
        direction: d, +1 forward, -1 reverse.
        begins, ends: (k, 4) poses with their curvature: x [m], y [m], heading of the vehicle [rad] and
            kappa = tan(steering)/wheelbase [1/m].
        speeds: (k, 2) m at both ends in shares of the distance between them.
    """
    p_0, p_1 = (rows[:, 0] + 1j * rows[:, 1] for rows in (begins, ends))
    m = speeds * np.abs(p_1 - p_0)[:, None]
    t_0, t_1 = (direction * np.exp(1j * rows[:, 2]) for rows in (begins, ends))
    v_0, v_1 = m[:, 0] * t_0, m[:, 1] * t_1
    a_0 = m[:, 0] ** 2 * direction * begins[:, 3] * 1j * t_0
    a_1 = m[:, 1] ** 2 * direction * ends[:, 3] * 1j * t_1
    p, v, a = p_1 - p_0 - v_0 - 0.5 * a_0, v_1 - v_0 - a_0, a_1 - a_0
    return np.stack(
        [
            p_0,
            v_0,
            0.5 * a_0,
            10.0 * p - 4.0 * v + 0.5 * a,
            -15.0 * p + 7.0 * v - a,
            6.0 * p - 3.0 * v + 0.5 * a,
        ],
        axis=1,
    )


def driven(direction: int, curves: Complex, u: Array, heading: Array) -> tuple[Array, Array]:
    """Poses with curvature (k, m, 4) of curves (k, 6) at u (m,), and dkappa/ds (k, m) [1/m²] there.

    `heading` (k,) is the vehicle's at their begin [rad], from which it is continued.
    """
    order = np.arange(6)
    powers = u[:, None] ** order
    p = curves @ powers.T
    p_1 = (curves[:, 1:] * order[1:]) @ powers[:, :5].T
    p_2 = (curves[:, 2:] * (order[2:] * order[1:5])) @ powers[:, :4].T
    p_3 = (curves[:, 3:] * (order[3:] * order[2:5] * order[1:4])) @ powers[:, :3].T
    speed = np.maximum(np.abs(p_1), 1e-6)
    cross = (p_1.conj() * p_2).imag
    slope = ((p_1.conj() * p_3).imag / speed**3 - 3.0 * cross * (p_1.conj() * p_2).real / speed**5) / speed
    turned = np.unwrap(np.angle(direction * p_1), axis=1)
    phi = turned + (lift(turned[:, 0], heading) - turned[:, 0])[:, None]
    return np.stack([p.real, p.imag, phi, direction * cross / speed**3], axis=-1), direction * slope
