"""The command line: `run --record` and `replay`."""

from __future__ import annotations

from pathlib import Path

import pytest

from rti_mpcc import cli
from rti_mpcc.cli import main
from rti_mpcc.recording import Machine, read_recording
from rti_mpcc.simulation import changed, load_scenario, save_scenario
from tests.rti_mpcc.cli_runs import write_mission, write_short


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    write_short(0.5)


@pytest.fixture
def recording(capsys: pytest.CaptureFixture[str]) -> Path:
    """Of 11 cycles."""
    assert main(["run", "short.toml", "--no-plots", "--record", "made/run.jsonl"]) == 1
    assert "made/run.jsonl" in capsys.readouterr().out
    return Path("made/run.jsonl")


def refusal(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    assert main(arguments) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert "Traceback" not in said.err
    return said.err


def test_a_recorded_run_replays_identically(recording: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["replay", str(recording)]) == 0
    said = capsys.readouterr()
    assert said.err == ""
    assert said.out == ("identical: 11 cycles compared bit for bit, on the same machine and versions\n")


def test_a_run_in_an_area_is_recorded_and_replays(capsys: pytest.CaptureFixture[str]) -> None:
    scenario = changed(load_scenario("bay_perpendicular"), {"simulation.duration": 1.0})
    file = save_scenario(scenario, Path())
    assert main(["run", str(file), "--no-plots", "--record", "run.jsonl"]) == 1
    assert main(["replay", "run.jsonl"]) == 0
    assert "identical: 21 cycles compared bit for bit" in capsys.readouterr().out


def test_a_mission_is_recorded_and_replays(capsys: pytest.CaptureFixture[str]) -> None:
    write_mission(30.0)
    assert main(["run", "delivery.toml", "--no-plots", "--record", "run.jsonl"]) == 0
    said = capsys.readouterr().out
    for step in ("dock", "wait", "straight", "undock"):
        assert any(f": {step} " in line and "SUCCEEDED" in line for line in said.splitlines()), step
    cycles = read_recording("run.jsonl").cycles
    assert sum(cycle.inputs.signal for cycle in cycles) == 1  # the contact
    assert main(["replay", "run.jsonl"]) == 0
    assert f"identical: {len(cycles)} cycles compared bit for bit" in capsys.readouterr().out


def test_a_recorded_mission_is_the_same_as_one_that_is_not() -> None:
    write_mission(10.0)
    for more, folder in ((["--record", "run.jsonl"], "with"), ([], "without")):
        main(["run", "delivery.toml", "--no-plots", "--seed", "3", "--out", folder, *more])
    assert Path("with/trajectory.csv").read_text() == Path("without/trajectory.csv").read_text()


def test_a_changed_contact_is_shown(capsys: pytest.CaptureFixture[str]) -> None:
    write_mission(10.0)
    main(["run", "delivery.toml", "--no-plots", "--record", "run.jsonl"])
    (touched,) = [cycle for cycle in read_recording("run.jsonl").cycles if cycle.inputs.signal]
    text = Path("run.jsonl").read_text()
    assert text.count('"signal":true') == 1
    Path("run.jsonl").write_text(text.replace('"signal":true', '"signal":false'))
    capsys.readouterr()
    assert main(["replay", "run.jsonl"]) == 1
    said = capsys.readouterr().out
    assert said.startswith(f"different: cycle {touched.number} at ")
    assert "command.mission.result: recorded" in said


def test_options_of_the_run_reach_the_recorded_controller(capsys: pytest.CaptureFixture[str]) -> None:
    main(["run", "short.toml", "--no-plots", "--preset", "paper", "--record", "run.jsonl"])
    assert read_recording("run.jsonl").header.config.cruise_horizon == 7.0
    assert main(["replay", "run.jsonl"]) == 0


def test_a_difference_is_shown_and_exits_1(recording: Path, capsys: pytest.CaptureFixture[str]) -> None:
    lines = recording.read_text().splitlines(keepends=True)
    speed = f'"v":{read_recording(recording).cycles[6].inputs.state.v!r}'
    assert speed in lines[7]
    recording.write_text("".join([*lines[:7], lines[7].replace(speed, '"v":0.05', 1), *lines[8:]]))
    assert main(["replay", str(recording)]) == 1
    said = capsys.readouterr().out.splitlines()
    assert said[0] == "different: cycle 6 at 0.300 s: its line was changed after it was recorded"
    assert said[1].startswith("  command.acceleration: recorded ")
    assert ", difference " in said[1]
    assert said[-1].startswith("7 cycles compared bit for bit")


def test_a_tolerance_is_told(
    recording: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    assert main(["replay", str(recording), "--tolerance", "1e-6"]) == 0
    assert "within 1e-06, on the same machine" in capsys.readouterr().out
    other = Machine(architecture="", processor="", versions={})
    monkeypatch.setattr(Machine, "here", lambda: other)
    assert main(["replay", str(recording)]) == 0
    assert "within 1e-09, on another machine or other versions" in capsys.readouterr().out


def test_a_truncated_recording(recording: Path, capsys: pytest.CaptureFixture[str]) -> None:
    recording.write_bytes(recording.read_bytes()[:-3000])
    message = refusal(capsys, "replay", str(recording))
    assert message == (
        "rti-mpcc: error: made/run.jsonl: is truncated: it holds 10 whole cycles and no end "
        "(replay those with --partial, allow_truncated=True in Python)\n"
    )
    assert main(["replay", str(recording), "--partial"]) == 0
    assert "10 cycles" in (said := capsys.readouterr().out)
    assert said.endswith("; the recording is truncated\n")


def test_what_is_no_recording_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert "short.toml: is not a recording of rti-mpcc" in refusal(capsys, "replay", "short.toml")
    assert "nowhere: cannot be read, No such file" in refusal(capsys, "replay", "nowhere")
    assert "'x' must be a number >= 0" in refusal(capsys, "replay", "short.toml", "--tolerance", "x")
    assert "'nan' must be a number >= 0" in refusal(capsys, "replay", "short.toml", "--tolerance", "nan")


def test_failed_qps_go_where_they_are_asked_for(recording: Path) -> None:
    arguments = ["run", "short.toml", "--no-plots", "--record", "run.jsonl", "--dump-failed", "qp/run"]
    assert main(arguments) == 1
    assert main(["replay", "run.jsonl", "--dump-failed", "qp/replay"]) == 0
    assert Path("qp/run").is_dir()
    assert Path("qp/replay").is_dir()


def test_failed_qps_without_a_recording_are_refused(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(cli.run, "simulate", None)
    assert "--dump-failed needs --record" in refusal(capsys, "run", "short.toml", "--dump-failed", "qp")
    assert not Path("runs").exists()


def test_a_recording_that_cannot_be_made_is_refused_before_the_run(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(cli.run, "simulate", None)
    Path("folder").mkdir()
    assert "folder: Is a directory" in refusal(capsys, "run", "short.toml", "--record", "folder")
