"""Runs the random courses of a seed and writes docs/courses.md and docs/courses/*.json.

    OMP_NUM_THREADS=1 python -m benchmarks.measure_courses [--seed 1] [--count 24] [--presets default paper]

With `--within campaign` they are drawn from the wider range of campaigns.
With `--save DIR` it writes the courses as scenario files instead, for `rti-mpcc run DIR/course_1_00.toml`;
with `--only 3 7` it runs these and writes nothing. The runs are deterministic but for their computing times.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from benchmarks.course_rows import HEADER, course_row, courses_told, run_figures
from benchmarks.problems.courses import CAMPAIGN, CourseRange, drawn_course
from benchmarks.tables import ROOT, command_line, origin, replace_block, table, told, write_json
from rti_mpcc.simulation import Scenario, save_scenario, simulate, summary

RANGES = {within.prefix: within for within in (CourseRange(), CAMPAIGN)}


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
