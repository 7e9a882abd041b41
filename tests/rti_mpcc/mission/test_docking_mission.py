"""Whole missions in closed loops with dead time: each kind of step, its ends, and what must never happen."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import groupby
from math import inf, nan
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from geometry import Area, Pose2
from rti_mpcc import ControllerConfig, DockingController, DockingMission, InputError, Source, Status
from rti_mpcc.mission import Approach, Dock, DockKind, DriveTo, Step, Straight, Undock, Wait
from rti_mpcc.mission.state import MissionState
from rti_mpcc.mission.step import MissionCycle, Started, StepOutcome, StepStart
from rti_mpcc.simulation.plant import PlantState
from rti_mpcc.types import MissionResult, VehicleState
from tests.lists import acceptance
from tests.rti_mpcc.docking_runs import straight
from tests.rti_mpcc.mission_runs import (
    CANCELLED,
    NOT_REACHED,
    RUNNING,
    SUCCEEDED,
    TIMED_OUT,
    assert_stays,
    driven,
    mission_in,
    results,
    seen_dock,
    stop_time,
)
from tests.rti_mpcc.yards import BRISK, CYCLE, DEAD_TIME, DOOR, ROOMS, START, YARD, Driver, block

AT_REST = VehicleState(x=0.0, y=0.0, phi=0.0, v=0.0, delta=0.0)
NEAR = Pose2(3.0, 0.0, 0.0)
DOCK = Pose2(5.0, 0.0, 0.0)
AHEAD = 5.0
"""The front of a vehicle at a pose is less far ahead of that [m]."""
BODY = [(AHEAD, -1.0), (7.0, -1.0), (7.0, 1.0), (AHEAD, 1.0)]
"""Of a dock that is driven to forward."""


# -- all goes well -------------------------------------------------------------------------------------------


def test_the_whole_sequence() -> None:
    """To the dock, a wait, straight on into contact, out again, and away: the body stays clear until then."""
    front = BRISK.vehicle.front
    touch = AHEAD - front
    body = Dock(DOCK, body=BODY).body_at(DOCK)
    steps: list[Step] = [
        Dock(DOCK, body=BODY, approach=Approach(1.0, 1)),
        Wait(1.0),
        Straight(touch + 0.05, speed=0.3, tolerance=(0.03, 0.02), until=lambda: False),
        Undock(-4.0),
        DriveTo(Pose2(0.0, 2.0, 0.0)),
    ]
    mission, place = mission_in(YARD, steps), [0.0]

    def measured(plant: PlantState) -> VehicleState:
        place[0] = plant.x
        return plant.measured

    touches = lambda now: place[0] >= DOCK.x + touch - 0.005  # noqa: E731
    drive = driven(mission, YARD, 60.0, measured=measured, signal=touches, standing_at=lambda now: [body])
    assert mission.result is SUCCEEDED
    kinds = [("dock", 0), ("wait", 1), ("straight", 2), ("undock", 3), ("drive_to", 4)]
    assert results(mission.log) == [(kind, k, 0, SUCCEEDED) for kind, k in kinds]
    dock, wait, move, out, away = mission.log
    assert (dock.goal, dock.dock, wait.goal, out.dock) == (DOCK, DOCK, None, None)
    assert wait.end is not None
    assert wait.end - wait.begin == pytest.approx(1.0, abs=1.5 * CYCLE)
    assert move.end is not None
    before, after = drive.between(0.0, move.begin), drive.between(move.end + 0.5, inf)
    assert drive.clearance[before].min() > touch - 0.1
    assert drive.clearance.min() < 0.01
    connecting = drive.between(0.0, move.end + 0.5)  # afterwards what it was docked at is no obstacle
    assert drive.states[connecting, 0].max() < DOCK.x + touch + 0.3 * (DEAD_TIME + 2.0 * CYCLE)
    assert len(drive.times[after]) > 0
    moving = drive.between(move.begin + 0.1, move.end)
    assert np.abs(drive.states[moving, 4]).max() <= 0.05 + 1e-3
    assert np.abs(drive.states[moving, 3]).max() <= 0.3 + 0.02
    assert drive.error(Pose2(0.0, 2.0, 0.0)).within((0.06, 0.06, 0.04))
    assert move.reason == "ended by its signal"
    for record, following in zip(mission.log, mission.log[1:], strict=False):
        assert record.end is not None
        assert record.begin < record.end <= following.begin
    assert away.goal == Pose2(0.0, 2.0, 0.0)


def test_a_command_reports_the_progress_of_the_mission() -> None:
    """A loop on the first success of a step ends after that step: the mission has a result of its own."""
    drive = driven(mission_in(YARD, [Wait(0.3), Dock(START)]), YARD, 5.0)
    reports = [command.mission for command in drive.commands if command.mission]
    assert len(reports) == len(drive.commands)
    said = [(each.step, each.kind, each.result, each.mission_result) for each in reports]
    assert [key for key, _ in groupby(said)] == [
        (0, "wait", RUNNING, RUNNING),
        (0, "wait", SUCCEEDED, RUNNING),
        (1, "dock", RUNNING, RUNNING),
        (1, "dock", SUCCEEDED, SUCCEEDED),
    ]


@pytest.mark.parametrize("shown", [0.0, 1.7e9, -50.0])
def test_times_count_from_the_first_cycle_whatever_the_clock_shows_then(shown: float) -> None:
    """A step begun in the first cycle is not taken to last since the clock's own zero."""
    mission = mission_in(YARD, [Wait(1.0), Dock(START, timeout=20.0)])
    drive = driven(mission, YARD, 10.0, shown=lambda now: shown + now)
    assert results(mission.log) == [("wait", 0, 0, SUCCEEDED), ("dock", 1, 0, SUCCEEDED)]
    wait = mission.log[0]
    assert wait.end is not None
    assert wait.end - wait.begin == pytest.approx(1.0, abs=1.5 * CYCLE)
    assert_stays(drive, 0.0)


@pytest.mark.parametrize("seconds", [None, 9.0])
def test_a_wait_ends_with_what_it_waits_for(seconds: float | None) -> None:
    now = [0.0]
    mission = mission_in(YARD, [Wait(seconds, until=lambda: now[0] >= 2.0), Wait(0.0)])
    driven(mission, YARD, 10.0, before=lambda time: now.__setitem__(0, time))
    assert mission.result is SUCCEEDED
    assert mission.log[0].end == pytest.approx(2.0, abs=2.0 * CYCLE)


def test_a_wait_whose_condition_raises_goes_on_until_its_timeout(caplog: pytest.LogCaptureFixture) -> None:
    def until() -> bool:
        raise KeyError("no such switch")

    mission = mission_in(YARD, [Wait(until=until, timeout=1.0)])
    driven(mission, YARD, 10.0)
    assert results(mission.log) == [("wait", 0, 0, TIMED_OUT)]
    assert mission.result is TIMED_OUT
    assert mission.mission_state.reason == "not over after 1 s"
    assert "`until` of a step raised" in caplog.text


# -- cancelled -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("steps", "at"),
    [
        ([Dock(DOCK)], 0.1),
        ([DriveTo(Pose2(5.0, 2.5, 0.3))], 4.0),
        ([Undock(5.0)], 3.0),
        acceptance([Straight(4.0, speed=1.0)], 2.0),
        acceptance([Wait(9.0)], 1.0),
        ([Wait(0.5), Straight(-3.0, speed=0.5)], 0.55),
    ],
    ids=["planning", "drive_to", "undock", "straight", "wait", "between"],
)
def test_a_cancelled_mission_ends_in_a_standstill_and_another_one_can_be_driven(
    steps: list[Step], at: float
) -> None:
    mission, speeds = mission_in(YARD, steps), [0.0]

    def measured(plant: PlantState) -> VehicleState:
        speeds.append(abs(plant.v))
        return plant.measured

    def before(now: float) -> None:
        if abs(now - at) < 0.5 * CYCLE:
            mission.cancel()

    drive = driven(mission, YARD, 30.0, before=before, measured=measured, after=6.0)
    assert mission.result is CANCELLED
    assert mission.log[-1].result is CANCELLED or mission.log[-1].result is SUCCEEDED
    cancelled = drive.between(at, inf)
    assert {command.status for command in drive.commands[cancelled]} == {Status.WAITING}
    unused_goal = [command.mission for command in drive.commands[cancelled] if command.mission]
    assert {each.mission_result for each in unused_goal} == {CANCELLED}
    assert {each.result for each in unused_goal} == {mission.log[-1].result}
    speed = abs(float(drive.states[drive.between(at, at + CYCLE), 3][0]))
    assert_stays(drive, at + stop_time(speed))
    # Another one on the same controller, from where that stands.
    x, y, phi = drive.states[-1, :3]
    back = Pose2(float(x) - 1.5, float(y), 0.0)
    again = DockingMission(mission.controller, [DriveTo(back), Wait(0.2)])
    later = float(drive.times[-1]) + 1.0
    there = driven(again, YARD, 30.0, start=Pose2(x, y, phi), shown=lambda now: later + now)
    assert again.result is SUCCEEDED
    assert there.error(back).within((0.06, 0.06, 0.04))


def test_to_cancel_before_the_first_cycle_or_after_the_end_does_no_harm() -> None:
    for step, result in ((Dock(DOCK), CANCELLED), (Wait(0.2), SUCCEEDED)):
        mission = mission_in(YARD, [step])
        if result is SUCCEEDED:
            driven(mission, YARD, 2.0)
        mission.cancel()
        command = mission.step(AT_REST, now=9.0)
        assert mission.result is result
        assert command.mission is not None
        assert command.mission.mission_result is result


# -- what fails ----------------------------------------------------------------------------------------------


def test_a_dock_that_is_never_detected() -> None:
    step = Dock(NEAR, kind=DockKind.DETECTED, patience=2.0, then="home")
    mission = mission_in(YARD, [step], home=START)
    drive = driven(mission, YARD, 40.0)
    assert results(mission.log) == [
        ("dock", 0, 0, MissionResult.NOT_DETECTED),
        ("drive_to", 0, 0, SUCCEEDED),
    ]
    assert mission.result is MissionResult.NOT_DETECTED
    last = drive.commands[-1].mission
    assert last is not None
    assert (last.result, last.mission_result) == (SUCCEEDED, MissionResult.NOT_DETECTED)
    assert drive.error(START).within((0.06, 0.06, 0.04))


@pytest.mark.parametrize("kind", [DockKind.DETECTED, DockKind.KNOWN])
def test_a_detected_dock_is_where_it_is_seen_and_a_known_one_where_it_is_said_to_be(kind: DockKind) -> None:
    seen = NEAR.compose(Pose2(0.2, 0.15, 0.03))
    mission = mission_in(YARD, [Dock(NEAR, kind=kind)])
    drive = driven(mission, YARD, 30.0, measurements_at=seen_dock(seen))
    assert mission.result is SUCCEEDED
    assert drive.error(seen if kind is DockKind.DETECTED else NEAR).within((0.06, 0.06, 0.04))


def test_a_way_that_is_filled_fails_after_its_patience_and_the_vehicle_drives_home() -> None:
    home = Pose2(-3.0, 0.0, 0.0)
    mission = mission_in(ROOMS, [Dock(Pose2(14.0, 0.0, 0.0), patience=3.0, then="home")], home=home)
    drive = driven(mission, ROOMS, 60.0, obstacles_at=lambda now: [DOOR] if now > 2.0 else [])
    (dock, home_run) = mission.log
    assert dock.result in (MissionResult.BLOCKED, NOT_REACHED)
    assert dock.reason
    assert home_run.result is SUCCEEDED
    assert mission.result is dock.result
    assert drive.error(home).within((0.06, 0.06, 0.04))
    assert drive.clearance.min() > 0.04


@pytest.mark.parametrize("planned", [True, False], ids=["planned", "along its path"])
def test_what_takes_too_long_is_tried_again_and_given_up_or_passed_over(planned: bool) -> None:
    """Without planned ways a step that is tried again goes on along the path."""
    config = BRISK if planned else ControllerConfig.paper(cycle=CYCLE, dead_time=0.18)
    controller = DockingController.in_area(YARD, config) if planned else on_path(config)
    goal = DOCK if planned else None
    steps: list[Step] = [Dock(goal, timeout=1.0, retries=1, then="continue"), Wait(0.2)]
    mission = DockingMission(controller, steps)
    drive = driven(mission, YARD if planned else WIDE, 20.0, config=config)
    assert results(mission.log) == [
        ("dock", 0, 0, TIMED_OUT),
        ("dock", 0, 1, TIMED_OUT),
        ("wait", 1, 0, SUCCEEDED),
    ]
    assert mission.result is SUCCEEDED
    if planned:
        assert_stays(drive, mission.log[-1].end or inf)


def test_a_straight_move_with_too_large_an_error_is_told_before_it_begins_and_docked_for_once_more() -> None:
    """Someone shoves it aside while it waits at the dock."""
    wide = Dock(DOCK, approach=Approach(1.0, 1), tolerance=(0.05, 0.05, 0.03), retries=1)
    move = Straight(0.5, speed=0.3, tolerance=(0.02, 0.0087), retries=1, retry_from=0)
    mission = mission_in(YARD, [wide, Wait(0.5), move])
    put: list[float] = []

    def moved(plant: PlantState) -> PlantState:
        if put or not (mission.log and mission.log[-1].kind == "wait"):
            return plant
        put.append(plant.time)
        return replace(plant, y=0.15)

    drive = driven(mission, YARD, 80.0, moved=moved)
    unused_goal = [record for record in mission.log if record.kind == "straight"]
    assert unused_goal[0].result is NOT_REACHED
    assert "too large to be corrected" in unused_goal[0].reason
    begun, ended = unused_goal[0].begin, unused_goal[0].end
    assert ended is not None
    assert ended - begun <= CYCLE
    kinds = [record.kind for record in mission.log]
    assert kinds == ["dock", "wait", "straight", "undock", "dock", "wait", "straight"]
    assert mission.log[3].result is SUCCEEDED
    assert unused_goal[1].result is SUCCEEDED
    assert mission.result is SUCCEEDED
    assert drive.error(DOCK.compose(Pose2(0.5, 0.0, 0.0))).within((0.02, 0.025, 0.01))


# -- goals that are told -------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("steps", "until"),
    [
        ([Dock()], 0.2),
        acceptance([Wait(0.5), Dock()], 0.2),
        acceptance([DriveTo(NEAR), Dock()], 0.2),
        ([DriveTo(NEAR), Dock()], inf),
    ],
    ids=["at once", "before a wait", "before another way", "always"],
)
def test_a_goal_that_is_told_is_that_of_the_next_dock_without_one(steps: list[Step], until: float) -> None:
    mission = mission_in(YARD, steps)
    drive = driven(mission, YARD, 40.0, goal_at=lambda now: DOCK if now < until else None)
    assert mission.result is SUCCEEDED
    assert drive.error(DOCK).within((0.06, 0.06, 0.04))
    assert (mission.log[-1].goal, mission.log[-1].dock) == (DOCK, DOCK)


def test_without_a_goal_a_dock_fails_after_another_step_and_waits_as_the_first_one() -> None:
    mission = mission_in(YARD, [DriveTo(Pose2(1.0, 0.0, 0.0)), Dock()])
    driven(mission, YARD, 20.0)
    assert mission.log[-1].reason == "no goal was given"
    assert mission.result is NOT_REACHED
    first = mission_in(YARD, [Dock(timeout=1.0)])
    drive = driven(first, YARD, 5.0)
    assert first.result is TIMED_OUT
    assert_stays(drive, 0.0)


ODD_GOALS: list[Any] = [
    5,
    "dock",
    SimpleNamespace(x=nan, y=0.0, phi=0.0),
    SimpleNamespace(x="1", y=0.0, phi=0.0),
    Pose2(1e300, 0.0, 0.0),
    Pose2(0.0, 0.0, 1e300),
]


@pytest.mark.parametrize("goal", ODD_GOALS, ids=repr)
def test_goals_that_are_none_do_no_harm(goal: Any) -> None:
    steps: list[Step] = [
        Dock(timeout=0.3, then="continue"),
        DriveTo(Pose2(0.1, 0.0, 0.0), timeout=0.5, then="continue"),
    ]
    mission = mission_in(YARD, [*steps, Dock(timeout=0.5)])
    driven(mission, YARD, 5.0, goal_at=lambda now: goal)
    assert mission.result in (TIMED_OUT, NOT_REACHED)
    assert mission.log[-1].place == 2


# -- on a given path -----------------------------------------------------------------------------------------


def on_path(config: ControllerConfig) -> DockingController:
    """On a straight path of 8 m in a corridor 3 m to both sides."""
    scenario = straight(1, 8.0)
    path = scenario.build_path()
    return DockingController(path, scenario.build_corridor(path), config)


WIDE = Area(boundary=[(-20.0, -8.0), (30.0, -8.0), (30.0, 8.0), (-20.0, 8.0)])


def test_on_a_given_path_it_docks_at_its_end_and_then_drives_planned_ways_in_the_corridor() -> None:
    back = Pose2(2.0, 0.5, 0.0)
    mission = DockingMission(on_path(BRISK), [Dock(), Wait(0.3), Undock(-3.0), DriveTo(back), Dock()])
    drive = driven(mission, WIDE, 80.0)
    assert mission.result is SUCCEEDED
    end = Pose2(8.0, 0.0, 0.0)
    assert [record.goal for record in mission.log if record.kind == "dock"] == [end, end]
    assert drive.error(end).within((0.06, 0.06, 0.04))
    assert np.abs(drive.states[:, 1]).max() + 0.5 * BRISK.vehicle.width < 3.0


@pytest.mark.parametrize(
    "step", [Straight(1.0), Undock(1.0), DriveTo(START), Dock(START)], ids=lambda step: step.word
)
def test_a_controller_that_drives_its_path_only_refuses_what_needs_planned_ways(step: Step) -> None:
    controller = on_path(ControllerConfig.paper(cycle=CYCLE, dead_time=0.18))
    with pytest.raises(InputError, match=r"steps\[1\]: needs planned routes"):
        DockingMission(controller, [Dock(), step])


# -- what stands at docks ------------------------------------------------------------------------------------

STANDS = Pose2(2.0, 0.0, 0.0)
"""A vehicle in this pose has docked already."""


@pytest.mark.parametrize("first", [True, False], ids=["after docking", "before it"])
def test_the_body_of_a_dock_is_kept_clear_of(first: bool) -> None:
    """It stands between the vehicle and the pose to drive to."""
    body, beyond = Dock(STANDS, body=BODY).body_at(STANDS), Pose2(14.0, 0.0, 0.0)
    assert body is not None
    drive_to, dock = DriveTo(beyond, timeout=40.0), Dock(STANDS, body=BODY, timeout=1.0, then="continue")
    mission = mission_in(YARD, [dock, drive_to] if first else [drive_to, dock])
    drive = driven(mission, YARD, 60.0, start=STANDS, standing_at=lambda now: [body])
    assert next(record.result for record in mission.log if record.kind == "drive_to") is SUCCEEDED
    assert drive.clearance.min() > 0.04
    assert drive.error(beyond).within((0.06, 0.06, 0.04)) or not first


def test_the_body_of_an_earlier_mission_is_no_obstacle_for_a_move_into_contact_with_it() -> None:
    """And nothing else is forgotten: the user tells obstacles once only."""
    cart = block(0.0, 5.0, 1.0, 6.0)
    first = mission_in(YARD, [Dock(STANDS, body=BODY)])
    driven(first, YARD, 5.0, start=STANDS, obstacles_at=lambda now: [cart])
    known = [each.outline for each in first.controller.state.area.tracked.obstacles]
    assert len(known) == 2
    touch = AHEAD - BRISK.vehicle.front
    move = Straight(touch + 0.05, speed=0.3, patience=3.0)
    again = DockingMission(first.controller, [Dock(STANDS, body=BODY), move])
    drive = driven(again, YARD, 30.0, start=STANDS, shown=lambda now: 20.0 + now)
    assert again.result is SUCCEEDED
    assert drive.states[-1, 0] == pytest.approx(STANDS.x + touch + 0.05, abs=0.02)
    (left,) = [each.outline for each in first.controller.state.area.tracked.obstacles]
    np.testing.assert_array_equal(left, cart)


def test_a_move_that_cannot_begin_leaves_the_body_an_obstacle() -> None:
    off = Pose2(2.0, 0.3, 0.0)
    dock = Dock(STANDS, body=BODY, tolerance=(0.5, 0.5, 0.5))
    mission = mission_in(YARD, [dock, Straight(1.0, tolerance=(0.01, 0.01))])
    driven(mission, YARD, 10.0, start=off)
    assert mission.result is NOT_REACHED
    assert len(mission.mission_state.standing) == 1
    assert len(mission.controller.state.area.tracked.obstacles) == 1


# -- whatever comes in ---------------------------------------------------------------------------------------


class Unreadable:
    """Obstacles that raise when they are looked at."""

    def __iter__(self) -> Iterator[Any]:
        raise RuntimeError("lost")


ODD_OBSTACLES: list[Any] = [
    None,
    [],
    [block(5.0, 5.0, 6.0, 6.0)],
    block(5.0, 5.0, 6.0, 6.0)[None],
    5,
    "walls",
    [None],
    [[(0.0, nan)]],
    {"a": 1},
    nan,
    Unreadable(),
]


@pytest.mark.parametrize("obstacles", ODD_OBSTACLES, ids=lambda each: type(each).__name__)
@pytest.mark.parametrize("body", [None, BODY], ids=["alone", "beside a body"])
def test_obstacles_of_any_kind_do_no_harm(obstacles: Any, body: Any) -> None:
    mission = mission_in(YARD, [Dock(STANDS, body=body), Wait(0.3)])
    for k in range(8):
        command = mission.step(replace(AT_REST, x=2.0), now=CYCLE * k, obstacles=obstacles)
        assert np.isfinite([command.acceleration, command.steering_rate]).all()
        assert command.mission is not None
    assert mission.result is RUNNING


ODD_STATES = [
    replace(AT_REST, x=nan),
    replace(AT_REST, v=inf),
    replace(AT_REST, phi=-inf),
    replace(AT_REST, y=1e300),
    replace(AT_REST, delta=nan),
]
STEPS: list[Callable[[], Step]] = [
    lambda: Dock(DOCK),
    lambda: Dock(),
    lambda: Wait(0.5),
    lambda: Straight(1.0),
    lambda: Undock(3.0),
    lambda: DriveTo(DOCK),
]


@pytest.mark.parametrize("step", STEPS, ids=["dock", "own dock", "wait", "straight", "undock", "drive_to"])
@pytest.mark.parametrize("good", [0, 6], ids=["from the first cycle", "later"])
def test_states_clocks_and_detections_of_any_kind_do_no_harm(step: Callable[[], Step], good: int) -> None:
    mission = mission_in(YARD, [step(), Wait(0.2)])
    odd_times: list[Any] = [nan, inf, "now", None, -5.0, 1e300, 0.0]
    odd_detections: list[Any] = [None, 5, [None], "seen"]
    sent = [mission.step(AT_REST, now=CYCLE * k) for k in range(good)]
    now = CYCLE * good
    for k, state in enumerate([*ODD_STATES, *[AT_REST] * len(odd_times)]):
        time = now if k < len(ODD_STATES) else odd_times[k - len(ODD_STATES)]
        sent.append(mission.step(state, now=time, measurements=odd_detections[k % len(odd_detections)]))
        now += CYCLE
    for command in sent:
        assert np.isfinite([command.acceleration, command.steering_rate]).all()
        assert abs(command.acceleration) <= BRISK.limits.acceleration
        assert isinstance(command.source, Source)
        assert command.mission is not None


class FaultyStart(Dock):
    """A user's dock that raises when it starts."""

    def start(self, at: StepStart) -> Started:
        raise ValueError("not\nexpected")


class FaultyJudge(Dock):
    """A user's dock that raises when it is judged after 2.5 s."""

    def judged(self, mission_state: MissionState, cycle: MissionCycle) -> StepOutcome:
        if cycle.now > 2.5:
            raise ValueError("not\nexpected")
        return super().judged(mission_state, cycle)


@pytest.mark.parametrize(("dock", "rest"), [(FaultyStart, 0.0), (FaultyJudge, 2.55 + stop_time(1.2))])
def test_an_internal_error_in_a_mission_ends_it_with_a_vehicle_that_stands(
    dock: type[Dock], rest: float, caplog: pytest.LogCaptureFixture
) -> None:
    mission = mission_in(YARD, [dock(DOCK), Wait(1.0)])
    drive = driven(mission, YARD, 6.0, after=3.0)
    assert mission.result is NOT_REACHED
    assert mission.mission_state.reason == "internal error: not expected"
    assert "internal error in a mission" in caplog.text
    assert_stays(drive, rest)
    last = drive.commands[-1].mission
    assert last is not None
    assert (last.result, last.reason) == (NOT_REACHED, "internal error: not expected")
    if dock is FaultyJudge:
        assert mission.log[-1].result is NOT_REACHED
        assert mission.log[-1].end is not None


# -- bad input -----------------------------------------------------------------------------------------------

FAR: list[tuple[list[Any], Any, str]] = [
    ([], None, "steps: a mission needs at least one"),
    ([Wait(1.0), "dock"], None, r"steps\[1\] = 'dock': must be a Step"),
    ([Wait(1.0, retry_from=1)], None, r"steps\[0\].retry_from = 1: must not be a later step"),
    ([Wait(1.0, then="home")], None, r"steps\[0\].then = 'home': the mission has no home"),
    ([Wait(1.0)], "home", "home = 'home': must be a Pose2 or a DriveTo"),
    ([Wait(1.0)], DriveTo(START, retry_from=0), "home.retry_from = 0: it has no place in the mission"),
    ([Wait(1.0)], Pose2(0.0, 0.0, 1e300), "home.pose = .*: its coordinates must be at most"),
    ([DriveTo(Pose2(1e300, 0.0, 0.0))], None, r"steps\[0\].pose = .*: its coordinates must be at most"),
    ([Dock(Pose2(0.0, 0.0, -1e300))], None, r"steps\[0\].pose = .*: its coordinates must be at most"),
]


@pytest.mark.parametrize(("steps", "home", "said"), FAR)
def test_missions_that_are_none_are_refused(steps: list[Any], home: Any, said: str) -> None:
    controller = DockingController.in_area(YARD, BRISK)
    with pytest.raises(InputError, match=said):
        DockingMission(controller, steps, home=home)
    assert controller.state.mission_state is None


def test_without_a_mission_nothing_is_said_of_one() -> None:
    drive = Driver(area=YARD, goal_at=lambda now: DOCK).drive(0.2)
    assert {command.mission for command in drive.commands} == {None}


# -- standing as it was told ---------------------------------------------------------------------------------


def test_a_vehicle_that_is_told_to_stand_does_not_creep_out_of_what_it_overlaps() -> None:
    """Not even where the settings allow that."""
    config, over = BRISK.model_copy(update={"escape_speed": 0.2}), block(3.6, -0.5, 4.2, 0.5)
    mission = mission_in(YARD, [Wait(3.0)], config=config)
    drive = driven(mission, YARD, 6.0, config=config, obstacles_at=lambda now: [over] if now > 0.5 else [])
    assert Status.BLOCKED in drive.statuses
    assert_stays(drive, 0.0)
    assert np.ptp(drive.states[:, 0]) < 1e-3


@pytest.mark.parametrize(
    "step", [Undock(3.0, timeout=1.0), Straight(1.0, patience=1.0)], ids=lambda s: s.word
)
def test_a_step_that_begins_at_rest_fails_where_that_is_never_known(step: Step) -> None:
    mission = mission_in(YARD, [step])
    for k in range(30):
        command = mission.step(replace(AT_REST, x=nan), now=CYCLE * k)
        assert np.isfinite([command.acceleration, command.steering_rate]).all()
    assert results(mission.log) == [(step.word, 0, 0, NOT_REACHED)]
    assert mission.mission_state.reason == "the vehicle does not come to rest"
    assert mission.log[0].begin == pytest.approx(1.0, abs=1.5 * CYCLE)


def test_a_step_that_times_out_on_the_way_brakes_in_comfort() -> None:
    mission = mission_in(YARD, [DriveTo(Pose2(14.0, 0.0, 0.0), timeout=4.0)])
    drive = driven(mission, YARD, 12.0, after=5.0)
    assert mission.result is MissionResult.TIMED_OUT
    assert drive.states[:, 3].max() > 1.0  # it was fast by then
    assert abs(drive.states[-1, 3]) < 0.02
    assert max(abs(command.acceleration) for command in drive.commands) < 1.2 * BRISK.comfort_acceleration
