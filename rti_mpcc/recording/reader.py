"""Reading recordings, and saying clearly what is wrong with a file that is none, or no longer whole."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any

from rti_mpcc.errors import InputError, RecordingError
from rti_mpcc.recording.codec import Data, Decoder, decoder
from rti_mpcc.recording.contents import Cycle, Header, Recording
from rti_mpcc.recording.lines import END, FORMAT, VERSION, from_line

CHANGED = "its line was changed after it was recorded"

_BEGIN = f'{{"format":"{FORMAT}"'.encode()


@dataclass(frozen=True, slots=True, kw_only=True)
class Entry:
    """The line of a cycle.

    Attributes:
        number: of the cycle, by its place in the file.
        data: what it says; None if it is not even JSON any more.
        intact: its checksum fits.
    """

    number: int
    data: dict[str, Data] | None
    intact: bool


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
        """The cycles in order. Raises RecordingError where lines are missing."""
        for place, line in enumerate(self.lines):
            try:
                data, intact = from_line(line)
            except ValueError:
                yield Entry(number=place, data=None, intact=False)
                continue
            if intact and data.get("number") != place:
                raise RecordingError(
                    f"{self.name}: cycle {place} is missing, line {place + 2} holds {data.get('number')}"
                )
            yield Entry(number=place, data=data, intact=intact)
        if self.count is not None and self.count != len(self.lines):
            raise RecordingError(
                f"{self.name}: holds {len(self.lines)} cycles, but its end mark says {self.count}"
            )


def read_recording(file: str | PathLike[str], *, allow_truncated: bool = False) -> Recording:
    """Read a recording.

    Args:
        allow_truncated: take the whole cycles of a recording that was cut off.

    Raises:
        RecordingError: the file cannot be read, is no recording, is from a newer version or truncated, or
            was changed.
    """
    opened = open_recording(file, allow_truncated=allow_truncated)
    decode = decoder(Cycle)
    cycles = []
    for entry in opened.entries():
        if not entry.intact:
            raise RecordingError(f"{opened.name}: cycle {entry.number}: {CHANGED}")
        cycles.append(decoded(decode, entry.data, f"{opened.name}: cycle {entry.number}"))
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


def decoded(decode: Decoder, data: Data, where: str) -> Any:
    """What a decoder makes of data of a whole line. Raises RecordingError, which says where."""
    try:
        return decode(data)
    except InputError as error:
        raise misfit(where, error) from None


def misfit(where: str, error: InputError) -> RecordingError:
    """The error for a whole line that does not say what it should."""
    return RecordingError(f"{where}: {told(error)}; was it written by another version of rti-mpcc?")


def told(error: InputError) -> str:
    """What a decoder's error says, beginning with the place."""
    return str(error).lstrip(".: =")


def _header(name: str, line: bytes, *, alone: bool) -> Header:
    try:
        data, intact = from_line(line)
    except ValueError:
        if alone and (line.startswith(_BEGIN) or _BEGIN.startswith(line)):
            raise RecordingError(f"{name}: is truncated: its first line is cut off") from None
        raise RecordingError(f"{name}: is not a recording of rti-mpcc, its first line is no header") from None
    if data.pop("format", None) != FORMAT:
        raise RecordingError(f"{name}: is not a recording of rti-mpcc, its first line is no header")
    version = data.get("version")
    if isinstance(version, int) and version > VERSION:
        raise RecordingError(
            f"{name}: was written by a newer rti-mpcc (format {version}, this one reads up to {VERSION})"
        )
    if not intact:
        raise RecordingError(f"{name}: its first line was changed after it was recorded")
    header: Header = decoded(decoder(Header), data, f"{name}: header")
    return header


def _ended(name: str, lines: list[bytes]) -> tuple[list[bytes], int | None]:
    """The lines of whole cycles, and what the end mark says, None without one."""
    if not lines:
        return lines, None
    try:
        data, intact = from_line(lines[-1])
    except ValueError:  # half a line
        return lines[:-1], None
    if END not in data:
        return lines, None
    if not intact:
        raise RecordingError(f"{name}: its last line was changed after it was recorded")
    return lines[:-1], data[END]
