"""The figures of a whole campaign in words, for page and terminal."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from math import degrees
from typing import Any

from rti_mpcc.report.numbers import counted, in_words, number, percent

ERRORS = {
    "longitudinal_m": ("longitudinal", "mm", 1e3),
    "lateral_m": ("lateral", "mm", 1e3),
    "heading_rad": ("heading", "deg", degrees(1.0)),
}
ENERGIES = {
    "acceleration": "∫a² [m²/s³]",
    "steering_rate": "∫δ̇² [rad²/s]",
    "lateral_acceleration": "∫a_lat² [m²/s³]",
}
COMFORT = {
    "acceleration": "acceleration",
    "acceleration_over_gain": "acceleration, gain divided out,",
    "lateral_acceleration": "lateral acceleration",
    "steering_rate": "steering rate",
    "jerk": "jerk",
}
TAIL = ("p50", "p95", "p99", "max")
Figures = Mapping[str, Any]


def in_short(figures: Figures) -> list[str]:
    """The outcome in a few sentences."""
    low, high = figures["success_interval"]
    lost = {name: count for name, count in figures["outcomes"].items() if count and name != "docked"}
    others = ", ".join(f"{count} {in_words(name)}" for name, count in lost.items())
    turns, unknown = figures["direction_changes_beyond_cusps"], figures["collisions_unknown"]
    told = [
        f"{figures['outcomes']['docked']} of {figures['cases']} cases docked: "
        f"{percent(figures['success_rate'])} (95 % interval {percent(low)} to {percent(high)})"
        + (f"; {others}." if others else "."),
        counted(figures["collisions"], "collision")
        + (f" (of {counted(unknown, 'case')} it is not known)" if unknown else "")
        + f"; least clearance {number(figures['min_clearance_m'], 3)} m, 5 % of the cases have less than "
        f"{number(figures['clearance_p5_m'], 3)} m.",
        f"Time to dock {number(figures['time_to_dock_p50'], 2)} s in the median, "
        f"{number(figures['time_to_dock_p95'], 2)} s at p95.",
        f"Peak acceleration over comfort {_tail(figures['comfort']['acceleration'])}, acceleration energy "
        f"over the least {_tail(figures['energy_ratio'])}, time to dock over the one expected "
        f"{_tail(figures['time_ratio'])} (p50, p95, p99).",
        f"Refused QPs: {_in_cases(figures['solver_failures'], figures['solver_failure_cases'])}, of which "
        f"{figures['failures_driven']} were driven all the same. Fallback: "
        f"{_in_cases(figures['fallback_cycles'], figures['fallback_cases'])}. Changes of direction beyond "
        f"the cusps: {turns['total']}, in {counted(turns['cases'], 'case')}.",
    ]
    return [*_not_whole(figures), *told, *_planned(figures)]


def _planned(figures: Figures) -> list[str]:
    """How ways were planned, where they were."""
    planning = figures["planning"]
    if planning is None:
        return []
    seconds, replans = planning["seconds"], planning["replans"]
    return [
        f"Planning took {number(seconds['p50'], 2)} s in the median of the cases, "
        f"{number(seconds['max'], 2)} s at most. "
        f"Ways beyond the first: {replans['total']}, in {counted(replans['cases'], 'case')}."
    ]


def _tail(values: Figures) -> str:
    return ", ".join(number(values[name], 2) for name in TAIL[:3])


def _in_cases(cycles: int, cases: int) -> str:
    return f"{counted(cycles, 'cycle')} in {counted(cases, 'case')}"


def _not_whole(figures: Figures) -> list[str]:
    told = []
    if not figures["finished"]:
        told.append(
            f"The campaign is not finished: {figures['cases']} of {figures['cases_asked']} cases are driven. "
            "All that follows is of these."
        )
    if figures["torn_line"]:
        told.append("The last line of rows.jsonl is not whole and left out.")
    if figures["repeated_lines"]:
        told.append(
            f"Left out because their case was there already: {counted(figures['repeated_lines'], 'line')}."
        )
    return told


def overall_rows(figures: Figures) -> list[tuple[str, str]]:
    """Names and values of the figures, for a table."""
    rate, low, high = map(percent, (figures["success_rate"], *figures["success_interval"]))
    times = {
        "time to tolerance p50 / p95 / largest [s]": "time_to_tolerance",
        "time to dock p50 / p95 / largest [s]": "time_to_dock",
        "time over its yardstick p50 / p95 / largest": "time_over_yardstick",
    }
    errors, energies = figures["final_error"], figures["energy_to_dock"]
    turns = figures["direction_changes_beyond_cusps"]
    return [
        ("cases", str(figures["cases"])),
        ("docked, 95 % interval", f"{rate} ({low} to {high})"),
        ("collisions", str(figures["collisions"])),
        (
            "least clearance / p5 / median [m]",
            several(figures, ("min_clearance_m", "clearance_p5_m", "clearance_p50_m"), 3),
        ),
        *(
            (words, several(figures, [f"{name}_{end}" for end in ("p50", "p95", "max")], 2))
            for words, name in times.items()
        ),
        *(
            (
                f"final error, {words} p50 / p95 / largest [{unit}]",
                several(errors[name], ("p50", "p95", "max"), 2, factor),
            )
            for name, (words, unit, factor) in ERRORS.items()
        ),
        *(
            (
                f"peak {words} over comfort p50 / p95 / p99 / largest",
                several(figures["comfort"][name], TAIL, 2),
            )
            for name, words in COMFORT.items()
        ),
        (
            "acceleration energy over the least p50 / p95 / p99 / largest",
            several(figures["energy_ratio"], TAIL, 2),
        ),
        (
            "time to dock over the one expected p50 / p95 / p99 / largest",
            several(figures["time_ratio"], TAIL, 2),
        ),
        ("cycles that braked harder than 1.1 times comfort", str(sum(figures["hard_braking"].values()))),
        ("cycles at the iteration limit", str(figures["iteration_limit_cycles"])),
        (
            "solver failures, cycles / cases",
            f"{figures['solver_failures']} / {figures['solver_failure_cases']}",
        ),
        ("refused results that were driven", str(figures["failures_driven"])),
        ("fallback cycles / cases", f"{figures['fallback_cycles']} / {figures['fallback_cases']}"),
        ("changes of direction beyond the cusps / cases", f"{turns['total']} / {turns['cases']}"),
        *(
            (f"energy to dock {sign} p50 / p95", several(energies[name], ("p50", "p95"), 2))
            for name, sign in ENERGIES.items()
        ),
        *_planning_rows(figures),
        *_computing_rows(figures),
    ]


def _planning_rows(figures: Figures) -> list[tuple[str, str]]:
    planning = figures["planning"]
    if planning is None:
        return []
    replans = planning["replans"]
    return [
        ("planning in all, p50 / p95 / largest [s]", several(planning["seconds"], ("p50", "p95", "max"), 2)),
        (
            "length of the first way p50 / p95 / largest [m]",
            several(planning["length_m"], ("p50", "p95", "max"), 1),
        ),
        ("cusps of the first way p50 / p95 / largest", several(planning["cusps"], ("p50", "p95", "max"), 0)),
        (
            "further ways / cases / most",
            f"{replans['total']} / {replans['cases']} / {number(replans['max'], 0)}",
        ),
    ]


def _computing_rows(figures: Figures) -> list[tuple[str, str]]:
    if figures["cycle_ms"] is None:
        return []
    misses = f"{figures['deadline_misses']} / {figures['deadline_miss_cases']}"
    return [
        (
            "cycle p50 / p99 of the median case / largest [ms]",
            several(figures["cycle_ms"], ("p50", "p99", "max"), 1),
        ),
        ("missed deadlines, cycles / cases", misses),
    ]


def several(figures: Figures, names: Iterable[str], digits: int, factor: float = 1.0) -> str:
    """Some of the figures behind one another, each times the factor."""
    values = (figures[name] for name in names)
    return " / ".join(number(None if value is None else factor * value, digits) for value in values)
