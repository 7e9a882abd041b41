"""The command line: `plan`, `docks` and `compare`: what they print and write, and their exit status."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from PIL import Image

from rti_mpcc.cli import main
from tests.rti_mpcc.cli_runs import Printed, refused, write_short
from tests.rti_mpcc.dock_files import FIRST, SECOND, written

BLOCK = "[[8, 3], [10, 3], [10, 5], [8, 5]]"
HALL = f"""
name = "hall"
[start]
pose = [0, 0, 0]
[area]
boundary = [[-5, -6], [25, -6], [25, 6], [-5, 6]]
obstacles = [{BLOCK}]
[goal]
pose = [15, 0, 0]
"""
FILES = {"plan.json", "route.csv", "plan.png"}


@pytest.fixture(autouse=True)
def _files(elsewhere: Path) -> None:
    Path("hall.toml").write_text(HALL)
    written(elsewhere, FIRST + SECOND)
    write_short(0.3)


def test_a_route_that_is_found_exits_0_and_writes_its_files(capsys: Printed) -> None:
    assert main(["plan", "hall.toml", "--out", "here/there"]) == 0
    said = capsys.readouterr()
    assert said.err == ""
    assert all(word in said.out for word in ("min clearance", *(f"here/there/{name}" for name in FILES)))
    folder = Path("here/there")
    assert {file.name for file in folder.iterdir()} == FILES
    figures = json.loads((folder / "plan.json").read_text())
    assert (figures["found"], figures["length_m"], figures["cusps"]) == (True, pytest.approx(15.0), 0)
    assert figures["min_clearance_m"] == pytest.approx(3.0 - 0.5 * 2.069)
    assert len((folder / "route.csv").read_text().splitlines()) >= 302  # at most 0.05 m apart


def test_no_route_exits_1_says_how_far_it_got_and_leaves_no_old_route(
    capsys: Printed,
) -> None:
    assert main(["plan", "hall.toml"]) == 0
    Path("hall.toml").write_text(HALL.replace(BLOCK, "[[8, -6], [10, -6], [10, 6], [8, 6]]"))
    capsys.readouterr()
    assert main(["plan", "hall.toml"]) == 1
    said = capsys.readouterr()
    assert said.err == ""
    why, how_far = said.out.splitlines()[:2]
    assert why.startswith("hall: no route was found: all ")
    assert how_far.startswith("hall: the search came within 15.00 m of the goal, ")
    assert json.loads(Path("runs/hall/plan.json").read_text())["found"] is False
    assert Path("runs/hall/route.csv").read_text() == "s,x,y,heading,curvature,direction,segment\n"


def test_docks_are_listed_and_drawn(capsys: Printed) -> None:
    assert main(["docks", "yard.toml"]) == 0
    said = capsys.readouterr()
    assert said.err == ""
    words = ["yard.toml", "heading [deg]", "first", "charuco", "10.00, 5.00, 90.0", "2 in reverse"]
    words += ["0.05, 0.02, 0.57", "-1.3", "second", "known", "20.00, 5.00, 0.0", "runs/yard/docks.png"]
    for word in words:
        assert word in said.out
    assert Path("runs/yard/docks.png").read_bytes().startswith(b"\x89PNG")


def test_every_method_and_preset_is_compared(capsys: Printed) -> None:
    asked = ["--methods", "dynamic", "constant_50", "--presets", "paper", "default"]
    assert main(["compare", "short.toml", *asked, "--jobs", "1", "--out", "there"]) == 0
    said = capsys.readouterr()
    assert said.err == ""
    found: list[dict[str, Any]] = json.loads(Path("there/comparison.json").read_text())
    assert [(run["scenario"], run["preset"], run["method"]) for run in found] == [
        ("short", preset, method) for preset in ("paper", "default") for method in ("dynamic", "constant_50")
    ]
    assert found[0]["ratios"]["energy.acceleration"] == 1.0
    for word in ("dynamic", "(paper)", "constant_50", "energy acceleration, ratio", "there/comparison.json"):
        assert word in said.out


def test_two_scenarios_of_one_name_are_refused(capsys: Printed) -> None:
    Path("other.toml").write_text(Path("short.toml").read_text())
    told = "short.toml and other.toml have the same name, 'short': give each its own"
    assert refused(capsys, "compare", "short.toml", "other.toml") == f"rti-mpcc: error: {told}\n"
    assert not Path("runs").exists()


def test_compared_runs_are_animated_side_by_side(capsys: Printed) -> None:
    assert main(["compare", "short.toml", "--methods", "dynamic", "switched", "--animate"]) == 0
    (file,) = (file for file in Path("runs/compare").iterdir() if file.stem == "short")
    assert str(file) in capsys.readouterr().out
    if file.suffix == ".gif":
        with Image.open(file) as picture:
            picture.seek(1)  # raises where there is one frame only
