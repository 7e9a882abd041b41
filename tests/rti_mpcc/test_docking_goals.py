"""Goals that cannot be reached, or hardly, in closed loop: never in silence, and never an exception."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import pytest

from estimation import GoalMeasurement
from geometry import Pose2
from rti_mpcc import ControllerConfig, DockingController, Limits, VehicleState
from tests.lists import acceptance
from tests.rti_mpcc.docking_runs import BODY_HALF_WIDTH, Obstacles, box, drive, straight

LENGTH = 12.0
LANE = straight(1, LENGTH, speed=2.0)
START = VehicleState(x=0.0, y=0.0, phi=0.0, v=0.0, delta=0.0)
PATH = LANE.build_path()
OBSTACLE = box(PATH.parts[0], 14.0, 1.2, 2.2, 1.0)


def controller(**settings: Any) -> DockingController:
    config = ControllerConfig(dead_time=0.18, limits=Limits(speed=2.0), **settings)
    return DockingController(PATH, LANE.build_corridor(PATH), config)


def test_a_goal_in_an_obstacle_is_taken_once_that_has_gone_and_kept_when_it_comes_back() -> None:
    """The vehicle has docked at the last good goal by nothing but that it was told again."""
    docking, good, taken = controller(), Pose2(11.0, -0.5, 0.0), Pose2(LENGTH, 0.5, 0.0)

    def aim(goal: Pose2, obstacles: Obstacles, now: float) -> tuple[float, str]:
        command = docking.step(START, now=now, goal=goal, obstacles=obstacles)
        assert command.goal is not None
        return command.goal.pose.x, command.diagnostics.reason

    assert aim(good, [], 0.0) == (11.0, "")
    x, reason = aim(taken, [OBSTACLE], 0.05)
    assert x == 11.0
    assert reason.startswith("goal (12, 0.5, 0) rejected: the body there crosses a boundary or obstacle")
    assert reason.endswith("keeping the previous goal")
    assert aim(taken, [OBSTACLE], 0.1)[0] == 11.0
    assert aim(taken, [], 0.15) == (LENGTH, "")
    x, reason = aim(taken, [OBSTACLE], 0.2)
    assert x == LENGTH
    assert "rejected" not in reason


@pytest.mark.parametrize("room", [0.03, 0.05, 0.09])
def test_beside_a_wall_no_command_is_without_a_reason(room: float) -> None:
    goal = Pose2(LENGTH, 3.0 - BODY_HALF_WIDTH - room, 0.0)
    said = f"the goal leaves {room:.2f} m beside the body, less than the margin of 0.10 m"
    for plant, command in drive(LANE, 6.0, goal_at=lambda _: goal):
        assert said in command.diagnostics.reason
        assert plant.y + BODY_HALF_WIDTH < 3.0


def test_clearing_the_goal_clears_what_was_said_of_it() -> None:
    docking = controller()
    docking.step(START, now=0.0, goal=Pose2(500.0, 0.0, 0.0))
    docking.clear_goal()
    assert docking.step(START, now=0.05).diagnostics.reason == ""


def test_a_correction_that_is_given_once_is_followed() -> None:
    """However small: noise would be followed by another goal."""
    corrected = Pose2(LENGTH - 0.09, 0.08, 0.03)
    told = iter([Pose2(LENGTH, 0.0, 0.0), None, corrected])
    *_, (plant, command) = drive(LANE, 20.0, goal_at=lambda _: next(told, None))
    assert command.docked
    assert Pose2(plant.x, plant.y, plant.phi).relative_to(corrected).within((0.05, 0.05, 0.035))


# -- detections -------------------------------------------------------------------------------------


def test_a_goal_detected_out_of_reach_is_not_followed_and_said() -> None:
    docking, planned = controller(), Pose2(LENGTH, 0.0, 0.0)
    for k in range(45):
        seen = GoalMeasurement(stamp=0.05 * k, x=LENGTH, y=2.6, phi=0.0, vehicle=Pose2(0.0, 0.0, 0.0))
        command = docking.step(START, now=0.05 * k, goal=planned, measurements=[seen])
    assert command.diagnostics.target == planned
    assert "goal detected at (12, 2.6" in command.diagnostics.reason
    assert "crosses a boundary or obstacle" in command.diagnostics.reason
    assert command.diagnostics.reason.endswith("keeping the previous goal")


# -- planned values --------------------------------------------------------------------


@pytest.mark.parametrize("noise", [acceptance(0.0), 0.02])
def test_the_speed_and_steering_of_a_command_stay_within_their_limits(noise: float) -> None:
    """As far as the vehicle itself does; noise shows it beyond its limit."""
    speed = 1.0
    scenario = straight(1, 20.0, speed=speed, state_noise=[0.0, 0.0, 0.0, noise, 0.0])
    run = list(drive(scenario, 14.0))
    assert max(command.speed for _, command in run) == pytest.approx(speed, abs=0.02)
    for plant, command in run:
        assert abs(command.speed) <= max(speed, abs(plant.measured.v))
        assert abs(command.steering) <= max(0.6, abs(plant.measured.delta))
    assert all(a.time < b.time for (a, _), (b, _) in pairwise(run))
