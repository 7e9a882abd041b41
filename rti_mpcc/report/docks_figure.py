"""The docks of a file from above, and as a table."""

from __future__ import annotations

from math import cos, degrees, pi, sin
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
_APPROACH, _BOARD = 5.0, 3.0
"""Widths of lines [point]; the first one shows beside the arrow on it."""
_WAYS = {1: "forward", -1: "in reverse"}
_NAME_AHEAD = 6.0
"""Names stand so far before the docked vehicle [point]."""
_STRAIGHT = sin(pi / 12.0)
"""An arrow that points less to a side has its name centred on it, else beyond its tip on this side."""


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
    axes.set_title(title, parse_math=False)
    figure.legend(*entries_once([axes]), loc="outside lower center", ncols=3, frameon=False, fontsize="small")
    return figure


def _draw_dock(axes: Axes, dock: Dock, vehicle: Vehicle) -> Array:
    """Draw a dock; returns the corners (k, 2) of what is to be seen of it [m]."""
    pose = dock.pose
    assert pose is not None
    shown = [_outline(axes, pose, vehicle, style.BLUE, "docked vehicle")]
    if dock.approach is not None:
        begin = pose.compose(Pose2(-dock.approach.direction * dock.approach.length, 0.0, 0.0))
        _line(axes, begin, pose, style.ORANGE, "approach, of the rear axle", width=_APPROACH)
        shown.append(np.array([[begin.x, begin.y]]))
    _draw_heading(axes, dock.name, pose, vehicle)
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
        _line(axes, ends[0], ends[1], style.RED, "board", width=_BOARD)
    return np.concatenate(shown)


def _draw_heading(axes: Axes, name: str, pose: Pose2, vehicle: Vehicle) -> None:
    """An arrow from the rear axle to the front, on top of all else, and the name before it."""
    nose = pose.compose(Pose2(vehicle.front, 0.0, 0.0))
    arrow = {"arrowstyle": "-|>", "color": style.BLUE, "linewidth": 1.2, "shrinkA": 0.0, "shrinkB": 0.0}
    axes.annotate("", xy=(nose.x, nose.y), xytext=(pose.x, pose.y), arrowprops=arrow, zorder=5)
    right, up = cos(pose.phi), sin(pose.phi)
    axes.annotate(
        name,
        (nose.x, nose.y),
        xytext=(_NAME_AHEAD * right, _NAME_AHEAD * up),
        textcoords="offset points",
        ha="center" if abs(right) < _STRAIGHT else "left" if right > 0.0 else "right",
        va="center" if abs(up) < _STRAIGHT else "bottom" if up > 0.0 else "top",
        fontsize="small",
        parse_math=False,
        bbox={"facecolor": "white", "alpha": 0.7, "linewidth": 0.0, "pad": 1.0},
        zorder=5,
    )


def _outline(
    axes: Axes, pose: Pose2, vehicle: Vehicle, color: str, label: str, dashes: str = "solid"
) -> Array:
    corners: Array = body_polygons(np.array([[pose.x, pose.y, pose.phi]]), vehicle)[0]
    look: dict[str, Any] = {"facecolors": "none", "edgecolors": color, "linewidths": 1.4}
    axes.add_collection(PolyCollection([corners], label=label, linestyles=[dashes], **look))
    return corners


def _line(axes: Axes, begin: Pose2, end: Pose2, color: str, label: str, *, width: float) -> None:
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
