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
