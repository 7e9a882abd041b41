"""Real runs, made once."""

from __future__ import annotations

from typing import Any

import pytest

from rti_mpcc.report.ride import Observer, Ride, ride_of_run
from rti_mpcc.simulation import RunResult, Scenario, changed, driver_of, load_scenario, simulate, summary


def driven(scenario: Scenario, **how: Any) -> tuple[RunResult, Ride]:
    """A run, and the same as a ride."""
    observer = Observer(driver_of(scenario))
    result = simulate(scenario, controller=observer, **how)
    return result, ride_of_run(result, observer.moments)


@pytest.fixture(scope="session")
def run_and_ride() -> tuple[RunResult, Ride]:
    """3.2 s along a path of two segments, beside an obstacle."""
    wall = [[-6.0, 0.0], [-5.5, 0.0], [-5.5, 2.0]]
    changes = {"corridor.obstacles": [wall], "simulation.duration": 3.2, "simulation.cycle": 0.1}
    return driven(changed(load_scenario("docking_full_course"), changes))


@pytest.fixture(scope="session")
def run(run_and_ride: tuple[RunResult, Ride]) -> RunResult:
    return run_and_ride[0]


@pytest.fixture(scope="session")
def ride(run_and_ride: tuple[RunResult, Ride]) -> Ride:
    return run_and_ride[1]


@pytest.fixture(scope="session")
def figures(run: RunResult) -> dict[str, Any]:
    return summary(run)


@pytest.fixture(scope="session")
def detected() -> tuple[RunResult, Ride]:
    """The goal is found, moves, and is lost from sight; every fifth detection is wrong by a metre."""
    changes = {
        "simulation.duration": 7.0,
        "simulation.cycle": 0.1,
        "goal.measurement.visible_range": 25.0,
        "goal.measurement.blind_range": 22.0,
        "goal.measurement.outlier": 0.2,
        "goal.shifts": [{"at_distance": 23.0, "offset": [0.1, 0.1, 0.03]}],
    }
    return driven(changed(load_scenario("docking_blackout"), changes), seed=1)
