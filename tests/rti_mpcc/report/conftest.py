"""A real run, made once."""

from __future__ import annotations

from typing import Any

import pytest

from rti_mpcc.simulation import RunResult, changed, load_scenario, simulate, summary


@pytest.fixture(scope="session")
def run() -> RunResult:
    wall = [[-6.0, 0.0], [-5.5, 0.0], [-5.5, 2.0]]
    changes = {"corridor.obstacles": [wall], "simulation.duration": 3.2, "simulation.cycle": 0.1}
    return simulate(changed(load_scenario("docking_full_course"), changes))


@pytest.fixture(scope="session")
def figures(run: RunResult) -> dict[str, Any]:
    return summary(run)


@pytest.fixture(scope="session")
def watched() -> RunResult:
    """The goal is found, moves, and is lost from sight; every fifth detection is wrong by a metre."""
    changes = {
        "simulation.duration": 7.0,
        "simulation.cycle": 0.1,
        "goal.measurement.visible_range": 25.0,
        "goal.measurement.blind_range": 22.0,
        "goal.measurement.outlier": 0.2,
        "goal.shifts": [{"at_distance": 23.0, "offset": [0.1, 0.1, 0.03]}],
    }
    return simulate(changed(load_scenario("docking_blackout"), changes), seed=1)


@pytest.fixture(scope="session")
def watched_figures(watched: RunResult) -> dict[str, Any]:
    return summary(watched)
