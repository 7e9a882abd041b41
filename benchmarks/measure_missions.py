"""Drives whole missions, and writes the tables of docs/missions.md.

    python -m benchmarks.measure_missions [--count 100] [--undockings 50] [--seeds 20] [--seed 777] [--jobs K]

The built-in mission at several seeds, random missions (`benchmarks.problems.missions`) and undockings.
Needs OpenCV: pip install '.[sim,vision]' in rti-mpcc's folder.
"""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Sequence
from math import degrees
from typing import Any

import numpy as np

from benchmarks.problems.missions import drawn_mission, drawn_undocking
from benchmarks.tables import ROOT, command_line, number, origin, replace_block, table, told
from rti_mpcc.report.text import progress_bar
from rti_mpcc.simulation import load_scenario
from rti_mpcc.simulation.batch import Case, DrivenCase, drive_all

COMMAND = "python -m benchmarks.measure_missions"
PAGE = ROOT / "docs" / "missions.md"
_NO_CASES = ["-"] * 9


def main() -> None:
    parser = command_line(__doc__, COMMAND)
    parser.add_argument(
        "--count", type=int, default=100, help="number of random missions; default: %(default)s"
    )
    parser.add_argument(
        "--undockings", type=int, default=50, help="number of random undockings; default: %(default)s"
    )
    parser.add_argument(
        "--seeds", type=int, default=20, help="number of seeds of the built-in mission; default: %(default)s"
    )
    parser.add_argument("--seed", type=int, default=777, help="random seed; default: %(default)s")
    parser.add_argument("--jobs", type=int, help="number of runs at a time; default: one a core")
    options = parser.parse_args()
    source = origin(command(options))  # first: the commit may change while it runs
    built_in = [Case(scenario=load_scenario("docking_mission"), seed=seed) for seed in range(options.seeds)]
    drawn = [drawn_mission(options.seed, number) for number in range(options.count)]
    missions = [Case(scenario=each.scenario, seed=number) for number, each in enumerate(drawn)]
    out = [Case(scenario=drawn_undocking(options.seed, number)) for number in range(options.undockings)]
    with progress_bar("missions", "{task.completed:.0f} runs") as progress:
        driven = drive_all([*built_in, *missions, *out], jobs=options.jobs, progress=progress)
    first, last = len(built_in), len(built_in) + len(missions)
    rows = [row("docking_mission", driven[:first]), row("random missions", driven[first:last])]
    rows.append(row("random undockings", driven[last:]))
    wrong = [
        f"{outcome.case.scenario.name}: {outcome.figures['mission_result']}, expected {each.expected.value}"
        for outcome, each in zip(driven[first:last], drawn, strict=True)
        if outcome.figures["mission_result"] != each.expected.value
    ]
    header = [
        "missions", "succeeded; other results", "touched something", "least clearance [m]", "T_goal [s]",
        "at contact: across [mm], heading [°]",
        "peak over comfort, p99 (max): acceleration; lateral acceleration; steering rate",
        "direction changes", "duration [s]",
    ]  # fmt: skip
    text = "\n\n".join(
        [
            table(header, rows),
            f"{len(drawn) - len(wrong)} of {len(drawn)} random missions had the expected result"
            + (f"; others: {'; '.join(wrong)}." if wrong else "."),
            told(source),
        ]
    )
    print(text)
    replace_block(PAGE, "missions", text)


def command(options: argparse.Namespace) -> str:
    """The command with all options that determine the random cases."""
    drawn = ("seed", "seeds", "count", "undockings")
    return " ".join([COMMAND, *(f"--{name} {getattr(options, name)}" for name in drawn)])


def row(name: str, outcomes: Sequence[DrivenCase]) -> list[str]:
    """The figures of some missions."""
    figures = [outcome.figures for outcome in outcomes]
    if not figures:
        return [name, *_NO_CASES[1:]]
    results = Counter(each["mission_result"] for each in figures)
    succeeded = results.pop("SUCCEEDED", 0)
    others = ", ".join(f"{count} {result}" for result, count in results.items())
    clear = [each["min_clearance_m"] for each in figures if each["min_clearance_m"] is not None]
    return [
        name,
        f"{succeeded} of {len(figures)}" + (f"; {others}" if others else ""),
        str(sum(each < 0.0 for each in clear)),
        number(min(clear), 3) if clear else "-",
        spread([each["time_to_tolerance_s"] for each in figures if each["time_to_tolerance_s"]], 1),
        contacts(figures),
        "; ".join(peaks(figures, key) for key in ("acceleration", "lateral_acceleration", "steering_rate")),
        spread([each["direction_changes"] for each in figures], 0),
        spread([each["duration_s"] for each in figures], 0),
    ]


def contacts(figures: Sequence[dict[str, Any]]) -> str:
    """Largest errors across and in heading at the ends of all contact moves."""
    errors = [
        step["final_error"]
        for each in figures
        for step in each["mission"]
        if step["kind"] == "straight" and step["result"] == "SUCCEEDED"
    ]
    if not errors:
        return "-"
    across = max(abs(error["lateral_m"]) for error in errors)
    heading = max(abs(error["heading_rad"]) for error in errors)
    return f"{number(1e3 * across, 1)}, {number(degrees(heading), 2)}"


def peaks(figures: Sequence[dict[str, Any]], key: str) -> str:
    """p99 (max) of a peak over its comfort value, up to docking."""
    shares = [each["peak"][key] / each["comfort"][key] for each in figures]
    if not any(shares):  # out of a dock nothing is driven up to it
        return "-"
    return f"{number(float(np.percentile(shares, 99)), 2)} ({number(max(shares), 2)})"


def spread(values: Sequence[float], digits: int) -> str:
    """Median (max)."""
    return f"{number(float(np.median(values)), digits)} ({number(max(values), digits)})" if values else "-"


if __name__ == "__main__":
    main()
