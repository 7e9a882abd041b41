"""What was not written is not said to be written."""

from __future__ import annotations

import errno
import io
import logging
import os
from pathlib import Path

import pytest

from rti_mpcc import VehicleState
from rti_mpcc.cli import main
from rti_mpcc.recording import Recorder, recorder
from rti_mpcc.simulation import docking_controller, load_scenario

FULL = Path("/dev/full")
SCENARIO = """name = "short"
[path]
start = [0.0, 0.0, 0.0]
segments = [{ direction = 1, curvature = 0.0, length = 10.0 }]
[corridor]
left = 3.0
right = -3.0
[simulation]
duration = 0.3
"""


class FullAtItsEnd(io.BytesIO):
    """Says only when it is closed that nothing was kept, as files over a network do."""

    def close(self) -> None:
        raise OSError(errno.EDQUOT, os.strerror(errno.EDQUOT))


def stepped(made: Recorder) -> None:
    made.step(VehicleState(x=0.0, y=0.0, phi=0.0, v=0.0, delta=0.0), now=0.0)


@pytest.fixture
def scenario(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    monkeypatch.chdir(tmp_path)
    Path("short.toml").write_text(SCENARIO, encoding="utf-8")
    return "short.toml"


@pytest.mark.skipif(not FULL.exists(), reason="there is no full disk")
def test_a_recording_to_a_full_disk_is_not_said_to_be_written(
    scenario: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["run", scenario, "--no-plots", "--record", str(FULL)]) == 2
    told = capsys.readouterr()
    assert str(FULL) not in told.out
    assert "summary.json" in told.out
    error = f"rti-mpcc: error: {FULL}: does not hold the whole run: [Errno 28] No space left on device"
    assert told.err.splitlines()[-1] == error


def test_a_recording_that_is_whole_is_said_to_be_written(
    scenario: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["run", scenario, "--no-plots", "--record", "run.jsonl"]) == 1  # it does not dock so soon
    told = capsys.readouterr()
    assert "run.jsonl" in told.out
    assert told.err == ""


def test_a_recorder_says_why_its_file_is_not_whole(
    scenario: str, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    with Recorder(docking_controller(load_scenario(scenario)), "run.jsonl") as made:
        stepped(made)
    assert made.problem == ""
    monkeypatch.setattr(recorder, "open", lambda *_: FullAtItsEnd(), raising=False)
    with (
        caplog.at_level(logging.ERROR),
        Recorder(docking_controller(load_scenario(scenario)), "run.jsonl") as made,
    ):
        stepped(made)
    assert made.problem == f"[Errno {errno.EDQUOT}] {os.strerror(errno.EDQUOT)}"
    (message,) = caplog.messages
    assert message.startswith("recording has ended, its file cannot be written: ")


@pytest.mark.skipif(not FULL.exists(), reason="there is no full disk")
@pytest.mark.parametrize("file", ["summary.json", "trajectory.csv", "overview.png"])
def test_no_file_of_a_run_is_said_to_be_written_to_a_full_disk(
    file: str, scenario: str, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = Path("runs")
    folder.mkdir()
    (folder / file).symlink_to(FULL)
    assert main(["run", scenario, "--out", str(folder)]) == 2
    told = capsys.readouterr()
    assert "written" not in told.out
    (line,) = told.err.splitlines()
    assert "No space left on device" in line
