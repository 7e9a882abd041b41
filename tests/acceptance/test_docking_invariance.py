"""The same docking problem elsewhere, mirrored or with the vehicle turned round gives the same motion."""

from __future__ import annotations

from collections.abc import Callable
from math import pi
from typing import Any

import numpy as np
import pytest

from benchmarks.problems.variants import mirrored, moved, turned_round
from geometry import Pose2
from rti_mpcc.simulation import RunResult, Scenario, docking_controller, load_scenario, simulate, summary
from tests.rti_mpcc.docking_runs import DOCKING, Wrapped, deviation, seen_from

Runs = Callable[[str], RunResult]

SAME = 5e-3
"""Largest distance between mirrored or rotated runs [m]: rounding decides when OSQP is done, and which pose
between two stages is the nearest to a corner. All end within 0.0002 m."""
SAME_FAR_AWAY = 0.01
"""The same for a run 5 km from the origin [m]."""


def compare(base: RunResult, other: RunResult, poses: Any, figures: dict[str, Any]) -> float:
    """Largest distance of `poses` (the other run's, carried back) from the base run's [m]."""
    distance = deviation(base.truth.poses, poses)
    found, usual = summary(other), summary(base)
    figures["deviation_m"] = distance
    for name in ("docked", "time_to_tolerance_s", "time_to_dock_s", "min_clearance_m"):
        figures[name] = found[name]
        figures[f"base_{name}"] = usual[name]
    assert found["docked"]
    assert abs(found["time_to_dock_s"] - usual["time_to_dock_s"]) <= base.config.cycle
    return distance


def rotated_run(scenario: Scenario, angle: float) -> RunResult:
    """Turned about the origin, with every heading told to the controller wrapped to +-pi."""
    scenario = moved(scenario, Pose2(0.0, 0.0, angle))
    return simulate(scenario, controller=Wrapped(docking_controller(scenario)))


@pytest.mark.parametrize("name", DOCKING)
def test_mirrored(name: str, undisturbed: Runs, figures: dict[str, Any]) -> None:
    result = simulate(mirrored(load_scenario(name)))
    poses = result.truth.poses * [1.0, -1.0, -1.0]
    assert compare(undisturbed(name), result, poses, figures) <= SAME


@pytest.mark.parametrize("angle", [0.7, 2.0, -2.5])
@pytest.mark.parametrize("name", DOCKING)
def test_rotated(name: str, angle: float, undisturbed: Runs, figures: dict[str, Any]) -> None:
    result = rotated_run(load_scenario(name), angle)
    poses = seen_from(Pose2(0.0, 0.0, angle), result.truth.poses)
    assert compare(undisturbed(name), result, poses, figures) <= SAME


@pytest.mark.parametrize("at", ["start", "middle", "goal"])
@pytest.mark.parametrize("name", DOCKING)
def test_across_pi(name: str, at: str, undisturbed: Runs, figures: dict[str, Any]) -> None:
    """The heading passes +-pi, where it is told with a jump, at the start, on the way or at the goal."""
    usual = undisturbed(name)
    heading = {"start": usual.truth.poses[0, 2], "goal": usual.truth.goals[-1, 2]}
    heading["middle"] = 0.5 * (usual.truth.poses[:, 2].min() + usual.truth.poses[:, 2].max())
    angle = float(pi - heading[at])
    result = rotated_run(load_scenario(name), angle)
    assert np.ptp(result.truth.poses[:, 2]) == pytest.approx(np.ptp(usual.truth.poses[:, 2]), abs=0.01)
    poses = seen_from(Pose2(0.0, 0.0, angle), result.truth.poses)
    assert compare(usual, result, poses, figures) <= SAME


@pytest.mark.parametrize("name", DOCKING)
def test_far_from_the_origin(name: str, undisturbed: Runs, figures: dict[str, Any]) -> None:
    place = Pose2(5000.0, -3000.0, 0.0)
    result = simulate(moved(load_scenario(name), place))
    poses = seen_from(place, result.truth.poses)
    assert compare(undisturbed(name), result, poses, figures) <= SAME_FAR_AWAY


@pytest.mark.parametrize("name", DOCKING)
def test_turned_round(name: str, undisturbed: Runs, figures: dict[str, Any]) -> None:
    result, usual = simulate(turned_round(load_scenario(name))), undisturbed(name)
    compare(usual, result, result.truth.poses, figures)
    found, before = summary(result), summary(usual)
    late = found["time_to_tolerance_s"] - before["time_to_tolerance_s"]
    assert abs(late) <= usual.config.cycle + 1e-9
    assert found["min_clearance_m"] == pytest.approx(before["min_clearance_m"], abs=0.01)
