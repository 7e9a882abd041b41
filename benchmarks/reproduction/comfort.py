"""Time against comfort: what the preset `default` gives for what it is asked for; not in the paper."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from benchmarks.reproduction.content import Block, Picture, Section, Table, found, say
from benchmarks.reproduction.published import published_run, published_track
from benchmarks.reproduction.runs import DEFAULT, DOCKING, Runs
from benchmarks.reproduction.verdicts import ENERGIES, came_out, ratio
from rti_mpcc.config import COMFORT_ACCELERATION
from rti_mpcc.report import draw
from rti_mpcc.report.text import number
from rti_mpcc.simulation.batch import DrivenCase

LATEST = {"docking_inside": 21.4, "docking_behind": 24.0}
"""Time to tolerance that `default` is to keep to [s]."""
CLEARANCE = 0.095
"""Clearance that `default` is to keep [m]: its margin to within what a plan is off between two cycles."""
MOST_ENERGY = {"acceleration": 1.0, "steering_rate": 1.2, "lateral_acceleration": 1.0}
"""Shares of the published code's energies that `default` is to keep to."""
QUANTITIES = {
    "acceleration": "acceleration [m/s²]",
    "lateral_acceleration": "lateral acceleration [m/s²]",
    "steering_rate": "steering rate [rad/s]",
}
"""Of comfort, as heads of columns."""
_SAID = (
    "Comfort is what passengers or load are to feel at most: acceleration, lateral acceleration, steering "
    "rate. A planned arrival takes the time that keeps to all three. The other way round, a time can be "
    "asked for, and the three values are scaled so that docking is expected to take it. The figure shows "
    "the front of time against energy over `comfort_acceleration`, the other two as they are by default."
)
_CAPTION = (
    "Energy (integral of the square up to T) against time to tolerance T. Numbers at the points: "
    "comfort_acceleration [m/s²]; the ringed one is the default. Left of the dotted line: less than "
    "{share:.2f} of the published code's time. Grey: slower and more energy than the published code."
)
SHORTEST = 0.70
"""Share of the published code's time that the front is to reach."""
LABELS = {
    "acceleration": "energy of acceleration [m²/s³]",
    "lateral_acceleration": "energy of\nlateral acceleration [m²/s³]",
    "steering_rate": "energy of steering rate [rad²/s]",
}
"""Of the axes, by the energy's name."""


def comfort_section(runs: Runs) -> Section:
    """Front, tables and sentences."""
    fronts = {name: _front(runs, name) for name in DOCKING}
    wanted = {name: aims(runs.figures(name, preset=DEFAULT), name) for name in DOCKING}
    blocks: list[Block] = [
        say(_SAID),
        Picture(
            name="comfort_front",
            png=draw.png(front_figure(runs, fronts)),
            caption=_CAPTION.format(share=SHORTEST),
            told="Curves of energy over time that fall towards longer times, with two points beside them.",
        ),
        *(found(_reached(name, fronts[name])) for name in DOCKING),
        *(found(aims_told(name, wanted[name])) for name in DOCKING),
        _aims_table(wanted),
        _comfort_table(runs),
        _time_table(runs),
    ]
    figures = [{"asked": _asked(outcome), **outcome.figures} for outcome in runs.comforts]
    return Section(name="comfort", title="Time against comfort", blocks=blocks, figures=figures)


class Aim(NamedTuple):
    """One thing that the preset `default` set out for; `value` None: it never came to it."""

    words: str
    value: float | None
    bound: float
    at_least: bool = False

    @property
    def met(self) -> bool:
        """Whether it came out."""
        if self.value is None:
            return False
        return self.value >= self.bound if self.at_least else self.value <= self.bound


def aims(figures: dict[str, Any], scenario: str) -> list[Aim]:
    """What the preset `default` set out for, and what came of it by the summary of its run."""
    published = published_run(scenario, "dynamic")
    energy, to_dock, peak = figures["energy"], figures["energy_to_dock"], figures["peak"]
    time = figures["time_to_tolerance_s"]
    least = None if time is None else _least_energy(figures, scenario)
    later = None if time is None else max(to_dock[name] / energy[name] for name in energy)
    return [
        Aim("time to tolerance T [s]", time, LATEST[scenario]),
        Aim("clearance [m]", figures["min_clearance_m"], CLEARANCE, at_least=True),
        *(
            Aim(
                f"energy of {ENERGIES[name]} / published code's",
                ratio(energy[name], published["energy"][name]),
                most,
            )
            for name, most in MOST_ENERGY.items()
        ),
        Aim("energy up to docking / up to T, the largest", later, 1.1),
        Aim("peak acceleration / a_c", ratio(peak["acceleration"], figures["comfort"]["acceleration"]), 2.0),
        Aim("acceleration energy / (12 D²/T³)", ratio(energy["acceleration"], least), 1.15),
    ]


def aims_told(scenario: str, found_aims: Sequence[Aim]) -> str:
    """Whether all of them came out, and which did not."""
    missed = [f"{aim.words} {number(aim.value, 3)}" for aim in found_aims if not aim.met]
    claim = f"{DOCKING[scenario]}: `default` keeps to all that it set out for"
    return came_out(claim, not missed, "; ".join(missed))


def _aims_table(by_scenario: dict[str, list[Aim]]) -> Table:
    rows = []
    for same in zip(*by_scenario.values(), strict=True):
        bounds = " / ".join(dict.fromkeys(f"{aim.bound:g}" for aim in same))
        side = "at least" if same[0].at_least else "at most"
        rows.append([same[0].words, f"{side} {bounds}", *(number(aim.value, 3) for aim in same)])
    return Table(
        caption="What the preset `default` set out for beside `dynamic` of the published code. D: the "
        "shorter of the two ways driven.",
        heads=["", "bound", *(DOCKING[name] for name in by_scenario)],
        rows=rows,
        worded=[1],
    )


def _least_energy(figures: dict[str, Any], scenario: str) -> float:
    """12 D²/T³ [m²/s³]: from rest to rest over D in T, D the shorter of this way and the published one."""
    track = published_track(scenario, "dynamic")
    there = float(np.hypot(*np.diff(track.poses[:, :2], axis=0).T).sum())
    return float(12.0 * min(figures["distance_m"], there) ** 2 / figures["time_to_tolerance_s"] ** 3)


def _front(runs: Runs, scenario: str) -> list[DrivenCase]:
    """The docked runs over the comfort acceleration alone, fastest first."""
    mine = [
        outcome
        for outcome in runs.comforts
        if outcome.case.scenario.name == scenario and set(_asked(outcome)) == {"comfort_acceleration"}
    ]
    return sorted(
        (outcome for outcome in mine if outcome.figures["time_to_tolerance_s"] is not None),
        key=lambda outcome: float(outcome.figures["time_to_tolerance_s"]),
    )


def _reached(scenario: str, front: Sequence[DrivenCase]) -> str:
    published = published_run(scenario, "dynamic")
    share = None
    if front:
        share = ratio(front[0].figures["time_to_tolerance_s"], published["time_to_tolerance_s"])
    claim = f"{DOCKING[scenario]}: the front reaches down to {SHORTEST:.2f} of the published code's time"
    holds = None if share is None else share <= SHORTEST
    return came_out(claim, holds, "" if share is None else f"{share:.2f}")


def _asked(outcome: DrivenCase) -> dict[str, float]:
    """What the scenario's [controller] asks for, besides the dead time."""
    section = outcome.case.scenario.controller
    return section.model_dump(exclude={"dead_time", "deadline"}, exclude_none=True)


def _pairs(figures: dict[str, Any], form: str) -> list[str]:
    """Comfort / largest value of each quantity."""
    return [f"{figures['comfort'][name]:{form}} / {figures['peak'][name]:.3f}" for name in QUANTITIES]


def _comfort_table(runs: Runs) -> Table:
    rows = []
    for outcome in runs.comforts:
        if "docking_time" not in _asked(outcome):
            figures = outcome.figures
            times = [number(figures[key], 2) for key in ("expected_time_s", "time_to_dock_s")]
            rows.append([DOCKING[outcome.case.scenario.name], *_pairs(figures, "g"), *times])
    return Table(
        caption="Comfort asked for / largest value driven, and the time that it gives.",
        heads=["scenario", *QUANTITIES.values(), "expected [s]", "docked after [s]"],
        rows=rows,
    )


def _time_table(runs: Runs) -> Table:
    rows = []
    for outcome in runs.comforts:
        if asked := _asked(outcome).get("docking_time"):
            times = [f"{asked:g}", number(outcome.figures["time_to_dock_s"], 2)]
            rows.append([DOCKING[outcome.case.scenario.name], *times, *_pairs(outcome.figures, ".3f")])
    return Table(
        caption="The other way round: time asked for and taken, and comfort / largest value that it gives.",
        heads=["scenario", "asked [s]", "docked after [s]", *QUANTITIES.values()],
        rows=rows,
    )


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
