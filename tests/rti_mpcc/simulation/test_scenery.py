"""What fills the way as a fault: where it is put, from when to when, beside which other obstacles."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from geometry import Pose2, ReferencePath
from rti_mpcc.config import Vehicle
from rti_mpcc.simulation import Scenario, changed, scenario_from_dict, simulate, summary
from rti_mpcc.simulation.scenery import ACROSS, BESIDE, THICKNESS, wall_ahead, wall_on
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


# -- in an area ------------------------------------------------------------------------------------------

HALF = 0.5 * VEHICLE.width + BESIDE


def test_in_an_area_it_is_somewhat_wider_than_the_body() -> None:
    path = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(1, 0.0, 20.0)])
    outline = wall_on(path, Pose2(1.0, 0.7, 0.1), VEHICLE, part=0, near=1.0, gap=4.0)
    near = 1.0 + VEHICLE.front + 4.0
    assert extent(outline) == pytest.approx((near, -HALF, near + THICKNESS, HALF))


def test_in_an_area_it_stands_behind_a_cusp_where_the_body_comes_to_it() -> None:
    path = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(1, 0.0, 6.0), (-1, 0.0, 20.0)])
    # 2 m forward and 10 m back: the rear axle is at -4 m by then.
    outline = wall_on(path, Pose2(4.0, 0.0, 0.0), VEHICLE, part=0, near=4.0, gap=12.0)
    near = -4.0 - VEHICLE.rear
    assert extent(outline) == pytest.approx((near - THICKNESS, -HALF, near, HALF))


def test_in_an_area_it_does_not_stand_on_the_body() -> None:
    path = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(1, 0.0, 6.0), (-1, 0.0, 20.0)])
    # 2 m forward and 2 m back: there the vehicle is now, so it stands beyond the cusp.
    outline = wall_on(path, Pose2(4.0, 0.0, 0.0), VEHICLE, part=0, near=4.0, gap=4.0)
    near = 4.0 + VEHICLE.front + 4.0
    assert extent(outline) == pytest.approx((near, -HALF, near + THICKNESS, HALF))


def test_in_an_area_behind_the_end_it_lies_straight_ahead() -> None:
    path = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(-1, 0.0, 5.0)])
    outline = wall_on(path, Pose2(-4.0, 0.0, 0.0), VEHICLE, part=0, near=4.0, gap=7.0)
    near = -11.0 - VEHICLE.rear
    assert extent(outline) == pytest.approx((near - THICKNESS, -HALF, near, HALF))


def test_before_there_is_a_way_it_stands_straight_ahead(scripted: Any, hall: Scenario) -> None:
    controller = scripted(script=forward)
    result = simulate(blocked(hall), controller=controller)
    assert [len(told[3]) for told in controller.given] == [0] * 20 + [1] * 20 + [0] * 21
    assert [begin for begin, _ in result.besides] == [0.0, 1.0, 2.0]
    near = 0.5 + VEHICLE.front + 1.0
    assert extent(controller.given[20][3][0]) == pytest.approx((near, -HALF, near + THICKNESS, HALF))
    assert summary(result)["min_clearance_m"] == pytest.approx(-0.5, abs=0.02)


def test_it_stands_across_the_way_that_was_planned(scripted_planner: Any, hall: Scenario) -> None:
    path = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(1, 0.1, 10.0)])
    controller = scripted_planner(script=still, planned=lambda now: path)
    simulate(blocked(hall), controller=controller)
    foot = path.parts[0].pose(VEHICLE.front + 1.0)
    (wall,) = controller.given[20][3]
    corners = [Pose2(x, y, 0.0).relative_to(foot) for x, y in wall.tolist()]
    assert [(p.x, p.y) for p in corners] == [
        pytest.approx(corner) for corner in ((0.0, -HALF), (THICKNESS, -HALF), (THICKNESS, HALF), (0.0, HALF))
    ]


def test_obstacles_at_a_time_come_besides_those_of_the_area(scripted: Any, hall: Scenario) -> None:
    controller = scripted(script=still)
    scenario = changed(hall, {"simulation.duration": 0.2})
    result = simulate(scenario, controller=controller, obstacles_at=lambda now: [np.array(BOX)])
    assert [len(told[3]) for told in controller.given] == [1] * 5
    assert [len(outlines) for _, outlines in result.besides] == [1]
    assert result.area is not None
    assert len(result.area.obstacles) == 1


def test_in_an_area_without_changes_no_obstacles_are_told(scripted: Any, hall: Scenario) -> None:
    controller = scripted(script=still)
    simulate(changed(hall, {"simulation.duration": 0.2}), controller=controller)
    assert {told[3] for told in controller.given} == {None}
