"""The report: the outcome in short, all sections, and the files reproduce.html, reproduce.json, pictures."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from benchmarks.reproduction.comfort import comfort_section
from benchmarks.reproduction.content import Block, Paragraph, Picture, Section, Table, found, say
from benchmarks.reproduction.courses import courses_section
from benchmarks.reproduction.docking import docking_section
from benchmarks.reproduction.frenet_picture import frenet_section
from benchmarks.reproduction.full_course import course_section
from benchmarks.reproduction.mission import mission_section
from benchmarks.reproduction.parameters import parameters_section
from benchmarks.reproduction.published import published, published_run
from benchmarks.reproduction.runs import DEFAULT, DOCKING, METHODS, Runs
from benchmarks.reproduction.schedules import schedules_section
from benchmarks.reproduction.verdicts import CAME, MISSED, UNSAID, ratio
from rti_mpcc.recording import Machine
from rti_mpcc.report.page import rendered
from rti_mpcc.report.text import number

_SAID = (
    "T is the first time inside the goal tolerance (0.05 m, 0.05 m, 2°), a dash where there is none. Preset "
    "`default` has no counterpart in the paper: it is compared with `dynamic`."
)
TITLE = "The experiments of the paper, driven again"
PAGE, NUMBERS = "reproduce.html", "reproduce.json"
_PAPER = (
    'The paper is Schumann, Buchholz, Dietmayer, "Dynamic Objective MPC for Motion Planning of Seamless '
    'Docking Maneuvers", IEEE Intelligent Vehicles Symposium 2025; the published code is what its authors '
    "released. Three sources stand side by side: the numbers printed in the paper (“paper”), those of the "
    "published code when it was run by the makers of this project (“published code”), and those of this "
    "project, measured when this page was made (“here”). Preset `paper` is the paper's method with what the "
    "published code adds to it, `default` is this project's own."
)
_READING = (
    "Every number that is said to be measured here comes from the runs of this report, and the sentences "
    "with a bar beside them are computed from these numbers. The runs are "
    "deterministic but for their computing times. All runs here: dead time 0.18 s, cycle 50 ms; those of the "
    "published code: the same dead time, 100 Hz. SI units. What differs by design, with letters that this "
    "page refers to, is in docs/decisions of the project."
)
_MISSING = (
    "The docking mission is driven in this project's own simulation, with pictures of the board that are "
    "drawn, not in the CARLA simulator. All figures and tables of the paper's method and evaluation sections "
    "are here."
)


def html_page(title: str, sections: Sequence[Section]) -> str:
    """The whole page: title, table of contents, sections. Tables and figures are numbered in order."""
    return rendered("sections.html", title, Path(__file__).parent, given=sections)


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
    known = published_run(scenario, method)
    paper, code = known.get("time_in_paper_s"), known.get("time_to_tolerance_s")
    here = runs.figures(scenario, method)["time_to_tolerance_s"]
    cells = [paper, code, here, ratio(here, paper)]
    if method == METHODS[0]:
        beyond = runs.figures(scenario, preset=DEFAULT)["time_to_tolerance_s"]
        cells += [beyond, ratio(beyond, code)]
    told = [number(cell, 2) for cell in cells]
    return [f"{DOCKING[scenario]}, {method}", *told, *[""] * (6 - len(told))]


class Report(NamedTuple):
    """What was written, and its outcome in a few sentences."""

    files: tuple[Path, ...]
    told: tuple[str, ...]


def sections(runs: Runs) -> list[Section]:
    """All of the report in order; those of runs that were not driven are left out."""
    made = [
        frenet_section(),
        schedules_section(),
        parameters_section(),
        course_section(runs),
        *(docking_section(runs, scenario) for scenario in DOCKING),
    ]
    if runs.mission is not None:
        made.append(mission_section(runs.mission))
    if runs.comforts:
        made.append(comfort_section(runs))
    if runs.courses:
        made.append(courses_section(runs.courses))
    return [about(runs, made), *made]


def about(runs: Runs, made: list[Section]) -> Section:
    """What stands before the experiments: the outcome in short, sources, how to read it."""
    origin = say(f"Origin of the published figures. {published()['origin']}")
    versions = ", ".join(f"{name} {value}" for name, value in Machine.here().versions.items() if value)
    made_by = say(f"Made by `make reproduce` with {versions}.")
    return Section(
        name="about",
        title="In short",
        blocks=[say(_PAPER), *in_short(runs, made, 2), say(_READING), origin, say(_MISSING), made_by],
    )


def write_report(runs: Runs, folder: Path) -> Report:
    """Write page, numbers and pictures into an existing folder. Raises OSError."""
    made = sections(runs)
    written = [folder / PAGE, folder / NUMBERS]
    written[0].write_text(html_page(TITLE, made), encoding="utf-8")
    written[1].write_text(
        json.dumps(numbers(made), indent=2, allow_nan=False, ensure_ascii=False) + "\n", encoding="utf-8"
    )
    for picture in (block for section in made for block in section.blocks if isinstance(block, Picture)):
        written.append(folder / f"{picture.name}.png")
        written[-1].write_bytes(picture.png)
    told = (block.text for block in made[0].blocks if isinstance(block, Paragraph) and block.verdict)
    return Report(files=tuple(written), told=tuple(told))


def numbers(made: list[Section]) -> dict[str, object]:
    """All figures: published ones, and by section the measured ones with the sentences computed from them."""
    measured = {
        section.name: {
            "figures": section.figures,
            "verdicts": [
                block.text for block in section.blocks if isinstance(block, Paragraph) and block.verdict
            ],
        }
        for section in made
    }
    return {"versions": Machine.here().versions, "published": published(), "sections": measured}
