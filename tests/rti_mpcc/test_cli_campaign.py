"""`rti-mpcc campaign`: rows, report and worst cases of a user's scenario; `run` drives a worst case again."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from rti_mpcc.cli import main
from rti_mpcc.simulation import changed, load_scenario, save_scenario

OUT = ["--out", "there"]


pytestmark = pytest.mark.usefixtures("elsewhere")


def test_a_campaign_of_ones_own_scenario(capsys: pytest.CaptureFixture[str]) -> None:
    changes = {"name": "mine", "simulation.duration": 2.0}
    file = str(save_scenario(changed(load_scenario("docking_inside"), changes), Path()))
    asked = ["campaign", file, "--count", "2", "--vary", "start,noise", "--jobs", "2", "--seed", "5"]
    assert main([*asked, "--worst", "1", *OUT]) == 0
    said = capsys.readouterr()
    assert said.err == ""
    for told in ("docked, and the controller says so", "unfinished", "there/rows.jsonl", "there/worst"):
        assert told in said.out
    rows = [json.loads(line) for line in Path("there/rows.jsonl").read_text().splitlines()]
    assert sorted(row["index"] for row in rows) == [0, 1]
    report = json.loads(Path("there/report.json").read_text())
    assert report["success_rate"] == 0.0
    assert report["settings"] == {"scenario": file, "vary": ["start", "noise"], "count": 2, "seed": 5}
    (worst,) = report["worst"]
    _, *command = worst["command"].split()
    assert main([*command, "--no-plots", "--out", "again"]) == 1
    (row,) = (row for row in rows if row["index"] == worst["index"])
    again = json.loads(Path("again/summary.json").read_text())
    assert again["final_error"] == row["figures"]["final_error"]
    assert again["seed"] == row["figures"]["seed"] == 5_000_000 + worst["index"]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["docking_inside", "--count", "0"], "'0' must be an integer >= 1"),
        (["docking_inside", "--count", "1000001"], "count = 1000001: must be <= 1000000"),
        (["docking_inside"], "required: --count"),
        (["--count", "2"], "required: SCENARIO"),
        (["docking_inside", "--count", "2", "--vary", "wind"], "unknown 'wind'; must be some of start,goal"),
        (["docking_inside", "--count", "2", "--jobs", "2", "--dask", "tcp://a:1"], "not allowed with"),
        (["docking_inside", "--count", "2", "--seed", "-1"], "'-1' must be an integer >= 0"),
        (["nowhere", "--count", "2"], "nowhere: must be a .toml file or one of"),
    ],
)
def test_what_is_no_campaign_is_refused(
    capsys: pytest.CaptureFixture[str], arguments: list[str], message: str
) -> None:
    assert main(["campaign", *arguments, *OUT]) == 2
    said = capsys.readouterr()
    assert message in said.err
    assert said.out == ""
    assert not Path("there").exists()
