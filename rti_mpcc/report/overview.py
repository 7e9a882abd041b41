"""The plane from above: path, corridor or area, the driven body each second, the goal and its detections."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure

from geometry import Area
from rti_mpcc.model.footprint import body_polygons
from rti_mpcc.report import style
from rti_mpcc.report.axes import plane
from rti_mpcc.report.ground import (
    draw_area,
    draw_boundaries,
    draw_obstacles,
    draw_ways,
    show_driven,
)
from rti_mpcc.report.mission_bands import docked_at, draw_ends
from rti_mpcc.simulation import GoalSource, RunResult
from rti_mpcc.types import Array

_BODY_EVERY = 1.0
"""Time between two drawn bodies [s]."""
_WIDEST, _HIGHEST, _LOWEST = 6.5, 8.5, 2.5
"""Bounds on the size of the axes [inch]."""
_DOT = 10.0
"""Area of the dot of a detection [points²]."""
_MARGINS = {"left": 0.9, "right": 2.3, "bottom": 0.6, "top": 0.5}
"""Room beside the axes for labels and legend [inch]."""


def overview_figure(result: RunResult) -> Figure:
    """Path, corridor or what is solid in the area, obstacles, body each second and at the end, goals.

    The true goal is drawn where it was at the end, and before it moved; where it was known from detections,
    the planned goal and the detected ones (dots where they put the rear axle) are drawn too. Axes are equal,
    in metres; the legend stands outside of the data.
    """
    figure = Figure()
    axes = figure.add_subplot()
    if result.area is not None:
        _draw_area(axes, result.area, result)
    else:
        _draw_corridor(axes, result)
        draw_ways(axes, [path for _, path in result.paths])
    poses = _poses_drawn(result)
    _draw_bodies(axes, result, poses)
    _draw_goals(axes, result)
    draw_ends(axes, result)
    plane(axes)
    axes.set_anchor("NW")
    if result.area is not None:
        bodies = body_polygons(np.concatenate((poses, result.truth.goals[[0, -1]])), result.config.vehicle)
        show_driven(axes, bodies.reshape(-1, 2), result.area)
    else:
        axes.margins(0.05)
        axes.autoscale_view()
    fit_plane(figure, axes)
    _draw_detections(axes, result)
    axes.set_title(f"{result.title}: {result.truth.times[-1]:.1f} s in all")
    axes.legend(
        loc="upper left", bbox_to_anchor=(1.01, 1.0), borderaxespad=0.0, frameon=False, markerscale=1.5
    )
    return figure


def fit_plane(figure: Figure, axes: Axes) -> None:
    """A wide course gets a low picture and a tall one a high picture, within limits [inch]."""
    (left, right), (bottom, top) = axes.get_xlim(), axes.get_ylim()
    width, height = _WIDEST, _WIDEST * (top - bottom) / (right - left)
    if height > _HIGHEST:
        width, height = _HIGHEST * width / height, _HIGHEST
    height = max(height, _LOWEST)
    whole = (width + _MARGINS["left"] + _MARGINS["right"], height + _MARGINS["bottom"] + _MARGINS["top"])
    figure.set_size_inches(*whole)
    # By hand: matplotlib's own layouts cut labels off where the aspect is fixed.
    axes.set_position(
        (_MARGINS["left"] / whole[0], _MARGINS["bottom"] / whole[1], width / whole[0], height / whole[1])
    )


def _poses_drawn(result: RunResult) -> Array:
    """(k, 3) true poses each second and at the end."""
    truth = result.truth
    wanted = np.arange(truth.times[0], truth.times[-1], _BODY_EVERY)
    rows = np.append(np.searchsorted(truth.times, wanted), len(truth.times) - 1)
    poses: Array = truth.poses[np.unique(rows)]
    return poses


def _draw_corridor(axes: Axes, result: RunResult) -> None:
    draw_boundaries(axes, result.corridors[0][1], result.paths[0][1])
    draw_obstacles(axes, [obstacle for _, scene in result.corridors for obstacle in scene.obstacles])


def _draw_area(axes: Axes, area: Area, result: RunResult) -> None:
    """What is solid, what came and went besides, and all paths that were planned."""
    draw_area(axes, area)
    docked = docked_at(result)  # it is drawn by itself
    others = [outline for _, outlines in result.besides for outline in outlines]
    draw_obstacles(axes, [each for each in others if docked is None or not np.array_equal(each, docked)])
    draw_ways(axes, [path for _, path in result.paths])


def _draw_bodies(axes: Axes, result: RunResult, poses: Array) -> None:
    vehicle, truth = result.config.vehicle, result.truth
    bodies = body_polygons(poses, vehicle)
    driven = PolyCollection(
        list(bodies), facecolors="none", edgecolors=style.BLUE, linewidths=0.6, label="body each second"
    )
    axes.add_collection(driven)
    axes.plot(
        truth.poses[:, 0], truth.poses[:, 1], color=style.BLUE, linewidth=1.5, label="rear axle, driven"
    )
    last = PolyCollection(
        [bodies[-1]], facecolors=style.SKY, edgecolors=style.BLUE, alpha=0.6, label="body at the end"
    )
    axes.add_collection(last)


def _draw_goals(axes: Axes, result: RunResult) -> None:
    goals = result.truth.goals
    moved = np.flatnonzero((goals[1:] != goals[:-1]).any(axis=1))
    _add_goals(axes, result, goals[moved], style.RED, "solid", 0.5, "goal before it moved")
    _add_goals(axes, result, goals[-1:], style.RED, "dashed", 1.5, "goal")
    planned = _planned_goal(result)
    if planned is not None:
        _add_goals(axes, result, np.array([planned]), style.PINK, (0.0, (2.0, 1.0)), 1.2, "planned goal")


def _planned_goal(result: RunResult) -> tuple[float, float, float] | None:
    """The goal that a run began with, where that was not the true one."""
    if result.scenario.goal.measurement is None or result.goal_source is GoalSource.KNOWN:
        return None
    planned = result.scenario.planned_goal(result.given_path)
    return None if planned is None else (planned.x, planned.y, planned.phi)


def _add_goals(
    axes: Axes,
    result: RunResult,
    goals: Array,
    color: str,
    dashes: str | tuple[float, tuple[float, float]],
    width: float,
    label: str,
) -> None:
    """The body at each of the goals (k, 3)."""
    if not len(goals):
        return
    bodies = list(body_polygons(goals, result.config.vehicle))
    axes.add_collection(
        PolyCollection(
            bodies, facecolors="none", edgecolors=color, linewidths=width, linestyles=[dashes], label=label
        )
    )


def _draw_detections(axes: Axes, result: RunResult) -> None:
    """Dots where the goal was detected. They don't widen the axes: a wild one may lie far outside."""
    told = result.tracking.detections if result.tracking is not None else ()
    axes.set_autoscale_on(False)
    kinds = ((True, "detection, accepted", style.GREEN, "."), (False, "detection, rejected", style.RED, "x"))
    for accepted, name, color, marker in kinds:
        poses = [judged.pose for judged in told if judged.accepted is accepted]
        known = np.array([(pose.x, pose.y) for pose in poses if pose is not None])
        if len(known):
            x, y = known.T
            axes.scatter(x, y, s=_DOT, color=color, marker=marker, linewidths=0.8, label=name, zorder=3)
