"""Kernels compute what they do uncompiled."""

from __future__ import annotations

import json

import numpy as np
import pytest
from numba.core import config

from tests.lists import some_of
from tests.processes import printed

SECONDS = 0.8
DRIVE = f"""
import json, sys
from rti_mpcc.simulation import changed, load_scenario, simulate
from tests.lists import some_of
result = simulate(changed(load_scenario(sys.argv[1]), {{"simulation.duration": {SECONDS}}}))
cycles = result.cycles
print(json.dumps([*cycles.speed, *cycles.steering, *map(float, cycles.iterations)]))
"""


def driven(scenario: str, **environment: str) -> list[float]:
    """Commands and iterations of the cycles of the first seconds."""
    found: list[float] = json.loads(printed("-c", DRIVE, scenario, **environment))
    return found


@pytest.mark.skipif(config.DISABLE_JIT, reason="there is nothing compiled")
@pytest.mark.parametrize("scenario", some_of(["docking_behind", "docking_inside"]))
def test_a_vehicle_is_driven_alike_uncompiled(scenario: str) -> None:
    uncompiled = driven(scenario, NUMBA_DISABLE_JIT="1")
    assert len(uncompiled) > 3 * SECONDS / 0.1
    np.testing.assert_allclose(driven(scenario), uncompiled, rtol=1e-6, atol=1e-6)
