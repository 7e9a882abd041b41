"""A case from above: where it is and, if it was driven, how, and where it came nearest to a boundary."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure

from geometry import Pose2, ReferencePath
from rti_mpcc.model.footprint import body_polygons
from rti_mpcc.report import style
from rti_mpcc.report.axes import plane
from rti_mpcc.report.ground import draw_area, draw_outlines, draw_path, draw_routes, show_driven
from rti_mpcc.report.overview import fit_plane
from rti_mpcc.simulation import RunResult, Scenario
from rti_mpcc.simulation.metrics import clearances
from rti_mpcc.types import Array

BODY_EVERY = 1.0
"""Time between two drawn bodies [s]."""
_EARLIER, _LAST = ("earlier parts", style.GREY), ("last part", style.BLACK)


def case_figure(scenario: Scenario, result: RunResult | None, title: str) -> Figure:
    """Path, corridor by part, obstacles, goal; the body each second, at the end, at its least clearance.

    In an area what is solid in it, and the ways that were planned. `result`: None for a case that was not
    driven: then the body stands at its start. Scales are equal.
    """
    figure = Figure(layout="constrained")
    axes = figure.add_subplot()
    path = None if scenario.in_area else scenario.build_path()
    if path is None:
        _draw_ways(axes, scenario, result)
    else:
        _draw_corridor(axes, scenario, path)
        draw_path(axes, path)
    start, goal = scenario.start_pose(), scenario.goal_pose(path)
    if result is None:
        _bodies(axes, scenario, [start], edgecolors=style.BLUE, label="body at the start")
    else:
        _draw_run(axes, scenario, result)
        goal = Pose2(*result.truth.goals[-1].tolist())
    _draw_goals(axes, scenario, path, goal)
    axes.set_aspect("equal", adjustable="box", anchor="NW")
    if scenario.in_area:
        ends = np.array([(pose.x, pose.y, pose.phi) for pose in (start, goal)])
        poses = ends if result is None else np.concatenate((ends, result.truth.poses))
        bodies = body_polygons(poses, scenario.build_vehicle())
        show_driven(axes, bodies.reshape(-1, 2), scenario.build_area())
    else:
        axes.margins(0.05)
        axes.autoscale_view()
    fit_plane(figure, axes)
    plane(axes)
    axes.set_title(title, fontsize="medium", loc="left")
    beside: dict[str, Any] = {"bbox_to_anchor": (1.01, 1.0), "borderaxespad": 0.0, "frameon": False}
    axes.legend(loc="upper left", fontsize="small", **beside)
    return figure


def _draw_corridor(axes: Axes, scenario: Scenario, path: ReferencePath) -> None:
    """Only the boundaries of the active part act, so those of the last one are told from the others."""
    corridor, last = scenario.build_corridor(path), len(path.parts) - 1
    for (words, color), parts in ((_EARLIER, range(last)), (_LAST, (last,))):
        lines = [line for part in parts for side in corridor.lines(part) for line in side]
        label = f"corridor, {words}" if last else "corridor"
        if lines:
            axes.add_collection(LineCollection(lines, colors=color, linewidths=1.3, label=label))
    if corridor.obstacles:
        shapes = list(corridor.obstacles)
        axes.add_collection(
            PolyCollection(shapes, facecolors=style.GREY, edgecolors=style.BLACK, label="obstacle")
        )


def _draw_ways(axes: Axes, scenario: Scenario, result: RunResult | None) -> None:
    """What is solid in an area, what came and went besides, and the ways that were planned."""
    draw_area(axes, scenario.build_area())
    if result is None:
        return
    draw_outlines(axes, [outline for _, outlines in result.besides for outline in outlines])
    draw_routes(axes, [path for _, path in result.paths])


def _draw_run(axes: Axes, scenario: Scenario, result: RunResult) -> None:
    truth = result.truth
    wanted = np.searchsorted(truth.times, np.arange(truth.times[0], truth.times[-1], BODY_EVERY))
    last = truth.part == truth.part[-1]
    for (words, _), color, rows in (
        (_EARLIER, style.GREEN, wanted[~last[wanted]]),
        (_LAST, style.BLUE, wanted[last[wanted]]),
    ):
        label = f"body each second,\n{words}" if not last.all() else "body each second"
        _bodies(axes, scenario, truth.poses[rows], edgecolors=color, linewidths=0.6, label=label)
    axes.plot(*truth.poses[:, :2].T, color=style.BLUE, linewidth=1.4, label="rear axle, driven")
    _bodies(
        axes,
        scenario,
        truth.poses[-1:],
        facecolors=style.SKY,
        edgecolors=style.BLUE,
        alpha=0.6,
        label="body at the end",
    )
    clearance = clearances(result)
    least = int(np.argmin(clearance))
    if np.isfinite(clearance[least]):
        label = f"body nearest to a boundary,\n{clearance[least]:.3f} m at {truth.times[least]:.1f} s"
        _bodies(
            axes,
            scenario,
            truth.poses[least : least + 1],
            facecolors=style.ORANGE,
            edgecolors=style.BLACK,
            alpha=0.55,
            label=label.replace("-", "−"),
        )


def _draw_goals(axes: Axes, scenario: Scenario, path: ReferencePath | None, goal: Pose2) -> None:
    """The true goal at the end, and the planned one where the goal is detected."""
    planned = scenario.planned_goal(path)
    if scenario.goal.measurement is not None and planned is not None:
        dotted = {"edgecolors": style.PINK, "linewidths": 1.2, "linestyles": "dotted"}
        _bodies(axes, scenario, [planned], label="planned goal", **dotted)
    dashed = {"edgecolors": style.RED, "linewidths": 1.5, "linestyles": "dashed"}
    _bodies(axes, scenario, [goal], label="goal", **dashed)


def _bodies(axes: Axes, scenario: Scenario, poses: list[Pose2] | Array, **look: Any) -> None:
    """Outlines of the body at poses, or at (k, 3) x, y, phi."""
    rows = np.array([(pose.x, pose.y, pose.phi) if isinstance(pose, Pose2) else pose for pose in poses])
    if len(rows):
        shapes = list(body_polygons(rows, scenario.build_vehicle()))
        axes.add_collection(PolyCollection(shapes, **{"facecolors": "none", **look}))
