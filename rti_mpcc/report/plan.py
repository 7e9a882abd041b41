"""The plane of a planned route, with route.csv and plan.json, and the docks of a file from above."""

from __future__ import annotations

from math import cos, isfinite, pi, sin
from pathlib import Path
from textwrap import fill
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from geometry import Area, Pose2
from rti_mpcc.config import ControllerConfig, Vehicle
from rti_mpcc.manoeuvre import Manoeuvre
from rti_mpcc.mission import Dock
from rti_mpcc.model.footprint import body_of, body_polygons
from rti_mpcc.report import draw
from rti_mpcc.report.files import write_csv, write_json
from rti_mpcc.simulation.docks_file import Docks
from rti_mpcc.types import Array, Index

RouteRows = dict[str, Array]

SPACING, FINE = 0.05, 0.01
"""Largest distance of two rows of a route, and of two rows at which its least clearance is measured [m]."""
ROUTE = {"s": "%.6f", "x": "%.16g", "y": "%.16g", "heading": "%.12g", "curvature": "%.12g"}
ROUTE |= {"direction": "%d", "segment": "%d"}
"""Columns of route.csv with their formats: distance driven [m], pose of the rear axle [m], [rad], curvature,
positive to the left [1/m], 1 forward or -1 reverse, index of the segment; x, y may lie far from (0, 0)."""
_PLANE, _CURVES, _LABELS, _LOWEST = 7.0, 7.0, 1.6, 4.5
"""Largest side of the plane, width of the curves with labels, labels and legends, least height [inch]."""
_DIRECTIONS: dict[int, Any] = {
    1: {"label": "forward", "color": draw.BLUE},
    -1: {"label": "reverse", "color": draw.RED},
}
_STRAIGHT = sin(pi / 12.0)
"""An arrow that points less to a side has its name centred on it, else beyond its tip on this side."""


def route_rows(manoeuvre: Manoeuvre, spacing: float = SPACING) -> RouteRows:
    """The route in rows at most `spacing` apart [m], see `ROUTE`: two where one segment ends and the next
    starts, none where no route was found."""
    parts = [segment.part for segment in manoeuvre.segments]
    rows = [np.zeros((len(ROUTE), 0))]
    for index, part in enumerate(parts):
        theta = part.places(spacing)
        at, same = part.reference(theta), np.ones_like(theta)
        driven, curvature = theta - parts[0].start, part.curvature(theta)
        rows.append(np.array([driven, at.x, at.y, at.phi, curvature, part.direction * same, index * same]))
    return dict(zip(ROUTE, np.concatenate(rows, axis=1), strict=True))


def no_route(manoeuvre: Manoeuvre) -> list[str]:
    """Why there is no route, and how far the search got, in lines."""
    lines = [f"no route was found: {manoeuvre.reason or manoeuvre.outcome.value}"]
    if manoeuvre.nodes and isfinite(manoeuvre.nearest):
        searched = f"{manoeuvre.nodes} nodes expanded in {manoeuvre.seconds:.1f} s"
        lines.append(f"the search came within {manoeuvre.nearest:.2f} m of the goal, {searched}")
    return lines


def write_plan(
    name: str, manoeuvre: Manoeuvre, area: Area, config: ControllerConfig, folder: Path
) -> tuple[dict[str, Any], list[Path]]:
    """Write the files of a search into a folder; returns plan.json and the paths. Raises OSError."""
    found, poses = manoeuvre.found, _poses(route_rows(manoeuvre, FINE))
    clearance = area.signed_distances(body_of(config.vehicle), poses)
    figures = {
        "found": found,
        "seconds": manoeuvre.seconds,
        "length_m": manoeuvre.length if found else None,
        "cusps": manoeuvre.cusps if found else None,
        "min_clearance_m": float(clearance.min()) if len(poses) else None,
        "nodes": manoeuvre.nodes,
    }
    written = [folder / "plan.json", folder / "route.csv", folder / "plan.png"]
    write_json(figures, written[0])
    write_csv(list(route_rows(manoeuvre).values()), ROUTE, written[1])
    draw.save(plan_figure(name, area, manoeuvre, config), written[2])
    return figures, written


def _poses(rows: RouteRows) -> Array:
    return np.column_stack([rows["x"], rows["y"], rows["heading"]])


def plan_figure(name: str, area: Area, manoeuvre: Manoeuvre, config: ControllerConfig) -> Figure:
    """Left the plane: static obstacles, the bodies at start, goal and along the route, coloured by direction.

    Right, over the distance: curvature with its limit, clearance with its wanted and least values. Where
    no route was found the plane stands alone. Legends stand outside the data.
    """
    figure, rows = Figure(layout="constrained"), route_rows(manoeuvre)
    found = len(rows["s"]) > 0
    places = figure.add_gridspec(2, 2 if found else 1)
    axes = figure.add_subplot(places[:, 0])
    draw.area(axes, area)
    shown = [_draw_route(axes, rows, config.vehicle)]
    for pose, label, color, dashes in (
        (manoeuvre.start, "start", draw.GREEN, "solid"),
        (manoeuvre.goal, "goal", draw.BLACK, "dashed"),
    ):
        look = {"linewidths": 1.8, "linestyles": [dashes], "zorder": 4}
        shown.append(draw.bodies(axes, pose, config.vehicle, color, label, **look))
        draw.heading(axes, pose, config.vehicle, color)
    draw.plane(axes)
    draw.show_driven(axes, np.concatenate(shown), area)
    (x0, x1), (y0, y1) = axes.get_xlim(), axes.get_ylim()
    scale = _PLANE / max(x1 - x0, y1 - y0)
    widths = [max(scale * (x1 - x0), 0.5 * _PLANE) + 1.0, _CURVES][: places.ncols]
    places.set_width_ratios(widths)
    figure.set_size_inches(sum(widths), max(scale * (y1 - y0) + _LABELS, _LOWEST))
    figure.legend(
        *draw.entries_once([axes]), loc="outside lower left", ncols=6, frameon=False, fontsize="small"
    )
    told = no_route(manoeuvre)[0]
    if found:
        curvature = figure.add_subplot(places[0, 1])
        _draw_curvature(curvature, manoeuvre, rows, config.max_curvature)
        _draw_clearance(figure.add_subplot(places[1, 1], sharex=curvature), rows, area, config)
        cusps = f"{manoeuvre.cusps} cusp{'s' * (manoeuvre.cusps != 1)}"
        told = f"{manoeuvre.length:.2f} m with {cusps}, planned in {manoeuvre.seconds:.2f} s"
    figure.suptitle(fill(f"{name}: {told}", 100 if found else 50), fontsize="medium")
    return figure


def _stops(rows: RouteRows) -> tuple[tuple[str, str, Index], ...]:
    """Name, colour and last rows of the segments before a change of direction, and before a stop to steer."""
    ends = np.flatnonzero(np.diff(rows["segment"]) > 0)
    turns = rows["direction"][ends] != rows["direction"][ends + 1]
    return ("cusp", draw.ORANGE, ends[turns]), ("stop to steer", draw.SKY, ends[~turns])


def _draw_route(axes: Axes, rows: RouteRows, vehicle: Vehicle) -> Array:
    """Draw the route; returns the corners of all bodies along it (k, 2) [m]."""
    poses = _poses(rows)
    for direction, look in _DIRECTIONS.items():
        own = np.flatnonzero(rows["direction"] == direction)
        for segment in np.unique(rows["segment"][own]):
            axes.plot(*poses[rows["segment"] == segment, :2].T, linewidth=1.8, zorder=3, **look)
        every = np.arange(0.0, rows["s"][-1] if len(own) else 0.0, 0.5)
        drawn = np.intersect1d(np.searchsorted(rows["s"], np.round(every, 9)), own)
        draw.bodies(axes, poses[drawn], vehicle, look["color"], linewidths=0.4, alpha=0.7)
    for name, color, ends in _stops(rows):
        if len(ends):
            dot: dict[str, Any] = {"s": 25.0, "edgecolors": draw.BLACK, "linewidths": 0.6, "zorder": 4}
            axes.scatter(*poses[ends, :2].T, color=color, label=name, **dot)
    return body_polygons(poses, vehicle).reshape(-1, 2)


def _draw_curvature(axes: Axes, manoeuvre: Manoeuvre, rows: RouteRows, limit: float) -> None:
    parts = [segment.part for segment in manoeuvre.segments]
    for part in parts:
        knots, values = part.knots - parts[0].start, np.append(part.curvatures, part.curvatures[-1])
        axes.step(knots, values, where="post", linewidth=1.2, **_DIRECTIONS[part.direction])
    axes.set_ylim(-1.15 * limit, 1.15 * limit)
    axes.set_ylabel("curvature [1/m]")
    axes.tick_params(labelbottom=False)
    _finish(axes, rows, (limit, draw.BLACK, "vehicle's limit"), (-limit, draw.BLACK, "vehicle's limit"))


def _draw_clearance(axes: Axes, rows: RouteRows, area: Area, config: ControllerConfig) -> None:
    clearance = area.signed_distances(body_of(config.vehicle), _poses(rows))
    axes.plot(rows["s"], clearance, color=draw.BLACK, linewidth=1.2, label="clearance")
    margin, least = config.clearance.on_routes, config.clearance.least
    most = min(float(np.max(clearance)), 3.0)
    axes.set_ylim(min(0.0, 1.05 * float(np.min(clearance))), 1.1 * max(most, 2.0 * margin))
    axes.set_ylabel("clearance [m]")
    axes.set_xlabel("distance driven [m]")
    _finish(axes, rows, (margin, draw.GREEN, "wanted clearance"), (least, draw.RED, "least clearance"))


def _finish(axes: Axes, rows: RouteRows, *limits: tuple[float, str, str]) -> None:
    for value, color, label in limits:
        axes.axhline(value, color=color, linestyle="dashed", linewidth=0.9, label=label)
    for name, color, ends in _stops(rows):
        for end in rows["s"][ends].tolist():
            axes.axvline(end, color=color, linestyle="dotted", linewidth=1.4, label=name, zorder=1)
    axes.set_xlim(0.0, float(rows["s"][-1]))
    draw.grid(axes)
    axes.legend(*draw.entries_once([axes]), fontsize="small", **draw.BESIDE)


def docks_figure(title: str, docks: Docks) -> Figure:
    """Each dock: docked vehicle with its heading, approach, docked object, board, end of the contact move."""
    figure = Figure(figsize=(9.0, 7.5), layout="constrained")
    axes = figure.add_subplot()
    area = docks.area or Area()
    draw.area(axes, area)
    shown = [_draw_dock(axes, dock, docks.vehicle) for dock in docks.docks.values()]
    draw.plane(axes)
    draw.show_driven(axes, np.concatenate(shown), area)
    axes.set_title(title, parse_math=False)
    draw.legend_below(figure, columns=3)
    return figure


def _draw_dock(axes: Axes, dock: Dock, vehicle: Vehicle) -> Array:
    """Draw a dock; returns the corners (k, 2) of all its shapes [m]."""
    pose, approach, board = dock.pose, dock.approach, dock.board
    assert pose is not None
    shown = [draw.bodies(axes, pose, vehicle, draw.BLUE, "docked vehicle", linewidths=1.4)]
    if approach is not None:
        start = pose.compose(Pose2(-approach.direction * approach.length, 0.0, 0.0))
        # Wider than the arrow on it.
        shown.append(_draw_line(axes, (start, pose), 5.0, draw.ORANGE, "approach of the rear axle"))
    _draw_name(axes, dock.name, pose, draw.heading(axes, pose, vehicle, draw.BLUE))
    if dock.contact is not None:
        end = pose.compose(Pose2(dock.contact.distance, 0.0, 0.0))
        look = {"linewidths": 1.4, "linestyles": ["dashed"]}
        shown.append(draw.bodies(axes, end, vehicle, draw.GREEN, "after the contact move", **look))
    if (body := dock.body_at(pose)) is not None:
        draw.outlines(axes, [body], "docked object", draw.PINK, alpha=0.5)
        shown.append(body)
    if board is not None:
        middle, half = pose.compose(Pose2(board.x, board.y, board.yaw)), 0.5 * board.size[0]
        ends = middle.compose(Pose2(0.0, -half, 0.0)), middle.compose(Pose2(0.0, half, 0.0))
        _draw_line(axes, ends, 3.0, draw.RED, "board")
    return np.concatenate(shown)


def _draw_name(axes: Axes, name: str, pose: Pose2, tip: Pose2) -> None:
    right, up = cos(pose.phi), sin(pose.phi)
    axes.annotate(
        name,
        (tip.x, tip.y),
        xytext=(6.0 * right, 6.0 * up),
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
