"""Runs the random courses of a seed and writes docs/courses.md and docs/courses/*.json.

    OMP_NUM_THREADS=1 python -m benchmarks.measure_courses [--seed 1] [--count 24] [--presets default paper]

With `--within campaign` they are drawn from the wider range of campaigns.
With `--save DIR` it writes the courses as scenario files instead, for `rti-mpcc run DIR/course_1_00.toml`;
with `--only 3 7` it runs these and writes nothing. The runs are deterministic but for their computing times.
"""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Sequence
from math import degrees, inf
from pathlib import Path
from statistics import median
from typing import Any

from benchmarks.problems.courses import CAMPAIGN, CourseRange, drawn_course
from benchmarks.tables import (
    ENERGIES,
    ROOT,
    TIMES,
    cells,
    command_line,
    heads,
    number,
    origin,
    replace_block,
    table,
    told,
    write_json,
)
from rti_mpcc.report.text import figure
from rti_mpcc.simulation import RunResult, Scenario, save_scenario, simulate, summary

HEADER = ["course", "preset", "last part", "goal", "lateral offset [m]", "heading [rad]", "docked"]
HEADER += [*heads((*TIMES, *ENERGIES)), "how it ended"]
RANGES = {within.prefix: within for within in (CourseRange(), CAMPAIGN)}


def run_figures(result: RunResult, figures: dict[str, Any]) -> dict[str, Any]:
    """The summary of a run, its course, how many cycles had which status, the last one, its last reason."""
    cycles, course = result.cycles, result.scenario
    reasons = [reason for reason in cycles.reason if reason]
    return {
        **figures,
        "description": course.description,
        "offset": list(course.goal.offset or ()),
        "direction": result.path.parts[-1].direction,
        "cycles_by_status": dict(Counter(status.value for status in cycles.status)),
        "last_status": cycles.status[-1].value,
        "last_reason": reasons[-1] if reasons else "",
    }


def course_row(run: dict[str, Any]) -> list[str]:
    """The cells of a run, under `HEADER`."""
    along, beside, turned = run["offset"]
    behind = run["direction"] * along
    return [
        run["scenario"],
        run["preset"],
        "forward" if run["direction"] > 0 else "reverse",
        f"{abs(behind):.1f} m {'behind' if behind > 0 else 'inside'}",
        number(beside, 1),
        number(turned, 2),
        "yes" if run["docked"] else "no",
        *cells(run, (*TIMES, *ENERGIES)),
        _ending(run),
    ]


def _ending(run: dict[str, Any]) -> str:
    """How a run that did not dock ended: where it stood and what the controller said last."""
    if run["docked"]:
        return "docked"
    error = run["final_error"]
    return (
        f"{run['last_status']} after {run['duration_s']:.0f} s, "
        f"{number(100.0 * error['longitudinal_m'], 1)} cm, {number(100.0 * error['lateral_m'], 1)} cm, "
        f"{number(degrees(error['heading_rad']), 1)}° off"
    )


def courses_told(runs: Sequence[dict[str, Any]], presets: Sequence[str]) -> str:
    """A sentence a preset, and the ratios on the courses where the first and another one dock."""
    lines = []
    for preset in presets:
        mine = [run for run in runs if run["preset"] == preset]
        docked = sum(run["docked"] for run in mine)
        clearance = min(run["min_clearance_m"] for run in mine)
        lines.append(f"`{preset}` docks {docked} of {len(mine)}, least clearance {number(clearance, 2)} m.")
    first = {run["scenario"]: run for run in runs if run["preset"] == presets[0] and run["docked"]}
    for preset in presets[1:]:
        pairs = [
            (first[run["scenario"]], run)
            for run in runs
            if run["preset"] == preset and run["docked"] and run["scenario"] in first
        ]
        if pairs:
            lines.append(_ratios(pairs, presets[0], preset))
    return " ".join(lines)


def _ratios(pairs: list[tuple[dict[str, Any], dict[str, Any]]], name: str, other: str) -> str:
    time, *energies = (
        number(median((figure(a, one.path) or 0.0) / (figure(b, one.path) or inf) for a, b in pairs), 2)
        for one in (TIMES[0], *ENERGIES)
    )
    return (
        f"On the {len(pairs)} that both dock, `{name}` takes (median of the ratios to `{other}`) "
        f"{time} times the time to tolerance, {energies[0]}, {energies[1]} and {energies[2]} times the "
        "energy of acceleration, steering rate and lateral acceleration."
    )


def measure(course: Scenario, preset: str) -> dict[str, Any]:
    """See `run_figures`."""
    result = simulate(course, preset=preset)
    return run_figures(result, summary(result))


def parsed() -> argparse.Namespace:
    parser = command_line(__doc__, "python -m benchmarks.measure_courses")
    parser.add_argument("--within", choices=RANGES, default="course")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--count", type=int, default=24)
    parser.add_argument("--only", type=int, nargs="+")
    parser.add_argument("--presets", nargs="+", default=["default", "paper"])
    parser.add_argument("--save", type=Path)
    return parser.parse_args()


def page_text(runs: Sequence[dict[str, Any]], presets: Sequence[str], name: str, source: str) -> str:
    """The summary of the runs, a row for each run that did not dock, and the file with all runs."""
    missed = [course_row(run) for run in runs if not run["docked"]]
    parts = [courses_told(runs, presets), *([table(HEADER, missed)] if missed else [])]
    return "\n\n".join([*parts, f"All runs: [courses/{name}.json](courses/{name}.json). {source}"])


def main() -> None:
    asked = parsed()
    command = f"python -m benchmarks.measure_courses --seed {asked.seed} --count {asked.count}"
    command += f" --within {asked.within} --presets {' '.join(asked.presets)}"
    source = origin(command)  # first: the code is loaded, the commit may change while it runs
    indices = asked.only or range(asked.count)
    drawn = [drawn_course(asked.seed, index, RANGES[asked.within]) for index in indices]
    if asked.save is not None:
        for course in drawn:
            print(save_scenario(course, asked.save))
        return
    runs = []
    for course in drawn:
        for preset in asked.presets:
            runs.append(measure(course, preset))
            print(*course_row(runs[-1]), sep=" | ", flush=True)
    print(courses_told(runs, asked.presets))
    if asked.only is not None:
        return
    name = f"{asked.within}_{asked.seed}"
    write_json(ROOT / "docs" / "courses" / f"{name}.json", {"origin": source, "runs": runs})
    replace_block(ROOT / "docs" / "courses.md", name, page_text(runs, asked.presets, name, told(source)))


if __name__ == "__main__":
    main()
