"""Polygons, lines and points, checked and in convex pieces; and a polygon as the boundaries of a part."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations
from math import cos, hypot, sin
from typing import TypeAlias

import numpy as np
import shapely
from numpy.typing import ArrayLike

from geometry.arrays import Array, locked
from geometry.errors import CorridorError, InputError, PathError
from geometry.part import PathPart
from geometry.pose import Pose2
from geometry.sampling import number_steps, steps
from geometry.validation import to_rows

Shape: TypeAlias = shapely.Point | shapely.LineString | shapely.Polygon
"""What an obstacle may be."""
FARTHEST = 1e12  # [m] that anything may be from (0, 0)
_ROUNDING = 1e-9  # of an area, or of a length
_DRAWN = 0.04  # [m] width at which a line or a point is drawn
_SPACING = 0.25  # [m] between the path points at which the width is measured


def checked_polygon(
    corners: ArrayLike, name: str, error: type[InputError] = CorridorError
) -> shapely.Polygon:
    """Return corners (m, 2) [m] as a polygon whose outline runs counter-clockwise.

    Raises `error` for fewer than 3 corners, numbers that are not finite, or an outline that crosses itself.
    """
    points = _points(corners, name, error)
    if len(points) < 3:
        raise error(f"{name} has {len(points)} corner(s), a polygon needs at least 3.")
    shape = shapely.Polygon(points)
    if not shape.is_valid:
        raise error(f"{name} is not a simple polygon ({shapely.is_valid_reason(shape)}).")
    return shape if shape.exterior.is_ccw else shapely.Polygon(points[::-1])


def checked_shape(corners: ArrayLike, name: str, error: type[InputError] = CorridorError) -> Shape:
    """Return corners (m, 2) [m] of an obstacle as a shape: of one a point, of two a line, of more a polygon.

    A polygon without area, all corners of which are on one line, is that line or point. Raises as
    `checked_polygon`, and without any corner.
    """
    points = _points(corners, name, error)
    if len(points) == 0:
        raise error(f"{name} has no corner, an obstacle needs at least 1.")
    off = points - points[0]
    far = off[int(np.argmax((off**2).sum(axis=1)))]
    length = float(np.hypot(*far))
    if length == 0.0:
        return shape_of(points[:1])
    along, across = off @ far / length, off @ np.array([-far[1], far[0]]) / length
    if np.abs(across).max() > _ROUNDING * length:
        return checked_polygon(points, name, error)
    return shape_of(points[[int(np.argmin(along)), int(np.argmax(along))]])


def shape_of(corners: Array) -> Shape:
    """Return checked corners (m, 2) as a point, a line or a polygon [m]."""
    if len(corners) > 2:
        return shapely.Polygon(corners)
    return shapely.LineString(corners) if len(corners) == 2 else shapely.Point(corners)


def corners_of(shape: Shape) -> Array:
    """Return the corners (m, 2) of a point, a line, or the outline of a polygon, each of them once [m]."""
    corners: Array = shapely.get_coordinates(getattr(shape, "exterior", shape))
    return corners[:-1] if isinstance(shape, shapely.Polygon) else corners


@dataclass(frozen=True, eq=False)
class CheckedShape:
    """The shape of an obstacle, checked. What follows from it is computed once, when it is first needed."""

    shape: Shape

    @cached_property
    def corners(self) -> Array:
        """Return its corners (m, 2), counter-clockwise [m]; read-only."""
        return locked(corners_of(self.shape))

    @cached_property
    def pieces(self) -> list[Array]:
        """Return its `convex_pieces`. Shapely works on small numbers; whole metres make both ways exact."""
        origin = np.round(self.corners[0])
        return [piece + origin for piece in convex_pieces(shape_of(self.corners - origin))]

    @cached_property
    def circle(self) -> tuple[float, float, float]:
        """Return a circle around all of it: x, y and radius [m]."""
        left, low, right, high = self.shape.bounds
        return 0.5 * (left + right), 0.5 * (low + high), 0.5 * hypot(right - left, high - low)

    @cached_property
    def hull(self) -> Array:
        """Return the corners (m, 2) of its convex hull, counter-clockwise [m]."""
        hull = shapely.orient_polygons(shapely.convex_hull(self.shape))
        return np.ascontiguousarray(corners_of(hull))


def checked_shapes(
    outlines: Iterable[ArrayLike], name: str, error: type[InputError] = CorridorError
) -> list[CheckedShape]:
    """Return the obstacles of a list of that name. Raises as `checked_shape`."""
    return [CheckedShape(checked_shape(each, f"{name}[{i}]", error)) for i, each in enumerate(outlines)]


def drawn_shape(shape: Shape) -> shapely.Polygon:
    """Return a polygon, or a line or a point widened to one, so that it is seen."""
    if isinstance(shape, shapely.Polygon):
        return shape
    return shape.buffer(0.5 * _DRAWN, cap_style="square")


def _points(corners: ArrayLike, name: str, refuse: type[InputError]) -> Array:
    points = to_rows(corners, 2, name, refuse)
    if points.size and np.abs(points).max() > FARTHEST:
        raise refuse(f"{name} must have coordinates of at most {FARTHEST:g} m.")
    if len(points) > 1 and (points[0] == points[-1]).all():
        points = points[:-1]
    return points


def outline_at(corners: ArrayLike, frame: Pose2) -> Array:
    """Return corners (m, 2) [m], given in the frame of a pose, in that in which the pose is given."""
    c, s = cos(frame.phi), sin(frame.phi)
    turned = np.asarray(corners, dtype=np.float64) @ np.array([(c, s), (-s, c)])
    return np.asarray(turned + np.array([frame.x, frame.y]))


def convex_pieces(shape: Shape) -> list[Array]:
    """Return convex pieces (m_i, 2), counter-clockwise, that make up a shape [m]: itself, or triangles."""
    if not isinstance(shape, shapely.Polygon):
        return [corners_of(shape)]
    # A corner that is given twice would hide which way it turns.
    ring: Array = shapely.get_coordinates(shapely.remove_repeated_points(shape))[:-1]
    loop = np.concatenate((ring[-1:], ring, ring[:1]))
    (x, y), (next_x, next_y) = (loop[1:-1] - loop[:-2]).T, (loop[2:] - loop[1:-1]).T
    if (x * next_y - y * next_x >= 0.0).all():
        return [ring]
    triangles = shapely.get_parts(shapely.constrained_delaunay_triangles(shape))
    corners = shapely.get_coordinates(shapely.orient_polygons(triangles))
    return list(corners.reshape(-1, 4, 2)[:, :-1])


def merge_convex(pieces: Sequence[Array]) -> list[Array]:
    """Return convex pieces (m_i, 2) with as many put together as are convex then, the longest seams first."""
    shapes = [shapely.Polygon(piece) for piece in pieces]
    while True:
        seams = []
        for i, j in combinations(range(len(shapes)), 2):
            whole = shapes[i].union(shapes[j])
            if whole.geom_type == "Polygon" and whole.convex_hull.area <= whole.area * (1.0 + _ROUNDING):
                seams.append((shapes[i].intersection(shapes[j]).length, i, j, whole))
        if not seams:
            break
        _, i, j, whole = max(seams, key=lambda seam: seam[0])
        shapes = [shape for k, shape in enumerate(shapes) if k not in (i, j)] + [whole.convex_hull]
    return [shapely.get_coordinates(shape.normalize().reverse())[:-1] for shape in shapes]


def path_line(part: PathPart, spacing: float) -> shapely.LineString:
    """Return the part as a polyline with points at its knots and at most `spacing` [m] apart."""
    counts = steps(np.diff(part.knots), spacing, "a part of the path", PathError)
    piece, step = number_steps(counts)
    theta = part.knots[piece] + np.diff(part.knots)[piece] * step / counts[piece]
    at = part.reference(np.append(theta, part.end))
    return shapely.LineString(np.column_stack([at.x, at.y]))


def split_outline(part: PathPart, polygon: shapely.Polygon) -> tuple[Array, Array]:
    """Return the outline as polylines (k, 2) of the left and of the right side of the vehicle [m].

    It is cut where the tangents at both ends of the part, followed outwards, first meet it, so that the way
    round either end belongs half to the left and half to the right. Both run counter-clockwise: allowed on
    the left.
    """
    outline, x, y = polygon.exterior, part.x[[0, -1]], part.y[[0, -1]]
    outward = part.phi[[0, -1]] + ([np.pi, 0.0] if part.direction > 0 else [0.0, np.pi])
    far = _ray_lengths(outline, x, y, outward)
    met = shapely.points(x + far * np.cos(outward), y + far * np.sin(outward))
    behind, ahead = shapely.line_locate_point(outline, met).tolist()
    starboard, port = _between(outline, behind, ahead), _between(outline, ahead, behind)
    return (port, starboard) if part.direction > 0 else (starboard, port)


def narrowest_in(part: PathPart, polygon: shapely.Polygon) -> tuple[float, float]:
    """Return the smallest width along the path's normals [m] and its theta [m].

    Measured every _SPACING, at knots and beside each corner of the outline, which is where the width has
    its minima.
    """
    corners = shapely.get_coordinates(polygon.exterior)[:-1]
    beside = [part.project(float(x), float(y)) for x, y in corners]
    theta = np.unique(np.concatenate((part.places(_SPACING), part.knots, beside)))
    at = part.reference(theta)
    right, left = (
        _ray_lengths(polygon.exterior, at.x, at.y, at.phi + a) for a in (-np.pi / 2.0, np.pi / 2.0)
    )
    i = int(np.argmin(right + left))
    return float((right + left)[i]), float(theta[i])


def _ray_lengths(outline: shapely.LinearRing, x: Array, y: Array, angle: Array) -> Array:
    """Length (n,) of rays from points inside to where they first meet the outline [m]."""
    low_x, low_y, high_x, high_y = outline.bounds
    far = np.hypot(high_x - low_x, high_y - low_y) + 1.0
    start = np.column_stack([x, y])
    end = start + far * np.column_stack([np.cos(angle), np.sin(angle)])
    rays = shapely.linestrings(np.stack([start, end], axis=1))
    return np.asarray(shapely.distance(shapely.points(start), shapely.intersection(rays, outline)))


def _between(outline: shapely.LinearRing, start: float, end: float) -> Array:
    """The outline from one position on it to another, in its own sense."""
    corners = shapely.get_coordinates(outline)
    at = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(corners, axis=0).T))))
    if end <= start:
        end += at[-1]
    corners, at = np.concatenate((corners, corners[1:])), np.concatenate((at, at[-1] + at[1:]))
    inner = (at > start) & (at < end)
    first, last = np.column_stack([np.interp((start, end), at, corners[:, axis]) for axis in (0, 1)])
    return np.vstack([first, corners[inner], last])
