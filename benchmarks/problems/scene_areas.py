"""Dead-end yards, the aisles of a warehouse, and open ground with things all over it.

Yards and aisles have a boundary. Where a drive is made from the goal to the start, the scene is that drive
backwards.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import product
from math import pi
from typing import Any

import numpy as np
import shapely

from benchmarks.problems.scene_parts import SPARE, Draw, Layout, box, ring
from benchmarks.problems.witness import Drive, Ground
from geometry import Pose2
from geometry.outline import outline_at
from rti_mpcc.types import Array

MOVES = 12
"""Pieces of a turn, at most."""
TRIES = 20
"""Poses in a yard from which a way out is sought."""


def yard(draw: Draw) -> Layout | None:
    """A yard at the end of a lane in which the vehicle has to turn round; None: no way was found.

    It starts there facing the wrong way and ends in the lane, or comes in along the lane and turns round.
    The lane is along y below 0.
    """
    layout = _branch(draw) if draw.chance(0.25) else _court(draw)
    if layout is None or draw.chance(0.6):
        return layout
    return replace(layout, drive=layout.drive.back())


def _court(draw: Draw) -> Layout | None:
    """A yard wide enough to turn round in by some pieces to and fro."""
    half = 0.5 * draw.width + draw(0.25, 0.4 + 0.8 * draw.scale)
    wide, deep = max(draw(1.5, 2.6) * draw.length, 2.5 * half), draw(1.3, 2.2) * draw.length
    left = -draw(half, wide - half)
    area = _court_area(draw, half, box(left, 0.0, left + wide, deep))
    if area.geom_type != "Polygon" or area.interiors:
        return None
    boundary = ring(area)
    ground = draw.ground([], boundary)
    outward, offset = draw.sign(), draw(-0.5, 0.5) * (half - 0.5 * draw.width - ground.clearance)
    for _ in range(TRIES):
        heading = outward * 0.5 * pi + draw(-1.0, 1.0)
        start = draw.axle(left + draw(0.1, 0.9) * wide, draw(0.15, 0.9) * deep, heading)
        if area.contains(shapely.Point(start.x, start.y)) and ground.free(start):
            drive = _out_of_court(draw, ground, Drive.at(start), outward, offset)
            if drive:
                return Layout(drive=drive, obstacles=_along_walls(draw, drive, boundary), boundary=boundary)
    return None


def _court_area(draw: Draw, half: float, corners: Array) -> Any:
    """The area (shapely) of a yard, crooked, with nooks at its corners (4, 2), and of its lane."""
    lane, deep = draw(1.2, 3.0) * draw.length, float(corners[2, 1])
    court = shapely.Polygon(corners + draw.random.uniform(-0.12, 0.12, (4, 2)) * draw.length)
    parts = [shapely.Polygon(box(-half, -lane, half, 0.2 * deep)), court]
    for _ in range(int(draw.random.integers(3))):
        nook = box(0.0, 0.0, draw(0.3, 0.9) * draw.length, draw(0.3, 0.9) * draw.length)
        x, y = (corners[draw.random.integers(4)] + draw.random.uniform(-0.5, 0.0, 2) * draw.length).tolist()
        parts.append(shapely.Polygon(outline_at(nook, Pose2(x, y, draw(-0.2, 0.2)))))
    return shapely.union_all(parts)


def _out_of_court(draw: Draw, ground: Ground, drive: Drive, outward: int, offset: float) -> Drive | None:
    """Turn until the lane is straight ahead (`outward` 1) or behind (-1), then into it at x = offset [m]."""
    turn = (outward * -0.5 * pi - drive.end.phi) % (2.0 * pi)
    for change, direction in product(draw.random.permutation([turn, turn - 2.0 * pi]).tolist(), (1, -1)):
        turned = ground.turned(drive, drive.end.phi + change, direction, moves=MOVES)
        found = turned and _into_lane(draw, ground, turned, outward, offset)
        if found:
            return found
    return None


def _into_lane(draw: Draw, ground: Ground, drive: Drive, outward: int, offset: float) -> Drive | None:
    """From a pose in line with the lane, maybe some way back first, sideways to x = offset [m] and on."""
    for share in (0.0, 0.5, 1.0):
        back = share * ground.free_length(drive.end, -outward, 0.0, 0.8 * draw.length)
        # To its left there is +x where it faces out of the yard, -x where it faces into it.
        lateral = outward * (offset - drive.end.x)
        found = ground.shifted(drive.on(-outward, 0.0, back), lateral, outward)
        if found:
            inside = max(found.end.y, 0.0)
            onward = ground.free_length(found.end, outward, 0.0, inside + draw(1.0, 1.5) * draw.length)
            if onward > inside:
                return found.on(outward, 0.0, onward)
    return None


def _branch(draw: Draw) -> Layout:
    """A lane with a branch: past it, backwards round the corner into it, and out the way that it came.

    The lane may as well be entered in reverse, and the branch forward.
    """
    radius = 1.0 / (draw(0.75, 1.0) * draw.curvature)
    onward, deep = draw.sign(), draw(0.0, 0.8) * draw.length
    before, after = draw(0.5, 2.0) * draw.length, draw(0.5, 2.0) * draw.length
    start = Pose2(0.0, -before, onward * 0.5 * pi)
    # Round the corner to the side of positive x, so that the heading is +pi or 0 there, and on to -y.
    arc = 0.5 * pi * radius
    drive = Drive.at(start).on(onward, 0.0, before)
    corner = Drive.at(drive.end).on(-onward, -1.0 / radius, arc).on(-onward, 0.0, deep)
    corner = corner.on(onward, 0.0, deep).on(onward, 1.0 / radius, arc)
    drive = Drive.at(start, (*drive.pieces, *corner.pieces)).on(onward, 0.0, after)
    room, spare = draw.clearance + 2.0 * SPARE, 0.15 + 0.6 * draw.scale
    swept = drive.swept(draw.vehicle).buffer(room, join_style="mitre")
    half = 0.5 * draw.width + room
    lane = box(-half - draw(0.0, spare), swept.bounds[1] - spare, half + draw(0.0, spare), swept.bounds[3])
    turn = shapely.convex_hull(corner.swept(draw.vehicle)).buffer(room + draw(0.0, 0.3), join_style="mitre")
    area = shapely.union_all([shapely.Polygon(lane), turn, swept])
    boundary = ring(shapely.simplify(area, 0.5 * SPARE))
    return Layout(drive=drive, obstacles=_along_walls(draw, drive, boundary), boundary=boundary)


def _along_walls(draw: Draw, drive: Drive, boundary: Array) -> list[Array]:
    """A few things in a yard, where the drive leaves room."""
    count = int(draw.random.integers(0, 7))
    return draw.strewn(drive, boundary, count, (0.2 * draw.scale, 1.6 * draw.scale))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Aisles:
    """Aisles along y from -far to 0 [m], and racks beside them.

    Attributes:
        lefts, widths: of the aisles (n,) [m]; racks: widths (n + 1,) [m], the first at x = 0.
        far: length of all [m]; dock: the aisle with the dock.
    """

    lefts: Array
    widths: Array
    racks: Array
    far: float
    dock: int

    @property
    def width(self) -> float:
        """Of all aisles and racks [m]."""
        return float(self.widths.sum() + self.racks.sum())

    def middle(self, i: int) -> float:
        """x of the middle of an aisle [m]."""
        return float(self.lefts[i] + 0.5 * self.widths[i])


def aisle(draw: Draw) -> Layout | None:
    """Aisles between racks, along y below 0, a cross aisle above them, and a dock at the end of one.

    None: no way out of the aisle was found.
    """
    aisles, cross, nose_out = _aisles(draw), draw(1.1, 2.0) * draw.length, draw.chance(0.5)
    far, dock = aisles.far, aisles.dock
    room = 0.5 * float(aisles.widths[dock]) - 0.5 * draw.width - draw.clearance - 2.0 * SPARE
    x, y = aisles.middle(dock) + draw(-0.8, 0.8) * room, -far + 0.5 * draw.length + draw(0.25, 0.6)
    goal = draw.axle(x, y, 0.5 * pi if nose_out else -0.5 * pi)
    obstacles = [*_racks(draw, aisles, cross), *_guides(draw, aisles, x)]
    boundary = _hall(draw, aisles.width, far, cross)
    ground = draw.ground(obstacles, boundary)
    if not ground.free(goal):
        return None
    reach = (max(far - 0.6 * draw.length, 0.1), far + cross)
    drive = ground.leaving(draw.random, Drive.at(goal), 1 if nose_out else -1, reach, (0.0, pi), moves=MOVES)
    if drive is None:
        return None
    other = (dock + int(draw.random.integers(1, aisles.widths.size))) % aisles.widths.size
    drive = _into(draw, ground, drive, aisles.middle(other) + draw(-0.15, 0.15))
    count, hall = int(draw.random.integers(0, 8)), box(0.0, -far, aisles.width, cross)
    pallets = draw.strewn(drive, hall, count, (0.3 * draw.scale, draw.scale))
    return Layout(drive=drive.back(), obstacles=obstacles + pallets, boundary=boundary)


def _aisles(draw: Draw) -> _Aisles:
    """Two to five aisles, each of its own width."""
    count = int(draw.random.integers(2, 6))
    widths = draw.width + draw.random.uniform(0.7, 1.8, count)
    racks = draw.random.uniform(0.25, 0.7, count + 1) * draw.length
    lefts = np.cumsum(racks)[:-1] + np.cumsum(widths) - widths
    far, dock = draw(1.5, 4.0) * draw.length, int(draw.random.integers(count))
    return _Aisles(lefts=lefts, widths=widths, racks=racks, far=far, dock=dock)


def _racks(draw: Draw, aisles: _Aisles, cross: float) -> list[Array]:
    """One in four leaves a way round its far end, `cross` [m] at most, but not beside the dock."""
    found = []
    for i, left in enumerate([0.0, *(aisles.lefts + aisles.widths).tolist()]):
        short = draw.chance(0.25) and i not in (aisles.dock, aisles.dock + 1)
        low = -aisles.far + draw(0.0, cross) * short
        found.append(box(left, low, left + float(aisles.racks[i]), draw(-0.3, 0.0) * draw.scale))
    return found


def _guides(draw: Draw, aisles: _Aisles, x: float) -> list[Array]:
    """What guides a body into the dock at x [m]: a block at either side, as far as the racks."""
    left, half = float(aisles.lefts[aisles.dock]), 0.5 * draw.width + draw.clearance + 2.0 * SPARE
    right = left + float(aisles.widths[aisles.dock])
    high = -aisles.far + draw(0.1, 0.6) * draw.length
    return [box(left, -aisles.far, x - half, high), box(x + half, -aisles.far, right, high)]


def _hall(draw: Draw, width: float, far: float, cross: float) -> Array:
    """The outline (m, 2) of a hall over the aisles, with a bay in the wall of the cross aisle."""
    hall = shapely.Polygon(box(-draw(0.0, 1.5), -far, width + draw(0.0, 1.5), cross))
    wide, at = draw(0.3, 1.0) * draw.length, draw(0.0, width)
    niche = shapely.Polygon(box(at - wide, 0.9 * cross, at + wide, cross + draw(0.1, 0.6) * draw.length))
    return ring(shapely.union_all([hall, niche]))


def _into(draw: Draw, ground: Ground, drive: Drive, x: float) -> Drive:
    """Along the cross aisle and into the aisle at x [m] where there is room for it, or else only along."""
    radius, along = 1.0 / ground.curvature, float(np.cos(drive.end.phi))
    for direction, out in product(draw.random.permutation([1, -1]).tolist(), (1, -1)):
        # The arc goes down into the aisle, in direction `out`, and takes `radius` along the way.
        way = direction * (x - out * radius * along - drive.end.x) * along
        found = ground.driven(drive, direction, 0.0, way) if way > 0.0 else None
        found = found and ground.driven(found, out, -along * ground.curvature, 0.5 * pi * radius)
        if found:
            free = ground.free_length(found.end, out, 0.0, 2.0 * draw.length)
            return found.on(out, 0.0, draw(0.3, 1.0) * free)
    return ground.wandered(draw.random, drive, draw.sign(), draw(1.0, 4.0) * draw.length)


def clutter(draw: Draw) -> Layout | None:
    """Things of all shapes over 30 to 60 m, less for a small vehicle; some on the straight way if they can.

    None where start and goal are near to one another.
    """
    across = draw(30.0, 60.0) if draw.scale > 0.5 else draw(12.0, 30.0)
    drive = _roamed(draw, across)
    swept = drive.swept(draw.vehicle)
    start, goal = (shapely.Point(pose.x, pose.y) for pose in (drive.begin, drive.end))
    if start.distance(goal) < 1.5 * draw.length:
        return None
    keeps = [swept.buffer(draw.clearance + 3.0 * SPARE + much * draw.scale) for much in (0.0, 0.1, 0.4, 1.0)]
    bare = shapely.LineString([start, goal]).difference(keeps[0])
    obstacles = []
    for x, y in _middles(draw, drive, bare, across):
        size = float(np.exp(draw(np.log(0.6), np.log(9.0)))) * max(draw.scale, 0.35)
        shape = shapely.Polygon(draw.thing(x, y, size)).difference(keeps[draw.random.integers(len(keeps))])
        obstacles += [
            ring(part)
            for part in shapely.get_parts(shapely.simplify(shape, 2.0 * SPARE))
            if part.area > 0.05 * draw.scale**2 and not part.interiors
        ]
    return Layout(drive=drive, obstacles=obstacles)


def _middles(draw: Draw, drive: Drive, bare: Any, across: float) -> list[tuple[float, float]]:
    """Middles (x, y) [m] of things: anywhere, beside a drive, and on what is left of the straight way."""
    anywhere = draw.random.uniform(0.0, across, (int(draw.random.integers(20, 60)), 2))
    way = draw.random.permutation(drive.poses(0.5))[: int(draw.random.integers(5, 25))]
    beside = draw.width * draw.random.uniform(0.7, 2.5, len(way)) * draw.random.choice([-1.0, 1.0], len(way))
    near = way[:, :2] + beside[:, None] * np.column_stack([-np.sin(way[:, 2]), np.cos(way[:, 2])])
    on = [bare.interpolate(draw(0.0, 1.0), normalized=True)] if bare.length > 0.0 else []
    return [*map(tuple, anywhere.tolist()), *map(tuple, near.tolist()), *((each.x, each.y) for each in on)]


def _roamed(draw: Draw, across: float) -> Drive:
    """A drive of straight pieces and arcs within a square [m], from anywhere to anywhere."""
    drive = Drive.at(
        Pose2(draw(0.1, 0.9) * across, draw(0.1, 0.9) * across, draw(-pi, pi)),
    )
    direction, wanted = draw.sign(), draw(0.6, 1.6) * across
    for _ in range(40):
        if drive.length > wanted:
            break
        curvature = 0.0 if draw.chance(0.35) else draw.sign() * draw(0.3, 1.0) * draw.curvature
        length = draw(0.3, 1.6) / abs(curvature) if curvature else draw(0.05, 0.3) * across
        onward = drive.on(direction, curvature, length)
        if max(abs(onward.end.x - 0.5 * across), abs(onward.end.y - 0.5 * across)) < 0.5 * across:
            drive = onward
        if draw.chance(0.25):
            direction = -direction
    return drive
