"""The area that a corridor leaves: all of its parts put together, with their open ends.

The boundaries of a part act on that part only, so a vehicle may be wherever one of them lets it be. Where a
part begins and ends there is no boundary: there the area goes on straight, as wide as the part is.
"""

from __future__ import annotations

from itertools import pairwise

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
_SLIVER = 1e-2  # [m²]: holes smaller than this are none


def area_of(corridor: Corridor, path: ReferencePath, *, beyond: float) -> Area:
    """Return the area of a corridor along a path, whose obstacles are left out.

    Args:
        beyond: how far it goes on at the open ends of each part [m].

    Raises:
        CorridorError: the boundaries of a part do not enclose it.
    """
    if corridor.area is not None:
        return corridor.area
    parts = [_enclosed(k, part, corridor.walls[k], beyond) for k, part in enumerate(path.parts)]
    whole = shapely.union_all(parts).simplify(_FINE)
    if whole.geom_type != "Polygon":
        raise CorridorError("the parts of the corridor are not connected.")
    holes = [ring for ring in whole.interiors if shapely.Polygon(ring).area > _SLIVER]
    return Area(boundary=_corners(whole.exterior), obstacles=[_corners(ring) for ring in holes])


def _corners(ring: shapely.LinearRing) -> Array:
    corners: Array = shapely.get_coordinates(ring)[:-1]
    return corners


def _enclosed(index: int, part: PathPart, walls: PartWalls, beyond: float) -> shapely.Polygon:
    """What the boundaries of one part enclose, with its ends."""
    lines = [shapely.LineString(line) for side in walls.lines for line in side if len(line) > 1]
    if not walls.joined:
        first, last = part.first, part.last
        turned = 0.0 if part.direction > 0 else np.pi
        lines += _end(walls, first, first.phi + turned + np.pi, beyond)
        lines += _end(walls, last, last.phi + turned, beyond)
    faces = shapely.get_parts(shapely.polygonize(shapely.get_parts(shapely.node(shapely.union_all(lines)))))
    driven, more = path_line(part, _SPACING), 0.0 if walls.joined else 0.5 * beyond
    ends = part.reference(np.array([part.start - more, part.start, part.end, part.end + more]))
    beside = shapely.points(np.column_stack([ends.x, ends.y]))
    inside = [
        face
        for face in faces
        if shapely.intersects(face.buffer(-_FINE), driven) or shapely.intersects(face, beside[[0, -1]]).any()
    ]
    found = shapely.union_all(inside)
    if not inside or not shapely.covers(found.buffer(_FINE), driven):
        raise CorridorError(f"part {index}: its boundaries do not enclose it.")
    return found


def _end(walls: PartWalls, at: Pose2, way: float, beyond: float) -> list[shapely.LineString]:
    """The outline of the open end of a part at a pose, which goes on in this direction [rad]."""
    ends = [line[place] for side in walls.lines for line in side for place in (0, -1)]
    ahead = np.array([np.cos(way), np.sin(way)])
    across = np.array([-ahead[1], ahead[0]])
    middle = np.array([at.x, at.y])
    found = []
    for sign in (1.0, -1.0):
        beside = [end for end in ends if sign * float((end - middle) @ across) > 0.0]
        near = min(beside, key=lambda end: abs(float((end - middle) @ ahead)))
        found.append(near)
    left, right = found
    corners = [left, left + beyond * ahead, right + beyond * ahead, right]
    return [shapely.LineString(pair) for pair in (*pairwise(corners), (left, right))]
