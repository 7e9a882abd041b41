"""Missions in scenario files and in the closed loop: what they mean, and every way of getting them wrong."""

from __future__ import annotations

import tomllib
from math import inf, nan, pi
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from geometry import Pose2
from geometry.outline import placed
from rti_mpcc import DockingController, DockingMission
from rti_mpcc.config import Vehicle
from rti_mpcc.errors import ScenarioError
from rti_mpcc.planning.agenda import StepRecord
from rti_mpcc.simulation import (
    Scenario,
    load_scenario,
    scenario_from_dict,
    scenario_text,
    simulate,
    summary,
)
from rti_mpcc.simulation.closed_loop import _with_body
from rti_mpcc.simulation.controllers import driver_of
from rti_mpcc.simulation.mission import (
    OPTIONAL,
    REQUIRED,
    all_succeeded,
    mission_in,
    mission_of,
    told_by_the_simulation,
    touches,
)
from rti_mpcc.steps import Approach, Dock, DriveTo, Straight, Undock, Wait
from rti_mpcc.types import MissionResult
from tests.rti_mpcc.simulation.conftest import area_tables, straight_tables
from tests.rti_mpcc.yards import BRISK

BODY = [[4.5, -1.0], [6.5, -1.0], [6.5, 1.0], [4.5, 1.0]]
"""Before the front of a docked vehicle."""
FULL: dict[str, dict[str, Any]] = {
    "dock": {
        "approach": {"length": 2.0, "direction": -1},
        "tolerance": [0.1, 0.1, 0.1],
        "uncertainty": [1.0, 0.2],
    },
    "wait": {"seconds": 2.0},
    "straight": {"distance": -1.0, "speed": 0.3, "steering": 0.1, "tolerance": [0.1, 0.1], "contact": True},
    "undock": {"distance": 3.0},
    "drive_to": {"pose": [1.0, 2.0, 0.5], "tolerance": [0.1, 0.1, 0.1]},
}
COMMON = {"timeout": 9.0, "patience": 3.0, "retries": 2, "retry_from": 0, "then": "home"}


def in_hall(*steps: dict[str, Any], body: list[list[float]] | None = BODY) -> dict[str, Any]:
    tables = area_tables()
    tables["mission"] = list(steps)
    tables["home"] = {"pose": [1.0, -2.0, 0.0]}
    if body is not None:
        tables["goal"]["body"] = body
    return tables


def refused(tables: dict[str, Any]) -> list[str]:
    """The lines on a file that must be refused."""
    with pytest.raises(ScenarioError) as caught:
        scenario_from_dict(tables, source="bad.toml")
    return str(caught.value).splitlines()


# -- what they mean ------------------------------------------------------------------------------------------


def test_each_kind_with_all_that_it_knows() -> None:
    scenario = scenario_from_dict(in_hall(*({"kind": kind, **FULL[kind], **COMMON} for kind in FULL)))
    mission = mission_of(scenario, DockingController.in_area(scenario.build_area(), BRISK))
    assert isinstance(mission, DockingMission)
    dock, wait, move, out, away = mission.steps
    assert isinstance(dock, Dock)
    assert (dock.pose, dock.approach) == (Pose2(15.0, 0.0, 0.0), Approach(2.0, -1))
    assert (dock.tolerance, dock.uncertainty) == ((0.1, 0.1, 0.1), (1.0, 0.2))
    np.testing.assert_array_equal(np.asarray(dock.body), BODY)
    assert wait == Wait(2.0, timeout=9.0, patience=3.0, retries=2, retry_from=0, then="home")
    assert isinstance(move, Straight)
    assert (move.distance, move.speed, move.steering, move.tolerance) == (-1.0, 0.3, 0.1, (0.1, 0.1))
    assert move.until is told_by_the_simulation
    assert not told_by_the_simulation()
    assert out == Undock(3.0, timeout=9.0, patience=3.0, retries=2, retry_from=0, then="home")
    assert isinstance(away, DriveTo)
    assert (away.pose, away.tolerance) == (Pose2(1.0, 2.0, 0.5), (0.1, 0.1, 0.1))
    assert mission.home == DriveTo(Pose2(1.0, -2.0, 0.0))
    assert {kind: {*REQUIRED[kind], *OPTIONAL[kind]} for kind in FULL} == {k: set(v) for k, v in FULL.items()}


def test_what_is_not_said_is_as_in_python() -> None:
    steps: list[dict[str, Any]] = [{"kind": "dock"}, {"kind": "straight", "distance": 1.0, "contact": False}]
    scenario = scenario_from_dict(in_hall(*steps, body=None))
    mission = mission_of(scenario, DockingController.in_area(scenario.build_area(), BRISK))
    assert isinstance(mission, DockingMission)
    assert mission.steps[1] == Straight(1.0)
    assert mission.steps[0].then == "stop"


def test_along_a_path_a_dock_is_at_its_end_and_without_a_mission_there_is_none() -> None:
    tables = straight_tables()
    tables["mission"] = [{"kind": "dock"}, {"kind": "undock", "distance": -2.0}]
    mission = mission_in(driver_of(scenario_from_dict(tables)))
    assert isinstance(mission, DockingMission)
    assert isinstance(mission.steps[0], Dock)
    assert mission.steps[0].pose is None
    assert mission_in(SimpleNamespace(controller=SimpleNamespace(controller=mission))) is mission
    alone = driver_of(scenario_from_dict(straight_tables()))
    assert isinstance(alone, DockingController)
    assert mission_in(alone) is None


def test_what_was_read_is_written_and_read_the_same() -> None:
    scenario = scenario_from_dict(in_hall(*({"kind": kind, **FULL[kind], **COMMON} for kind in FULL)))
    assert scenario_from_dict(tomllib.loads(scenario_text(scenario))) == scenario


# -- and what is wrong with them -----------------------------------------------------------------------------

BAD: list[tuple[dict[str, Any], str]] = [
    ({}, ".kind: required"),
    ({"kind": "fly"}, ".kind = 'fly': must be 'dock', 'wait', 'straight', 'undock' or 'drive_to'"),
    ({"kind": "wait"}, ".seconds: required for kind = 'wait'"),
    ({"kind": "straight"}, ".distance: required for kind = 'straight'"),
    ({"kind": "undock"}, ".distance: required for kind = 'undock'"),
    ({"kind": "drive_to"}, ".pose: required for kind = 'drive_to'"),
    ({"kind": "wait", "seconds": -1.0}, ": Wait.seconds = -1.0: must be >= 0, and finite"),
    ({"kind": "wait", "seconds": nan}, ".seconds = nan: must be a finite number"),
    (
        {"kind": "straight", "distance": 0.0},
        ": Straight.distance = 0.0: must not be 0, and at most 100 m either way",
    ),
    ({"kind": "straight", "distance": 1.0, "speed": 0.0}, ": Straight.speed = 0.0: must be > 0, and finite"),
    (
        {"kind": "straight", "distance": 1.0, "tolerance": [0.1, 0.1, 0.1]},
        ": Straight.tolerance = (0.1, 0.1, 0.1): must be 2 numbers or None",
    ),
    ({"kind": "straight", "distance": 1.0, "contact": 1}, ".contact = 1: must be true or false"),
    ({"kind": "undock", "distance": "far"}, ".distance = 'far': must be a number"),
    ({"kind": "drive_to", "pose": [1.0, 2.0]}, ".pose[2]: required"),
    ({"kind": "dock", "approach": {"length": 1.0}}, ".approach.direction: required"),
    (
        {"kind": "dock", "approach": {"length": 0.0, "direction": 1}},
        ".approach.length = 0.0: must be > 0",
    ),
    (
        {"kind": "dock", "approach": {"length": 1.0, "direction": 3}},
        ".approach.direction = 3: must be 1 or -1",
    ),
    (
        {"kind": "dock", "tolerance": [0.1, 0.1]},
        ": Dock.tolerance = (0.1, 0.1): must be 3 numbers or None",
    ),
    ({"kind": "dock", "timeout": 0.0}, ": Dock.timeout = 0.0: must be > 0"),
    ({"kind": "dock", "patience": inf}, ".patience = inf: must be a finite number"),
    ({"kind": "dock", "retries": -1}, ": Dock.retries = -1: must be a whole number >= 0"),
    ({"kind": "dock", "retries": 1.5}, ".retries = 1.5: must be an integer"),
    ({"kind": "dock", "retry_from": 1}, ".retry_from = 1: must be <= 0, its own place"),
    ({"kind": "dock", "then": "again"}, ".then = 'again': must be 'stop', 'continue' or 'home'"),
]


@pytest.mark.parametrize(("step", "said"), BAD, ids=[said for _, said in BAD])
def test_what_is_wrong_with_a_step_is_said(step: dict[str, Any], said: str) -> None:
    assert refused(in_hall(step)) == [f"bad.toml: mission[0]{said}"]


@pytest.mark.parametrize("kind", list(FULL))
def test_keys_of_other_kinds_and_keys_of_none_are_refused(kind: str) -> None:
    own = {"kind": kind, **FULL[kind]}
    known = ", ".join(sorted({*REQUIRED[kind], *OPTIONAL[kind], *COMMON}))
    for other in FULL.values():
        for key, value in other.items():
            if key not in own:
                (line,) = refused(in_hall({**own, key: value}))
                assert line.startswith(f"bad.toml: mission[0].{key} = ")
                assert line.endswith(f": unknown key for kind = '{kind}', allowed are {known}")
    (line,) = refused(in_hall({**own, "speeds": 1.0}))
    assert line.startswith("bad.toml: mission[0].speeds = 1.0: unknown key, allowed are kind, ")


def test_what_does_not_go_together_is_refused() -> None:
    touches_nothing = in_hall({"kind": "straight", "distance": 1.0, "contact": True}, body=None)
    assert refused(touches_nothing) == [
        "bad.toml: mission[0].contact = True: needs goal.body, what is to be touched"
    ]
    homeless = in_hall({"kind": "dock", "then": "home"})
    del homeless["home"]
    assert refused(homeless) == ["bad.toml: mission[0].then = 'home': needs [home]"]
    idle = in_hall()
    assert refused(idle) == [
        "bad.toml: goal.body: only with [[mission]], which keeps clear of it",
        "bad.toml: home: only with [[mission]]",
    ]
    crossed = in_hall({"kind": "dock"}, body=[[0.0, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0]])
    (line,) = refused(crossed)
    assert "goal.body = " in line
    assert "must be a polygon whose outline does not cross itself" in line


@pytest.mark.parametrize("key", ["approach", "tolerance"])
def test_along_a_path_nothing_is_asked_of_the_way_to_the_dock(key: str) -> None:
    tables = straight_tables()
    tables["mission"] = [{"kind": "dock", key: FULL["dock"][key]}]
    assert refused(tables) == [
        f"bad.toml: mission[0].{key}: only in an area, where the way to the dock is planned"
    ]


# -- contact -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("goal", [Pose2(1.0, 2.0, 0.0), Pose2(-4.0, 3.0, pi / 2)], ids=repr)
def test_the_vehicle_touches_the_body_where_the_two_meet(goal: Pose2) -> None:
    vehicle = Vehicle()
    body = placed(BODY, goal)
    for along, touching in ((-0.01, False), (0.0, True), (0.2, True)):
        pose = goal.compose(Pose2(4.5 - vehicle.front + along, 0.0, 0.0))
        assert touches(pose, vehicle, body) is touching


def _record(kind: str, begin: float, dock: Pose2 | None) -> StepRecord:
    return StepRecord(kind=kind, place=0, attempt=0, begin=begin, dock=dock)


def test_the_body_stands_until_the_move_into_contact_begins() -> None:
    scenario, goal = scenario_from_dict(in_hall({"kind": "dock"})), Pose2(15.0, 0.0, 0.0)
    cart = np.array([(0.0, 4.0), (1.0, 4.0), (1.0, 5.0)])
    changes = [(0.0, ()), (5.0, (cart,)), (9.0, ())]
    never = [("dock", 0.0, goal), ("straight", 3.0, None)]
    found = _with_body(changes, [_record(*each) for each in never], goal, scenario)
    assert [(at, len(some)) for at, some in found] == [(0.0, 1), (5.0, 2), (9.0, 1)]
    log = [_record(*each) for each in (*never, ("straight", 7.0, goal))]
    found = _with_body(changes, log, goal, scenario)
    assert [(at, len(some)) for at, some in found] == [(0.0, 1), (5.0, 2), (7.0, 1), (9.0, 0)]
    bare = scenario_from_dict(in_hall({"kind": "dock"}, body=None))
    assert _with_body(changes, log, goal, bare) == changes


# -- in the closed loop --------------------------------------------------------------------------------------


def short(*steps: dict[str, Any]) -> Scenario:
    tables = in_hall(*steps)
    tables["start"] = {"pose": [11.0, 0.0, 0.0]}
    tables["simulation"] = {"dead_time": 0.18, "cycle": 0.05, "duration": 60.0}
    return scenario_from_dict(tables)


def test_a_run_ends_with_its_mission_and_the_summary_tells_of_each_step() -> None:
    result = simulate(
        short(
            {"kind": "dock"},
            {"kind": "wait", "seconds": 1.0},
            {"kind": "straight", "distance": 1.2, "tolerance": [0.03, 0.02], "contact": True},
            {"kind": "undock", "distance": -3.0},
        )
    )
    found = summary(result)
    assert found["ended"] == "mission over"
    assert found["docked"] is True
    assert [(each["kind"], each["result"]) for each in found["mission"]] == [
        ("dock", "SUCCEEDED"),
        ("wait", "SUCCEEDED"),
        ("straight", "SUCCEEDED"),
        ("undock", "SUCCEEDED"),
    ]
    dock, wait, move, out = found["mission"]
    assert [(each["step"], each["attempt"]) for each in found["mission"]] == [(k, 0) for k in range(4)]
    assert set(dock) == {"step", "kind", "attempt", "begin_s", "end_s", "result", "reason", "final_error"}
    assert wait["final_error"] is None
    tolerance = result.config.goal_tolerance
    assert all(
        abs(error) <= most for error, most in zip(dock["final_error"].values(), tolerance, strict=True)
    )
    assert move["reason"] == "it was told to stop"
    # It stops where it touches, and the body was clear of all until then.
    vehicle, truth = result.config.vehicle, result.truth
    gap = 4.5 - vehicle.front
    touched = truth.poses[:, 0].max() - 15.0
    assert gap - 1e-3 <= touched <= gap + 0.2 * 0.3
    assert abs(out["final_error"]["lateral_m"]) <= 0.2
    before = truth.times < move["begin_s"]
    assert truth.poses[before, 0].max() - 15.0 < gap - 0.05
    assert found["min_clearance_m"] > 0.0


def test_a_mission_that_fails_is_told_and_has_not_docked() -> None:
    result = simulate(short({"kind": "dock", "timeout": 1.0, "retries": 1}))
    found = summary(result)
    assert (found["ended"], found["docked"]) == ("mission over", False)
    assert [each["result"] for each in found["mission"]] == ["TIMED_OUT", "TIMED_OUT"]
    assert [(each["step"], each["attempt"]) for each in found["mission"]] == [(0, 0), (0, 1)]


def record(place: int, attempt: int, result: MissionResult) -> StepRecord:
    return StepRecord(kind="wait", place=place, attempt=attempt, begin=0.0, result=result)


def test_all_steps_succeed_by_their_last_tries() -> None:
    well, badly, on = MissionResult.SUCCEEDED, MissionResult.BLOCKED, MissionResult.RUNNING
    again = [record(0, 0, well), record(1, 0, badly), record(0, 0, well), record(1, 1, well)]
    assert all_succeeded(well, again)
    assert not all_succeeded(well, again[:2])  # it went on after a failure
    assert not all_succeeded(badly, [record(1, 0, badly), record(1, 0, well)])  # and drove home
    assert not all_succeeded(on, [record(0, 0, on)])
    assert all_succeeded(None, [])


def test_a_run_without_a_mission_tells_of_none() -> None:
    tables = straight_tables()
    tables["simulation"] = {"duration": 0.5}
    result = simulate(scenario_from_dict(tables))
    assert result.mission == ()
    assert "mission" not in summary(result)


@pytest.mark.acceptance
def test_the_built_in_mission_picks_up_the_capsule() -> None:
    result = simulate(load_scenario("docking_mission"))
    assert {record.result for record in result.mission} == {MissionResult.SUCCEEDED}
    assert summary(result)["docked"] is True
    assert summary(result)["min_clearance_m"] > 0.1
