"""A goal close to which corners of obstacles stand, in closed loop."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from rti_mpcc.config import Vehicle
from rti_mpcc.simulation import Scenario, simulate, summary
from tests.rti_mpcc.docking_runs import straight

LENGTH = 12.0
ROOM = 0.16
NOISE = [0.005, 0.005, 0.002, 0.01, 0.002]
"""Of the measured state."""


def between_blocks(direction: int, **simulation: Any) -> Scenario:
    """Two blocks `ROOM` ahead of the body at the goal, with a gap of half its width between them."""
    vehicle = Vehicle()
    leading = vehicle.front if direction > 0 else vehicle.rear
    corner = np.array([LENGTH + leading + ROOM, 0.25 * vehicle.width])
    block = corner + np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.5), (0.0, 1.5)])
    outlines = [(block * [direction, side]).tolist() for side in (1, -1)]
    return straight(direction, LENGTH, corridor={"obstacles": outlines}, duration=40.0, **simulation)


@pytest.mark.parametrize("noise", [pytest.param(None, marks=pytest.mark.acceptance), NOISE])
@pytest.mark.parametrize("direction", [pytest.param(1, marks=pytest.mark.acceptance), -1])
def test_it_docks_between_corners(direction: int, noise: list[float] | None) -> None:
    told = {} if noise is None else {"state_noise": noise}
    figures = summary(simulate(between_blocks(direction, **told), seed=1))
    assert figures["docked"]
    assert figures["min_clearance_m"] == pytest.approx(ROOM, abs=0.03)
    assert figures["time_to_dock_s"] < 20.0
    assert figures["fallback_cycles"] == 0
    assert figures["solver"]["failures"] == 0
