"""How times and clearances spread over the cases of a campaign."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from rti_mpcc.report import style
from rti_mpcc.report.axes import grid, legend_below
from rti_mpcc.report.campaign.columns import Campaign
from rti_mpcc.report.campaign.figures import time_over_yardstick
from rti_mpcc.types import Array

_BINS = 30
_EXTREME = "p95, of the clearance p5"


def spread_figure(campaign: Campaign) -> Figure:
    """Histograms with median and p95 (p5 of the clearance), counts upright."""
    figure = Figure(figsize=(10.0, 3.3), layout="constrained")
    panels = figure.subplots(1, 3)
    docked = campaign.docked
    _histogram(panels[0], campaign["time_to_dock_s"][docked], "time to dock [s]", 95)
    _histogram(panels[1], time_over_yardstick(campaign)[docked], "time to dock / yardstick", 95)
    _histogram(panels[2], campaign["min_clearance_m"], "least clearance [m]", 5)
    if campaign.crossed.any():
        panels[2].axvline(0.0, color=style.BLACK, linewidth=1.0, label="the body touches")
    panels[0].set_ylabel("cases")
    legend_below(figure)
    return figure


def _histogram(axes: Axes, values: Array, label: str, percent: int) -> None:
    finite = values[np.isfinite(values)]
    axes.set_xlabel(label)
    grid(axes)
    axes.yaxis.set_major_locator(MaxNLocator(integer=True))
    if not finite.size:
        axes.text(0.5, 0.5, "no case", ha="center", va="center", transform=axes.transAxes)
        return
    axes.hist(finite, bins=min(_BINS, max(5, finite.size // 4)), color=style.SKY, edgecolor="white")
    lines = ((50, style.BLUE, "solid", "median"), (percent, style.RED, "dashed", _EXTREME))
    for place, color, dashes, name in lines:
        value = float(np.percentile(finite, place))
        axes.axvline(value, color=color, linestyle=dashes, linewidth=1.4, label=name)
