"""Campaigns: the same rows whatever drives them, and a case that goes wrong is a row, not the end."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import distributed
import pytest

from rti_mpcc.errors import CampaignError, InputError
from rti_mpcc.simulation.campaign import TIMES, drive_case, read_rows, run_campaign
from tests.lists import acceptance
from tests.rti_mpcc.simulation.drives import ShortCase, made_up, troubled

CASES = [ShortCase(index=index) for index in range(8)]


@pytest.fixture(scope="module")
def cluster(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """Address of a real cluster of two processes on this machine."""
    options = {"n_workers": 2, "threads_per_worker": 1, "dashboard_address": None}
    made: Any = distributed.LocalCluster  # it has no types
    with made(processes=True, local_directory=tmp_path_factory.mktemp("dask"), **options) as workers:
        yield workers.scheduler_address


def by_index(folder: Path, file: str = "rows.jsonl") -> dict[int, dict[str, Any]]:
    rows = read_rows(folder, file)
    assert len({row["index"] for row in rows}) == len(rows)
    return {row["index"]: row for row in rows}


@pytest.fixture(scope="module")
def expected() -> dict[int, dict[str, Any]]:
    return {case.index: drive_case(case).table() for case in CASES[:3]}


@pytest.mark.parametrize("how", ["one process", "two processes", acceptance("dask")])
def test_rows_are_the_same_whatever_drives_them(
    how: str, expected: dict[int, dict[str, Any]], tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    address = request.getfixturevalue("cluster") if how == "dask" else None
    jobs = {"one process": 1, "two processes": 2, "dask": None}[how]
    done: list[int] = []
    run_campaign(CASES[:3], tmp_path, jobs=jobs, dask=address, progress=lambda now, total: done.append(now))
    found = by_index(tmp_path)
    assert found.keys() == expected.keys()
    for index, row in found.items():
        assert row["figures"]["final_error"] == expected[index]["figures"]["final_error"]
        assert row["figures"]["cycles_by_status"] == expected[index]["figures"]["cycles_by_status"]
        assert row["course"] == {"number": index}
        assert row["outcome"] == "unfinished"
    assert done == [1, 2, 3]
    assert by_index(tmp_path, TIMES)[2]["cycle_ms"]["max"] > 0.0


@pytest.mark.parametrize("how", ["two processes", acceptance("dask")])
def test_a_case_that_raises_or_ends_its_worker_is_a_row(
    how: str, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    address = request.getfixturevalue("cluster") if how == "dask" else None
    run_campaign(CASES, tmp_path, jobs=None if address else 2, dask=address, drive=troubled)
    found = by_index(tmp_path)
    ends = ["docked", "raised", "worker_died", "docked", "raised", "raised", "docked", "docked"]
    assert [found[index]["outcome"] for index in range(8)] == ends
    assert found[1]["detail"] == "ZeroDivisionError: case 1 of <object object>"
    assert found[4]["detail"] == "SystemExit: 3"
    assert found[5]["detail"].startswith("ValueError: Out of range float values")
    assert found[1]["course"] == {"number": 1}
    assert (found[2]["course"], found[2]["figures"]) == (None, None)


def test_a_campaign_that_is_started_again_replaces_the_earlier_one(tmp_path: Path) -> None:
    for cases in (CASES[:3], CASES[1:2]):
        run_campaign(cases, tmp_path, jobs=1, drive=made_up)
    assert list(by_index(tmp_path)) == [1]


def test_an_incomplete_last_line_is_left_out_and_others_are_refused(tmp_path: Path) -> None:
    run_campaign(CASES[:2], tmp_path, jobs=1, drive=made_up)
    file = tmp_path / "rows.jsonl"
    with file.open("a") as stream:
        stream.write('{"index":')
    assert len(by_index(tmp_path)) == 2
    for wrong in ("nonsense\n", "3\n"):
        file.write_text(wrong)
        with pytest.raises(InputError, match="rows of a campaign"):
            read_rows(tmp_path)


def test_workers_that_there_are_none_of_are_told_in_one_sentence(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="jobs = 0: must be >= 1"):
        run_campaign(CASES, tmp_path, jobs=0)
    with pytest.raises(CampaignError, match="no Dask scheduler at nowhere"):
        run_campaign(CASES, tmp_path, dask="nowhere")
