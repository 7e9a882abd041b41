"""From a map to the dock: a controller in an area plans its way, and another one where it cannot get on."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import pi
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from estimation import Frame, GoalMeasurement
from geometry import Area, Pose2
from rti_mpcc import DockingController, GoalTracking, Reason, Source, Status, VehicleState
from rti_mpcc.simulation.plant import PlantState
from rti_mpcc.types import Array
from tests.lists import acceptance, some_of
from tests.rti_mpcc.docking_runs import granting
from tests.rti_mpcc.simulation.conftest import write_map
from tests.rti_mpcc.yards import BEYOND, BRISK, DOOR, ROOMS, START, YARD, Drive, Driver, block

LIMITS = BRISK.limits
STILL = 0.02
"""Slower than this a vehicle stands [m/s]."""
WAITS = 1.5
"""So long some tests leave it without a goal that it can be driven to [s]."""


def assert_docked(drive: Drive, goal: Pose2 = BEYOND, clearance: float = 0.04) -> None:
    """It stands in the goal, and came near nothing."""
    assert drive.docked, (drive.statuses, drive.reasons[-1])
    assert drive.error(goal).within((0.06, 0.06, 0.04)), drive.error(goal)
    assert drive.clearance.min() > clearance
    assert_sane(drive)


def assert_sane(drive: Drive) -> None:
    """What was commanded is finite and within the limits; each reason is one line."""
    commanded = np.abs(drive.commanded())
    assert np.isfinite(commanded).all()
    assert (commanded <= np.array([LIMITS.acceleration, LIMITS.steering_rate]) + 1e-9).all()
    assert all(len(reason.splitlines()) <= 1 for reason in drive.reasons)
    assert not any(command.diagnostics.cause is Reason.INTERNAL_ERROR for command in drive.commands), (
        drive.reasons
    )


def assert_stood(drive: Drive, begin: float, end: float) -> None:
    """At rest, and nothing else was asked of it."""
    while_ = drive.between(begin, end)
    assert np.abs(drive.states[while_, 3]).max() <= STILL
    assert np.abs(drive.commanded()[while_, 0]).max() <= STILL
    assert {command.source for command in drive.commands[while_]} == {Source.STANDSTILL}


def replans(driver: Driver) -> int:
    assert isinstance(driver.controller, DockingController)
    return driver.controller.replans


# -- to the goal ---------------------------------------------------------------------------------------------


def test_docks_from_a_map(tmp_path: Path) -> None:
    cells = np.full((32, 60), 254, dtype=np.uint8)  # 30 m by 16 m, with a wall that has a door
    cells[[0, -1]] = cells[:, [0, -1]] = cells[:13, 30:32] = cells[19:, 30:32] = 0
    controller = DockingController.in_area(Area.from_map(write_map(tmp_path, cells, 0.5, (-8, -8, 0))), BRISK)
    assert_docked(Driver(area=ROOMS, controller=controller).drive(40.0))
    assert controller.manoeuvre is not None
    assert controller.manoeuvre.clearance > 0.05
    assert controller.path is not None
    assert controller.path.length == pytest.approx(controller.manoeuvre.length)
    assert controller.planning_seconds == pytest.approx(controller.manoeuvre.seconds, rel=1e-3)


@pytest.mark.parametrize(
    ("goal", "directions"),
    [
        (Pose2(-5.0, 0.0, 0.0), [-1]),
        acceptance(Pose2(6.0, 3.0, pi / 2), None),
    ],
    ids=["behind", "turned"],
)
def test_docks_wherever_the_goal_is(goal: Pose2, directions: list[int] | None) -> None:
    driver = Driver(area=YARD, goal_at=lambda now: goal)
    assert_docked(driver.drive(40.0), goal)
    assert replans(driver) == 0
    assert isinstance(driver.controller, DockingController)
    assert driver.controller.manoeuvre is not None
    driven = [segment.part.direction for segment in driver.controller.manoeuvre.segments]
    assert directions is None or driven == directions


def test_a_goal_given_later_is_waited_for() -> None:
    driver = Driver(area=ROOMS, goal_at=lambda now: None if now < WAITS else BEYOND)
    drive = driver.drive(40.0)
    assert_docked(drive)
    assert_stood(drive, 0.0, WAITS)
    before = drive.between(0.0, WAITS)
    assert {command.status for command in drive.commands[before]} == {Status.PLANNING}
    assert set(drive.reasons[before]) == {"planning a route: there is no goal yet"}


@pytest.mark.parametrize("off", [(0.0, 0.0, 0.0), (0.03, -0.04, 0.03)], ids=["exactly", "nearly"])
def test_a_vehicle_that_stands_in_its_goal_has_docked(off: tuple[float, float, float]) -> None:
    driver = Driver(area=ROOMS, goal_at=lambda now: START.compose(Pose2(*off)))
    drive = driver.drive(2.0)
    assert drive.statuses == [Status.PLANNING, Status.DOCKED]
    assert_stood(drive, 0.0, 2.0)
    assert_sane(drive)


# -- where there is no way -----------------------------------------------------------------------------------

REJECTED = {Status.GOAL_REJECTED}
NAN: Any = SimpleNamespace(x=float("nan"), y=4.0, phi=0.0)


@pytest.mark.parametrize(
    ("bad", "statuses", "said"),
    [
        (Pose2(5.0, 4.0, 0.0), REJECTED, "goal (5, 4, 0) rejected: the body there crosses a boundary or"),
        (
            Pose2(3.3, 4.0, 0.0),
            {Status.PLANNING, Status.STALLED},
            "clearance of 0.022 m, at least 0.05",
        ),
        (NAN, REJECTED, "goal (nan, 4.0, 0.0) rejected: not finite"),
        acceptance(
            Pose2(500.0, 0.0, 0.0), REJECTED, "goal (500, 0, 0) rejected: outside the boundary of the"
        ),
        acceptance(Pose2(14.0, 500.0, 0.0), REJECTED, "goal (14, 500, 0) rejected: outside the boundary of"),
        (Pose2(14.0, 1e7, 0.0), REJECTED, "goal (14, 1e+07, 0) rejected"),
    ],
    ids=["in a wall", "too near to one", "NaN", "outside", "outside in y", "far outside in y"],
)
def test_a_goal_that_cannot_be_one_is_told_and_a_good_one_is_driven_to(
    bad: Pose2, statuses: set[Status], said: str
) -> None:
    driver = Driver(area=ROOMS, goal_at=lambda now: bad if now < WAITS else BEYOND)
    drive = driver.drive(40.0)
    assert_docked(drive)
    assert_stood(drive, 0.0, WAITS)
    before = drive.between(0.0, WAITS)
    assert {command.status for command in drive.commands[before]} == statuses
    assert said in drive.reasons[before][-1]


AROUND = np.array(
    [(-1.3, -0.5), (-0.83, -0.5), (-0.83, 1.2), (3.7, 1.2), (3.7, -0.5), (4.2, -0.5), (4.2, 1.7), (-1.3, 1.7)]
)
"""Round the left side of the start, 2 cm before the body and 3 cm behind it."""


@pytest.mark.parametrize(
    ("fills", "status", "said"),
    [
        (block(3.0, -0.5, 4.0, 0.5), Status.BLOCKED, "the body overlaps obstacles[0] by 0.68 m"),
        (AROUND, Status.STALLED, "has a clearance of 0.022 m, at least 0.05 m is required, and no arc"),
        (DOOR, Status.STALLED, "the nearest 14.00 m from the goal"),
    ],
    ids=["over the start", "too near on both ends", "in the door"],
)
def test_what_leaves_no_way_is_told_and_waited_for(fills: Array, status: Status, said: str) -> None:
    driver = Driver(area=ROOMS, obstacles_at=lambda now: [fills] if now < WAITS else [])
    drive = driver.drive(40.0)
    assert drive.docked
    assert drive.error(BEYOND).within((0.06, 0.06, 0.04))
    assert drive.clearance[drive.between(WAITS, 40.0)].min() > 0.04
    assert_sane(drive)
    assert_stood(drive, 0.0, WAITS)
    last = drive.commands[drive.between(0.0, WAITS)][-1]
    assert last.status is status
    assert said in last.diagnostics.reason


# -- another goal --------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("goal", "ways"),
    [
        (Pose2(10.0, 4.0, 0.5), 1),
        (Pose2(14.0, 0.0, pi / 2), 1),  # turned
        (Pose2(14.3, 0.4, 0.1), 0),  # near the last one
    ],
)
def test_for_another_goal_it_brakes_and_replans_but_not_for_one_near_the_last(goal: Pose2, ways: int) -> None:
    driver = Driver(area=YARD, goal_at=lambda now: BEYOND if now < 3.0 else goal)
    drive = driver.drive(60.0)
    assert_docked(drive, goal)
    assert replans(driver) == ways
    told = drive.commands[drive.between(3.0, 3.01)][0]
    if not ways:
        assert Status.PLANNING not in {command.status for command in drive.commands[60:]}
        return
    assert (told.status, told.source) == (Status.PLANNING, Source.BRAKING)
    assert told.diagnostics.reason == "planning a route: the goal has moved"
    braking = [command for command in drive.commands if command.source is Source.BRAKING]
    assert max(abs(command.acceleration) for command in braking) < 1.5 * BRISK.comfort_acceleration


# -- what comes in the way -----------------------------------------------------------------------------------


def test_before_an_obstacle_that_appears_it_stops_and_plans_meanwhile_and_drives_round() -> None:
    goal, appears, box = Pose2(16.0, 0.0, 0.0), 2.0, block(8.0, -1.0, 9.0, 1.0)
    driver = Driver(
        area=YARD, goal_at=lambda now: goal, obstacles_at=lambda now: [box] if now >= appears else []
    )
    drive = driver.drive(60.0)
    assert_docked(drive, goal)
    # It is too near to the box to go round it without a stop: the route begins there, or has a cusp.
    assert replans(driver) in (1, 2)
    stood = (drive.times > appears) & (np.abs(drive.states[:, 3]) <= 0.1)
    stood &= drive.states[:, 0] < 8.0 - BRISK.vehicle.front
    assert 0.0 < stood.sum() * BRISK.cycle < 6.0  # it does not wait for the route


@pytest.mark.parametrize(("appears", "gap"), [(2.0, 4.0), (2.5, 5.0)])
def test_no_route_is_joined_on_the_move_that_starts_in_reverse_or_with_too_short_a_segment(
    appears: float, gap: float
) -> None:
    """A wall leaves a gap on the left. Braking on such a route took 2.6 to 3.1 m/s²."""
    wide = Area(boundary=[(-10.0, -9.0), (30.0, -9.0), (30.0, 9.0), (-10.0, 9.0)])
    goal, wall = Pose2(22.0, 0.0, 0.0), block(9.0, -9.0, 10.0, 9.0 - gap)
    driver = Driver(
        area=wide, goal_at=lambda now: goal, obstacles_at=lambda now: [wall] if now >= appears else []
    )
    drive = driver.drive(50.0)
    assert_docked(drive, goal)
    assert np.abs(drive.commanded()[:, 0]).max() < 1.2 * BRISK.comfort_acceleration


def test_what_fills_the_only_way_is_waited_for() -> None:
    comes, goes = 1.5, 9.0
    driver = Driver(area=ROOMS, obstacles_at=lambda now: [DOOR] if comes < now < goes else [])
    drive = driver.drive(60.0)
    assert_docked(drive)
    assert_stood(drive, 7.0, goes)
    waiting = drive.commands[drive.between(7.0, goes)]
    assert {command.status for command in waiting} == {Status.STALLED}
    assert {command.diagnostics.cause for command in waiting} == {Reason.NO_ROUTE}
    assert "reachable nodes expanded" in waiting[0].diagnostics.reason
    assert drive.states[drive.between(7.0, goes), 0].max() < 7.0 - BRISK.vehicle.front
    driving = np.abs(drive.states[:, 3]) > STILL
    assert driving[drive.between(goes + 1.0, goes + 1.5)].any()


# -- set down elsewhere --------------------------------------------------------------------------------------


def once(at: float, change: Callable[[PlantState], PlantState]) -> Callable[[PlantState], PlantState]:
    """A change of the plant at one time [s]."""
    done: list[float] = []

    def moved(plant: PlantState) -> PlantState:
        if done or plant.time < at:
            return plant
        done.append(plant.time)
        return change(plant)

    return moved


def test_found_elsewhere_while_it_drives_it_stops_and_docks() -> None:
    """A localisation that jumps: what it believed before is given up after a while at rest."""
    driver = Driver(
        area=YARD, moved=once(3.0, lambda plant: replace(plant, x=0.0, y=-3.0, phi=plant.phi + 0.4))
    )
    drive = driver.drive(60.0)
    assert_docked(drive)
    doubted = drive.commands[drive.between(3.0, 3.01)][0]
    assert doubted.status is Status.FAILED
    assert "has jumped" in doubted.diagnostics.reason


# -- wheels --------------------------------------------------------------------------------------------------

TURNED = Pose2(6.0, 3.0, pi / 2)
"""For which the first segment begins with the wheels turned a little to the left."""


def test_wheels_are_turned_at_rest_where_a_segment_asks_for_it() -> None:
    driver = Driver(area=YARD, goal_at=lambda now: TURNED, delta=0.5)
    drive = driver.drive(4.0)
    assert isinstance(driver.controller, DockingController)
    assert driver.controller.manoeuvre is not None
    wheels = driver.controller.manoeuvre.segments[0].wheels
    assert wheels is not None
    turning = [command.diagnostics.cause is Reason.TURNS_WHEELS for command in drive.commands]
    assert any(turning)
    first = turning.index(True)
    last = len(turning) - turning[::-1].index(True)
    for command in drive.commands[first:last]:
        assert command.status is Status.STARTING
        assert command.source is Source.STANDSTILL
        assert command.diagnostics.reason == f"turning the wheels at rest to {wheels:.2f} rad"
        assert abs(command.steering_rate) <= BRISK.comfort_steering_rate + 1e-9
    assert np.abs(drive.states[first:last, 3]).max() <= STILL
    begins = int(np.argmax(np.abs(drive.states[:, 3]) > 0.1))
    assert abs(drive.states[begins, 4] - wheels) < 0.5 * abs(wheels - 0.5)


# -- far away, noise, detections -----------------------------------------------------------------------------


def test_a_billion_metres_away_it_drives_the_same() -> None:
    away = np.array([1e9, -1e9])
    assert ROOMS.boundary is not None
    there = Area(boundary=ROOMS.boundary + away, obstacles=[each + away for each in ROOMS.obstacles])
    goal = Pose2(1e9 + BEYOND.x, -1e9 + BEYOND.y, BEYOND.phi)
    far = Driver(area=there, start=Pose2(1e9, -1e9, 0.0), goal_at=lambda now: goal).drive(40.0)
    here = Driver(area=ROOMS).drive(40.0)
    assert_docked(far, goal)
    assert [status for status in far.statuses if status is not Status.STARTING] == here.statuses
    # Some of what is planned takes a slice more; from where it drives on it is the same.
    begins = [int(np.argmax(np.abs(drive.states[:, 3]) > 0.1)) for drive in (far, here)]
    count = min(len(drive.times) - begin for drive, begin in zip((far, here), begins, strict=True)) - 20
    one = far.states[begins[0] : begins[0] + count, :2] - away
    other = here.states[begins[1] : begins[1] + count, :2]
    assert np.abs(one - other).max() < 0.1


@pytest.mark.parametrize(
    "stds",
    [
        acceptance((0.01, 0.01, 0.003, 0.01, 0.003)),
        (0.03, 0.03, 0.015, 0.01, 0.003),
    ],
    ids=["some", "much"],
)
def test_docks_with_a_state_that_is_noisy(stds: tuple[float, ...]) -> None:
    random = np.random.default_rng(3)

    def measured(plant: PlantState) -> VehicleState:
        true = plant.measured
        values = np.array([true.x, true.y, true.phi, true.v, true.delta]) + random.normal(size=5) * stds
        return VehicleState(*values.tolist())

    driver = Driver(area=ROOMS, measured=measured, clock_at=lambda now: granting(40 if now > 3.0 else 1))
    drive = driver.drive(60.0)
    assert drive.docked
    assert drive.error(BEYOND).within((0.1, 0.1, 0.06))
    assert drive.clearance.min() > 0.0
    assert_sane(drive)
    assert replans(driver) <= 1


@pytest.mark.parametrize("told", some_of([True, False]), ids=["planned beside it", "not told"])
def test_docks_at_a_goal_that_is_detected(told: bool) -> None:
    planned = BEYOND.compose(Pose2(0.3, 0.26, 0.08)) if told else None  # 0.4 m off
    random = np.random.default_rng(4)

    def seen(now: float, plant: PlantState) -> list[GoalMeasurement]:
        at = BEYOND.relative_to(Pose2(plant.x, plant.y, plant.phi))
        off = random.normal(size=3) * [0.03, 0.03, 0.02] * np.hypot(at.x, at.y) / 10.0
        x, y, phi = at.x + off[0], at.y + off[1], at.phi + off[2]
        return [GoalMeasurement(stamp=now, x=x, y=y, phi=phi, frame=Frame.VEHICLE)]

    config = BRISK.model_copy(update={"goal_tracking": GoalTracking(required=True)})
    driver = Driver(area=ROOMS, config=config, goal_at=lambda now: planned, measurements_at=seen)
    drive = driver.drive(60.0)
    assert_docked(drive)
    assert replans(driver) == 0
