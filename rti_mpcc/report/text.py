"""Numbers, tables and lines that people read, and a command's output on the terminal."""

from __future__ import annotations

import logging
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from math import degrees
from pathlib import Path
from textwrap import shorten
from typing import Any

from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.table import Column, Table

from rti_mpcc.recording import ReplayReport
from rti_mpcc.simulation.docks_file import Docks
from rti_mpcc.types import MissionResult

Advance = Callable[[float, float], None]  # called with the work done and all of it
SHOWN, LONGEST = 12, 200
"""Largest number of fields of a replay's difference that are shown, and of characters of a value."""
Row = tuple[str, str, str]  # name, value, unit
Figures = dict[str, Any]
_DIRECTIONS = {1: "forward", -1: "in reverse"}
_APART = ("scenario", "method", "preset", "mission", "comfort", "energy_to_dock", "recording", "statuses")
"""Figures of a ride that have no row of their own in the table."""
_ENDINGS = {"_s": ("s", 1.0, 2), "_m": ("m", 1.0, 3), "_rad": ("rad", 1.0, 3), "seconds": ("s", 1.0, 3)}
_ERRORS = {"_m": ("mm", 1e3, 1), "_rad": ("deg", degrees(1.0), 2)}
"""Unit, factor and digits by the end of a name, and below a name that holds errors."""
_PERCENTILES = ("p50", "p95", "p99", "max")
_UNITS = {
    "steering": "rad",
    "steering_rate": "rad/s",
    "acceleration": "m/s²",
    "lateral_acceleration": "m/s²",
    "jerk": "m/s³",
}
_SQUARED = {"steering_rate": "rad²/s", "acceleration": "m²/s³", "lateral_acceleration": "m²/s³"}

RATIOS = (
    "time_to_tolerance_s",
    "time_to_dock_s",
    "energy.steering_rate",
    "energy.acceleration",
    "energy.lateral_acceleration",
    "cycle_ms.p50",
)
"""Figures with a ratio of each run to the first one of its scenario."""
_COMPARED = ("docked", *RATIOS[:2], "direction_changes", "min_clearance_m", "rms", "energy")
"""Figures of several runs side by side: those of the paper's Tables II and III, and some more."""


def number(value: float | None, digits: int) -> str:
    """A number for a table; what was never reached is a dash, what rounds to zero has no sign."""
    return "–" if value is None or value != value else f"{value:z.{digits}f}".replace("-", "−")


def percent(share: float) -> str:
    """A share in percent; nothing but the whole is rounded to 100 %, nothing but none to 0."""
    told = number(100.0 * share, 2)
    if share < 1.0 and told == "100.00":
        return "99.99 %"
    return "0.01 %" if share > 0.0 and told == "0.00" else f"{told} %"


def in_words(name: str) -> str:
    """A name of the program for people."""
    return name.replace("_", " ")


@contextmanager
def progress_bar(name: str, done: str) -> Iterator[Advance | None]:
    """On a terminal a bar, told by (done, in all), with `done` as its text; None elsewhere."""
    console = Console(stderr=True)
    if not console.is_terminal:
        yield None
        return
    columns = TextColumn(name), BarColumn(), TextColumn(done), TimeElapsedColumn(), TimeRemainingColumn()
    with Progress(*columns, console=console, transient=True, refresh_per_second=4) as bar:
        task = bar.add_task("", total=None)
        yield lambda completed, total: bar.update(task, completed=completed, total=total)


def print_tables(tables: Sequence[Table]) -> None:
    """Print tables. Piped into a file they are 120 columns wide: the usual guess of 80 would cut them."""
    console = Console(highlight=False, width=None if sys.stdout.isatty() else 120)
    for table in tables:
        console.print(table)


def print_lines(lines: Sequence[str]) -> None:
    """Print sentences as they are; what is code in a page has no backticks here."""
    console = Console(highlight=False)
    for line in lines:
        console.print(line.replace("`", ""), markup=False, soft_wrap=True)


def print_written(files: Sequence[Path]) -> None:
    """Print which files were written."""
    print_lines([f"written: {', '.join(map(str, files))}"])


@contextmanager
def warnings_on_stderr(program: str) -> Iterator[None]:
    """Show the package's log from warnings up while a command runs."""
    handler = logging.StreamHandler(sys.stderr)
    handler.setLevel(logging.WARNING)
    handler.setFormatter(logging.Formatter(f"{program}: warning: %(message)s"))
    # The controller tells again what the check of the file has told with the file's name.
    handler.addFilter(lambda record: record.name != "rti_mpcc.world.surroundings")
    logger = logging.getLogger("rti_mpcc")
    logger.addHandler(handler)
    try:
        yield
    finally:
        logger.removeHandler(handler)


def summary_table(summary: Mapping[str, Any]) -> Table:
    """The figures of `simulation.summary`, each with its unit."""
    title = "{scenario}, method {method}, preset {preset}".format_map(summary)
    return _table(title, [*_ride_rows(summary), *mission_rows(summary.get("mission"))])


def recorded_table(summary: Mapping[str, Any]) -> Table:
    """The figures of `report.recorded.recorded_summary`, each with its unit."""
    spent = ((f"time {status}", number(seconds, 2), "s") for status, seconds in summary["statuses"].items())
    return _table(str(summary["recording"]), [*_ride_rows(summary), *spent])


def _ride_rows(summary: Mapping[str, Any]) -> Iterator[Row]:
    comfort, hard = summary["comfort"], summary["hard_braking"]
    figures = {name: value for name, value in summary.items() if name not in _APART}
    figures["hard_braking"] = ", ".join(f"{count} {reason}" for reason, count in hard.items()) or "none"
    peaks = figures.pop("peak").items()
    figures["peak"] = {name: _against(value, comfort[name]) for name, value in peaks}
    return figure_rows(figures)


def plan_table(name: str, figures: Mapping[str, Any]) -> Table:
    """The figures of a route that was found, each with its unit."""
    return _table(f"{name}, planned route", figure_rows(figures))


def docks_table(name: str, docks: Docks) -> Table:
    """Docks, one a row: kind, pose, approach, tolerance, contact move."""
    # A long name is folded: it takes nothing from the other columns.
    table = Table(Column("dock", overflow="fold"), title=escape(name))
    for head in ("kind", "x, y [m], heading [deg]", "approach [m]", "tolerance [m, m, deg]", "contact [m]"):
        table.add_column(escape(head), no_wrap=True)
    for dock in docks.docks.values():
        pose, approach, contact, most = dock.pose, dock.approach, dock.contact, dock.tolerance
        assert pose is not None
        assert dock.kind is not None
        table.add_row(
            escape(dock.name),
            dock.kind.value,
            f"{pose.x:.2f}, {pose.y:.2f}, {degrees(pose.phi):.1f}",
            "-" if approach is None else f"{approach.length:g} {_DIRECTIONS[approach.direction]}",
            "-" if most is None else f"{most[0]:g}, {most[1]:g}, {degrees(most[2]):.2f}",
            "-" if contact is None else f"{contact.distance:g}",
        )
    return table


def figure_rows(figures: Mapping[str, Any], above: str = "") -> Iterator[Row]:
    """A row for each figure, percentiles in one row; `above`: name that the figures belong to.

    A figure that was never reached or measured is a dash.
    """
    for key, value in figures.items():
        if not isinstance(value, Mapping):
            yield _row(key, value, above)
            continue
        spread = {name: each for name, each in value.items() if name.endswith(_PERCENTILES)}
        if spread:
            heads = " / ".join(name.rpartition("_")[2] for name in spread)
            counted = "" if key.endswith("_ms") else "iterations "
            told = " / ".join(number(each, 1) for each in spread.values())
            yield f"{key.removesuffix('_ms')} {counted}{heads}", told, "" if counted else "ms"
        others = {name: each for name, each in value.items() if name not in spread}
        yield from figure_rows(others, f"{above} {key}")


def _row(key: str, value: Any, above: str) -> Row:
    endings = _ERRORS if "error" in above else _ENDINGS
    ending = next((each for each in endings if key.endswith(each)), "")
    unit, factor, digits = endings.get(ending, ("", 1.0, 3))
    units = _SQUARED if "energy" in above else _UNITS
    name = in_words(f"{above} {key.removesuffix(ending) if ending.startswith('_') else key}".strip())
    if isinstance(value, bool):
        return name, "yes" if value else "no", ""
    if isinstance(value, float):
        return name, number(factor * value, digits), unit or units.get(key, "")
    told = number(None, 0) if value is None else str(value)
    return name, told, units.get(key, "") if "peak" in above else ""


def mission_rows(steps: Sequence[Mapping[str, Any]] | None) -> Iterator[Row]:
    """Of each step: its result and times, and the error at its end."""
    for step in steps or []:
        end = "" if step["end_s"] is None else f"{step['end_s']:.2f}"
        yield _step_name(step), f"{step['result']} {step['begin_s']:.2f} to {end}", "s"
        if step["final_error"] is not None:
            told = " / ".join(value for _, value, _ in figure_rows(step["final_error"], "error"))
            yield "error at its end, along / across / heading", told, "mm, deg"


def failure_lines(steps: Sequence[Mapping[str, Any]] | None) -> list[str]:
    """Why steps failed, a line for each that did."""
    over = (MissionResult.SUCCEEDED.value, MissionResult.RUNNING.value)
    return [
        f"{_step_name(step)}: {step['result']}" + (f": {step['reason']}" if step["reason"] else "")
        for step in steps or []
        if step["result"] not in over
    ]


def replay_lines(report: ReplayReport) -> list[str]:
    """One line if the replay is identical; otherwise the first difference: cycle, time and fields."""
    how = "bit for bit" if report.tolerance == 0.0 else f"within {report.tolerance:g}"
    where = "the same machine and versions" if report.same_machine else "another machine or other versions"
    whole = "" if report.complete else "; the recording is truncated"
    compared, mismatch = f"{report.cycles} cycles compared {how}, on {where}{whole}", report.mismatch
    if mismatch is None:
        return [f"identical: {compared}"]
    place = f"cycle {mismatch.cycle} at {mismatch.time:.3f} s"
    lines = [f"different: {place}" + (f": {mismatch.changed}" if mismatch.changed else "")]
    for field in mismatch.fields[:SHOWN]:
        one, other = field.recorded, field.replayed
        size = ""
        if isinstance(one, int | float) and isinstance(other, int | float):
            size = f", difference {abs(other - one):.3g}"
        recorded, replayed = (shorten(repr(value), LONGEST) for value in (one, other))
        lines.append(f"  {field.field}: recorded {recorded}, replayed {replayed}{size}")
    if not mismatch.fields:
        lines.append("  all compared fields are equal")
    if len(mismatch.fields) > SHOWN:
        lines.append(f"  and {len(mismatch.fields) - SHOWN} more fields")
    return [*lines, compared]


def figure(figures: Mapping[str, Any], path: str) -> float | None:
    """The figure at a path in a summary, such as "energy.acceleration"; None where there is none."""
    found: Any = figures
    for name in path.split("."):
        found = (found or {}).get(name)
    return None if found is None else float(found)


def compared(runs: Sequence[Figures]) -> list[Figures]:
    """The summaries with `ratios` to the first one of the same scenario; None where one of the two is."""
    first: dict[str, Figures] = {}
    found = []
    for run in runs:
        base = first.setdefault(run["scenario"], run)
        ratios: dict[str, float | None] = {}
        for path in RATIOS:
            one, other = figure(run, path), figure(base, path)
            ratios[path] = one / other if one is not None and other else None
        found.append({**run, "ratios": ratios})
    return found


def comparison_tables(runs: Sequence[Figures]) -> list[Table]:
    """For each scenario the figures of `compared` runs and their ratios to its first run; a column a run."""
    tables = []
    for scenario in dict.fromkeys(run["scenario"] for run in runs):
        own = [run for run in runs if run["scenario"] == scenario]
        table = Table("", *(run_label(run).replace(" ", "\n") for run in own), "unit", title=scenario)
        for column in table.columns[1:-1]:
            column.justify, column.overflow = "right", "fold"
        rows = []
        for run in own:
            times = {name: run["cycle_ms"][name] for name in ("p50", "p95")}
            rows.append(list(figure_rows({name: run[name] for name in _COMPARED} | {"cycle_ms": times})))
        for cells in zip(*rows, strict=True):
            table.add_row(cells[0][0], *(value for _, value, _ in cells), max(unit for *_, unit in cells))
        names = [name for name, *_ in figure_rows(dict.fromkeys(RATIOS))]
        for path, name in zip(RATIOS, names if len(own) > 1 else (), strict=False):
            ratios = (number(run["ratios"][path], 2) for run in own)
            table.add_row(f"{name.replace('.', ' ')}, ratio", *ratios, "")
        tables.append(table)
    return tables


def run_label(run: Figures) -> str:
    """Method and preset of a run."""
    return f"{run['method']} ({run['preset']})"


def _step_name(step: Mapping[str, Any]) -> str:
    again = f", try {step['attempt'] + 1}" if step["attempt"] else ""
    return f"step {step['step']}: {step['kind']}{again}"


def _against(peak: float, comfort: float) -> str:
    if round(peak, 3) > round(comfort, 3):
        return f"[bold red]{peak:.3f}[/] (limit {comfort:.3f} exceeded)"
    return f"{peak:.3f} (limit {comfort:.3f})"


def _table(title: str, rows: Iterable[Row]) -> Table:
    value = Column("value", justify="right", no_wrap=True)
    table = Table(Column(no_wrap=True), value, Column("unit", no_wrap=True), title=title)
    for row in rows:
        table.add_row(*row)
    return table
