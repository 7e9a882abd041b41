"""Replay: the recorded inputs and decisions once more, without a clock, compared cycle by cycle."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from math import isclose
from os import PathLike
from pathlib import Path
from typing import NamedTuple

from rti_mpcc.errors import InputError
from rti_mpcc.planning.clock import PlayedBack
from rti_mpcc.recording.codec import Data, to_data
from rti_mpcc.recording.contents import CHANGED, read_recording
from rti_mpcc.recording.recorder import run_cycle
from rti_mpcc.version import Machine

ELSEWHERE = 1e-9  # tolerance on another machine or with other versions
TIMES = frozenset({"prepare_ms", "feedback_ms", "solve_ms", "step_ms"})
"""Diagnostics of how long something took: never the same twice."""


class FieldDifference(NamedTuple):
    """A field such as command.trajectory.states[3][1], of a list the first that differs; None: not there."""

    field: str
    recorded: object
    replayed: object


class Mismatch(NamedTuple):
    """The first cycle that is not as it was recorded: its number, from 0, and its `now` [s].

    `changed` is "", or says that its line was changed after it was recorded; then there may be no `fields`.
    """

    cycle: int
    time: float
    changed: str
    fields: tuple[FieldDifference, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class ReplayReport:
    """The outcome of a replay."""

    cycles: int  # number of compared ones, with the one that differs
    tolerance: float  # of numbers; 0: bit for bit
    same_machine: bool  # the recording was made on such a machine, with the same versions
    complete: bool  # the recording has its end
    mismatch: Mismatch | None  # the first cycle that differs

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
        tolerance: of numbers, absolute up to 1 and relative above; 0: bit for bit. None: that on a machine
            like the recording's with the same versions, 1e-9 elsewhere.
        allow_truncated: replay the whole cycles of a recording that was cut off.
        dump_failed: folder for the QPs of failed cycles, see `dump_problem`.
        progress: called after each cycle with how many are done, and how many there are.

    Raises InputError for a negative tolerance, RecordingError as `read_recording`, but lines may be changed.
    """
    if tolerance is not None and not tolerance >= 0.0:
        raise InputError(f"tolerance = {tolerance}: must be >= 0")
    recording = read_recording(file, allow_truncated=allow_truncated, allow_changed=True)
    same = recording.header.machine == Machine.here()
    if tolerance is None:
        tolerance = 0.0 if same else ELSEWHERE
    if dump_failed is not None:
        dump_failed.mkdir(parents=True, exist_ok=True)
    driver, mismatch, done = recording.header.driver(), None, 0
    for done, cycle in enumerate(recording.cycles, start=1):
        again, _ = run_cycle(driver, cycle.number, cycle.inputs, PlayedBack(cycle.decisions), dump_failed)
        fields = differences(to_data(cycle), to_data(again), tolerance)
        changed = CHANGED if cycle.number in recording.changed else ""
        if progress is not None:
            progress(done, len(recording.cycles))
        if fields or changed:
            mismatch = Mismatch(done - 1, cycle.inputs.now, changed, fields)
            break
    return ReplayReport(
        cycles=done, tolerance=tolerance, same_machine=same, complete=recording.complete, mismatch=mismatch
    )


def differences(recorded: Data, replayed: Data, tolerance: float) -> tuple[FieldDifference, ...]:
    """The differences of JSON data, in the order of their fields, but times; `tolerance` as of `replay`."""
    before, after = dict(_values(recorded)), dict(_values(replayed))
    found: dict[str, FieldDifference] = {}
    for field in before | after:
        one, other = before.get(field), after.get(field)
        if not _near(one, other, tolerance):
            found.setdefault(field.partition("[")[0], FieldDifference(field, one, other))
    return tuple(found.values())


def _values(data: Data, place: str = "") -> Iterator[tuple[str, Data]]:
    """Names and values of all that is no list and no object with entries."""
    if isinstance(data, dict) and data:
        for name, value in data.items():
            if name not in TIMES:
                yield from _values(value, f"{place}.{name}" if place else name)
    elif isinstance(data, list) and data:
        for i, value in enumerate(data):
            yield from _values(value, f"{place}[{i}]")
    else:
        yield place, data


def _near(one: Data, other: Data, tolerance: float) -> bool:
    if repr(one) == repr(other):  # of numbers: the same bits, or both are NaN
        return True
    floats = isinstance(one, float) and isinstance(other, float)
    return tolerance > 0.0 and floats and isclose(one, other, rel_tol=tolerance, abs_tol=tolerance)
