"""Starts beside and turned from the path in the built-in scenarios, whose corridors leave less room."""

from __future__ import annotations

from math import isfinite, radians
from typing import NamedTuple

import numpy as np
import pytest

from geometry import Pose2
from rti_mpcc.model.footprint import body_polygons
from rti_mpcc.simulation import load_scenario
from rti_mpcc.simulation.plant import PlantState
from rti_mpcc.types import Command, Status
from tests.rti_mpcc.docking_runs import drive


class Start(NamedTuple):
    """To the left of the path's begin [m], and turned from it [deg]."""

    across: float
    turned: float


STARTS = {
    Start(2.0, 0.0): 30.0,
    Start(-2.0, 0.0): 30.0,
    Start(0.0, 60.0): 30.0,
    Start(0.0, -60.0): 60.0,
}
"""So long they are driven at most [s]. Turned to the right by 60 deg there is no way back in one move, and
another way is planned."""


@pytest.mark.acceptance
@pytest.mark.parametrize(
    "start",
    [
        start if start == Start(-2.0, 0.0) else pytest.param(start, marks=pytest.mark.acceptance)
        for start in STARTS
    ],
    ids=str,
)
@pytest.mark.parametrize(
    "name", ["docking_inside", pytest.param("docking_behind", marks=pytest.mark.acceptance)]
)
def test_a_start_off_the_path_touches_nothing_and_docks_where_there_is_a_way(name: str, start: Start) -> None:
    scenario = load_scenario(name)
    path, config = scenario.build_path(), scenario.controller_config()
    part = path.parts[0]
    pose = part.pose(part.start).compose(Pose2(0.0, start.across, radians(start.turned)))
    run: list[tuple[PlantState, Command]] = []
    for plant, command in drive(scenario, STARTS[start], start=PlantState(x=pose.x, y=pose.y, phi=pose.phi)):
        run.append((plant, command))
        assert all(map(isfinite, (command.acceleration, command.steering_rate)))
        assert abs(command.acceleration) <= config.limits.acceleration
        assert abs(command.steering_rate) <= config.limits.steering_rate
        if command.docked:
            break
    poses = np.array([[plant.x, plant.y, plant.phi, 0.0, 0.0, 0.0] for plant, _ in run])
    clearance = scenario.build_corridor(path).clearance(0, body_polygons(poses, config.vehicle))
    assert clearance.min() > 0.0
    last = run[-1][1]
    assert last.status is Status.DOCKED, last.diagnostics.reason
