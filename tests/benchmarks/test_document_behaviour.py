from __future__ import annotations

from pathlib import Path
from shutil import copy

from benchmarks import document_behaviour
from rti_mpcc.course.transitions import Event


def test_the_page_is_what_the_code_says(tmp_path: Path) -> None:
    page = tmp_path / "behaviour.md"
    copy(document_behaviour.PAGE, page)
    document_behaviour.write(page)
    again = "python -m benchmarks.document_behaviour"
    assert page.read_text() == document_behaviour.PAGE.read_text(), f"docs/behaviour.md is old: {again}"


def test_every_event_is_in_the_table_on_the_page() -> None:
    text = document_behaviour.PAGE.read_text()
    assert all(f"| {event.name} | {event.value} |" in text for event in Event)
