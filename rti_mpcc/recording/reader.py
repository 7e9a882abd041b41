"""Reading recordings, and saying clearly what is wrong with a file that is none, or no longer whole."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from os import PathLike
from pathlib import Path

from rti_mpcc.errors import InputError, RecordingError
from rti_mpcc.recording.codec import structured
from rti_mpcc.recording.contents import Cycle, Header, Recording
from rti_mpcc.recording.lines import END, FORMAT, VERSION, from_line

CHANGED = "its line was changed after it was recorded"

_BEGIN = f'{{"format":"{FORMAT}"'.encode()


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
class OpenRecording:
    """A recording whose header is read and whose cycles are still text.

    Attributes:
        name: of the file, for messages.
        header: see there.
        lines: of the cycles.
        count: of cycles as the end mark says; None if the recording is truncated.
    """

    name: str
    header: Header
    lines: tuple[bytes, ...]
    count: int | None

    def entries(self) -> Iterator[Entry]:
        """The cycles in order. Raises RecordingError where lines are missing, or not of this version."""
        for number, line in enumerate(self.lines):
            yield self._entry(number, line)
        if self.count is not None and self.count != len(self.lines):
            raise RecordingError(
                f"{self.name}: holds {len(self.lines)} cycles, but its end mark says {self.count}"
            )

    def _entry(self, number: int, line: bytes) -> Entry:
        data, intact = from_line(line)
        if intact and data.get("number") != number:
            raise RecordingError(
                f"{self.name}: cycle {number} is missing, line {number + 2} holds {data.get('number')}"
            )
        try:
            cycle = structured(data, Cycle)
        except InputError as error:
            if intact:
                raise _misfit(f"{self.name}: cycle {number}", error) from None
            why = error if data else "no JSON any more"
            return Entry(number=number, cycle=None, changed=f"{CHANGED} ({why})")
        return Entry(number=number, cycle=cycle, changed="" if intact else CHANGED)


def read_recording(file: str | PathLike[str], *, allow_truncated: bool = False) -> Recording:
    """Read a recording.

    Args:
        allow_truncated: take the whole cycles of a recording that was cut off.

    Raises:
        RecordingError: the file cannot be read, is no recording, is from another version or truncated, or
            was changed.
    """
    opened = open_recording(file, allow_truncated=allow_truncated)
    cycles = []
    for entry in opened.entries():
        if entry.changed or entry.cycle is None:
            raise RecordingError(f"{opened.name}: cycle {entry.number}: {CHANGED}")
        cycles.append(entry.cycle)
    return Recording(header=opened.header, cycles=tuple(cycles), complete=opened.count is not None)


def open_recording(file: str | PathLike[str], *, allow_truncated: bool = False) -> OpenRecording:
    """Read the header and find the end; see `read_recording`."""
    name = str(file)
    try:
        lines = Path(file).read_bytes().rstrip().splitlines()
    except OSError as error:
        raise RecordingError(f"{name}: cannot be read, {error.strerror or error}") from error
    if not lines:
        raise RecordingError(f"{name}: is empty")
    header = _header(name, lines[0], alone=len(lines) == 1)
    body, count = _ended(name, lines[1:])
    if count is None and not allow_truncated:
        raise RecordingError(
            f"{name}: is truncated: it holds {len(body)} whole cycles and no end "
            "(replay those with --partial, allow_truncated=True in Python)"
        )
    return OpenRecording(name=name, header=header, lines=tuple(body), count=count)


def _misfit(where: str, error: InputError) -> RecordingError:
    """The error for a whole line that does not say what it should."""
    return RecordingError(f"{where}: {error}; was it written by another version of rti-mpcc?")


def _header(name: str, line: bytes, *, alone: bool) -> Header:
    data, intact = from_line(line)
    if not data and alone and (line.startswith(_BEGIN) or _BEGIN.startswith(line)):
        raise RecordingError(f"{name}: is truncated: its first line is cut off")
    if data.get("format") != FORMAT:
        raise RecordingError(f"{name}: is not a recording of rti-mpcc, its first line is no header")
    version = data.get("version")
    if isinstance(version, int) and version != VERSION:
        age = "a newer" if version > VERSION else "an older"
        raise RecordingError(
            f"{name}: was written by {age} rti-mpcc (format {version}, this one reads {VERSION})"
        )
    if not intact:
        raise RecordingError(f"{name}: its first line was changed after it was recorded")
    try:
        return structured(data, Header)
    except InputError as error:
        raise _misfit(f"{name}: header", error) from None


def _ended(name: str, lines: list[bytes]) -> tuple[list[bytes], int | None]:
    """The lines of whole cycles, and what the end mark says, None without one."""
    data, intact = from_line(lines[-1]) if lines else ({}, False)
    if not data:  # nothing, or half a line
        return lines[:-1], None
    if END not in data:
        return lines, None
    if not intact:
        raise RecordingError(f"{name}: its last line was changed after it was recorded")
    return lines[:-1], data[END]
