"""Campaigns on processes: the same rows from one and two, no worker left behind, deaths that are rows."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from pathlib import Path
from time import monotonic, sleep

import pytest

from rti_mpcc.errors import CampaignError, InputError
from rti_mpcc.simulation.batch import THREADS
from rti_mpcc.simulation.campaign import CampaignSettings, Level, ProcessEngine, read_rows, run_campaign
from rti_mpcc.simulation.campaign.case import driven_lines
from tests.rti_mpcc.simulation.campaign import drives
from tests.rti_mpcc.simulation.campaign.engines import Puppet

ROOT = Path(__file__).parents[4]
HARD = CampaignSettings(count=2, level=Level.HARD, seed=11)
SCRIPT = """
import sys
from pathlib import Path
from rti_mpcc.simulation.campaign import CampaignSettings, Level, ProcessEngine, run_campaign
from tests.rti_mpcc.simulation.campaign import drives

if __name__ == "__main__":
    settings = CampaignSettings(count=100, level=Level.NOMINAL, seed=11)
    run_campaign(settings, Path(sys.argv[1]), engine=ProcessEngine(2), drive=drives.slow)
"""


def lines(folder: Path) -> list[str]:
    return (folder / "rows.jsonl").read_text().splitlines(keepends=True)


def test_two_processes_keep_the_rows_of_this_one(tmp_path: Path) -> None:
    before = {name: os.environ.get(name) for name in THREADS}
    run_campaign(HARD, tmp_path, engine=ProcessEngine(2), drive=drives.short)
    assert sorted(lines(tmp_path)) == [driven_lines(drives.short, HARD.case(index)).row for index in range(2)]
    assert {name: os.environ.get(name) for name in THREADS} == before


@pytest.mark.acceptance
@pytest.mark.parametrize("jobs", [pytest.param(1, marks=pytest.mark.acceptance), 2])
def test_cases_that_raise_or_end_their_process_are_rows(tmp_path: Path, jobs: int) -> None:
    settings = CampaignSettings(count=6, level=Level.NOMINAL, seed=11)
    run_campaign(settings, tmp_path, engine=ProcessEngine(jobs), drive=drives.troubled)
    rows = {row["index"]: row for row in read_rows(tmp_path)}
    found = [rows[index]["outcome"] for index in range(6)]
    assert found == ["docked", "raised", "worker_died", "docked", "raised", "docked"]
    assert rows[2]["course"] is not None


@pytest.mark.acceptance
def test_one_job_drives_one_case_at_a_time(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(drives.JOURNAL, str(tmp_path / "journal"))
    settings = CampaignSettings(count=4, level=Level.NOMINAL, seed=11)
    run_campaign(settings, tmp_path, engine=ProcessEngine(1), drive=drives.alone)
    assert {row["outcome"] for row in read_rows(tmp_path)} == {"docked"}
    assert os.getpid() not in workers_of(tmp_path / "journal")


@pytest.mark.acceptance
def test_an_interrupted_campaign_keeps_its_rows_and_leaves_no_workers(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(drives.JOURNAL, str(tmp_path / "journal"))

    def enough(done: int, total: int) -> None:
        if done == 3:
            raise KeyboardInterrupt

    settings = CampaignSettings(count=20, level=Level.NOMINAL, seed=11)
    with pytest.raises(KeyboardInterrupt):
        run_campaign(settings, tmp_path, engine=ProcessEngine(2), drive=drives.slow, progress=enough)
    assert len(lines(tmp_path)) == 3
    eventually(lambda: not any(map(runs, workers_of(tmp_path / "journal"))))


def test_an_engine_without_workers_is_refused() -> None:
    with pytest.raises(InputError, match="jobs = 0: must be >= 1"):
        ProcessEngine(0)
    assert ProcessEngine().jobs == (os.cpu_count() or 1)


def test_processes_that_cannot_start_end_the_campaign(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Else every case would be taken for one that ends its worker."""
    monkeypatch.setattr("rti_mpcc.simulation.campaign.engine._begin_worker", drives.made_up)
    with pytest.raises(CampaignError, match="worker processes cannot be started"):
        run_campaign(HARD, tmp_path, engine=ProcessEngine(1), drive=drives.made_up)
    assert lines(tmp_path) == []


@pytest.mark.acceptance
@pytest.mark.skipif(sys.platform != "linux", reason="looks for processes in /proc")
def test_a_killed_campaign_is_gone_on_with_and_leaves_no_workers(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder, journal = tmp_path / "killed", tmp_path / "journal"
    environment = os.environ | {"PYTHONPATH": str(ROOT), drives.JOURNAL: str(journal)}
    script = tmp_path / "script.py"
    script.write_text(SCRIPT)
    command = [sys.executable, str(script), str(folder)]
    with subprocess.Popen(command, env=environment, stderr=subprocess.DEVNULL) as campaign:
        eventually(lambda: len(workers_of(journal)) == 2 and len(lines(folder)) >= 5)
        campaign.send_signal(signal.SIGKILL)
    eventually(lambda: not any(map(runs, workers_of(journal))))
    kept = [json.loads(line)["index"] for line in lines(folder) if line.endswith("\n")]
    assert 5 <= len(kept) < 100
    settings = CampaignSettings(count=100, level=Level.NOMINAL, seed=11)
    journal.unlink()
    monkeypatch.setenv(drives.JOURNAL, str(journal))
    run_campaign(settings, folder, engine=Puppet(), drive=drives.made_up)
    again = [index for index, _ in drives.begun(journal)]
    assert sorted([*kept, *again]) == list(range(100))
    run_campaign(settings, tmp_path / "whole", engine=Puppet(), drive=drives.made_up)
    assert sorted(lines(folder)) == sorted(lines(tmp_path / "whole"))


def workers_of(journal: Path) -> set[int]:
    return {pid for _, pid in drives.begun(journal)}


def runs(pid: int) -> bool:
    """Whether a process is there and has not ended."""
    try:
        status = Path(f"/proc/{pid}/stat").read_text()
    except FileNotFoundError:
        return False
    return status.rpartition(")")[2].split()[0] != "Z"


def eventually(condition: object, within: float = 60.0) -> None:
    assert callable(condition)
    end = monotonic() + within
    while not condition():
        assert monotonic() < end
        sleep(0.02)
