"""What the tests of docks share: two docks of a file, and the file."""

from __future__ import annotations

from pathlib import Path

FIRST = """
[[dock]]
name = "first"
pose = [10.0, 5.0, 1.5707963267948966]
kind = "charuco"
tolerance = [0.05, 0.02, 0.01]
body = [[-4.0, -1.0], [-2.1, -1.0], [-2.1, 1.0], [-4.0, 1.0]]
board = { x = -2.1, first_marker = 5 }
approach = { length = 2.0, direction = -1 }
contact = { distance = -1.3, speed = 0.1, tolerance = [0.02, 0.01] }
"""
SECOND = """
[[dock]]
name = "second"
pose = [20, 5, 0]
"""
EXAMPLE = Path(__file__).parents[2] / "examples" / "docks.toml"


def written(folder: Path, text: str) -> Path:
    """yard.toml in this folder."""
    file = folder / "yard.toml"
    file.write_text(text, encoding="utf-8")
    return file
