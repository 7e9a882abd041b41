"""What is driven when time runs out in a cycle. No test looks at a clock: what it says is written down."""

from __future__ import annotations

from collections.abc import Callable
from itertools import count
from typing import Any

import numpy as np
import pytest

from benchmarks.encounters import on_lane, square
from geometry import Area, Pose2
from rti_mpcc import ControllerConfig, DockingController, VehicleState
from rti_mpcc.clock import CycleClock
from rti_mpcc.simulation import RunResult, Scenario, changed, docking_controller, simulate
from rti_mpcc.simulation.faults import FAILED
from rti_mpcc.simulation.plant import PlantState
from rti_mpcc.types import Command, Reason, Source, Status
from tests.lists import acceptance, some_of
from tests.rti_mpcc.docking_runs import (
    Clocked,
    Obstacles,
    docking_figures,
    drive,
    granting,
    present,
    short,
    straight,
    wall,
)

CYCLE = 0.05
PLENTY = 40
SEARCHED, SLICES = 6.0, 1  # until then no route is searched for [s], later in so many slices a cycle
BEGIN, GONE = 3.0, 15.0
"""When a wall comes and goes [s]."""

Run = list[tuple[PlantState, Command]]


def run_with(clock_at: Callable[[float], CycleClock | None], seconds: float) -> Run:
    scenario = short()
    controller = Clocked(docking_controller(scenario), clock_at)
    return list(drive(scenario, seconds, controller=controller, after_docking=2.0))


def at(time: float, clock: Callable[[], CycleClock]) -> Callable[[float], CycleClock]:
    """One cycle with this clock, the others with time in plenty."""
    return lambda now: clock() if abs(now - time) < 0.5 * CYCLE else granting(PLENTY)


def cycle(run: Run, time: float) -> Command:
    return run[round(time / CYCLE)][1]


@pytest.mark.parametrize("jitter", [1e-9, 0.02])
def test_a_goal_that_jitters_does_not_begin_the_search_anew_in_each_cycle(jitter: float) -> None:
    """Time is for one iteration a cycle: a first plan takes three of them."""
    scenario = short()
    goal, noise = scenario.goal_pose(), np.random.default_rng(1)

    def goal_at(now: float) -> Pose2:
        x, y = jitter * noise.standard_normal(2)
        return Pose2(goal.x + x, goal.y + y, goal.phi)

    controller = Clocked(docking_controller(scenario), lambda now: granting(1))
    run = list(drive(scenario, 1.0, goal_at=goal_at, controller=controller))
    assert run[-1][1].source is Source.SOLUTION
    assert run[-1][0].v != 0.0


# -- late plans ------------------------------------------------------------------------------------------


@pytest.mark.acceptance
def test_a_late_plan_is_not_driven_and_the_next_cycle_goes_on() -> None:
    run = run_with(at(5.0, lambda: granting(PLENTY, late=True)), 16.0)
    late, after = cycle(run, 5.0), cycle(run, 5.0 + CYCLE)
    assert (late.source, late.status) == (Source.SHIFTED_PLAN, Status.ARRIVING)
    assert late.diagnostics.reason == Reason.LATE.message
    assert late.diagnostics.deadline_missed
    assert not late.diagnostics.failed  # the plan was good, only late
    assert after.source is Source.SOLUTION
    assert not after.diagnostics.deadline_missed
    assert run[-1][1].docked


def test_late_without_a_plan_from_before_it_stands_and_then_begins() -> None:
    run = run_with(at(0.0, lambda: granting(PLENTY, late=True)), 0.2)
    late, after = cycle(run, 0.0), cycle(run, CYCLE)
    assert (late.source, late.status, late.acceleration) == (Source.STANDSTILL, Status.STARTING, 0.0)
    assert late.diagnostics.reason == Reason.LATE.message
    assert after.source is Source.SOLUTION


@pytest.mark.parametrize(("without", "status"), [(1, Status.STARTING), (120, Status.FAILED)])
def test_a_cycle_without_time_is_no_failure_but_six_seconds_are_one(without: int, status: Status) -> None:
    """As where a reading of 300 obstacles takes the first cycle on a route that was searched for long."""
    docking = DockingController.in_area(Area(), ControllerConfig(cycle=CYCLE))
    at_rest, goal = VehicleState(0.0, 0.0, 0.0, 0.0, 0.0), Pose2(12.0, 0.0, 0.0)
    told = list[Status]()
    while len(told) - told.count(Status.PLANNING) < without:
        now = CYCLE * len(told)
        clock = granting(SLICES if now > SEARCHED and told[-1] is Status.PLANNING else 0)
        told.append(docking.step(at_rest, now=now, goal=goal, clock=clock).status)
    assert told[-1] is status


def test_late_without_a_plan_from_before_it_brakes_while_it_rolls() -> None:
    def clock_at(now: float) -> CycleClock:
        if 4.975 < now < 6.225:  # longer than the last plan lives
            return granting(PLENTY, stops=(FAILED,) * PLENTY)
        return granting(PLENTY, late=6.225 < now < 6.275)

    run = run_with(clock_at, 25.0)
    assert abs(run[round(6.25 / CYCLE)][0].v) > 0.2
    assert cycle(run, 6.2).status is Status.FAILED
    late = cycle(run, 6.25)
    assert (late.source, late.status) == (Source.BRAKING, Status.STARTING)
    assert late.diagnostics.reason == Reason.LATE.message
    assert cycle(run, 6.3).source is Source.SOLUTION
    assert run[-1][1].docked


class Hurried(CycleClock):
    """Its time is up as soon as an iteration has begun."""

    def grants(self, least: float = 0.0) -> bool:
        granted, self._until = super().grants(least), 0.0
        return granted

    def late(self) -> bool:
        return False


def test_the_first_qp_of_a_cycle_is_finished_whatever_the_time_is() -> None:
    """So a first plan, which takes three, is found in three cycles."""
    run = run_with(lambda now: Hurried(), 25.0)
    assert [command.diagnostics.failed for _, command in run].count(True) <= 3
    assert cycle(run, 3 * CYCLE).source is Source.SOLUTION
    assert run[-1][1].docked


def test_a_controller_has_a_deadline_by_default(monkeypatch: pytest.MonkeyPatch) -> None:
    """Here each look at the clock takes 20 ms, of a cycle of 50 ms."""
    monkeypatch.setattr("rti_mpcc.clock.perf_counter", count(0.0, 0.02).__next__)
    state, goal = VehicleState(0.0, 0.0, 0.0, 0.0, 0.0), Pose2(40.0, 0.0, 0.0)
    first = on_lane(40.0, 5.0, ControllerConfig()).step(state, now=0.0, goal=goal)
    assert (first.source, first.status) == (Source.STANDSTILL, Status.STARTING)
    assert first.diagnostics.deadline_missed
    without = on_lane(40.0, 5.0, ControllerConfig(deadline=None)).step(state, now=0.0, goal=goal)
    assert without.source is Source.SOLUTION
    assert not without.diagnostics.deadline_missed


# -- a QP that is not solved -------------------------------------------------------------------------------


def test_where_a_qp_is_not_solved_the_last_plan_is_driven_for_a_cycle() -> None:
    run = run_with(at(5.0, lambda: granting(PLENTY, stops=(FAILED,))), 5.2)
    failed, after = cycle(run, 5.0), cycle(run, 5.0 + CYCLE)
    assert failed.source is Source.SHIFTED_PLAN
    assert failed.diagnostics.failed
    assert after.source is Source.SOLUTION


# -- so many iterations in every cycle -------------------------------------------------------------------


def course(**tables: Any) -> Scenario:
    return changed(straight(1, 24.0, duration=45.0), tables)


def limited(
    scenario: Scenario, clock_at: Callable[[float], CycleClock | None], **told: Any
) -> tuple[RunResult, dict[str, Any]]:
    result = simulate(scenario, controller=Clocked(docking_controller(scenario), clock_at), **told)
    return result, docking_figures(result)


def assert_gentle(result: RunResult) -> None:
    """Never braked as hard as without a plan."""
    assert (
        np.abs(result.cycles.acceleration).max() < 0.6 * docking_controller(course()).config.firm_deceleration
    )
    assert Status.FAILED not in result.cycles.status


@pytest.mark.parametrize(("ahead", "speed"), [acceptance(30.0, 1.2), (22.0, 0.8)])
def test_cycles_without_time_cost_nothing_while_somebody_crosses(ahead: float, speed: float) -> None:
    """The last plan is driven on as far as a plan of its cycle would be; who yields goes on doing so."""

    def somebody(now: float) -> Obstacles:
        return [square(ahead, -7.0 + speed * now, 0.6)]

    usual = docking_figures(simulate(straight(1, 30.0), obstacles_at=somebody))
    result, found = limited(
        straight(1, 30.0),
        lambda now: granting(0 if round(now / CYCLE) % 5 == 4 else PLENTY),
        obstacles_at=somebody,
    )
    assert_gentle(result)
    assert found["docked"]
    assert found["min_clearance_m"] > 0.5
    assert found["time_to_dock_s"] - usual["time_to_dock_s"] <= 0.5


@pytest.mark.parametrize("ends", [8.9, 10.2])
def test_who_yields_and_never_has_time_again_stands_and_fails(ends: float) -> None:
    """From when the way is blocked, and from when it is clear again."""
    result, _ = limited(
        straight(1, duration=ends + 15.0), lambda now: granting(PLENTY if now < ends else 0),
        obstacles_at=lambda now: [square(22.0, -7.0 + 0.9 * now, 0.6)],
    )  # fmt: skip
    statuses = result.cycles.status
    assert statuses[round(ends / CYCLE)] is statuses[round(ends / CYCLE) + 1] is Status.BLOCKED
    assert statuses[-1] is Status.FAILED
    assert abs(result.truth.v[-1]) < 0.01


@pytest.mark.parametrize("iterations", some_of([1, 3]))
def test_docks_with_few_iterations_a_cycle(iterations: int) -> None:
    usual = simulate(short())
    result, found = limited(short(), lambda now: granting(iterations))
    assert found["docked"]
    assert_gentle(result)
    assert 0.0 <= found["time_to_dock_s"] - docking_figures(usual)["time_to_dock_s"] <= 0.5


@pytest.mark.acceptance
@pytest.mark.parametrize("iterations", [1, 3, 5])
def test_stops_before_a_wall_with_few_iterations_a_cycle_and_goes_on(iterations: int) -> None:
    scenario = course()
    outline = wall(scenario.build_path(), 16.0, 3.2)
    result, found = limited(
        scenario, lambda now: granting(iterations), obstacles_at=present(outline, BEGIN, GONE)
    )
    assert_gentle(result)
    assert found["docked"]
    assert found["min_clearance_m"] > 0.5
    assert result.cycles.status[round((GONE - CYCLE) / CYCLE)] is Status.BLOCKED
    assert np.abs(result.truth.poses[:, 1]).max() <= 0.2  # it does not swerve
    stops = ["a stop in front of" in reason for reason in result.cycles.reason]
    assert BEGIN <= result.cycles.times[stops.index(True)] <= BEGIN + 0.5
