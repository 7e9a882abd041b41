"""`rti-mpcc campaign-report`: page, numbers, table, refusals; made-up rows and a small real campaign."""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from re import findall
from typing import Any

import pytest

from rti_mpcc.cli import main
from rti_mpcc.simulation import Scenario, changed, load_scenario
from rti_mpcc.simulation.campaign import (
    CampaignCase,
    CampaignRow,
    CampaignSettings,
    CaseOutcome,
    Level,
    Problems,
    drive_case,
)
from tests.rti_mpcc.report.campaign.made_up import (
    SCENES,
    SETTINGS,
    docked,
    figures,
    raised,
    scene,
    stalled,
    write,
)
from tests.rti_mpcc.report.pages import Wellformed, parsed

QUICK = 29
"""A case that is made to dock soon; the others end before they do."""
SOON = """
name = "soon"
description = "5 m straight"
[path]
start = [0, 0, 0]
segments = [{ direction = 1, curvature = 0.0, length = 5.0 }]
[corridor]
left = 4
right = -4
[goal]
offset = [0, 0, 0]
[simulation]
dead_time = 0.18
"""
NEEDED = {
    "cases",
    "success_rate",
    "success_interval",
    "collisions",
    "solver_failures",
    "time_to_dock_p50",
    "min_clearance_m",
}


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def report(folder: str = "one") -> tuple[str, dict[str, Any]]:
    page = Path(folder, "report.html").read_text(encoding="utf-8")
    return page, json.loads(Path(folder, "report.json").read_text(encoding="utf-8"))


def self_contained(page: str) -> Wellformed:
    read = parsed(page)
    assert all(source.startswith(("#", "data:image/png;base64,")) for source in read.fetched)
    assert "<script" not in page
    assert not findall(r"url\(|@import|https?://", page)
    return read


def made_up(folder: str, rows: Iterable[CampaignRow], **changes: Any) -> None:
    write(Path(folder), rows, **changes)


def test_a_campaign_is_reported(capsys: pytest.CaptureFixture[str]) -> None:
    made_up("one", [docked(2, 30.0), docked(0, 20.0, 0.1), stalled(1), raised(3)])
    assert main(["campaign-report", "one", "--worst", "0"]) == 0
    said = capsys.readouterr()
    assert said.err == ""
    assert (
        "\n2 of 4 cases docked: 50.00 % (95 % interval 6.76 % to 93.24 %); 1 stalled, 1 raised.\n" in said.out
    )
    assert "docked, 95 % interval" in said.out
    assert "least clearance / p5 / median [m]" in said.out
    assert "one/report.html, one/report.json" in said.out
    page, numbers = report()
    assert set(numbers) >= NEEDED
    assert numbers["success_rate"] == 0.5
    assert numbers["success_interval"] == pytest.approx([0.067586, 0.932414], abs=1e-6)
    assert numbers["time_to_dock_p50"] == 25.0
    assert numbers["finished"] is True
    assert "worst" not in numbers
    assert [part["cases"] for part in numbers["difficulty"]["goal_beside_m"]] == [1, 1, 1, 1]
    text = "".join(self_contained(page).text)
    assert "2 of 4 cases docked: 50.00 %" in text
    assert "ValueError: <odd> 'x'" in text
    assert [group["index"] for group in numbers["losses"]] == [[1], [3]]


def test_what_is_not_finished_says_so(capsys: pytest.CaptureFixture[str]) -> None:
    made_up("one", [docked(0)], tail='{"index": 2, "scen')
    assert main(["campaign-report", "one", "--worst", "0"]) == 0
    said = capsys.readouterr().out
    assert "The campaign is not finished: 1 of 4 cases are driven." in said
    assert "The last line of rows.jsonl is not whole and left out." in said
    page, numbers = report()
    assert (numbers["finished"], numbers["torn_line"], numbers["cases_asked"]) == (False, True, 4)
    assert "The campaign is not finished" in page


def test_a_campaign_of_scenes_is_reported(capsys: pytest.CaptureFixture[str]) -> None:
    lost = scene(1, figures(None), kind="slot", outcome=CaseOutcome.UNFINISHED, detail="no way")
    undrawn = replace(scene(3, None, outcome=CaseOutcome.WORKER_DIED), course=None)
    rows = [scene(0, figures(20.0)), lost, scene(2, figures(30.0), kind="slot"), undrawn]
    made_up("one", rows, settings=SCENES)
    assert main(["campaign-report", "one", "--worst", "0"]) == 0
    said = capsys.readouterr()
    assert said.err == ""
    assert "one: scenes, nominal, seed 1" in said.out
    assert "Planning took 0.20 s in the median of the cases, 0.30 s at most." in said.out
    assert "Ways beyond the first: 3, in 2 cases." in said.out
    page, numbers = report()
    assert numbers["planning"]["seconds"] == pytest.approx({"p50": 0.2, "p95": 0.29, "max": 0.3})
    assert numbers["planning"]["replans"] == {"total": 3, "cases": 2, "max": 2.0}
    assert numbers["cycle_ms"] == {"p50": 2.0, "p99": 4.0, "max": 42.0}
    assert (numbers["deadline_misses"], numbers["deadline_miss_cases"]) == (3, 2)
    assert [(one["kind"], one["cases"], one["docked"]) for one in numbers["kinds"]] == [
        ("bay", 1, 1),
        ("slot", 2, 1),
    ]
    assert [part["cases"] for part in numbers["difficulty"]["apart_m"]] == [1, 1, 1]
    assert "goal_beside_m" not in numbers["difficulty"]
    text = "".join(self_contained(page).text)
    assert "the length of the first way that was planned" in text
    assert "left the area or met an obstacle" in " ".join(text.split())


def test_the_page_of_courses_has_nothing_of_scenes() -> None:
    made_up("one", [docked(0), docked(1)])
    assert main(["campaign-report", "one", "--worst", "0"]) == 0
    page, numbers = report()
    assert "kinds" not in numbers
    assert (numbers["planning"], numbers["cycle_ms"], numbers["deadline_misses"]) == (None, None, None)
    assert "apart_m" not in numbers["difficulty"]
    text = "".join(self_contained(page).text)
    assert "planning" not in text
    assert "left the corridor or met an obstacle" in " ".join(text.split())


def test_the_worst_scenes_are_driven_again(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    whole = CampaignCase.scenario
    monkeypatch.setattr(
        CampaignCase, "scenario", lambda case: changed(whole(case), {"simulation.duration": 1.0})
    )
    settings = CampaignSettings(count=9, level=Level.NOMINAL, seed=1, problems=Problems.SCENES, deadline=0.5)
    made_up("one", [drive_case(settings.case(0))], settings=settings)
    assert main(["campaign-report", "one", "--worst", "1"]) == 0
    page, numbers = report()
    (one,) = numbers["worst"]
    assert one["command"].endswith(
        "--seed 1 --index 0 --method dynamic --preset default --scenes --deadline 0.5"
    )
    assert "what is solid, path, obstacles, goal, and the driven body" in page


def test_two_campaigns_are_compared(capsys: pytest.CaptureFixture[str]) -> None:
    made_up("one", [docked(0, 20.0), docked(1, 30.0)])
    made_up("two", [docked(0, 40.0), stalled(1)], settings=replace(SETTINGS, preset="paper"))
    assert main(["campaign-report", "one", "--against", "two", "--worst", "0"]) == 0
    assert "1 dock in both, 1 in default only, 0 in paper only" in capsys.readouterr().out
    page, numbers = report()
    self_contained(page)
    assert numbers["against"]["ratios"]["time_to_dock_s"]["p50"] == 0.5
    assert numbers["against"]["lost_by_second"] == [1]
    assert not Path("two/report.html").exists()


@pytest.mark.acceptance
def test_a_real_campaign(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    whole = CampaignCase.scenario

    def cut_short(case: CampaignCase) -> Scenario:
        if case.index == QUICK:
            return load_scenario("soon.toml")
        return changed(whole(case), {"simulation.duration": 0.4})

    Path("soon.toml").write_text(SOON)
    monkeypatch.setattr(CampaignCase, "scenario", cut_short)
    settings = CampaignSettings(count=30, level=Level.NOMINAL, seed=1)
    made_up("one", [drive_case(settings.case(index)) for index in (QUICK, 0)], settings=settings)
    assert main(["campaign-report", "one"]) == 0
    page, numbers = report()
    assert numbers["outcomes"]["docked"] == numbers["outcomes"]["unfinished"] == 1
    assert [(one["index"], one["why"]) for one in numbers["worst"]] == [
        (0, "unfinished"),
        (QUICK, "least clearance"),
    ]
    text = "".join(self_contained(page).text)
    for one in numbers["worst"]:
        assert one["command"] == (
            f"rti-mpcc campaign-case --level nominal --seed 1 --index {one['index']} "
            "--method dynamic --preset default"
        )
        assert one["command"] in text
    assert "came out differently" not in text
    assert text.count("Figure ") == 5  # spread, success, time, and two cases
    assert "1 of 2 cases docked" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["missing"], "missing: is no campaign, it has no campaign.json"),
        (["empty"], "empty/rows.jsonl: has no whole row"),
        (["one", "--against", "missing"], "missing: is no campaign"),
        (
            ["one", "--against", "other"],
            "seed = 1 and 2: campaigns of different seeds have no case in common",
        ),
        (["one", "--worst", "-1"], "'-1' must be an integer >= 0"),
        ([], "the following arguments are required: DIR"),
    ],
)
def test_bad_input_is_refused(capsys: pytest.CaptureFixture[str], arguments: list[str], message: str) -> None:
    made_up("one", [docked(0)])
    made_up("other", [docked(0)], settings=replace(SETTINGS, seed=2))
    made_up("empty", [])
    assert main(["campaign-report", *arguments]) == 2
    said = capsys.readouterr()
    assert message in said.err
    assert said.out == ""
    assert not Path("one/report.html").exists()
