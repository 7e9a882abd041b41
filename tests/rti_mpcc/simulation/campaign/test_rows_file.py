"""Nothing that was kept is lost, nothing torn is kept."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from rti_mpcc.errors import InputError
from rti_mpcc.simulation.campaign import (
    CampaignCase,
    CaseOutcome,
    Level,
    Lines,
    RowsFile,
    read_rows,
    read_times,
)
from rti_mpcc.simulation.campaign import rows_file as writing
from rti_mpcc.simulation.campaign.case import driven_lines
from tests.rti_mpcc.simulation.campaign import drives


def line(index: int) -> str:
    return driven_lines(drives.made_up, CampaignCase(seed=1, level=Level.NOMINAL, index=index)).row


def written(folder: Path) -> bytes:
    return (folder / "rows.jsonl").read_bytes()


def test_lines_are_there_at_once_and_counted(tmp_path: Path) -> None:
    with RowsFile(tmp_path, 4) as rows:
        for kept, index in enumerate((2, 0), start=1):
            rows.append(Lines(line(index)))
            assert written(tmp_path).count(b"\n") == kept
        assert list(rows.done) == [1, 0, 1, 0]
        assert rows.tally.outcomes == {CaseOutcome.DOCKED: 2}
        assert (rows.tally.cases, rows.tally.collisions, rows.tally.failures_driven) == (2, 1, 2)
    assert written(tmp_path).decode() == line(2) + line(0)


def test_more_lines_go_behind_those_that_are_there(tmp_path: Path) -> None:
    with RowsFile(tmp_path, 2) as rows:
        rows.append(Lines(line(1)))
    with RowsFile(tmp_path, 5) as rows:
        assert list(rows.done) == [0, 1, 0, 0, 0]
        assert rows.tally.cases == 1
        rows.append(Lines(line(4)))
    assert [row["index"] for row in read_rows(tmp_path)] == [1, 4]


@pytest.mark.parametrize("kept", [0, 1, 2])
def test_a_torn_line_is_cut_off(tmp_path: Path, kept: int) -> None:
    whole = "".join(line(index) for index in range(kept))
    for torn in ("{", line(3)[:-1], "ä" * 40):
        (tmp_path / "rows.jsonl").write_text(whole + torn, encoding="utf-8")
        assert [row["index"] for row in read_rows(tmp_path)] == list(range(kept))
        with RowsFile(tmp_path, 4) as rows:
            assert sum(rows.done) == kept
            rows.append(Lines(line(3)))
        assert written(tmp_path).decode() == whole + line(3)


def test_a_file_that_ends_whole_is_left_as_it_is(tmp_path: Path) -> None:
    (tmp_path / "rows.jsonl").write_text(line(0))
    with RowsFile(tmp_path, 1):
        pass
    assert written(tmp_path).decode() == line(0)


def test_a_case_is_kept_once(tmp_path: Path) -> None:
    with RowsFile(tmp_path, 3) as rows:
        rows.append(Lines(line(0)))
        with pytest.raises(InputError, match="a new row: case 0 is there already"):
            rows.append(Lines(line(0)))
        with pytest.raises(InputError, match="case 3 is there already, or none of this campaign"):
            rows.append(Lines(line(3)))
    assert written(tmp_path).decode() == line(0)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("no json\n", "line 2: is no row of a campaign"),
        ("[1]\n", "line 2: is no row of a campaign"),
        ('{"index": "one"}\n', "line 2: is no row of a campaign"),
        ('{"index": 1}\n', "line 2: is no row of a campaign"),
        (json.dumps({"index": 1, "outcome": "lost", "figures": None}) + "\n", "line 2: is no row"),
        (line(0), "line 2: case 0 is there already"),
        (line(9), "line 2: case 9 is there already, or none of this campaign"),
    ],
)
def test_other_files_are_refused_and_left_alone(tmp_path: Path, text: str, message: str) -> None:
    (tmp_path / "rows.jsonl").write_text(line(0) + text)
    with pytest.raises(InputError, match=message):
        RowsFile(tmp_path, 3)
    assert written(tmp_path).decode() == line(0) + text


def timed(index: int, seconds: float) -> str:
    return json.dumps({"index": index, "planning_s": seconds}) + "\n"


def test_what_was_timed_has_a_file_of_its_own(tmp_path: Path) -> None:
    assert read_times(tmp_path) == {}
    with RowsFile(tmp_path, 4) as rows:
        rows.append(Lines(line(2), timed(2, 0.5)))
        rows.append(Lines(line(0)))
    assert written(tmp_path).decode() == line(2) + line(0)
    assert read_times(tmp_path) == {2: {"index": 2, "planning_s": 0.5}}
    # Killed between a time and its row, and in the middle of another time.
    with (tmp_path / "timed.jsonl").open("a") as stream:
        stream.write(timed(1, 0.1) + timed(3, 0.1)[:-4])
    with RowsFile(tmp_path, 4) as rows:
        rows.append(Lines(line(1), timed(1, 0.2)))
    assert {index: time["planning_s"] for index, time in read_times(tmp_path).items()} == {2: 0.5, 1: 0.2}


def test_times_of_nothing_are_refused(tmp_path: Path) -> None:
    (tmp_path / "timed.jsonl").write_text(timed(1, 0.1) + "[]\n")
    with pytest.raises(InputError, match="line 2: is not what was timed of a case"):
        read_times(tmp_path)


def test_no_file_has_no_rows(tmp_path: Path) -> None:
    assert list(read_rows(tmp_path)) == []


def test_lines_are_written_to_the_disk_now_and_then(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    synced: list[int] = []
    monkeypatch.setattr(writing, "SYNCED", 2)
    monkeypatch.setattr("os.fsync", synced.append)
    with RowsFile(tmp_path, 5) as rows:
        for index in range(5):
            rows.append(Lines(line(index)))
        assert len(synced) == 2
    assert len(synced) == 3
