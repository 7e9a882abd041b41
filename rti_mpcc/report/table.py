"""The summary of a run as a table for a terminal."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import degrees
from typing import Any

from rich.markup import escape
from rich.table import Table

from rti_mpcc.simulation import GoalSource
from rti_mpcc.types import MissionResult

_NEVER = "never"
_COMFORT = (
    ("acceleration", "m/s²"),
    ("lateral_acceleration", "m/s²"),
    ("steering_rate", "rad/s"),
    ("jerk", "m/s³"),
)


def summary_table(summary: dict[str, Any]) -> Table:
    """The figures of `simulation.summary` with names and units for humans."""
    table = Table(title=f"{summary['scenario']}, method {summary['method']}, preset {summary['preset']}")
    table.add_column("", no_wrap=True)
    table.add_column("value", justify="right", no_wrap=True)
    table.add_column("unit", no_wrap=True)
    for name, value, unit in _rows(summary):
        table.add_row(name, value, "" if value == _NEVER else unit)
    return table


def plan_table(name: str, figures: dict[str, Any]) -> Table:
    """The figures of a way that was found, with names and units for humans."""
    table = Table(title=f"{name}, the way that was found")
    table.add_column("", no_wrap=True)
    table.add_column("value", justify="right", no_wrap=True)
    table.add_column("unit", no_wrap=True)
    for row in (
        ("length", _number(figures["length_m"], 2), "m"),
        ("cusps", str(figures["cusps"]), ""),
        ("smallest clearance", _number(figures["min_clearance_m"], 3), "m"),
        ("time of the search", _number(figures["seconds"], 3), "s"),
        ("poses looked at", str(figures["nodes"]), ""),
    ):
        table.add_row(*row)
    return table


def docks_table(name: str, rows: Sequence[tuple[str, ...]]) -> Table:
    """Docks, one a row, see `docks_figure.docks_rows`."""
    table = Table(title=escape(name))
    names = "kind", "x, y [m], heading [deg]", "approach [m]", "tolerance [m, m, deg]", "contact [m]"
    table.add_column("dock", overflow="fold")  # a long name takes nothing from the other columns
    for column in map(escape, names):
        table.add_column(column, no_wrap=True)
    for row in rows:
        table.add_row(*map(escape, row))
    return table


def _rows(summary: dict[str, Any]) -> list[tuple[str, str, str]]:
    error, solver = summary["final_error"], summary["solver"]
    rms, energy = summary["rms"], summary["energy"]
    peak, comfort = summary["peak"], summary["comfort"]
    return [
        ("docked", "yes" if summary["docked"] else "no", ""),
        ("time to tolerance", _number(summary["time_to_tolerance_s"], 2), "s"),
        ("time to dock", _number(summary["time_to_dock_s"], 2), "s"),
        ("time expected", _number(summary["expected_time_s"], 2) if summary["expected_time_s"] else "-", "s"),
        ("final error, longitudinal", _number(1e3 * error["longitudinal_m"], 1), "mm"),
        ("final error, lateral", _number(1e3 * error["lateral_m"], 1), "mm"),
        ("final error, heading", _number(degrees(error["heading_rad"]), 2), "deg"),
        ("smallest clearance", _number(summary["min_clearance_m"], 3), "m"),
        ("direction changes", str(summary["direction_changes"]), ""),
        ("distance", _number(summary["distance_m"], 2), "m"),
        ("largest steering", _number(summary["max_steering_rad"], 3), "rad"),
        ("rms steering", _number(rms["steering"], 3), "rad"),
        ("rms steering rate", _number(rms["steering_rate"], 3), "rad/s"),
        ("rms acceleration", _number(rms["acceleration"], 3), "m/s²"),
        ("rms lateral acceleration", _number(rms["lateral_acceleration"], 3), "m/s²"),
        ("energy steering rate", _number(energy["steering_rate"], 3), "rad²/s"),
        ("energy acceleration", _number(energy["acceleration"], 3), "m²/s³"),
        ("energy lateral acceleration", _number(energy["lateral_acceleration"], 3), "m²/s³"),
        *(
            (f"peak / comfort {name.replace('_', ' ')}", _against_comfort(peak[name], comfort[name]), unit)
            for name, unit in _COMFORT
        ),
        ("acceleration energy over the least", _ratio(summary["energy_ratio"]), ""),
        ("cycles that brake hard", _hard(summary["hard_braking"]), ""),
        ("cycle p50 / p95 / p99 / max", _spread(summary["cycle_ms"]), "ms"),
        ("feedback p50 / p95 / p99 / max", _spread(summary["feedback_ms"]), "ms"),
        ("iterations p50 / p95", _pair(solver), ""),
        ("solver failures", str(solver["failures"]), ""),
        ("cycles at the iteration limit", str(solver["iteration_limit_cycles"]), ""),
        ("fallback cycles", str(summary["fallback_cycles"]), ""),
        ("deadline misses", str(summary["deadline_misses"]), ""),
        *_planning_rows(summary.get("planning")),
        *_goal_rows(summary["goal"]),
        *mission_rows(summary.get("mission")),
    ]


def mission_rows(steps: list[dict[str, Any]] | None) -> list[tuple[str, str, str]]:
    """What the table of a run says of each step: when it was, what it came to, and the error at its end."""
    found = []
    for step in steps or []:
        end = "" if step["end_s"] is None else f"{step['end_s']:.2f}"
        told = f"{step['result']} {step['begin_s']:.2f} to {end}"
        found.append((_step_name(step), told, "s"))
        error = step["final_error"]
        if error is not None:
            along, across = 1e3 * error["longitudinal_m"], 1e3 * error["lateral_m"]
            errors = f"{along:.1f} / {across:.1f} / {degrees(error['heading_rad']):.2f}"
            found.append(("error at its end, along / across / heading", errors, "mm, deg"))
    return found


def failure_lines(steps: Sequence[Mapping[str, Any]] | None) -> list[str]:
    """Why steps failed, a line for each that did."""
    over = (MissionResult.SUCCEEDED.value, MissionResult.RUNNING.value)
    failed = [step for step in steps or [] if step["result"] not in over]
    return [
        f"{_step_name(step)}: {step['result']}" + (f": {step['reason']}" if step["reason"] else "")
        for step in failed
    ]


def _step_name(step: Mapping[str, Any]) -> str:
    again = f", try {step['attempt'] + 1}" if step["attempt"] else ""
    return f"step {step['step']}: {step['kind']}{again}"


def _planning_rows(planning: dict[str, Any] | None) -> list[tuple[str, str, str]]:
    """What a run in an area has besides."""
    if planning is None:
        return []
    cusps = "-" if planning["cusps"] is None else str(planning["cusps"])
    return [
        ("time of planning", _number(planning["seconds"], 3), "s"),
        ("planned anew", str(planning["replans"]), ""),
        ("planned way", "none" if planning["length_m"] is None else _number(planning["length_m"], 2), "m"),
        ("cusps of it", cusps, ""),
    ]


def _goal_rows(goal: dict[str, Any] | None) -> list[tuple[str, str, str]]:
    """What a run with a detector has besides; how a filter did, where there was one."""
    if goal is None:
        return []
    source = ("goal source", goal["source"], "")
    if goal["source"] != GoalSource.DETECTED.value:
        return [source]
    error = goal["estimate_error"]
    counts = " / ".join(str(goal[name]) for name in ("accepted", "rejected", "refused"))
    return [
        source,
        ("goal first seen", _number(goal["first_seen_s"], 2), "s"),
        ("detections accepted / rejected / refused", counts, ""),
        ("goal estimate, longitudinal", _scaled(error["longitudinal_m"], 1e3, 1), "mm"),
        ("goal estimate, lateral", _scaled(error["lateral_m"], 1e3, 1), "mm"),
        ("goal estimate, heading", _scaled(error["heading_rad"], degrees(1.0), 2), "deg"),
        ("mean NIS of accepted detections", _number(goal["mean_nis"], 2), ""),
        ("goal status at the end", goal["final_status"] or _NEVER, ""),
    ]


def _against_comfort(peak: float, comfort: float) -> str:
    above = "[bold red]above[/] " if round(peak, 3) > round(comfort, 3) else ""
    return f"{above}{peak:.3f} / {comfort:.3f}"


def _hard(cycles: dict[str, int]) -> str:
    told = ", ".join(f"{count} {reason}" for reason, count in cycles.items())
    return f"{sum(cycles.values())} ({told})" if told else "0"


def _ratio(value: float | None) -> str:
    return "-" if value is None else f"{value:.2f}"


def _scaled(value: float | None, factor: float, digits: int) -> str:
    return _number(None if value is None else factor * value, digits)


def _number(value: float | None, digits: int) -> str:
    return _NEVER if value is None else f"{value:.{digits}f}"


def _spread(values: dict[str, float | None]) -> str:
    return " / ".join("-" if value is None else f"{value:.1f}" for value in values.values())


def _pair(solver: dict[str, Any]) -> str:
    values = (solver["iterations_p50"], solver["iterations_p95"])
    return " / ".join("-" if value is None else f"{value:.0f}" for value in values)
