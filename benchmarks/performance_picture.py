"""The picture of docs/performance.md: how the cost of a cycle grows."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import NullLocator

from benchmarks.sweeps import Variant, series
from rti_mpcc.report.draw import BLACK, BLUE, DPI, GREY, ORANGE

PANELS = (
    ("stages", "stages N", "log"),
    ("path length", "length of the path [m]", "log"),
    ("boundary points", "points of the boundaries", "log"),
)
TICKS = (0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0)
STAGES_COMPARED = 70
"""Where the line begins to which growth with N is compared."""


def draw(rows: Sequence[Variant], yardstick: float, file: Path) -> None:
    """One panel a series: p50 and p95 of a cycle [ms] over its size, and the yardstick [ms]."""
    figure, panels = plt.subplots(2, 2, figsize=(9.0, 6.4), sharey=True, layout="constrained")
    for axes, (name, label, scale) in zip(panels.flat, PANELS, strict=True):
        _panel(axes, series(rows, name), label, yardstick)
        axes.set_xscale(scale)
        sizes = [row.size for row in series(rows, name)]
        axes.set_xticks(sizes, [f"{size:,}" for size in sizes])
        axes.xaxis.set_minor_locator(NullLocator())
    for axes in panels[:, 0]:
        axes.set_ylabel("time of a cycle [ms]")
    first = panels.flat[0]
    _proportional(first, series(rows, "stages"))
    first.legend(fontsize="small")
    first.set_yticks(TICKS, [f"{tick:g}" for tick in TICKS])
    first.yaxis.set_minor_locator(NullLocator())
    values = [value for row in rows for value in (row.found.p50, row.found.p95)] + [yardstick]
    first.set_ylim(0.7 * min(values), 1.4 * max(values))
    figure.savefig(file, dpi=DPI)
    plt.close(figure)


def _panel(axes: Axes, rows: Sequence[Variant], label: str, yardstick: float) -> None:
    sizes = [row.size for row in rows]
    axes.plot(sizes, [row.found.p50 for row in rows], "o-", color=BLUE, label="p50")
    axes.plot(sizes, [row.found.p95 for row in rows], "^-", color=ORANGE, label="p95")
    axes.axhline(yardstick, color=GREY, linestyle=":", label="yardstick")
    axes.set_yscale("log")
    axes.set_xlabel(label)
    axes.grid(color=GREY, alpha=0.25, linewidth=0.5)


def _proportional(axes: Axes, rows: Sequence[Variant]) -> None:
    """What growth in proportion to N would be."""
    for row in rows:
        if row.size == STAGES_COMPARED:
            sizes = np.array([one.size for one in rows])
            cost = row.found.p50 / STAGES_COMPARED * sizes
            axes.plot(sizes, cost, "--", color=BLACK, linewidth=0.8, label="in proportion to N")
