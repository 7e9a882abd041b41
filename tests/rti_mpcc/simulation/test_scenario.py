"""Scenario files: what they mean, and every way of getting them wrong."""

from __future__ import annotations

import logging
from math import inf, nan, pi
from pathlib import Path
from typing import Any

import pytest

from geometry import Pose2
from rti_mpcc.config import ControllerConfig
from rti_mpcc.errors import InputError, ScenarioError
from rti_mpcc.simulation import Scenario, builtin_names, changed, load_scenario, scenario_from_dict

ON_A_PATH = (
    "docking_behind",
    "docking_blackout",
    "docking_full_course",
    "docking_inside",
    "docking_moving_goal",
    "docking_noisy",
    "long_approach",
    "path_following",
)
IN_AN_AREA = (
    "aisle_dock",
    "bay_perpendicular",
    "docking_mission",
    "obstacle_appears",
    "slot_parallel",
    "yard_dead_end",
)
TRIANGLE = [[6.0, 1.0], [7.0, 1.0], [7.0, 2.0]]
BOX = [[-2.0, -3.0], [12.0, -3.0], [12.0, 3.0], [-2.0, 3.0]]


def put(tables: dict[str, Any], key: str, value: Any) -> dict[str, Any]:
    *names, last = key.split(".")
    table = tables
    for name in names:
        table = table.setdefault(name, {})
    table[last] = value
    return tables


def fault(kind: str = "nan_state", **values: Any) -> dict[str, Any]:
    return {"kind": kind, "from": 1.0, "to": 2.0, **values}


def test_built_in_scenarios_are_those_of_the_contract() -> None:
    assert builtin_names() == tuple(sorted(ON_A_PATH + IN_AN_AREA))


@pytest.mark.parametrize("name", ON_A_PATH)
def test_built_in_scenarios_load_without_a_warning(name: str, caplog: pytest.LogCaptureFixture) -> None:
    scenario = load_scenario(name)
    assert scenario.name == name
    assert scenario.description
    assert (scenario.simulation.dead_time, scenario.simulation.cycle) == (0.18, 0.05)
    assert scenario.build_path().max_curvature <= 0.2 + 1e-12
    assert not caplog.records


def test_docking_scenarios_have_the_goals_of_the_contract() -> None:
    inside, behind = load_scenario("docking_inside"), load_scenario("docking_behind")
    goal = inside.goal_pose(inside.build_path())
    assert (goal.x, goal.y, goal.phi) == pytest.approx((11.08, -15.24, 1.171), abs=0.005)
    path = behind.build_path()
    assert path.length == pytest.approx(30.0)
    error = behind.goal_pose(path).relative_to(path.end)
    assert (error.x, error.y, error.phi) == pytest.approx((-4.1, -3.0, 0.1))


def test_full_course_is_thirty_metres_longer_and_so_are_its_narrowings() -> None:
    course, behind = load_scenario("docking_full_course"), load_scenario("docking_behind")
    assert course.build_path().cusps == pytest.approx((30.0,))
    for far, near in zip(course.corridor.narrowings, behind.corridor.narrowings, strict=True):
        assert (far.start - 30.0, far.end - 30.0, far.left, far.right) == (
            near.start,
            near.end,
            near.left,
            near.right,
        )


def test_long_approach_is_as_described() -> None:
    scenario = load_scenario("long_approach")
    path = scenario.build_path()
    assert path.length == pytest.approx(150.0)
    assert not path.cusps
    assert scenario.limits.speed == 3.0
    goal = scenario.goal_pose(path).relative_to(path.end)
    assert (goal.x, abs(goal.y)) == pytest.approx((2.0, 0.8))


def test_defaults_are_those_of_the_contract(straight: Scenario) -> None:
    config = straight.controller_config()
    assert config.goal_tolerance == (0.05, 0.05, pi / 90.0)
    assert (config.cycle, config.dead_time, config.deadline) == (0.05, 0.0, None)
    assert (config.vehicle.wheelbase, config.limits.speed) == (2.875, 10.0)
    assert (straight.simulation.plant_step, straight.simulation.duration) == (0.01, 120.0)
    assert straight.goal_is_path_end
    assert straight.goal_pose(straight.build_path()) == Pose2(10.0, 0.0, 0.0)


def test_controller_assumes_the_dead_time_of_the_plant_unless_told(straight: Scenario) -> None:
    scenario = changed(straight, {"simulation.dead_time": 0.18})
    assert scenario.controller_config().dead_time == 0.18
    scenario = changed(scenario, {"controller.dead_time": 0.1, "controller.comfort_acceleration": 0.3})
    config = scenario.controller_config("paper")
    assert (config.dead_time, config.comfort_acceleration) == (0.1, 0.3)
    assert scenario.plant_parameters().dead_time == 0.18


def test_presets_are_the_configs(straight: Scenario) -> None:
    assert straight.controller_config("default").arrival
    for preset, whole in (
        ("paper", ControllerConfig.paper()),
        ("paper_printed", ControllerConfig.paper_printed()),
    ):
        config = straight.controller_config(preset)
        assert (config.weights, config.objective) == (whole.weights, whole.objective)
    with pytest.raises(InputError, match="preset = 'none': must be one of default, paper, paper_printed"):
        straight.controller_config("none")


def test_integers_stand_for_numbers(tables: dict[str, Any]) -> None:
    put(tables, "simulation.duration", 30)
    assert scenario_from_dict(tables).simulation.duration == 30.0


def test_polygon_corridor_and_obstacles(tables: dict[str, Any]) -> None:
    tables["corridor"] = {"polygon": BOX, "obstacles": [TRIANGLE]}
    scenario = scenario_from_dict(tables)
    corridor = scenario.build_corridor(scenario.build_path())
    assert len(corridor.obstacles) == 1


def test_path_file_lies_beside_the_scenario(tmp_path: Path) -> None:
    rows = ["x,y,heading,direction", *(f"{x},0.0,0.0,1" for x in range(0, 11, 2))]
    (tmp_path / "way.csv").write_text("\n".join(rows))
    file = tmp_path / "mine.toml"
    file.write_text('name = "mine"\n[path]\nfile = "way.csv"\n[corridor]\nleft = 3\nright = -3\n')
    scenario = load_scenario(file)
    assert scenario.build_path().length == pytest.approx(10.0)
    assert changed(scenario, {"simulation.cycle": 0.1}).build_path().length == pytest.approx(10.0)


def test_too_sharp_a_path_is_a_warning(tables: dict[str, Any], caplog: pytest.LogCaptureFixture) -> None:
    tables["path"]["segments"].append({"direction": 1, "curvature": 0.3, "length": 3.0})
    with caplog.at_level(logging.WARNING):
        scenario_from_dict(tables, source="sharp.toml")
    (record,) = caplog.records
    assert "sharp.toml: path: its largest curvature 0.3 1/m" in record.getMessage()


def test_changed_scenarios_are_checked_anew(straight: Scenario) -> None:
    assert changed(straight, {"goal.offset": [1, 0, 0]}).goal.offset == (1.0, 0.0, 0.0)
    assert changed(straight, {"goal.offset": None}) == straight
    with pytest.raises(ScenarioError, match=r"straight: simulation.cycle = 1.0: must be <= 0.2"):
        changed(straight, {"simulation.cycle": 1.0})


# Key, value, and what the message says behind `file: `.
WRONG: list[tuple[str, Any, str]] = [
    ("speed", 3.0, "speed = 3.0: unknown key, allowed are name, description, path, corridor"),
    ("faults", [{"kind": "lost_cycles", "to": 2.0}], "faults[0].from: required"),
    ("faults", [{"kind": "lost_cycles", "from": 2.0}], "faults[0].to: required"),
    ("faults", [{"from": 1.0, "to": 2.0}], "faults[0].kind: required"),
    ("faults", {"kind": "lost_cycles"}, "faults = {'kind': 'lost_cycles'}: must be a list"),
    (
        "faults",
        [fault(kind="fire")],
        "faults[0].kind = 'fire': must be 'nan_state', 'infinite_state', 'frozen",
    ),
    ("faults", [fault(begin=1.0)], "faults[0].begin = 1.0: unknown key, allowed are kind, from, to, size"),
    ("faults", [{**fault(), "from": -0.1}], "faults[0].from = -0.1: must be >= 0"),
    ("faults", [fault(to=1.0)], "faults[0].to = 1.0: must be > from = 1.0"),
    ("faults", [fault(), fault(to=0.5)], "faults[1].to = 0.5: must be > from = 1.0"),
    ("faults", [fault(to=inf)], "faults[0].to = inf: must be a finite number"),
    ("faults", [fault(size="big")], "faults[0].size = 'big': must be a number"),
    ("faults", [fault(size=nan)], "faults[0].size = nan: must be a finite number"),
    ("faults", [fault("weak_brakes", size=1.0)], "faults[0].size = 1.0: must be > 0 and < 1 for weak_brakes"),
    ("faults", [fault("weak_brakes", size=0.0)], "faults[0].size = 0.0: must be > 0 and < 1 for weak_brakes"),
    ("faults", [fault("late_cycles", size=-0.1)], "faults[0].size = -0.1: must be > 0 and < 10 for late_cyc"),
    ("faults", [fault("clock_back", size=-1.0)], "faults[0].size = -1.0: must be > 0 and < 1e+06 for clock"),
    ("faults", [fault("blocked", size=0.0)], "faults[0].size = 0.0: must be > 0 and < 1000 for blocked"),
    (
        "faults",
        [fault("state_jump", size=200.0)],
        "faults[0].size = 200.0: must be > -100 and < 100 for state",
    ),
    ("goal.measurement", {"rate": 0.0}, "goal.measurement.rate = 0.0: must be > 0"),
    ("goal.measurement", {"dropout": 1.5}, "goal.measurement.dropout = 1.5: must be <= 1"),
    ("goal.measurement", {"delay": -0.1}, "goal.measurement.delay = -0.1: must be >= 0"),
    ("goal.measurement", {"position_floor": 0.0}, "goal.measurement.position_floor = 0.0: must be > 0"),
    ("goal.measurement", {"visible_after_cusp": 1}, "visible_after_cusp = 1: must be true or false"),
    (
        "goal.measurement",
        {"frequency": 10.0},
        "goal.measurement.frequency = 10.0: unknown key, allowed are rate",
    ),
    ("goal.measurement", {"initial_offset": [0.1, 0.1]}, "goal.measurement.initial_offset[2]: required"),
    (
        "goal.measurement",
        {"initial_offset": [0.0, 2.5, 0.0]},
        "goal.measurement.initial_offset = pose (",
    ),
    (
        "goal.measurement",
        {"visible_range": 3.0, "blind_range": 3.0},
        "goal.measurement.blind_range = 3.0: must be < goal.measurement.visible_range = 3.0",
    ),
    ("simulation.plantstep", 0.01, "simulation.plantstep = 0.01: unknown key, allowed are plant_step, cycle"),
    (
        "path.segments",
        [{"direction": 1, "curvature": 0, "length": 9, "radius": 3}],
        "path.segments[0].radius = 3",
    ),
    (
        "corridor.narrowings",
        [{"start": 1, "from": 1, "to": 2, "left": 2}],
        "narrowings[0].start = 1: unknown key",
    ),
    ("name", 3, "name = 3: must be text"),
    ("name", "../up", "name = '../up': must be letters"),
    ("description", True, "description = True: must be text"),
    ("path", 3, "path = 3: must be a table"),
    ("path.start", [0.0, 0.0], "path.start[2]: required"),
    (
        "path.start",
        [0.0, 0.0, 0.0, 0.0],
        "path.start = [0.0, 0.0, 0.0, 0.0]: number of entries must be <= 3, not 4",
    ),
    ("path.start", "origin", "path.start = 'origin': must be a list"),
    ("path.start", [0.0, "0", 0.0], "path.start[1] = '0': must be a number"),
    ("path.start", [0.0, True, 0.0], "path.start[1] = True: must be a number"),
    ("path.start", [0.0, nan, 0.0], "path.start[1] = nan: must be a finite number"),
    ("path.start", None, "path.start: required where path.file is not given"),
    ("path.segments", None, "path.segments: required where path.file is not given"),
    ("path.segments", [], "path.segments = []: number of entries must be >= 1, not 0"),
    (
        "path.segments",
        [{"direction": 2, "curvature": 0, "length": 9}],
        "path.segments[0].direction = 2: must be 1 or -1",
    ),
    (
        "path.segments",
        [{"direction": 1, "curvature": inf, "length": 9}],
        "path.segments[0].curvature = inf: must be a fin",
    ),
    (
        "path.segments",
        [{"direction": 1, "curvature": 0, "length": 0}],
        "path.segments[0].length = 0: must be > 0",
    ),
    ("path.segments", [{"direction": 1, "curvature": 0}], "path.segments[0].length: required"),
    ("path.file", "path.csv", "path.file = 'path.csv': either file, or start and segments, not both"),
    ("corridor", None, "corridor: required"),
    ("corridor.left", None, "corridor.left: required where corridor.polygon is not given"),
    ("corridor.left", "wide", "corridor.left = 'wide': must be a number"),
    (
        "corridor.left",
        -2.0,
        "corridor.left = -2.0 with right = -3.0: left - right must be >= the body's width 2.069 m",
    ),
    ("corridor.polygon", BOX, "corridor.left = 3.0: either polygon, or left and right, not both"),
    (
        "corridor.obstacles",
        [TRIANGLE[:0]],
        "corridor.obstacles[0] = []: number of entries must be >= 1",
    ),
    (
        "corridor.obstacles",
        [[[6, 1], [7, 1], [7, nan]]],
        "corridor.obstacles[0][2][1] = nan: must be a finite number",
    ),
    ("corridor.obstacles", [[[0, 0], [1, 1], [1, 0], [0, 1]]], "corridor: "),
    (
        "corridor.narrowings",
        [{"from": 3, "to": 3, "left": 2}],
        "corridor.narrowings[0].to = 3.0: must be above from",
    ),
    (
        "corridor.narrowings",
        [{"from": 3, "to": 11, "left": 2}],
        "corridor.narrowings[0].to = 11.0: must be above from",
    ),
    (
        "corridor.narrowings",
        [{"from": -1, "to": 3, "left": 2}],
        "corridor.narrowings[0].from = -1: must be >= 0",
    ),
    ("corridor.narrowings", [{"from": 1, "to": 3}], "corridor.narrowings[0]: needs left, right or both"),
    (
        "corridor.narrowings",
        [{"from": 1, "to": 3, "left": -1.0}],
        "corridor.narrowings[0] = left -1.0, right -3.0: left",
    ),
    ("goal.offset", [1.0, 2.0], "goal.offset[2]: required"),
    ("goal.offset", [inf, 0.0, 0.0], "goal.offset[0] = inf: must be a finite number"),
    (
        "goal",
        {"offset": [0, 0, 0], "pose": [1, 0, 0]},
        "goal.pose = (1.0, 0.0, 0.0): either offset or pose, not both",
    ),
    ("goal.pose", [40.0, 0.0, 0.0], "goal = pose (40, 0, 0): out of reach, 30 m from the path's last part"),
    ("goal.pose", [9.0, 0.0, 2.0], "goal = pose (9, 0, 2): out of reach, turned by 2 rad"),
    (
        "goal.pose",
        [6.0, 2.5, 0.0],
        "goal = pose (6, 2.5, 0): out of reach, the body there crosses a boundary or obstacle",
    ),
    (
        "goal.pose",
        [6.0, 9.0, 0.0],
        "goal = pose (6, 9, 0): out of reach, a boundary lies between it and the path",
    ),
    ("goal.tolerance", [0.05, 0.0, 0.03], "goal.tolerance[1] = 0.0: must be > 0"),
    ("goal.shifts", [{"at_distance": 0, "offset": [0, 0, 0]}], "goal.shifts[0].at_distance = 0: must be > 0"),
    (
        "goal.shifts",
        [{"at_distance": 5, "offset": [30, 0, 0]}],
        "goal.shifts[0] = pose (40, 0, 0): out of reach",
    ),
    ("vehicle.width", 0.0, "vehicle.width = 0.0: must be > 0"),
    ("vehicle.rear", -0.1, "vehicle.rear = -0.1: must be >= 0"),
    ("vehicle.length", 4.0, "vehicle.length = 4.0: unknown key, allowed are wheelbase, width, front, rear"),
    (
        "vehicle.width",
        7.0,
        "corridor.left = 3.0 with right = -3.0: left - right must be >= the body's width 7.0 m",
    ),
    ("limits.steering", 1.6, "limits.steering = 1.6: must be <= 1.4"),
    ("limits.speed", "fast", "limits.speed = 'fast': must be a number"),
    ("controller.dead_time", -0.1, "controller.dead_time = -0.1: must be >= 0"),
    ("controller.deadline", 0.0, "controller.deadline = 0.0: must be > 0.001"),
    ("controller.deadline", 20.0, "controller.deadline = 20.0: must be <= 10"),
    (
        "controller.comfort_acceleration",
        6.0,
        "controller.comfort_acceleration = 6.0: must be <= limits.acceleration = 5",
    ),
    (
        "limits.acceleration",
        0.3,
        "controller.comfort_acceleration = 0.4: must be <= limits.acceleration = 0.3",
    ),
    ("controller.stages", 70, "controller.stages = 70: unknown key"),
    ("simulation.cycle", 0.004, "simulation.cycle = 0.004: must be >= 0.005"),
    ("simulation.cycle", 0.21, "simulation.cycle = 0.21: must be <= 0.2"),
    ("simulation.plant_step", 0.0, "simulation.plant_step = 0.0: must be >= 0.0005"),
    ("simulation.dead_time", -0.1, "simulation.dead_time = -0.1: must be >= 0"),
    ("simulation.duration", 0.0, "simulation.duration = 0.0: must be > 0"),
    ("simulation.wheelbase_error", 0.6, "simulation.wheelbase_error = 0.6: must be <= 0.5"),
    ("simulation.steering_offset", nan, "simulation.steering_offset = nan: must be a finite number"),
    ("simulation.acceleration_gain", 0.0, "simulation.acceleration_gain = 0.0: must be >= 0.1"),
    ("simulation.acceleration_offset", 11.0, "simulation.acceleration_offset = 11.0: must be <= 10"),
    ("simulation.state_noise", [0.0, 0.0, 0.0, 0.0, -1.0], "simulation.state_noise[4] = -1.0: must be >= 0"),
    ("simulation.state_noise", [0.0, 0.0, 0.0], "simulation.state_noise[3]: required"),
    (
        "simulation",
        {"cycle": 0.005, "plant_step": 0.01},
        "simulation.plant_step = 0.01: must be <= simulation.cycle",
    ),
]


@pytest.mark.parametrize(("key", "value", "message"), WRONG, ids=[f"{k}={v}"[:60] for k, v, _ in WRONG])
def test_wrong_values_are_named(tables: dict[str, Any], key: str, value: Any, message: str) -> None:
    if value is None:
        *names, last = key.split(".")
        table = tables
        for name in names:
            table = table[name]
        del table[last]
    else:
        put(tables, key, value)
    with pytest.raises(ScenarioError) as caught:
        scenario_from_dict(tables, source="bad.toml")
    lines = str(caught.value).splitlines()
    assert all(line.startswith("bad.toml: ") for line in lines)
    assert message in lines[0]
    # Nothing else is wrong, save what follows from it in a pair of keys or the entries of a list.
    assert len(lines) <= 2


def test_each_problem_has_a_line(tables: dict[str, Any]) -> None:
    put(tables, "simulation.cycle", 9.0)
    put(tables, "goal.tolerance", [0.05, -1.0, 0.03])
    with pytest.raises(ScenarioError) as caught:
        scenario_from_dict(tables, source="bad.toml")
    assert str(caught.value).splitlines() == [
        "bad.toml: goal.tolerance[1] = -1.0: must be > 0",
        "bad.toml: simulation.cycle = 9.0: must be <= 0.2",
    ]


def test_corridor_that_crosses_the_path_is_refused(tables: dict[str, Any]) -> None:
    put(tables, "corridor.right", 0.5)
    with pytest.raises(ScenarioError, match=r"bad.toml: corridor"):
        scenario_from_dict(tables, source="bad.toml")


def test_polygon_narrower_than_the_body_is_refused(tables: dict[str, Any]) -> None:
    waist = [[-2, -3], [5, -1], [12, -3], [12, 3], [5, 1], [-2, 3]]
    tables["corridor"] = {"polygon": waist}
    with pytest.raises(
        ScenarioError, match=r"bad.toml: corridor = 2 m wide at 5 m .* at least as wide as the body"
    ):
        scenario_from_dict(tables, source="bad.toml")


def test_polygon_without_the_path_is_refused(tables: dict[str, Any]) -> None:
    tables["corridor"] = {"polygon": [[x, y + 20.0] for x, y in BOX]}
    with pytest.raises(ScenarioError, match=r"bad.toml: corridor"):
        scenario_from_dict(tables, source="bad.toml")


def test_bad_path_files_are_named(tables: dict[str, Any], tmp_path: Path) -> None:
    tables["path"] = {"file": "way.csv"}
    with pytest.raises(ScenarioError, match=r"bad.toml: path.file = .*way.csv"):
        scenario_from_dict(tables, source="bad.toml", folder=tmp_path)
    (tmp_path / "way.csv").write_text("x,y,heading,direction\n0,0,0,1\n2,zero,0,1\n")
    with pytest.raises(ScenarioError, match=r"bad.toml: path.file = .*way.csv"):
        scenario_from_dict(tables, source="bad.toml", folder=tmp_path)


def test_files_that_cannot_be_read_are_named(tmp_path: Path) -> None:
    with pytest.raises(ScenarioError, match=r"nowhere.toml: cannot be read"):
        load_scenario(tmp_path / "nowhere.toml")
    folder = tmp_path / "folder.toml"
    folder.mkdir()
    with pytest.raises(ScenarioError, match=r"folder.toml: cannot be read"):
        load_scenario(folder)
    binary = tmp_path / "binary.toml"
    binary.write_bytes(b"name = \xff\xfe")
    with pytest.raises(ScenarioError, match=r"binary.toml: is not UTF-8 text"):
        load_scenario(binary)
    broken = tmp_path / "broken.toml"
    broken.write_text("name = \n")
    with pytest.raises(ScenarioError, match=r"broken.toml: is not TOML, .*line 1"):
        load_scenario(broken)


def test_unknown_names_list_the_known_ones() -> None:
    with pytest.raises(ScenarioError, match=r"docking_besides: must be a .toml file or one of aisle_dock, "):
        load_scenario("docking_besides")
