"""Scenario files: what they mean, and that they are written and read back the same."""

from __future__ import annotations

from math import pi
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from geometry import Pose2
from rti_mpcc import DockingController, DockingMission
from rti_mpcc.config import Clearance
from rti_mpcc.errors import InputError, ScenarioError
from rti_mpcc.mission import Approach, Dock, DriveTo, Straight, Undock, Wait
from rti_mpcc.model.footprint import body_of
from rti_mpcc.simulation import (
    Scenario,
    builtin_names,
    changed,
    load_scenario,
    save_scenario,
    scenario_from_dict,
)
from rti_mpcc.simulation.closed_loop import mission_of
from rti_mpcc.simulation.sections.mission import signalled_by_the_simulation
from tests.rti_mpcc.simulation.conftest import area_tables, camera_tables, straight_tables, write_yard
from tests.rti_mpcc.yards import BRISK

IN_AN_AREA = [name for name in builtin_names() if load_scenario(name).in_area]
TRICKY = 'a "quoted" \\ text,\nsecond line\ttab, \x7f and \x01, δ̇ ≤ 0.6, 🚚'
BODY = [[4.5, -1.0], [6.5, -1.0], [6.5, 1.0], [4.5, 1.0]]
COMMON = {"timeout": 9.0, "patience": 3.0, "retries": 2, "retry_from": 0, "then": "home"}
MISSION: list[dict[str, Any]] = [
    {
        "kind": "dock",
        "approach": {"length": 2.0, "direction": -1},
        "tolerance": [0.1, 0.1, 0.1],
        "uncertainty": [1.0, 0.2],
    },
    {"kind": "wait", "seconds": 2.0},
    {
        "kind": "straight",
        "distance": -1.0,
        "speed": 0.3,
        "steering": 0.1,
        "tolerance": [0.1, 0.1],
        "contact": True,
    },
    {"kind": "undock", "distance": 3.0},
    {"kind": "drive_to", "pose": [1.0, 2.0, 0.5], "tolerance": [0.1, 0.1, 0.1]},
]
CAMERA = {
    "board": {"x": -2, "first_marker": 5},
    "mount": {"x": -1.0, "distortion": [0.01, 0, 0, 0, 0]},
    "optics": {"noise": 2.0},
    "others": [{"pose": [4, 0, 0], "first_marker": 20}],
    "lost": [1.0, 4.0],
    "wrong": {"after": 2.0, "offset": [1.0, 0.0, 0.0]},
}
EVERYTHING: dict[str, Any] = {
    "description": TRICKY,
    "corridor": {
        "polygon": [[-2, -3], [16, -3], [16, 3], [-2, 3]],
        "obstacles": [[[6, 2.5], [7, 2.5], [7, 2.75]]],
    },
    "goal": {
        "pose": [9.5, 0.1, 1e-7],
        "measurement": {"visible_after_cusp": True, "rate": 5},
        "shifts": [{"at_distance": 3.0, "offset": [0.1, 1 / 3, 0.0]}],
    },
    "vehicle": {"wheelbase": 2.5},
    "controller": {"deadline": 0.02},
    "simulation": {"state_noise": [0.1, 0.1, 0.01, 0.0, 0.0]},
    "faults": [
        {"kind": "nan_state", "from": 1.0, "to": 2.0},
        {"kind": "blocked", "from": 1, "to": 2, "size": 3},
    ],
}


def with_mission() -> dict[str, Any]:
    tables = area_tables() | {
        "home": {"pose": [1.0, -2.0, 0.0]},
        "mission": [{**step, **COMMON} for step in MISSION],
    }
    tables["goal"]["body"] = BODY
    return tables


@pytest.mark.parametrize("name", builtin_names())
def test_built_in_scenarios(name: str, caplog: pytest.LogCaptureFixture, tmp_path: Path) -> None:
    scenario = load_scenario(name)
    assert scenario.name == name
    assert scenario.description
    assert (scenario.simulation.dead_time, scenario.simulation.cycle) == (0.18, 0.05)
    assert not caplog.records
    assert load_scenario(save_scenario(scenario, tmp_path / "new" / "folder")) == scenario
    if not scenario.in_area:
        assert scenario.build_path().max_curvature <= 0.2 + 1e-12
        return
    poses = np.array([(p.x, p.y, p.phi) for p in (scenario.start_pose(), scenario.goal_pose())])
    clearance = scenario.build_area().signed_distances(body_of(scenario.vehicle), poses)
    assert (clearance > Clearance().on_routes - 0.01).all()


def test_they_are_those_of_the_contract() -> None:
    contract = {"docking_inside", "docking_behind", "path_following", "docking_full_course"}
    assert contract < set(builtin_names())
    assert (len(builtin_names()), len(IN_AN_AREA)) == (14, 6)
    inside, behind, course = map(load_scenario, ("docking_inside", "docking_behind", "docking_full_course"))
    goal = inside.goal_pose()
    assert (goal.x, goal.y, goal.phi) == pytest.approx((11.08, -15.24, 1.171), abs=0.005)
    path = behind.build_path()
    assert path.length == pytest.approx(30.0)
    error = behind.goal_pose().relative_to(path.end)
    assert (error.x, error.y, error.phi) == pytest.approx((-4.1, -3.0, 0.1))
    assert course.build_path().cusps == pytest.approx((30.0,))
    assert course.corridor is not None
    assert behind.corridor is not None
    for far, near in zip(course.corridor.narrowings, behind.corridor.narrowings, strict=True):
        there = (far.start - 30.0, far.end - 30.0, far.left, far.right)
        assert there == (near.start, near.end, near.left, near.right)


def test_defaults_are_those_of_the_contract(straight: Scenario) -> None:
    config = straight.controller_config()
    assert config.goal_tolerance == (0.05, 0.05, pi / 90.0)
    assert (config.cycle, config.dead_time, config.deadline) == (0.05, 0.0, None)
    assert (config.vehicle.wheelbase, config.limits.speed) == (2.875, 10.0)
    assert (straight.simulation.plant_step, straight.simulation.duration) == (0.01, 120.0)
    assert straight.goal.is_path_end
    assert straight.goal_pose() == Pose2(10.0, 0.0, 0.0)


def test_controller_assumes_the_dead_time_of_the_plant_unless_given(straight: Scenario) -> None:
    scenario = changed(straight, {"simulation.dead_time": 0.18})
    assert scenario.controller_config().dead_time == 0.18
    scenario = changed(scenario, {"controller.dead_time": 0.1, "controller.comfort_acceleration": 0.3})
    config = scenario.controller_config("paper")
    assert (config.dead_time, config.comfort_acceleration) == (0.1, 0.3)
    with pytest.raises(InputError, match="preset = 'best': must be one of default, paper, paper_printed"):
        scenario.controller_config("best")


def test_start_area_and_goal(hall: Scenario, straight: Scenario) -> None:
    assert hall.in_area
    assert not hall.goal.is_path_end
    assert hall.start_pose() == Pose2(0.0, 0.0, 0.0)
    assert hall.goal_pose() == hall.planned_goal() == Pose2(15.0, 0.0, 0.0)
    area = hall.build_area()
    assert np.max(np.array(area.boundary), axis=0).tolist() == [25.0, 6.0]
    assert len(area.obstacles) == 1
    assert straight.start_pose() == Pose2(0.0, 0.0, 0.0)
    for ask, said in (
        (straight.build_area, r"straight: has no \[area\]"),
        (hall.build_path, r"hall: has no \[path\]"),
        (lambda: hall.build_corridor(straight.build_path()), r"hall: has no \[corridor\]"),
    ):
        with pytest.raises(InputError, match=said):
            ask()


@pytest.mark.parametrize(("key", "value", "top"), [("area.boundary", None, 19.0), ("area", {}, 15.0)])
def test_without_a_boundary_it_is_a_box_around_all_that_is_given(
    hall: Scenario, key: str, value: Any, top: float
) -> None:
    boundary = np.array(changed(hall, {key: value}).build_area().boundary)
    assert (boundary.min(axis=0).tolist(), boundary.max(axis=0).tolist()) == ([-15.0, -15.0], [30.0, top])


def test_goal_that_is_detected_is_planned_beside_the_true_one(hall: Scenario) -> None:
    scenario = changed(hall, {"goal.measurement": {"initial_offset": [0.1, -0.2, 0.05]}})
    assert scenario.goal_pose() == Pose2(15.0, 0.0, 0.0)
    assert scenario.planned_goal() == Pose2(15.1, -0.2, 0.05)


def test_each_step_with_all_that_it_knows() -> None:
    scenario = scenario_from_dict(with_mission())
    mission = mission_of(scenario, DockingController.in_area(scenario.build_area(), BRISK))
    assert isinstance(mission, DockingMission)
    dock, wait, move, out, away = mission.steps
    assert isinstance(dock, Dock)
    assert (dock.pose, dock.approach) == (Pose2(15.0, 0.0, 0.0), Approach(2.0, -1))
    assert (dock.tolerance, dock.uncertainty) == ((0.1, 0.1, 0.1), (1.0, 0.2))
    np.testing.assert_array_equal(np.asarray(dock.body), BODY)
    assert wait == Wait(2.0, timeout=9.0, patience=3.0, retries=2, retry_from=0, then="home")
    assert isinstance(move, Straight)
    assert (move.distance, move.speed, move.steering) == (-1.0, 0.3, 0.1)
    assert move.until is signalled_by_the_simulation
    assert not signalled_by_the_simulation()
    assert out == Undock(3.0, timeout=9.0, patience=3.0, retries=2, retry_from=0, then="home")
    assert isinstance(away, DriveTo)
    assert (away.pose, away.tolerance) == (Pose2(1.0, 2.0, 0.5), (0.1, 0.1, 0.1))
    assert mission.home == DriveTo(Pose2(1.0, -2.0, 0.0))


def test_changed_scenarios_are_checked_anew(straight: Scenario) -> None:
    assert changed(straight, {"goal.offset": [1, 0, 0]}).goal.offset == (1.0, 0.0, 0.0)
    assert changed(straight, {"goal.offset": None}) == straight
    with pytest.raises(ScenarioError, match=r"straight: simulation.cycle = 1.0: must be <= 0.2"):
        changed(straight, {"simulation.cycle": 1.0})


@pytest.mark.parametrize("tables", [straight_tables() | EVERYTHING, with_mission(), camera_tables(**CAMERA)])
def test_everything_a_file_may_have_comes_back(tables: dict[str, Any], tmp_path: Path) -> None:
    scenario = scenario_from_dict(tables)
    assert load_scenario(save_scenario(scenario, tmp_path)) == scenario


@pytest.mark.parametrize("kind", ["path", "map"])
def test_files_lie_beside_the_scenario_and_are_found_from_elsewhere(kind: str, elsewhere: Path) -> None:
    write_yard(elsewhere)
    rows = ["x,y,heading,direction", *(f"{x},0.0,0.0,1" for x in range(0, 11, 2))]
    (elsewhere / "way.csv").write_text("\n".join(rows))
    file = elsewhere / "mine.toml"
    ground = {
        "path": '[path]\nfile = "way.csv"\n[corridor]\nleft = 3\nright = -3\n',
        "map": '[start]\npose = [0, 0, 0]\n[area]\nmap = "yard.yaml"\n[goal]\npose = [15, 0, 0]\n',
    }
    file.write_text('name = "mine"\n' + ground[kind])
    scenario = load_scenario("mine.toml")
    again = load_scenario(save_scenario(scenario, elsewhere / "saved"))
    for one in (scenario, again, changed(scenario, {"simulation.cycle": 0.1})):
        if kind == "path":
            assert one.build_path().length == pytest.approx(10.0)
        else:
            assert np.max(np.array(one.build_area().boundary), axis=0) == pytest.approx([30.0, 6.0])


def test_weights_of_the_controller_are_those_of_the_preset_but_for_what_a_file_gives(tmp_path: Path) -> None:
    tables = straight_tables() | {"controller": {"weights": {"contouring": 5.0, "goal": [1.0, 2.0, 3.0]}}}
    scenario = scenario_from_dict(tables)
    assert load_scenario(save_scenario(scenario, tmp_path)) == scenario
    for preset in ("default", "paper"):
        usual = scenario_from_dict(straight_tables()).controller_config(preset).weights
        given = scenario.controller_config(preset).weights
        changed_ones = usual.model_dump() | {"contouring": 5.0, "goal": (1.0, 2.0, 3.0)}
        assert given.model_dump() == changed_ones
    for key, value, said in (
        ("lag", -1.0, r"controller.weights.lag = -1.0: must be >= 0"),
        ("contorin", 1.0, r"did you mean 'contouring'\?"),
    ):
        with pytest.raises(ScenarioError, match=said):
            scenario_from_dict(straight_tables() | {"controller": {"weights": {key: value}}})
