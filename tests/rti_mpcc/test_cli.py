"""The command line: `run` and `scenarios`, exit statuses, and one clear message on bad input."""

from __future__ import annotations

import json
import logging
from pathlib import Path
from typing import Any

import pytest

from rti_mpcc.cli import main
from rti_mpcc.simulation import builtin_names, save_scenario
from tests.lists import acceptance
from tests.processes import fresh
from tests.rti_mpcc.cli_runs import Printed, refused, write_short
from tests.rti_mpcc.short_missions import short

FOLDER = Path("runs/short")


@pytest.fixture(autouse=True)
def _short(elsewhere: Path) -> None:
    write_short(0.2)


def figures(folder: Path = FOLDER) -> dict[str, Any]:
    found: dict[str, Any] = json.loads((folder / "summary.json").read_text())
    return found


def test_scenarios_lists_the_built_in_ones(capsys: Printed) -> None:
    assert main(["scenarios"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines] == list(builtin_names())
    assert all(len(line.split()) > 3 for line in lines)


def test_docked_run_prints_a_table_writes_its_files_and_exits_0(capsys: Printed) -> None:
    write_short(30.0, "cycle = 0.1\n")
    assert main(["run", "short.toml"]) == 0
    said = capsys.readouterr()
    assert ("time to dock" in said.out, said.err) == (True, "")
    names = {"summary.json", "trajectory.csv", "overview.png", "timeline.png"}
    assert {file.name for file in FOLDER.iterdir()} == names
    assert all(str(FOLDER / name) in said.out for name in names)
    told, expected = figures(), {"docked": True, "scenario": "short", "method": "dynamic", "seed": 0}
    assert expected | {"preset": "default"} == {name: told[name] for name in (*expected, "preset")}


def test_options_reach_the_run_which_exits_1_where_it_does_not_dock() -> None:
    options = "--method dynamic --preset paper --seed 7 --out here/there --no-plots"
    assert main(["run", "short.toml", *options.split()]) == 1
    told, expected = figures(Path("here/there")), {"preset": "paper", "seed": 7, "time_to_dock_s": None}
    assert expected | {"docked": False} == {name: told[name] for name in (*expected, "docked")}
    assert {file.name for file in Path("here/there").iterdir()} == {"summary.json", "trajectory.csv"}


def test_goal_source_without_detections_is_refused(capsys: Printed) -> None:
    assert refused(capsys, "run", "short.toml", "--goal-source", "raw") == (
        "rti-mpcc: error: goal_source = 'raw': must be 'detected', the default, "
        "in a scenario without [goal.measurement] such as short\n"
    )
    assert not Path("runs").exists()


@pytest.mark.parametrize(("ahead", "status"), [(3.0, 0), (0.02, 1)])
def test_contact_exits_1_even_when_docked(ahead: float, status: int) -> None:
    """For two seconds something is so far [m] ahead of the vehicle: less than it needs to stop."""
    write_short(40.0, f'cycle = 0.1\n[[faults]]\nkind = "blocked"\nfrom = 4.0\nto = 6.0\nsize = {ahead}\n')
    assert main(["run", "short.toml", "--no-plots"]) == status
    assert figures()["docked"]
    assert (figures()["min_clearance_m"] < 0.0) == (status == 1)


LATE = {"kind": "undock", "distance": 5.0, "timeout": 1.0}


@pytest.mark.parametrize(
    ("steps", "status", "lines"),
    [
        (None, 0, ["step 2: straight"]),
        acceptance([{"kind": "dock"}, LATE], 1, ["step 1: undock: TIMED_OUT: not over after 1 s"]),
        # Of a step that is tried again the last try counts.
        (
            [{"kind": "dock", "timeout": 4.0, "retries": 3}],
            0,
            ["step 0: dock, try 2", "step 0: dock: TIMED_OUT: not over after 4 s"],
        ),
        # A mission that continues after a failure did not succeed with all steps.
        ([{"kind": "dock"}, LATE | {"then": "continue"}, {"kind": "wait", "seconds": 0.1}], 1, ["SUCCEEDED"]),
    ],
)
def test_the_status_says_whether_all_steps_succeeded(
    capsys: Printed, steps: Any, status: int, lines: list[str]
) -> None:
    file = save_scenario(short() if steps is None else short(mission=steps), Path())
    assert main(["run", str(file), "--no-plots", "--out", "out"]) == status
    said = capsys.readouterr().out
    assert all(line in said for line in lines)


def test_too_sharp_a_path_is_told_on_stderr_once_a_run(capsys: Printed) -> None:
    write_short(0.2, curvature=0.26)
    for _ in range(2):
        main(["run", "short.toml", "--no-plots"])
        line, change = capsys.readouterr().err.splitlines()
        assert line.startswith("rti-mpcc: warning: short.toml: path: its largest curvature 0.26 1/m")
        assert "the path, segment 0, theta = 0.00 to" in change


def test_bad_scenarios_have_one_line_a_problem(capsys: Printed) -> None:
    write_short(0.2, "cycle = 9\nspeed = 3\n")
    first, second = refused(capsys, "run", "short.toml").splitlines()
    assert first == "rti-mpcc: error: short.toml: simulation.cycle = 9: must be <= 0.2"
    assert second.startswith("rti-mpcc: error: short.toml: simulation.speed = 3: unknown key, allowed are ")
    assert not Path("runs").exists()


def test_files_that_are_not_there_or_not_toml(capsys: Printed) -> None:
    Path("broken.toml").write_text("name = ")
    Path("binary.toml").write_bytes(b"\xff\xfe")
    Path("path.toml").write_text('name = "bad"\n[path]\nfile = "no.csv"\n[corridor]\nleft = 3\nright = -3\n')
    for name, message in (
        ("nowhere.toml", "nowhere.toml: cannot be read, No such file"),
        ("docking", "docking: must be a .toml file or one of aisle_dock"),
        ("broken.toml", "broken.toml: is not TOML"),
        ("binary.toml", "binary.toml: is not UTF-8 text"),
        ("path.toml", "path.toml: path.file"),
    ):
        assert message in refused(capsys, "run", name)


@pytest.mark.parametrize("command", ["run", "plan"])
def test_folder_that_cannot_be_made_is_refused_before_the_run(
    capsys: Printed, caplog: pytest.LogCaptureFixture, command: str
) -> None:
    caplog.set_level(logging.INFO, logger="rti_mpcc")
    Path("file").write_text("")
    scenario = {"run": "short.toml", "plan": "bay_perpendicular"}[command]
    assert "file: " in refused(capsys, command, scenario, "--out", "file")
    assert "file/below: " in refused(capsys, command, scenario, "--out", "file/below")
    assert caplog.messages == []  # a controller that is made tells its vehicle


def test_file_that_cannot_be_written_is_named(capsys: Printed) -> None:
    Path("out/summary.json").mkdir(parents=True)
    assert "out/summary.json: " in refused(capsys, "run", "short.toml", "--out", "out", "--no-plots")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ("", "required: COMMAND"),
        ("dock", "invalid choice: 'dock'"),
        ("run", "required: SCENARIO"),
        ("run docking_inside --method best", "invalid choice: 'best'"),
        ("run docking_inside --preset best", "invalid choice: 'best'"),
        ("run docking_noisy --goal-source radar", "invalid choice: 'radar'"),
        ("run docking_inside --seed -1", "'-1' must be an integer >= 0"),
        ("run docking_inside --seed 1.5", "'1.5' must be an integer >= 0"),
        ("run docking_inside --fast", "unrecognized arguments: --fast"),
        ("run bay_perpendicular --docking-time 30", "controller.docking_time = 30.0: only with [path]"),
        ("run short.toml --dump-failed qp", "--dump-failed needs --record"),
        ("plan", "required: SCENARIO"),
        ("plan nowhere.toml", "nowhere.toml: cannot be read"),
        ("plan bay_perpendicular --seed 1", "unrecognized arguments"),
        (
            "plan docking_inside",
            "docking_inside: has a [path], which is driven as it is: a route is planned only",
        ),
        ("docks", "required: FILE"),
        ("docks none.toml", "none.toml: cannot be read, "),
        ("compare", "required: SCENARIO"),
        ("compare nowhere", "nowhere"),
        ("compare short.toml --methods best", "invalid choice: 'best'"),
        ("compare short.toml --presets best", "invalid choice: 'best'"),
        ("compare short.toml --jobs 0", "'0' must be an integer >= 1"),
        ("replay short.toml", "short.toml: is not a recording of rti-mpcc"),
        ("replay nowhere", "nowhere: cannot be read, No such file"),
        ("replay short.toml --tolerance x", "'x' must be a number >= 0"),
        ("replay short.toml --tolerance nan", "'nan' must be a number >= 0"),
    ],
)
def test_wrong_arguments_exit_2(capsys: Printed, arguments: str, message: str) -> None:
    assert message in refused(capsys, *arguments.split())
    assert not Path("runs").exists()


@pytest.mark.parametrize("arguments", [["--help"], ["run", "--help"]])
def test_help_exits_0(capsys: Printed, arguments: list[str]) -> None:
    assert main(arguments) == 0
    assert "usage: rti-mpcc" in capsys.readouterr().out


class Interrupting(logging.Handler):
    """Ctrl+C when the controller of a run tells its vehicle."""

    def emit(self, record: logging.LogRecord) -> None:
        raise KeyboardInterrupt


def test_interrupt_leaves_no_traceback(capsys: Printed, caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.INFO, logger="rti_mpcc")
    log, handler = logging.getLogger("rti_mpcc"), Interrupting()
    log.addHandler(handler)
    try:
        assert main(["run", "short.toml"]) == 130
    finally:
        log.removeHandler(handler)
    assert capsys.readouterr().err == "rti-mpcc: error: interrupted\n"


def test_module_is_the_command() -> None:
    done = fresh("-m", "rti_mpcc", "run", "nothing")
    assert done.returncode == 2
    assert done.stderr.startswith("rti-mpcc: error: nothing: must be a .toml file or one of")
