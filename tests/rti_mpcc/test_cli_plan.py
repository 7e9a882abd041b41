"""`rti-mpcc plan`: what it writes, its exit status, and what it refuses."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from geometry import Area, Pose2, ReferencePath
from rti_mpcc import cli
from rti_mpcc.cli import main
from rti_mpcc.config import ControllerConfig
from rti_mpcc.manoeuvre import Manoeuvre, PlanOutcome
from tests.rti_mpcc.planned import manoeuvre_along, no_manoeuvre

HALL = """
name = "hall"
[start]
pose = [0, 0, 0]
[area]
boundary = [[-5, -6], [25, -6], [25, 6], [-5, 6]]
obstacles = [[[8, 3], [10, 3], [10, 5], [8, 5]]]
[goal]
pose = [15, 0, 0]
"""
FILES = {"plan.json", "route.csv", "plan.png"}


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("hall.toml").write_text(HALL)


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> list[tuple[Pose2, Pose2, Area]]:
    """What a planner was asked that goes straight on, whatever there is."""
    asked: list[tuple[Pose2, Pose2, Area]] = []

    def plan(start: Pose2, goal: Pose2, area: Area, config: ControllerConfig) -> Manoeuvre:
        asked.append((start, goal, area))
        return manoeuvre_along(ReferencePath.from_segments(start, [(1, 0.0, 15.0)]), goal)

    monkeypatch.setattr(cli.plan, "plan_manoeuvre", plan)
    return asked


def in_vain(monkeypatch: pytest.MonkeyPatch, **changes: Any) -> None:
    def plan(start: Pose2, goal: Pose2, area: Area, config: ControllerConfig) -> Manoeuvre:
        return no_manoeuvre(start, goal, **changes)

    monkeypatch.setattr(cli.plan, "plan_manoeuvre", plan)


def refusal(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    """The message on stderr of a call that must be refused."""
    assert main(arguments) == 2
    said = capsys.readouterr()
    assert "Traceback" not in said.out + said.err
    assert said.out == ""
    return said.err


def test_a_way_that_is_found_exits_0_and_writes_its_files(
    capsys: pytest.CaptureFixture[str], asked: list[tuple[Pose2, Pose2, Area]]
) -> None:
    assert main(["plan", "hall.toml"]) == 0
    said = capsys.readouterr()
    assert said.err == ""
    assert "min clearance" in said.out
    folder = Path("runs/hall")
    assert {file.name for file in folder.iterdir()} == FILES
    assert all(str(folder / name) in said.out for name in FILES)
    ((start, goal, area),) = asked
    assert (start, goal) == (Pose2(0.0, 0.0, 0.0), Pose2(15.0, 0.0, 0.0))
    assert len(area.obstacles) == 1
    figures = json.loads((folder / "plan.json").read_text())
    assert set(figures) == {"found", "seconds", "length_m", "cusps", "min_clearance_m", "nodes"}
    assert (figures["found"], figures["length_m"], figures["cusps"]) == (True, 15.0, 0)
    assert figures["min_clearance_m"] == pytest.approx(3.0 - 0.5 * 2.069)
    header, *rows = (folder / "route.csv").read_text().splitlines()
    assert header == "s,x,y,heading,curvature,direction,segment"
    assert len(rows) == 301
    assert (folder / "plan.png").read_bytes().startswith(b"\x89PNG")


def test_out_says_where_the_files_go(asked: list[tuple[Pose2, Pose2, Area]]) -> None:
    assert main(["plan", "hall.toml", "--out", "here/there"]) == 0
    assert {file.name for file in Path("here/there").iterdir()} == FILES
    assert not Path("runs").exists()


def test_with_detections_the_plan_ends_at_the_planned_goal(asked: list[tuple[Pose2, Pose2, Area]]) -> None:
    more = "[goal.measurement]\ninitial_offset = [0.5, 0.0, 0.0]\n"
    Path("seen.toml").write_text(HALL + more)
    assert main(["plan", "seen.toml"]) == 0
    assert asked[0][1] == Pose2(15.5, 0.0, 0.0)


def test_no_way_exits_1_says_how_far_it_got_and_leaves_no_old_route(
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    asked: list[tuple[Pose2, Pose2, Area]],
) -> None:
    assert main(["plan", "hall.toml"]) == 0
    in_vain(monkeypatch)
    capsys.readouterr()
    assert main(["plan", "hall.toml"]) == 1
    said = capsys.readouterr()
    assert said.err == ""
    first, second, _ = said.out.splitlines()
    assert first == "hall: no route was found: too narrow"
    assert second == "hall: the search came within 1.50 m of the goal, 1000 nodes expanded in 2.0 s"
    figures = json.loads(Path("runs/hall/plan.json").read_text())
    nothing = dict.fromkeys(("length_m", "cusps", "min_clearance_m"))
    assert figures == {"found": False, "seconds": 2.0, "nodes": 1000, **nothing}
    assert Path("runs/hall/route.csv").read_text() == "s,x,y,heading,curvature,direction,segment\n"


def test_a_goal_in_collision_is_no_bad_input(monkeypatch: pytest.MonkeyPatch) -> None:
    in_vain(monkeypatch, outcome=PlanOutcome.GOAL_IN_COLLISION)
    assert main(["plan", "hall.toml"]) == 1


def test_a_scenario_with_a_path_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    (line,) = refusal(capsys, "plan", "docking_inside").splitlines()
    assert line == (
        "rti-mpcc: error: docking_inside: has a [path], which is driven as it is: "
        "a route is planned only for a scenario with [start], [area] and goal.pose"
    )
    assert not Path("runs").exists()


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("pose = [15, 0, 0]", "", "goal.pose: required"),
        ("[[8, 3], [10, 3], [10, 5], [8, 5]]", "[[8, 3], [10, 5], [10, 3], [8, 5]]", "area.obstacles[0] = "),
        (
            "[[8, 3], [10, 3], [10, 5], [8, 5]]",
            "[[8, 3], [10, nan], [10, 3]]",
            "area.obstacles[0][1][1] = nan",
        ),
        ("boundary = [[-5, -6], [25, -6], [25, 6], [-5, 6]]", 'map = "no.yaml"', "area.map = 'no.yaml': "),
        ("[start]\npose = [0, 0, 0]", "", "start: required"),
    ],
)
def test_bad_input_is_one_line(capsys: pytest.CaptureFixture[str], old: str, new: str, said: str) -> None:
    text = HALL.replace("obstacles = [[[8, 3], [10, 3], [10, 5], [8, 5]]]", "") if "map" in new else HALL
    Path("bad.toml").write_text(text.replace(old, new))
    for command in ("plan", "run"):
        (line,) = refusal(capsys, command, "bad.toml").splitlines()
        assert line.startswith("rti-mpcc: error: bad.toml: ")
        assert said in line
    assert not Path("runs").exists()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["plan"], "required: SCENARIO"),
        (["plan", "nowhere.toml"], "nowhere.toml: cannot be read"),
        (["plan", "hall.toml", "--seed", "1"], "unrecognized arguments"),
        (
            ["run", "hall.toml", "--docking-time", "30"],
            "hall: controller.docking_time = 30.0: only with [path]",
        ),
    ],
)
def test_wrong_arguments_exit_2(
    capsys: pytest.CaptureFixture[str], arguments: list[str], message: str
) -> None:
    assert message in refusal(capsys, *arguments)
    assert not Path("runs").exists()


def test_folder_that_cannot_be_made_is_refused_before_the_search(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(cli.plan, "plan_manoeuvre", None)
    Path("file").write_text("")
    assert "file: " in refusal(capsys, "plan", "hall.toml", "--out", "file")


def test_the_planner_finds_this_one() -> None:
    assert main(["plan", "hall.toml"]) == 0
    figures = json.loads(Path("runs/hall/plan.json").read_text())
    assert figures["min_clearance_m"] > 0.05
    assert figures["length_m"] >= 15.0 - 1e-6
