"""What fills the way as a fault: where it is put, from when to when, beside which other obstacles."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from geometry import Pose2
from rti_mpcc.config import Vehicle
from rti_mpcc.simulation import Scenario, changed, scenario_from_dict, simulate, summary
from rti_mpcc.simulation.scenery import ACROSS, THICKNESS, wall_ahead
from rti_mpcc.types import Array, VehicleState

VEHICLE = Vehicle()
BOX = [[20.0, 5.0], [21.0, 5.0], [21.0, 6.0]]


def still(now: float, state: VehicleState) -> tuple[float, float]:
    return 0.0, 0.0


def forward(now: float, state: VehicleState) -> tuple[float, float]:
    return 1.0, 0.0


def put(scenario: Scenario, at: Pose2, gap: float, part: int = 0) -> Array:
    path = scenario.build_path()
    lines = scenario.build_corridor(path).lines(part)
    way = path.parts[part]
    return wall_ahead(way, lines, at, VEHICLE, near=way.project(at.x, at.y), gap=gap)


def extent(outline: Array) -> tuple[float, float, float, float]:
    return (*outline.min(axis=0).tolist(), *outline.max(axis=0).tolist())


def in_reverse(tables: dict[str, Any]) -> Scenario:
    tables["path"]["segments"] = [{"direction": -1, "curvature": 0, "length": 20}]
    return scenario_from_dict(tables)


def test_it_lies_ahead_of_the_front_bumper(tables: dict[str, Any]) -> None:
    tables["path"]["segments"][0]["length"] = 20
    near = 1.0 + VEHICLE.front + 4.0
    outline = put(scenario_from_dict(tables), Pose2(1.0, 0.7, 0.1), 4.0)
    assert extent(outline) == pytest.approx((near, -3.0, near + THICKNESS, 3.0))


def test_in_reverse_it_lies_behind_the_rear_bumper(tables: dict[str, Any]) -> None:
    near = -1.0 - VEHICLE.rear - 4.0
    outline = put(in_reverse(tables), Pose2(-1.0, 0.0, 0.0), 4.0)
    assert extent(outline) == pytest.approx((near - THICKNESS, -3.0, near, 3.0))


def test_behind_the_end_it_lies_straight_ahead_and_has_no_boundary(straight: Scenario) -> None:
    near = 8.0 + VEHICLE.front + 5.0
    expected = (near, -ACROSS, near + THICKNESS, ACROSS)
    assert extent(put(straight, Pose2(8.0, 0.0, 0.0), 5.0)) == pytest.approx(expected)
    # The vehicle itself behind the end: from there on.
    assert extent(put(straight, Pose2(11.0, 0.0, 0.0), 5.0))[0] == pytest.approx(11.0 + VEHICLE.front + 5.0)


def test_in_a_bend_it_stands_across_the_path(tables: dict[str, Any]) -> None:
    tables["path"]["segments"] = [{"direction": 1, "curvature": 0.1, "length": 15}]
    scenario = scenario_from_dict(tables)
    foot = scenario.build_path().parts[0].pose(VEHICLE.front + 5.0)
    corners = [Pose2(x, y, 0.0).relative_to(foot) for x, y in put(scenario, Pose2(0.0, 0.0, 0.0), 5.0)]
    assert [(p.x, p.y) for p in corners] == [
        pytest.approx(corner, abs=1e-3)
        for corner in ((0.0, -3.0), (THICKNESS, -3.0), (THICKNESS, 3.0), (0.0, 3.0))
    ]


def blocked(scenario: Scenario, **changes: Any) -> Scenario:
    faults = [{"kind": "blocked", "from": 1.0, "to": 2.0, "size": 1.0}]
    return changed(scenario, {"simulation.duration": 3.0, "faults": faults, **changes})


def test_it_is_told_and_kept_for_as_long_as_it_is_there(scripted: Any, straight: Scenario) -> None:
    controller = scripted(script=forward)
    result = simulate(blocked(straight), controller=controller)
    assert [len(told[3]) for told in controller.given] == [0] * 20 + [1] * 20 + [0] * 21
    assert [begin for begin, _ in result.corridors] == [0.0, 1.0, 2.0]
    # It stays where it was put: the vehicle has come 1.5 m nearer when it goes, and is 0.5 m inside.
    near = 0.5 + VEHICLE.front + 1.0
    (wall,) = {outline.tobytes() for told in controller.given for outline in told[3]}
    assert np.frombuffer(wall).reshape(-1, 2)[:, 0].min() == pytest.approx(near)
    assert summary(result)["min_clearance_m"] == pytest.approx(-0.5, abs=0.02)


def test_it_comes_on_top_of_other_obstacles(scripted: Any, straight: Scenario) -> None:
    known, told = scripted(script=still), scripted(script=still)
    simulate(blocked(straight, **{"corridor.obstacles": [BOX]}), controller=known)
    simulate(
        blocked(straight),
        controller=told,
        obstacles_at=lambda now: [np.array(BOX)] if now > 1.475 else [],
    )
    assert [len(entry[3]) for entry in known.given[::10]] == [1, 1, 2, 2, 1, 1, 1]
    assert [len(entry[3]) for entry in told.given[::10]] == [0, 0, 1, 2, 1, 1, 1]


def test_it_appears_though_the_cycle_is_lost(scripted: Any, straight: Scenario) -> None:
    scenario = blocked(straight)
    faults = [
        *(fault.model_dump(by_alias=True) for fault in scenario.faults),
        {"kind": "lost_cycles", "from": 0.5, "to": 2.5},
    ]
    result = simulate(changed(scenario, {"faults": faults}), controller=scripted(script=forward))
    assert [begin for begin, _ in result.corridors] == [0.0, 1.0, 2.0]


def test_without_changes_no_obstacles_are_told(scripted: Any, straight: Scenario) -> None:
    controller = scripted(script=still)
    scenario = changed(straight, {"simulation.duration": 0.2, "corridor.obstacles": [BOX]})
    result = simulate(scenario, controller=controller)
    assert {told[3] for told in controller.given} == {None}
    assert len(result.corridors[0][1].obstacles) == 1
