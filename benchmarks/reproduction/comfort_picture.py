"""The front of time against energies over the comfort acceleration."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from benchmarks.reproduction.published import published_run
from benchmarks.reproduction.runs import DOCKING, Runs
from rti_mpcc.config import COMFORT_ACCELERATION
from rti_mpcc.report import draw
from rti_mpcc.simulation.batch import DrivenCase

SHORTEST = 0.70
"""Share of the published code's time that the front is to reach."""
LABELS = {
    "acceleration": "energy of acceleration [m²/s³]",
    "lateral_acceleration": "energy of\nlateral acceleration [m²/s³]",
    "steering_rate": "energy of steering rate [rad²/s]",
}
"""Of the axes, by the energy's name."""


def front_figure(runs: Runs, fronts: Mapping[str, Sequence[DrivenCase]]) -> Figure:
    """A row a scenario, a column an energy; `fronts` by scenario, the fastest run first."""
    figure = Figure(figsize=(10.5, 3.2 * len(fronts)), layout="constrained")
    panels = figure.subplots(len(fronts), len(LABELS), squeeze=False)
    for row, (scenario, front) in zip(panels, fronts.items(), strict=True):
        for axes, (energy, label) in zip(row, LABELS.items(), strict=True):
            _draw(axes, runs, scenario, front, energy)
            axes.set_xlabel("time to tolerance T [s]")
            axes.set_ylabel(label)
            axes.set_title(DOCKING[scenario], fontsize="medium")
    draw.legend_below(figure, columns=4)
    return figure


def _draw(axes: Axes, runs: Runs, scenario: str, front: Sequence[DrivenCase], energy: str) -> None:
    published = published_run(scenario, "dynamic")
    assert published is not None
    times = [outcome.figures["time_to_tolerance_s"] for outcome in front]
    spent = [outcome.figures["energy"][energy] for outcome in front]
    axes.plot(times, spent, color=draw.BLUE, marker="o", markersize=4, label="preset default")
    for outcome, time, value in zip(front, times, spent, strict=True):
        comfort = outcome.figures["comfort"]["acceleration"]
        axes.annotate(f"{comfort:g}", (time, value), (4, 4), textcoords="offset points", fontsize="x-small")
        if comfort == COMFORT_ACCELERATION:
            axes.plot(time, value, "o", markersize=10, fillstyle="none", color=draw.BLUE)
    paper = runs.figures(scenario)
    if paper["time_to_tolerance_s"] is not None:
        axes.plot(
            paper["time_to_tolerance_s"],
            paper["energy"][energy],
            "s",
            color=draw.RED,
            label="preset paper",
            linestyle="none",
        )
    there, cost = published["time_to_tolerance_s"], published["energy"][energy]
    axes.plot(there, cost, "*", color=draw.BLACK, markersize=11, label="published code", linestyle="none")
    told = f"{SHORTEST:.2f} of the published code's time"
    axes.axvline(SHORTEST * there, color=draw.GREY, linestyle="dotted", linewidth=1.0, label=told)
    axes.set_ylim(0.0, 1.15 * max([cost, *spent, paper["energy"][energy]]))
    left, right = axes.get_xlim()
    right += 0.06 * (right - left)
    axes.fill_between([there, right], cost, axes.get_ylim()[1], color=draw.GREY, alpha=0.15, linewidth=0.0)
    axes.set_xlim(right=right)
    draw.grid(axes)
