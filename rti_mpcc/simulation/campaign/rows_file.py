"""rows.jsonl: one line a case, in the order in which they ended, never changed again; and timed.jsonl beside
it, with what was timed of them.

A line is handed to the system by one call, so a process that is killed leaves whole lines and at most a torn
last one, which is cut off when the file is opened again; its case is driven again.
"""

from __future__ import annotations

import json
import os
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from types import TracebackType
from typing import Any, BinaryIO, Self

from geometry.files import RECORDING, from_json, opened
from rti_mpcc.errors import InputError
from rti_mpcc.simulation.campaign.row import CaseOutcome, Lines

FILE = "rows.jsonl"
TIMES = "timed.jsonl"
SYNCED = 64
"""After so many lines the system is told to write them to the disk: what a power cut may cost."""
Table = dict[str, Any]


@dataclass(slots=True, kw_only=True)
class Tally:
    """How many cases are done, and how they ended.

    Attributes:
        outcomes: number of cases by how they ended; collisions: of those whose body crossed a boundary;
            failures_driven: cycles that drove a refused solution, of all cases together.
    """

    outcomes: Counter[CaseOutcome] = field(default_factory=Counter)
    collisions: int = 0
    failures_driven: int = 0

    @property
    def cases(self) -> int:
        """All that are done."""
        return self.outcomes.total()

    def count(self, row: Table) -> None:
        """Count a row in."""
        self.outcomes[CaseOutcome(row["outcome"])] += 1
        figures = row["figures"]
        if figures is not None:
            clearance = figures["min_clearance_m"]
            self.collisions += clearance is not None and clearance < 0.0
            self.failures_driven += figures["failures_driven"]


class RowsFile:
    """The file, open for more lines; a context manager.

    Attributes:
        done: (count,) of bytes, 1 for the cases that have a line; tally: of those lines.
    """

    def __init__(self, folder: Path, count: int) -> None:
        """Open FOLDER/rows.jsonl for cases 0 ... count - 1, cut a torn line off, and read what is done.

        Raises InputError for a line that is none of this campaign.
        """
        self.file = folder / FILE
        self.done = bytearray(count)
        self.tally = Tally()
        self._unsynced, whole = 0, 0
        for number, row, end in _tables(self.file):
            self._note(row, f"{self.file}: line {number}")
            whole = end
        self._stream = _continued(self.file, whole)
        times = folder / TIMES
        self._times = _continued(times, max((end for _, _, end in _tables(times)), default=0))

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            os.fsync(self._stream.fileno())
        finally:
            self._stream.close()
            self._times.close()

    def append(self, lines: Lines) -> None:
        """Keep the lines of a case. Raises InputError for one that has a row, OSError for a full disk."""
        self._note(json.loads(lines.row), "a new row")
        if lines.timed is not None:
            self._write(self._times, lines.timed)
        self._write(self._stream, lines.row)
        self._unsynced += 1
        if self._unsynced >= SYNCED:
            os.fsync(self._stream.fileno())
            self._unsynced = 0

    def _write(self, stream: BinaryIO, line: str) -> None:
        data = line.encode("utf-8")
        if stream.write(data) != len(data):
            raise OSError(f"{self.file}: a row could not be written whole: is the disk full?")

    def _note(self, row: Table, place: str) -> None:
        try:
            index = row["index"]
            new = 0 <= index < len(self.done) and not self.done[index]
            if new:
                self.tally.count(row)
        except (KeyError, TypeError, ValueError):
            raise InputError(f"{place}: is no row of a campaign") from None
        if not new:
            raise InputError(f"{place}: case {index} is there already, or none of this campaign")
        self.done[index] = 1


def read_rows(folder: Path) -> Iterator[Table]:
    """The rows of a campaign one by one, in the order of the file; a torn last line is left out.

    Raises InputError for a line that is no row.
    """
    for _, row, _ in _tables(folder / FILE):
        yield row


def read_times(folder: Path) -> dict[int, Table]:
    """What was timed of the cases of a campaign; the last time counts.

    Raises InputError for a line that is none of it.
    """
    file, found = folder / TIMES, {}
    for number, table, _ in _tables(file):
        try:
            found[int(table["index"])] = table
        except (KeyError, TypeError, ValueError):
            raise InputError(f"{file}: line {number}: is not what was timed of a case") from None
    return found


def _continued(file: Path, whole: int) -> BinaryIO:
    """The file, open for more lines behind those `whole` bytes; the rest is cut off."""
    stream = file.open("ab", buffering=0)
    stream.truncate(whole)
    return stream


def _tables(file: Path) -> Iterator[tuple[int, Table, int]]:
    """Number and row of each whole line, and where it ends in the file [bytes]."""
    if not file.exists():
        return
    end = 0
    try:
        lines = opened(file, RECORDING)
    except OSError as error:
        raise InputError(f"{file}: cannot be read, {error}") from error
    with lines as stream:
        for number, line in enumerate(stream, start=1):
            if not line.endswith(b"\n"):
                return
            end += len(line)
            try:
                row = from_json(line)
            except ValueError:
                raise InputError(f"{file}: line {number}: is no row of a campaign") from None
            yield number, row, end
