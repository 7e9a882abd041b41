"""What all figures share: colours, axes, legends, PNG files, and the plane from above."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure
from numpy.typing import ArrayLike
from shapely.plotting import patch_from_polygon

from geometry import Area, Corridor, Pose2, ReferencePath
from geometry.outline import drawn_shape, shape_of
from rti_mpcc.config import Vehicle
from rti_mpcc.model.footprint import body_polygons
from rti_mpcc.recording.moment import widened
from rti_mpcc.types import Array, Status

# Colours that stay apart for colour-blind readers (Okabe and Ito 2008):
BLACK = "#000000"
GREY = "#8c8c8c"
ORANGE = "#e69f00"
SKY = "#56b4e9"
GREEN = "#009e73"
BLUE = "#0072b2"
RED = "#d55e00"
PINK = "#cc79a7"
COLORS = (BLACK, GREY, ORANGE, SKY, GREEN, BLUE, RED, PINK)

STATUS_COLORS = {
    Status.FOLLOWING: SKY,
    Status.ARRIVING: BLUE,
    Status.SETTLING: "#7fc8a9",
    Status.DOCKED: GREEN,
    Status.CHANGING_DIRECTION: "#f0e442",
    Status.STARTING: "#d9d9d9",
    Status.BLOCKED: RED,
    Status.GOAL_LOST: PINK,
    Status.GOAL_REJECTED: "#9e4f7a",
    Status.SEARCHING: "#e7c6d8",
    Status.WAITING: "#b3b3b3",
    Status.PLANNING: ORANGE,
    Status.STALLED: "#7a3600",
    Status.GOAL_BEHIND: "#f2a97e",
    Status.FAILED: BLACK,
}
DPI = 130  # resolution of the written pictures [dots/inch]
WEIGHTS = (("lag", BLACK), ("contouring", BLUE), ("progress reward", ORANGE), ("goal position", RED))
"""Effective weights in the order of `Moment.weights`: name and colour."""
BESIDE: dict[str, Any] = {"loc": "upper left", "bbox_to_anchor": (1.01, 1.0)}
BESIDE |= {"borderaxespad": 0.0, "frameon": False}
"""A legend to the right of its axes."""
_AROUND = 4.0  # part of an area that is shown around the ride [m]
_ROOM = 0.05  # without an area: room around the ride, as a share of its size


def plane(axes: Axes) -> None:
    """Axes of the plane from above: equal, in metres."""
    axes.set_aspect("equal", adjustable="box")
    axes.set_xlabel("x [m]")
    axes.set_ylabel("y [m]")
    grid(axes)


def grid(axes: Axes) -> None:
    """A faint grid."""
    axes.grid(color=GREY, alpha=0.25, linewidth=0.5)


def legend_below(figure: Figure, *, columns: int = 4) -> None:
    """One legend for all axes, each label once, below them; the figure has to have a constrained layout."""
    look: dict[str, Any] = {"frameon": False, "fontsize": "small", "handlelength": 3.5}
    figure.legend(*entries_once(figure.axes), loc="outside lower center", ncols=columns, **look)


def entries_once(several: Iterable[Axes]) -> tuple[list[Artist], list[str]]:
    """Handles and labels for a legend of several axes, each label once."""
    found: dict[str, Artist] = {}
    for axes in several:
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
            found.setdefault(label, handle)
    return list(found.values()), list(found)


def png(figure: Figure) -> bytes:
    """The picture of a figure, for a page."""
    stream = BytesIO()
    save(figure, stream, dpi=160)
    return stream.getvalue()


def save(figure: Figure, file: Path | BytesIO, *, dpi: int = DPI) -> None:
    """Write a figure as PNG. Raises OSError."""
    # Tight: the layout doesn't know the tick labels that the final size brings.
    figure.savefig(file, format="png", dpi=dpi, bbox_inches="tight")


def lines(axes: Axes, lines: Sequence[Array], color: str, label: str) -> None:
    """Polylines (k, 2) [m] of a path or of boundaries."""
    axes.add_collection(LineCollection(lines, colors=color, linewidths=1.2, label=label))


def path_lines(path: ReferencePath) -> list[Array]:
    """One polyline (k, 2) [m] a part."""
    return [np.stack([at.x, at.y], axis=-1) for at in path.sample(0.1)]


def boundaries_of(corridor: Corridor, parts: Iterable[int] | None = None) -> list[Array]:
    """Polylines (k, 2) [m] on both sides of these parts of its path, by default of all."""
    shown = range(len(corridor.walls)) if parts is None else parts
    return [line for part in shown for side in corridor.lines(part) for line in side]


def area(axes: Axes, area: Area) -> None:
    """The static obstacles, and all that is outside the boundary. It does not widen the view."""
    rings = [*area.obstacles] if area.boundary is None else [area.boundary, *area.obstacles]
    if not rings:
        return
    origin = np.round(rings[0][0])  # maps may be far from (0, 0)
    shapes = [drawn_shape(shape_of(ring - origin)) for ring in area.obstacles]
    if area.boundary is not None:
        inside = shapely.Polygon(area.boundary - origin)
        shapes.append(shapely.box(*inside.buffer(1000.0).bounds).difference(inside))
    solid = shapely.transform(shapely.union_all(shapes, grid_size=1e-6), lambda points: points + origin)
    look = {"facecolor": GREY, "edgecolor": BLACK, "linewidth": 0.6}
    axes.add_artist(patch_from_polygon(solid, label="static obstacle", **look))


def outlines(
    axes: Axes, outlines: Sequence[Array], label: str = "obstacle", color: str = GREY, **look: Any
) -> None:
    """Polygons, lines and points (k, 2) [m], if there are any."""
    if outlines:
        line = {"facecolors": color, "edgecolors": BLACK, "label": label}
        axes.add_collection(PolyCollection(widened(outlines), **line | look))


def bodies(
    axes: Axes, poses: ArrayLike | Pose2, vehicle: Vehicle, color: str, label: str = "_", **look: Any
) -> Array:
    """Outlines of the body at poses (k, 3) x [m], y [m], heading [rad]; returns their corners (n, 2) [m]."""
    rows = (poses.x, poses.y, poses.phi) if isinstance(poses, Pose2) else poses
    bodies = body_polygons(np.asarray(rows, dtype=np.float64).reshape(-1, 3), vehicle)
    if len(bodies):
        line = {"facecolors": "none", "edgecolors": color, "label": label}
        axes.add_collection(PolyCollection(list(bodies), **line | look))
    return bodies.reshape(-1, 2)


def heading(axes: Axes, pose: Pose2, vehicle: Vehicle, color: str) -> Pose2:
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
