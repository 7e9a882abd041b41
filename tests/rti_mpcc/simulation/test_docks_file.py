"""Files of docks: what they say, and each mistake in one sentence."""

from __future__ import annotations

import re
from math import pi
from pathlib import Path

import pytest
from pydantic import BaseModel

from estimation import CharucoBoard
from geometry import Pose2
from rti_mpcc.config import Vehicle
from rti_mpcc.errors import ScenarioError
from rti_mpcc.mission import Approach, DockKind, Straight
from rti_mpcc.simulation import load_docks, read_docks
from rti_mpcc.simulation.docks_file import DockSection, MoveSection
from rti_mpcc.simulation.sections.mission import ApproachSection
from tests.rti_mpcc.dock_files import EXAMPLE, FIRST, SECOND, written


def test_what_a_file_says(tmp_path: Path) -> None:
    docks = load_docks(written(tmp_path, FIRST + SECOND))
    assert list(docks) == ["first", "second"]
    first = docks["first"]
    assert first.name == "first"
    assert first.pose == Pose2(10.0, 5.0, 0.5 * pi)
    assert first.kind is DockKind.CHARUCO
    assert first.tolerance == (0.05, 0.02, 0.01)
    assert first.approach == Approach(2.0, -1)
    assert first.contact == Straight(-1.3, speed=0.1, tolerance=(0.02, 0.01))
    assert first.board == CharucoBoard(x=-2.1, first_marker=5)


def test_a_vehicle_and_an_area(tmp_path: Path) -> None:
    more = "[vehicle]\nwidth = 1.5\n[area]\nboundary = [[0, 0], [30, 0], [30, 20], [0, 20]]\n"
    docks = read_docks(written(tmp_path, FIRST + more))
    assert docks.vehicle == Vehicle(width=1.5)
    assert docks.area is not None
    assert docks.area.boundary is not None
    assert docks.area.boundary.max(axis=0).tolist() == [30.0, 20.0]


def test_all_keys_are_documented() -> None:
    page = (EXAMPLE.parents[1] / "docs" / "docks.md").read_text(encoding="utf-8")
    tables = re.split(r"^\| \*\*`\[+([\w.]+)\]+`\*\*", page, flags=re.MULTILINE)
    found = {
        name: {
            key
            for cell in re.findall(r"^\| (`.*?) \|", rows, re.MULTILINE)
            for key in re.findall(r"\w+", cell)
        }
        for name, rows in zip(tables[1::2], tables[2::2], strict=True)
    }
    inner: dict[str, type[BaseModel]] = {
        "board": CharucoBoard,
        "approach": ApproachSection,
        "contact": MoveSection,
    }
    assert found["dock"] | set(inner) == set(DockSection.model_fields)
    for name, model in inner.items():
        assert found[f"dock.{name}"] == set(model.model_fields)


def test_two_of_one_name(tmp_path: Path) -> None:
    said = "dock[1].name = 'second': must be a name of its own, dock[0] has it already"
    with pytest.raises(ScenarioError, match=re.escape(said)):
        load_docks(written(tmp_path, SECOND + SECOND))


@pytest.mark.parametrize("dictionary", ["DICT_4X4_50", "DICT_4X4_100"])
def test_boards_that_share_markers(tmp_path: Path, dictionary: str) -> None:
    board = f'first_marker = 14, dictionary = "{dictionary}"'
    other = FIRST.replace("first", "other", 1).replace("10.0", "30.0").replace("first_marker = 5", board)
    said = "must leave the markers 5 to 14 of DICT_4X4_50 to the board of dock 'first'"
    with pytest.raises(ScenarioError, match=re.escape(f"dock[1].board.first_marker = 14: {said}")):
        load_docks(written(tmp_path, FIRST + other))


def test_a_body_may_touch_the_docked_vehicle(tmp_path: Path) -> None:
    text = FIRST.replace("-2.1, -1.0], [-2.1,", f"{-Vehicle().rear}, -1.0], [{-Vehicle().rear},")
    assert text != FIRST
    assert list(load_docks(written(tmp_path, text))) == ["first"]
