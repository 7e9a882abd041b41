"""What is driven when no plan is fit to be driven, and what `DockingController` refuses."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import inf, nan
from typing import Any

import numpy as np
import pytest

from geometry import Corridor, CorridorError, InputError, Pose2, ReferencePath
from rti_mpcc import ControllerConfig, DockingController, Vehicle
from rti_mpcc.planning import search, sensing
from rti_mpcc.planning.search import SqpResult
from rti_mpcc.safety import decision
from rti_mpcc.safety.fallback import PLAN_LIFE
from rti_mpcc.simulation import docking_controller
from rti_mpcc.simulation.plant import PlantState, advance, issue
from rti_mpcc.types import Command, Reason, Source, Status, VehicleState
from tests.rti_mpcc.docking_runs import drive, short

Fail = Callable[[float, float], None]
REFUSED = "the QP was not solved: made up"


@pytest.fixture
def fail(monkeypatch: pytest.MonkeyPatch) -> Fail:
    """Refuse all that is found from one time to another [s]."""
    found = search.converge

    def between(begin: float, end: float) -> None:
        def converge(mpcc: Any, s: Any, context: Any, guess: Any, clock: Any) -> SqpResult:
            attempt = found(mpcc, s, context, guess, clock)
            if not begin <= context.now < end:
                return attempt
            refused = tuple(replace(each, solved=False, status="made up") for each in attempt.solutions)
            return SqpResult(solutions=refused, problem=REFUSED, corridor_infeasible=False)

        monkeypatch.setattr(search, "converge", converge)

    return between


def between(
    run: list[tuple[PlantState, Command]], begin: float, end: float
) -> list[tuple[PlantState, Command]]:
    return [entry for entry in run if begin - 1e-6 <= entry[0].time < end - 1e-6]


def finite(run: list[tuple[PlantState, Command]]) -> bool:
    return all(np.isfinite([c.acceleration, c.steering_rate, c.speed, c.steering]).all() for _, c in run)


def test_the_last_plan_is_driven_on_through_a_short_failure(fail: Fail) -> None:
    usual = list(drive(short(), 6.0))
    fail(5.0, 5.5)
    run = list(drive(short(), 30.0))
    during = between(run, 5.0, 5.5)
    assert {command.source for _, command in during} == {Source.SHIFTED_PLAN}
    assert all(command.diagnostics.failed for _, command in during)
    assert all(command.diagnostics.reason == REFUSED for _, command in during)
    # It was a good plan: nothing else happens than would have happened.
    one, other = run[int(5.5 / 0.05)][0], usual[int(5.5 / 0.05)][0]
    assert np.hypot(one.x - other.x, one.y - other.y) <= 0.02
    assert run[-1][1].docked


@pytest.mark.acceptance
def test_it_brakes_when_the_plan_is_too_old_and_goes_on_afterwards(fail: Fail) -> None:
    fail(5.0, 9.0)
    run = list(drive(short(), 30.0))
    shifted = [plant.time for plant, command in run if command.source is Source.SHIFTED_PLAN]
    assert shifted[0] == pytest.approx(5.0)
    assert shifted[-1] <= 5.0 + PLAN_LIFE
    failed = [(plant, command) for plant, command in run if command.status is Status.FAILED]
    assert failed
    assert {command.source for _, command in failed} <= {Source.BRAKING, Source.STANDSTILL}
    assert abs(run[int(8.9 / 0.05)][0].v) <= 0.02
    assert run[int(8.9 / 0.05)][1].source is Source.STANDSTILL
    assert finite(run)
    assert run[-1][1].docked


@pytest.mark.acceptance
def test_without_a_first_plan_it_does_not_move(fail: Fail) -> None:
    fail(0.0, inf)
    run = list(drive(short(), 3.0))
    # Once it has stood for a while it asks for another way, and its first plan fails as well.
    assert {command.status for _, command in run} == {Status.STARTING, Status.PLANNING}
    assert all(command.acceleration == 0.0 for _, command in run)
    assert any(REFUSED in command.diagnostics.reason for _, command in run)
    assert not run[-1][1].docked


@pytest.mark.acceptance
def test_it_begins_as_soon_as_a_first_plan_is_found(fail: Fail) -> None:
    fail(0.0, 1.0)
    run = list(drive(short(), 22.0))
    assert {command.status for _, command in between(run, 0.0, 1.0)} <= {Status.STARTING, Status.PLANNING}
    # Its wheels are turned at rest for the way that was planned meanwhile.
    drives = next(plant.time for plant, command in run if command.status is Status.ARRIVING)
    assert drives <= 3.0
    assert run[-1][1].docked


# -- refused ---------------------------------------------------------------------------------------------

PATH = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(1, 0.0, 20.0)])


@pytest.mark.parametrize(("width", "half"), [(2.069, 1.0), (3.0, 1.4)])
def test_a_corridor_narrower_than_the_body_is_refused(width: float, half: float) -> None:
    corridor = Corridor.from_offsets(PATH, left=half, right=-half)
    with pytest.raises(CorridorError, match=rf"{2 * half:.3f} m wide .* {width:.3f} m"):
        DockingController(PATH, corridor, ControllerConfig(vehicle=Vehicle(width=width)))


@pytest.mark.parametrize("value", [nan, inf])
@pytest.mark.parametrize("field", ["x", "y", "phi"])
def test_a_goal_that_is_not_finite_cannot_be_made(field: str, value: float) -> None:
    with pytest.raises(InputError, match=rf"{field} = {value}"):
        Pose2(**{"x": 0.0, "y": 0.0, "phi": 0.0, field: value})


@pytest.mark.parametrize(
    "outline", [np.zeros((0, 2)), [[5.0, nan], [6.0, 1.0], [6.0, 2.0]], [[5.0, 1.0, 0.0]] * 3]
)
def test_an_obstacle_that_cannot_be_one_stops_the_vehicle_and_says_why(outline: Any) -> None:
    controller = docking_controller(short())
    start = short().build_path().start
    state = VehicleState(x=start.x, y=start.y, phi=start.phi, v=0.0, delta=0.0)
    command = controller.step(state, now=0.0, obstacles=[np.array(outline)])
    assert (command.status, command.source) == (Status.FAILED, Source.STANDSTILL)
    assert command.diagnostics.reason.startswith("obstacles")
    assert "obstacles[0]" in command.diagnostics.reason
    kept = controller.step(state, now=0.05)
    assert (kept.status, kept.source) == (Status.FAILED, Source.STANDSTILL)  # nothing better was told since
    assert controller.step(state, now=0.1, obstacles=[]).source is Source.SOLUTION


class Blank:
    """A goal that a broken bridge hands over."""

    x, y, phi = nan, 1.0, 2.0


def test_a_goal_that_is_not_finite_is_not_taken_and_the_last_one_stays() -> None:
    scenario = short()
    path, goal = scenario.build_path(), scenario.goal_pose(scenario.build_path())
    controller = docking_controller(scenario)
    state = VehicleState(x=path.start.x, y=path.start.y, phi=path.start.phi, v=0.0, delta=0.0)
    controller.step(state, now=0.0, goal=goal)
    blank: Any = Blank()
    for told in (blank, Pose2(1e9, 0.0, 0.0), Pose2(0.0, 0.0, 1e9)):
        command = controller.step(state, now=0.05, goal=told)
        assert command.source is Source.SOLUTION
        assert "the last one stays" in command.diagnostics.reason
        assert command.diagnostics.aim.x == pytest.approx(goal.x)
        assert command.diagnostics.aim.y == pytest.approx(goal.y)


@pytest.mark.parametrize("field", ["x", "y", "phi", "v", "delta"])
@pytest.mark.parametrize("value", [nan, inf])
def test_a_state_that_is_not_finite_brakes_and_says_so(field: str, value: float) -> None:
    controller = docking_controller(short())
    good = VehicleState(x=1.0, y=2.0, phi=1.0, v=0.0, delta=0.0)
    controller.step(good, now=0.0)
    command = controller.step(replace(good, **{field: value}), now=0.05)
    assert command.status is Status.FAILED
    assert "finite" in command.diagnostics.reason
    assert np.isfinite([command.acceleration, command.steering_rate, command.speed, command.steering]).all()
    assert controller.step(good, now=0.1).source is Source.SOLUTION


@pytest.mark.parametrize(
    ("told", "said"),
    [
        ({"goal": (1, 2, 3)}, "goal is no Pose2 but a tuple"),
        ({"goal": "x"}, "goal is no Pose2 but a str"),
        ({"measurements": [(1, 2, 3)]}, "measurements[0] is no GoalMeasurement but a tuple, left out"),
        ({"measurements": 5}, "measurements are no sequence but int, left out"),
        ({"measurements": None}, ""),
        ({"state": None}, "state is no VehicleState but None"),
        ({"state": (1.0, 2.0)}, "state is no VehicleState but a tuple"),
    ],
)
def test_what_is_of_another_type_is_left_out_and_said(told: dict[str, Any], said: str) -> None:
    start = short().build_path().start
    state = VehicleState(x=start.x, y=start.y, phi=start.phi, v=0.0, delta=0.0)
    arguments: dict[str, Any] = {"state": state, "now": 0.0} | told
    command = docking_controller(short()).step(arguments.pop("state"), **arguments)
    assert command.diagnostics.reason.endswith(said)
    assert ("goal" in told) == (command.status is Status.GOAL_REJECTED)
    if "measurements" in told:
        assert command.source is Source.SOLUTION


def test_lost_cycles_do_not_hurry_an_arrival() -> None:
    controller = docking_controller(short())
    good = VehicleState(x=1.0, y=2.0, phi=1.0, v=0.0, delta=0.0)
    for now in (0.0, 2.0, 5.0, 10.0, 30.0):
        assert abs(controller.step(good, now=now).acceleration) <= controller.config.comfort_acceleration


class Blinded(DockingController):
    """Gets no measurement between two times [s]."""

    between = (5.0, 9.0)

    def step(self, state: VehicleState, *, now: float, **inputs: Any) -> Command:
        blind = self.between[0] <= now < self.between[1]
        return super().step(replace(state, x=nan, v=nan) if blind else state, now=now, **inputs)


def test_a_vehicle_that_is_not_measured_stops_and_stays_and_goes_on_afterwards() -> None:
    scenario = short()
    path = scenario.build_path()
    blinded = Blinded(path, scenario.build_corridor(path), scenario.controller_config())
    run = list(drive(scenario, 30.0, controller=blinded))
    assert all(plant.v <= 1e-3 for plant, _ in run)  # it reverses, and never goes the other way
    stopped = between(run, 8.0, 9.0)
    assert {command.status for _, command in stopped} == {Status.FAILED}
    assert all(abs(plant.v) <= 0.01 for plant, _ in stopped)
    first, last = stopped[0][0], stopped[-1][0]
    assert np.hypot(last.x - first.x, last.y - first.y) <= 0.01
    assert run[-1][1].docked


def test_a_mistake_in_what_is_told_of_a_cycle_still_leaves_a_command(monkeypatch: pytest.MonkeyPatch) -> None:
    """What brakes the vehicle then needs nothing of a cycle's account."""

    def wrong(*told: object) -> None:
        raise ZeroDivisionError("made up")

    monkeypatch.setattr(decision, "_diagnose", wrong)
    (_, command), *_ = drive(short(), 0.1)
    assert (command.status, command.source) == (Status.FAILED, Source.BRAKING)
    assert "made up" in command.diagnostics.reason


def test_a_mistake_in_the_program_brakes_and_the_next_cycle_goes_on(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    found = search.converge

    def converge(mpcc: Any, s: Any, context: Any, start: Any, clock: Any) -> SqpResult:
        if 5.0 <= context.now < 5.2:
            raise ZeroDivisionError("made up\nin two lines")
        return found(mpcc, s, context, start, clock)

    monkeypatch.setattr(search, "converge", converge)
    run = list(drive(short(), 25.0))
    during = between(run, 5.0, 5.2)
    assert {(c.status, c.source) for _, c in during} == {(Status.FAILED, Source.BRAKING)}
    what = "ZeroDivisionError: made up in two lines"
    assert during[0][1].diagnostics.reason == Reason.MISTAKE.message.format(what)
    assert during[0][1].acceleration > 0.0  # it reverses
    assert finite(run)
    assert run[int(5.2 / 0.05)][1].source is Source.SOLUTION
    assert run[-1][1].docked
    assert "mistake in a cycle" in caplog.text


@pytest.mark.parametrize("dead_time", [0.0, 0.18, 0.5])
def test_a_mistake_that_lasts_brings_the_vehicle_to_rest_and_leaves_it_there(
    dead_time: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = search.converge

    def converge(mpcc: Any, s: Any, context: Any, start: Any, clock: Any) -> SqpResult:
        if context.now >= 5.0:
            raise ZeroDivisionError("made up")
        return found(mpcc, s, context, start, clock)

    monkeypatch.setattr(search, "converge", converge)
    run = list(drive(short(dead_time=dead_time), 12.0))
    assert max(plant.v for plant, _ in run) <= 0.02  # it reverses, and is not driven forwards by its brakes
    assert all(abs(plant.v) <= 0.02 for plant, _ in between(run, 9.0, 12.0))


def test_a_mistake_in_the_prediction_itself_is_braked_for_too(monkeypatch: pytest.MonkeyPatch) -> None:
    predicted = sensing.predicted

    def fails(s: Any, at: float, config: Any) -> Any:
        if 5.0 <= s.now < 5.2:
            raise ZeroDivisionError("made up")
        return predicted(s, at, config)

    monkeypatch.setattr(sensing, "predicted", fails)
    run = list(drive(short(), 25.0))
    during = between(run, 5.0, 5.2)
    assert {(c.status, c.source) for _, c in during} == {(Status.FAILED, Source.BRAKING)}
    assert during[0][1].acceleration > 0.0  # it reverses
    assert finite(run)
    assert run[-1][1].docked


def test_after_a_mistake_the_command_that_was_sent_is_queued(monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(*_: Any) -> Any:
        raise ZeroDivisionError("made up")

    scenario = short(dead_time=0.2)
    path = scenario.build_path()
    controller = DockingController(path, scenario.build_corridor(path), scenario.controller_config())
    monkeypatch.setattr(search, "converge", fails)
    first, beyond = path.parts[0].first, 1.05 * controller.config.limits.steering
    command = controller.step(VehicleState(first.x, first.y, first.phi, v=-1.0, delta=beyond), now=0.0)
    queued = controller.state.queue[-1]
    assert command.diagnostics.cause is Reason.MISTAKE
    assert command.steering_rate < 0.0  # back to within the limit
    assert (queued.acceleration, queued.steering_rate) == (command.acceleration, command.steering_rate)


class Told(DockingController):
    """What is told of the state, the time and the obstacles is changed."""

    tell: Callable[[VehicleState, float], dict[str, Any]]

    def step(self, state: VehicleState, *, now: float, **inputs: Any) -> Command:
        told: dict[str, Any] = {"state": state, "now": now} | inputs | self.tell(state, now)
        return super().step(told.pop("state"), **told)


def driven_as_told(seconds: float, tell: Callable[[VehicleState, float], dict[str, Any]]) -> list[Any]:
    scenario = short()
    path = scenario.build_path()
    controller = Told(path, scenario.build_corridor(path), scenario.controller_config())
    controller.tell = tell
    return list(drive(scenario, seconds, controller=controller))


@pytest.mark.parametrize("speed", [31.0, 12.0, -31.0])
def test_a_speed_that_cannot_be_does_not_keep_the_vehicle_from_braking(speed: float) -> None:
    run = driven_as_told(10.0, lambda state, now: {"state": replace(state, v=speed)} if now >= 5.0 else {})
    assert between(run, 5.0, 5.1)[0][0].v < -0.5
    assert all(abs(plant.v) <= 0.02 for plant, _ in between(run, 8.0, 10.0))
    assert {command.status for _, command in between(run, 8.0, 10.0)} == {Status.FAILED}


@pytest.mark.acceptance
def test_obstacles_that_are_not_readable_stop_a_moving_vehicle_until_some_are() -> None:
    broken = [[[5.0, nan], [6.0, 1.0], [6.0, 2.0]]]

    def tell(state: VehicleState, now: float) -> dict[str, Any]:
        return {"obstacles": broken} if abs(now - 5.0) < 0.01 else {"obstacles": []} if now >= 10.0 else {}

    run = driven_as_told(30.0, tell)
    assert all(abs(plant.v) <= 0.02 for plant, _ in between(run, 8.0, 10.0))
    assert run[-1][1].docked


@pytest.mark.acceptance
def test_a_clock_that_stands_still_is_told_and_the_vehicle_docks_nevertheless() -> None:
    run = driven_as_told(25.0, lambda state, now: {"now": min(now, 5.0)})
    assert run[-1][1].docked
    assert "the clock stands still" in run[-1][1].diagnostics.reason


@pytest.mark.acceptance
def test_a_docked_vehicle_stays_where_it_is_after_cycles_were_lost() -> None:
    """A gap says nothing about where it is: it is measured there."""
    scenario = short()
    controller, path = docking_controller(scenario), scenario.build_path()
    goal, parameters = scenario.goal_pose(path), scenario.plant_parameters()
    plant = PlantState(x=path.start.x, y=path.start.y, phi=path.start.phi)
    moved, docked_at = 0.0, None
    for cycle in range(round(30.0 / 0.05)):
        now = 0.05 * cycle
        if docked_at is not None and any(begin <= now - docked_at < begin + 1.2 for begin in (0.2, 1.5)):
            continue
        plant = advance(plant, parameters, now)
        command = controller.step(plant.measured, now=now, goal=goal)
        if docked_at is None and command.docked:
            docked_at, there = now, plant
        if docked_at is not None:
            assert command.docked, (now, command.diagnostics.reason)
            moved = max(moved, float(np.hypot(plant.x - there.x, plant.y - there.y)))
        plant = issue(
            plant, parameters, acceleration=command.acceleration, steering_rate=command.steering_rate
        )
    assert docked_at is not None
    assert moved <= 0.02


def test_a_vehicle_that_begins_in_its_goal_is_docked_at_once() -> None:
    scenario = short()
    goal = scenario.goal_pose(scenario.build_path())
    state = VehicleState(x=goal.x + 0.02, y=goal.y, phi=goal.phi, v=0.0, delta=0.3)
    command = docking_controller(scenario).step(state, now=0.0, goal=goal)
    assert (command.docked, command.acceleration, command.steering_rate) == (True, 0.0, 0.0)


@pytest.mark.acceptance
@pytest.mark.parametrize("aside", [0.1, pytest.param(-0.3, marks=pytest.mark.acceptance)])
def test_a_vehicle_that_begins_beside_its_goal_backs_off_gently(aside: float) -> None:
    scenario = short()
    goal = scenario.goal_pose(scenario.build_path())
    beside = goal.compose(Pose2(0.0, aside, 0.0))
    run = list(drive(scenario, 12.0, start=PlantState(x=beside.x, y=beside.y, phi=beside.phi)))
    assert max(abs(command.acceleration) for _, command in run) <= 1.0
    assert finite(run)
