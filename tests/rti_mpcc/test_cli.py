"""The command line: what it writes, its exit status, and one clear message on bad input."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from rti_mpcc import cli
from rti_mpcc.cli import main
from rti_mpcc.simulation import summary

SCENARIO = """
name = "short"
[path]
start = [0, 0, 0]
segments = [{ direction = 1, curvature = CURVATURE, length = 6.0 }]
[corridor]
left = 4
right = -4
[simulation]
duration = DURATION
"""


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def scenario_file(*, curvature: float = 0.0, duration: float = 30.0) -> str:
    text = SCENARIO.replace("CURVATURE", str(curvature)).replace("DURATION", str(duration))
    Path("short.toml").write_text(text)
    return "short.toml"


def refusal(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    """The message on stderr of a call that must be refused."""
    assert main(arguments) == 2
    said = capsys.readouterr()
    assert "Traceback" not in said.out + said.err
    assert said.out == ""
    return said.err


def test_scenarios_lists_the_built_in_ones(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["scenarios"]) == 0
    lines = capsys.readouterr().out.splitlines()
    names = [
        "aisle_dock",
        "bay_perpendicular",
        "docking_behind",
        "docking_blackout",
        "docking_full_course",
        "docking_inside",
        "docking_mission",
        "docking_moving_goal",
        "docking_noisy",
        "long_approach",
        "obstacle_appears",
        "path_following",
        "slot_parallel",
        "yard_dead_end",
    ]
    assert [line.split()[0] for line in lines] == names
    assert all(len(line.split()) > 3 for line in lines)


def test_docked_run_prints_a_table_writes_its_files_and_exits_0(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", scenario_file()]) == 0
    said = capsys.readouterr()
    assert "time to dock" in said.out
    assert said.err == ""
    folder = Path("runs/short")
    names = {"summary.json", "trajectory.csv", "overview.png", "timeline.png"}
    assert {file.name for file in folder.iterdir()} == names
    written = json.loads((folder / "summary.json").read_text())
    assert written["docked"] is True
    assert (written["scenario"], written["method"], written["preset"], written["seed"]) == (
        "short",
        "dynamic",
        "default",
        0,
    )
    assert all(str(folder / name) in said.out for name in names)


def test_options_reach_the_run() -> None:
    arguments = [
        "--method",
        "dynamic",
        "--preset",
        "paper",
        "--seed",
        "7",
        "--out",
        "here/there",
        "--no-plots",
    ]
    assert main(["run", scenario_file(duration=0.2), *arguments]) == 1
    written = json.loads(Path("here/there/summary.json").read_text())
    assert (written["preset"], written["seed"]) == ("paper", 7)
    assert {file.name for file in Path("here/there").iterdir()} == {"summary.json", "trajectory.csv"}


DETECTED = """
[goal.measurement]
initial_offset = [0.1, 0.0, 0.0]
"""


@pytest.mark.parametrize(
    ("arguments", "source"),
    [([], "detected"), *[(["--goal-source", source], source) for source in ("detected", "raw", "known")]],
)
def test_goal_source_reaches_the_run(arguments: list[str], source: str) -> None:
    Path("seen.toml").write_text(Path(scenario_file(duration=0.2)).read_text() + DETECTED)
    assert main(["run", "seen.toml", "--no-plots", *arguments]) == 1
    assert json.loads(Path("runs/short/summary.json").read_text())["goal"]["source"] == source


def test_goal_source_without_detections_is_refused_before_anything_is_written(
    capsys: pytest.CaptureFixture[str],
) -> None:
    for source in ("raw", "known"):
        (line,) = refusal(capsys, "run", scenario_file(), "--goal-source", source).splitlines()
        assert line == (
            f"rti-mpcc: error: goal_source = '{source}': must be 'detected', the default, "
            "in a scenario without [goal.measurement] such as short"
        )
    assert not Path("runs").exists()
    assert main(["run", scenario_file(duration=0.2), "--no-plots", "--goal-source", "detected"]) == 1
    assert json.loads(Path("runs/short/summary.json").read_text())["goal"] is None


def test_run_that_does_not_dock_exits_1() -> None:
    assert main(["run", scenario_file(duration=0.5), "--no-plots"]) == 1
    written = json.loads(Path("runs/short/summary.json").read_text())
    assert (written["docked"], written["time_to_dock_s"]) == (False, None)


@pytest.mark.parametrize(("clearance", "status"), [(0.01, 0), (None, 0), (-0.001, 1)])
def test_contact_exits_1_even_when_docked(
    monkeypatch: pytest.MonkeyPatch, clearance: float | None, status: int
) -> None:
    def docked(result: Any) -> dict[str, Any]:
        return {**summary(result), "docked": True, "min_clearance_m": clearance}

    monkeypatch.setattr(cli.run, "summary", docked)
    assert main(["run", scenario_file(duration=0.2), "--no-plots"]) == status


def test_too_sharp_a_path_is_told_on_stderr(capsys: pytest.CaptureFixture[str]) -> None:
    main(["run", scenario_file(curvature=0.26, duration=0.2), "--no-plots"])
    line, change = capsys.readouterr().err.splitlines()
    assert line.startswith("rti-mpcc: warning: short.toml: path: its largest curvature 0.26 1/m")
    assert "the path, part 0, theta = 0.00 to" in change
    assert change.endswith("left as it is, no smooth way is clear there")


def test_warnings_leave_no_handler_behind(capsys: pytest.CaptureFixture[str]) -> None:
    for _ in range(2):
        main(["run", scenario_file(curvature=0.26, duration=0.2), "--no-plots"])
        assert len(capsys.readouterr().err.splitlines()) == 2


def test_bad_scenarios_have_one_line_a_problem(capsys: pytest.CaptureFixture[str]) -> None:
    Path("bad.toml").write_text(Path(scenario_file()).read_text() + "cycle = 9\nspeed = 3\n")
    lines = refusal(capsys, "run", "bad.toml").splitlines()
    assert lines[0] == "rti-mpcc: error: bad.toml: simulation.cycle = 9: must be <= 0.2"
    assert lines[1].startswith(
        "rti-mpcc: error: bad.toml: simulation.speed = 3: unknown key, allowed are plant_step"
    )
    assert len(lines) == 2
    assert not Path("runs").exists()


def test_files_that_are_not_there_or_not_toml(capsys: pytest.CaptureFixture[str]) -> None:
    assert "nowhere.toml: cannot be read, No such file" in refusal(capsys, "run", "nowhere.toml")
    assert "docking: must be a .toml file or one of aisle_dock" in refusal(capsys, "run", "docking")
    Path("broken.toml").write_text("name = ")
    assert "broken.toml: is not TOML" in refusal(capsys, "run", "broken.toml")
    Path("binary.toml").write_bytes(b"\xff\xfe")
    assert "binary.toml: is not UTF-8 text" in refusal(capsys, "run", "binary.toml")


def test_bad_path_file_is_named(capsys: pytest.CaptureFixture[str]) -> None:
    Path("bad.toml").write_text('name = "bad"\n[path]\nfile = "no.csv"\n[corridor]\nleft = 3\nright = -3\n')
    message = refusal(capsys, "run", "bad.toml")
    assert "bad.toml: path.file" in message
    assert "no.csv" in message


def test_folder_that_cannot_be_made_is_refused_before_the_run(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(cli.run, "simulate", None)
    Path("file").write_text("")
    assert "file: " in refusal(capsys, "run", scenario_file(), "--out", "file")
    assert "file/below: " in refusal(capsys, "run", scenario_file(), "--out", "file/below")


def test_file_that_cannot_be_written_is_named(capsys: pytest.CaptureFixture[str]) -> None:
    Path("out/summary.json").mkdir(parents=True)
    message = refusal(capsys, "run", scenario_file(duration=0.2), "--out", "out", "--no-plots")
    assert "out/summary.json: " in message


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([], "required: COMMAND"),
        (["dock"], "invalid choice: 'dock'"),
        (["run"], "required: SCENARIO"),
        (["run", "docking_inside", "--method", "best"], "invalid choice: 'best'"),
        (["run", "docking_inside", "--preset", "best"], "invalid choice: 'best'"),
        (["run", "docking_noisy", "--goal-source", "radar"], "invalid choice: 'radar'"),
        (["run", "docking_inside", "--seed", "-1"], "'-1' must be an integer >= 0"),
        (["run", "docking_inside", "--seed", "1.5"], "'1.5' must be an integer >= 0"),
        (["run", "docking_inside", "--fast"], "unrecognized arguments: --fast"),
    ],
)
def test_wrong_arguments_exit_2(
    capsys: pytest.CaptureFixture[str], arguments: list[str], message: str
) -> None:
    assert message in refusal(capsys, *arguments)


@pytest.mark.parametrize("arguments", [["--help"], ["run", "--help"]])
def test_help_exits_0(capsys: pytest.CaptureFixture[str], arguments: list[str]) -> None:
    assert main(arguments) == 0
    assert "usage: rti-mpcc" in capsys.readouterr().out


def test_interrupt_leaves_no_traceback(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(*_: Any, **__: Any) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(cli.run, "simulate", interrupted)
    assert main(["run", scenario_file()]) == 130
    assert capsys.readouterr().err == "rti-mpcc: error: interrupted\n"


def test_module_is_the_command() -> None:
    root = str(Path(__file__).parents[2])
    done = subprocess.run(
        [sys.executable, "-m", "rti_mpcc", "run", "nothing"],
        env=os.environ | {"PYTHONPATH": root},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 2
    assert done.stderr.startswith("rti-mpcc: error: nothing: must be a .toml file or one of")
