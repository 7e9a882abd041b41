"""The examples run as they stand, dock, and stay short."""

from __future__ import annotations

import runpy
from pathlib import Path

import pytest

FOLDER = Path(__file__).parents[2] / "examples"
NAMES = ("dock_with_python", "embed_in_your_loop", "own_path_and_polygon")
LONGEST = 60


def test_there_are_no_other_examples() -> None:
    assert sorted(file.stem for file in FOLDER.glob("*.py")) == list(NAMES)


@pytest.mark.parametrize("name", NAMES)
def test_an_example_docks_and_says_so(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    # The example itself asserts that it docked.
    runpy.run_path(str(FOLDER / f"{name}.py"), run_name="__main__")
    told = capsys.readouterr().out
    assert "docked" in told


@pytest.mark.parametrize("name", NAMES)
def test_an_example_is_short(name: str) -> None:
    assert len((FOLDER / f"{name}.py").read_text(encoding="utf-8").splitlines()) <= LONGEST
