"""The built-in scenarios in closed loop: docking, path following, other cycles, a plant with model errors."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from geometry import Pose2
from rti_mpcc.simulation import RunResult, changed, load_scenario, simulate
from tests.rti_mpcc.docking_runs import DOCKING, docking_figures, statuses

LATEST = {"docking_inside": 23.0, "docking_behind": 26.0}
"""Time to tolerance, at most [s]."""
STANDSTILL_WITHIN = 3.0
"""From the first time inside tolerance to docked, at most [s]."""
DIRECTION_CHANGES = {"docking_inside": 0, "docking_behind": 0, "docking_full_course": 1, "long_approach": 0}
LEAST_CLEARANCE = 0.05
LARGEST_STEP = 0.15
"""Of the commanded acceleration where contouring turns into arrival [m/s² a cycle]."""
MODEL_ERRORS = [
    ("simulation.wheelbase_error", 0.05),
    ("simulation.wheelbase_error", -0.05),
    ("simulation.acceleration_gain", 0.8),
    ("simulation.acceleration_gain", 1.2),
]


def note(figures: dict[str, Any], result: RunResult) -> dict[str, Any]:
    found = docking_figures(result)
    figures.update(found)
    figures["statuses"] = statuses(result)
    return found


@pytest.mark.parametrize("name", DOCKING)
def test_default_docks(name: str, undisturbed: Callable[[str], RunResult], figures: dict[str, Any]) -> None:
    found = note(figures, undisturbed(name))
    assert found["docked"]
    assert found["time_to_tolerance_s"] <= LATEST.get(name, np.inf)
    assert found["time_to_dock_s"] - found["time_to_tolerance_s"] <= STANDSTILL_WITHIN
    assert found["direction_changes"] == DIRECTION_CHANGES[name]
    assert found["min_clearance_m"] > LEAST_CLEARANCE
    assert found["solver_failures"] == 0
    assert found["step_at_change_over"] <= LARGEST_STEP


@pytest.mark.parametrize("name", DOCKING[:3])
def test_paper_docks(name: str, figures: dict[str, Any]) -> None:
    found = note(figures, simulate(load_scenario(name), preset="paper"))
    assert found["docked"]


def test_path_following_passes_the_cusp_and_stops_at_the_end(
    undisturbed: Callable[[str], RunResult], figures: dict[str, Any]
) -> None:
    result = undisturbed("path_following")
    found = note(figures, result)
    truth = result.truth
    passing = int(np.argmax(truth.part == 1))
    at_cusp = Pose2(*truth.poses[passing]).relative_to(result.path.parts[0].last)
    distance, angle = float(np.hypot(at_cusp.x, at_cusp.y)), abs(at_cusp.phi)
    figures["cusp_distance_m"], figures["cusp_heading_deg"] = distance, np.degrees(angle)
    assert truth.part[-1] == 1
    assert distance <= 0.1
    assert angle <= np.radians(3.0)
    assert abs(truth.v[-1]) <= 0.02
    error = found["final_error"]
    assert abs(error["longitudinal_m"]) <= 0.05
    assert abs(error["lateral_m"]) <= 0.05
    assert abs(error["heading_rad"]) <= np.radians(2.0)
    assert found["direction_changes"] == 1
    assert found["min_clearance_m"] > LEAST_CLEARANCE


@pytest.mark.parametrize("cycle", [0.01, 0.1])
@pytest.mark.parametrize("name", DOCKING)
def test_the_cycle_hardly_matters(
    name: str, cycle: float, undisturbed: Callable[[str], RunResult], figures: dict[str, Any]
) -> None:
    found = note(figures, simulate(changed(load_scenario(name), {"simulation.cycle": cycle})))
    usual = docking_figures(undisturbed(name))["time_to_tolerance_s"]
    assert found["docked"]
    figures["ratio"] = found["time_to_tolerance_s"] / usual
    assert found["time_to_tolerance_s"] == pytest.approx(usual, rel=0.03)
    assert found["min_clearance_m"] > 0.0


@pytest.mark.parametrize("cycle", [0.005, 0.2])
@pytest.mark.parametrize("name", DOCKING)
def test_docks_at_the_shortest_and_the_longest_cycle(
    name: str, cycle: float, figures: dict[str, Any]
) -> None:
    clock = {"simulation.cycle": cycle, "simulation.plant_step": min(cycle, 0.01)}
    found = note(figures, simulate(changed(load_scenario(name), clock)))
    assert found["docked"]
    assert found["min_clearance_m"] > 0.0


@pytest.mark.parametrize(("key", "value"), MODEL_ERRORS)
@pytest.mark.parametrize("name", DOCKING)
def test_docks_with_a_plant_that_differs_from_the_model(
    name: str, key: str, value: float, figures: dict[str, Any]
) -> None:
    found = note(figures, simulate(changed(load_scenario(name), {key: value})))
    assert found["docked"]
    assert found["min_clearance_m"] > 0.0
