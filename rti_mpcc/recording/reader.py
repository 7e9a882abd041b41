"""Reading recordings, and saying clearly what is wrong with a file that is none, or no longer whole."""

from __future__ import annotations

from codecs import BOM_UTF8
from collections.abc import Sequence
from dataclasses import dataclass
from os import PathLike
from typing import TypeVar

from geometry.files import RECORDING, content
from rti_mpcc.errors import InputError, RecordingError
from rti_mpcc.recording.codec import structured
from rti_mpcc.recording.contents import Cycle, Header, Recording
from rti_mpcc.recording.lines import END, FORMAT, VERSION, Data, from_line

CHANGED = "its line was changed after it was recorded"

_BEGIN = f'{{"format":"{FORMAT}"'.encode()

T = TypeVar("T")


@dataclass(frozen=True, slots=True, kw_only=True)
class Entry:
    """The line of a cycle.

    Attributes:
        number: of the cycle, by its place in the file.
        cycle: what it says; None where a line that was changed says nothing any more.
        changed: "", or that it was changed after it was recorded.
    """

    number: int
    cycle: Cycle | None
    changed: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Entries:
    """A recording whose lines may have been changed; `complete`: its end is there."""

    header: Header
    cycles: tuple[Entry, ...]
    complete: bool


def read_recording(file: str | PathLike[str], *, allow_truncated: bool = False) -> Recording:
    """Read a recording.

    Args:
        allow_truncated: take the whole cycles of a recording that was cut off.

    Raises:
        RecordingError: the file cannot be read, is no recording, is from another version or truncated, or
            was changed.
    """
    entries = read_entries(file, allow_truncated=allow_truncated)
    changed = _first_changed(entries.cycles)
    if changed:
        raise RecordingError(f"{file}: {changed}")
    cycles = tuple(entry.cycle for entry in entries.cycles if entry.cycle is not None)
    return Recording(header=entries.header, cycles=cycles, complete=entries.complete)


def read_entries(file: str | PathLike[str], *, allow_truncated: bool = False) -> Entries:
    """Read a recording of which lines of cycles may have been changed; see `read_recording`."""
    try:
        return _entries(_lines(content(file, RECORDING)), allow_truncated)
    except OSError as error:
        raise RecordingError(f"{file}: cannot be read, {error.strerror or error}") from error
    except RecordingError as error:
        raise RecordingError(f"{file}: {error}") from None
    except RecursionError:
        raise RecordingError(f"{file}: is nested too deep") from None


def _lines(whole: bytes) -> list[bytes]:
    """Cut at line feeds only: one bit makes a minus a carriage return, and that line is still one."""
    return [line.removesuffix(b"\r") for line in whole.removeprefix(BOM_UTF8).rstrip().split(b"\n")]


def _first_changed(cycles: Sequence[Entry]) -> str:
    """What there is to say of the first line that was changed, or ""."""
    return next((f"cycle {entry.number}: {CHANGED}" for entry in cycles if entry.changed), "")


def _entries(lines: list[bytes], allow_truncated: bool) -> Entries:
    if lines == [b""]:
        raise RecordingError("is empty")
    header = _header(lines[0], alone=len(lines) == 1)
    body, count = _ended(lines[1:])
    if count is None and not allow_truncated:
        raise RecordingError(
            f"is truncated: it holds {len(body)} whole cycles and no end "
            "(replay those with --partial, allow_truncated=True in Python)"
        )
    cycles: list[Entry] = []
    try:
        for number, line in enumerate(body):
            cycles.append(_entry(number, line))
        if count not in (None, len(body)):
            raise RecordingError(f"holds {len(body)} cycles, but its end mark says {count}")
    except RecordingError as error:  # two lines made one explain what is missing behind them
        raise RecordingError(_first_changed(cycles) or str(error)) from None
    return Entries(header=header, cycles=tuple(cycles), complete=count is not None)


def _header(line: bytes, *, alone: bool) -> Header:
    data, intact = from_line(line)
    if not data and alone and (line.startswith(_BEGIN) or _BEGIN.startswith(line)):
        raise RecordingError("is truncated: its first line is cut off")
    if data.get("format") != FORMAT:
        raise RecordingError("is not a recording of rti-mpcc, its first line is no header")
    version = data.get("version")
    if isinstance(version, int) and version != VERSION:
        age = "a newer" if version > VERSION else "an older"
        raise RecordingError(f"was written by {age} rti-mpcc (format {version}, this one reads {VERSION})")
    if not intact:
        raise RecordingError("its first line was changed after it was recorded")
    return _whole("header", data, Header)


def _ended(lines: list[bytes]) -> tuple[list[bytes], int | None]:
    """The lines of whole cycles, and what the end mark says, None without one."""
    data, intact = from_line(lines[-1]) if lines else ({}, False)
    if not data:  # nothing, or half a line
        return lines[:-1], None
    if END not in data:
        return lines, None
    if not intact:
        raise RecordingError("its last line was changed after it was recorded")
    return lines[:-1], data[END]


def _entry(number: int, line: bytes) -> Entry:
    data, intact = from_line(line)
    if intact:
        if data.get("number") != number:
            raise RecordingError(f"cycle {number} is missing, line {number + 2} holds {data.get('number')}")
        return Entry(number=number, cycle=_whole(f"cycle {number}", data, Cycle), changed="")
    if not data:
        return Entry(number=number, cycle=None, changed=f"{CHANGED} (no JSON any more)")
    try:
        return Entry(number=number, cycle=structured(data, Cycle), changed=CHANGED)
    except InputError as error:
        return Entry(number=number, cycle=None, changed=f"{CHANGED} ({error})")


def _whole(name: str, data: Data, kind: type[T]) -> T:
    """What a line says that is as it was written."""
    try:
        return structured(data, kind)
    except InputError as error:
        raise RecordingError(f"{name}: {error}; was it written by another version of rti-mpcc?") from None
