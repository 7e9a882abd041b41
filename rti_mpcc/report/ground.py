"""Drawing on the plane from above: area, corridor, path, obstacles, the body and its heading."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import shapely
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from numpy.typing import ArrayLike
from shapely.plotting import patch_from_polygon

from geometry import Area, Corridor, Pose2, ReferencePath
from geometry.outline import corners_of, drawn_shape, shape_of
from rti_mpcc.config import Vehicle
from rti_mpcc.model.footprint import body_polygons
from rti_mpcc.report import style
from rti_mpcc.types import Array

_PATH_SPACING = 0.1
"""Spacing of the drawn path [m]."""
_AROUND = 4.0
"""Part of an area that is shown around the ride [m]."""
_ROOM = 0.05
"""Without an area: room around the ride, as a share of its size."""
_FAR = 1000.0
"""The outside of a boundary is drawn to this distance [m]."""
_DRAWN = 1e-6
"""Outlines of static obstacles are rounded to this [m]."""


def draw_boundaries(
    axes: Axes, corridor: Corridor, path: ReferencePath, *, color: str = style.BLACK, label: str = "corridor"
) -> None:
    """The boundaries of all parts."""
    axes.add_collection(
        LineCollection(boundaries_of(corridor, path), colors=color, linewidths=1.2, label=label)
    )


def draw_path(axes: Axes, path: ReferencePath, *, color: str = style.ORANGE, label: str = "path") -> None:
    """The path, each of its parts."""
    axes.add_collection(LineCollection(path_lines(path), colors=color, linewidths=1.2, label=label))


def draw_routes(axes: Axes, paths: Sequence[ReferencePath], *, label: str = "route") -> None:
    """Routes that were driven one after the other; `label` of the last one."""
    for place, path in enumerate(paths[:-1]):
        draw_path(axes, path, color=style.PINK, label="_" if place else "earlier route")
    for path in paths[-1:]:
        draw_path(axes, path, label=label)


def draw_area(axes: Axes, area: Area) -> None:
    """The static obstacles, and all that is outside the boundary. It does not widen the view."""
    rings = [*area.obstacles] if area.boundary is None else [area.boundary, *area.obstacles]
    if not rings:
        return
    origin = np.round(rings[0][0])  # maps may be far from (0, 0)
    shapes = [drawn_shape(shape_of(ring - origin)) for ring in area.obstacles]
    if area.boundary is not None:
        inside = shapely.Polygon(area.boundary - origin)
        shapes.append(shapely.box(*inside.buffer(_FAR).bounds).difference(inside))
    solid = shapely.transform(shapely.union_all(shapes, grid_size=_DRAWN), lambda points: points + origin)
    look = {"facecolor": style.GREY, "edgecolor": style.BLACK, "linewidth": 0.6}
    axes.add_artist(patch_from_polygon(solid, label="static obstacle", **look))


def draw_outlines(
    axes: Axes, outlines: Sequence[Array], label: str = "obstacle", color: str = style.GREY, **look: Any
) -> None:
    """Polygons, lines and points (k, 2) [m], if there are any."""
    if outlines:
        drawn = PolyCollection(
            drawn_outlines(outlines), facecolors=color, edgecolors=style.BLACK, label=label, **look
        )
        axes.add_collection(drawn)


def drawn_outlines(outlines: Sequence[Array]) -> list[Array]:
    """Polygons (k, 2) [m], with lines and points widened so that they are seen."""
    return [each if len(each) > 2 else corners_of(drawn_shape(shape_of(each))) for each in outlines]


def draw_bodies(
    axes: Axes, poses: ArrayLike | Pose2, vehicle: Vehicle, color: str, label: str = "_", **look: Any
) -> Array:
    """Outlines of the body at poses (k, 3) x [m], y [m], heading [rad]; returns their corners (n, 2) [m]."""
    rows = (poses.x, poses.y, poses.phi) if isinstance(poses, Pose2) else poses
    bodies = body_polygons(np.asarray(rows, dtype=np.float64).reshape(-1, 3), vehicle)
    if len(bodies):
        line = {"facecolors": "none", "edgecolors": color, "label": label}
        axes.add_collection(PolyCollection(list(bodies), **line | look))
    return bodies.reshape(-1, 2)


def draw_heading(axes: Axes, pose: Pose2, vehicle: Vehicle, color: str) -> Pose2:
    """An arrow from the rear axle to the front, on top of the rest; returns its tip."""
    tip = pose.compose(Pose2(vehicle.front, 0.0, 0.0))
    arrow = {"arrowstyle": "-|>", "color": color, "linewidth": 1.2, "shrinkA": 0.0, "shrinkB": 0.0}
    axes.annotate("", xy=(tip.x, tip.y), xytext=(pose.x, pose.y), arrowprops=arrow, zorder=5)
    return tip


def show_driven(axes: Axes, points: Array, area: Area | None) -> None:
    """Show all points (n, 2) [m] and some room around them, but little beyond the boundary of an area."""
    low, high = points.min(axis=0), points.max(axis=0)
    room = _ROOM * (high - low) if area is None else _AROUND
    least, most = low - room, high + room
    if area is not None and area.boundary is not None:
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
