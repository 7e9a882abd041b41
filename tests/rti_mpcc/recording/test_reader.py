"""One clear sentence on files that are no recording, or no longer a whole one."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rti_mpcc.errors import InputError, RecordingError
from rti_mpcc.recording import read_recording, replay
from rti_mpcc.recording.contents import VERSION, to_line
from tests.rti_mpcc.recording.recordings import EVENTFUL


def refusal(file: Path) -> str:
    """What is said of a file that is no whole recording, by reader and replay alike."""
    with pytest.raises(RecordingError) as read:
        read_recording(file)
    with pytest.raises(RecordingError) as replayed:
        replay(file)
    assert str(read.value) == str(replayed.value)
    assert isinstance(read.value, InputError)
    assert str(read.value).startswith(f"{file}: ")
    assert "\n" not in str(read.value)
    return str(read.value).removeprefix(f"{file}: ")


def written(folder: Path, *lines: bytes) -> Path:
    file = folder / "file.jsonl"
    file.write_bytes(b"".join(lines))
    return file


def lines_of(recording: Path) -> list[bytes]:
    return recording.read_bytes().splitlines(keepends=True)


def test_other_line_ends_change_nothing(recording: Path, tmp_path: Path) -> None:
    file = written(tmp_path, *(line.rstrip() + b"\r\n" for line in lines_of(recording)))
    assert len(read_recording(file).cycles) == EVENTFUL
    assert read_recording(written(tmp_path, recording.read_bytes().rstrip())).complete


@pytest.mark.parametrize(
    ("whole", "rest"), [(0, 0), (0, 500), (1, 0), (5, 1), (5, 3000), (EVENTFUL, 0), (EVENTFUL, 4)]
)
def test_truncated(recording: Path, tmp_path: Path, whole: int, rest: int) -> None:
    lines = lines_of(recording)
    file = written(tmp_path, *lines[: whole + 1], lines[whole + 1][:rest])
    assert refusal(file) == (
        f"is truncated: it holds {whole} whole cycles and no end "
        "(replay those with --partial, allow_truncated=True in Python)"
    )
    read = read_recording(file, allow_truncated=True)
    assert (len(read.cycles), read.complete) == (whole, False)
    report = replay(file, allow_truncated=True)
    assert (report.cycles, report.complete, report.identical) == (whole, False, True)


FOREIGN = "is not a recording of rti-mpcc, its first line is no header"


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", FOREIGN),
        (b"t,x,y\n0,1,2\n", FOREIGN),
        (b'{"a": 1}\n{"a": 2}\n', FOREIGN),
        (b"[1, 2]\n", FOREIGN),
        (b"\x89PNG\r\n\x1a\n\x00\xff", FOREIGN),
        (to_line({"format": "another recording", "version": 1}), FOREIGN),
        (
            to_line({"format": "rti-mpcc recording", "version": VERSION + 1}),
            f"was written by a newer rti-mpcc (format {VERSION + 1}, this one reads {VERSION})",
        ),
        (
            b'{"format":"rti-mpcc recording","version":4,"machine":{},"crc":"2d5b4f13"}\n',
            f"was written by an older rti-mpcc (format 4, this one reads {VERSION})",
        ),
    ],
)
def test_foreign(tmp_path: Path, content: bytes, message: str) -> None:
    assert refusal(written(tmp_path, content)) == message


def test_a_header_without_its_content_and_a_setting_out_of_range(recording: Path, tmp_path: Path) -> None:
    empty = to_line({"format": "rti-mpcc recording", "version": VERSION})
    message = refusal(written(tmp_path, empty))
    assert message.startswith("header: was it written by another version of rti-mpcc? ")
    assert "required field missing @ $.machine" in message
    lines = lines_of(recording)
    data: dict[str, Any] = json.loads(lines[0])
    del data["crc"]
    data["config"]["cycle"] = 9.0
    assert "$.config" in refusal(written(tmp_path, to_line(data), *lines[1:]))


def test_a_changed_header_or_end_is_refused(recording: Path, tmp_path: Path) -> None:
    lines = lines_of(recording)
    file = written(tmp_path, lines[0].replace(b'"cycle":0.05', b'"cycle":0.06'), *lines[1:])
    assert refusal(file) == "its first line was changed after it was recorded"
    end = lines[-1].replace(str(EVENTFUL).encode(), b"35", 1)
    assert refusal(written(tmp_path, *lines[:-1], end)).startswith("is truncated: ")


def test_missing_lines_are_refused(recording: Path, tmp_path: Path) -> None:
    lines = lines_of(recording)
    assert refusal(written(tmp_path, *lines[:4], *lines[5:])) == "cycle 3 is missing, line 5 holds 4"
    assert refusal(written(tmp_path, *lines[:-2], lines[-1])) == (
        f"holds {EVENTFUL - 1} cycles, but its end mark says {EVENTFUL}"
    )


def test_any_flipped_bit_is_found_where_it_is(recording: Path, tmp_path: Path) -> None:
    """Also one that makes a minus a carriage return, or a line feed something else and two lines one."""
    content = recording.read_bytes()
    ends = np.flatnonzero(np.frombuffer(content, dtype=np.uint8) == ord("\n"))
    random = np.random.default_rng(4)
    bits = [(int(at), int(random.integers(8))) for at in random.integers(ends[0] + 1, ends[-2], 40)]
    bits += [(int(ends[4]), 0), (content.index(b"-", ends[3]), 5)]
    for position, bit in bits:
        flipped = bytearray(content)
        flipped[position] ^= 1 << bit
        cycle = int(np.searchsorted(ends, position)) - 1
        with pytest.raises(RecordingError, match=f"cycle {cycle}: its line was changed"):
            read_recording(written(tmp_path, bytes(flipped)))
