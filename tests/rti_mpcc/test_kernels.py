"""Kernels compute what they do uncompiled."""

from __future__ import annotations

import json

import numpy as np
import pytest
from numba.core import config

from rti_mpcc.simulation import changed, load_scenario, simulate
from tests.lists import some_of
from tests.processes import printed

SECONDS = 0.8
DRIVE = (
    "import json, sys; from tests.rti_mpcc import test_kernels as t; print(json.dumps(t.driven(sys.argv[1])))"
)


def driven(scenario: str) -> list[float]:
    """Commands and iterations of the cycles of the first seconds."""
    cycles = simulate(changed(load_scenario(scenario), {"simulation.duration": SECONDS})).cycles
    return [*map(float, cycles.speed), *map(float, cycles.steering), *map(float, cycles.iterations)]


@pytest.mark.skipif(config.DISABLE_JIT, reason="there is nothing compiled")
@pytest.mark.parametrize("scenario", some_of(["docking_behind", "docking_inside"]))
def test_a_vehicle_is_driven_alike_uncompiled(scenario: str) -> None:
    uncompiled = json.loads(printed("-c", DRIVE, scenario, NUMBA_DISABLE_JIT="1"))
    assert len(uncompiled) > 3 * SECONDS / 0.1
    np.testing.assert_allclose(driven(scenario), uncompiled, rtol=1e-6, atol=1e-6)
