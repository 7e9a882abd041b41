"""A drawn scene as a scenario: what a campaign drives, and `save_scenario` writes to a file."""

from __future__ import annotations

from math import hypot
from typing import Any

from benchmarks.problems.scenes import Scene
from geometry import Pose2
from rti_mpcc.config import Vehicle
from rti_mpcc.simulation.scenario import Scenario, scenario_from_dict
from rti_mpcc.types import Array

DEAD_TIME = 0.18
"""Of the plant, known to the controller [s]."""
DURATION = 240.0
"""More than any of the ways takes that have been driven [s]."""


def scenario_of(scene: Scene) -> Scenario:
    """The scenario of a scene: start, area and goal; nothing of its witness."""
    area: dict[str, Any] = {"obstacles": [_corners(each) for each in scene.obstacles]}
    if scene.boundary is not None:
        area["boundary"] = _corners(scene.boundary)
    return scenario_from_dict(
        {
            "name": scene.name,
            "description": _described(scene),
            "start": {"pose": _pose(scene.start)},
            "area": area,
            "goal": {"pose": _pose(scene.goal)},
            "vehicle": {
                name: getattr(scene.vehicle, name) for name in ("wheelbase", "width", "front", "rear")
            },
            "limits": {name: float(value) for name, value in scene.limits.model_dump().items()},
            "controller": {"comfort_acceleration": scene.comfort_acceleration},
            "simulation": {"cycle": 0.05, "dead_time": DEAD_TIME, "duration": DURATION},
        }
    )


def kind_of(scenario: Scenario) -> str:
    """Of the scene that a scenario was made from."""
    return scenario.name.partition("_")[0]


def _corners(outline: Array) -> list[list[float]]:
    corners: list[list[float]] = outline.tolist()
    return corners


def _pose(pose: Pose2) -> list[float]:
    return [pose.x, pose.y, pose.phi]


def _described(scene: Scene) -> str:
    vehicle: Vehicle = scene.vehicle
    apart = hypot(scene.goal.x - scene.start.x, scene.goal.y - scene.start.y)
    around = "within a boundary" if scene.boundary is not None else "without a boundary"
    return (
        f"{scene.kind}, {apart:.1f} m from start to goal, {len(scene.obstacles)} obstacles, {around}, "
        f"a body of {vehicle.front + vehicle.rear:.2f} m"
    )
