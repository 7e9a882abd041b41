"""Runs side by side: the figures of the paper's Tables II and III, and some more, for terminal and JSON."""

from __future__ import annotations

from collections.abc import Sequence
from functools import reduce
from operator import getitem
from typing import Any, NamedTuple

from rich.table import Table
from rich.text import Text

from rti_mpcc.report.numbers import number

Figures = dict[str, Any]


class Column(NamedTuple):
    """A figure of `simulation.summary`, by its path in it, with its head and digits."""

    head: str
    path: tuple[str, ...]
    digits: int


PAPER = (
    Column("T [s]", ("time_to_tolerance_s",), 2),
    Column("reversals", ("direction_changes",), 0),
    Column("rms δ [rad]", ("rms", "steering"), 3),
    Column("rms δ̇ [rad/s]", ("rms", "steering_rate"), 3),
    Column("rms a [m/s²]", ("rms", "acceleration"), 3),
    Column("rms a_lat [m/s²]", ("rms", "lateral_acceleration"), 3),
)
"""In the order of the paper's tables."""
BEYOND = (
    Column("dock [s]", ("time_to_dock_s",), 2),
    Column("clearance [m]", ("min_clearance_m",), 2),
    Column("∫δ̇² [rad²/s]", ("energy", "steering_rate"), 3),
    Column("∫a² [m²/s³]", ("energy", "acceleration"), 3),
    Column("∫a_lat² [m²/s³]", ("energy", "lateral_acceleration"), 3),
    Column("cycle p50 [ms]", ("cycle_ms", "p50"), 1),
    Column("p95 [ms]", ("cycle_ms", "p95"), 1),
)
RATIOS = (
    Column("T", ("time_to_tolerance_s",), 2),
    Column("dock", ("time_to_dock_s",), 2),
    Column("∫δ̇²", ("energy", "steering_rate"), 2),
    Column("∫a²", ("energy", "acceleration"), 2),
    Column("∫a_lat²", ("energy", "lateral_acceleration"), 2),
    Column("cycle p50", ("cycle_ms", "p50"), 2),
)
"""Of each run to the first one of its scenario."""


def compared(runs: Sequence[Figures]) -> list[Figures]:
    """The summaries with `ratios` to the first one of the same scenario; None where one of the two is."""
    first: dict[str, Figures] = {}
    found = []
    for run in runs:
        base = first.setdefault(run["scenario"], run)
        ratios = {".".join(column.path): _ratio(run, base, column.path) for column in RATIOS}
        found.append({**run, "ratios": ratios})
    return found


def comparison_tables(runs: Sequence[Figures]) -> list[Table]:
    """For each scenario the paper's figures, further ones, and the ratios to its first run."""
    tables = []
    for scenario in dict.fromkeys(run["scenario"] for run in runs):
        own = [run for run in compared(runs) if run["scenario"] == scenario]
        tables.append(_measured(scenario, PAPER, own, told=True))
        tables.append(_measured(f"{scenario}, further figures", BEYOND, own))
        if len(own) > 1:
            tables.append(_against(label(own[0]), own[1:]))
    return tables


def label(run: Figures) -> str:
    """Which run it is among those of its scenario."""
    return f"{run['method']} ({run['preset']})"


def figure(run: Figures, path: tuple[str, ...]) -> float | None:
    """A figure by its path in the summary."""
    value: Any = reduce(getitem, path, run)
    return None if value is None else float(value)


def _measured(title: str, columns: Sequence[Column], runs: Sequence[Figures], *, told: bool = False) -> Table:
    """`told`: which did not dock is said."""
    table = _table(title, [column.head for column in columns])
    for run in runs:
        cells = [number(figure(run, column.path), column.digits) for column in columns]
        table.add_row(label(run) + (", not docked" if told and not run["docked"] else ""), *cells)
    return table


def _against(base: str, runs: Sequence[Figures]) -> Table:
    table = _table(f"{runs[0]['scenario']}, times that of {base}", [column.head for column in RATIOS])
    for run in runs:
        ratios = [run["ratios"][".".join(column.path)] for column in RATIOS]
        table.add_row(label(run), *(number(ratio, 2) for ratio in ratios))
    return table


def _table(title: str, heads: Sequence[str]) -> Table:
    table = Table(title=title, title_justify="left")
    table.add_column("method (preset)", overflow="fold")
    for head in heads:
        # As text: in a string rich takes [s] for a style and swallows it. Word below word it is narrow.
        table.add_column(Text(head.replace(" ", "\n")), justify="right", no_wrap=True)
    return table


def _ratio(run: Figures, base: Figures, path: tuple[str, ...]) -> float | None:
    one, other = figure(run, path), figure(base, path)
    return one / other if one is not None and other else None
