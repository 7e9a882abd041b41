"""The examples run as they stand, dock, and stay short."""

from __future__ import annotations

import runpy
import sys
from pathlib import Path

import pytest

from tests.lists import in_fast_suite

FOLDER = Path(__file__).parents[2] / "examples"
NAMES = (
    "charuco_docking",
    "dock_with_python",
    "docking_mission",
    "embed_in_your_loop",
    "own_path_and_polygon",
    "park_from_map",
)
LONGEST = 61


def test_there_are_no_other_examples() -> None:
    assert sorted(file.stem for file in FOLDER.glob("*.py")) == list(NAMES)


@pytest.mark.parametrize("name", in_fast_suite(["dock_with_python"], NAMES))
def test_an_example_docks_and_says_so(
    name: str, elsewhere: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "argv", [name])
    # The example itself asserts that it docked.
    runpy.run_path(str(FOLDER / f"{name}.py"), run_name="__main__")
    told = capsys.readouterr().out
    assert "docked" in told
    if name == "charuco_docking":
        pictures = sorted(file.name for file in (elsewhere / "runs" / name).iterdir())
        assert pictures == ["first.png", "last.png", "overview.png"]


@pytest.mark.parametrize("name", NAMES)
def test_an_example_is_short(name: str) -> None:
    assert len((FOLDER / f"{name}.py").read_text(encoding="utf-8").splitlines()) <= LONGEST
