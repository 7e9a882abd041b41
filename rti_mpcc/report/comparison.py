"""Runs side by side, for terminal and JSON."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from rich.table import Table

from rti_mpcc.report.numbers import number
from rti_mpcc.report.table import figure_rows

Figures = dict[str, Any]
_SHOWN = (
    "docked",
    "time_to_tolerance_s",
    "time_to_dock_s",
    "direction_changes",
    "min_clearance_m",
    "rms",
    "energy",
)
"""Figures of `simulation.summary` in a table: those of the paper's Tables II and III, and some more."""
RATIOS = (
    "time_to_tolerance_s",
    "time_to_dock_s",
    "energy.steering_rate",
    "energy.acceleration",
    "energy.lateral_acceleration",
    "cycle_ms.p50",
)
"""Figures with a ratio of each run to the first one of its scenario."""


def compared(runs: Sequence[Figures]) -> list[Figures]:
    """The summaries with `ratios` to the first one of the same scenario; None where one of the two is."""
    first: dict[str, Figures] = {}
    found = []
    for run in runs:
        base = first.setdefault(run["scenario"], run)
        pairs = {path: (_figure(run, path), _figure(base, path)) for path in RATIOS}
        ratios = {
            path: one / other if one is not None and other else None for path, (one, other) in pairs.items()
        }
        found.append({**run, "ratios": ratios})
    return found


def comparison_tables(runs: Sequence[Figures]) -> list[Table]:
    """For each scenario its figures, and their ratios to its first run; a column a run."""
    tables = []
    for scenario in dict.fromkeys(run["scenario"] for run in runs):
        own = [run for run in compared(runs) if run["scenario"] == scenario]
        table = Table("", *(label(run).replace(" ", "\n") for run in own), "unit", title=scenario)
        for column in table.columns[1:-1]:
            column.justify, column.overflow = "right", "fold"
        rows = []
        for run in own:
            times = {name: run["cycle_ms"][name] for name in ("p50", "p95")}
            rows.append(list(figure_rows({name: run[name] for name in _SHOWN} | {"cycle_ms": times})))
        for cells in zip(*rows, strict=True):
            table.add_row(cells[0][0], *(value for _, value, _ in cells), max(unit for *_, unit in cells))
        names = [name for name, *_ in figure_rows(dict.fromkeys(RATIOS))]
        for path, name in zip(RATIOS, names if len(own) > 1 else (), strict=False):
            ratios = (number(run["ratios"][path], 2) for run in own)
            table.add_row(f"{name.replace('.', ' ')}, ratio", *ratios, "")
        tables.append(table)
    return tables


def label(run: Figures) -> str:
    """Which run it is among those of its scenario."""
    return f"{run['method']} ({run['preset']})"


def _figure(run: Figures, path: str) -> float | None:
    value: Any = run
    for name in path.split("."):
        value = value[name]
    return None if value is None else float(value)
