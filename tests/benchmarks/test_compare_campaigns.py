"""Versions are compared on the cases that all of them have, and by those that all dock."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from benchmarks.compare_campaigns import Driven, line, read, sentence, side_by_side
from rti_mpcc.errors import InputError


def row(time: float | None, *, peak: float = 0.4, clearance: float = 0.1) -> dict[str, Any]:
    energy = {"acceleration": 2.0, "steering_rate": 0.5, "lateral_acceleration": 1.0}
    return {
        "outcome": "stalled" if time is None else "docked",
        "figures": {
            "peak": {"acceleration": peak},
            "comfort": {"acceleration": 0.4},
            "time_to_dock_s": time,
            "expected_time_s": 20.0,
            "energy_to_dock": dict.fromkeys(energy) if time is None else energy,
            "min_clearance_m": clearance,
        },
    }


@pytest.fixture
def driven(tmp_path: Path) -> Callable[..., Driven]:
    """Keeps the rows of a campaign as one leaves them, and reads them."""

    def write(name: str, rows: dict[int, Any], level: str = "hard", problems: str = "courses") -> Driven:
        folder = tmp_path / f"{name}_{level}_{problems}"
        folder.mkdir()
        settings = {"level": level, "seed": 7, "problems": problems}
        (folder / "report.json").write_text(json.dumps({"settings": settings}))
        lines = [json.dumps({"index": index, **one}) for index, one in rows.items()]
        (folder / "rows.jsonl").write_text("".join(f"{line}\n" for line in lines))
        (folder / "timed.jsonl").write_text("")
        return read(f"{name}={folder}")

    return write


@pytest.fixture
def versions(driven: Callable[..., Driven]) -> list[Driven]:
    before = {0: row(20.0), 1: row(None, clearance=0.01), 2: row(30.0), 5: row(20.0)}
    after = {0: row(24.0, peak=0.8), 1: row(25.0), 2: row(30.0), 3: row(20.0)}
    return [driven("before", before), driven("before", {0: row(20.0)}, "nominal"), driven("after", after)]


def test_versions_stand_side_by_side_with_the_cases_that_all_have(versions: list[Driven]) -> None:
    groups = side_by_side(versions)
    assert [[each.version for each in group] for group in groups] == [["before", "after"], ["before"]]
    assert all(list(each.rows.index) == [0, 1, 2] for each in groups[0])


def test_a_line_counts_all_and_measures_what_all_dock(versions: list[Driven]) -> None:
    group, _ = side_by_side(versions)
    before, after = (line(each, group) for each in group)
    assert before[:4] == ["hard of 7, before", "3", "2", "0.010"]
    assert after[:4] == ["hard of 7, after", "3", "3", "0.100"]
    assert before[4] == "1.00, 1.00, 1.00"
    assert after[4].endswith(", 2.00")
    assert before[6] == after[6] == "4.0"  # of cases 0 and 2
    assert (before[-1], after[-1]) == ("1", "–")


def test_scenes_without_a_path_have_no_expected_time_and_are_none_of_the_courses(
    driven: Callable[..., Driven], versions: list[Driven]
) -> None:
    scene = row(20.0)
    scene["figures"]["expected_time_s"] = None
    scenes = driven("after", {0: scene, 1: row(25.0)}, problems="scenes")
    groups = side_by_side([versions[0], scenes])
    assert [each.of for group in groups for each in group] == ["hard of 7", "scenes, hard of 7"]
    assert line(scenes, [scenes])[5] == "1.25, 1.25, 1.25"
    alone = driven("alone", {0: scene}, problems="scenes")
    assert line(alone, [alone])[5] == "–"


def test_times_are_compared_case_by_case(versions: list[Driven]) -> None:
    told = sentence(*side_by_side([versions[0], versions[2]])[0])
    assert "of 2 cases that both dock" in told
    assert "1.100 times as long as before" in told
    assert "in 1 more than 1.1, in 0 less than 0.9" in told


def test_a_folder_without_a_version_is_refused() -> None:
    with pytest.raises(InputError, match="VERSION=FOLDER"):
        read("runs/hard")
