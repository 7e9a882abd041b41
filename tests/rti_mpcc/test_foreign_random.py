"""A foreign vehicle with everything at random docks, stays, and accuses no healthy sensor."""

from __future__ import annotations

import pytest

from benchmarks.foreign_random import drawn, faults
from tests.lists import acceptance

SWINGING, ACCUSED = (50_044, 50_046), 71_225  # by a dead band, a creep torque and a lag; its steering
CORRECTED, UNREAD = (71_031, 71_148), 71_310  # the goal, or no state can be read, while it is held
FURTHER = (*range(30_001, 30_006), SWINGING[1], CORRECTED[1], UNREAD)
SEEDS = [30_000, SWINGING[0], ACCUSED, CORRECTED[0], *map(acceptance, FURTHER)]


@pytest.mark.parametrize("seed", SEEDS)
def test_a_foreign_vehicle_docks_whatever_an_integrator_has(seed: int) -> None:
    draw = drawn(seed)
    assert faults(draw, draw.drive()) == []
