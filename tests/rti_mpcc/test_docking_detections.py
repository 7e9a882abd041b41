"""Docking by detections in closed loop, in short; tests/acceptance has the same at length."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import isfinite, nan
from typing import Any

import numpy as np
import pytest

from estimation import Frame, GoalMeasurement, GoalStatus, Outcome
from estimation.belief import BURST
from geometry import Pose2
from rti_mpcc.docking import DockingController
from rti_mpcc.simulation import Scenario, changed, docking_controller, load_scenario, simulate
from rti_mpcc.simulation.metrics import detections_of, goal_estimates
from rti_mpcc.types import Command, Status, VehicleState
from tests.lists import some_of
from tests.rti_mpcc.docking_runs import assert_docked, short

Expose = Callable[[float, Pose2], GoalMeasurement | None]


@dataclass(kw_only=True)
class Scripted:
    """A detector by a function of the stamp and the goal as seen from the vehicle."""

    script: Expose
    rate: float = 10.0
    delay: float = 0.0

    def expose(self, stamp: float, vehicle: Pose2, goal: Pose2, *, last_part: bool) -> GoalMeasurement | None:
        return self.script(stamp, goal.relative_to(vehicle))


def exact(stamp: float, seen: Pose2) -> GoalMeasurement:
    return GoalMeasurement(stamp=stamp, x=seen.x, y=seen.y, phi=seen.phi, frame=Frame.VEHICLE)


def noisy(**measurement: Any) -> Scenario:
    """The short course with detections in place of the goal."""
    return changed(short(), {"goal.measurement": {"visible_range": 15.0, **measurement}})


# -- docking on the true goal ----------------------------------------------------------------------------


@pytest.mark.parametrize("seed", some_of(range(3), 3))
def test_docking_noisy_docks_on_the_true_goal(seed: int) -> None:
    result = simulate(changed(load_scenario("docking_noisy"), {"simulation.cycle": 0.1}), seed=seed)
    assert_docked(result)
    outcomes = [judged.outcome for judged in detections_of(result.cycles)]
    assert outcomes.count(Outcome.ACCEPTED) > 0.9 * len(outcomes)
    arrivals = result.cycles.times[[bool(given) for given in result.cycles.detections]]
    part = result.truth.part[result.truth.rows_at(arrivals)]
    assert (part == 1).all()  # visible after the cusp only


# -- jumps -----------------------------------------------------------------------------------------------


@pytest.mark.acceptance
def test_a_goal_that_moves_for_good_is_followed_without_a_jump_of_the_commands() -> None:
    scenario = changed(noisy(), {"goal.shifts": [{"at_distance": 9.0, "offset": [-1.5, 0.1, 0.0]}]})
    result = simulate(scenario, detector=Scripted(script=exact))
    assert_docked(result)
    cycles, truth = result.cycles, result.truth
    moved = float(truth.times[np.argmax(np.diff(truth.goals[:, 0]) != 0.0)])
    late = cycles.times > moved + BURST + 0.2  # until then it may be a burst of false detections
    assert np.abs(goal_estimates(cycles.goal)[late, :2] - truth.goals[-1, :2]).max() < 0.01
    after = (cycles.times >= moved) & (cycles.times <= moved + 5.0)
    assert np.abs(np.diff(cycles.acceleration[after])).max() < 0.15
    assert np.abs(np.diff(cycles.steering_rate[after])).max() < 0.2
    assert np.abs(cycles.acceleration).max() < 0.5


@pytest.mark.acceptance
@pytest.mark.parametrize("back", [0.25, 0.4])
def test_a_goal_found_behind_the_vehicle_at_the_last_moment_is_backed_off_to(back: float) -> None:
    """So slow a manoeuvre takes more than a second to leave standstill: that is not a stall."""
    scenario = changed(noisy(), {"goal.shifts": [{"at_distance": 0.25, "offset": [back, 0.0, 0.0]}]})
    result = simulate(scenario, detector=Scripted(script=exact))
    assert_docked(result)


# -- not seen, or not seen any more ----------------------------------------------------------------------


@pytest.mark.acceptance
def test_a_goal_never_seen_is_waited_for_where_it_was_planned() -> None:
    def late(stamp: float, seen: Pose2) -> GoalMeasurement | None:
        return exact(stamp, seen) if stamp > 25.0 else None

    scenario = noisy(initial_offset=[0.5, 0.0, 0.0])
    planned = scenario.planned_goal()
    assert planned is not None
    result = simulate(scenario, detector=Scripted(script=late))
    waits = np.flatnonzero(result.cycles.times < 25.0)[-1]
    assert result.cycles.status[waits] is Status.SEARCHING
    stand = result.truth.poses[np.searchsorted(result.truth.times, result.cycles.times[waits])]
    assert np.hypot(stand[0] - planned.x, stand[1] - planned.y) < 0.05
    assert_docked(result)


@pytest.mark.acceptance
def test_an_uncertain_goal_that_is_lost_is_stopped_before_until_it_is_seen_again() -> None:
    def gap(stamp: float, seen: Pose2) -> GoalMeasurement | None:
        if 3.0 < stamp < 25.0:
            return None
        spread = np.diag([0.05**2, 0.05**2, 0.03**2]) if stamp <= 3.0 else None
        return GoalMeasurement(
            stamp=stamp, x=seen.x, y=seen.y, phi=seen.phi, frame=Frame.VEHICLE, covariance=spread
        )

    result = simulate(noisy(), detector=Scripted(script=gap, rate=2.0))
    waits = np.flatnonzero(result.cycles.times < 25.0)[-1]
    assert result.cycles.status[waits] is Status.GOAL_LOST
    assert "goal not seen for" in result.cycles.reason[waits]
    at = np.searchsorted(result.truth.times, result.cycles.times[waits])
    left = np.hypot(*(result.truth.poses[at, :2] - result.truth.goals[at, :2]))
    assert 0.8 < left < 1.6
    changes = sum(
        one is not other
        for one, other in zip(result.cycles.status[:waits], result.cycles.status[1:waits], strict=False)
    )
    assert changes == 1  # from arriving to waiting, and it stays so
    assert_docked(result)


def test_a_docked_vehicle_stays_while_noise_and_drift_leave_it_inside_the_tolerance() -> None:
    """The goal is seen to drift by 3 cm of the 5 cm allowed; states are 1 cm off, one sigma."""
    scenario, random = noisy(), np.random.default_rng(0)
    goal, controller = scenario.goal_pose(), docking_controller(scenario)
    commands = []
    for cycle in range(400):
        now = 0.05 * cycle
        x, y, phi = random.standard_normal(3) * (0.01, 0.01, 0.002)
        state = VehicleState(x=goal.x + x, y=goal.y + y, phi=goal.phi + phi, v=0.0, delta=0.0)
        seen = goal.compose(Pose2(0.0, 0.03 * min(now / 5.0, 1.0), 0.0))
        commands.append(controller.step(state, now=now, goal=goal, measurements=[world(seen, stamp=now)]))
    docked = [command.docked for command in commands]
    assert all(docked[docked.index(True) :])
    assert docked.index(True) < 60


# -- one step --------------------------------------------------------------------------------------------


def first_steps(
    controller: DockingController, scenario: Scenario, count: int, **arguments: Any
) -> list[Command]:
    """Steps at the start of the course; detections are of the goal where it is planned."""
    start = scenario.build_path().start
    state = VehicleState(x=start.x, y=start.y, phi=start.phi, v=0.0, delta=0.0)
    return [controller.step(state, now=0.05 * k, **arguments) for k in range(count)]


def world(pose: Pose2, **changes: Any) -> GoalMeasurement:
    values: dict[str, Any] = {"stamp": 0.0, "x": pose.x, "y": pose.y, "phi": pose.phi, **changes}
    return GoalMeasurement(**values)


@pytest.mark.parametrize(
    "changes",
    [
        {"x": nan},
        {"stamp": nan},
        {"stamp": -50.0},
        {"stamp": 50.0},
        {"covariance": np.full((3, 3), nan)},
        {"frame": Frame.VEHICLE, "stamp": -0.5},
    ],
)
def test_an_unusable_detection_is_refused_and_a_sound_command_given(changes: dict[str, Any]) -> None:
    scenario = short()
    controller = docking_controller(scenario)
    goal = scenario.goal_pose()
    (command,) = first_steps(controller, scenario, 1, goal=goal, measurements=[world(goal, **changes)])
    (judged,) = command.diagnostics.detections
    assert judged.outcome is Outcome.REFUSED
    assert judged.reason
    assert isfinite(command.acceleration)
    assert isfinite(command.steering_rate)
    assert command.diagnostics.goal is not None
    assert command.diagnostics.goal.status is GoalStatus.SEARCHING
    assert command.diagnostics.target == goal
