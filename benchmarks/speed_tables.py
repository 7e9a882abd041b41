"""The tables and the picture of docs/performance.md, and the same figures for JSON."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.ticker import NullLocator

from benchmarks.figures import Distribution, distribution, distribution_row, ratio_row
from benchmarks.ledger import KINDS
from benchmarks.measured import Measured
from benchmarks.sweeps import Variant, series
from benchmarks.tables import number, table
from benchmarks.workload import later, solving
from rti_mpcc.report.draw import BLACK, BLUE, DPI, GREY, ORANGE

PERCENTILES = ["p50", "p95", "p99", "max", "count"]
RATIOS = ["p50 / yardstick", "p95 / yardstick", "p99 / yardstick"]
FIRST_ROUND = ", first round"
"""End of the names of times that the table leaves out."""
PANELS = (
    ("stages", "stages N", "log"),
    ("path length", "length of the path [m]", "log"),
    ("boundary points", "points of the boundaries", "log"),
)
TICKS = (0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0)
STAGES_COMPARED = 70
"""Where the line begins to which growth with N is compared."""


def blocks(found: Measured) -> dict[str, str]:
    """Name of a table of docs/performance.md -> its text, but for the targets."""
    return {"cycles": _cycles(found), "phases": _phases(found), "ledger": _ledger(found)}


def timed_rows(found: Measured) -> dict[str, Distribution]:
    """Times of cycles [ms] by name: first what is judged, then parts of it."""
    rounds, warm_up = found.rounds, found.warm_up
    times = {
        "cycle": later(rounds)["step_ms"],
        "cycle in which a QP is solved": solving(rounds)["step_ms"],
        "preparation": solving(rounds)["prepare_ms"],
        "feedback phase": solving(rounds)["feedback_ms"],
        "of it the QPs' solve": solving(rounds)["solve_ms"],
        "first cycle of a drive": rounds.loc[[0], "step_ms"],
        f"cycle{FIRST_ROUND}": later(warm_up)["step_ms"],
        f"first cycle of a drive{FIRST_ROUND}": warm_up.loc[[0], "step_ms"],
    }
    return {name: distribution(each) for name, each in times.items()}


def phase_rows(found: Measured) -> dict[str, Distribution]:
    """Exclusive times of the phases [ms], all cycles but the first of each drive."""
    return {str(name): distribution(times) for name, times in later(found.phases).items()}


def ledger_rows(found: Measured) -> dict[str, dict[str, Distribution]]:
    """Kind of QP -> errors and iterations."""
    entries = referenced(found.entries)
    groups = {kind: entries[entries["kind"] == kind] for kind in KINDS} | {"all": entries}
    names = ("acceleration", "steering_rate", "cost", "iterations")
    return {
        kind: {name: distribution(group[name]) for name in names}
        for kind, group in groups.items()
        if len(group)
    }


def referenced(entries: pd.DataFrame) -> pd.DataFrame:
    """Those whose QP could be solved to the tolerance of the references."""
    return entries.dropna(subset="acceleration")


def _cycles(found: Measured) -> str:
    yardstick = found.yardstick.p50
    timed = timed_rows(found)
    rows = [ratio_row(name, one, yardstick) for name, one in timed.items() if not name.endswith(FIRST_ROUND)]
    iterations = distribution_row("solvers' iterations", distribution(solving(found.rounds)["iterations"]), 0)
    return table(["time [ms]", *PERCENTILES, *RATIOS], [*rows, [*iterations, "–", "–", "–"]])


def _phases(found: Measured) -> str:
    rows = phase_rows(found)
    plain = distribution(later(found.rounds)["step_ms"]).p50
    lines = []
    for name, one in rows.items():
        times = [number(value, 3) for value in (one.p50, one.p95, one.max)]
        lines.append([name, *times, number(one.p50 / found.yardstick.p50, 2)])
    return (
        f"{table(['exclusive time [ms]', 'p50', 'p95', 'max', 'p50 / yardstick'], lines)}\n\n"
        f"With the stop watches p50 of a cycle is {number(rows['total'].p50 / plain, 2)} times that without."
    )


def _ledger(found: Measured) -> str:
    header = ["QPs", "number", "a p50 [m/s²]", "p95", "max", "δ̇ p50 [rad/s]", "p95", "max"]
    header += ["cost p50", "p95", "iterations p50", "p95", "max"]
    rows = []
    for kind, found_here in ledger_rows(found).items():
        a, rate = found_here["acceleration"], found_here["steering_rate"]
        cost, iterations = found_here["cost"], found_here["iterations"]
        controls = [number(value, 4) for one in (a, rate) for value in (one.p50, one.p95, one.max)]
        steps = [number(value, 0) for value in (iterations.p50, iterations.p95, iterations.max)]
        rows.append([kind, str(a.count), *controls, f"{cost.p50:.1e}", f"{cost.p95:.1e}", *steps])
    spread = found.entries["spread"].dropna()
    without = len(found.entries) - len(referenced(found.entries))
    return (
        f"{table(header, rows)}\n\nOn {spread.size} of them OSQP was asked for 1e-9 too: its first "
        f"controls are within {spread.max():.1e} (m/s² or rad/s) of PIQP's. Left out, as neither "
        f"solved them to 1e-9: {without} QPs."
    )


def numbers(found: Measured) -> dict[str, Any]:
    """All figures for JSON, times in ms unless the name says otherwise."""
    return {
        "yardstick": {
            "p50_ms": found.yardstick.p50,
            "steadiness_ms": found.yardstick.steadiness,
            "solve_ms": asdict(distribution(np.concatenate(found.yardstick.solve_ms))),
            "setup_ms": asdict(distribution(np.concatenate(found.yardstick.setup_ms))),
            "osqp_default_solve_ms": asdict(distribution(found.yardstick.osqp_solve_ms)),
            "osqp_default_iterations": asdict(distribution(found.yardstick.osqp_iterations)),
            "sweeps_p50_ms": found.sweep_yardstick.p50,
        },
        "workload": {drive.name: len(drive.cycles) for drive in found.drives},
        "cycles_ms": {name: asdict(one) for name, one in timed_rows(found).items()},
        "iterations": asdict(distribution(solving(found.rounds)["iterations"])),
        "phases_ms": {name: asdict(one) for name, one in phase_rows(found).items()},
        "solver": {
            "feedback_phases": found.counts.feedback_phases,
            "matrix_updates": found.counts.matrix_updates,
            "matrix_updates_after_measurement": found.counts.late_matrix_updates,
            "interior_points": found.counts.interior_points,
        },
        "ledger": {
            kind: {name: asdict(one) for name, one in row.items()} for kind, row in ledger_rows(found).items()
        },
        "qps_without_a_reference": len(found.entries) - len(referenced(found.entries)),
        "reference_spread": float(found.entries["spread"].max()),
        "closed_loop": found.loops,
        "sweeps": [
            {
                "series": row.series,
                "size": row.size,
                "p50_ms": row.found.p50,
                "p95_ms": row.found.p95,
                "iterations_p50": row.iterations_p50,
            }
            for row in found.sweeps
        ],
        "import": found.imported,
        "standing": {str(length): one for length, one in found.standing.items()},
    }


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
