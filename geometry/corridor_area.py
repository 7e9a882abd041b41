"""The area that a corridor leaves: all of its parts put together, with their open ends.

The boundaries of a part act on that part only, so a vehicle may be wherever one of them lets it be. Where a
part begins and ends there is no boundary: there the area goes on straight, as wide as the part is. Where a
bend has folded a boundary away the area goes as far to that side as to the other one. Behind the end of the
route, where a goal may be beside it, it is open to the sides, too, up to its own boundaries.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely

from geometry.area import Area
from geometry.arrays import Array
from geometry.corridor import Corridor
from geometry.errors import CorridorError
from geometry.outline import path_line
from geometry.part import PathPart
from geometry.path import ReferencePath
from geometry.pose import Pose2
from geometry.walls import PartWalls

_SPACING = 0.1  # [m] of the points of a path by which it is told what is inside
_FINE = 1e-3  # [m] that the outline may be beside the boundaries
_WALL = 0.01  # [m] to either side of a boundary nobody drives behind the ends of a part
_SLIVER = 1e-2  # [m²]: pieces and holes smaller than this are none


def area_of(corridor: Corridor, path: ReferencePath, *, beyond: float) -> Area:
    """Return the area of a corridor along a path, whose obstacles are left out.

    Args:
        beyond: how far it goes on at the open ends, at the end of the route to the sides, too [m].

    Raises:
        CorridorError: the boundaries of a part do not enclose it, or its parts are not connected.
    """
    if corridor.area is not None:
        return corridor.area
    last = len(path.parts) - 1
    parts = [
        _lane_and_ends(k, part, corridor.walls[k], beyond, beyond if k == last else 0.0)
        for k, part in enumerate(path.parts)
    ]
    lanes = shapely.union_all([lane for lane, _ in parts])
    ends = shapely.union_all([end for _, end in parts])
    found = shapely.get_parts(_closed(shapely.union(lanes, ends)))
    begin = shapely.Point(path.start.x, path.start.y)
    whole = found[int(np.argmin(shapely.distance(found, begin)))]
    if shapely.difference(lanes, whole).area > _SLIVER:
        raise CorridorError("the parts of the corridor are not connected.")
    whole = whole.simplify(_FINE)
    holes = [ring for ring in whole.interiors if shapely.Polygon(ring).area > _SLIVER]
    return Area(boundary=_corners(whole.exterior), obstacles=[_corners(ring) for ring in holes])


def _corners(ring: shapely.LinearRing) -> Array:
    corners: Array = shapely.get_coordinates(ring)[:-1]
    return corners


def _closed(shape: shapely.Geometry) -> shapely.Geometry:
    """Without the gaps that rounding leaves between pieces that meet."""
    wider = shapely.buffer(shape, 0.5 * _FINE, join_style="mitre")
    return shapely.buffer(wider, -0.5 * _FINE, join_style="mitre")


def _lines(walls: PartWalls) -> list[shapely.LineString]:
    return [shapely.LineString(line) for side in walls.lines for line in side if len(line) > 1]


def _lane_and_ends(
    index: int, part: PathPart, walls: PartWalls, beyond: float, aside: float
) -> tuple[shapely.Geometry, shapely.Geometry]:
    """What the boundaries of one part enclose, and what is beyond its ends."""
    lines, driven = _lines(walls), path_line(part, _SPACING)
    if not lines:
        raise CorridorError(f"part {index}: it has no boundaries.")
    reach = float(shapely.distance(shapely.points(shapely.get_coordinates(lines)), driven).max())
    ends = [] if walls.joined else _ends(part, walls, reach, beyond, aside)
    around = [] if all(walls.lines) else [shapely.buffer(driven, reach - _FINE).exterior]
    lane = shapely.union_all([
        face
        for face in _faces([*lines, *around, *(shapely.LineString(end.mouth) for end in ends)])
        if shapely.intersects(face.buffer(-_FINE), driven)
    ])  # fmt: skip
    if not shapely.covers(lane.buffer(_FINE), driven):
        raise CorridorError(f"part {index}: its boundaries do not enclose it.")
    open_ends = [
        face
        for end in ends
        for face in _faces([*lines, shapely.Polygon(end.outline).exterior])
        if shapely.covers(face, shapely.Point(end.just_beyond))
    ]
    return lane, shapely.difference(
        shapely.union_all(open_ends), shapely.buffer(shapely.union_all(lines), _WALL)
    )


def _faces(lines: list[shapely.LineString]) -> list[shapely.Polygon]:
    """The polygons that lines enclose between them."""
    return list(
        shapely.get_parts(shapely.polygonize(shapely.get_parts(shapely.node(shapely.union_all(lines)))))
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class _OpenEnd:
    """Where a part has no boundary: across it (3, 2), what is beyond it (n, 2), and a point (2,) of that."""

    mouth: Array
    outline: Array
    just_beyond: Array


def _ends(part: PathPart, walls: PartWalls, reach: float, beyond: float, aside: float) -> list[_OpenEnd]:
    """The begin of a part, and its end, which goes on `aside` [m] to either side.

    To a side without a boundary they are `reach` wide [m].
    """
    # Either boundary has its allowed side on the left: the right one runs with the heading, the left against.
    left, right = walls.lines
    poses = (part.first, part.last) if part.direction > 0 else (part.last, part.first)
    behind, ahead = ((_across(pose, reach), _across(pose, -reach)) for pose in poses)
    if left:
        behind, ahead = (left[-1][-1], behind[1]), (left[0][0], ahead[1])
    if right:
        behind, ahead = (behind[0], right[0][0]), (ahead[0], right[-1][-1])
    begins, ends = (behind, ahead) if part.direction > 0 else (ahead, behind)
    return [
        _end(part.first, -part.direction, begins, beyond, 0.0),
        _end(part.last, part.direction, ends, beyond, aside),
    ]


def _across(pose: Pose2, to_left: float) -> Array:
    """The point (2,) beside a pose, so far to the left [m]."""
    beside = pose.compose(Pose2(0.0, to_left, 0.0))
    return np.array([beside.x, beside.y])


def _end(at: Pose2, direction: int, sides: tuple[Array, Array], beyond: float, aside: float) -> _OpenEnd:
    """The open end at a pose of the path, between where the left and the right boundary end (2,) each."""
    left, right = sides
    across = np.array([-np.sin(at.phi), np.cos(at.phi)])
    ahead, middle = direction * np.array([np.cos(at.phi), np.sin(at.phi)]), np.array([at.x, at.y])
    outer = [left + aside * across, right - aside * across]
    outline = [left, outer[0], outer[0] + beyond * ahead, outer[1] + beyond * ahead, outer[1], right, middle]
    return _OpenEnd(
        mouth=np.array([left, middle, right]),
        outline=np.array(outline),
        just_beyond=middle + _SPACING * ahead,
    )
