"""Replay: the recorded inputs and decisions once more, without a clock, compared cycle by cycle."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from os import PathLike
from pathlib import Path

from rti_mpcc.errors import InputError
from rti_mpcc.planning.clock import PlayedBack
from rti_mpcc.recording.compare import FieldDifference, differences
from rti_mpcc.recording.contents import Driver, core_of, run_cycle
from rti_mpcc.recording.lines import to_data
from rti_mpcc.recording.machine import Machine
from rti_mpcc.recording.problem_file import dump_if_failed
from rti_mpcc.recording.reader import Entry, read_entries

ELSEWHERE = 1e-9
"""Tolerance on another machine or with other versions."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Mismatch:
    """The first cycle that is not as it was recorded.

    Attributes:
        cycle: its number, from 0.
        time: its `now` [s]; None if its line cannot be read.
        changed: "", or that the line itself was changed after it was recorded.
        fields: what came out differently, in order; may be none in a line that was changed.
    """

    cycle: int
    time: float | None
    changed: str
    fields: tuple[FieldDifference, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class ReplayReport:
    """What a replay came to.

    Attributes:
        cycles: that were compared, with the one that differs.
        tolerance: of numbers; 0: bit for bit.
        same_machine: the recording was made on such a machine, with the same versions.
        complete: the recording has its end.
        mismatch: the first cycle that differs, or None.
    """

    cycles: int
    tolerance: float
    same_machine: bool
    complete: bool
    mismatch: Mismatch | None

    @property
    def identical(self) -> bool:
        """No cycle differs."""
        return self.mismatch is None


def replay(
    file: str | PathLike[str],
    *,
    tolerance: float | None = None,
    allow_truncated: bool = False,
    dump_failed: Path | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> ReplayReport:
    """Drive a new controller by a recording and compare commands, diagnostics (but times) and plans.

    Args:
        file: that a `Recorder` wrote.
        tolerance: of numbers, absolute up to 1 and relative above; 0: bit for bit. None: that on a machine
            like the recording's with the same versions, 1e-9 elsewhere.
        allow_truncated: replay the whole cycles of a recording that was cut off.
        dump_failed: folder for the QPs of failed cycles, see `dump_problem`.
        progress: called after each cycle with how many are done, and how many there are.

    Raises:
        RecordingError: the file cannot be read, is no recording, is from another version or truncated.
        InputError: a tolerance that is negative or not a number.
    """
    if tolerance is not None and not tolerance >= 0.0:
        raise InputError(f"tolerance = {tolerance}: must be >= 0")
    recorded = read_entries(file, allow_truncated=allow_truncated)
    same_machine = recorded.header.machine == Machine.here()
    if tolerance is None:
        tolerance = 0.0 if same_machine else ELSEWHERE
    if dump_failed is not None:
        dump_failed.mkdir(parents=True, exist_ok=True)
    driver = recorded.header.driver()
    mismatch, done = None, 0
    for done, entry in enumerate(recorded.cycles, start=1):
        mismatch = _mismatch(driver, entry, tolerance, dump_failed)
        if progress is not None:
            progress(done, len(recorded.cycles))
        if mismatch is not None:
            break
    return ReplayReport(
        cycles=done,
        tolerance=tolerance,
        same_machine=same_machine,
        complete=recorded.complete,
        mismatch=mismatch,
    )


def _mismatch(driver: Driver, entry: Entry, tolerance: float, dumps: Path | None) -> Mismatch | None:
    """Drive one cycle; what is not as it was recorded, or None."""
    recorded = entry.cycle
    if recorded is None:
        return Mismatch(cycle=entry.number, time=None, changed=entry.changed, fields=())
    replayed, _ = run_cycle(driver, entry.number, recorded.inputs, PlayedBack(recorded.decisions))
    if dumps is not None:
        dump_if_failed(core_of(driver), replayed, dumps)
    fields = tuple(differences(to_data(recorded), to_data(replayed), tolerance))
    if not fields and not entry.changed:
        return None
    return Mismatch(cycle=entry.number, time=recorded.inputs.now, changed=entry.changed, fields=fields)
