"""A goal with a wall close ahead of the vehicle there, in closed loop."""

from __future__ import annotations

from typing import Any

import pytest

from rti_mpcc.config import Vehicle
from rti_mpcc.simulation import Scenario, simulate, summary
from rti_mpcc.types import Status
from tests.rti_mpcc.docking_runs import straight

LENGTH, THICKNESS = 12.0, 0.3
NOISE = [0.005, 0.005, 0.002, 0.01, 0.002]
"""Of the measured state."""


def before_a_wall(direction: int, room: float, **simulation: Any) -> Scenario:
    """A wall 3 m wide across the way, `room` [m] ahead of the body's leading end at the goal."""
    vehicle = Vehicle()
    leading = vehicle.front if direction > 0 else vehicle.rear
    near = LENGTH + leading + room
    begin, end = direction * near, direction * (near + THICKNESS)
    outline = [[begin, -1.5], [end, -1.5], [end, 1.5], [begin, 1.5]]
    return straight(direction, LENGTH, corridor={"obstacles": [outline]}, duration=40.0, **simulation)


@pytest.mark.parametrize("noise", [pytest.param(None, marks=pytest.mark.acceptance), NOISE])
@pytest.mark.parametrize("direction", [1, pytest.param(-1, marks=pytest.mark.acceptance)])
def test_it_docks_before_a_wall(direction: int, noise: list[float] | None) -> None:
    told = {} if noise is None else {"state_noise": noise}
    result = simulate(before_a_wall(direction, 0.3, **told), seed=1)
    figures = summary(result)
    assert figures["docked"]
    assert result.cycles.status[-1] is Status.DOCKED
    assert figures["min_clearance_m"] == pytest.approx(0.3, abs=0.02)
    assert figures["time_to_dock_s"] < 20.0
    assert figures["fallback_cycles"] == 0
    assert figures["solver"]["failures"] == 0


@pytest.mark.acceptance
@pytest.mark.parametrize("direction", [pytest.param(1, marks=pytest.mark.acceptance), -1])
def test_it_docks_as_near_as_the_margin_lets_it(direction: int) -> None:
    """0.1 m."""
    figures = summary(simulate(before_a_wall(direction, 0.1)))
    assert figures["docked"]
    assert figures["min_clearance_m"] > 0.08
