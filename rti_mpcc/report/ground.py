"""What stands still in a picture of the plane from above: paths, boundaries, what is solid in an area."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
import shapely
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.patches import PathPatch
from matplotlib.path import Path

from geometry import Area, Corridor, ReferencePath
from geometry.outline import corners_of, drawn_shape, shape_of
from rti_mpcc.report import style
from rti_mpcc.types import Array

_PATH_SPACING = 0.1
"""Spacing of the drawn path [m]."""
_AROUND = 4.0
"""In an area so much is shown around all that is driven [m]."""
_FAR = 1000.0
"""What is outside a boundary is drawn as solid, so far around it [m]."""
_DRAWN = 1e-6
"""To which the outlines of what is solid are rounded [m]."""


def draw_boundaries(
    axes: Axes,
    corridor: Corridor,
    path: ReferencePath,
    *,
    color: str = style.BLACK,
    label: str = "corridor",
) -> None:
    """The boundaries of all parts."""
    _add_lines(axes, boundaries_of(corridor, path), color=color, label=label)


def draw_path(axes: Axes, path: ReferencePath, *, color: str = style.ORANGE, label: str = "path") -> None:
    """The path, each of its parts."""
    _add_lines(axes, path_lines(path), color=color, label=label)


def draw_ways(axes: Axes, paths: Sequence[ReferencePath]) -> None:
    """Ways that were driven one after the other, the last one as the path."""
    for place, path in enumerate(paths[:-1]):
        draw_path(axes, path, color=style.PINK, label="_" if place else "earlier path")
    for path in paths[-1:]:
        draw_path(axes, path)


def draw_area(axes: Axes, area: Area) -> None:
    """What is solid: the obstacles, and all that is outside the boundary. It does not widen the view."""
    outlines = _solid_outlines(area)
    if outlines:
        shape = Path.make_compound_path(*(Path(ring, closed=True) for ring in outlines))
        look = {"facecolor": style.GREY, "edgecolor": style.BLACK, "linewidth": 0.6}
        axes.add_artist(PathPatch(shape, label="solid", **look))


def _solid_outlines(area: Area) -> list[Array]:
    """Closed outlines (k, 2) [m] of all that is solid put together; those of holes run the other way."""
    rings = [*area.obstacles] if area.boundary is None else [area.boundary, *area.obstacles]
    if not rings:
        return []
    origin = np.round(rings[0][0])  # maps may be far from (0, 0)
    shapes = [drawn_shape(shape_of(ring - origin)) for ring in area.obstacles]
    if area.boundary is not None:
        inside = shapely.Polygon(area.boundary - origin)
        shapes.append(shapely.box(*inside.buffer(_FAR).bounds).difference(inside))
    parts = shapely.get_parts(shapely.orient_polygons(shapely.union_all(shapes, grid_size=_DRAWN)))
    found = [ring for part in parts for ring in (part.exterior, *part.interiors)]
    return [shapely.get_coordinates(ring) + origin for ring in found]


def draw_obstacles(axes: Axes, outlines: Sequence[Array]) -> None:
    """Polygons, lines and points (k, 2) [m], if there are any."""
    if outlines:
        shapes = PolyCollection(
            drawn_outlines(outlines), facecolors=style.GREY, edgecolors=style.BLACK, label="obstacle"
        )
        axes.add_collection(shapes)


def drawn_outlines(outlines: Sequence[Array]) -> list[Array]:
    """Polygons (k, 2) [m], with lines and points widened so that they are seen."""
    return [each if len(each) > 2 else corners_of(drawn_shape(shape_of(each))) for each in outlines]


def show_driven(axes: Axes, points: Array, area: Area) -> None:
    """Show all of points (n, 2) [m] and some of the area around them, but little beyond its boundary."""
    low, high = points.min(axis=0), points.max(axis=0)
    least, most = low - _AROUND, high + _AROUND
    if area.boundary is not None:
        edge = 0.25 * _AROUND
        least = np.minimum(np.maximum(least, area.boundary.min(axis=0) - edge), low - edge)
        most = np.maximum(np.minimum(most, area.boundary.max(axis=0) + edge), high + edge)
    axes.set_xlim(float(least[0]), float(most[0]))
    axes.set_ylim(float(least[1]), float(most[1]))


def boundaries_of(corridor: Corridor, path: ReferencePath) -> list[Array]:
    """Polylines (k, 2) [m]."""
    return [line for part in range(len(path.parts)) for side in corridor.lines(part) for line in side]


def path_lines(path: ReferencePath) -> list[Array]:
    """One polyline (k, 2) [m] a part."""
    return [np.stack([at.x, at.y], axis=-1) for at in path.sample(_PATH_SPACING)]


def _add_lines(axes: Axes, lines: Iterable[Array], *, color: str, label: str) -> None:
    drawn = list(lines)
    if drawn:
        axes.add_collection(LineCollection(drawn, colors=color, linewidths=1.2, label=label))
