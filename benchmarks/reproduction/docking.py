"""Scenario 1 and 2: the paper, its published code and this project side by side."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from benchmarks.reproduction import causes
from benchmarks.reproduction.content import PAPER as PAPER_COLUMNS
from benchmarks.reproduction.content import Block, Picture, Section, Table, found, say
from benchmarks.reproduction.docking_pictures import BODY_EVERY, HIGHEST, LONGEST, plane_figure, time_figure
from benchmarks.reproduction.published import published_run, published_track
from benchmarks.reproduction.runs import DEFAULT, DOCKING, METHODS, Runs
from benchmarks.reproduction.verdicts import (
    beyond_told,
    came_out,
    claims,
    missed_causes,
    published_times,
    time_told,
    times_of,
    times_told,
)
from benchmarks.tables import ENERGIES, Column, cells, heads
from rti_mpcc.report import draw
from rti_mpcc.report.text import number
from rti_mpcc.simulation import RunResult
from rti_mpcc.simulation.batch import DrivenCase

Figures = Mapping[str, Any]
COLUMNS = (*PAPER_COLUMNS, Column("clearance [m]", "min_clearance_m", 2))


_TABLE_SAID = (
    "T: first time inside tolerance, a dash where it never was. Reversals: changes of direction. Rms: up "
    "to T, of the whole run where there is no T. Clearance: of the whole body, negative where it crosses a "
    "boundary. The published code is not asked for a standstill, so of its runs it is said that they get "
    "inside tolerance. Of the paper only T stands here: its columns of rms values are near the fourth "
    "power of the rms of its own published code (within a factor of two), so they are not in the same unit "
    "as these."
)


def docking_section(runs: Runs, scenario: str) -> Section:
    """The section of a scenario: tables, two figures, verdicts and causes."""
    outcomes = {method: runs.of(scenario, method) for method in METHODS}
    measured = {method: _with_status(outcome) for method, outcome in outcomes.items()}
    beyond = runs.of(scenario, preset=DEFAULT)
    published = published_run(scenario, "dynamic")
    blocks: list[Block] = [
        say(causes.SAYS[scenario]),
        _table(scenario, measured, beyond.figures),
        _ratio_table(scenario, measured),
        _energy_table(published, measured["dynamic"], beyond.figures),
        *_pictures(scenario, list(outcomes.values()), beyond.result),
        *map(found, verdicts(scenario, measured)),
        found(fastest_told(scenario, outcomes["dynamic"].result)),
        *map(say, missed_causes(scenario, measured)),
        found(beyond_told(_with_status(beyond), published)),
        *map(say, causes.FOR_BOTH[scenario]),
    ]
    title = f"{DOCKING[scenario]}: `{scenario}`"
    figures = [*measured.values(), _with_status(beyond)]
    return Section(name=scenario.replace("_", "-"), title=title, blocks=blocks, figures=figures)


def verdicts(scenario: str, measured: Mapping[str, Figures]) -> list[str]:
    """One sentence a method beside the published figures, then one an outcome."""
    return [
        time_told(scenario, measured["dynamic"]),
        *(times_told(scenario, method, measured) for method in METHODS[1:]),
        *(came_out(one.text, one.holds(measured), one.evidence(measured)) for one in claims(scenario)),
    ]


def fastest_told(scenario: str, result: RunResult) -> str:
    """The highest speed of `dynamic` here and in the published code."""
    track = published_track(scenario, "dynamic")
    here, there = (float(np.max(np.abs(v))) for v in (result.truth.v, track.v))
    return f"`dynamic` drives at up to {here:.2f} m/s here, at up to {there:.2f} m/s in the published code."


def _with_status(outcome: DrivenCase) -> dict[str, Any]:
    return {**outcome.figures, "last_status": outcome.result.cycles.status[-1].value}


def _table(scenario: str, measured: Mapping[str, Figures], beyond: Figures) -> Table:
    rows = []
    for method, figures in measured.items():
        published = published_run(scenario, method)
        paper = {"time_to_tolerance_s": published.get("time_in_paper_s")}
        rows += [
            [f"{method}: paper", *cells(paper, COLUMNS), "–"],
            [f"{method}: published code", *cells(published, COLUMNS), "in tolerance"],
            [f"{method}: here, `paper`", *cells(figures, COLUMNS), "yes" if figures["docked"] else "no"],
        ]
    rows.append(["dynamic: here, `default`", *cells(beyond, COLUMNS), "yes" if beyond["docked"] else "no"])
    return Table(
        caption=f"{DOCKING[scenario]}. {_TABLE_SAID}",
        heads=["run", *heads(COLUMNS), "docked"],
        rows=rows,
        worded=[len(COLUMNS) + 1],
        group=len(METHODS),
    )


def _ratio_table(scenario: str, measured: Mapping[str, Figures]) -> Table:
    rows = [
        [method, *published_times(scenario, method), number(times_of(measured, method), 2)]
        for method in METHODS[1:]
    ]
    return Table(
        caption="Time to tolerance, times that of `dynamic`.",
        heads=["method", "paper", "published code", "here, preset `paper`"],
        rows=rows,
    )


def _energy_table(published: Figures, here: Figures, beyond: Figures) -> Table:
    runs = {"published code": published, "here, `paper`": here, "here, `default`": beyond}
    return Table(
        caption="Energies of `dynamic` up to T.",
        heads=["run", *heads(ENERGIES)],
        rows=[
            [name, *cells(run, [column._replace(digits=3) for column in ENERGIES])]
            for name, run in runs.items()
        ],
    )


def _pictures(scenario: str, outcomes: Sequence[DrivenCase], beyond: RunResult) -> list[Picture]:
    name, results = DOCKING[scenario], [outcome.result for outcome in outcomes]
    figures = [outcome.figures for outcome in outcomes]
    return [
        Picture(
            name=f"{scenario}_plane",
            png=draw.png(plane_figure(results, figures)),
            caption=f"{name}, preset `paper`: path of the rear axle, body each {BODY_EVERY:g} s and "
            "at the end. Thin dashed: the published code by the same method, rear axle.",
            told="Driven bodies in the corridor, a panel for each of three methods.",
        ),
        Picture(
            name=f"{scenario}_time",
            png=draw.png(time_figure(results, beyond)),
            caption=f"{name}: speed, steering and acceleration over time, preset `paper`, beside `dynamic` "
            f"also `default`. Runs are shown up to {LONGEST:g} times the published one, acceleration up to "
            f"{HIGHEST:g} m/s².",
            told="Speed, steering and acceleration over time, a column for each of three methods.",
        ),
    ]
