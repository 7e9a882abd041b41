"""Files of docks: what they say, and each mistake in one sentence."""

from __future__ import annotations

import re
from collections.abc import Callable
from math import pi
from pathlib import Path

import numpy as np
import pytest
from pydantic import BaseModel

from estimation import CharucoBoard
from geometry import Pose2
from rti_mpcc.config import Vehicle
from rti_mpcc.errors import ScenarioError
from rti_mpcc.simulation import load_docks, read_docks
from rti_mpcc.simulation.docks_file import ContactSection, DockSection, approach_poses
from rti_mpcc.simulation.mission import ApproachSection
from rti_mpcc.steps import Approach, DockKind, Straight
from tests.rti_mpcc.dock_files import EXAMPLE, FIRST, SECOND, written

Told = Callable[[str], str]
ACROSS = "[[0.0, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0]]"
"""An outline that crosses itself."""


@pytest.fixture
def told(tmp_path: Path) -> Told:
    """What is told of a text, without the file's name, which is before each line."""

    def refused(text: str) -> str:
        file = written(tmp_path, text)
        with pytest.raises(ScenarioError) as error:
            load_docks(file)
        lines = str(error.value).splitlines()
        assert all(line.startswith(f"{file}: ") for line in lines)
        return "\n".join(line.removeprefix(f"{file}: ") for line in lines)

    return refused


# -- what a file says ----------------------------------------------------------------------------------------


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


def test_what_need_not_be_given(tmp_path: Path) -> None:
    docks = read_docks(written(tmp_path, SECOND))
    second = docks.docks["second"]
    assert second.kind is DockKind.KNOWN
    assert [second.tolerance, second.body, second.board, second.approach, second.contact] == [None] * 5
    assert docks.vehicle == Vehicle()
    assert docks.area is None


def test_a_contact_move_is_as_a_straight_one_has_it(tmp_path: Path) -> None:
    text = FIRST.replace(", speed = 0.1, tolerance = [0.02, 0.01]", "")
    assert load_docks(written(tmp_path, text))["first"].contact == Straight(-1.3)


@pytest.mark.parametrize("kind", ["known", "detected"])
def test_the_kinds_without_a_board(tmp_path: Path, kind: str) -> None:
    assert load_docks(written(tmp_path, f'{SECOND}kind = "{kind}"\n'))["second"].kind is DockKind(kind)


def test_the_body_stands_in_the_frame_of_the_dock(tmp_path: Path) -> None:
    first = load_docks(written(tmp_path, FIRST))["first"]
    assert first.pose is not None
    body = first.body_at(first.pose)
    assert body is not None
    np.testing.assert_allclose(body, [(11.0, 1.0), (11.0, 2.9), (9.0, 2.9), (9.0, 1.0)], atol=1e-12)


def test_tables_may_be_written_out(tmp_path: Path) -> None:
    tables = "[dock.board]\nx = -2.1\nfirst_marker = 5\n[dock.approach]\nlength = 2.0\ndirection = -1\n"
    inline = "board = { x = -2.1, first_marker = 5 }\napproach = { length = 2.0, direction = -1 }\n"
    text = FIRST.replace(inline, "")
    assert text != FIRST
    first, again = (load_docks(written(tmp_path, each))["first"] for each in (FIRST, text + tables))
    assert (again.board, again.approach) == (first.board, first.approach)


def test_a_vehicle_and_an_area(tmp_path: Path) -> None:
    more = "[vehicle]\nwidth = 1.5\n[area]\nboundary = [[0, 0], [30, 0], [30, 20], [0, 20]]\n"
    docks = read_docks(written(tmp_path, FIRST + more))
    assert docks.vehicle == Vehicle(width=1.5)
    assert docks.area is not None
    assert docks.area.boundary is not None
    assert docks.area.boundary.max(axis=0).tolist() == [30.0, 20.0]


def test_a_map_lies_beside_the_file(tmp_path: Path) -> None:
    size, solid, free = 100, 0, 254
    picture = np.full((size, size), free, dtype=np.uint8)
    picture[0] = solid
    (tmp_path / "yard.pgm").write_bytes(b"P5 %d %d 255\n" % picture.shape + picture.tobytes())
    (tmp_path / "yard.yaml").write_text(
        "image: yard.pgm\nresolution: 0.5\norigin: [0.0, 0.0, 0.0]\n"
        "negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"
    )
    docks = read_docks(written(tmp_path, 'area = { map = "yard.yaml" }\n' + FIRST))
    assert docks.area is not None
    assert len(docks.area.obstacles) > 0


def test_the_approach_ends_at_the_dock(tmp_path: Path) -> None:
    docks = load_docks(written(tmp_path, FIRST + SECOND))
    poses = approach_poses(docks["first"])
    assert poses[0] == docks["first"].pose
    assert (poses[-1].x, poses[-1].y) == pytest.approx((10.0, 7.0))
    assert approach_poses(docks["second"]) == []


def test_the_example() -> None:
    docks = load_docks(EXAMPLE)
    assert list(docks) == ["capsule_a", "capsule_b", "charger"]


def test_what_is_uncertain_needs_a_body_and_an_approach(tmp_path: Path) -> None:
    file = tmp_path / "docks.toml"
    text = '[[dock]]\nname = "one"\npose = [1.0, 2.0, 0.0]\nuncertainty = [1.0, 0.2]\n'
    file.write_text(text, encoding="utf-8")
    with pytest.raises(ScenarioError, match="only of a dock with a body and an approach"):
        load_docks(file)
    more = "body = [[-4.0, -1.0], [-2.0, -1.0], [-2.0, 1.0]]\napproach = { length = 1.0, direction = -1 }\n"
    file.write_text(text + more, encoding="utf-8")
    assert load_docks(file)["one"].uncertainty == (1.0, 0.2)


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
        "contact": ContactSection,
    }
    assert found["dock"] | set(inner) == set(DockSection.model_fields)
    for name, model in inner.items():
        assert found[f"dock.{name}"] == set(model.model_fields)


# -- and what is wrong with it -------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('name = "first"', 'name = ""', "name = '': must be text in one line, without blanks at its ends"),
        ('name = "first"', 'name = "a\\nb"', r"name = 'a\nb': must be text in one line"),
        ('name = "first"', "", "name: required"),
        ("pose = [10.0, 5.0, 1.5707963267948966]", "", "pose: required"),
        ("10.0, 5.0,", "nan, 5.0,", "pose[0] = nan: must be a finite number"),
        ("10.0, 5.0,", "10.0, inf,", "pose[1] = inf: must be a finite number"),
        ("10.0, 5.0,", "1e300, 5.0,", "pose[0] = 1e+300: must be <= 1e+08"),
        ("1.5707963267948966", "90", "pose[2] = 90: must be <= 6.28319"),
        ("1.5707963267948966", "true", "pose[2] = True: must be a number"),
        ('"charuco"', '"magnet"', "kind = 'magnet': must be 'known', 'detected' or 'charuco'"),
        ('"charuco"', '"detected"', "kind = 'detected': must be 'charuco' where there is a board"),
        ("board = { x = -2.1, first_marker = 5 }", "", "board: required for kind = 'charuco'"),
        ("kind =", "colour = 1\nkind =", "colour = 1: unknown key, allowed are name, pose, kind, tolerance"),
        (
            "board = { x",
            "board = { colour = 1, x",
            "board.colour = 1: unknown key, allowed are columns,",
        ),
        ("first_marker = 5", "first_marker = -1", "board.first_marker = -1: must be >= 0"),
        ("x = -2.1, f", "x = nan, f", "board.x = nan: must be a finite number"),
        ("x = -2.1, f", 'x = "far", f', "board.x = 'far': must be a number"),
        ("x = -2.1, f", "columns = 4.5, f", "board.columns = 4.5: must be an integer"),
        ("x = -2.1, f", "marker = 0.3, f", "marker = 0.3: must be smaller than square = 0.2"),
        (
            "first_marker = 5",
            "first_marker = 41",
            "board.dictionary = 'DICT_4X4_50': must have the markers 41 to 50 of the board, has 0 to 49",
        ),
        ("length = 2.0", "length = 0.0", "approach.length = 0.0: must be > 0"),
        ("length = 2.0", "length = 1e9", "approach.length = 1000000000.0: must be <= 100"),
        ("length = 2.0", "length = inf", "approach.length = inf: must be a finite number"),
        ("length = 2.0", "long = 2.0, length = 2.0", "approach.long = 2.0: unknown key, allowed are length"),
        ("direction = -1", "direction = 2", "approach.direction = 2: must be 1 or -1"),
        (", direction = -1", "", "approach.direction: required"),
        ("distance = -1.3", "distance = 0.0", "contact.distance = 0.0: must not be 0"),
        ("distance = -1.3", "distance = nan", "contact.distance = nan: must be a finite number"),
        ("distance = -1.3", "distance = -1e3", "contact.distance = -1000.0: must be >= -100"),
        ("speed = 0.1", "speed = 0.0", "contact.speed = 0.0: must be > 0"),
        ("speed = 0.1", "steering = -0.1", "contact.steering = -0.1: must be > 0"),
        ("speed = 0.1", "until = 0.1", "contact.until = 0.1: unknown key, allowed are distance, speed"),
        ("[0.02, 0.01] }", "[0.02, 0.0] }", "contact.tolerance[1] = 0.0: must be > 0"),
        ("[0.05, 0.02, 0.01]", "[0.05, -0.02, 0.01]", "tolerance[1] = -0.02: must be > 0"),
        ("[0.05, 0.02, 0.01]", "[0.05, 0.02]", "tolerance[2]: required"),
        ("[-2.1, -1.0], [-2.1, 1.0]", "[-2.1, nan], [-2.1, 1.0]", "body[1][1] = nan: must be a finite"),
        (", [-2.1, 1.0], [-4.0, 1.0]]", "]", "number of entries must be >= 3, not 2"),
        (
            "[-2.1, -1.0], [-2.1, 1.0]",
            "[-2.1, 1.0], [-2.1, -1.0]",
            "must be a polygon whose outline does not cross itself",
        ),
        ("[-2.1, -1.0], [-2.1, 1.0]", "[-0.5, -1.0], [-0.5, 1.0]", "must not overlap the docked vehicle"),
        ("direction = -1", "direction = 1", "must not overlap the approach, does by 0.7 m"),
    ],
)
def test_each_mistake_in_a_sentence(told: Told, old: str, new: str, said: str) -> None:
    assert FIRST.count(old) == 1
    line = told(FIRST.replace(old, new))
    assert line.startswith("dock[0].")
    assert said in line
    assert "\n" not in line


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ("[yard]\n", "yard = {}: unknown key, allowed are dock, vehicle, area"),
        ("[vehicle]\nwheelbase = 0\n", "vehicle.wheelbase = 0: must be > 0"),
        ("[vehicle]\nwheels = 4\n", "vehicle.wheels = 4: unknown key, allowed are wheelbase, width"),
        (f"[vehicle]\noutline = {ACROSS}\n", "it is not a simple polygon"),
        ("[area]\nsize = 4\n", "area.size = 4: unknown key, allowed are boundary, obstacles, map"),
        (f"[area]\nobstacles = [{ACROSS}]\n", f"area.obstacles[0] = {ACROSS}: must be a polygon whose"),
        (f"[area]\nboundary = {ACROSS}\n", f"area.boundary = {ACROSS}: must be a polygon whose outline"),
        (
            '[area]\nmap = "yard.yaml"\nobstacles = [[[0, 0], [1, 0], [1, 1]]]\n',
            "either map, or boundary and obstacles, not both",
        ),
        ('[area]\nmap = "yard.yaml"\n', "cannot be read"),
        (
            "[area]\nobstacles = [[[9.0, 8.0], [10.0, 8.0], [10.0, 10.0], [9.0, 10.0]]]\n",
            "dock[0].pose = [10.0, 5.0, 1.5707963267948966]: the docked vehicle must be in the area and "
            "clear of its obstacles, overlaps by 0.68 m",
        ),
        (
            "[area]\nboundary = [[0, 0], [9.5, 0], [9.5, 20], [0, 20]]\n",
            "dock[0].pose = [10.0, 5.0, 1.5707963267948966]: the docked vehicle must be in the area",
        ),
        (
            "[area]\nobstacles = [[[9.0, 10.0], [11.0, 10.0], [11.0, 11.0], [9.0, 11.0]]]\n",
            "dock[0].approach.length = 2.0: the approach must be in the area and clear of its obstacles",
        ),
        (
            "[area]\nboundary = [[0, 0], [20, 0], [20, 10], [0, 10]]\n",
            "dock[0].approach.length = 2.0: the approach must be in the area",
        ),
    ],
)
def test_mistakes_beside_the_docks(told: Told, more: str, said: str) -> None:
    line = told(FIRST + more)
    assert said in line
    assert "\n" not in line


def test_all_mistakes_are_told_at_once(told: Told) -> None:
    lines = told(FIRST.replace("2.0, direction = -1", "0.0, direction = 2") + SECOND.replace("20", "nan"))
    keys = [line.partition(" = ")[0] for line in lines.splitlines()]
    assert keys == ["dock[0].approach.length", "dock[0].approach.direction", "dock[1].pose[0]"]


def test_two_of_one_name(told: Told) -> None:
    said = "dock[1].name = 'second': must be a name of its own, dock[0] has it already"
    assert told(SECOND + SECOND) == said


@pytest.mark.parametrize("dictionary", ["DICT_4X4_50", "DICT_4X4_100"])
def test_boards_that_share_markers(told: Told, dictionary: str) -> None:
    board = f'first_marker = 14, dictionary = "{dictionary}"'
    other = FIRST.replace("first", "other", 1).replace("10.0", "30.0").replace("first_marker = 5", board)
    said = "must leave the markers 5 to 14 of DICT_4X4_50 to the board of dock 'first'"
    assert told(FIRST + other) == f"dock[1].board.first_marker = 14: {said}"


@pytest.mark.parametrize("board", ["first_marker = 15", 'dictionary = "DICT_5X5_50", first_marker = 5'])
def test_boards_that_share_none(tmp_path: Path, board: str) -> None:
    other = FIRST.replace("first", "other", 1).replace("10.0", "30.0").replace("first_marker = 5", board)
    assert list(load_docks(written(tmp_path, FIRST + other))) == ["first", "other"]


def test_a_body_may_touch_the_docked_vehicle(tmp_path: Path) -> None:
    text = FIRST.replace("-2.1, -1.0], [-2.1,", f"{-Vehicle().rear}, -1.0], [{-Vehicle().rear},")
    assert text != FIRST
    assert list(load_docks(written(tmp_path, text))) == ["first"]


def test_files_that_are_none(told: Told, tmp_path: Path) -> None:
    assert told("[[dock]").startswith("is not TOML, ")
    assert told("") == "dock: required"
    assert told("dock = []") == "dock = []: number of entries must be >= 1, not 0"
    assert told("dock = 1") == "dock = 1: must be a list"
    for nothing in (tmp_path / "none.toml", tmp_path):
        with pytest.raises(ScenarioError, match="cannot be read, "):
            load_docks(nothing)
    latin = tmp_path / "latin.toml"
    latin.write_bytes(FIRST.replace("first", "für").encode("latin-1"))
    with pytest.raises(ScenarioError, match=r"latin\.toml: is not UTF-8 text, byte"):
        load_docks(latin)
