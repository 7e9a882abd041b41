"""What is driven when there is no plan, when an input is unusable, and when the program itself goes wrong."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import product
from math import inf, nan, pi
from typing import Any

import numpy as np
import pytest

from benchmarks.encounters import on_lane
from geometry import CorridorError, Pose2
from rti_mpcc import ControllerConfig, Vehicle
from rti_mpcc.clock import CycleClock
from rti_mpcc.simulation import changed, docking_controller
from rti_mpcc.simulation.faults import FAILED
from rti_mpcc.simulation.plant import PlantState
from rti_mpcc.types import Command, Reason, Source, Status, VehicleState
from tests.lists import acceptance, in_fast_suite, some_of
from tests.rti_mpcc.docking_runs import Clocked, drive, granting, short
from tests.rti_mpcc.yards import YARD, Driver

Run = list[tuple[PlantState, Command]]
PLENTY = 40
STAYS = 2.0
"""So long a vehicle stays docked before its drive ends [s]."""


def during(run: Run, begin: float, end: float) -> Run:
    return [entry for entry in run if begin - 1e-6 <= entry[0].time < end - 1e-6]


def assert_finite(run: Run) -> None:
    values = [(c.acceleration, c.steering_rate, c.speed, c.steering) for _, c in run]
    assert np.isfinite(values).all()


# -- no plan ---------------------------------------------------------------------------------------------


def failing(begin: float, end: float, seconds: float) -> Run:
    """The short course; every QP fails from one time to another [s]."""

    def clock_at(now: float) -> CycleClock:
        return granting(PLENTY, stops=(FAILED,) * PLENTY if begin <= now + 1e-6 < end else ())

    controller = Clocked(docking_controller(short()), clock_at)
    return list(drive(short(), seconds, controller=controller, after_docking=STAYS))


def test_the_last_plan_is_driven_through_a_short_failure() -> None:
    usual, run = list(drive(short(), 6.0)), failing(5.0, 5.5, 30.0)
    failed = during(run, 5.0, 5.5)
    assert {command.source for _, command in failed} == {Source.SHIFTED_PLAN}
    assert all(command.diagnostics.failed and command.diagnostics.reason for _, command in failed)
    one, other = run[110][0], usual[110][0]
    assert np.hypot(one.x - other.x, one.y - other.y) <= 0.02
    assert run[-1][1].docked


def test_it_brakes_when_the_last_plan_is_too_old_and_resumes_afterwards() -> None:
    run = failing(5.0, 9.0, 30.0)
    shifted = [plant.time for plant, command in run if command.source is Source.SHIFTED_PLAN]
    assert shifted[0] == pytest.approx(5.0)
    assert shifted[-1] <= 6.05
    failed = {command.source for _, command in run if command.status is Status.FAILED}
    assert Source.BRAKING in failed
    assert failed <= {Source.BRAKING, Source.STANDSTILL}
    stands = during(run, 8.0, 9.0)
    assert max(abs(plant.v) for plant, _ in stands) <= 0.02
    assert_finite(run)
    assert run[-1][1].docked


def test_a_plan_is_not_driven_from_far_off_it() -> None:
    """A localisation that jumps while the QPs fail: the last plan is not shifted to there."""

    def clock_at(now: float) -> CycleClock:
        return granting(PLENTY, stops=(FAILED,) * PLENTY if now >= 4.99 else ())

    for turned in (0.25, -0.25):

        def turn(state: VehicleState, now: float, turned: float = turned) -> VehicleState:
            return replace(state, phi=state.phi + turned)

        controller = Clocked(docking_controller(short()), clock_at)
        run = list(drive(short(), 8.0, controller=Given(controller, told_from(5.1, turn))))
        ((_, command),) = during(run, 5.1, 5.15)
        assert command.source is Source.BRAKING
        assert "contact" not in command.diagnostics.reason
        assert abs(run[-1][0].v) <= 0.02


def test_without_a_first_plan_it_does_not_move_and_starts_once_there_is_one() -> None:
    run = failing(0.0, 3.0, 25.0)
    without = during(run, 0.0, 3.0)
    assert {command.status for _, command in without} == {Status.STARTING, Status.PLANNING}
    assert all(command.acceleration == 0.0 for _, command in without)
    assert run[-1][1].docked


# -- an error of the program -----------------------------------------------------------------------------


class Broken(CycleClock):
    """Asking for the time goes wrong: an error inside of a cycle, wherever the time counts."""

    def grants(self, least: float = 0.0) -> bool:
        raise ZeroDivisionError("made up\nin two lines")


@pytest.mark.parametrize(
    ("lasts", "dead_time"), in_fast_suite([(0.2, 0.5), (inf, 0.18)], product([0.2, inf], [0.18, 0.0, 0.5]))
)
def test_an_internal_error_brakes_and_the_next_cycle_resumes(
    lasts: float, dead_time: float, caplog: pytest.LogCaptureFixture
) -> None:
    scenario = short(dead_time=dead_time)

    def clock_at(now: float) -> CycleClock | None:
        return Broken() if 5.0 <= now + 1e-6 < 5.0 + lasts else None

    controller = Clocked(docking_controller(scenario), clock_at)
    run = list(drive(scenario, 25.0, controller=controller, after_docking=STAYS))
    wrong = during(run, 5.0, 5.2)
    assert {(command.status, command.source) for _, command in wrong} == {(Status.FAILED, Source.BRAKING)}
    what = "ZeroDivisionError: made up in two lines"
    assert wrong[0][1].diagnostics.reason == Reason.INTERNAL_ERROR.message.format(what)
    assert wrong[0][1].acceleration > 0.0  # it reverses
    assert "in a cycle" in caplog.text
    assert max(plant.v for plant, _ in run) <= 0.02  # its brakes do not drive it forwards
    assert_finite(run)
    if lasts == inf:
        assert all(abs(plant.v) <= 0.02 for plant, _ in during(run, 9.0, 25.0))
    else:
        assert run[104][1].source is Source.SOLUTION
        assert run[-1][1].docked


# -- unusable inputs -------------------------------------------------------------------------------------

STATE = VehicleState(x=1.0, y=2.0, phi=1.0, v=0.0, delta=0.0)


@pytest.mark.parametrize(("width", "half"), [(2.069, 1.0), (3.0, 1.4)])
def test_a_corridor_narrower_than_the_body_is_refused(width: float, half: float) -> None:
    with pytest.raises(CorridorError, match=rf"{2 * half:.3f} m wide .* {width:.3f} m"):
        on_lane(20.0, half, ControllerConfig(vehicle=Vehicle(width=width)))


@pytest.mark.parametrize(
    "outline", [np.zeros((0, 2)), [[5.0, nan], [6.0, 1.0], [6.0, 2.0]], [[5.0, 1.0, 0.0]] * 3]
)
def test_an_obstacle_that_cannot_be_one_stops_the_vehicle_and_says_why(outline: Any) -> None:
    controller = docking_controller(short())
    command = controller.step(STATE, now=0.0, obstacles=[np.array(outline)])
    assert (command.status, command.source) == (Status.FAILED, Source.STANDSTILL)
    assert command.diagnostics.reason.startswith("obstacles")
    assert "obstacles[0]" in command.diagnostics.reason
    kept = controller.step(STATE, now=0.05)
    assert (kept.status, kept.source) == (Status.FAILED, Source.STANDSTILL)  # no better ones were given since
    assert controller.step(STATE, now=0.1, obstacles=[]).source is Source.SOLUTION


class Blank:
    """A goal that a broken bridge hands over."""

    x, y, phi = nan, 1.0, 2.0


@pytest.mark.parametrize(
    "odd", [Blank(), Pose2(1e9, 0.0, 0.0), Pose2(0.0, 0.0, 1e9)], ids=["NaN", "far", "turns"]
)
def test_an_odd_goal_is_not_taken_and_the_last_one_stays(odd: Any) -> None:
    controller, goal = docking_controller(short()), short().goal_pose()
    controller.step(STATE, now=0.0, goal=goal)
    command = controller.step(STATE, now=0.05, goal=odd)
    assert command.source is Source.SOLUTION
    assert "keeping the previous goal" in command.diagnostics.reason
    assert (command.diagnostics.target.x, command.diagnostics.target.y) == pytest.approx((goal.x, goal.y))


@pytest.mark.parametrize(
    ("told", "said"),
    [
        ({"goal": (1, 2, 3)}, "goal rejected: expected Pose2, got tuple"),
        ({"goal": "x"}, "goal rejected: expected Pose2, got str"),
        ({"measurements": [(1, 2, 3)]}, "measurements[0] ignored: expected GoalMeasurement, got tuple"),
        ({"measurements": 5}, "measurements ignored: expected a sequence, got int"),
        ({"measurements": None}, ""),
        ({"state": None}, "expected VehicleState, got None"),
        ({"state": (1.0, 2.0)}, "expected VehicleState, got tuple"),
        ({"state": replace(STATE, phi="east")}, "state.phi is not a number: 'east'"),  # type: ignore[arg-type]
        ({"now": nan}, "clock"),
    ],
)
def test_an_input_of_another_type_is_ignored_and_named(told: dict[str, Any], said: str) -> None:
    arguments: dict[str, Any] = {"state": STATE, "now": 0.0} | told
    command = docking_controller(short()).step(arguments.pop("state"), **arguments)
    assert said in command.diagnostics.reason
    assert ("goal" in told) == (command.status is Status.GOAL_REJECTED)
    if "measurements" in told:
        assert command.source is Source.SOLUTION


@pytest.mark.parametrize(
    "shown",
    [lambda now: now - 100.0, acceptance(lambda now: now + 1e5), lambda now: 5.0, lambda now: nan],
    ids=["back", "ahead", "still", "NaN"],
)
def test_a_clock_that_goes_wrong_is_said_and_the_vehicle_docks_nevertheless(
    shown: Callable[[float], float],
) -> None:
    run = driven_with(25.0, lambda state, now: {"now": shown(now)} if now >= 5.0 else {})
    assert run[-1][1].docked
    assert any("clock" in command.diagnostics.reason for _, command in during(run, 5.0, 6.0))
    assert max(abs(command.acceleration) for _, command in run) <= 1.0


def test_obstacles_that_are_not_readable_stop_a_moving_vehicle_until_some_are() -> None:
    broken = [[[5.0, nan], [6.0, 1.0], [6.0, 2.0]]]

    def tell(state: VehicleState, now: float) -> dict[str, Any]:
        return {"obstacles": broken} if abs(now - 5.0) < 0.01 else {"obstacles": []} if now >= 10.0 else {}

    run = driven_with(30.0, tell)
    assert all(abs(plant.v) <= 0.02 for plant, _ in during(run, 8.0, 10.0))
    assert run[-1][1].docked


# -- measured states -------------------------------------------------------------------------------------


class Given:
    """A controller whose inputs are changed: `tell` gives those that differ."""

    def __init__(self, controller: Any, tell: Callable[[VehicleState, float], dict[str, Any]]) -> None:
        self.controller, self._tell = controller, tell

    def step(self, state: VehicleState, *, now: float, **inputs: Any) -> Command:
        told: dict[str, Any] = {"state": state, "now": now} | inputs | self._tell(state, now)
        command: Command = self.controller.step(told.pop("state"), **told)
        return command


def driven_with(seconds: float, tell: Callable[[VehicleState, float], dict[str, Any]]) -> Run:
    controller = Given(docking_controller(short()), tell)
    return list(drive(short(), seconds, controller=controller, after_docking=STAYS))


Spoil = Callable[[VehicleState, float], VehicleState]


def told_from(
    begin: float, spoil: Spoil, end: float = inf
) -> Callable[[VehicleState, float], dict[str, Any]]:
    """Measured states are spoiled from one time to another [s]."""
    return lambda state, now: {"state": spoil(state, now)} if begin <= now + 1e-6 < end else {}


def frozen() -> Spoil:
    """The first one is measured again and again."""
    kept: list[VehicleState] = []

    def spoil(state: VehicleState, now: float) -> VehicleState:
        kept.append(state)
        return kept[0]

    return spoil


ONE_CYCLE: dict[str, tuple[Spoil, str]] = {
    "NaN": (lambda s, t: replace(s, x=nan), "not a finite state"),
    "infinite": (lambda s, t: replace(s, v=-inf), "not a finite state"),
    "huge": (lambda s, t: replace(s, y=1e300), "not a state"),
    "aside": (lambda s, t: replace(s, x=s.x + 0.4), "position by 0.40 m"),
    "turned": (lambda s, t: replace(s, phi=s.phi + 0.5), "heading by 0.50 rad"),
    "faster": (lambda s, t: replace(s, v=s.v - 1.5), "leapt by -1.50 m/s"),
    "steered": (lambda s, t: replace(s, delta=s.delta + 0.5), "steering by 0.50 rad"),
    "another branch": (lambda s, t: replace(s, phi=s.phi + 2.0 * pi), ""),
    "a little aside": (lambda s, t: replace(s, x=s.x + 0.1), ""),
    "a little turned": (lambda s, t: replace(s, phi=s.phi + 0.1), ""),
}


IN_KIND = ("NaN", "aside", "faster", "steered", "another branch", "a little aside")


@pytest.mark.parametrize("name", in_fast_suite(IN_KIND, ONE_CYCLE))
def test_a_state_that_cannot_be_is_doubted_and_the_next_one_is_believed(name: str) -> None:
    spoil, said = ONE_CYCLE[name]
    run = driven_with(5.2, told_from(5.0, spoil, 5.05))
    told = run[100][1]
    assert said in told.diagnostics.reason
    assert bool(told.diagnostics.reason) == bool(said)
    assert told.source is (Source.SHIFTED_PLAN if said and name != "faster" else Source.SOLUTION)
    assert np.isfinite([told.acceleration, told.steering_rate, told.speed, told.steering]).all()
    assert run[-1][1].source is Source.SOLUTION


LASTING: dict[str, tuple[Callable[[], Spoil], str]] = {
    "all NaN": (lambda: lambda s, t: VehicleState(nan, nan, nan, nan, nan), "not a finite state"),
    "frozen": (frozen, "does not change"),
    "steering in degrees": (lambda: lambda s, t: replace(s, delta=57.3 * s.delta), "not a state"),
    "too fast": (lambda: lambda s, t: replace(s, v=31.0), "not a state"),
    "too fast backwards": (lambda: lambda s, t: replace(s, v=-31.0), "not a state"),
    "to and fro": (lambda: lambda s, t: replace(s, y=s.y + 3.0 + 2.0 * (round(t / 0.05) % 2)), "position by"),
}


@pytest.mark.parametrize("name", some_of(LASTING))
def test_a_vehicle_that_is_measured_wrongly_stops_and_says_why_and_resumes_afterwards(name: str) -> None:
    made, said = LASTING[name]
    run = driven_with(30.0, told_from(5.0, made(), 9.0))
    assert all(plant.v <= 0.02 for plant, _ in run)  # it reverses, and never drives the other way
    stopped = during(run, 8.0, 9.0)
    assert {command.status for _, command in stopped} == {Status.FAILED}
    assert any(said in command.diagnostics.reason for _, command in during(run, 5.0, 9.0))
    assert all(abs(plant.v) <= 0.02 for plant, _ in stopped)
    assert_finite(run)
    assert run[-1][1].docked, run[-1][1].diagnostics.reason


def test_a_vehicle_that_does_not_move_as_commanded_is_named_and_not_driven_any_more() -> None:
    """It may be the measurement, or the vehicle: it is tried again a few times."""
    controller = docking_controller(short())
    commands = [controller.step(STATE, now=0.05 * k) for k in range(240)]
    assert any("does not change" in command.diagnostics.reason for command in commands[:40])
    assert sum(command.source is Source.SOLUTION for command in commands) < 48
    assert commands[-1].source is Source.STANDSTILL


def test_a_vehicle_that_starts_with_a_frozen_state_is_doubted_before_it_is_fast() -> None:
    scenario = changed(short(), {"controller.comfort_acceleration": 2.0, "controller.comfort_jerk": 10.0})
    run = list(drive(scenario, 2.0, controller=Given(docking_controller(scenario), told_from(0.0, frozen()))))
    doubted = next(plant for plant, command in run if "does not change" in command.diagnostics.reason)
    assert abs(doubted.v) < 0.6


def test_after_a_gap_without_cycles_the_state_is_taken_as_it_is() -> None:
    controller = docking_controller(short())
    for k in range(5):
        controller.step(STATE, now=0.05 * k)
    command = controller.step(replace(STATE, y=2.5), now=5.0)
    assert command.status is not Status.FAILED
    assert "position by" not in command.diagnostics.reason


def test_lost_cycles_do_not_hurry_an_arrival() -> None:
    controller = docking_controller(short())
    for now in (0.0, 2.0, 5.0, 10.0, 30.0):
        command = controller.step(STATE, now=now)
        assert abs(command.acceleration) <= controller.config.comfort_acceleration


def test_a_vehicle_that_starts_in_its_goal_is_docked_at_once() -> None:
    goal = short().goal_pose()
    state = VehicleState(x=goal.x + 0.02, y=goal.y, phi=goal.phi, v=0.0, delta=0.3)
    command = docking_controller(short()).step(state, now=0.0, goal=goal)
    assert (command.docked, command.acceleration, command.steering_rate) == (True, 0.0, 0.0)


def test_after_lost_cycles_a_heading_is_doubted_that_no_steering_makes() -> None:
    """0.7 s without cycles at 1.5 m/s: it may have turned by 0.25 rad more, as sharply as it can."""

    def measured(plant: PlantState) -> VehicleState:
        state = plant.measured
        return replace(state, phi=state.phi + 0.65) if plant.time >= 2.99 else state

    driver = Driver(area=YARD, measured=measured, lost=lambda now: 2.3 <= now < 2.99)
    drive = driver.drive(3.1)
    assert any("heading by 0.6" in reason for reason in drive.reasons[-2:]), drive.reasons[-2:]
    assert drive.states[-1, 3] > 1.0
