"""The same docking problem elsewhere, mirrored, or driven the other way round.

A controller must not care; tests compare the runs. Noise is what it was: it is not mirrored or turned. All
take and give a `Scenario` whose path is made of segments, or one in an area that is no map.
"""

from __future__ import annotations

from collections.abc import Callable
from math import pi
from typing import Any

from geometry import Pose2
from rti_mpcc.errors import InputError
from rti_mpcc.simulation.scenario import Scenario, changed
from rti_mpcc.simulation.sections.ground import AreaSection, CorridorSection

Points = list[list[float]]


def moved(scenario: Scenario, to: Pose2) -> Scenario:
    """The scenario turned by `to.phi` [rad] about the world's origin and then shifted by x, y [m]."""
    start = to.compose(_start(scenario))
    changes: dict[str, Any] = {_start_key(scenario): [start.x, start.y, start.phi]}
    if scenario.goal.pose is not None:
        pose = to.compose(Pose2(*scenario.goal.pose))
        changes["goal.pose"] = [pose.x, pose.y, pose.phi]
    return changed(
        scenario, {**changes, **_outlines(scenario, lambda x, y: _xy(to.compose(Pose2(x, y, 0.0))))}
    )


def mirrored(scenario: Scenario) -> Scenario:
    """The scenario mirrored at the world's x axis: left and right change places."""
    start, goal = _start(scenario), scenario.goal
    changes: dict[str, Any] = {
        _start_key(scenario): [start.x, -start.y, -start.phi],
        **_segments(scenario, direction=1),
        **_swapped_sides(scenario),
        **_body(scenario, lambda x, y: [x, -y]),
        **_outlines(scenario, lambda x, y: [x, -y]),
    }
    for key, value in (("offset", goal.offset), ("pose", goal.pose)):
        if value is not None:
            changes[f"goal.{key}"] = [value[0], -value[1], -value[2]]
    if goal.measurement is not None:
        x, y, phi = goal.measurement.initial_offset
        changes["goal.measurement.initial_offset"] = [x, -y, -phi]
    if goal.shifts:
        changes["goal.shifts"] = _shifts(scenario, lambda x, y, phi: [x, -y, -phi])
    return changed(scenario, {**changes, **_faults_aside(scenario)})


def turned_round(scenario: Scenario) -> Scenario:
    """Everything driven with the other end of the vehicle ahead: headings by pi, forward for reverse.

    Front and rear of the body are exchanged, so the body passes over the same ground.
    """
    start, goal = _start(scenario), scenario.goal
    changes: dict[str, Any] = {
        _start_key(scenario): [start.x, start.y, start.phi + pi],
        **_segments(scenario, direction=-1),
        **_swapped_sides(scenario),
        **_body(scenario, lambda x, y: [-x, -y]),
    }
    if goal.offset is not None:
        changes["goal.offset"] = [-goal.offset[0], -goal.offset[1], goal.offset[2]]
    if goal.pose is not None:
        changes["goal.pose"] = [goal.pose[0], goal.pose[1], goal.pose[2] + pi]
    if goal.measurement is not None:
        x, y, phi = goal.measurement.initial_offset
        changes["goal.measurement.initial_offset"] = [-x, -y, phi]
    if goal.shifts:
        changes["goal.shifts"] = _shifts(scenario, lambda x, y, phi: [-x, -y, phi])
    return changed(scenario, {**changes, **_faults_aside(scenario)})


def _start(scenario: Scenario) -> Pose2:
    if scenario.area is not None:
        if scenario.area.map is not None:
            raise InputError(f"area.map = {scenario.area.map!r}: only an area of polygons can be changed")
        return scenario.start_pose()
    assert scenario.path is not None
    if scenario.path.start is None or scenario.path.segments is None:
        raise InputError(f"path.file = {scenario.path.file!r}: only a path made of segments can be changed")
    return Pose2(*scenario.path.start)


def _start_key(scenario: Scenario) -> str:
    return "start.pose" if scenario.in_area else "path.start"


def _segments(scenario: Scenario, *, direction: int) -> dict[str, list[dict[str, float]]]:
    """All curvatures negated, directions multiplied by `direction`."""
    if scenario.path is None:
        return {}
    segments = [
        {"direction": direction * piece.direction, "curvature": -piece.curvature, "length": piece.length}
        for piece in scenario.path.segments or ()
    ]
    return {"path.segments": segments}


def _swapped_sides(scenario: Scenario) -> dict[str, Any]:
    """The offsets of the corridor, where it has some, on the other side."""
    corridor = scenario.corridor
    if corridor is None or corridor.left is None or corridor.right is None:
        return {}
    return {
        "corridor.left": -corridor.right,
        "corridor.right": -corridor.left,
        "corridor.narrowings": _swapped_narrowings(corridor),
    }


def _swapped_narrowings(corridor: CorridorSection) -> list[dict[str, float]]:
    swapped = []
    for piece in corridor.narrowings:
        entry = {"from": piece.start, "to": piece.end}
        if piece.right is not None:
            entry["left"] = -piece.right
        if piece.left is not None:
            entry["right"] = -piece.left
        swapped.append(entry)
    return swapped


def _shifts(scenario: Scenario, move: Callable[[float, float, float], list[float]]) -> list[dict[str, Any]]:
    return [
        {"at_distance": shift.at_distance, "offset": move(*shift.offset)} for shift in scenario.goal.shifts
    ]


def _faults_aside(scenario: Scenario) -> dict[str, Any]:
    """The faults with jumps to the left as jumps to the right."""
    faults = [fault.model_dump(by_alias=True) for fault in scenario.faults]
    for table, fault in zip(faults, scenario.faults, strict=True):
        if fault.kind in ("state_jump", "goal_jump"):
            table["size"] = -fault.amount
    return {"faults": faults} if faults else {}


def _outlines(scenario: Scenario, move: Any) -> dict[str, list[Any]]:
    """Corridor polygon or boundary, and obstacles, with every point moved."""
    section: CorridorSection | AreaSection
    if scenario.area is not None:
        table, section, outline = "area.boundary", scenario.area, scenario.area.boundary
    else:
        assert scenario.corridor is not None
        table, section, outline = "corridor.polygon", scenario.corridor, scenario.corridor.polygon
    changes: dict[str, list[Any]] = {}
    if outline is not None:
        changes[table] = [move(*point) for point in outline]
    if section.obstacles:
        key = f"{table.partition('.')[0]}.obstacles"
        changes[key] = [[move(*point) for point in obstacle] for obstacle in section.obstacles]
    return changes


def _body(scenario: Scenario, move: Callable[[float, float], list[float]]) -> dict[str, Any]:
    """The vehicle with every point of its body moved."""
    vehicle = scenario.vehicle
    if vehicle.outline is not None:
        return {"vehicle.outline": [move(*point) for point in vehicle.outline]}
    if move(1.0, 0.0)[0] > 0.0:
        return {}
    return {"vehicle.front": vehicle.rear, "vehicle.rear": vehicle.front}


def _xy(pose: Pose2) -> list[float]:
    return [pose.x, pose.y]
