"""The docks of a file from above, and as a table."""

from __future__ import annotations

from math import cos, degrees, sin
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure

from geometry import Area, Pose2
from rti_mpcc.config import Vehicle
from rti_mpcc.model.footprint import body_polygons
from rti_mpcc.report import style
from rti_mpcc.report.axes import entries_once, plane
from rti_mpcc.report.ground import draw_area, show_driven
from rti_mpcc.simulation.docks_file import Docks
from rti_mpcc.steps import Dock
from rti_mpcc.types import Array

SIZE = (9.0, 7.5)
"""Of the figure [inch]."""
_WAYS = {1: "forward", -1: "in reverse"}
_NAME_AHEAD = 0.6
"""Names stand so far before the docked vehicle [m]."""


def docks_figure(title: str, docks: Docks) -> Figure:
    """Each dock: the docked vehicle with its heading, the approach, what is docked at, the board, and the end
    of the contact move."""
    figure = Figure(figsize=SIZE, layout="constrained")
    axes = figure.add_subplot()
    area = docks.area or Area()
    draw_area(axes, area)
    shown = [_draw_dock(axes, dock, docks.vehicle) for dock in docks.docks.values()]
    plane(axes)
    show_driven(axes, np.concatenate(shown), area)
    axes.set_title(title)
    figure.legend(*entries_once([axes]), loc="outside lower center", ncols=3, frameon=False, fontsize="small")
    return figure


def _draw_dock(axes: Axes, dock: Dock, vehicle: Vehicle) -> Array:
    """Draw a dock; returns the corners (k, 2) of what is to be seen of it [m]."""
    pose = dock.pose
    assert pose is not None
    shown = [_outline(axes, pose, vehicle, style.BLUE, "docked vehicle")]
    nose, name = (pose.compose(Pose2(vehicle.front + more, 0.0, 0.0)) for more in (0.0, _NAME_AHEAD))
    arrow = {"arrowstyle": "-|>", "color": style.BLUE, "shrinkA": 0.0, "shrinkB": 0.0}
    axes.annotate("", xy=(nose.x, nose.y), xytext=(pose.x, pose.y), arrowprops=arrow)
    axes.annotate(dock.name, (name.x, name.y), ha="center", va="center", fontsize="small")
    shown.append(np.array([[name.x, name.y]]))
    if dock.approach is not None:
        begin = pose.compose(Pose2(-dock.approach.direction * dock.approach.length, 0.0, 0.0))
        _line(axes, begin, pose, style.ORANGE, "approach")
        shown.append(np.array([[begin.x, begin.y]]))
    if dock.contact is not None:
        end = pose.compose(Pose2(dock.contact.distance, 0.0, 0.0))
        shown.append(_outline(axes, end, vehicle, style.GREEN, "after the contact move", dashes="dashed"))
    body = dock.body_at(pose)
    if body is not None:
        look: dict[str, Any] = {"facecolors": style.PINK, "edgecolors": style.BLACK, "alpha": 0.5}
        axes.add_collection(PolyCollection([body], label="what is docked at", **look))
        shown.append(body)
    if dock.board is not None:
        middle, half = dock.board, 0.5 * dock.board.size[0]
        across = (-half * sin(middle.yaw), half * cos(middle.yaw))
        ends = [pose.compose(Pose2(middle.x + k * across[0], middle.y + k * across[1], 0.0)) for k in (-1, 1)]
        _line(axes, ends[0], ends[1], style.RED, "board", width=3.0)
    return np.concatenate(shown)


def _outline(
    axes: Axes, pose: Pose2, vehicle: Vehicle, color: str, label: str, dashes: str = "solid"
) -> Array:
    corners: Array = body_polygons(np.array([[pose.x, pose.y, pose.phi]]), vehicle)[0]
    look: dict[str, Any] = {"facecolors": "none", "edgecolors": color, "linewidths": 1.4}
    axes.add_collection(PolyCollection([corners], label=label, linestyles=[dashes], **look))
    return corners


def _line(axes: Axes, begin: Pose2, end: Pose2, color: str, label: str, width: float = 1.8) -> None:
    points = [[(begin.x, begin.y), (end.x, end.y)]]
    axes.add_collection(LineCollection(points, colors=color, linewidths=width, label=label, zorder=3))


def docks_rows(docks: Docks) -> list[tuple[str, ...]]:
    """A row for each dock: name, kind, pose, approach, tolerance, contact move."""
    return [_row(dock) for dock in docks.docks.values()]


def _row(dock: Dock) -> tuple[str, ...]:
    pose, approach, contact, most = dock.pose, dock.approach, dock.contact, dock.tolerance
    assert pose is not None
    assert dock.kind is not None
    return (
        dock.name,
        dock.kind.value,
        f"{pose.x:.2f}, {pose.y:.2f}, {degrees(pose.phi):.1f}",
        "-" if approach is None else f"{approach.length:g} {_WAYS[approach.direction]}",
        "-" if most is None else f"{most[0]:g}, {most[1]:g}, {degrees(most[2]):.2f}",
        "-" if contact is None else f"{contact.distance:g}",
    )
