"""What was not written is not said to be written."""

from __future__ import annotations

from pathlib import Path

import pytest

from rti_mpcc.cli import main
from tests.rti_mpcc.cli_runs import write_short

FULL = Path("/dev/full")


@pytest.fixture
def scenario(elsewhere: Path) -> str:
    write_short(0.3)
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
