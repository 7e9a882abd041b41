"""What programs write into the docs is there as they write it, and what they name of the code is there."""

from __future__ import annotations

import json
from importlib import import_module
from pathlib import Path
from shutil import copy
from typing import Any

import pytest

from benchmarks import document_behaviour, measure_courses, optimum
from benchmarks.tables import ROOT, told
from benchmarks.variations import VARIATIONS
from rti_mpcc.course.transitions import Event

DOCS = ROOT / "docs"
RUNS = sorted((DOCS / "courses").glob("*.json"))


def recorded(file: Path) -> tuple[list[dict[str, Any]], str]:
    """Runs, and what they are of."""
    content = json.loads(file.read_text(encoding="utf-8"))
    return content["runs"], told(content["origin"])


def assert_on(page: str, block: str, text: str) -> None:
    written = (DOCS / page).read_text(encoding="utf-8")
    assert f"<!-- begin {block} -->\n{text}\n<!-- end {block} -->" in written


def test_the_page_of_the_optimum_is_what_the_recorded_runs_say() -> None:
    assert_on("optimum.md", "optimum", optimum.page_text(*recorded(DOCS / "optimum.json")))


@pytest.mark.parametrize("file", RUNS, ids=lambda file: file.stem)
def test_the_page_of_the_courses_is_what_the_recorded_runs_say(file: Path) -> None:
    runs, origin = recorded(file)
    presets = list(dict.fromkeys(run["preset"] for run in runs))
    assert_on("courses.md", file.stem, measure_courses.page_text(runs, presets, file.stem, origin))


def test_the_page_of_the_behaviour_is_what_the_code_says(tmp_path: Path) -> None:
    page = tmp_path / "behaviour.md"
    copy(document_behaviour.PAGE, page)
    document_behaviour.write(page)
    again = "python -m benchmarks.document_behaviour"
    assert page.read_text() == document_behaviour.PAGE.read_text(), f"docs/behaviour.md is old: {again}"
    assert all(f"| {event.name} | {event.value} |" in page.read_text() for event in Event)


@pytest.mark.parametrize("name", sorted({name for each in VARIATIONS for name in each.patches}))
def test_every_constant_that_a_measurement_of_deviations_patches_is_there(name: str) -> None:
    module, _, constant = name.rpartition(".")
    assert hasattr(import_module(module), constant)
