"""Paths that a user gives badly, of few waypoints or with corners, and starts off a path: all dock."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from benchmarks.encounters import on_lane
from geometry import Pose2, ReferencePath
from rti_mpcc import ControllerConfig
from tests.rti_mpcc.yards import Driver

CONFIG = ControllerConfig(cycle=0.05, dead_time=0.18)
PATHS = {
    "corner": [(0, 0), (10, 0), (10, 10)],
    "corner of five": [(0, 0), (5, 0), (10, 0), (10, 5), (10, 10)],
    "dense corner": [*((x, 0) for x in range(11)), *((10, y) for y in range(1, 11))],
    "zigzag": [(0, 0), (8, 0), (8, 6), (16, 6), (16, 12)],
    "turn": [(0, 0), (12, 0), (12, 5), (0, 5)],
    "waves": [(0, 0), (5, 0.8), (10, -0.8), (15, 0.8), (20, -0.8), (25, 0)],
    "three": [(0, 0), (12, 4), (24, 0)],
}
STARTS = {
    "before it": Pose2(-15.0, 0.0, 0.0),
    "beside it": Pose2(0.0, 2.5, 0.0),
    "turned": Pose2(4.0, 0.5, 0.7),
    "the wrong way round": Pose2(4.0, 0.0, np.pi),
}


def docks(path: ReferencePath, half: float, start: Pose2) -> tuple[float | None, float]:
    """When it docks [s], or None, and the least clearance of the body on the way [m]."""
    controller = on_lane(path, half, CONFIG)
    # In all of the corridor and its open ends, where another way may lead.
    area = controller.area
    assert area is not None
    driver = Driver(area=area, controller=controller, config=CONFIG, start=start, goal_at=lambda now: None)
    drive = driver.drive(120.0, after_docking=CONFIG.cycle)
    return float(drive.times[-1]) if drive.docked else None, float(drive.clearance.min())


@pytest.mark.parametrize("direction", [1, -1])
@pytest.mark.parametrize("half", [2.0, 3.0, 5.0])
@pytest.mark.parametrize("name", PATHS)
def test_paths_of_few_waypoints_and_with_corners_are_docked_along(
    name: str, half: float, direction: int, figures: dict[str, Any]
) -> None:
    path = ReferencePath.from_waypoints(np.array(PATHS[name], dtype=float), direction)
    docked, clearance = docks(path, half, path.start)
    figures["docked_s"], figures["clearance_m"] = docked, clearance
    assert docked is not None
    assert clearance > 0.0


@pytest.mark.parametrize("name", STARTS)
def test_starts_off_the_path_are_joined_to_it(name: str, figures: dict[str, Any]) -> None:
    path = ReferencePath.from_waypoints([(0.0, 0.0), (20.0, 0.0), (40.0, 5.0)])
    docked, clearance = docks(path, 5.0, path.start.compose(STARTS[name]))
    figures["docked_s"], figures["clearance_m"] = docked, clearance
    assert docked is not None
    assert clearance > 0.0
