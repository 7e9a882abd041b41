"""Docking on the true goal by detections, over many seeds; beside it raw detections and the goal known."""

from __future__ import annotations

from statistics import mean
from typing import Any

import pytest

from rti_mpcc.simulation import GoalSource, Scenario, load_scenario, simulate, summary

SEEDS = range(50)
DOCKED_AT_LEAST = 49
EXCESS_SHARE = 0.5
"""Of the steering rate energy that raw detections cost beyond the known goal, at most."""


def run(scenario: Scenario, seed: int, source: GoalSource) -> dict[str, Any]:
    found = summary(simulate(scenario, seed=seed, goal_source=source))
    return {
        "docked": found["docked"],
        "time_to_dock_s": found["time_to_dock_s"],
        "final_error": found["final_error"],
        "min_clearance_m": found["min_clearance_m"],
        "steering_rate_energy": found["energy"]["steering_rate"],
        "solver_failures": found["solver"]["failures"],
    }


def test_docking_noisy_docks_on_the_true_goal_and_filtering_saves_steering(figures: dict[str, Any]) -> None:
    """One test for all seeds: the sources are compared over those that dock whatever the source.

    One that does not dock steers on until its end. The state is measured exactly: one known goal serves all.
    """
    scenario = load_scenario("docking_noisy")
    runs = {
        "known": [run(scenario, 0, GoalSource.KNOWN)] * len(SEEDS),
        "detected": [run(scenario, seed, GoalSource.DETECTED) for seed in SEEDS],
        "raw": [run(scenario, seed, GoalSource.RAW) for seed in SEEDS],
    }
    docked = {source: sum(one["docked"] for one in found) for source, found in runs.items()}
    compared = [k for k in SEEDS if all(found[k]["docked"] for found in runs.values())]
    energy = {
        source: mean(found[k]["steering_rate_energy"] for k in compared) for source, found in runs.items()
    }
    share = (energy["detected"] - energy["known"]) / (energy["raw"] - energy["known"])
    clearance = min(one["min_clearance_m"] for one in runs["detected"])
    figures.update(docked=docked, compared=len(compared), steering_rate_energy=energy, excess_share=share)
    figures.update(min_clearance_m=clearance, runs=runs["detected"])
    assert docked["detected"] >= DOCKED_AT_LEAST
    assert docked["detected"] >= docked["raw"]
    assert clearance > 0.0
    assert energy["raw"] > energy["known"]
    assert share <= EXCESS_SHARE


@pytest.mark.parametrize("seed", range(10))
@pytest.mark.parametrize("name", ["docking_moving_goal", "docking_blackout"])
def test_moving_goal_and_blackout_dock_on_the_true_goal(
    name: str, seed: int, figures: dict[str, Any]
) -> None:
    found = run(load_scenario(name), seed, GoalSource.DETECTED)
    figures.update(found)
    assert found["docked"]
    assert found["min_clearance_m"] > 0.0
