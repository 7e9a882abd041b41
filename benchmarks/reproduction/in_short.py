"""The outcome on one page: times side by side, and which published outcomes are reproduced."""

from __future__ import annotations

from collections.abc import Sequence

from benchmarks.reproduction.content import Block, Paragraph, Section, Table, found, say
from benchmarks.reproduction.published import published_run
from benchmarks.reproduction.runs import DEFAULT, DOCKING, METHODS, Runs
from benchmarks.reproduction.verdicts import CAME, MISSED, UNSAID, ratio
from rti_mpcc.report.text import number

_SAID = (
    "T is the first time inside the goal tolerance (0.05 m, 0.05 m, 2°), a dash where there is none. Preset "
    "`default` has no counterpart in the paper: it is compared with `dynamic`."
)


def in_short(runs: Runs, made: Sequence[Section], first: int) -> list[Block]:
    """Blocks for the first section.

    Args:
        made: the sections after it; first: number of the first of them.
    """
    misses = [
        found(f"Section {place}: {text}")
        for place, section in enumerate(made, start=first)
        for text in _sentences(section)
        if MISSED in text
    ]
    told = "Outcomes that are not reproduced; the section gives the reason, if it is known:"
    return [times_table(runs), found(counted(made)), *([say(told), *misses] if misses else [])]


def counted(made: Sequence[Section]) -> str:
    """The numbers of outcomes, and of those reproduced or not measured."""
    sentences = [text for section in made for text in _sentences(section)]
    came, missed, unsaid = (sum(f": {word}" in text for text in sentences) for word in (CAME, MISSED, UNSAID))
    rest = f"; {unsaid} not measured" if unsaid else ""
    return f"Of {came + missed + unsaid} published or required outcomes {came} are reproduced{rest}."


def _sentences(section: Section) -> list[str]:
    return [block.text for block in section.blocks if isinstance(block, Paragraph) and block.verdict]


def times_table(runs: Runs) -> Table:
    """T of each scenario and method from all sources."""
    return Table(
        caption=f"Time to tolerance T [s]. {_SAID}",
        heads=[
            "scenario, method",
            "paper",
            "published code",
            "here, `paper`",
            "times the paper",
            "here, `default`",
            "times the published code",
        ],
        rows=[_row(runs, scenario, method) for scenario in DOCKING for method in METHODS],
        group=len(METHODS),
    )


def _row(runs: Runs, scenario: str, method: str) -> list[str]:
    known = published_run(scenario, method) or {}
    paper, code = known.get("time_in_paper_s"), known.get("time_to_tolerance_s")
    here = runs.figures(scenario, method)["time_to_tolerance_s"]
    cells = [paper, code, here, ratio(here, paper)]
    if method == METHODS[0]:
        beyond = runs.figures(scenario, preset=DEFAULT)["time_to_tolerance_s"]
        cells += [beyond, ratio(beyond, code)]
    told = [number(cell, 2) for cell in cells]
    return [f"{DOCKING[scenario]}, {method}", *told, *[""] * (6 - len(told))]
