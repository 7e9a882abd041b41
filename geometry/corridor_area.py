"""The area that a corridor leaves: all of its parts put together, with their open ends.

The boundaries of a part act on that part only, so a vehicle may be wherever one of them lets it be: beside
the path as far as the nearest of them. Where there is none, for a bend or another part of a loop has folded
it away, it is as far as the farthest boundary is from the path. Where a part begins and ends there is no
boundary: there the area goes on straight, as wide as the part is. Behind the end of the route, where a goal
may be beside it, it is open to the sides, too, up to its own boundaries.
"""

from __future__ import annotations

import numpy as np
import shapely

from geometry.area import Area
from geometry.arrays import Array
from geometry.corridor import Corridor
from geometry.errors import CorridorError
from geometry.outline import path_line
from geometry.part import PathPart
from geometry.path import ReferencePath
from geometry.walls import PartLines, simplified

_SPACING = 0.1  # [m] of the points of a path beside which the boundaries are looked for
_FINE = 1e-3  # [m] that the outline may be beside the boundaries
_WALL = 0.01  # [m] to either side of a boundary nobody drives behind the ends of a part
_SLIVER = 1e-2  # [m²]: holes smaller than this are none
_ROUNDING = 1e-4  # [m]
_GRID = 1e-6  # [m] on which shapes are put together: without one GEOS 3.14 has left a polygon out of a union
_STRAIGHT = 1e-9  # [m] that a line which is taken to be straight may be beside itself
_STRIP = 64  # cross-sections that are put together at a time
_FOLDED = 0.99  # of a bend's radius: beside its inside there is no more


def area_of(corridor: Corridor, path: ReferencePath, *, beyond: float) -> Area:
    """Return the area of a corridor along a path without its obstacles, `beyond` [m] longer at the open ends.

    Raises CorridorError if a part has no boundaries, they cut the path, or the parts are not connected.
    """
    if corridor.area is not None:
        return corridor.area
    last = len(path.parts) - 1
    pieces = []
    for k, part in enumerate(path.parts):
        pieces += _lane_and_ends(k, part, corridor.walls[k], beyond, beyond if k == last else 0.0)
    driven = shapely.union_all([path_line(part, _SPACING) for part in path.parts])
    # Rounding leaves gaps between pieces that meet: they are closed.
    wider = shapely.union_all(pieces, grid_size=_GRID).buffer(0.5 * _FINE, join_style="mitre")
    found = shapely.get_parts(wider.buffer(-0.5 * _FINE, join_style="mitre"))
    whole = found[int(np.argmin(shapely.distance(found, shapely.Point(path.start.x, path.start.y))))]
    if not (shapely.covers(whole, driven) or shapely.covers(whole.buffer(2.0 * _FINE), driven)):
        raise CorridorError("the boundaries cut the path, or the parts of the corridor are not connected.")
    whole = whole.simplify(_FINE)
    holes = [ring for ring in whole.interiors if shapely.Polygon(ring).area > _SLIVER]
    outline, *obstacles = map(shapely.get_coordinates, [whole.exterior, *holes])
    return Area(boundary=outline, obstacles=obstacles)


def _lane_and_ends(
    index: int, part: PathPart, walls: PartLines, beyond: float, aside: float
) -> list[shapely.Geometry]:
    """What is beside one part, up to its boundaries, and beyond its ends, the last of which goes on `aside`
    [m] to either side."""
    if walls.joined:
        return [shapely.Polygon(np.concatenate(walls.both))]
    lines = shapely.MultiLineString([line for line in walls.both if len(line) > 1])
    if lines.is_empty:
        raise CorridorError(f"part {index}: it has no boundaries.")
    left, middle, right = _cross_sections(part, lines)
    # What a cross-section reaches beside a step of a boundary is cut off by the boundary itself.
    covered = [piece for side in (left, right) for piece in _strips(middle, side)]
    lane = shapely.difference(
        shapely.union_all(covered, grid_size=_GRID), shapely.buffer(lines, _FINE), grid_size=_GRID
    )
    first, last = ([side[k] for side in (left, middle, right)] for k in (0, -1))
    thick = shapely.buffer(lines, _WALL)
    begin = _end(first, part.first.phi, -part.direction, thick, beyond, 0.0)
    end = _end(last, part.last.phi, part.direction, thick, beyond, aside)
    return [lane, begin, end]


def _cross_sections(part: PathPart, lines: shapely.MultiLineString) -> tuple[Array, Array, Array]:
    """Points (n, 2) of the nearest boundary on the left, along a part, and of the nearest on the right [m].

    Where there is none: as far as the farthest boundary, and inside of a bend no farther than its centre.
    """
    # Those at the ends must meet what ends there.
    theta = np.linspace(part.start + _ROUNDING, part.end - _ROUNDING, part.places(_SPACING).size)
    at, bend = part.reference(theta), part.curvature(theta)
    middle = np.column_stack([at.x, at.y])
    normal = np.column_stack([-np.sin(at.phi), np.cos(at.phi)])
    walls = [simplified(shapely.get_coordinates(line), _STRAIGHT) for line in lines.geoms]
    pieces = np.concatenate([np.stack([wall[:-1], wall[1:]], axis=1) for wall in walls])
    farthest = _farthest(np.concatenate(walls), path_line(part, _SPACING)) + _FINE
    tree = shapely.STRtree(shapely.linestrings(pieces))
    sides = []
    for sign in (1.0, -1.0):
        reach = np.full(len(theta), farthest)
        np.divide(_FOLDED, sign * bend, out=reach, where=sign * bend * farthest > _FOLDED)
        rays = shapely.linestrings(np.stack([middle, middle + (sign * reach)[:, None] * normal], axis=1))
        ray, piece = tree.query(rays, predicate="intersects")
        np.minimum.at(reach, ray, _along(middle[ray], sign * normal[ray], pieces[piece]))
        sides.append(middle + (sign * reach)[:, None] * normal)
    return sides[0], middle, sides[1]


def _farthest(points: Array, line: shapely.LineString) -> float:
    """How far the farthest of points (n, 2) is from a line [m]."""
    ends = simplified(shapely.get_coordinates(line), _STRAIGHT)
    tree = shapely.STRtree(shapely.linestrings(np.stack([ends[:-1], ends[1:]], axis=1)))
    _, apart = tree.query_nearest(shapely.points(points), return_distance=True, all_matches=False)
    return float(apart.max())


def _along(origin: Array, unit: Array, pieces: Array) -> Array:
    """How far along rays (n,), from points (n, 2) in directions (n, 2), they meet pieces (n, 2, 2) [m]."""
    to, way = pieces - origin[:, None], pieces[:, 1] - pieces[:, 0]
    across = _cross(unit, way)
    ends = (to * unit[:, None]).sum(axis=2).min(axis=1)
    meets = np.abs(across) > _STRAIGHT * np.hypot(*way.T)  # else the piece is along the ray
    return np.where(meets, _cross(to[:, 0], way) / np.where(meets, across, 1.0), np.maximum(ends, 0.0))


def _strips(middle: Array, side: Array) -> list[shapely.Geometry]:
    """Polygons that cover what is between each two neighbours of points (n, 2) on a path and beside it.

    Many neighbours make one polygon. Where that crosses itself, or two of them make none that is convex, each
    two are put in a hull of their own.
    """
    quads = np.stack([middle[:-1], side[:-1], side[1:], middle[1:]], axis=1)
    ways = np.roll(quads, -1, axis=1) - quads
    turns = _cross(ways, np.roll(ways, -1, axis=1))
    convex = np.asarray((turns > 0.0).all(axis=1) | (turns < 0.0).all(axis=1))
    found: list[shapely.Geometry] = []
    for k in range(0, len(quads), _STRIP):
        ends, some = slice(k, k + _STRIP + 1), slice(k, k + _STRIP)
        strip = shapely.Polygon(np.concatenate([middle[ends], side[ends][::-1]]))
        whole = convex[some].all() and strip.is_valid
        found += [strip] if whole else list(shapely.convex_hull(shapely.multipoints(quads[some])))
    return found


def _cross(a: Array, b: Array) -> Array:
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])


def _end(
    mouth: list[Array], phi: float, direction: int, walls: shapely.Geometry, beyond: float, aside: float
) -> shapely.Geometry:
    """What is beyond an open end, from its cross-section (left, middle, right) on, in the direction +1 or -1
    of the heading phi [rad], and not in the `walls`."""
    left, middle, right = mouth
    ahead = direction * np.array([np.cos(phi), np.sin(phi)])
    across = np.array([-np.sin(phi), np.cos(phi)])
    outer = [left + aside * across, right - aside * across]
    box = shapely.Polygon(
        [left, outer[0], outer[0] + beyond * ahead, outer[1] + beyond * ahead, outer[1], right, middle]
    )
    clear = shapely.difference(box, walls, grid_size=_GRID)
    begin = shapely.Point(middle + _SPACING * ahead)
    return shapely.union_all([piece for piece in shapely.get_parts(clear) if shapely.covers(piece, begin)])
