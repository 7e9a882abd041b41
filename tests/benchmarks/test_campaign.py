"""`python -m benchmarks.campaign`: random problems of a level, the same rows each time."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from benchmarks.campaign import parser
from benchmarks.problems.case import CampaignCase, Problems
from benchmarks.problems.levels import Level
from benchmarks.tabulate_campaigns import difficulty, driven, rides, row
from rti_mpcc.cli import exit_status
from rti_mpcc.report.campaign import read_table
from rti_mpcc.simulation import load_scenario
from rti_mpcc.simulation.campaign import drive_case, read_rows


def test_a_study_keeps_a_row_a_case_and_reports(tmp_path: Path) -> None:
    out = str(tmp_path / "there")
    asked = ["--count", "9", "--only", "5", "7", "--level", "hard", "--seed", "11", "--scenes", "--jobs", "1"]
    assert exit_status(parser(), [*asked, "--worst", "1", "--out", out]) == 0
    rows = {row["index"]: row for row in read_rows(Path(out))}
    cases = {i: CampaignCase(seed=11, level=Level.HARD, index=i, problems=Problems.SCENES) for i in (5, 7)}
    assert rows.keys() == cases.keys()
    assert json.dumps(drive_case(cases[7]).table()) == json.dumps(rows[7])
    report = json.loads((Path(out) / "report.json").read_text())
    assert (report["settings"]["level"], report["settings"]["problems"]) == ("hard", "scenes")
    (worst,) = report["worst"]
    file = f"{out}/worst/{worst['scenario']}.toml"
    assert load_scenario(file) == cases[worst["index"]].scenario()
    assert worst["command"].startswith(f"rti-mpcc run {file} --method dynamic --preset default --seed 110000")
    assert row(Path(out), report)[:3] == ["hard", "dynamic, default", "2"]
    assert "peak jerk over comfort" in rides([report])
    assert difficulty(read_table(Path(out))).loc["course.kind"]["cases"].sum() == 2


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--count", "2", "--level", "easy"], "invalid Level value: 'easy'"),
        (["--count", "2", "--deadline", "0"], "deadline"),
    ],
)
def test_what_is_no_study_is_refused(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, arguments: list[str], message: str
) -> None:
    assert exit_status(parser(), [*arguments, "--out", str(tmp_path / "there")]) == 2
    assert message in capsys.readouterr().err
    assert not (tmp_path / "there").exists()


def test_the_table_names_the_commit_that_was_driven() -> None:
    one = {"settings": {"commit": "abc1234", "changed": True, "date": "2026-11-27"}}
    two = {"settings": {"commit": "abc1234", "changed": False, "date": "2026-11-28"}}
    found = driven([one, two])
    assert (found["commit"], found["changed"], found["date"]) == ("abc1234", True, "2026-11-28")
    for other in ({"commit": "def5678", "changed": False, "date": "2026-11-28"}, {}):
        with pytest.raises(SystemExit, match="must be one"):
            driven([one, {"settings": other}])
