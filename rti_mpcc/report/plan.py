"""A planned route: route.csv, plan.json, and plan.png with the plane, curvature and clearance."""

from __future__ import annotations

from math import isfinite
from pathlib import Path
from textwrap import fill
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from geometry import Area
from rti_mpcc.config import ControllerConfig, Vehicle
from rti_mpcc.manoeuvre import Manoeuvre
from rti_mpcc.model.footprint import body_polygons
from rti_mpcc.report import style
from rti_mpcc.report.axes import BESIDE, entries_once, grid, plane, save
from rti_mpcc.report.files import write_csv, write_json
from rti_mpcc.report.ground import draw_area, draw_bodies, draw_heading, show_driven
from rti_mpcc.report.numbers import counted
from rti_mpcc.simulation.scenery import area_clearance
from rti_mpcc.types import Array, Index

RouteRows = dict[str, Array]

SPACING, FINE = 0.05, 0.01
"""Largest distance of two rows of a route, and of two rows at which its least clearance is measured [m]."""
ROUTE = {"s": "%.6f", "x": "%.16g", "y": "%.16g", "heading": "%.12g", "curvature": "%.12g"}
ROUTE |= {"direction": "%d", "segment": "%d"}
"""Columns of route.csv with their formats: distance driven [m], pose of the rear axle [m], [rad], curvature,
positive to the left [1/m], 1 forward or -1 reverse, index of the segment; x, y may lie far from (0, 0)."""
_BODY_EVERY = 0.5
"""Distance of two drawn bodies along the route [m]."""
_PLANE, _CURVES, _LABELS, _LOWEST = 7.0, 7.0, 1.6, 4.5
"""Largest side of the plane, width of the curves with labels, labels and legends, least height [inch]."""
_MOST_SHOWN = 3.0
"""Larger clearance is cut off [m]."""
_STOPS = ((True, "cusp", style.ORANGE), (False, "stop to steer", style.SKY))
_DIRECTIONS: dict[int, Any] = {
    1: {"label": "forward", "color": style.BLUE},
    -1: {"label": "reverse", "color": style.RED},
}


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
    clearance = area_clearance(area, poses, config.vehicle)
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
    save(plan_figure(name, area, manoeuvre, config), written[2])
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
    draw_area(axes, area)
    shown = [_draw_route(axes, rows, config.vehicle)]
    for pose, label, color, dashes in (
        (manoeuvre.start, "start", style.GREEN, "solid"),
        (manoeuvre.goal, "goal", style.BLACK, "dashed"),
    ):
        look = {"linewidths": 1.8, "linestyles": [dashes], "zorder": 4}
        shown.append(draw_bodies(axes, pose, config.vehicle, color, label, **look))
        draw_heading(axes, pose, config.vehicle, color)
    plane(axes)
    show_driven(axes, np.concatenate(shown), area)
    (x0, x1), (y0, y1) = axes.get_xlim(), axes.get_ylim()
    scale = _PLANE / max(x1 - x0, y1 - y0)
    widths = [max(scale * (x1 - x0), 0.5 * _PLANE) + 1.0, _CURVES][: places.ncols]
    places.set_width_ratios(widths)
    figure.set_size_inches(sum(widths), max(scale * (y1 - y0) + _LABELS, _LOWEST))
    figure.legend(*entries_once([axes]), loc="outside lower left", ncols=6, frameon=False, fontsize="small")
    told = no_route(manoeuvre)[0]
    if found:
        curvature = figure.add_subplot(places[0, 1])
        _draw_curvature(curvature, manoeuvre, rows, config.max_curvature)
        _draw_clearance(figure.add_subplot(places[1, 1], sharex=curvature), rows, area, config)
        cusps = counted(manoeuvre.cusps, "cusp")
        told = f"{manoeuvre.length:.2f} m with {cusps}, planned in {manoeuvre.seconds:.2f} s"
    figure.suptitle(fill(f"{name}: {told}", 100 if found else 50), fontsize="medium")
    return figure


def _stops(rows: RouteRows, *, cusps: bool) -> Index:
    """The last rows of segments before a change of direction, or before a stop to steer."""
    ends = np.flatnonzero(np.diff(rows["segment"]) > 0)
    kept: Index = ends[(rows["direction"][ends] != rows["direction"][ends + 1]) == cusps]
    return kept


def _draw_route(axes: Axes, rows: RouteRows, vehicle: Vehicle) -> Array:
    """Draw the route; returns the corners of all bodies along it (k, 2) [m]."""
    poses = _poses(rows)
    for direction, look in _DIRECTIONS.items():
        own = np.flatnonzero(rows["direction"] == direction)
        for segment in np.unique(rows["segment"][own]):
            axes.plot(*poses[rows["segment"] == segment, :2].T, linewidth=1.8, zorder=3, **look)
        every = np.arange(0.0, rows["s"][-1] if len(own) else 0.0, _BODY_EVERY)
        drawn = np.intersect1d(np.searchsorted(rows["s"], np.round(every, 9)), own)
        draw_bodies(axes, poses[drawn], vehicle, look["color"], linewidths=0.4, alpha=0.7)
    for cusps, name, color in _STOPS:
        ends = poses[_stops(rows, cusps=cusps), :2]
        if len(ends):
            dot: dict[str, Any] = {"s": 25.0, "edgecolors": style.BLACK, "linewidths": 0.6, "zorder": 4}
            axes.scatter(*ends.T, color=color, label=name, **dot)
    return body_polygons(poses, vehicle).reshape(-1, 2)


def _draw_curvature(axes: Axes, manoeuvre: Manoeuvre, rows: RouteRows, limit: float) -> None:
    parts = [segment.part for segment in manoeuvre.segments]
    for part in parts:
        knots, values = part.knots - parts[0].start, np.append(part.curvatures, part.curvatures[-1])
        axes.step(knots, values, where="post", linewidth=1.2, **_DIRECTIONS[part.direction])
    axes.set_ylim(-1.15 * limit, 1.15 * limit)
    axes.set_ylabel("curvature [1/m]")
    axes.tick_params(labelbottom=False)
    _finish(axes, rows, (limit, style.BLACK, "vehicle's limit"), (-limit, style.BLACK, "vehicle's limit"))


def _draw_clearance(axes: Axes, rows: RouteRows, area: Area, config: ControllerConfig) -> None:
    clearance = area_clearance(area, _poses(rows), config.vehicle)
    axes.plot(rows["s"], clearance, color=style.BLACK, linewidth=1.2, label="clearance")
    margin, least = config.clearance.on_routes, config.clearance.least
    most = min(float(np.max(clearance)), _MOST_SHOWN)
    axes.set_ylim(min(0.0, 1.05 * float(np.min(clearance))), 1.1 * max(most, 2.0 * margin))
    axes.set_ylabel("clearance [m]")
    axes.set_xlabel("distance driven [m]")
    _finish(axes, rows, (margin, style.GREEN, "wanted clearance"), (least, style.RED, "least clearance"))


def _finish(axes: Axes, rows: RouteRows, *limits: tuple[float, str, str]) -> None:
    for value, color, label in limits:
        axes.axhline(value, color=color, linestyle="dashed", linewidth=0.9, label=label)
    for cusps, name, color in _STOPS:
        for end in rows["s"][_stops(rows, cusps=cusps)].tolist():
            axes.axvline(end, color=color, linestyle="dotted", linewidth=1.4, label=name, zorder=1)
    axes.set_xlim(0.0, float(rows["s"][-1]))
    grid(axes)
    axes.legend(*entries_once([axes]), fontsize="small", **BESIDE)
