"""The notebooks of docs/notebooks run from their first cell to their last, and are stored without outputs.

Their cells run in this process: the kernel of Jupyter would be another one, where warnings are no errors.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import pytest

from benchmarks.reproduction.published import published_run

FOLDER = Path(__file__).parents[2] / "docs" / "notebooks"
NAMES = ("dock", "reproduce_table_ii")


def cells_of(name: str) -> list[dict[str, Any]]:
    notebook = json.loads((FOLDER / f"{name}.ipynb").read_text(encoding="utf-8"))
    assert (notebook["nbformat"], notebook["nbformat_minor"]) == (4, 5)
    return list(notebook["cells"])


def run(name: str) -> dict[str, Any]:
    """The names of a notebook after its last cell."""
    names: dict[str, Any] = {"__name__": name}
    for cell in cells_of(name):
        if cell["cell_type"] == "code":
            exec(compile("".join(cell["source"]), f"{name}, {cell['id']}", "exec"), names)
    return names


@pytest.fixture(autouse=True)
def figures(monkeypatch: pytest.MonkeyPatch) -> Iterator[list[int]]:
    """Number of figures at each `show`; all are closed afterwards."""
    shown: list[int] = []
    monkeypatch.setattr(plt, "show", lambda: shown.append(len(plt.get_fignums())))
    yield shown
    plt.close("all")


def test_there_are_no_other_notebooks() -> None:
    assert sorted(file.stem for file in FOLDER.glob("*.ipynb")) == list(NAMES)


@pytest.mark.parametrize("name", NAMES)
def test_a_notebook_is_stored_without_outputs(name: str) -> None:
    cells = cells_of(name)
    assert len({cell["id"] for cell in cells}) == len(cells)
    for cell in cells:
        assert cell["cell_type"] == "markdown" or (cell["outputs"], cell["execution_count"]) == ([], None)


def test_the_notebook_docks(figures: list[int], capsys: pytest.CaptureFixture[str]) -> None:
    rides = run("dock")["rides"]
    assert capsys.readouterr().out.count("docked after") == 3
    times = {name: ride[-1, 0] for name, ride in rides.items()}
    assert times["brisk"] < times["default"] < times["gentle"]
    assert figures == [1]


@pytest.mark.acceptance
def test_the_notebook_reproduces_the_tables(figures: list[int]) -> None:
    names = run("reproduce_table_ii")
    for scenario, times in names["IN_PAPER"].items():
        found = tuple(published_run(scenario, method)["time_in_paper_s"] for method in names["METHODS"])
        assert times == found
    dynamic = names["table"].xs("dynamic", level="method")
    assert dynamic["T [s]"].to_list() == pytest.approx(dynamic["T in the paper [s]"].to_list(), rel=0.1)
    assert figures == [1]
