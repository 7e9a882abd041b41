"""A planned way from above, and its curvature and clearance along it."""

from __future__ import annotations

from textwrap import fill
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure

from geometry import Area, Pose2
from rti_mpcc.config import ControllerConfig, Vehicle
from rti_mpcc.manoeuvre import Manoeuvre
from rti_mpcc.model.footprint import body_polygons
from rti_mpcc.report import style
from rti_mpcc.report.axes import grid, plane
from rti_mpcc.report.ground import draw_area, show_driven
from rti_mpcc.report.planned_way import PlannedWay, no_way, way_of
from rti_mpcc.simulation.result import cusps_of
from rti_mpcc.simulation.solid import SolidThings
from rti_mpcc.types import Array

_BODY_EVERY = 0.5
"""Way between two drawn bodies [m]."""
_WIDEST, _HIGHEST, _LOWEST = 7.0, 7.0, 3.6
"""Bounds on the size of the plane [inch]."""
_LEFT, _BETWEEN, _ALONG, _RIGHT = 0.9, 0.95, 5.2, 1.9
"""Widths beside the plane: its labels, those of the curves, the curves, their legends [inch]."""
_BOTTOM, _GAP, _TOP = 1.0, 0.35, 0.6
"""Heights below, between and above the axes, for the legend of the plane and the title, too [inch]."""
_LABELS = 0.6
"""Height below the plane for its labels [inch]."""
_MOST_SHOWN = 3.0
"""More clearance than this is not told apart [m]."""
_TITLE = 100
"""Letters in a line of the title."""
_STOPS = (("cusp", style.ORANGE), ("stop to steer", style.SKY))
_DOT: dict[str, Any] = {
    "linestyle": "none",
    "marker": "o",
    "markersize": 5.0,
    "markeredgecolor": style.BLACK,
    "markeredgewidth": 0.6,
}
_DIRECTIONS = ((1, "forward", style.BLUE), (-1, "reverse", style.RED))


def plan_figure(name: str, area: Area, manoeuvre: Manoeuvre, config: ControllerConfig) -> Figure:
    """Left the plane: what is solid, the bodies at start and goal and along the way, coloured by direction.

    Right, over the way driven: curvature with the vehicle's limit, and the clearance with the margin and the
    least one that is kept. Where no way was found the plane stands alone. Legends stand outside the data.
    """
    figure = Figure()
    axes = figure.add_subplot()
    way = way_of(manoeuvre)
    draw_area(axes, area)
    _draw_way(axes, way, config.vehicle)
    shown = [_draw_end(axes, manoeuvre.start, "start", style.GREEN, "solid", config.vehicle)]
    shown.append(_draw_end(axes, manoeuvre.goal, "goal", style.BLACK, "dashed", config.vehicle))
    if len(way.poses):
        shown.append(body_polygons(way.poses, config.vehicle).reshape(-1, 2))
    plane(axes)
    show_driven(axes, np.concatenate(shown), area)
    curves = (figure.add_subplot(), figure.add_subplot()) if len(way.poses) else ()
    _lay_out(figure, axes, curves)
    if curves:
        _draw_curvature(curves[0], manoeuvre, way, config.max_curvature)
        _draw_clearance(curves[1], way, SolidThings.of(area).clearance(way.poses, config.vehicle), config)
    figure.suptitle(
        fill(f"{name}: {said_of(manoeuvre)}", _TITLE if curves else _TITLE // 2),
        x=_LEFT / figure.get_size_inches()[0],
        y=1.0 - 0.1 / figure.get_size_inches()[1],
        ha="left",
        va="top",
        fontsize="medium",
    )
    return figure


def said_of(manoeuvre: Manoeuvre) -> str:
    """What came of a search, in a line."""
    if not manoeuvre.found:
        return no_way(manoeuvre)[0]
    cusps = cusps_of(segment.part for segment in manoeuvre.segments)
    changes = f"{cusps} cusp{'' if cusps == 1 else 's'}"
    return f"{manoeuvre.length:.2f} m with {changes}, planned in {manoeuvre.seconds:.2f} s"


def _draw_way(axes: Axes, way: PlannedWay, vehicle: Vehicle) -> None:
    for direction, name, color in _DIRECTIONS:
        rows = np.flatnonzero(way.direction == direction)
        if not len(rows):
            continue
        lines = [way.poses[way.segment == index, :2] for index in np.unique(way.segment[rows])]
        axes.add_collection(LineCollection(lines, colors=color, linewidths=1.8, label=name, zorder=3))
        places = np.round(np.arange(0.0, way.s[-1], _BODY_EVERY), 9)
        drawn = np.intersect1d(np.searchsorted(way.s, places), rows)
        outlines = body_polygons(way.poses[drawn], vehicle)
        axes.add_collection(
            PolyCollection(list(outlines), facecolors="none", edgecolors=color, linewidths=0.4, alpha=0.7)
        )
    for kind, (name, color) in zip((way.is_cusp, ~way.is_cusp), _STOPS, strict=True):
        ends = way.poses[way.last_rows[kind]]
        if len(ends):
            axes.plot(*ends[:, :2].T, markerfacecolor=color, label=name, zorder=4, **_DOT)


def _draw_end(axes: Axes, pose: Pose2, name: str, color: str, dashes: str, vehicle: Vehicle) -> Array:
    """The body there and its axis from the rear axle to the front; returns its corners (m, 2) [m]."""
    corners: Array = body_polygons(np.array([[pose.x, pose.y, pose.phi]]), vehicle)[0]
    body = PolyCollection(
        [corners],
        facecolors="none",
        edgecolors=color,
        linewidths=1.8,
        linestyles=[dashes],
        label=name,
        zorder=4,
    )
    axes.add_collection(body)
    tip = pose.compose(Pose2(vehicle.front, 0.0, 0.0))
    axes.annotate(
        "",
        xy=(tip.x, tip.y),
        xytext=(pose.x, pose.y),
        arrowprops={"arrowstyle": "-|>", "color": color, "linewidth": 1.0, "shrinkA": 0.0, "shrinkB": 0.0},
        zorder=4,
    )
    return corners


def _draw_curvature(axes: Axes, manoeuvre: Manoeuvre, way: PlannedWay, limit: float) -> None:
    begin = manoeuvre.segments[0].part.start
    for direction, name, color in _DIRECTIONS:
        label: str | None = name
        for part in (segment.part for segment in manoeuvre.segments):
            if part.direction == direction:
                values = np.append(part.curvatures, part.curvatures[-1])
                axes.step(part.knots - begin, values, where="post", color=color, linewidth=1.2, label=label)
                label = None
    for side in (-limit, limit):
        label = "vehicle's limit" if side > 0.0 else None
        axes.axhline(side, color=style.BLACK, linestyle="dashed", linewidth=0.9, label=label)
    axes.set_ylim(-1.15 * limit, 1.15 * limit)
    axes.set_ylabel("curvature [1/m]")
    axes.tick_params(labelbottom=False)
    _finish(axes, way)


def _draw_clearance(axes: Axes, way: PlannedWay, clearance: Array, config: ControllerConfig) -> None:
    axes.plot(way.s, clearance, color=style.BLACK, linewidth=1.2, label="clearance")
    for value, color, name in (
        (config.clearance.on_routes, style.GREEN, "wanted clearance"),
        (config.clearance.least, style.RED, "least clearance"),
    ):
        axes.axhline(value, color=color, linestyle="dashed", linewidth=0.9, label=name)
    most = min(float(np.max(clearance)), _MOST_SHOWN)
    highest = max(most, 2.0 * config.clearance.on_routes)
    axes.set_ylim(min(0.0, 1.05 * float(np.min(clearance))), 1.1 * highest)
    axes.set_ylabel("clearance [m]")
    axes.set_xlabel("way driven [m]")
    _finish(axes, way)


def _finish(axes: Axes, way: PlannedWay) -> None:
    for kind, (name, color) in zip((way.is_cusp, ~way.is_cusp), _STOPS, strict=True):
        for k, end in enumerate(way.s[way.last_rows[kind]].tolist()):
            label = None if k else name
            axes.axvline(end, color=color, linestyle="dotted", linewidth=1.4, label=label, zorder=1)
    axes.set_xlim(0.0, float(way.s[-1]))
    grid(axes)
    axes.legend(
        loc="upper left", bbox_to_anchor=(1.01, 1.0), borderaxespad=0.0, frameon=False, fontsize="small"
    )


def _lay_out(figure: Figure, axes: Axes, curves: tuple[Axes, ...]) -> None:
    """By hand: matplotlib's own layouts cut labels off where the aspect is fixed [inch]."""
    (left, right), (bottom, top) = axes.get_xlim(), axes.get_ylim()
    scale = min(_WIDEST / (right - left), _HIGHEST / (top - bottom))
    wide, high = scale * (right - left), scale * (top - bottom)
    room = max(high, _LOWEST) if curves else high
    beside = _BETWEEN + _ALONG + _RIGHT if curves else 0.3
    across = max(wide, 3.0)
    whole = (_LEFT + across + beside, _BOTTOM + room + _TOP)
    figure.set_size_inches(*whole)
    low = _BOTTOM + room - high
    axes.set_position((_LEFT / whole[0], low / whole[1], across / whole[0], high / whole[1]))
    axes.set_anchor("NW")
    each = 0.5 * (room - _GAP)
    for place, curve in enumerate(curves):
        under = _BOTTOM + (1 - place) * (each + _GAP)
        begin = (_LEFT + across + _BETWEEN) / whole[0]
        curve.set_position((begin, under / whole[1], _ALONG / whole[0], each / whole[1]))
    figure.legend(
        *axes.get_legend_handles_labels(),
        loc="upper left",
        bbox_to_anchor=(_LEFT / whole[0], (low - _LABELS) / whole[1]),
        borderaxespad=0.0,
        ncols=7,
        frameon=False,
        fontsize="small",
    )
