"""Reading recordings: what is in them, and one clear sentence on files that are none."""

from __future__ import annotations

import json
import platform
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rti_mpcc.errors import InputError, RecordingError
from rti_mpcc.recording import Machine, read_recording, replay
from rti_mpcc.recording.lines import VERSION, to_line
from rti_mpcc.types import Source, Status
from tests.rti_mpcc.recording.recordings import DETECTED, EVENTFUL, GOAL, SCENARIO


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


def written(folder: Path, content: bytes) -> Path:
    file = folder / "file.jsonl"
    file.write_bytes(content)
    return file


def test_a_recording_gives_its_cycles_typed(recording: Path) -> None:
    read = read_recording(recording)
    assert read.complete
    assert [cycle.number for cycle in read.cycles] == list(range(EVENTFUL))
    cycle = read.cycles[DETECTED]
    assert cycle.inputs.goal == GOAL
    assert cycle.inputs.measurements[0].vehicle is not None
    assert np.asarray(cycle.inputs.measurements[0].covariance).shape == (3, 3)
    assert cycle.command is not None
    assert cycle.command.source is Source.SOLUTION
    assert cycle.command.status in (Status.ARRIVING, Status.FOLLOWING)
    stages = read.header.config.stages
    plan = cycle.command.trajectory
    shapes = (plan.times.shape, plan.states.shape, plan.controls.shape)
    assert shapes == ((stages + 1,), (stages + 1, 6), (stages, 3))
    assert not plan.states.flags.writeable
    assert cycle.command.diagnostics.step_ms > 0.0
    assert read.header.config == SCENARIO.controller_config()
    assert read.header.machine == Machine.here()


def test_the_header_names_no_host_user_or_folder(recording: Path) -> None:
    header = recording.read_text().splitlines()[0]
    assert set(Machine.here().versions) >= {"python", "numpy", "scipy", "osqp", "shapely", "filterpy"}
    for private in (platform.node(), str(Path.home()), str(recording.parent)):
        assert len(private) < 3 or private not in header


def test_every_line_is_json(recording: Path) -> None:
    lines = [json.loads(line) for line in recording.read_text(encoding="utf-8").splitlines()]
    assert lines[0]["format"] == "rti-mpcc recording"
    assert [line["number"] for line in lines[1:-1]] == list(range(EVENTFUL))
    assert lines[-1]["end"] == EVENTFUL


def test_other_line_ends_change_nothing(recording: Path, tmp_path: Path) -> None:
    file = written(tmp_path, b"\r\n".join([*recording.read_bytes().splitlines(), b""]))
    assert len(read_recording(file).cycles) == EVENTFUL


# -- truncated ------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("whole", "rest"), [(0, 0), (0, 500), (1, 0), (5, 1), (5, 3000), (EVENTFUL, 0), (EVENTFUL, 4)]
)
def test_truncated(recording: Path, tmp_path: Path, whole: int, rest: int) -> None:
    lines = recording.read_bytes().splitlines(keepends=True)
    cut = lines[: whole + 1] + ([lines[whole + 1][:rest]] if rest else [])
    file = written(tmp_path, b"".join(cut))
    assert refusal(file) == (
        f"is truncated: it holds {whole} whole cycles and no end "
        "(replay those with --partial, allow_truncated=True in Python)"
    )
    read = read_recording(file, allow_truncated=True)
    assert (len(read.cycles), read.complete) == (whole, False)
    report = replay(file, allow_truncated=True)
    assert (report.cycles, report.complete, report.identical) == (whole, False, True)


def test_truncated_between_a_line_and_its_end(recording: Path, tmp_path: Path) -> None:
    lines = recording.read_bytes().splitlines()
    file = written(tmp_path, b"\n".join(lines[:4]))
    assert len(read_recording(file, allow_truncated=True).cycles) == 3
    file = written(tmp_path, b"\n".join(lines))
    assert read_recording(file).complete


@pytest.mark.parametrize("length", [5, 30, 2000])
def test_truncated_within_the_header(recording: Path, tmp_path: Path, length: int) -> None:
    file = written(tmp_path, recording.read_bytes()[:length])
    assert refusal(file) == "is truncated: its first line is cut off"
    with pytest.raises(RecordingError, match="its first line is cut off"):
        replay(file, allow_truncated=True)


# -- foreign --------------------------------------------------------------------------------------------

FOREIGN = "is not a recording of rti-mpcc, its first line is no header"


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "is empty"),
        (b"\n\n", "is empty"),
        (b"t,x,y\n0,1,2\n", FOREIGN),
        (b'{"a": 1}\n{"a": 2}\n', FOREIGN),
        (b"[1, 2]\n", FOREIGN),
        (b"\x89PNG\r\n\x1a\n\x00\xff", FOREIGN),
        (to_line({"format": "another recording", "version": 1}), FOREIGN),
        (to_line({"version": 1}), FOREIGN),
        (
            to_line({"format": "rti-mpcc recording", "version": VERSION + 1}),
            f"was written by a newer rti-mpcc (format {VERSION + 1}, this one reads {VERSION})",
        ),
        (
            b'{"format":"rti-mpcc recording","version":1,"machine":{},"crc":"2d5b4f13"}\n',
            f"was written by an older rti-mpcc (format 1, this one reads {VERSION})",
        ),
        (
            to_line({"format": "rti-mpcc recording", "version": VERSION}),
            "header: machine: required field missing; config: required field missing; "
            "path: required field missing; corridor: required field missing; "
            "was it written by another version of rti-mpcc?",
        ),
    ],
)
def test_foreign(tmp_path: Path, content: bytes, message: str) -> None:
    assert refusal(written(tmp_path, content)) == message


def test_a_folder_and_nothing_at_all(tmp_path: Path) -> None:
    assert refusal(tmp_path) == "cannot be read, Is a directory"
    assert refusal(tmp_path / "nowhere") == "cannot be read, No such file or directory"


# -- changed --------------------------------------------------------------------------------------------


def lines_of(recording: Path) -> list[bytes]:
    return recording.read_bytes().splitlines(keepends=True)


def test_a_changed_header_or_end_is_refused(recording: Path, tmp_path: Path) -> None:
    lines = lines_of(recording)
    file = written(tmp_path, lines[0].replace(b'"cycle":0.05', b'"cycle":0.06') + b"".join(lines[1:]))
    assert refusal(file) == "its first line was changed after it was recorded"
    end = lines[-1].replace(str(EVENTFUL).encode(), b"35", 1)
    assert refusal(written(tmp_path, b"".join([*lines[:-1], end]))) == (
        "its last line was changed after it was recorded"
    )


def test_missing_lines_are_refused(recording: Path, tmp_path: Path) -> None:
    lines = lines_of(recording)
    file = written(tmp_path, b"".join(lines[:4] + lines[5:]))
    assert refusal(file) == "cycle 3 is missing, line 5 holds 4"
    file = written(tmp_path, b"".join([*lines[:-2], lines[-1]]))
    assert refusal(file) == f"holds {EVENTFUL - 1} cycles, but its end mark says {EVENTFUL}"


def test_a_setting_out_of_range_is_named(recording: Path, tmp_path: Path) -> None:
    lines = lines_of(recording)
    data: dict[str, Any] = json.loads(lines[0])
    del data["crc"]
    data["config"]["cycle"] = 9.0
    message = refusal(written(tmp_path, to_line(data) + b"".join(lines[1:])))
    assert message.startswith("header: config: ControllerConfig.cycle = 9.0: ")


def test_a_line_that_one_bit_cuts_or_joins_to_the_next_is_the_one_that_was_changed(
    recording: Path, tmp_path: Path
) -> None:
    """A minus is one bit from a carriage return, a line feed from a vertical tab."""
    lines = lines_of(recording)
    assert ord("-") ^ ord("\r") == 1 << 5
    for place in (1, 7, len(lines) - 3, len(lines) - 2):
        cut = lines[place].replace(b"-", b"\r", 1)
        joined = lines[place][:-1] + b"\v"
        assert cut != lines[place]
        for line in (cut, joined) if place < len(lines) - 2 else (cut,):
            file = written(tmp_path, b"".join([*lines[:place], line, *lines[place + 1 :]]))
            with pytest.raises(RecordingError, match=f"cycle {place - 1}: its line was changed"):
                read_recording(file)


def test_any_flipped_bit_is_found_where_it_is(recording: Path, tmp_path: Path) -> None:
    content = recording.read_bytes()
    ends = np.flatnonzero(np.frombuffer(content, dtype=np.uint8) == ord("\n"))
    random = np.random.default_rng(4)
    for position in random.integers(ends[0] + 1, ends[-2], 60):
        flipped = bytearray(content)
        flipped[position] ^= 1 << int(random.integers(8))
        cycle = int(np.searchsorted(ends, position)) - 1
        with pytest.raises(RecordingError, match=f"cycle {cycle}: its line was changed"):
            read_recording(written(tmp_path, bytes(flipped)))
