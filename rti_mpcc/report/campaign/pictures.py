"""The pictures of a campaign's report: spread of figures, success and time over difficulty, case by case."""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from rti_mpcc.report import style
from rti_mpcc.report.axes import grid, legend_below
from rti_mpcc.report.campaign.difficulty import Scale
from rti_mpcc.report.campaign.pairs import Pairs

COLUMNS = 4
_PANEL = (2.75, 2.1)
"""Of a panel with its labels [inch]."""
_ROOM = 0.9
"""For title and legend [inch]."""
_BARS = 30
_EXTREME = "p95, of the clearance p5"
Shown = Sequence[tuple[Scale, pd.DataFrame]]
"""Scales, with their bins as `difficulty.bins` gives them."""


def spread_figure(rows: pd.DataFrame) -> Figure:
    """Histograms with median and p95 (p5 of the clearance), counts upright."""
    figure = Figure(figsize=(10.0, 3.3), layout="constrained")
    panels = figure.subplots(1, 3)
    _histogram(panels[0], rows["time_to_dock_s"], "time to dock [s]", 0.95)
    _histogram(panels[1], rows["over_yardstick"], "time to dock / yardstick", 0.95)
    _histogram(panels[2], rows["min_clearance_m"], "least clearance [m]", 0.05)
    if rows["crossed"].any():
        panels[2].axvline(0.0, color=style.BLACK, linewidth=1.0, label="the body touches")
    panels[0].set_ylabel("cases")
    legend_below(figure)
    return figure


def _histogram(axes: Axes, values: pd.Series[float], label: str, share: float) -> None:
    values = values.dropna()
    axes.set_xlabel(label)
    grid(axes)
    axes.yaxis.set_major_locator(MaxNLocator(integer=True))
    if values.empty:
        axes.text(0.5, 0.5, "no case", ha="center", va="center", transform=axes.transAxes)
        return
    axes.hist(values, bins=min(_BARS, max(5, len(values) // 4)), color=style.SKY, edgecolor="white")
    axes.axvline(float(values.median()), color=style.BLUE, linewidth=1.4, label="median")
    axes.axvline(
        float(values.quantile(share)), color=style.RED, linestyle="dashed", linewidth=1.4, label=_EXTREME
    )


def success_figure(rows: pd.DataFrame, shown: Shown) -> Figure:
    """Share that docked with its interval over each scale; marks where cases did not dock, or collided."""
    figure, panels = _panels(shown, "docked [%]")
    lowest = min(100.0 * parts["rate_low"].min() for _, parts in shown)
    bottom = max(0.0, lowest - 0.12 * (100.0 - lowest))
    marks = (
        (~rows["docked"], "x", style.RED, "did not dock"),
        (rows["crossed"], "+", style.BLACK, "collision"),
    )
    for axes, (scale, parts) in zip(panels, shown, strict=True):
        ends = 100.0 * parts[["rate_low", "rate", "rate_high"]]
        _points(axes, parts, ends, "share that docked, 95 % interval")
        for wanted, marker, color, words in marks:
            at = scale.of(rows[wanted])
            if len(at):
                low = np.full(len(at), bottom + 0.03 * (100.0 - bottom))
                axes.plot(at, low, marker, color=color, markersize=5.0, zorder=4, label=words)
    panels[0].set_ylim(bottom, 100.0 + 0.05 * (100.0 - bottom))
    legend_below(figure)
    return figure


def time_figure(shown: Shown) -> Figure:
    """Median time to dock with its quartiles over each scale."""
    figure, panels = _panels(shown, "time to dock [s]")
    for axes, (_, parts) in zip(panels, shown, strict=True):
        label = "time to dock of those that docked: median, quartiles"
        _points(axes, parts, parts[["p25", "p50", "p75"]], label)
    low, high = panels[0].get_ylim()
    panels[0].set_ylim(max(0.0, low - 0.05 * (high - low)), high)
    legend_below(figure, columns=3)
    return figure


def _panels(shown: Shown, name: str) -> tuple[Figure, list[Axes]]:
    """Axes for each scale, with one `name` upright for all of them."""
    columns, lines = min(COLUMNS, len(shown)), ceil(len(shown) / COLUMNS)
    size = (max(_PANEL[0] * columns, 6.0), _PANEL[1] * lines + _ROOM)
    figure = Figure(figsize=size, layout="constrained")
    panels = figure.subplots(lines, columns, sharey=True, squeeze=False).ravel().tolist()
    for empty in panels[len(shown) :]:
        empty.remove()
    for place, (axes, (scale, parts)) in enumerate(zip(panels, shown, strict=False)):
        grid(axes)
        axes.tick_params(labelsize="small")
        axes.set_xlabel(scale.label, fontsize="small")
        axes.xaxis.set_major_locator(MaxNLocator(5))
        if (parts["low"] == parts["high"].round()).all():  # each bin is a whole number
            axes.set_xticks(parts["low"])
            axes.margins(x=0.25)
        if place % COLUMNS == 0:
            axes.set_ylabel(name)
    return figure, panels[: len(shown)]


def _points(axes: Axes, parts: pd.DataFrame, values: pd.DataFrame, label: str) -> None:
    """A point a bin, with its interval upright and its range across; `values`: low, middle, high."""
    low, middle, high = values.to_numpy().T
    bars: dict[str, Any] = {"color": style.BLUE, "markersize": 4.5, "capsize": 2.5, "linewidth": 1.2}
    axes.errorbar(parts["middle"], middle, yerr=(middle - low, high - middle), fmt="o", label=label, **bars)
    ranges: dict[str, Any] = {"colors": style.SKY, "linewidth": 3.0, "alpha": 0.7, "zorder": 1}
    axes.hlines(middle, parts["low"], parts["high"], label="range of the bin", **ranges)


def pairs_figure(pairs: Pairs) -> Figure:
    """Time to dock and least clearance of the second campaign across, of the first upright."""
    figure = Figure(figsize=(9.0, 5.0), layout="constrained")
    times, clearances = figure.subplots(1, 2)
    _scatter(times, pairs, "time_to_dock_s", "time to dock [s]")
    _scatter(clearances, pairs, "min_clearance_m", "least clearance [m]")
    legend_below(figure, columns=4)
    return figure


def _scatter(axes: Axes, pairs: Pairs, column: str, words: str) -> None:
    """A point a case, equal scales, the diagonal; a time that only one has stands at the edge."""
    first, second = pairs.first["docked"], pairs.second["docked"]
    values = pd.DataFrame({"x": pairs.second[column], "y": pairs.first[column]}).dropna(how="all")
    if column == "min_clearance_m":
        values = values.dropna()
    low, high = (values.min().min(), values.max().max()) if len(values) else (0.0, 1.0)
    room = 0.06 * (high - low) or 0.5
    low, high = low - room, high + (2.0 if values.isna().any(axis=None) else 1.0) * room
    kinds = (
        (first & second, "both dock", "o", style.BLUE, "none"),
        (first & ~second, f"only {pairs.names[0]} docks", "^", style.GREEN, "none"),
        (second & ~first, f"only {pairs.names[1]} docks", "v", style.RED, "none"),
        (~first & ~second, "neither docks", "x", style.BLACK, style.BLACK),
    )
    axes.plot([low, high], [low, high], color=style.GREY, linewidth=0.9, zorder=1)
    look: dict[str, Any] = {"s": 22, "linewidths": 0.9, "zorder": 3, "clip_on": False}
    for wanted, label, marker, color, face in kinds:
        points = values[wanted[values.index]].fillna(high)
        if len(points):
            axes.scatter(
                points["x"], points["y"], marker=marker, color=color, facecolors=face, label=label, **look
            )
    axes.set(xlim=(low, high), ylim=(low, high), aspect="equal")
    axes.set(xlabel=f"{words}, {pairs.names[1]}", ylabel=f"{words}, {pairs.names[0]}")
    grid(axes)
