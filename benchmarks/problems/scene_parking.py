"""Bays beside a lane, and slots along a kerb, between parked cars.

All is made in the frame of the lane: x along it, parked cars below y = 0. The vehicle is driven out of its
place until it is in line with the lane, and on along it; the scene is that drive backwards.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from math import atan2, cos, hypot, pi, sin

import numpy as np

from benchmarks.problems.scene_parts import Draw, Layout, box
from benchmarks.problems.witness import Drive, Ground
from rti_mpcc.types import Array

MOVES = 16
"""Pieces of a way out of a slot, at most; out of a bay it is half of them."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _Row:
    """Places along the lane: angle of their axis to it [rad], from one to the next along it [m]."""

    slant: float
    pitch: float

    def place(self, x: float, depth: float, reach: float) -> tuple[float, float]:
        """Middle (x, y) [m] of a body in the place at x: the lane is `depth` above it, `reach` its half."""
        down = -(depth + reach) / sin(self.slant)
        return x + down * cos(self.slant), down * sin(self.slant)


def bay(draw: Draw) -> Layout | None:
    """A bay between parked cars, right-angled or slanted, docked in forward or in reverse.

    None: no way out was found.
    """
    wide = draw.width + draw(0.45, 0.5 + 0.3 * draw.scale)
    # Neighbours are ahead of one another by wide/tan(slant): by 0.6 of their length at most.
    slant = 0.5 * pi if draw.chance(0.5) else draw(atan2(wide, 0.6 * draw.length), 1.3)
    row = _Row(slant=slant, pitch=wide / sin(slant))
    reach = 0.5 * (draw.length * sin(slant) + draw.width * cos(slant))
    places, lane = int(draw.random.integers(2, 6)), draw(0.95, 1.6) * draw.length
    half = (places + 0.5) * row.pitch + draw.length
    nose_out = draw.chance(0.5)
    x, y = row.place(0.0, draw(-0.05, 0.1) * draw.length, reach)
    goal = draw.axle(x + draw(-0.05, 0.05), y, slant if nose_out else slant - pi)
    back = 2.0 * reach + draw(0.2, 0.4) + 0.1 * draw.length
    obstacles = [
        draw.car(
            *row.place(i * row.pitch + draw(-0.08, 0.08), draw(-0.05, 0.1) * draw.length, reach),
            slant + draw(-0.03, 0.03) + pi * draw.chance(0.3),
        )
        for i in range(-places, places + 1)
        if i and (abs(i) == 1 or draw.chance(0.8))
    ]
    obstacles += _behind(draw, row, back, reach, half) + _across(draw, row, lane, reach, half)
    obstacles += _ends(draw, half, -back, lane)
    ground, out = draw.ground(obstacles), 1 if nose_out else -1
    if not ground.free(goal):
        return None
    drive = ground.leaving(
        draw.random, Drive.at(goal), out, (0.3 * draw.length, draw.length + lane), (0.0, pi), moves=MOVES // 2
    )
    return None if drive is None else _finished(draw, ground, drive, obstacles, box(-half, 0.0, half, lane))


def slot(draw: Draw) -> Layout | None:
    """A slot along a kerb between parked cars; None: no way out was found."""
    least, before = 0.6 if draw.scale > 0.5 else 0.4, draw(0.35, 0.65)
    spare = least + min(2.4, 2.0 * draw.length) * draw(0.0, 1.0) ** 1.5
    side, half = 0.5 * draw.width, draw(1.5, 4.0) * draw.length + 3.0
    goal = draw.axle(0.0, 0.0, draw(-0.02, 0.02))
    lane, kerb = side + draw(0.9, 2.2) * draw.length, -side - draw(0.2, 0.5)
    obstacles = [box(-half, kerb - draw(0.2, 2.0), half, kerb)]
    obstacles += _along_kerb(draw, 0.5 * draw.length + before * spare, half, kerb)
    obstacles += _along_kerb(draw, -0.5 * draw.length - (1.0 - before) * spare, half, kerb)
    row = _Row(slant=0.5 * pi if draw.chance(0.5) else draw(0.75, 1.3), pitch=1.4 * draw.width)
    obstacles += _across(draw, row, lane, 0.5 * draw.length, half)
    ground, out = draw.ground(obstacles), -1 if draw.chance(0.15) else 1
    drive = _out_of_slot(ground, Drive.at(goal), out, 0.9 * draw.width) if ground.free(goal) else None
    return None if drive is None else _finished(draw, ground, drive, obstacles, box(-half, side, half, lane))


def _out_of_slot(ground: Ground, drive: Drive, out: int, lateral: float) -> Drive | None:
    """To and fro at full lock, turning the same way, until the arc in direction `out` leads into the lane.

    That is where the vehicle is at least at y = lateral [m].
    """
    direction = -out
    for _ in range(MOVES):
        bend = ground.curvature * direction * out
        length = ground.free_length(drive.end, direction, bend, 1.2 / ground.curvature)
        found = _into_lane(ground, drive, out, length) if direction == out else None
        if found and found.end.y >= lateral:
            return found
        drive = drive.on(direction, bend, length)
        direction = -direction
    return None


def _into_lane(ground: Ground, drive: Drive, out: int, length: float) -> Drive | None:
    """An arc of at most `length` [m], maybe a straight piece, and an arc back: the longest that is clear."""
    radius = 1.0 / ground.curvature
    for begin, straight in product(np.arange(length, 0.0, -0.25).tolist(), (0.0, 0.4, 0.8)):
        away = drive.on(out, ground.curvature, begin)
        found = ground.driven(away, out, 0.0, straight * radius)
        found = found and ground.driven(found, out, -ground.curvature, abs(away.end.phi) * radius)
        if found:
            return found
    return None


def _finished(draw: Draw, ground: Ground, drive: Drive, obstacles: list[Array], lane: Array) -> Layout | None:
    """A way out, driven on along the lane (m, 2), backwards; with small things in the lane.

    None where the way on is so short that start and goal are not apart by the length of the body.
    """
    reach, direction = draw(0.8, 6.0) * draw.length, draw.sign()
    for onward in (direction, -direction):
        way = ground.wandered(draw.random, drive, onward, reach)
        if hypot(way.end.x - way.begin.x, way.end.y - way.begin.y) > draw.length:
            break
    else:
        return None
    if draw.chance(0.5):
        sizes = (0.2 * draw.scale, 0.9 * draw.scale)
        obstacles = obstacles + draw.strewn(way, lane, int(draw.random.integers(1, 5)), sizes)
    boundary = None
    if draw.chance(0.3):
        low, high = (f([f(each, axis=0) for each in obstacles], axis=0) for f in (np.min, np.max))
        boundary = box(*(low - draw(0.5, 5.0)), *(high + draw(0.5, 5.0)))
    return Layout(drive=way.back(), obstacles=obstacles, boundary=boundary)


def _behind(draw: Draw, row: _Row, back: float, reach: float, half: float) -> list[Array]:
    """What is behind a row: a wall at `back` [m], or another row."""
    if draw.chance(0.6):
        return [box(-half, -back - draw(0.2, 2.0), half, -back)]
    return _cars(draw, row, -back - 2.0 * reach, reach, half)


def _ends(draw: Draw, half: float, low: float, lane: float) -> list[Array]:
    """Walls across the ends of the lane, one in three."""
    walls = [(half, half + draw(0.2, 1.0)), (-half - draw(0.2, 1.0), -half)]
    return [box(left, low * draw(0.0, 1.0), right, lane) for left, right in walls if draw.chance(0.35)]


def _along_kerb(draw: Draw, begin: float, half: float, kerb: float) -> list[Array]:
    """Cars one after the other from x = begin [m] away from 0, with a gap now and then."""
    cars, side, at = [], 1 if begin > 0.0 else -1, abs(begin)
    while at < half:
        size = (draw(0.85, 1.08) * draw.length, draw(0.92, 1.04) * draw.width)
        x, y = side * (at + 0.5 * size[0]), kerb + draw(0.1, 0.4) + 0.5 * size[1]
        cars.append(draw.car(x, y, pi * draw.chance(0.1), size=size))
        at += size[0] + draw(0.3, 1.2) + draw.length * draw.chance(0.15)
    return cars


def _across(draw: Draw, row: _Row, lane: float, reach: float, half: float) -> list[Array]:
    """What is on the other side of the lane, `lane` [m] wide: a wall, a row, or cars along it."""
    kind = draw.random.integers(3)
    if kind == 0:
        return [box(-half, lane, half, lane + draw(0.2, 3.0))]
    if kind == 1:
        return _cars(draw, row, lane, reach, half)
    cars, x = [], -half
    while x < half:
        cars.append(draw.car(x, lane + draw(0.5, 0.65) * draw.width, pi * draw.chance(0.5)))
        x += draw(1.15, 1.6) * draw.length
    return cars


def _cars(draw: Draw, row: _Row, low: float, reach: float, half: float) -> list[Array]:
    """A row of parked cars that begins at y = low [m], every sixth place free."""
    offset = draw(0.0, row.pitch)
    return [
        draw.car(x + offset, low + reach + draw(0.0, 0.08) * draw.length, row.slant + draw(-0.03, 0.03))
        for x in np.arange(-half, half - offset, row.pitch)
        if draw.chance(0.83)
    ]
