"""Campaigns on a Dask cluster: the same rows, the same care; one sentence where there is none."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from time import monotonic, sleep
from typing import Any

import dask
import distributed
import pytest

from rti_mpcc.errors import CampaignError, InputError, MissingExtraError
from rti_mpcc.simulation.campaign import CampaignSettings, Level, cluster, read_rows, run_campaign
from rti_mpcc.simulation.campaign.case import driven_lines
from rti_mpcc.simulation.campaign.cluster import DaskEngine
from tests.rti_mpcc.simulation.campaign import drives

ROOT = Path(__file__).parents[4]
HARD = CampaignSettings(count=2, level=Level.HARD, seed=11)


@pytest.fixture(scope="module")
def expected() -> list[str]:
    return sorted(driven_lines(drives.short, HARD.case(index)).row for index in range(HARD.count))


def lines(folder: Path) -> list[str]:
    return sorted((folder / "rows.jsonl").read_text().splitlines(keepends=True))


@pytest.mark.acceptance
def test_a_local_cluster_keeps_the_same_rows_and_its_deaths_are_rows(
    tmp_path: Path, expected: list[str]
) -> None:
    made: Any = distributed.LocalCluster  # it has no types
    options = {"n_workers": 2, "threads_per_worker": 1, "dashboard_address": None}
    with (
        dask.config.set({"distributed.scheduler.allowed-failures": 0}),
        made(processes=True, local_directory=tmp_path, **options) as workers,
    ):
        address = workers.scheduler_address
        run_campaign(HARD, tmp_path / "short", engine=DaskEngine(address), drive=drives.short)
        troubled = CampaignSettings(count=4, level=Level.NOMINAL, seed=11)
        run_campaign(troubled, tmp_path / "bad", engine=DaskEngine(address), drive=drives.troubled)
    assert lines(tmp_path / "short") == expected
    rows = {row["index"]: row for row in read_rows(tmp_path / "bad")}
    found = [rows[index]["outcome"] for index in range(4)]
    assert found == ["docked", "raised", "worker_died", "docked"]
    assert rows[2]["course"] is not None


@pytest.mark.acceptance
def test_a_cluster_from_the_command_line_keeps_the_same_rows_until_it_is_lost(
    tmp_path: Path, expected: list[str]
) -> None:
    with scheduler_and_worker(tmp_path) as (address, scheduler):
        run_campaign(HARD, tmp_path / "short", engine=DaskEngine(address), drive=drives.short)
        assert lines(tmp_path / "short") == expected
        settings = CampaignSettings(count=200, level=Level.NOMINAL, seed=11)
        with pytest.raises(CampaignError, match=f"the Dask scheduler at {address} is lost"):
            run_campaign(
                settings,
                tmp_path / "lost",
                engine=DaskEngine(address),
                drive=drives.slow,
                progress=lambda done, total: scheduler.send_signal(signal.SIGKILL) if done == 2 else None,
            )
    assert 2 <= len(list(read_rows(tmp_path / "lost"))) < 200


def test_no_scheduler_is_told_in_one_sentence(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cluster, "CONNECTING", 0.2)
    with pytest.raises(CampaignError, match=r"no Dask scheduler at tcp://127\.0\.0\.1:1: Timed out"):
        run_campaign(HARD, tmp_path, engine=DaskEngine("tcp://127.0.0.1:1"))
    assert lines(tmp_path) == []


@pytest.mark.parametrize("address", ["nowhere", "tcp://nowhere", "x://nowhere:1"])
def test_what_is_no_address_is_refused(tmp_path: Path, address: str) -> None:
    with pytest.raises(InputError, match=f"dask = '{address}': "):
        run_campaign(HARD, tmp_path, engine=DaskEngine(address))


def test_without_the_library_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(MissingExtraError, match=r"pip install '.\[cluster\]'"):
        DaskEngine("tcp://127.0.0.1:1")


@contextmanager
def scheduler_and_worker(folder: Path) -> Iterator[tuple[str, subprocess.Popen[bytes]]]:
    """Both from the command line, on loopback; the scheduler may be ended by the caller."""
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    told = folder / "scheduler.json"
    common = [sys.executable, "-m", "dask"]
    scheduling = ["scheduler", "--host", "127.0.0.1", "--port", "0", "--scheduler-file", str(told)]
    working = ["--nthreads", "1", "--nworkers", "1", "--local-directory", str(folder)]
    with (folder / "log").open("wb") as log:
        scheduler = subprocess.Popen(
            [*common, *scheduling, "--no-dashboard"], env=environment, stdout=log, stderr=log
        )
        worker = None
        try:
            address = _address(told)
            worker = subprocess.Popen(
                [*common, "worker", address, *working, "--no-dashboard", "--death-timeout", "5"],
                env=environment,
                stdout=log,
                stderr=log,
            )
            yield address, scheduler
        finally:
            for process in filter(None, (worker, scheduler)):
                process.terminate()
                process.wait(30.0)


def _address(told: Path) -> str:
    """What a scheduler has written to its file, once it has."""
    end = monotonic() + 60.0
    while True:
        assert monotonic() < end
        try:
            return str(json.loads(told.read_text())["address"])
        except (FileNotFoundError, ValueError):
            sleep(0.05)
