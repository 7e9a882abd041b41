"""The words of a command promise no more than is true: docked, the goal, what holds, and a mission's end."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from math import hypot, pi
from typing import Any

import pytest

from benchmarks.encounters import square
from estimation import Frame, GoalMeasurement
from geometry import Area, Corridor, Narrowing, Pose2, ReferencePath
from rti_mpcc import (
    Command,
    ControllerConfig,
    Dock,
    DockingController,
    DockingMission,
    GoalOrigin,
    MissionResult,
    Reason,
    Status,
    Wait,
)
from rti_mpcc.simulation.plant import PlantParameters, PlantState
from tests.lists import acceptance
from tests.rti_mpcc.docking_runs import obeyed
from tests.rti_mpcc.yards import block

START = Pose2(0.0, 0.0, 0.0)
END = Pose2(15.0, 0.0, 0.0)
HALL = Area(boundary=[(-10.0, -10.0), (40.0, -10.0), (40.0, 10.0), (-10.0, 10.0)])
FAR = Pose2(900.0, 0.0, 0.0)
BESIDE = Pose2(15.0, 6.0, 0.0)
FENCE = [(-3.0, -3.0), (22.0, -3.0), (22.0, 3.0), (-3.0, 3.0)]
IN_FENCE = Pose2(13.0, 4.0, 0.0)
CONFIG = ControllerConfig()
HALF = 0.5 * CONFIG.vehicle.width
FRONT = CONFIG.vehicle.front
IN_FRONT = block(FRONT - 0.27, -1.0, FRONT + 1.73, 1.0)


def on_path(
    length: float = 15.0,
    *,
    curvature: float = 0.0,
    narrowings: Sequence[Narrowing] = (),
    fence: Sequence[tuple[float, float]] | None = None,
) -> DockingController:
    path = ReferencePath.from_segments(START, [(1, curvature, length)])
    corridor = Corridor.from_offsets(path, left=4.0, right=-4.0, narrowings=list(narrowings))
    if fence is not None:
        corridor = Corridor.from_polygon(path, fence)
    return DockingController(path, corridor, CONFIG)


@dataclass(slots=True)
class Ride:
    """A vehicle that obeys; what is given may depend on the plant."""

    driver: Any
    plant: PlantState = field(default_factory=lambda: PlantState(x=0.0, y=0.0, phi=0.0))
    commands: list[Command] = field(default_factory=list)
    travelled: float = 0.0

    def drive(
        self, seconds: float, until: Callable[[Command], bool] = lambda _: False, **given: Any
    ) -> Command:
        parameters = PlantParameters.of(CONFIG.vehicle, CONFIG.limits)
        end = self.plant.time + seconds
        while self.plant.time < end and not (self.commands and until(self.commands[-1])):
            told = {name: value(self.plant) if callable(value) else value for name, value in given.items()}
            command: Command = self.driver.step(self.plant.measured, now=self.plant.time, **told)
            self.commands.append(command)
            here = self.plant
            self.plant = obeyed(here, command, parameters, here.time + CONFIG.cycle)
            self.travelled += hypot(self.plant.x - here.x, self.plant.y - here.y)
        return self.commands[-1]


def docked(command: Command) -> bool:
    return command.docked


# -- docked: at the goal that was asked for --------------------------------------------------------------


@pytest.mark.parametrize(
    ("goal", "says"),
    [
        (FAR, "885 m from the path's end (at most 20 m)"),
        ((15.0, 0.0, 0.0), "expected Pose2, got tuple"),
        (Pose2(15.0, 0.0, 3.0), "turned by 3 rad from the path"),
        (BESIDE, "a boundary lies between it and the path"),
        (Pose2(15.0, 3.5, 0.0), "crosses a boundary or obstacle by 0.534 m"),
        (Pose2(15.0, 1e11, 0.0), "coordinates at most 1e+10 m"),
        (IN_FENCE, "crosses a boundary or obstacle by"),
    ],
)
@pytest.mark.parametrize("given", ["once", "always"])
def test_a_first_goal_that_is_refused_is_not_replaced_by_the_paths_end(
    goal: Any, says: str, given: str
) -> None:
    """The vehicle stands, and every command says why."""
    ride = Ride(on_path(fence=FENCE if goal is IN_FENCE else None))
    ride.drive(0.05, goal=goal)
    last = ride.drive(5.0, goal=goal if given == "always" else None)
    assert {each.status for each in ride.commands} == {Status.GOAL_REJECTED}
    assert not any(each.docked for each in ride.commands)
    assert (ride.travelled, last.goal) == (0.0, None)
    assert (ride.driver.replans, ride.driver.manoeuvre) == (0, None)
    for reason in (each.diagnostics.reason for each in ride.commands):
        assert says in reason
        assert "give another one, or call `clear_goal`" in reason


@pytest.mark.parametrize("goal", [FAR, Pose2(25.0, 9.5, 0.0), "there"])
def test_in_an_area_a_refused_goal_is_named_and_not_called_missing(goal: Any) -> None:
    ride = Ride(DockingController.in_area(HALL, CONFIG))
    last = ride.drive(1.0, goal=goal)
    assert (last.status, last.docked, last.goal) == (Status.GOAL_REJECTED, False, None)
    assert "no goal was accepted: give another one; goal " in last.diagnostics.reason
    assert "clear_goal" not in last.diagnostics.reason


@pytest.mark.parametrize("better", [Pose2(14.0, 0.5, 0.0), None])
def test_after_a_refused_goal_another_one_or_none_is_driven_to(better: Pose2 | None) -> None:
    ride = Ride(on_path())
    ride.drive(1.0, goal=FAR)
    if better is None:
        ride.driver.clear_goal()
    last = ride.drive(30.0, docked, goal=better)
    assert last.docked
    assert last.goal is not None
    assert last.goal.pose == (better or END)
    assert last.goal.source is (GoalOrigin.GIVEN if better else GoalOrigin.PATH_END)


def test_a_later_goal_that_is_refused_leaves_the_older_one_but_that_is_not_docked() -> None:
    ride, older = Ride(on_path()), Pose2(14.0, 0.5, 0.0)
    ride.drive(3.0, goal=older)
    last = ride.drive(22.0, goal=BESIDE)
    assert (ride.plant.x, ride.plant.y) == pytest.approx((14.0, 0.5), abs=0.05)
    assert (last.status, last.docked) == (Status.GOAL_REJECTED, False)
    assert not any(each.docked for each in ride.commands)
    assert last.goal is not None
    assert (last.goal.pose, last.goal.source) == (older, GoalOrigin.GIVEN)
    assert "goal (15, 6, 0) rejected: a boundary lies between it" in last.diagnostics.reason
    assert ride.drive(1.0, goal=older).docked  # asked for once more


@pytest.mark.parametrize(
    ("detection", "says"),
    [
        acceptance({"late": 1.5}, "older than `history`"),
        ({"unit": 1e3}, "is ahead of the clock"),
        ({"x": 15.0, "y": 6.0}, "a boundary lies between it and the path"),
        acceptance({"x": float("nan")}, "not finite"),
    ],
    ids=["1.5 s old", "stamps in ms", "elsewhere", "not finite"],
)
def test_detections_of_which_none_is_accepted_are_no_dock(detection: dict[str, float], says: str) -> None:
    def seen(plant: PlantState) -> list[GoalMeasurement]:
        stamp = detection.get("unit", 1.0) * plant.time - detection.get("late", 0.0)
        x, y = detection.get("x", 15.5), detection.get("y", 0.0)
        return [GoalMeasurement(stamp=stamp, x=x, y=y, phi=0.0, frame=Frame.WORLD)]

    ride = Ride(on_path())
    last = ride.drive(20.0, measurements=seen)
    assert ride.plant.x == pytest.approx(15.0, abs=0.05)
    assert (last.status, last.docked) == (Status.SEARCHING, False)
    assert says in last.diagnostics.reason
    assert not any(each.docked for each in ride.commands)


def test_a_dock_that_is_tracked_elsewhere_after_it_was_accepted_is_not_docked_at() -> None:
    def seen(plant: PlantState) -> list[GoalMeasurement]:
        y = 0.3 if plant.time < 8.0 else 4.8
        return [GoalMeasurement(stamp=plant.time, x=15.0, y=y, phi=0.0, frame=Frame.WORLD)]

    ride = Ride(on_path())
    last = ride.drive(25.0, measurements=seen)
    assert last.diagnostics.goal is not None
    assert last.diagnostics.goal.pose is not None
    assert last.diagnostics.goal.pose.y == pytest.approx(4.8, abs=0.1)
    assert (last.status, last.docked) == (Status.GOAL_REJECTED, False)
    assert "goal detected at (15, 4.8" in last.diagnostics.reason


def test_the_goal_says_where_it_is_from() -> None:
    def source(**given: Any) -> GoalOrigin | None:
        goal = Ride(on_path()).drive(0.5, **given).goal
        return None if goal is None else goal.source

    def seen(plant: PlantState) -> list[GoalMeasurement]:
        return [GoalMeasurement(stamp=plant.time, x=15.0, y=0.3, phi=0.0, frame=Frame.WORLD)]

    assert source() is GoalOrigin.PATH_END
    assert source(goal=END) is GoalOrigin.GIVEN
    assert source(measurements=seen) is GoalOrigin.DETECTED
    assert source(goal=END, measurements=seen) is GoalOrigin.DETECTED
    in_area = Ride(DockingController.in_area(HALL, CONFIG))
    assert in_area.drive(0.1).goal is None
    goal = in_area.drive(0.1, goal=END).goal
    assert goal is not None
    assert (goal.pose, goal.source) == (END, GoalOrigin.GIVEN)


# -- a route is driven by its progress -------------------------------------------------------------------


@pytest.mark.parametrize("given", [acceptance(False), True], ids=["path end", "given"])
def test_a_path_that_ends_where_it_starts_is_driven(given: bool) -> None:
    ride = Ride(on_path(20.0 * pi, curvature=0.1))
    last = ride.drive(60.0, docked, goal=ride.driver.path.end if given else None)
    assert last.docked
    assert ride.travelled > 2.0 * pi * (10.0 - 4.0)  # it may cut the bend, as far as the corridor lets it


# -- a mission that is over stands -----------------------------------------------------------------------


def in_motion(**step: Any) -> tuple[Ride, DockingMission]:
    controller = DockingController.in_area(HALL, CONFIG)
    mission = DockingMission(controller, [Dock(Pose2(25.0, 0.0, 0.0), **step), Wait(1.0)])
    return Ride(mission), mission


@pytest.mark.parametrize("ends", [MissionResult.CANCELLED, MissionResult.TIMED_OUT])
def test_a_mission_is_over_once_the_vehicle_stands(ends: MissionResult) -> None:
    ride, mission = in_motion(timeout=6.0 if ends is MissionResult.TIMED_OUT else 1e6)
    ride.drive(6.0 if ends is MissionResult.TIMED_OUT else 5.0)
    if ends is MissionResult.CANCELLED:
        mission.cancel()
    seen = []
    while not mission.over:
        assert ride.plant.time < 20.0
        command = ride.drive(0.05)
        assert command.mission is not None
        seen.append((command.mission.mission_result, abs(ride.plant.v) > 0.5))
    assert (ends, True) in seen
    assert abs(ride.plant.v) < 0.02
    assert mission.result is ends


# -- the deepest cause -----------------------------------------------------------------------------------


def test_a_stalled_vehicle_names_the_narrowing() -> None:
    narrow = Narrowing(12.0, 18.0, left=HALF + 0.055, right=-HALF - 0.055)
    last = Ride(on_path(25.0, narrowings=[narrow])).drive(60.0, lambda each: each.status is Status.STALLED)
    assert last.status is Status.STALLED
    assert "the boundaries leave 0.055 m on either side of the body" in last.diagnostics.reason


@pytest.mark.parametrize(
    ("driver", "obstacles", "says"),
    [
        (lambda: on_path(), [IN_FRONT], "obstacles[0] by 0.27 m at (3.54, "),
        (
            lambda: on_path(narrowings=[Narrowing(0.0, 3.0, left=HALF - 0.27)]),
            [],
            "the left boundary by 0.27 m at (",
        ),
        (
            lambda: DockingController.in_area(Area(boundary=HALL.boundary, obstacles=[IN_FRONT]), CONFIG),
            [],
            "area.obstacles[0] by 0.27 m at (3.54, ",
        ),
    ],
    ids=["an obstacle", "a boundary", "an obstacle of the area"],
)
def test_a_start_that_overlaps_something_says_what_where_and_how_deep(
    driver: Callable[[], DockingController], obstacles: list[Any], says: str
) -> None:
    last = Ride(driver()).drive(1.0, goal=END, obstacles=lambda _: obstacles)
    assert last.status is Status.BLOCKED
    assert f"the body overlaps {says}" in last.diagnostics.reason


# -- what holds the vehicle ------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("length", "thing", "where"),
    [
        (25.0, block(12.0, -4.0, 13.0, 4.0), "(12."),
        (15.0, block(13.0, HALF - 0.29, 18.5, HALF + 0.51), "(13."),
    ],
    ids=["across", "beside the path's end"],
)
def test_a_blocked_vehicle_names_what_fills_its_way_and_where_and_how_far(
    length: float, thing: Any, where: str
) -> None:
    ride = Ride(on_path(length))
    last = ride.drive(40.0, lambda each: each.status is Status.BLOCKED, obstacles=lambda _: [thing])
    assert last.status is Status.BLOCKED
    assert f"something blocks the route: obstacles[0] at {where}" in last.diagnostics.reason
    assert last.diagnostics.reason.endswith(" m ahead")


def test_a_contact_with_something_that_moves_is_named() -> None:
    def walker(plant: PlantState) -> list[Any]:
        return [square(9.25, -5.75 + 0.8 * plant.time, 0.5)]

    ride = Ride(on_path(25.0))
    first = ride.drive(10.0, lambda each: each.status is Status.BLOCKED, obstacles=walker)
    assert first.diagnostics.cause is Reason.CONTACT_AHEAD
    assert "m with obstacles[0] at (9.00, " in first.diagnostics.reason


def test_a_vehicle_that_waits_until_its_way_is_clear_says_what_was_in_it() -> None:
    ride = Ride(on_path(25.0))
    ride.drive(5.0)
    x = ride.plant.x + FRONT + 1.5
    ride.drive(0.05, obstacles=[block(x, -1.0, x + 1.0, 1.0)])
    waits = ride.drive(0.05, obstacles=[])
    assert waits.diagnostics.cause is Reason.WAITS_UNTIL_CLEAR
    assert "(last: contact in " in waits.diagnostics.reason
    assert "m with obstacles[0] at (" in waits.diagnostics.reason
