"""Files of docks: what they say, and each mistake in one sentence."""

from __future__ import annotations

from collections.abc import Callable
from math import pi
from pathlib import Path

import numpy as np
import pytest

from geometry import Pose2
from rti_mpcc.cli import main
from rti_mpcc.errors import ScenarioError
from rti_mpcc.report.docks_figure import docks_figure, docks_rows
from rti_mpcc.simulation import load_docks, read_docks
from rti_mpcc.steps import Approach, DockKind, Straight

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
Told = Callable[[str], str]


@pytest.fixture
def told(tmp_path: Path) -> Told:
    """What is told of a text, without the file's name."""

    def refused(text: str) -> str:
        file = tmp_path / "docks.toml"
        file.write_text(text, encoding="utf-8")
        with pytest.raises(ScenarioError) as error:
            load_docks(file)
        return str(error.value).replace(f"{file}: ", "")

    return refused


def written(folder: Path, text: str) -> Path:
    file = folder / "yard.toml"
    file.write_text(text, encoding="utf-8")
    return file


def test_what_a_file_says(tmp_path: Path) -> None:
    docks = load_docks(written(tmp_path, FIRST + SECOND))
    assert list(docks) == ["first", "second"]
    first = docks["first"]
    assert first.pose == Pose2(10.0, 5.0, 0.5 * pi)
    assert first.kind is DockKind.CHARUCO
    assert first.tolerance == (0.05, 0.02, 0.01)
    assert first.approach == Approach(2.0, -1)
    assert first.contact == Straight(-1.3, speed=0.1, steering=0.05, tolerance=(0.02, 0.01))
    assert first.board is not None
    assert (first.board.x, list(first.board.markers)) == (-2.1, list(range(5, 15)))
    assert docks["second"].kind is DockKind.KNOWN
    assert docks["second"].board is None


def test_the_body_stands_in_the_frame_of_the_dock(tmp_path: Path) -> None:
    first = load_docks(written(tmp_path, FIRST))["first"]
    assert first.pose is not None
    body = first.body_at(first.pose)
    assert body is not None
    np.testing.assert_allclose(body, [(11.0, 1.0), (11.0, 2.9), (9.0, 2.9), (9.0, 1.0)], atol=1e-12)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('"charuco"', '"magnet"', "dock[0] first: kind = 'magnet': must be one of known, detected, charuco"),
        ('"charuco"', '"detected"', "a charuco dock has one, and no other"),
        ("board = {", "bored = {", "dock[0].bored = {'x': -2.1, 'first_marker': 5}: unknown key"),
        ("first_marker = 5", "first_marker = -1", "CharucoBoard.first_marker = -1: "),
        ("length = 2.0", "length = 0.0", "Approach.length = 0.0: must be > 0, and finite"),
        ("direction = -1", "direction = 2", "Approach.direction = 2: must be 1 (forward) or -1"),
        ("distance = -1.3", "distance = 0.0", "Straight.distance = 0.0: must be finite, and not 0"),
        ("10.0, 5.0,", "nan, 5.0,", "dock[0].pose[0] = nan: must be a finite number"),
        ("[0.05, 0.02, 0.01]", "[0.05, -0.02, 0.01]", "Dock.tolerance = (0.05, -0.02, 0.01): must be three"),
        ("[-2.1, -1.0], [-2.1, 1.0]", "[-2.1, 1.0], [-2.1, -1.0]", "Dock.body is not a simple polygon"),
        ("[-2.1, -1.0], [-2.1, 1.0]", "[-0.5, -1.0], [-0.5, 1.0]", "must not overlap the docked vehicle"),
        ('name = "first"', 'name = ""', "dock[0].name = ''"),
        ("pose = [10.0, 5.0, 1.5707963267948966]", "", "dock[0].pose: required"),
    ],
)
def test_each_mistake_in_a_sentence(told: Told, old: str, new: str, said: str) -> None:
    assert old in FIRST
    lines = told(FIRST.replace(old, new))
    assert said in lines
    assert "\n" not in lines


def test_two_of_one_name(told: Told) -> None:
    said = "dock[1].name = 'second': there is a dock of this name already"
    assert told(SECOND + SECOND) == said


def test_boards_that_share_markers(told: Told) -> None:
    other = FIRST.replace("first", "other", 1).replace("10.0", "30.0").replace("er = 5", "er = 14")
    said = told(FIRST + other)
    assert said == "dock other: board.first_marker = 14: must share no marker with the board of dock 'first'"


@pytest.mark.parametrize("board", ["first_marker = 15", 'dictionary = "DICT_5X5_50", first_marker = 5'])
def test_boards_that_share_none(tmp_path: Path, board: str) -> None:
    other = FIRST.replace("first", "other", 1).replace("10.0", "30.0").replace("first_marker = 5", board)
    assert list(load_docks(written(tmp_path, FIRST + other))) == ["first", "other"]


def test_a_dock_in_an_obstacle(told: Told) -> None:
    area = "[area]\nobstacles = [[[19.0, 4.0], [20.0, 4.0], [20.0, 6.0], [19.0, 6.0]]]\n"
    assert told(SECOND + area) == "dock second: pose: the docked vehicle overlaps something of the area"


def test_an_approach_through_an_obstacle(told: Told) -> None:
    area = "[area]\nobstacles = [[[12.0, 4.0], [13.0, 4.0], [13.0, 6.0], [12.0, 6.0]]]\n"
    approach = "approach = { length = 8.0, direction = 1 }\n"
    said = told(SECOND + approach + area)
    assert said == "dock second: pose: its approach overlaps something of the area"


def test_files_that_are_none(told: Told, tmp_path: Path) -> None:
    assert "is not TOML" in told("[[dock]")
    assert "dock: required" in told("")
    with pytest.raises(ScenarioError, match="cannot be read"):
        load_docks(tmp_path / "none.toml")


def test_the_command_lists_and_draws(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = written(tmp_path, FIRST + SECOND)
    assert main(["docks", str(file), "--out", str(tmp_path / "out")]) == 0
    assert (tmp_path / "out" / "docks.png").stat().st_size > 10_000
    said = capsys.readouterr().out
    assert "first" in said
    assert "heading [deg]" in said


def test_the_command_refuses_in_sentences(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["docks", str(written(tmp_path, SECOND + SECOND))]) == 2
    said = capsys.readouterr().err
    assert "there is a dock of this name already" in said
    assert "Traceback" not in said


def test_the_picture_shows_every_dock(tmp_path: Path) -> None:
    docks = read_docks(written(tmp_path, FIRST + SECOND))
    (axes,) = docks_figure("yard", docks).axes
    assert [text.get_text() for text in axes.texts if text.get_text()] == ["first", "second"]
    labels = set(axes.get_legend_handles_labels()[1])
    assert {"docked vehicle", "approach", "what is docked at", "board", "after the contact move"} <= labels
    assert axes.get_aspect() == 1.0


def test_a_row_for_each_dock(tmp_path: Path) -> None:
    rows = docks_rows(read_docks(written(tmp_path, FIRST + SECOND)))
    assert rows[0] == ("first", "charuco", "10.00, 5.00, 90.0", "2 in reverse", "0.05, 0.02, 0.57", "-1.3")
    assert rows[1] == ("second", "known", "20.00, 5.00, 0.0", "-", "-", "-")
