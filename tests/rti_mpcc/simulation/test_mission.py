"""A scenario's mission in the closed loop: contact, the body that is docked at, how it ends."""

from __future__ import annotations

from math import pi
from typing import Any

import numpy as np
import pytest

from geometry import Pose2
from geometry.outline import outline_at
from rti_mpcc.config import Vehicle
from rti_mpcc.mission.state import StepRecord
from rti_mpcc.simulation import Scenario, scenario_from_dict, simulate, summary
from rti_mpcc.simulation.scenery import touches, with_body
from tests.rti_mpcc.simulation.conftest import area_tables

BODY = [(4.5, -1.0), (6.5, -1.0), (6.5, 1.0), (4.5, 1.0)]
"""Before the front of a docked vehicle."""


def short(*steps: dict[str, Any]) -> Scenario:
    tables = area_tables()
    tables["goal"]["body"] = BODY
    tables["start"] = {"pose": [11.0, 0.0, 0.0]}
    tables["simulation"] = {"dead_time": 0.18, "cycle": 0.05, "duration": 60.0}
    return scenario_from_dict({**tables, "mission": list(steps)})


@pytest.mark.parametrize("goal", [Pose2(1.0, 2.0, 0.0), Pose2(-4.0, 3.0, pi / 2)], ids=repr)
def test_the_vehicle_touches_the_body_where_the_two_meet(goal: Pose2) -> None:
    vehicle = Vehicle()
    body = outline_at(BODY, goal)
    for along, touching in ((-0.01, False), (0.0, True), (0.2, True)):
        pose = goal.compose(Pose2(4.5 - vehicle.front + along, 0.0, 0.0))
        assert touches(pose, vehicle, body) is touching


def _record(kind: str, begin: float, dock: Pose2 | None) -> StepRecord:
    return StepRecord(kind=kind, place=0, attempt=0, begin=begin, dock=dock)


def test_the_body_stands_until_the_move_into_contact_begins() -> None:
    goal, cart = Pose2(15.0, 0.0, 0.0), np.array([(0.0, 4.0), (1.0, 4.0), (1.0, 5.0)])
    changes = [(0.0, ()), (5.0, (cart,)), (9.0, ())]
    never = [("dock", 0.0, goal), ("straight", 3.0, None)]
    found = with_body(changes, [_record(*each) for each in never], goal, BODY)
    assert [(at, len(some)) for at, some in found] == [(0.0, 1), (5.0, 2), (9.0, 1)]
    log = [_record(*each) for each in (*never, ("straight", 7.0, goal))]
    found = with_body(changes, log, goal, BODY)
    assert [(at, len(some)) for at, some in found] == [(0.0, 1), (5.0, 2), (7.0, 1), (9.0, 0)]
    assert with_body(changes, log, goal, None) == tuple(changes)


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
    assert move["reason"] == "ended by its signal"
    # It stops where it touches, and the body was clear of all until then.
    vehicle, truth = result.config.vehicle, result.truth
    gap = 4.5 - vehicle.front
    touched = truth.poses[:, 0].max() - 15.0
    assert gap - 1e-3 <= touched <= gap + 0.2 * 0.3
    assert abs(out["final_error"]["lateral_m"]) <= 0.2
    before = truth.times < move["begin_s"]
    assert truth.poses[before, 0].max() - 15.0 < gap - 0.05
    assert found["min_clearance_m"] > 0.0
