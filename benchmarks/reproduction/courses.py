"""The presets `default` and `paper` on courses drawn from a seed, which the paper does not have."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from statistics import median
from typing import Any

from benchmarks.measure_courses import HEADER, course_row, courses_told, run_figures
from benchmarks.reproduction.content import BEYOND, PAPER, Section, Table, found, say
from benchmarks.reproduction.runs import COURSE_SEED, DEFAULT
from benchmarks.reproduction.verdicts import came_out
from benchmarks.tables import heads
from rti_mpcc.report.text import figure, number
from rti_mpcc.simulation.batch import DrivenCase

DOCKED = HEADER.index("docked")
"""The column that is left out: how a run ended says it, too."""
_COMPARED = (PAPER[0], *BEYOND)
_SAID = (
    "Not an experiment of the paper: routes, corridors and goals drawn from seed {seed}, goals inside and "
    "behind the path end in turn, forward and reverse, each proven dockable by a check that does not use "
    "the controller. No course is left out because of how the controller does on it. Preset `default` is "
    "compared with the paper's method, preset `paper`."
)


def courses_section(outcomes: Sequence[DrivenCase]) -> Section:
    """How many docked, both presets side by side, and one row a run."""
    runs = [run_figures(outcome.result, outcome.figures) for outcome in outcomes]
    presets = list(dict.fromkeys(run["preset"] for run in runs))
    table = Table(
        caption="Drawn courses, run by run.",
        heads=HEADER[:DOCKED] + HEADER[DOCKED + 1 :],
        rows=[row[:DOCKED] + row[DOCKED + 1 :] for row in map(course_row, runs)],
        worded=[1, 2, 3],
        sentences=[len(HEADER) - 2],
        group=len(presets),
    )
    ended = Counter((run["preset"], run["last_status"]) for run in runs if not run["docked"])
    missed = ", ".join(f"{count} {status} (`{preset}`)" for (preset, status), count in ended.items())
    told = courses_told(runs, presets) + (f" Those that do not dock: {missed}." if missed else "")
    docked = sum(run["docked"] for run in runs if run["preset"] == DEFAULT)
    count = sum(run["preset"] == DEFAULT for run in runs)
    outcome = came_out("`default` docks on all random courses", docked == count, f"{docked} of {count}")
    return Section(
        name="courses",
        title="Drawn courses",
        blocks=[
            say(_SAID.format(seed=COURSE_SEED)),
            _compared(runs, presets),
            found(told),
            found(outcome),
            table,
        ],
        figures=runs,
    )


def _compared(runs: Sequence[dict[str, Any]], presets: Sequence[str]) -> Table:
    """Medians over the courses on which all presets dock."""
    failed = {run["scenario"] for run in runs if not run["docked"]}
    rows = []
    for preset in presets:
        mine = [run for run in runs if run["preset"] == preset]
        both = [run for run in mine if run["scenario"] not in failed]
        cells = [
            number(median(figure(run, one.path) or 0.0 for run in both) if both else None, one.digits)
            for one in _COMPARED
        ]
        rows.append([f"`{preset}`", f"{sum(run['docked'] for run in mine)} of {len(mine)}", *cells])
    return Table(
        caption="Drawn courses: how many dock, and medians over those on which both presets do.",
        heads=["preset", "docked", *heads(_COMPARED)],
        rows=rows,
    )
