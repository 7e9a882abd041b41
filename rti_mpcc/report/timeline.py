"""Strip charts: of a ride (status, motion, goal, weights, computing time), and of identified actuators."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from estimation import GoalStatus, stds_in
from rti_mpcc.mission.state import StepRecord
from rti_mpcc.recording.identify import Identified
from rti_mpcc.recording.moment import Moment
from rti_mpcc.report import draw
from rti_mpcc.report.ride import Ride, Strip, motion_strips
from rti_mpcc.simulation.metrics import errors_to, goal_estimates
from rti_mpcc.simulation.plant import SAME_TIME
from rti_mpcc.types import Array, MissionResult, Status

FARTHEST = (1.0, 1.0, 30.0)  # no row of the goal's errors reaches farther than this [m], [m], [deg]
GOAL_ROWS = ("goal error\nlongitudinal [m]", "goal error\nlateral [m]", "goal error\nheading [deg]")
_SIGMAS = 3.0  # half the width of the band around the estimate [standard deviations]
_UNITS = np.array([1.0, 1.0, 180.0 / np.pi])
_ROOM, _TOLERANCES = 1.1, 1.5
"""A row of errors reaches this much farther than its curves, and this multiple of the goal tolerance."""
_UNKNOWN: Array = np.full((3, 3), np.nan)
_SHADES = {
    GoalStatus.SEARCHING: {"color": draw.GREY, "alpha": 0.3, "zorder": 0},
    GoalStatus.TRACKING: {"color": draw.SKY, "alpha": 0.1, "zorder": 0},
    GoalStatus.COASTING: {"color": draw.ORANGE, "alpha": 0.25, "zorder": 0},
    GoalStatus.LOST: {"color": draw.PINK, "alpha": 0.35, "zorder": 0},
}
_BANDED = 3  # number of the first rows that show the steps of a mission
_ENTRIES = 6  # largest number of entries in a column of a legend
_OVER = {
    MissionResult.SUCCEEDED: (draw.GREEN, "step, succeeded"),
    MissionResult.RUNNING: (draw.GREY, "step, running"),
}
_FAILED = (draw.RED, "step, failed")
_PAD, _LINE_HEIGHT, _LETTER = 6.0, 12.0, 0.012
"""Distance of the title, height of a line of names [points]; width of a letter, in widths of the axes."""


def timeline_figure(ride: Ride, summary: Mapping[str, Any]) -> Figure:
    """Status of each cycle, and strip charts of a ride above one another, on one time axis.

    The charts: those of `motion_strips`; the errors of the goal, where a filter was in use; the effective
    weights, where they change; computing time. `summary` gives the times that are marked: inside tolerance,
    the paper's T_goal (dotted), and docked (dashed). The steps of a mission are bands in the first charts.
    """
    strips, goals = motion_strips(ride), len(GOAL_ROWS) * ride.filtered
    solved = {moment.weights for moment in ride.moments if moment.command.diagnostics.solver_status}
    weights, computing = len(solved) > 1, bool(ride.moments)
    rows = len(strips) + goals + weights + computing
    figure = Figure(figsize=(10.0, 1.7 * rows + 0.6), layout="constrained")
    heights = [0.25 if ride.moments else 0.01, *[1.0] * rows]
    band, *axes = figure.subplots(1 + rows, 1, sharex=True, height_ratios=heights)
    _draw_statuses(band, ride)
    commands = [moment.command for moment in ride.moments]
    commanded = {
        "acceleration [m/s²]": [command.acceleration for command in commands],
        "steering rate [rad/s]": [command.steering_rate for command in commands],
    }
    for row, strip in zip(axes, strips, strict=False):
        _draw_strip(row, ride, strip, commanded.get(strip.label))
    _draw_routes(axes[len(strips) - 1], ride)
    goal = axes[len(strips) :][:goals]
    if goals:
        _draw_goal(goal, ride)
    if weights:
        _draw_weights(axes[len(strips) + goals], ride)
    if computing:
        _draw_computing(axes[-1], ride)
    for row in axes[:_BANDED]:
        draw_bands(row, ride)
    start = float(ride.motion.times[0])
    for row in axes:
        for key, name, dashes in (
            ("time_to_tolerance_s", "inside tolerance", "dotted"),
            ("time_to_dock_s", "docked", "dashed"),
        ):
            if summary.get(key) is not None:
                at = start + summary[key]
                row.axvline(at, color=draw.GREEN, linestyle=dashes, linewidth=1.2, label=name)
        draw.grid(row)
    # The goal's rows share a legend; the first chart also names the bands and the marks of all.
    marks = axes[0].get_legend_handles_labels()[1]
    for row in axes:
        handles, labels = draw.entries_once(goal if row in goal[:1] else [row])
        own = [k for k, label in enumerate(labels) if row is axes[0] or label not in marks]
        if own and row not in goal[1:]:
            look = {"fontsize": "small", **draw.BESIDE, "ncols": 1 + (len(own) > _ENTRIES)}
            row.legend([handles[k] for k in own], [labels[k] for k in own], **look)
    axes[-1].set_xlabel("time [s]")
    axes[-1].set_xlim(start, max(ride.end, start + 1e-3))
    band.set_title(ride.title, pad=_PAD + name_bands(band, ride))
    return figure


def _draw_statuses(band: Axes, ride: Ride) -> None:
    """The status of each cycle as a band of colours, named beside it."""
    band.set_yticks([])
    band.set_ylabel("status", rotation=0, ha="right", va="center")
    statuses = [moment.command.status for moment in ride.moments]
    _draw_spells(band, ride, statuses, {one: {"color": color} for one, color in draw.STATUS_COLORS.items()})
    if statuses:
        look = {"fontsize": "small", **draw.BESIDE, "ncols": 2}
        band.legend(*draw.entries_once([band]), **look)


def _draw_strip(row: Axes, ride: Ride, strip: Strip, commanded: Sequence[float] | None) -> None:
    """A quantity with its comfort value and limit: neither of them makes the curve small."""
    known = np.isfinite(strip.values)
    if commanded is not None:
        row.step(ride.times, commanded, where="post", **_thin(draw.ORANGE, "commanded"))
    if known.any() and (ride.simulated or commanded is None):
        label = "true" if ride.simulated else "measured"
        row.plot(ride.motion.times, strip.values, color=draw.BLUE, label=label)
    reach = max([float(np.abs(strip.values[known]).max(initial=0.0)), strip.comfort or 0.0])
    for name, most, dashes, color in (
        ("comfort", strip.comfort, "dashed", draw.GREEN),
        ("limit", strip.limit, "dashdot", draw.GREY),
    ):
        if most is not None and most <= 1.5 * reach:
            for side in (most, -most):
                row.axhline(side, linestyle=dashes, **_thin(color, name))
    row.set_ylabel(strip.label.replace(" [", "\n["))


def actuators_figure(title: str, found: Identified) -> Figure:
    """One strip chart for drive and steering each, over the whole drive."""
    figure = Figure(figsize=(9.0, 6.0), layout="constrained")
    upper, lower = figure.subplots(2, 1, sharex=True)
    rows = (
        (upper, found.speed, found.drive, "speed [m/s]"),
        (lower, found.steering_angle, found.steering, "steering [rad]"),
    )
    for axes, drive, fit, label in rows:
        axes.plot(drive.stamps, drive.measured, color=draw.BLACK, label="measured")
        axes.plot(drive.stamps, drive.setpoints, color=draw.SKY, linewidth=1.0, label="set-point")
        if fit is not None:
            share = fit.rms / max(float(np.ptp(drive.measured)), 1e-9)
            times = f"dead time {fit.dead_time:.3f} s, lag {fit.lag:.3f} s"
            told = f"fit: {times}; residual (rms) {100.0 * share:.1f} % of the range"
            axes.plot(drive.stamps, fit.predicted, color=draw.RED, linestyle="--", label=told)
        axes.set_ylabel(label)
        draw.grid(axes)
        axes.legend(loc="best", fontsize="small")
    lower.set_xlabel("time [s]")
    upper.set_title(title, parse_math=False)
    return figure


def _thin(color: str, label: str) -> dict[str, Any]:
    return {"color": color, "label": label, "linewidth": 0.8}


def _draw_routes(axes: Axes, ride: Ride) -> None:
    borders = [*(start for start, _ in ride.routes[1:]), ride.end]
    for (start, route), end in zip(ride.routes, borders, strict=False):
        for at in route.cusps:
            axes.plot((start, end), (at, at), linestyle="dashdot", **_thin(draw.RED, "cusp"))
    for start in borders[:-1]:
        axes.axvline(start, color=draw.PINK, linestyle="dotted", linewidth=1.2, label="replanned")


def _draw_weights(row: Axes, ride: Ride) -> None:
    values = np.array([moment.weights for moment in ride.moments])
    for (name, color), each in zip(draw.WEIGHTS, values.T, strict=True):
        if each.any():
            row.step(ride.times, each, where="post", color=color, label=name)
    # From 0 to 1e5: linear below 1, so that a weight that is switched off still shows.
    row.set_yscale("symlog", linthresh=1.0)
    row.set_ylim(0.0, 10.0 * max(1.0, float(values.max())))
    row.set_ylabel("effective\nweights")


def _draw_computing(row: Axes, ride: Ride) -> None:
    # Logarithmic: a new segment or objective takes several QPs and would hide the common cycle.
    row.set_yscale("log")
    for name, color, label in (
        ("step_ms", draw.GREY, "whole cycle"),
        ("feedback_ms", draw.ORANGE, "feedback phase"),
        ("solve_ms", draw.BLUE, "solver"),
    ):
        spent = np.array([getattr(moment.command.diagnostics, name) for moment in ride.moments])
        row.plot(ride.times, np.where(spent > 0.0, spent, np.nan), **_thin(color, label))
    row.set_ylabel("time a cycle\n[ms]")


def _draw_goal(rows: Sequence[Axes], ride: Ride) -> None:
    """Setpoint, estimate and detections of the goal against the true one, in its frame."""
    times, tolerance = ride.times, np.array(ride.config.goal_tolerance) * _UNITS
    found = [moment.command.diagnostics.goal for moment in ride.moments]
    goals = np.array([_UNKNOWN[0] if moment.goal is None else moment.goal for moment in ride.moments])
    covariances = np.array(
        [_UNKNOWN if one is None or one.covariance is None else one.covariance for one in found]
    )
    estimate = errors_to(goals, goal_estimates(found)) * _UNITS
    setpoint = errors_to(goals, np.array([_setpoint(moment) for moment in ride.moments])) * _UNITS
    half = _SIGMAS * stds_in(goals, covariances) * _UNITS
    told = [(each, each.pose) for each in ride.detections if each.pose is not None]
    stamps = np.array([each.stamp for each, _ in told])
    poses = np.array([(pose.x, pose.y, pose.phi) for _, pose in told]).reshape(-1, 3)
    detections = errors_to(ride.motion.goals[ride.motion.rows_at(stamps)], poses) * _UNITS
    accepted = np.array([each.accepted for each, _ in told], dtype=np.bool_)
    # A setpoint that is farther off is a stop on the route, and not the goal.
    near = setpoint[(np.abs(setpoint) <= FARTHEST).all(axis=1)]
    shown = np.concatenate([np.abs(estimate) + half, near, detections[accepted], np.zeros((1, 3))])
    largest = np.max(np.abs(np.nan_to_num(shown)), axis=0)
    reach = np.minimum(_ROOM * np.maximum(largest, _TOLERANCES * tolerance), FARTHEST)
    for column, axes in enumerate(rows):
        _draw_spells(axes, ride, [None if one is None else one.status for one in found], _SHADES)
        low, high = estimate[:, column] - half[:, column], estimate[:, column] + half[:, column]
        band: dict[str, Any] = {"color": draw.BLUE, "alpha": 0.4, "linewidth": 0.0}
        axes.fill_between(times, low, high, label=f"± {_SIGMAS:g} sigma", **band)
        axes.plot(times, setpoint[:, column], **_thin(draw.BLACK, "goal setpoint"))
        axes.plot(times, estimate[:, column], color=draw.BLUE, linewidth=1.2, label="estimate")
        for side in (-1.0, 1.0):
            limit = side * tolerance[column]
            axes.axhline(limit, linestyle="dashdot", **_thin(draw.GREY, "goal tolerance"))
        edge = float(reach[column])
        _draw_detections(axes, stamps, detections[:, column], accepted, edge)
        axes.set_ylim(-edge, edge)
        axes.set_ylabel(GOAL_ROWS[column])


def _setpoint(moment: Moment) -> Array:
    """(3,) of the goal; it is known on the last segment of a route alone."""
    told = moment.command.diagnostics
    known = moment.route is not None and told.part == len(moment.route.parts) - 1
    return np.array([told.target.x, told.target.y, told.target.phi]) if known else np.full(3, np.nan)


def _draw_detections(
    axes: Axes, stamps: Array, values: Array, accepted: NDArray[np.bool_], edge: float
) -> None:
    """Detections over time; those beyond the `edge` of the axes are arrows there."""
    beyond = np.abs(values) > edge
    places = np.where(beyond, np.clip(values, -0.95 * edge, 0.95 * edge), values)
    for kind, name, color, marker in (
        (accepted, "accepted", draw.GREEN, "."),
        (~accepted, "rejected", draw.RED, "x"),
    ):
        for own, label, symbol in (
            (kind & ~beyond, name, marker),
            (kind & beyond & (values > 0.0), f"{name}, farther off", "^"),
            (kind & beyond & (values < 0.0), f"{name}, farther off", "v"),
        ):
            if own.any():
                axes.scatter(stamps[own], places[own], s=14.0, color=color, marker=symbol, label=label)


def _draw_spells(
    axes: Axes,
    ride: Ride,
    values: Sequence[Status | GoalStatus | None],
    looks: Mapping[Any, Mapping[str, Any]],
) -> None:
    """A band for each time over which a value of the cycles stays; None has none."""
    starts = [k for k, value in enumerate(values) if k == 0 or value is not values[k - 1]]
    times = [*(ride.moments[k].time for k in starts), ride.end]
    for k, (start, until) in zip(starts, pairwise(times), strict=True):
        if (value := values[k]) is not None:
            axes.axvspan(start, until, label=value.value, linewidth=0.0, **looks[value])


def draw_bands(axes: Axes, ride: Ride, *, waited: str = "end of a wait") -> None:
    """A band for each step of a mission, in the colour of its result, and a mark `waited` at the end of each
    wait."""
    for step in ride.steps:
        color, label = _OVER.get(step.result, _FAILED)
        start, end = _span(step, ride.end)
        axes.axvspan(start, end, facecolor=color, edgecolor=color, alpha=0.12, linewidth=0.8, label=label)
        axes.axvline(start, color=draw.GREY, linewidth=0.6)
        if step.kind == "wait" and step.end is not None:
            axes.axvline(end, color=draw.ORANGE, linestyle="dashed", linewidth=1.2, label=waited)


def name_bands(axes: Axes, ride: Ride) -> float:
    """The kinds of the steps above the axes, with the results of failed steps, on lines without overlap;
    returns the height of these lines [points]."""
    free: list[float] = []  # where each line is free from, in widths of the axes
    for step in ride.steps:
        name = step.kind if step.result in _OVER else f"{step.kind}: {step.result.value}"
        middle = 0.5 * sum(_span(step, ride.end))
        centre, half = middle / max(ride.end, SAME_TIME), 0.5 * _LETTER * (len(name) + 1)
        line = next((k for k, start in enumerate(free) if start <= centre - half), len(free))
        free[line : line + 1] = [centre + half]
        look: dict[str, Any] = {"xytext": (0.0, 3.0 + line * _LINE_HEIGHT), "textcoords": "offset points"}
        look |= {"xycoords": axes.get_xaxis_transform(), "ha": "center", "fontsize": "small"}
        axes.annotate(name, (middle, 1.0), **look)
    return _LINE_HEIGHT * len(free)


def _span(step: StepRecord, last: float) -> tuple[float, float]:
    return step.begin, last if step.end is None else step.end
