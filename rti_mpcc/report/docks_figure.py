"""The docks of a file from above."""

from __future__ import annotations

from math import cos, pi, sin

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from geometry import Area, Pose2
from rti_mpcc.config import Vehicle
from rti_mpcc.report import style
from rti_mpcc.report.axes import legend_below, plane
from rti_mpcc.report.ground import draw_area, draw_bodies, draw_heading, draw_outlines, show_driven
from rti_mpcc.simulation.docks_file import Docks
from rti_mpcc.steps import Dock
from rti_mpcc.types import Array

_NAME_AHEAD = 6.0
"""Distance of a name from the front of the docked vehicle [point]."""
_STRAIGHT = sin(pi / 12.0)
"""An arrow that points less to a side has its name centred on it, else beyond its tip on this side."""


def docks_figure(title: str, docks: Docks) -> Figure:
    """Each dock: docked vehicle with its heading, approach, docked object, board, end of the contact move."""
    figure = Figure(figsize=(9.0, 7.5), layout="constrained")
    axes = figure.add_subplot()
    area = docks.area or Area()
    draw_area(axes, area)
    shown = [_draw_dock(axes, dock, docks.vehicle) for dock in docks.docks.values()]
    plane(axes)
    show_driven(axes, np.concatenate(shown), area)
    axes.set_title(title, parse_math=False)
    legend_below(figure, columns=3)
    return figure


def _draw_dock(axes: Axes, dock: Dock, vehicle: Vehicle) -> Array:
    """Draw a dock; returns the corners (k, 2) of all its shapes [m]."""
    pose, approach, board = dock.pose, dock.approach, dock.board
    assert pose is not None
    shown = [draw_bodies(axes, pose, vehicle, style.BLUE, "docked vehicle", linewidths=1.4)]
    if approach is not None:
        start = pose.compose(Pose2(-approach.direction * approach.length, 0.0, 0.0))
        # Wider than the arrow on it.
        shown.append(_draw_line(axes, (start, pose), 5.0, style.ORANGE, "approach of the rear axle"))
    _draw_name(axes, dock.name, pose, draw_heading(axes, pose, vehicle, style.BLUE))
    if dock.contact is not None:
        end = pose.compose(Pose2(dock.contact.distance, 0.0, 0.0))
        look = {"linewidths": 1.4, "linestyles": ["dashed"]}
        shown.append(draw_bodies(axes, end, vehicle, style.GREEN, "after the contact move", **look))
    if (body := dock.body_at(pose)) is not None:
        draw_outlines(axes, [body], "docked object", style.PINK, alpha=0.5)
        shown.append(body)
    if board is not None:
        middle, half = pose.compose(Pose2(board.x, board.y, board.yaw)), 0.5 * board.size[0]
        ends = middle.compose(Pose2(0.0, -half, 0.0)), middle.compose(Pose2(0.0, half, 0.0))
        _draw_line(axes, ends, 3.0, style.RED, "board")
    return np.concatenate(shown)


def _draw_name(axes: Axes, name: str, pose: Pose2, tip: Pose2) -> None:
    right, up = cos(pose.phi), sin(pose.phi)
    axes.annotate(
        name,
        (tip.x, tip.y),
        xytext=(_NAME_AHEAD * right, _NAME_AHEAD * up),
        textcoords="offset points",
        ha="center" if abs(right) < _STRAIGHT else "left" if right > 0.0 else "right",
        va="center" if abs(up) < _STRAIGHT else "bottom" if up > 0.0 else "top",
        fontsize="small",
        parse_math=False,
        bbox={"facecolor": "white", "alpha": 0.7, "linewidth": 0.0, "pad": 1.0},
        zorder=5,
    )


def _draw_line(axes: Axes, ends: tuple[Pose2, Pose2], width: float, color: str, label: str) -> Array:
    """A line; returns its ends (2, 2) [m]."""
    points = np.array([(end.x, end.y) for end in ends])
    axes.plot(*points.T, color=color, linewidth=width, label=label, zorder=3, solid_capstyle="butt")
    return points
