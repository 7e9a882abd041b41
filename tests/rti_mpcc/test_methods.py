"""What the method is compared with, in closed loop. Figures: docs/method.md."""

from __future__ import annotations

import numpy as np
import pytest

from rti_mpcc.simulation import RunResult, changed, load_scenario, simulate, summary
from rti_mpcc.types import Objective, Status


def run(scenario: str, method: str, preset: str = "paper", seconds: float = 120.0) -> RunResult:
    short = changed(load_scenario(scenario), {"simulation.duration": seconds})
    return simulate(short, preset=preset, method=method)


def objectives(result: RunResult) -> list[Objective]:
    """In the order in which they came, of the cycles that solved a QP."""
    solved = [o for o, s in zip(result.cycles.objective, result.cycles.solved, strict=True) if s]
    return list(dict.fromkeys(solved))


@pytest.mark.acceptance
def test_separated_stops_at_its_staging_pose_and_takes_longer() -> None:
    dynamic, separated = run("docking_inside", "dynamic"), run("docking_inside", "separated")
    assert objectives(separated) == [Objective.CONTOURING, Objective.CARTESIAN]
    assert Status.CHANGING_DIRECTION in separated.cycles.status
    first = separated.cycles.objective.index(Objective.CARTESIAN)
    at = int(np.searchsorted(separated.truth.times, separated.cycles.times[first]))
    goal = separated.path.parts[-1].project(
        *separated.truth.goals[0, :2], heading=separated.truth.goals[0, 2]
    )
    assert separated.truth.theta[at] == pytest.approx(goal - 7.0, abs=0.5)
    assert abs(separated.truth.v[at]) <= 0.03
    times = [summary(result)["time_to_tolerance_s"] for result in (dynamic, separated)]
    assert times[1] >= 1.4 * times[0]


@pytest.mark.acceptance
def test_separated_turns_about_where_the_goal_cannot_be_reached_from_its_staging_pose() -> None:
    found = summary(run("docking_behind", "separated"))
    assert found["docked"]
    assert found["direction_changes"] >= 1


@pytest.mark.acceptance
def test_switched_has_no_corridor_once_it_makes_for_the_goal() -> None:
    """Past the narrowing it is the last check that stops it: it does not dock, and touches nothing."""
    result = run("docking_behind", "switched", seconds=35.0)
    found = summary(result)
    assert objectives(result) == [Objective.CONTOURING, Objective.CARTESIAN]
    assert not found["docked"]
    assert found["min_clearance_m"] >= 0.0
    assert Status.BLOCKED in result.cycles.status
    first = result.cycles.objective.index(Objective.CARTESIAN)
    at = int(np.searchsorted(result.truth.times, result.cycles.times[first]))
    left = result.path.parts[-1].end - result.truth.theta[at]
    assert left == pytest.approx(result.config.weights.transition_reach, abs=1.0)


@pytest.mark.acceptance
def test_with_the_default_preset_the_staging_pose_is_arrived_at() -> None:
    result = run("docking_inside", "separated", "default")
    found = summary(result)
    assert objectives(result) == [Objective.ARRIVAL, Objective.CARTESIAN]
    assert found["docked"]
    assert found["min_clearance_m"] >= 0.0


@pytest.mark.acceptance
def test_constant_weights_are_the_less_exact_the_smaller_they_are() -> None:
    """At the cusp, which the first part ends in."""
    errors = []
    for method in ("constant_1", "constant_50", "constant_100"):
        result = run("path_following", method, seconds=26.0)
        cusp = result.path.parts[0].last
        away = np.hypot(result.truth.poses[:, 0] - cusp.x, result.truth.poses[:, 1] - cusp.y)
        errors.append(float(away.min()))
    assert errors[0] > errors[1] > errors[2]
    assert errors[0] > 0.5
