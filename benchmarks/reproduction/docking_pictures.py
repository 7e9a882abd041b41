"""The docking scenarios: driven bodies in the corridor by method, and motion over time."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure

from benchmarks.reproduction import looks
from benchmarks.reproduction.published import Track, published_track
from rti_mpcc.model.footprint import body_polygons
from rti_mpcc.report import draw
from rti_mpcc.simulation import RunResult
from rti_mpcc.types import Array

BODY_EVERY = 2.0
"""Time between two drawn bodies [s]."""
LONGEST = 1.25
"""Of a run so many times as long as the published one is shown over time."""
HIGHEST = 1.5
"""Acceleration that is shown [m/s²]."""
_WIDTH, _BESIDE, _BELOW = 3.6, 0.9, 1.3
"""Of the axes, and room for labels and legend [inch]."""


def plane_figure(results: Sequence[RunResult], figures: Sequence[Mapping[str, Any]]) -> Figure:
    """A panel a method: corridor, path, bodies, and where the published code drove by the same method.

    `figures` are the summaries of the runs.
    """
    left, right, bottom, top = _extent(results)
    height = _WIDTH * (top - bottom) / (right - left)
    size = (_BESIDE + len(results) * _WIDTH, height + _BELOW)
    figure = Figure(figsize=size, layout="constrained")
    panels = np.atleast_1d(figure.subplots(1, len(results), sharex=True, sharey=True))
    for axes, result, told in zip(panels, results, figures, strict=True):
        _draw(axes, result)
        axes.set_title(f"{result.method}: {_outcome(result, told)}", fontsize="medium")
        axes.set_xlim(left, right)
        axes.set_ylim(bottom, top)
        axes.label_outer()
    draw.legend_below(figure, columns=4)
    return figure


def _draw(axes: Axes, result: RunResult) -> None:
    assert result.corridor is not None
    draw.lines(axes, draw.boundaries_of(result.corridor), draw.BLACK, "corridor")
    draw.lines(axes, draw.path_lines(result.path), draw.ORANGE, "path")
    truth, vehicle, line = result.truth, result.config.vehicle, looks.look(result.method)
    times = np.arange(truth.times[0], truth.times[-1], BODY_EVERY)
    rows = np.unique([*np.searchsorted(truth.times, times), len(truth.times) - 1])
    for poses, color, width, dashes, label in (
        (truth.poses[rows], line["color"], 0.5, "solid", "_"),
        (truth.goals[-1:], draw.BLACK, 1.4, "dotted", "goal"),
    ):
        bodies = list(body_polygons(poses, vehicle))
        axes.add_collection(
            PolyCollection(
                bodies, edgecolors=color, linewidths=width, linestyles=dashes, label=label, facecolors="none"
            )
        )
    axes.plot(*truth.poses[:, :2].T, **line)
    track = published_track(result.scenario.name, result.method)
    axes.plot(*track.poses[:, :2].T, **_published())
    draw.plane(axes)


def _outcome(result: RunResult, figures: Mapping[str, Any]) -> str:
    if figures["docked"]:
        return f"docked at {figures['time_to_dock_s']:.1f} s"
    return f"not docked in {result.truth.times[-1]:.0f} s ({result.cycles.status[-1].value})"


def _published() -> dict[str, Any]:
    return {**looks.look(looks.PUBLISHED), "label": "published code, same method"}


def _extent(results: Sequence[RunResult]) -> tuple[float, float, float, float]:
    """Left, right, bottom, top of all that is drawn, the same for all panels [m]."""
    lines: list[Array] = []
    for result in results:
        vehicle = result.config.vehicle
        poses = np.concatenate([result.truth.poses[::20], result.truth.poses[-1:], result.truth.goals[-1:]])
        lines.append(body_polygons(poses, vehicle).reshape(-1, 2))
        assert result.corridor is not None
        lines += draw.boundaries_of(result.corridor)
        track = published_track(result.scenario.name, result.method)
        lines.append(track.poses[:, :2])
    points = np.concatenate(lines)
    (left, bottom), (right, top) = points.min(axis=0) - 0.7, points.max(axis=0) + 0.7
    return float(left), float(right), float(bottom), float(top)


def time_figure(results: Sequence[RunResult], beyond: RunResult) -> Figure:
    """A column a method, rows of speed, steering and acceleration; `beyond` goes with the first method."""
    figure = Figure(figsize=(3.5 * len(results), 6.6), layout="constrained")
    panels = figure.subplots(3, len(results), sharex="col", sharey="row", squeeze=False)
    for column, result in zip(panels.T, results, strict=True):
        _draw_times(column, result, looks.look(result.method))
        track = published_track(result.scenario.name, result.method)
        _draw_track(column, track)
        column[0].set_xlim(0.0, min(LONGEST * track.times[-1], _end(result, track)))
        column[0].set_title(result.method, fontsize="medium")
        column[-1].set_xlabel("time [s]")
        for axes in column:
            draw.grid(axes)
    _draw_times(panels[:, 0], beyond, looks.look(looks.BEYOND))
    named = ("speed v [m/s]", "steering δ [rad]", "acceleration a [m/s²]")
    for axes, label in zip(panels[:, 0], named, strict=True):
        axes.set_ylabel(label)
    cut_peaks(panels[-1])
    draw.legend_below(figure, columns=5)
    return figure


def cut_peaks(row: Iterable[Axes]) -> None:
    """One hard stop would flatten all other curves: such peaks are cut off, and told at the edge."""
    for axes in row:
        low, high = axes.get_ylim()
        axes.set_ylim(max(low, -HIGHEST), min(high, HIGHEST))
        for line in axes.lines:
            x, y = np.asarray(line.get_xdata(), dtype=float), np.asarray(line.get_ydata(), dtype=float)
            place = int(np.argmax(np.abs(y)))
            if abs(y[place]) > HIGHEST and x[place] <= axes.get_xlim()[1]:
                edge = float(np.copysign(HIGHEST, y[place]))
                axes.annotate(
                    f"to {y[place]:.1f} m/s²".replace("-", "−"),
                    (x[place], edge),
                    xytext=(-5.0, -np.sign(edge) * 4.0),
                    textcoords="offset points",
                    ha="right",
                    va="top" if edge > 0.0 else "bottom",
                    fontsize="small",
                )


def _end(result: RunResult, track: Track) -> float:
    return max(float(result.truth.times[-1]), float(track.times[-1])) + 0.5


def _draw_times(column: Iterable[Axes], result: RunResult, line: dict[str, Any]) -> None:
    truth = result.truth
    for axes, values in zip(column, (truth.v, truth.delta, truth.acceleration), strict=True):
        axes.plot(truth.times, values, **line)


def _draw_track(column: Iterable[Axes], track: Track) -> None:
    for axes, values in zip(column, (track.v, track.delta, track.acceleration), strict=True):
        axes.plot(track.times, values, **_published())
