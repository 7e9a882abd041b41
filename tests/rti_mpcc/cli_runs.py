"""What the tests of the command line share: scenarios that are over soon."""

from __future__ import annotations

from pathlib import Path

import pytest

from rti_mpcc.cli import main

Printed = pytest.CaptureFixture[str]

SCENARIO = """
name = "short"
[path]
start = [0, 0, 0]
segments = [{ direction = 1, curvature = 0.0, length = 6.0 }]
[corridor]
left = 4
right = -4
[simulation]
duration = DURATION
"""


def write_short(duration: float, more: str = "", *, curvature: float = 0.0) -> None:
    """short.toml, in the current folder; `more` goes on in its section [simulation]."""
    text = SCENARIO.replace("curvature = 0.0", f"curvature = {curvature}").replace("DURATION", str(duration))
    Path("short.toml").write_text(text + more)


MISSION = """
name = "delivery"
[start]
pose = [0.0, 0.0, 0.0]
[area]
boundary = [[-4.0, -4.0], [12.0, -4.0], [12.0, 4.0], [-4.0, 4.0]]
[goal]
pose = [1.5, 0.0, 0.0]
body = [[4.2, -1.0], [6.0, -1.0], [6.0, 1.0], [4.2, 1.0]]
[simulation]
cycle = CYCLE
duration = DURATION
[[mission]]
kind = "dock"
approach = { length = 0.5, direction = 1 }
[[mission]]
kind = "wait"
seconds = 0.2
[[mission]]
kind = "straight"
distance = 0.6
contact = true
[[mission]]
kind = "undock"
distance = -1.5
"""


def write_mission(duration: float, *, cycle: float = 0.05) -> None:
    """delivery.toml, in the current folder: to a dock, in contact with it, and out again."""
    Path("delivery.toml").write_text(MISSION.replace("DURATION", str(duration)).replace("CYCLE", str(cycle)))


def refused(capsys: Printed, *arguments: str) -> str:
    """What a call that must be refused says: on stderr alone, without a traceback."""
    assert main(arguments) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert "Traceback" not in said.err
    return said.err
