"""The report of a campaign: its figures from made-up rows, the order of the worst cases, the page."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchmarks.pictures import BROWSER
from rti_mpcc.errors import InputError
from rti_mpcc.report.campaign import overall, read_table, worst_cases, write_report
from tests.rti_mpcc.report.pages import browsed, parsed
from tests.rti_mpcc.simulation.drives import ShortCase

COMFORT = {"acceleration": 0.5, "lateral_acceleration": 1.0, "steering_rate": 0.5, "jerk": 1.0}


def row(index: int, outcome: str = "docked", time: float = 20.0, **figures: Any) -> dict[str, Any]:
    """A case that was driven: peaks at comfort, 0.1 m clear, all as expected; with other figures."""
    usual = {
        "time_to_tolerance_s": time - 1.0,
        "time_to_dock_s": time if outcome == "docked" else None,
        "expected_time_s": 20.0,
        "min_clearance_m": 0.1,
        "energy_ratio": 1.0,
        "comfort": COMFORT,
        "peak": COMFORT,
        "fallback_cycles": 0,
        "failures_driven": 0,
        "solver": {"failures": 0, "interior_point_cycles": 1},
        "hard_braking": {},
        "cycles_by_status": {"arriving": 10, "docked": 2},
    }
    drawn = {"course": {"number": index}, "disturbances": {}}
    detail = "" if outcome == "docked" else "gets no nearer"
    named = {"index": index, "scenario": f"short_{index}", "outcome": outcome, "detail": detail}
    return {**named, **drawn, "figures": {**usual, **figures}}


def died(index: int) -> dict[str, Any]:
    return {**row(index, "worker_died"), "course": None, "disturbances": None, "figures": None}


def written(folder: Path, *rows: dict[str, Any]) -> Path:
    """A campaign with these rows; each that was driven missed one deadline."""
    timed = [
        {"index": each["index"], "cycle_ms": {"p50": 1.0, "p99": 2.0, "max": 3.0 + each["index"]},
         "deadline_misses": 1} for each in rows if each["figures"]
    ]  # fmt: skip
    for name, tables in (("rows.jsonl", rows), ("timed.jsonl", timed)):
        (folder / name).write_text("".join(json.dumps(table) + "\n" for table in tables))
    return folder


def test_the_figures_of_a_campaign(tmp_path: Path) -> None:
    hard = {**COMFORT, "acceleration": 1.5}
    rows = [
        row(3, "stalled", peak=hard, min_clearance_m=0.02),
        row(0, energy_ratio=2.0, hard_braking={"a walker": 2}),
        row(1, time=30.0, min_clearance_m=-0.05, fallback_cycles=4),
        died(2),
    ]
    found = overall(read_table(written(tmp_path, *rows)))
    assert (found["cases"], found["success_rate"]) == (4, 0.5)
    assert found["success_interval"] == pytest.approx([0.0676, 0.9324], abs=1e-4)  # of tables
    assert found["outcomes"]["stalled"] == found["outcomes"]["worker_died"] == 1
    assert (found["collisions"], found["min_clearance_m"]) == (1, -0.05)
    assert found["time_ratio"]["max"] == 1.5
    assert (found["time_to_dock_p50"], found["time_to_dock_max"]) == (25.0, 30.0)
    assert found["energy_ratio"]["p50"] == 1.5
    assert (found["comfort"]["acceleration"]["p50"], found["comfort"]["acceleration"]["max"]) == (1.0, 3.0)
    assert found["cycle_ms"] == {"p50": 1.0, "p99": 2.0, "max": 6.0}
    assert (found["deadline_misses"], found["interior_point_cycles"], found["fallback_cycles"]) == (3, 3, 4)
    assert found["hard_braking"] == {"a walker": 2}
    assert found["cycles_by_status"] == {"arriving": 30, "docked": 6}


def test_what_nothing_is_known_of_is_none(tmp_path: Path) -> None:
    found = overall(read_table(written(tmp_path, died(0))))
    assert found["success_rate"] == 0.0
    assert found["comfort"]["jerk"] == {"p50": None, "p95": None, "p99": None, "max": None}
    assert (found["min_clearance_m"], found["cycle_ms"]["max"], found["cycles_by_status"]) == (None, None, {})
    with pytest.raises(InputError, match="has no row"):
        read_table(written(tmp_path))


def test_the_worst_come_first(tmp_path: Path) -> None:
    rows = [
        row(0, min_clearance_m=0.05),
        row(1, time=40.0),
        row(2, min_clearance_m=-0.01),
        row(3, min_clearance_m=-0.2),
        row(4, "stalled"),
        died(5),
        row(6),
    ]
    assert worst_cases(read_table(written(tmp_path, *rows)), 6) == {
        3: "collision",
        2: "collision",
        5: "worker died",
        4: "stalled",
        0: "least clearance",
        1: "longest time over the expected one",
    }


def test_page_and_numbers_and_the_worst_as_files(tmp_path: Path) -> None:
    rows = [row(0), row(1, "stalled"), died(2)]
    cases = [ShortCase(index=index) for index in range(3)]
    settings = {"scenario": "short", "count": 3}
    folder = written(tmp_path, *rows)
    table, files = write_report(folder, settings, cases, worst=2)
    assert {file.name for file in files} == {"report.html", "report.json", "worst"}
    numbers = json.loads((tmp_path / "report.json").read_text())
    assert numbers["settings"] == settings
    assert [(one["index"], one["outcome"]) for one in numbers["worst"]] == [
        (2, "worker_died"),
        (1, "stalled"),
    ]
    file = tmp_path / "worst" / "short_1.toml"
    assert numbers["worst"][1]["command"] == f"rti-mpcc run {file} --seed 1"
    assert file.exists()
    page = parsed((tmp_path / "report.html").read_text())
    own, picture = sorted({address for address in page.fetched if not address.startswith("#")})[::-1]
    assert picture.startswith("data:image/png")  # one: what ended its worker is not driven here
    assert own == "worst/short_1.html"
    assert "<canvas" in (tmp_path / own).read_text()
    known = ["0", "docked", "20.00", "1.00", "0.100", "1.00", "1.00"]
    assert page.rows_below("One row a case")[1:] == [
        known,
        ["1", "stalled", "–", "–", "0.100", "1.00", "1.00"],
        ["2", "worker died", *"–––––"],
    ]
    assert ["docked, and the controller says so", "33.33 %"] in page.rows_below("The campaign as a whole")
    assert len(table) == len(page.rows_below("The campaign as a whole")) - 1
    assert np.isfinite(numbers["success_interval"]).all()


SORTED = """<script>
cases.tHead.rows[0].cells[2].click();
cases.tHead.rows[0].cells[2].click();
const input = document.getElementById("filter");
input.value = "docked";
input.dispatchEvent(new Event("input"));
const left = [...body.rows].filter((row) => !row.hidden);
document.body.dataset.order = left.map((row) => row.cells[0].textContent).join(" ");
</script></body>"""
"""Two clicks on the time to dock, the longest first; then the filter."""


@pytest.mark.skipif(BROWSER is None, reason="no Chromium here")
def test_a_browser_sorts_and_filters_the_cases(tmp_path: Path) -> None:
    rows = [row(0, time=9.0), row(1, "stalled"), row(2, time=30.0), died(3), row(4, time=20.0)]
    write_report(written(tmp_path, *rows), {}, [ShortCase(index=k) for k in range(5)], worst=0)
    file = tmp_path / "report.html"
    file.write_text(file.read_text().replace("</body>", SORTED))
    shown = browsed(file, tmp_path)
    assert 'data-order="2 4 0"' in shown
