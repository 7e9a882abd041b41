"""The preset `default` on courses drawn from a seed, which the paper does not have."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from rti_mpcc.report.course_rows import HEADER, course_figures, course_row, courses_told
from rti_mpcc.report.reproduction.content import Section, Table, found, say
from rti_mpcc.report.reproduction.runs import COURSE_SEED, DEFAULT
from rti_mpcc.simulation.batch import Outcome

LEFT_OUT = ("preset",)
"""Columns that are the same in all rows."""
_SAID = (
    "Not an experiment of the paper: routes, corridors and goals drawn from seed {seed}, goals inside and "
    "behind the path end in turn, forward and reverse, each proven dockable by a check that does not use "
    "the controller. No course is left out because of how the controller does on it."
)


def courses_section(outcomes: Sequence[Outcome]) -> Section:
    """One row a course, and how many docked."""
    runs = [course_figures(outcome.result, outcome.figures) for outcome in outcomes]
    kept = [place for place, head in enumerate(HEADER) if head not in LEFT_OUT]
    rows = [course_row(run) for run in runs]
    table = Table(
        caption="Drawn courses, preset `default`.",
        heads=[HEADER[place] for place in kept],
        rows=[[row[place] for place in kept] for row in rows],
        worded=[1, 2, len(kept) - 1],
    )
    ended = Counter(run["last_status"] for run in runs if not run["docked"])
    missed = ", ".join(f"{count} {status}" for status, count in ended.items())
    told = courses_told(runs, [DEFAULT]) + (f" Those that do not: {missed}." if missed else "")
    return Section(
        name="courses",
        title="Drawn courses",
        blocks=[say(_SAID.format(seed=COURSE_SEED)), found(told), table],
        figures=runs,
    )
