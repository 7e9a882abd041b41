"""Scenario files without a path: what they mean, and every way of getting them wrong."""

from __future__ import annotations

from math import inf, nan, pi
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from geometry import Pose2
from rti_mpcc.config import Clearance
from rti_mpcc.errors import InputError, ScenarioError
from rti_mpcc.simulation import (
    Scenario,
    builtin_names,
    changed,
    load_scenario,
    save_scenario,
    scenario_from_dict,
    scenario_text,
)
from rti_mpcc.simulation.solid import SolidThings
from rti_mpcc.simulation.variants import mirrored, moved, turned_round

IN_AN_AREA = [name for name in builtin_names() if load_scenario(name).in_area]
CROSSED = [[0.0, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0]]
MAP = """image: yard.pgm
resolution: 1.0
origin: [-10, -6, 0]
negate: 0
occupied_thresh: 0.65
free_thresh: 0.2
"""


def write_map(folder: Path) -> None:
    """40 m by 12 m, free but for its rim."""
    cells = np.full((12, 40), 254, dtype=np.uint8)
    cells[[0, -1]] = cells[:, [0, -1]] = 0
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "yard.pgm").write_bytes(b"P5\n40 12\n255\n" + cells.tobytes())
    (folder / "yard.yaml").write_text(MAP)


def on_map(tables: dict[str, Any]) -> dict[str, Any]:
    return {**tables, "area": {"map": "yard.yaml"}}


def refused(tables: dict[str, Any], folder: Path | None = None) -> list[str]:
    """The lines on a file that must be refused."""
    with pytest.raises(ScenarioError) as caught:
        scenario_from_dict(tables, source="bad.toml", folder=folder)
    return str(caught.value).splitlines()


# -- what they mean ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", IN_AN_AREA)
def test_built_in_ones_have_room_at_start_and_goal(name: str, caplog: pytest.LogCaptureFixture) -> None:
    scenario = load_scenario(name)
    assert scenario.name == name
    assert scenario.description
    assert (scenario.simulation.dead_time, scenario.simulation.cycle) == (0.18, 0.05)
    ends = [scenario.start_pose(), scenario.goal_pose()]
    poses = np.array([(pose.x, pose.y, pose.phi) for pose in ends])
    room = SolidThings.of(scenario.build_area()).clearance(poses, scenario.build_vehicle())
    assert (room > Clearance().on_routes - 0.01).all()
    assert not caplog.records


def test_there_are_some_of_them_two_on_a_map() -> None:
    assert len(IN_AN_AREA) == 6
    sections = [load_scenario(name).area for name in IN_AN_AREA]
    assert sum(section is not None and section.map is not None for section in sections) == 2


def test_start_area_and_goal(hall: Scenario) -> None:
    assert hall.in_area
    assert hall.start_pose() == Pose2(0.0, 0.0, 0.0)
    assert hall.goal_pose() == hall.planned_goal() == Pose2(15.0, 0.0, 0.0)
    area = hall.build_area()
    assert area.boundary is not None
    assert area.boundary.max(axis=0).tolist() == [25.0, 6.0]
    assert len(area.obstacles) == 1
    assert not hall.goal_is_path_end


def test_a_path_has_a_start_too(straight: Scenario) -> None:
    assert not straight.in_area
    assert straight.start_pose() == Pose2(0.0, 0.0, 0.0)
    with pytest.raises(InputError, match=r"straight: has no \[area\]"):
        straight.build_area()
    with pytest.raises(InputError, match=r"goal.pose: required where there is no path"):
        straight.goal_pose()


def test_there_is_neither_path_nor_corridor(hall: Scenario) -> None:
    with pytest.raises(InputError, match=r"hall: has no \[path\]"):
        hall.build_path()
    with pytest.raises(InputError, match=r"hall: has no \[corridor\]"):
        _ = hall.corridor


def test_without_a_boundary_it_is_a_box_around_all_that_is_given(hall: Scenario) -> None:
    boundary = changed(hall, {"area.boundary": None}).build_area().boundary
    assert boundary is not None
    assert (boundary.min(axis=0).tolist(), boundary.max(axis=0).tolist()) == ([-15.0, -15.0], [30.0, 19.0])
    bare = changed(hall, {"area": {}}).build_area().boundary
    assert bare is not None
    assert (bare.min(axis=0).tolist(), bare.max(axis=0).tolist()) == ([-15.0, -15.0], [30.0, 15.0])


def test_goal_that_is_detected_is_planned_beside_the_true_one(hall: Scenario) -> None:
    scenario = changed(hall, {"goal.measurement": {"initial_offset": [0.1, -0.2, 0.05]}})
    assert scenario.goal_pose() == Pose2(15.0, 0.0, 0.0)
    assert scenario.planned_goal() == Pose2(15.1, -0.2, 0.05)


def test_start_or_goal_in_collision_is_left_to_the_planner(hall: Scenario) -> None:
    changed(hall, {"goal.pose": [9.0, 3.0, 0.0]})
    changed(hall, {"start.pose": [-40.0, 0.0, 0.0]})


def test_map_lies_beside_the_scenario(hall_tables: dict[str, Any], tmp_path: Path) -> None:
    write_map(tmp_path)
    scenario = scenario_from_dict(on_map(hall_tables), folder=tmp_path)
    for one in (scenario, changed(scenario, {"simulation.cycle": 0.1})):
        boundary = one.build_area().boundary
        assert boundary is not None
        assert boundary.max(axis=0).tolist() == [30.0, 6.0]


def test_written_and_read_back(hall: Scenario, tmp_path: Path) -> None:
    scenario = changed(hall, {"goal.shifts": [{"at_distance": 3.0, "offset": [0.1, 1 / 3, 0.0]}]})
    assert load_scenario(save_scenario(scenario, tmp_path / "new")) == scenario
    assert "[path]" not in scenario_text(hall)


def test_a_map_is_found_from_elsewhere(
    hall_tables: dict[str, Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write_map(tmp_path)
    monkeypatch.chdir(tmp_path)
    scenario = scenario_from_dict(on_map(hall_tables), folder=Path())
    again = load_scenario(save_scenario(scenario, tmp_path / "elsewhere"))
    assert again.build_area().boundary == pytest.approx(np.array(scenario.build_area().boundary))


# -- elsewhere, mirrored, turned round ---------------------------------------------------------------------


def test_moved(hall: Scenario) -> None:
    other = moved(hall, Pose2(1.0, 2.0, 0.5 * pi))
    assert other.start_pose() == Pose2(1.0, 2.0, 0.5 * pi)
    assert (other.goal_pose().x, other.goal_pose().y) == pytest.approx((1.0, 17.0))
    (box,) = other.build_area().obstacles
    assert (*box.min(axis=0), *box.max(axis=0)) == pytest.approx((-3.0, 10.0, -1.0, 12.0))
    boundary = other.build_area().boundary
    assert boundary is not None
    assert boundary.max(axis=0) == pytest.approx((7.0, 27.0))


def test_mirrored(hall: Scenario) -> None:
    other = mirrored(changed(hall, {"start.pose": [0.0, 1.0, 0.2]}))
    assert other.start_pose() == Pose2(0.0, -1.0, -0.2)
    (box,) = other.build_area().obstacles
    assert (*box.min(axis=0), *box.max(axis=0)) == pytest.approx((8.0, -4.0, 10.0, -2.0))
    assert mirrored(other) == changed(hall, {"start.pose": [0.0, 1.0, 0.2]})


def test_turned_round(hall: Scenario) -> None:
    other = turned_round(hall)
    assert (other.start_pose().phi, other.goal_pose().phi) == (pi, pi)
    assert other.vehicle.front == hall.vehicle.rear
    assert other.area == hall.area


def test_a_map_cannot_be_moved(hall_tables: dict[str, Any], tmp_path: Path) -> None:
    write_map(tmp_path)
    scenario = scenario_from_dict(on_map(hall_tables), folder=tmp_path)
    with pytest.raises(InputError, match=r"area.map = .*yard.yaml'?: only an area of polygons"):
        moved(scenario, Pose2(1.0, 0.0, 0.0))


# -- what is refused ---------------------------------------------------------------------------------------

EITHER = "either [path] and [corridor], or [start], [area] and goal.pose"
PATH = {"start": [0, 0, 0], "segments": [{"direction": 1, "curvature": 0, "length": 10}]}
SIDES = {"left": 3, "right": -3}

WRONG: list[tuple[dict[str, Any], list[str]]] = [
    ({"start": None}, [f"start: required: {EITHER}"]),
    ({"area": None}, [f"area: required: {EITHER}"]),
    ({"goal": None}, [f"goal.pose: required: {EITHER}"]),
    ({"goal": {}}, [f"goal.pose: required: {EITHER}"]),
    ({"start": None, "area": None}, [f"path: required: {EITHER}", f"corridor: required: {EITHER}"]),
    ({"path": PATH}, [f"start: {EITHER}, not both", f"area: {EITHER}, not both"]),
    ({"corridor": SIDES}, [f"start: {EITHER}, not both", f"area: {EITHER}, not both"]),
    ({"path": PATH, "corridor": SIDES}, [f"start: {EITHER}, not both", f"area: {EITHER}, not both"]),
    ({"path": PATH, "corridor": SIDES, "area": None}, [f"start: {EITHER}, not both"]),
    ({"path": PATH, "corridor": SIDES, "start": None}, [f"area: {EITHER}, not both"]),
    ({"path": PATH, "start": None, "area": None}, [f"corridor: required: {EITHER}"]),
    (
        {"goal": {"pose": [15.0, 0.0, 0.0], "offset": [1.0, 0.0, 0.0]}},
        [
            "goal.offset = (1.0, 0.0, 0.0): only with [path], from whose end it is counted: give goal.pose",
            "goal.pose = (15.0, 0.0, 0.0): either offset or pose, not both",
        ],
    ),
    (
        {"controller": {"docking_time": 30.0}},
        [
            "controller.docking_time = 30.0: only with [path]: how long an unknown way takes is not known "
            "before"
        ],
    ),
    ({"start": {}}, ["start.pose: required"]),
    ({"start": {"pose": [0.0, 0.0]}}, ["start.pose[2]: required"]),
    ({"start": {"pose": [0.0, nan, 0.0]}}, ["start.pose[1] = nan: must be a finite number"]),
    ({"start": {"pose": [0.0, "0", 0.0]}}, ["start.pose[1] = '0': must be a number"]),
    (
        {"start": {"at": [0, 0, 0]}},
        ["start.pose: required", "start.at = [0, 0, 0]: unknown key, allowed are pose"],
    ),
    ({"start": [0.0, 0.0, 0.0]}, ["start = [0.0, 0.0, 0.0]: must be a table"]),
    ({"goal": {"pose": [15.0, inf, 0.0]}}, ["goal.pose[1] = inf: must be a finite number"]),
    ({"area": {"walls": []}}, ["area.walls = []: unknown key, allowed are boundary, obstacles, map"]),
    ({"area": {"map": 3}}, ["area.map = 3: must be text"]),
    (
        {"area": {"boundary": [[0.0, 0.0], [1.0, 0.0]]}},
        ["area.boundary = [[0.0, 0.0], [1.0, 0.0]]: number of entries must be >= 3, not 2"],
    ),
    (
        {"area": {"boundary": [[0, 0], [9, 0], [9, nan]]}},
        ["area.boundary[2][1] = nan: must be a finite number"],
    ),
    (
        {"area": {"obstacles": [[[0, 0], [9, 0], [9, 9]], [[0, 0], [9, 0], [9, "x"]]]}},
        ["area.obstacles[1][2][1] = 'x': must be a number"],
    ),
    (
        {"area": {"boundary": CROSSED}},
        [
            "area.boundary = [[0.0, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0]]: must be a polygon whose "
            "outline does not cross itself, it is not a simple polygon (Self-intersection[0.5 0.5])"
        ],
    ),
    (
        {"area": {"obstacles": [[[0, 0], [9, 0], [9, 9]], CROSSED]}},
        [
            "area.obstacles[1] = [[0.0, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0]]: must be a polygon whose "
            "outline does not cross itself, it is not a simple polygon (Self-intersection[0.5 0.5])"
        ],
    ),
    (
        {"area": {"boundary": [[0, 0], [9, 0], [0, 0]]}},
        [
            "area.boundary = [[0.0, 0.0], [9.0, 0.0], [0.0, 0.0]]: must be a polygon whose outline does "
            "not cross itself, it has 2 corner(s), a polygon needs at least 3"
        ],
    ),
]


@pytest.mark.parametrize(("changes", "lines"), WRONG, ids=[str(one)[:60] for one, _ in WRONG])
def test_wrong_values_are_named(
    hall_tables: dict[str, Any], changes: dict[str, Any], lines: list[str]
) -> None:
    tables = {key: value for key, value in {**hall_tables, **changes}.items() if value is not None}
    assert refused(tables) == [f"bad.toml: {line}" for line in lines]


def test_an_outline_without_width_is_refused(hall_tables: dict[str, Any]) -> None:
    hall_tables["area"]["boundary"] = [[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]]
    (line,) = refused(hall_tables)
    assert "area.boundary" in line
    assert "is not a simple polygon" in line


@pytest.mark.parametrize(
    "other", [{"boundary": [[0, 0], [9, 0], [9, 9]]}, {"obstacles": [[[0, 0], [9, 0], [9, 9]]]}]
)
def test_map_stands_alone(hall_tables: dict[str, Any], tmp_path: Path, other: dict[str, Any]) -> None:
    write_map(tmp_path)
    (line,) = refused({**hall_tables, "area": {"map": "yard.yaml", **other}}, tmp_path)
    assert line.startswith("bad.toml: area.map = ")
    assert line.endswith(": either map, or boundary and obstacles, not both")


@pytest.mark.parametrize(
    ("spoil", "said"),
    [
        (lambda folder: (folder / "yard.yaml").unlink(), "yard.yaml: cannot be read"),
        (lambda folder: (folder / "yard.pgm").unlink(), "yard.pgm cannot be read"),
        (lambda folder: (folder / "yard.pgm").write_text("P5"), "yard.pgm"),
        (
            lambda folder: (folder / "yard.yaml").write_text(MAP.replace("1.0", "x")),
            "resolution = 'x': must be",
        ),
    ],
)
def test_bad_maps_are_refused_in_one_line(
    hall_tables: dict[str, Any], tmp_path: Path, spoil: Any, said: str
) -> None:
    write_map(tmp_path)
    spoil(tmp_path)
    (line,) = refused(on_map(hall_tables), tmp_path)
    assert line.startswith("bad.toml: area.map = '")
    assert said in line


def test_settings_are_checked_too(hall_tables: dict[str, Any]) -> None:
    (line,) = refused({**hall_tables, "vehicle": {"wheelbase": 20.0, "outline": CROSSED}})
    assert line.startswith("bad.toml: controller: ")
