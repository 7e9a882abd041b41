"""The narrow places that are drawn are as narrow as they say, and one of each is docked in."""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np
import pytest

from benchmarks.measure_narrow import LANE_ROOM, VEHICLE, bay, before_a_wall, lanes
from rti_mpcc.model.footprint import clearances
from rti_mpcc.simulation import Scenario, simulate, summary
from tests.lists import in_fast_suite


def room_at_the_goal(scenario: Scenario) -> float:
    """Least distance of the body at the goal to what is there [m]."""
    path = scenario.build_path()
    corridor = scenario.build_corridor(path)
    pose = np.array([[path.end.x, path.end.y, path.end.phi]])
    return float(clearances(pose, corridor, len(path.parts) - 1, VEHICLE).min())


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("room", [0.08, 0.25])
def test_bays_and_walls_leave_so_much_room(seed: int, room: float) -> None:
    for draw in (bay, before_a_wall):
        scenario = draw(np.random.default_rng(seed), room)
        assert room_at_the_goal(scenario) == pytest.approx(room, abs=2e-3)


def test_lanes_leave_so_much_room() -> None:
    drawn = lanes(np.random.default_rng(1))
    assert len(drawn) == 5
    for name, scenario in drawn.items():
        if name != "corner":
            assert room_at_the_goal(scenario) == pytest.approx(LANE_ROOM, abs=2e-3)


@pytest.mark.parametrize(
    ("draw", "seed"), in_fast_suite([(before_a_wall, 0)], product([bay, before_a_wall], range(12)))
)
def test_it_docks_with_a_tenth_of_a_metre(draw: Any, seed: int) -> None:
    found = summary(simulate(draw(np.random.default_rng(100 + seed), 0.1)))
    assert found["docked"]
    assert found["min_clearance_m"] > 0.03
    assert found["fallback_cycles"] == 0
