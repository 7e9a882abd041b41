"""The run over time: motion, inputs, progress, the goal as detected, effective weights, computing time."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from rti_mpcc.report import style
from rti_mpcc.report.axes import grid
from rti_mpcc.report.goal_rows import NAMES, draw_goal_rows, has_goal_rows
from rti_mpcc.report.mission_bands import BAND_LABELS, LOWERED, draw_bands, name_bands
from rti_mpcc.simulation import RunResult


def timeline_figure(result: RunResult, summary: dict[str, Any]) -> Figure:
    """v, delta, a, theta, effective weights and computing time above one another, on one time axis.

    Where a filter watched the goal, three rows below theta show what it knew, see `goal_rows`. `summary`
    gives the times that are marked: inside tolerance, the paper's T_goal (dotted), and docked (dashed). The
    steps of a mission are bands in the first rows, see `mission_bands`. Legends stand beside the axes.
    """
    goal_rows = len(NAMES) if has_goal_rows(result) else 0
    figure = Figure(figsize=(10.0, 2.0 * (6 + goal_rows)), layout="constrained")
    axes = figure.subplots(6 + goal_rows, 1, sharex=True)
    _draw_speed(axes[0], result)
    _draw_steering(axes[1], result)
    _draw_acceleration(axes[2], result)
    _draw_progress(axes[3], result)
    if goal_rows:
        draw_goal_rows(axes[4:-2], result)
    _draw_weights(axes[-2], result)
    _draw_computing(axes[-1], result)
    for place, one in enumerate(axes):
        if place < _BANDED:
            draw_bands(one, result)
        _mark(one, summary)
        grid(one)
        # Marks are named once, in the first legend.
        handles, labels = one.get_legend_handles_labels()
        kept = [k for k, label in enumerate(labels) if place == 0 or label not in _MARKS]
        one.legend(
            [handles[k] for k in kept],
            [labels[k] for k in kept],
            loc="upper left",
            bbox_to_anchor=(1.01, 1.0),
            borderaxespad=0.0,
            frameon=False,
            fontsize="small",
        )
    axes[0].set_title(result.title, pad=_PAD + name_bands(axes[0], result))
    axes[-1].set_xlabel("time [s]")
    axes[-1].set_xlim(0.0, max(float(result.truth.times[-1]), 1e-3))
    return figure


_MARKS = ("inside tolerance", "docked", LOWERED, *BAND_LABELS)
_BANDED = 3
"""So many rows show the steps of a mission: speed, steering, acceleration."""
_PAD = 6.0
"""Between the title and what is below it [points]."""


def _mark(axes: Axes, summary: dict[str, Any]) -> None:
    for key, label, dashes in (
        ("time_to_tolerance_s", "inside tolerance", "dotted"),
        ("time_to_dock_s", "docked", "dashed"),
    ):
        if summary[key] is not None:
            axes.axvline(summary[key], color=style.GREEN, linestyle=dashes, linewidth=1.2, label=label)


def _draw_speed(axes: Axes, result: RunResult) -> None:
    axes.plot(result.truth.times, result.truth.v, color=style.BLUE, label="true")
    axes.set_ylabel("v [m/s]")


def _draw_steering(axes: Axes, result: RunResult) -> None:
    limit = result.config.limits.steering
    axes.plot(result.truth.times, result.truth.delta, color=style.BLUE, label="true")
    for side in (-limit, limit):
        axes.axhline(
            side, color=style.GREY, linestyle="dashdot", linewidth=0.8, label="limit" if side > 0.0 else None
        )
    axes.set_ylabel("delta [rad]")


def _draw_acceleration(axes: Axes, result: RunResult) -> None:
    cycles = result.cycles
    axes.step(
        cycles.times, cycles.acceleration, where="post", color=style.ORANGE, linewidth=0.8, label="commanded"
    )
    axes.plot(result.truth.times, result.truth.acceleration, color=style.BLUE, label="true")
    axes.set_ylabel("a [m/s²]")


def _draw_progress(axes: Axes, result: RunResult) -> None:
    axes.plot(result.truth.times, result.truth.theta, color=style.BLUE, label="true")
    last, cusp = float(result.truth.times[-1]), "cusp"
    ends = [*(begin for begin, _ in result.paths[1:]), last]
    for (begin, path), end in zip(result.paths, ends, strict=False):
        for at in path.cusps:
            axes.plot((begin, end), (at, at), color=style.RED, linestyle="dashdot", linewidth=0.8, label=cusp)
            cusp = "_"
    for k, (begin, _) in enumerate(result.paths[1:]):
        label = "_" if k else "planned anew"
        axes.axvline(begin, color=style.PINK, linestyle="dotted", linewidth=1.2, label=label)
    axes.set_ylabel("theta [m]")


def _draw_weights(axes: Axes, result: RunResult) -> None:
    weights = result.cycles.weights
    for (name, color), values in zip(style.WEIGHTS, weights.T, strict=True):
        axes.step(result.cycles.times, values, where="post", color=color, label=name)
    # From 0 to 1e5: linear below 1, so that a weight that is switched off still shows.
    axes.set_yscale("symlog", linthresh=1.0)
    axes.set_ylim(0.0, 10.0 * max(1.0, float(np.max(weights, initial=0.0))))
    axes.set_ylabel("effective weights")


def _draw_computing(axes: Axes, result: RunResult) -> None:
    cycles = result.cycles
    curves = (
        (cycles.step_ms, style.GREY, "whole cycle"),
        (cycles.feedback_ms, style.ORANGE, "feedback phase"),
        (cycles.solve_ms, style.BLUE, "solver"),
    )
    # Logarithmic: a new part or objective takes several QPs and would hide the common cycle.
    axes.set_yscale("log")
    for values, color, name in curves:
        shown = np.where(values > 0.0, values, np.nan)
        axes.plot(cycles.times, shown, color=color, linewidth=0.8, label=name)
    axes.set_ylabel("time a cycle [ms]")
