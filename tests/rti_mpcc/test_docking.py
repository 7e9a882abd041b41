"""The controller in closed loop, in short; tests/acceptance has the same at length."""

from __future__ import annotations

from math import radians

import numpy as np
import pytest

from geometry import Pose2
from rti_mpcc.simulation import RunResult, Scenario, changed, load_scenario, simulate, summary
from rti_mpcc.types import Source, Status
from tests.rti_mpcc.docking_runs import assert_docked, drive, on_segments, short


@pytest.fixture(scope="module")
def inside() -> RunResult:
    """docking_inside as it is built in."""
    return simulate(load_scenario("docking_inside"))


@pytest.fixture(scope="module")
def usual() -> RunResult:
    """The short scenario, driven once."""
    return simulate(short())


def offset_goal(scenario: Scenario, *offset: float) -> Pose2:
    return scenario.goal_pose().compose(Pose2(*offset))


# -- docking ---------------------------------------------------------------------------------------------


def test_docking_inside(inside: RunResult) -> None:
    found = assert_docked(inside)
    assert found["solver_failures"] == 0
    assert found["time_to_tolerance_s"] <= 23.0
    assert found["time_to_dock_s"] <= found["time_to_tolerance_s"] + 3.0
    assert found["direction_changes"] == 0
    assert found["min_clearance_m"] > 0.05
    assert found["step_at_change_over"] <= 0.15


# -- the goal --------------------------------------------------------------------------------------------


def test_without_any_goal_it_is_the_end_of_the_path() -> None:
    scenario = short()
    *_, (plant, command) = drive(scenario, 20.0, goal_at=lambda now: None)
    error = Pose2(plant.x, plant.y, plant.phi).relative_to(scenario.build_path().end)
    assert command.docked
    assert np.hypot(error.x, error.y) <= 0.07


def test_stays_docked_without_creeping_or_jitter() -> None:
    run = list(drive(short(), 38.0))
    standing = [entry for entry in run if entry[0].time >= 18.0]
    plant = standing[0][0]
    assert all(command.docked and command.status is Status.DOCKED for _, command in standing)
    assert max(abs(command.acceleration) for _, command in standing) <= 0.01
    assert max(abs(command.steering_rate) for _, command in standing) <= 1e-3
    assert max(np.hypot(other.x - plant.x, other.y - plant.y) for other, _ in standing) <= 1e-3
    assert max(abs(other.v) for other, _ in standing) <= 1e-3


def test_a_goal_that_moves_after_docking_is_driven_to() -> None:
    scenario = short()
    first, second = offset_goal(scenario, 0.0, 0.0, 0.0), offset_goal(scenario, -2.5, 0.1, 0.0)
    run = list(drive(scenario, 40.0, goal_at=lambda now: first if now < 16.0 else second))
    assert run[int(15.9 / 0.05)][1].docked
    plant, command = run[-1]
    error = Pose2(plant.x, plant.y, plant.phi).relative_to(second)
    assert command.docked
    assert abs(error.x) <= 0.05
    assert abs(error.y) <= 0.05
    assert abs(error.phi) <= radians(2.0)


# -- cusps -----------------------------------------------------------------------------------------------


def test_the_direction_changes_only_once_the_queue_is_drained() -> None:
    result = simulate(on_segments([(1, 0.1, 8.0), (-1, -0.1, 8.0)]))
    found = assert_docked(result)
    assert found["solver_failures"] == 0
    truth = result.truth
    assert found["direction_changes"] == 1
    change = truth.times[np.argmax(truth.part == 1)]
    around = (truth.times >= change - 0.18) & (truth.times <= change + 0.18)
    assert np.abs(truth.v[around]).max() <= 0.02
    assert truth.v[truth.times <= change].min() >= -0.02
    assert truth.v[truth.times >= change].max() <= 0.02
    pose = Pose2(*truth.poses[np.argmax(truth.part == 1)]).relative_to(result.path.parts[0].last)
    assert np.hypot(pose.x, pose.y) <= 0.1
    assert abs(pose.phi) <= radians(3.0)


@pytest.mark.acceptance
def test_a_vehicle_changes_direction_clear_of_a_narrowing_of_the_next_part() -> None:
    narrowed = {"left": 4.0, "right": -4.0, "narrowings": [{"from": 9.0, "to": 10.0, "left": 0.96}]}
    segments, brief = [(-1, 0.0, 8.0), (1, 0.08, 14.0)], {"duration": 15.0}
    figures = summary(simulate(on_segments(segments, corridor=narrowed, simulation=brief)))
    assert figures["direction_changes"] == 1  # it is on its way, clear of the narrowing
    assert figures["min_clearance_m"] > 0.05


# -- commands --------------------------------------------------------------------------------------------


def test_commands_keep_to_the_limits() -> None:
    limits = {"speed": 1.2, "acceleration": 0.45, "steering": 0.5, "steering_rate": 0.3}
    result = simulate(changed(short(), {"limits": limits}))
    assert assert_docked(result)["solver_failures"] == 0
    cycles, truth = result.cycles, result.truth
    assert np.abs(cycles.acceleration).max() <= limits["acceleration"]
    assert np.abs(cycles.steering_rate).max() <= limits["steering_rate"]
    assert np.abs(truth.v).max() <= 1.01 * limits["speed"]
    assert np.abs(truth.delta).max() <= limits["steering"] + 1e-9
    assert np.abs(cycles.steering).max() <= limits["steering"] + 0.01


def test_planned_speed_and_steering_come_true(usual: RunResult) -> None:
    cycles, truth = usual.cycles, usual.truth
    reached = cycles.times + 0.18 + 0.05
    inside = reached <= truth.times[-1]
    speed = np.interp(reached[inside], truth.times, truth.v)
    steering = np.interp(reached[inside], truth.times, truth.delta)
    driven = np.array([source is not Source.STANDSTILL for source in cycles.source])[inside]
    assert driven.sum() > 100
    np.testing.assert_allclose(cycles.speed[inside][driven], speed[driven], atol=1e-9)
    # While it is held, what is learnt of the slope moves the set-point by some micrometres a second.
    np.testing.assert_allclose(cycles.speed[inside], speed, atol=1e-5)
    np.testing.assert_allclose(cycles.steering[inside], steering, atol=1e-9)


def test_a_command_comes_with_the_plan_that_it_belongs_to() -> None:
    for plant, command in drive(short(), 3.0):
        plan = command.trajectory
        assert plan.times.shape == (71,)
        assert plan.states.shape == (71, 6)
        assert plan.controls.shape == (70, 3)
        assert np.isfinite(plan.states).all()
        assert np.isfinite(plan.controls).all()
        assert (np.diff(plan.times) > 0.0).all()
        assert plan.times[0] == pytest.approx(plant.time + 0.18)
        assert plan.times[1] - plan.times[0] == pytest.approx(0.05)
        assert not any(array.flags.writeable for array in (plan.times, plan.states, plan.controls))
        if command.source is Source.SOLUTION:
            assert command.acceleration == pytest.approx(plan.controls[0, 0], abs=1e-8)
            assert command.steering_rate == pytest.approx(plan.controls[0, 1], abs=1e-8)
            assert command.speed == pytest.approx(plan.states[1, 3], abs=5e-3)
            assert command.steering == pytest.approx(plan.states[1, 4], abs=5e-3)
