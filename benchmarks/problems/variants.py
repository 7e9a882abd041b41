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


def moved(scenario: Scenario, to: Pose2) -> Scenario:
    """The scenario turned by `to.phi` [rad] about the world's origin and then shifted by x, y [m]."""

    def there(pose: Pose2) -> list[float]:
        moved = to.compose(pose)
        return [moved.x, moved.y, moved.phi]

    changes = {_start_key(scenario): there(_start(scenario))}
    if scenario.goal.pose is not None:
        changes["goal.pose"] = there(Pose2(*scenario.goal.pose))
    return changed(scenario, changes | _outlines(scenario, lambda x, y: there(Pose2(x, y, 0.0))[:2]))


def mirrored(scenario: Scenario) -> Scenario:
    """The scenario mirrored at the world's x axis: left and right change places."""
    pose = _start(scenario)
    changes = {_start_key(scenario): [pose.x, -pose.y, -pose.phi]}
    if scenario.goal.pose is not None:
        x, y, phi = scenario.goal.pose
        changes["goal.pose"] = [x, -y, -phi]
    outlines = _outlines(scenario, lambda x, y: [x, -y])
    return changed(scenario, changes | outlines | _reflected(scenario, ahead=1))


def turned_round(scenario: Scenario) -> Scenario:
    """Everything driven with the other end of the vehicle ahead: headings by pi, forward for reverse.

    Front and rear of the body are exchanged, so the body passes over the same ground.
    """
    pose = _start(scenario)
    changes = {_start_key(scenario): [pose.x, pose.y, pose.phi + pi]}
    if scenario.goal.pose is not None:
        x, y, phi = scenario.goal.pose
        changes["goal.pose"] = [x, y, phi + pi]
    return changed(scenario, changes | _reflected(scenario, ahead=-1))


def _reflected(scenario: Scenario, *, ahead: int) -> dict[str, Any]:
    """What is relative to vehicle, path or goal, left and right exchanged; `ahead` -1: both ends too."""

    def there(x: float, y: float, phi: float) -> list[float]:
        return [ahead * x, -y, -ahead * phi]

    changes: dict[str, Any] = {
        **_segments(scenario, direction=ahead),
        **_swapped_sides(scenario),
        **_body(scenario, lambda x, y: [ahead * x, -y]),
        **_faults_aside(scenario),
    }
    goal = scenario.goal
    if goal.offset is not None:
        changes["goal.offset"] = there(*goal.offset)
    if goal.measurement is not None:
        changes["goal.measurement.initial_offset"] = there(*goal.measurement.initial_offset)
    if goal.shifts:
        changes["goal.shifts"] = [
            {"at_distance": shift.at_distance, "offset": there(*shift.offset)} for shift in goal.shifts
        ]
    return changes


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
    narrowings = []
    for piece in corridor.narrowings:
        sides = {"left": piece.right, "right": piece.left}
        swapped = {side: -offset for side, offset in sides.items() if offset is not None}
        narrowings.append({"from": piece.start, "to": piece.end, **swapped})
    return {
        "corridor.left": -corridor.right,
        "corridor.right": -corridor.left,
        "corridor.narrowings": narrowings,
    }


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
