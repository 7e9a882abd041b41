"""The full course by constant and dynamic weights: the plane, and what goes on along the way."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from benchmarks.reproduction import looks
from benchmarks.reproduction.published import Track
from geometry import Pose2
from rti_mpcc.report import draw
from rti_mpcc.simulation import RunResult
from rti_mpcc.types import Array

NEAR = {"cusp": 1.0, "end": 0.3}
"""Half the width of what is shown larger [m]."""


def plane_figure(results: Sequence[RunResult], track: Track) -> Figure:
    """The whole course, and what is near its cusp and its end."""
    figure = Figure(figsize=(10.5, 6.4), layout="constrained")
    spots = figure.subplot_mosaic([["whole", "cusp"], ["whole", "end"]], width_ratios=(1.35, 1.0))
    path = results[0].path
    for name, axes in spots.items():
        draw.lines(axes, draw.path_lines(path), draw.ORANGE, "path")
        for result in results:
            x, y, _ = result.truth.poses.T
            axes.plot(x, y, **looks.look(result.method))
        x, y, _ = track.poses.T
        axes.plot(x, y, **looks.look(looks.PUBLISHED))
        axes.set_title({"whole": "full course"}.get(name, f"near the {name}"), fontsize="medium")
        draw.plane(axes)
    spots["whole"].margins(0.08)
    for name, pose in (("cusp", path.parts[0].last), ("end", path.end)):
        _zoom(spots[name], pose, NEAR[name])
        _mark(spots["whole"], pose, name)
    draw.legend_below(figure, columns=4)
    return figure


def _zoom(axes: Axes, pose: Pose2, near: float) -> None:
    axes.set_xlim(pose.x - near, pose.x + near)
    axes.set_ylim(pose.y - near, pose.y + near)
    axes.locator_params(nbins=5)
    axes.plot([pose.x], [pose.y], "x", color=draw.BLACK, markersize=9.0, markeredgewidth=1.8)


def _mark(axes: Axes, pose: Pose2, name: str) -> None:
    """Where a part is shown larger."""
    axes.plot([pose.x], [pose.y], "x", color=draw.BLACK, markersize=8.0, markeredgewidth=1.5)
    axes.annotate(name, (pose.x, pose.y), xytext=(-8.0, -5.0), textcoords="offset points", ha="right")


def beside(result: RunResult) -> Array:
    """(n,) distance beside the path at the run's progress, positive to the left of the heading [m]."""
    truth, values = result.truth, np.empty(len(result.truth.times))
    for index, part in enumerate(result.path.parts):
        rows = np.flatnonzero(truth.part == index)
        if len(rows):
            foot = part.reference(truth.theta[rows])
            dx, dy = truth.poses[rows, 0] - foot.x, truth.poses[rows, 1] - foot.y
            values[rows] = -np.sin(foot.phi) * dx + np.cos(foot.phi) * dy
    return values


def along_figure(results: Sequence[RunResult]) -> Figure:
    """Distance beside the path, steering and speed over the progress."""
    figure = Figure(figsize=(10.0, 6.8), layout="constrained")
    axes = figure.subplots(3, 1, sharex=True)
    for result in results:
        truth, line = result.truth, looks.look(result.method)
        for one, values in zip(axes, (beside(result), truth.delta, truth.v), strict=True):
            one.plot(truth.theta, values, **line)
    path = results[0].path
    for one, label in zip(axes, ("beside the path [m]", "steering δ [rad]", "speed v [m/s]"), strict=True):
        for k, end in enumerate([*path.cusps, path.length]):
            one.axvline(end, color=draw.GREY, linewidth=0.9, label="_" if k else "cusp, end")
        one.set_ylabel(label)
        draw.grid(one)
    axes[-1].set_xlabel("progress θ [m]")
    axes[-1].set_xlim(0.0, path.length + 1.0)
    draw.legend_below(figure, columns=5)
    return figure
