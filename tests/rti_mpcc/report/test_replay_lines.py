"""What a replay came to, in lines."""

from __future__ import annotations

from dataclasses import replace

import pytest

from rti_mpcc.recording import FieldDifference, Mismatch, ReplayReport
from rti_mpcc.report.replay_lines import SHOWN, replay_lines

SAME = ReplayReport(cycles=5, tolerance=0.0, same_machine=True, complete=True, mismatch=None)
SPEED = FieldDifference(field="command.speed", recorded=1.0, replayed=1.25)
STATUS = FieldDifference(field="command.status", recorded="docked", replayed=None)


@pytest.mark.parametrize(
    ("report", "line"),
    [
        (
            SAME,
            "identical: 5 cycles compared bit for bit, on the machine and with the versions of the recording",
        ),
        (
            replace(SAME, tolerance=1e-9, same_machine=False, complete=False),
            "identical: 5 cycles compared within 1e-09, on another machine or versions than the recording's, "
            "which is truncated",
        ),
    ],
)
def test_identical_is_one_line(report: ReplayReport, line: str) -> None:
    assert replay_lines(report) == [line]


def test_a_difference_says_where_and_what() -> None:
    mismatch = Mismatch(cycle=4, time=0.2, changed="", fields=(SPEED, STATUS))
    assert replay_lines(replace(SAME, mismatch=mismatch))[:-1] == [
        "different: cycle 4 at 0.200 s",
        "  command.speed: recorded 1.0, replayed 1.25, difference 0.25",
        "  command.status: recorded 'docked', replayed None",
    ]


def test_a_changed_line_may_come_to_the_same() -> None:
    told = replay_lines(replace(SAME, mismatch=Mismatch(cycle=4, time=0.2, changed="changed", fields=())))
    assert told[:-1] == ["different: cycle 4 at 0.200 s: changed", "  what comes of it is the same"]


def test_many_fields_are_counted() -> None:
    mismatch = Mismatch(cycle=4, time=0.2, changed="", fields=(SPEED,) * (SHOWN + 3))
    told = replay_lines(replace(SAME, mismatch=mismatch))
    assert len(told) == SHOWN + 3
    assert told[-2] == "  and 3 fields more"
