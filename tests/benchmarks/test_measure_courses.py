from __future__ import annotations

import json
from pathlib import Path

import pytest

from benchmarks.measure_courses import page_text
from benchmarks.tables import ROOT, told

RUNS = sorted((ROOT / "docs" / "courses").glob("*.json"))


@pytest.mark.parametrize("file", RUNS, ids=lambda file: file.stem)
def test_the_page_is_what_the_recorded_runs_say(file: Path) -> None:
    content = json.loads(file.read_text(encoding="utf-8"))
    presets = list(dict.fromkeys(run["preset"] for run in content["runs"]))
    text = page_text(content["runs"], presets, file.stem, told(content["origin"]))
    page = (ROOT / "docs" / "courses.md").read_text(encoding="utf-8")
    assert f"<!-- begin {file.stem} -->\n{text}\n<!-- end {file.stem} -->" in page
