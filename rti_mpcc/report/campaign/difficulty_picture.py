"""Small multiples: the share that docked, and the time to dock, over each thing that makes a case hard."""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from rti_mpcc.report import style
from rti_mpcc.report.axes import grid, legend_below
from rti_mpcc.report.campaign.columns import Campaign
from rti_mpcc.report.campaign.difficulty import Bin, Scale

COLUMNS = 4
_PANEL = (2.75, 2.1)
"""Of a panel with its labels [inch]."""
_ROOM = 0.9
"""For title and legend [inch]."""
Shown = Sequence[tuple[Scale, Sequence[Bin]]]


def success_figure(campaign: Campaign, shown: Shown) -> Figure:
    """Share that docked with its interval over each scale; marks where cases did not dock, or collided."""
    figure, panels = _panels(len(shown))
    lowest = min(100.0 * one.interval[0] for _, parts in shown for one in parts)
    bottom = max(0.0, lowest - 0.12 * (100.0 - lowest))
    for axes, (scale, parts) in zip(panels, shown, strict=True):
        rates = 100.0 * np.array([one.rate for one in parts])
        ends = 100.0 * np.array([one.interval for one in parts])
        _points(axes, parts, rates, ends, "share that docked, 95 % interval")
        for rows, marker, color, words in (
            (~campaign.docked, "x", style.RED, "did not dock"),
            (campaign.crossed, "+", style.BLACK, "collision"),
        ):
            at = scale.of(campaign)[rows]
            if at.size:
                low = np.full(at.size, bottom + 0.03 * (100.0 - bottom))
                axes.plot(at, low, marker, color=color, markersize=5.0, zorder=4, label=words)
        axes.set_ylim(bottom, 100.0 + 0.05 * (100.0 - bottom))
        axes.set_xlabel(scale.label, fontsize="small")
        _discrete(axes, parts)
    _name_rows(panels, "docked [%]")
    legend_below(figure)
    return figure


def time_figure(shown: Shown) -> Figure:
    """Median time to dock with its quartiles over each scale."""
    figure, panels = _panels(len(shown))
    for axes, (scale, parts) in zip(panels, shown, strict=True):
        times = np.array([[one.time[name] for name in ("p25", "p50", "p75")] for one in parts], dtype=float)
        label = "time to dock of those that docked: median, quartiles"
        _points(axes, parts, times[:, 1], times[:, [0, 2]], label)
        axes.set_xlabel(scale.label, fontsize="small")
        _discrete(axes, parts)
    low, high = panels[0].get_ylim()
    panels[0].set_ylim(max(0.0, low - 0.05 * (high - low)), high)
    _name_rows(panels, "time to dock [s]")
    legend_below(figure, columns=3)
    return figure


def _panels(count: int) -> tuple[Figure, list[Axes]]:
    columns, rows = min(COLUMNS, count), ceil(count / COLUMNS)
    width = max(_PANEL[0] * columns, 6.0)
    figure = Figure(figsize=(width, _PANEL[1] * rows + _ROOM), layout="constrained")
    grid_of = figure.subplots(rows, columns, sharey=True, squeeze=False).ravel().tolist()
    for empty in grid_of[count:]:
        empty.remove()
    for axes in grid_of[:count]:
        grid(axes)
        axes.tick_params(labelsize="small")
        axes.xaxis.set_major_locator(MaxNLocator(5))
    return figure, grid_of[:count]


def _points(axes: Axes, parts: Sequence[Bin], values: np.ndarray, ends: np.ndarray, label: str) -> None:
    """A point a bin, with its interval upright and its range across; ends (k, 2)."""
    x = np.array([one.middle for one in parts])
    upright = np.abs(ends - values[:, None]).T
    axes.errorbar(
        x,
        values,
        yerr=upright,
        fmt="o",
        color=style.BLUE,
        markersize=4.5,
        capsize=2.5,
        linewidth=1.2,
        label=label,
    )
    low, high = np.array([(one.low, one.high) for one in parts]).T
    axes.hlines(
        values, low, high, colors=style.SKY, linewidth=3.0, alpha=0.7, zorder=1, label="range of the bin"
    )


def _discrete(axes: Axes, parts: Sequence[Bin]) -> None:
    """Where every bin is one whole number, these are the ticks."""
    if all(one.low == one.high == round(one.low) for one in parts):
        axes.set_xticks([one.low for one in parts])
        axes.margins(x=0.25)


def _name_rows(panels: Sequence[Axes], name: str) -> None:
    for axes in panels[::COLUMNS]:
        axes.set_ylabel(name)
