"""The study of the longest cycles times each cycle of each drive, whoever drives it."""

from __future__ import annotations

from benchmarks.problems.case import Problems
from benchmarks.worst_cycles import cycles_of
from rti_mpcc import Status


def test_each_cycle_of_each_drive_is_timed() -> None:
    cycles, docked = cycles_of(Problems.COURSES, 2, 6)
    assert docked == 2
    assert (cycles["ms"] > 0.0).all()
    assert list(cycles.index).count(0) == 2  # each drive has a first cycle
    assert len(cycles) > 500
    assert cycles["iterations"].sum() > len(cycles)
    assert {Status.FOLLOWING, Status.DOCKED} <= set(cycles["status"])
    assert not cycles["deadline_missed"].any()  # the tests' clock stands
