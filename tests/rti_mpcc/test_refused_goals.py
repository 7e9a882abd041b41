"""Goals that are refused: each command says why, and the vehicle stands."""

from __future__ import annotations

import pytest

from benchmarks.encounters import on_lane
from geometry import Pose2
from rti_mpcc import Command, DockingController, Status, VehicleState
from tests.rti_mpcc.yards import YARD


def told(controller: DockingController, goal: Pose2) -> Command:
    """The first command of a vehicle at rest that is given a goal."""
    return controller.step(VehicleState(0.0, 0.0, 0.0, 0.0, 0.0), now=0.0, goal=goal)


@pytest.mark.parametrize(("x", "y"), [(15.0, 500.0), (15.0, -500.0), (500.0, 0.0), (-500.0, 0.0)])
def test_a_goal_far_beyond_the_area_is_refused_in_either_axis(x: float, y: float) -> None:
    command = told(DockingController.in_area(YARD), Pose2(x, y, 0.0))
    assert command.status is Status.GOAL_REJECTED
    assert "outside the boundary of the area" in command.diagnostics.reason
    assert command.acceleration == 0.0


@pytest.mark.parametrize(("x", "y"), [(20.0, 1e11), (20.0, -1e11), (1e11, 0.0)])
def test_coordinates_of_no_place_on_earth_are_refused_in_either_axis(x: float, y: float) -> None:
    command = told(on_lane(20.0, 3.0), Pose2(x, y, 0.0))
    assert command.status is Status.GOAL_REJECTED
    assert "coordinates at most 1e+10 m" in command.diagnostics.reason


@pytest.mark.parametrize("y", [8.0, -8.0])
def test_a_goal_behind_a_wall_is_refused(y: float) -> None:
    command = told(on_lane(20.0, 3.0), Pose2(10.0, y, 0.0))
    assert command.status is Status.GOAL_REJECTED
    assert "a boundary lies between it and the path" in command.diagnostics.reason
