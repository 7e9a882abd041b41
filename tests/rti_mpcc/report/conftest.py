"""A real run, made once."""

from __future__ import annotations

from typing import Any

import pytest

from rti_mpcc.report.film import Film, film_of_run
from rti_mpcc.report.views import ObservedCycle, Observer
from rti_mpcc.simulation import (
    RunResult,
    changed,
    docking_controller,
    load_scenario,
    simulate,
    summary,
)


@pytest.fixture(scope="session")
def looked_at() -> tuple[RunResult, list[ObservedCycle]]:
    wall = [[-6.0, 0.0], [-5.5, 0.0], [-5.5, 2.0]]
    changes = {"corridor.obstacles": [wall], "simulation.duration": 3.2, "simulation.cycle": 0.1}
    scenario = changed(load_scenario("docking_full_course"), changes)
    observer = Observer(docking_controller(scenario))
    return simulate(scenario, controller=observer), observer.observed


@pytest.fixture(scope="session")
def run(looked_at: tuple[RunResult, list[ObservedCycle]]) -> RunResult:
    return looked_at[0]


@pytest.fixture(scope="session")
def film(looked_at: tuple[RunResult, list[ObservedCycle]]) -> Film:
    return film_of_run(*looked_at)


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
