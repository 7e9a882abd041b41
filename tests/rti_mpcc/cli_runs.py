"""What the tests of the command line share: a scenario that is over soon."""

from __future__ import annotations

from pathlib import Path

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


def write_short(duration: float, more: str = "") -> None:
    """short.toml, in the current folder; `more` goes on in its section [simulation]."""
    Path("short.toml").write_text(SCENARIO.replace("DURATION", str(duration)) + more)
