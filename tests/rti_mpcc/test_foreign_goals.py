"""Detections that are wrong in ways that a detector's noise is not; tests/acceptance has the random ones.

The plant, the camera and the check are those of `benchmarks.foreign`, none of the product's.
"""

from __future__ import annotations

from dataclasses import replace
from math import pi

import pytest

from benchmarks.foreign_cameras import Bursts, MovingDock
from benchmarks.foreign_goals import Case, drawn, judged, ride
from estimation import GoalMeasurement, Outcome
from geometry import Area, Pose2
from rti_mpcc import (
    Approach,
    Command,
    ControllerConfig,
    Dock,
    DockingController,
    DockingMission,
    DockKind,
    Status,
    VehicleState,
)
from tests.lists import some_of

PLANNED = Pose2(8.0, 0.0, 0.0)
BODY = ((5.0, -1.0), (7.0, -1.0), (7.0, 1.0), (5.0, 1.0))
START = VehicleState(x=0.0, y=0.0, phi=0.0, v=0.0, delta=0.0)


def seen(pose: Pose2, stamp: float) -> GoalMeasurement:
    """A detection in the world."""
    return GoalMeasurement(stamp=stamp, x=pose.x, y=pose.y, phi=pose.phi)


def after(seconds: float, pose: Pose2, *, unit: float = 1.0, late: float = 0.0) -> Command:
    """The last command of a controller that stands and sees the dock at one pose."""
    controller = DockingController.in_area(Area(obstacles=[]), ControllerConfig(cycle=0.05))
    for k in range(round(seconds / 0.05)):
        now = 5.0 + 0.05 * k
        detection = seen(pose, unit * (now - late))
        command = controller.step(START, now=now, goal=PLANNED, measurements=[detection])
    return command


def pose_of(command: Command) -> Pose2:
    """The goal that it is made for."""
    assert command.goal is not None
    return command.goal.pose


# -- one detection, and what is said of it ---------------------------------------------------------------


def test_a_detection_turned_by_180_deg_is_rejected_and_named() -> None:
    command = after(3.0, Pose2(8.1, 0.0, pi))
    (judgement,) = command.diagnostics.detections
    assert judgement.outcome is Outcome.REJECTED
    assert "turned by 180 deg" in judgement.reason
    assert "turned by 180 deg" in command.diagnostics.reason
    assert pose_of(command) == PLANNED


def test_a_detection_beyond_the_uncertainty_of_its_dock_is_rejected_from_the_first_one_on() -> None:
    dock = Dock(
        PLANNED, kind=DockKind.DETECTED, approach=Approach(2.0, 1), body=BODY, uncertainty=(1.0, 0.26)
    )
    mission = DockingMission(DockingController.in_area(Area(obstacles=[]), ControllerConfig()), [dock])
    for k in range(60):
        detections = [seen(Pose2(8.0, 1.5, 0.0), 0.05 * k)]
        command = mission.step(START, now=0.05 * k, measurements=detections)
    (judgement,) = command.diagnostics.detections
    assert judgement.outcome is Outcome.REJECTED
    assert "1.50 m and 0 deg from the planned goal, which is wrong by at most 1 m" in judgement.reason
    assert pose_of(command) == PLANNED


def test_a_goal_that_was_given_roughly_is_still_followed_far_from_there() -> None:
    far = Pose2(8.0, 4.0, 0.3)
    assert pose_of(after(1.0, far)) == PLANNED
    assert pose_of(after(4.0, far)).relative_to(far).within((0.01, 0.01, 0.01))


@pytest.mark.parametrize(
    ("unit", "late", "said"),
    [
        (1000.0, 0.0, "ahead of the clock by"),
        (1000.0, 0.0, "stamps are seconds on the clock of `now`, 5.950: is it in milliseconds?"),
        (1.0, 2.0, "older than `history`, 1 s: 2.000 s before the clock"),
    ],
)
def test_stamps_that_are_not_seconds_on_the_clock_are_named(unit: float, late: float, said: str) -> None:
    command = after(1.0, PLANNED, unit=unit, late=late)
    (judgement,) = command.diagnostics.detections
    assert judgement.outcome is Outcome.REFUSED
    assert said in judgement.reason
    assert judgement.reason in command.diagnostics.reason


# -- rides -----------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def clean() -> float:
    """When the vehicle docks without any fault [s]."""
    docked = judged(CASE, ride(CASE)).docked_at
    assert docked is not None
    return docked


CASE = drawn("path", 4711)


def with_fault(**camera: object) -> Case:
    return drawn("path", 4711, **camera)


@pytest.mark.parametrize("share", some_of([0.5, 0.3]))
def test_it_docks_in_time_though_many_detections_are_turned_by_180_deg(share: float, clean: float) -> None:
    outcome = judged(with_fault(flips=share), ride(with_fault(flips=share)))
    assert outcome.docked_at is not None
    assert outcome.docked_at <= 1.15 * clean
    assert outcome.wrong == 0.0


def test_it_stands_and_says_why_where_all_detections_are_turned_by_180_deg() -> None:
    case = replace(with_fault(flips=1.0), seconds=30.0)
    outcome = judged(case, ride(case))
    assert outcome.docked_at is None
    assert outcome.stands
    assert "turned by" in outcome.reason


def test_bursts_of_false_detections_neither_replan_nor_cost_time(clean: float) -> None:
    case = with_fault(bursts=Bursts())
    done = ride(case)
    outcome = judged(case, done)
    assert outcome.docked_at is not None
    assert outcome.docked_at <= 1.15 * clean
    assert outcome.wrong == 0.0
    assert not any(command.status is Status.PLANNING for command in done.commands)


@pytest.mark.parametrize("speed", some_of([0.1, 0.3]))
def test_nobody_is_docked_at_a_dock_that_moves_away(speed: float) -> None:
    """It is told as moving, waited for, and docked at where it stands."""
    dock = MovingDock(pose=CASE.dock.pose, velocity=(0.0, speed), begin=18.0, end=18.0 + 1.0 / speed)
    case = replace(CASE, dock=dock, after=60.0, seconds=70.0)
    done = ride(case)
    outcome = judged(case, done)
    assert outcome.wrong <= 1.3
    assert any(
        "waiting until the dock stands; the dock moves at" in each.diagnostics.reason
        for each in done.commands
    )
    assert done.commands[-1].docked
    assert done.inside(dock.at(70.0), (0.05, 0.05, 0.0349))
