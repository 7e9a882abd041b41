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
from numba.core import config as numba_config

from estimation import Frame, GoalMeasurement
from geometry import Area, Pose2, compiled
from rti_mpcc import DockingController, GoalTracking, Reason, Source, Status, VehicleState
from rti_mpcc.recording import Recorder, replay
from rti_mpcc.route_planner.planner import RoutePlanning
from rti_mpcc.simulation.plant import PlantParameters, PlantState, advance, issue
from rti_mpcc.types import Array
from tests.rti_mpcc.docking_runs import granting
from tests.rti_mpcc.yards import BEYOND, BRISK, DOOR, ROOMS, START, YARD, Drive, Driver, block, put_down

LIMITS, ROUTE = BRISK.limits, BRISK.route
STILL = 0.02
"""Slower than this a vehicle stands [m/s]."""
WAITS = 1.5
"""So long some tests leave it without a goal that it can be driven to [s]."""
MAP = """image: hall.pgm
resolution: 0.5
origin: [-8.0, -8.0, 0.0]
negate: 0
occupied_thresh: 0.65
free_thresh: 0.2
"""


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
    assert not any(command.diagnostics.cause is Reason.MISTAKE for command in drive.commands), drive.reasons


def assert_stood(drive: Drive, begin: float, end: float) -> None:
    """At rest, and nothing else was asked of it."""
    while_ = drive.between(begin, end)
    assert np.abs(drive.states[while_, 3]).max() <= STILL
    assert np.abs(drive.commanded()[while_, 0]).max() <= STILL
    assert {command.source for command in drive.commands[while_]} == {Source.STANDSTILL}


def replans(driver: Driver) -> int:
    assert isinstance(driver.controller, DockingController)
    return driver.controller.replans


@pytest.fixture
def slices(monkeypatch: pytest.MonkeyPatch) -> list[RoutePlanning]:
    """The searches that were gone on with, slice by slice."""
    found: list[RoutePlanning] = []
    advance_ = RoutePlanning.advance

    def counted(self: RoutePlanning) -> None:
        found.append(self)
        advance_(self)

    monkeypatch.setattr(RoutePlanning, "advance", counted)
    return found


# -- to the goal ---------------------------------------------------------------------------------------------


def test_docks_from_a_map_in_ten_lines(tmp_path: Path) -> None:
    cells = np.full((32, 60), 254, dtype=np.uint8)  # 30 m by 16 m, with a wall that has a door
    cells[[0, -1]] = cells[:, [0, -1]] = cells[:13, 30:32] = cells[19:, 30:32] = 0
    (tmp_path / "hall.pgm").write_bytes(b"P5\n60 32\n255\n" + cells.tobytes())
    (tmp_path / "hall.yaml").write_text(MAP)
    # The ten lines.
    controller = DockingController.in_area(Area.from_map(tmp_path / "hall.yaml"), BRISK)
    parameters = PlantParameters.of(BRISK.vehicle, BRISK.limits, dead_time=BRISK.dead_time)
    plant = PlantState(x=0.0, y=0.0, phi=0.0)
    command = controller.step(plant.measured, now=0.0, goal=BEYOND)
    while not command.docked and plant.time < 40.0:
        plant = issue(
            plant, parameters, acceleration=command.acceleration, steering_rate=command.steering_rate
        )
        plant = advance(plant, parameters, plant.time + BRISK.cycle)
        command = controller.step(plant.measured, now=plant.time, goal=BEYOND)
    assert command.docked
    assert Pose2(plant.x, plant.y, plant.phi).relative_to(BEYOND).within((0.06, 0.06, 0.04))
    assert controller.manoeuvre is not None
    assert controller.manoeuvre.clearance > BRISK.clearance.least
    assert controller.path is not None
    assert controller.path.length == pytest.approx(controller.manoeuvre.length)
    assert controller.planning_seconds == pytest.approx(controller.manoeuvre.seconds, rel=1e-3)


@pytest.mark.parametrize(
    ("goal", "directions"),
    [
        (Pose2(-5.0, 0.0, 0.0), [-1]),
        pytest.param(Pose2(6.0, 3.0, pi / 2), None, marks=pytest.mark.acceptance),
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
    assert set(drive.reasons[before]) == {"planning a way: there is no goal yet"}


def test_without_a_goal_it_stands_and_says_so() -> None:
    driver = Driver(area=ROOMS, goal_at=lambda now: None)
    drive = driver.drive(1.0)
    assert_stood(drive, 0.0, 1.0)
    assert drive.statuses == [Status.PLANNING]
    assert isinstance(driver.controller, DockingController)
    assert (driver.controller.path, driver.controller.manoeuvre) == (None, None)
    assert (driver.controller.replans, driver.controller.planning_seconds) == (0, 0.0)


@pytest.mark.parametrize("off", [(0.0, 0.0, 0.0), (0.03, -0.04, 0.03)], ids=["exactly", "nearly"])
def test_a_vehicle_that_stands_in_its_goal_has_docked(off: tuple[float, float, float]) -> None:
    driver = Driver(area=ROOMS, goal_at=lambda now: START.compose(Pose2(*off)))
    drive = driver.drive(2.0)
    assert drive.statuses == [Status.PLANNING, Status.DOCKED]
    assert_stood(drive, 0.0, 2.0)
    assert_sane(drive)


# -- where there is no way -----------------------------------------------------------------------------------

IN_THE_WALL = Pose2(5.0, 4.0, 0.0)
TIGHT = Pose2(3.30, 4.0, 0.0)  # 0.02 m before the wall
NAN: Any = SimpleNamespace(x=float("nan"), y=4.0, phi=0.0)


@pytest.mark.parametrize(
    ("bad", "statuses", "said"),
    [
        (
            IN_THE_WALL,
            {Status.GOAL_REJECTED},
            "goal (5, 4, 0) out of reach, the body there crosses a boundary or obstacle by 1.68 m",
        ),
        (
            TIGHT,
            {Status.PLANNING, Status.STALLED},
            "the body at the goal (3.30, 4.00, 0.00) leaves 0.022 m, at least 0.05 m are kept",
        ),
        (NAN, {Status.GOAL_REJECTED}, "goal (nan, 4.0, 0.0) not finite"),
        (
            Pose2(500.0, 0.0, 0.0),
            {Status.GOAL_REJECTED},
            "goal (500, 0, 0) out of reach, it is beyond the boundary of the area",
        ),
    ],
    ids=["in a wall", "too near to one", "NaN", "outside"],
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
        (
            AROUND,
            Status.STALLED,
            "the body at the start (0.00, 0.00, 0.00) leaves 0.022 m, at least 0.05 m are kept, and no arc",
        ),
        (DOOR, Status.STALLED, "the nearest is 14.00 m from the goal"),
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


def test_for_a_goal_far_from_the_last_one_it_brakes_and_plans_anew() -> None:
    goal = Pose2(10.0, 4.0, 0.5)
    driver = Driver(area=YARD, goal_at=lambda now: BEYOND if now < 3.0 else goal)
    drive = driver.drive(40.0)
    assert_docked(drive, goal)
    assert replans(driver) == 1
    told = drive.commands[drive.between(3.0, 3.01)][0]
    assert (told.status, told.source) == (Status.PLANNING, Source.BRAKING)
    assert told.diagnostics.reason == "planning a way: the goal is elsewhere"
    braking = [command for command in drive.commands if command.source is Source.BRAKING]
    assert max(abs(command.acceleration) for command in braking) < 1.5 * BRISK.comfort_acceleration


def test_a_goal_near_the_last_one_is_driven_to_on_the_same_way() -> None:
    goal = Pose2(14.3, 0.4, 0.1)
    driver = Driver(area=YARD, goal_at=lambda now: BEYOND if now < 3.0 else goal)
    drive = driver.drive(40.0)
    assert_docked(drive, goal)
    assert replans(driver) == 0
    after = drive.between(3.0, 40.0)
    assert Status.PLANNING not in {command.status for command in drive.commands[after]}


def test_a_docked_vehicle_is_driven_to_another_goal() -> None:
    goals = [Pose2(6.0, 0.0, 0.0), Pose2(-2.0, 0.0, 0.0)]
    driver = Driver(area=YARD, goal_at=lambda now: goals[now >= 9.0])
    drive = driver.drive(40.0, after_docking=3.0)
    assert Status.DOCKED in {command.status for command in drive.commands[drive.between(0.0, 9.0)]}
    assert_docked(drive, goals[1])
    assert replans(driver) == 1


# -- what comes in the way -----------------------------------------------------------------------------------


def test_before_an_obstacle_that_appears_it_stops_and_plans_meanwhile_and_drives_round(
    slices: list[RoutePlanning],
) -> None:
    goal, appears, planned_while_driving = Pose2(16.0, 0.0, 0.0), 2.0, []
    box = block(8.0, -1.0, 9.0, 1.0)

    def obstacles_at(now: float) -> list[Array]:
        planned_while_driving.append(len(slices))
        return [box] if now >= appears else []

    driver = Driver(area=YARD, goal_at=lambda now: goal, obstacles_at=obstacles_at)
    drive = driver.drive(60.0)
    assert_docked(drive, goal)
    # It is too near to the box to go round it without a stop: the way begins there.
    assert replans(driver) == 1
    moving = np.abs(drive.states[:, 3]) > 0.1
    begun = np.diff([*planned_while_driving, len(slices)])[: len(moving)]
    while_stopping = moving & (drive.times > appears) & (begun > 0)
    assert while_stopping.any()
    assert begun[while_stopping].max() <= BRISK.route.slices
    stood = (drive.times > appears) & ~moving & (drive.states[:, 0] < 8.0 - BRISK.vehicle.front)
    assert 0.0 < stood.sum() * BRISK.cycle < 6.0  # it does not wait for the way


def test_what_fills_the_only_way_is_waited_for() -> None:
    comes, goes = 1.5, 9.0
    driver = Driver(area=ROOMS, obstacles_at=lambda now: [DOOR] if comes < now < goes else [])
    drive = driver.drive(60.0)
    assert_docked(drive)
    assert_stood(drive, 7.0, goes)
    waiting = drive.commands[drive.between(7.0, goes)]
    assert {command.status for command in waiting} == {Status.STALLED}
    assert {command.diagnostics.cause for command in waiting} == {Reason.NO_WAY}
    assert "that can be reached were looked at" in waiting[0].diagnostics.reason
    assert drive.states[drive.between(7.0, goes), 0].max() < 7.0 - BRISK.vehicle.front
    driving = np.abs(drive.states[:, 3]) > STILL
    assert driving[drive.between(goes + 1.0, goes + 1.5)].any()


def test_an_obstacle_beside_the_way_changes_nothing() -> None:
    cart = block(2.0, 4.0, 3.0, 5.0)
    driver = Driver(area=YARD, obstacles_at=lambda now: [cart] if now > 2.0 else [])
    drive = driver.drive(40.0)
    assert_docked(drive)
    assert replans(driver) == 0
    assert Status.BLOCKED not in drive.statuses


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


def test_set_down_elsewhere_before_it_drives_it_plans_from_there() -> None:
    there = Pose2(0.0, 3.0, -0.5)
    driver = Driver(
        area=ROOMS,
        goal_at=lambda now: BEYOND if now > 1.0 else None,
        moved=once(1.0, lambda plant: put_down(plant, there)),
    )
    drive = driver.drive(60.0)
    assert_docked(drive)
    assert_stood(drive, 0.0, 4.0)
    assert isinstance(driver.controller, DockingController)
    assert driver.controller.manoeuvre is not None
    assert driver.controller.manoeuvre.start.relative_to(there).within((0.01, 0.01, 0.01))


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


def wheels_at_begin(delta: float) -> tuple[Drive, float]:
    """A drive, and the angle that its first segment begins with [rad]."""
    driver = Driver(area=YARD, goal_at=lambda now: TURNED, delta=delta)
    drive = driver.drive(4.0)
    assert isinstance(driver.controller, DockingController)
    assert driver.controller.manoeuvre is not None
    wheels = driver.controller.manoeuvre.segments[0].wheels
    assert wheels is not None
    return drive, wheels


def test_wheels_are_turned_at_rest_where_a_segment_asks_for_it() -> None:
    drive, wheels = wheels_at_begin(0.5)
    turning = [command.diagnostics.cause is Reason.TURNS_WHEELS for command in drive.commands]
    assert any(turning)
    assert abs(wheels - 0.5) > BRISK.behaviour.wheels_off
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


def test_wheels_that_are_near_are_left_as_they_stand() -> None:
    _, wheels = wheels_at_begin(0.5)
    drive, same = wheels_at_begin(wheels)
    assert same == pytest.approx(wheels, abs=1e-6)
    assert Reason.TURNS_WHEELS not in {command.diagnostics.cause for command in drive.commands}
    assert np.abs(drive.states[:, 3]).max() > 0.5


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
        pytest.param((0.01, 0.01, 0.003, 0.01, 0.003), marks=pytest.mark.acceptance),
        (0.03, 0.03, 0.015, 0.01, 0.003),
    ],
    ids=["some", "much"],
)
def test_docks_with_a_state_that_is_noisy_and_begins_no_search_anew_for_it(
    stds: tuple[float, ...], slices: list[RoutePlanning]
) -> None:
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
    assert len({id(search) for search in slices}) <= 3


@pytest.mark.parametrize(
    "told", [True, pytest.param(False, marks=pytest.mark.acceptance)], ids=["planned beside it", "not told"]
)
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


# -- time, and the same again --------------------------------------------------------------------------------


@pytest.mark.parametrize("granted", [1, pytest.param(3, marks=pytest.mark.acceptance)])
def test_planning_takes_only_the_slices_that_a_cycle_grants_and_loses_none(
    granted: int, slices: list[RoutePlanning]
) -> None:
    unhurried = Driver(area=ROOMS)
    unhurried.drive(1.0)
    needed, taken = len(slices), [0]

    def clock_at(now: float) -> Any:
        taken.append(len(slices) - needed)
        return granting(granted)

    config = BRISK.model_copy(update={"deadline": 0.02})
    hurried = Driver(area=ROOMS, config=config, clock_at=clock_at)
    drive = hurried.drive(40.0)
    assert_docked(drive)
    assert len(slices) == 2 * needed
    assert np.diff(taken).max() == min(granted, ROUTE.slices_at_rest)
    assert len({id(search) for search in slices}) == 2
    for one, other in ((unhurried.controller, hurried.controller),):
        assert isinstance(one, DockingController)
        assert isinstance(other, DockingController)
        assert one.manoeuvre is not None
        assert other.manoeuvre is not None
        for a, b in zip(one.manoeuvre.segments, other.manoeuvre.segments, strict=True):
            np.testing.assert_array_equal(a.part.curvatures, b.part.curvatures)


def test_cycles_without_any_time_plan_nothing_and_what_was_planned_stays(
    slices: list[RoutePlanning],
) -> None:
    def clock_at(now: float) -> Any:
        return granting(0 if 0.25 < now < 1.0 else 1)

    counted: list[int] = []

    def obstacles_at(now: float) -> list[Array]:
        counted.append(len(slices))
        return []

    driver = Driver(area=ROOMS, clock_at=clock_at, obstacles_at=obstacles_at)
    drive = driver.drive(40.0)
    assert_docked(drive)
    begun = np.array(counted)
    waits = drive.between(0.35, 1.0)
    assert begun[waits][0] == begun[waits][-1] > 0
    assert_stood(drive, 0.0, 1.0)
    assert len({id(search) for search in slices}) == 1


def test_the_same_inputs_give_the_same_commands_to_the_bit() -> None:
    box = block(8.0, -1.0, 9.0, 1.0)
    drives = [
        Driver(area=YARD, obstacles_at=lambda now: [box] if now > 2.0 else []).drive(9.0) for _ in range(2)
    ]
    one, other = drives
    np.testing.assert_array_equal(one.commanded(), other.commanded())
    np.testing.assert_array_equal(one.states, other.states)
    assert one.reasons == other.reasons
    assert Status.PLANNING in one.statuses[1:]  # it has planned twice


def test_recorded_it_drives_the_same_and_a_replay_is_identical(tmp_path: Path) -> None:
    plain = Driver(area=ROOMS).drive(3.0)
    with Recorder(DockingController.in_area(ROOMS, BRISK), tmp_path / "run.jsonl") as recorder:
        recorded = Driver(area=ROOMS, controller=recorder).drive(3.0)
    np.testing.assert_array_equal(recorded.commanded(), plain.commanded())
    assert replay(tmp_path / "run.jsonl").identical


@pytest.mark.skipif(numba_config.DISABLE_JIT, reason="there is nothing compiled")
def test_all_kernels_are_ready_when_it_is_made(monkeypatch: pytest.MonkeyPatch) -> None:
    controller = DockingController.in_area(ROOMS, BRISK)
    assert compiled.load() == 0
    assert list(compiled.build()) == []

    def compiles(*_: Any) -> None:
        raise AssertionError("a kernel is compiled in a cycle")

    monkeypatch.setattr(compiled._Kernel, "compile", compiles)
    assert_sane(Driver(area=ROOMS, controller=controller, goal_at=lambda now: BEYOND).drive(1.0))


def test_settings_of_the_way_are_those_given() -> None:
    config = BRISK.model_copy(update={"route": ROUTE.model_copy(update={"final_straight": 30.0})})
    driver = Driver(area=YARD, config=config, goal_at=lambda now: TURNED)
    driver.drive(2.0)
    assert isinstance(driver.controller, DockingController)
    manoeuvre = driver.controller.manoeuvre
    assert manoeuvre is not None
    assert not manoeuvre.found
    assert manoeuvre.reason == "there is no straight way of 30.0 m into the goal"
    assert (manoeuvre.start, manoeuvre.goal) == (START, TURNED)
