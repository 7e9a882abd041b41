"""Walls across the way that can neither be passed nor ignored; tests/acceptance has more of them."""

from __future__ import annotations

import numpy as np
import pytest

from rti_mpcc.simulation import simulate
from rti_mpcc.types import Status
from tests.rti_mpcc.docking_runs import between_obstacles, docking_figures, present, straight, wall

GONE = 35.0
"""When the wall is taken away [s]."""


@pytest.mark.parametrize("begin", [0.0, pytest.param(3.0, marks=pytest.mark.acceptance)])
@pytest.mark.parametrize("direction", [1, pytest.param(-1, marks=pytest.mark.acceptance)])
def test_stops_before_a_wall_whose_gaps_are_too_narrow_and_goes_on_when_it_is_gone(
    direction: int, begin: float
) -> None:
    scenario = straight(direction, 16.0, corridor={"left": 4.0, "right": -4.0}, duration=GONE + 20.0)
    outline = wall(scenario.build_path(), 12.0, 3.0)
    result = simulate(scenario, obstacles_at=present(outline, begin, GONE))
    found, cycles, truth = docking_figures(result), result.cycles, result.truth
    waiting = (truth.times > GONE - 1.0) & (truth.times < GONE)
    assert np.abs(truth.v[waiting]).max() <= 0.02
    # Seen from rest another way is looked for first; there is none.
    assert begin or cycles.status[int(2.0 / 0.05)] is Status.PLANNING
    assert cycles.status[int((GONE - 0.1) / 0.05)] is Status.BLOCKED
    assert Status.FAILED not in cycles.status
    assert found["docked"]
    assert found["min_clearance_m"] > 0.0


def test_a_wall_that_comes_into_view_on_a_long_path_is_stopped_before_on_the_path() -> None:
    """A cruise gets farther along the path aslant before it than straight; it was known from the start."""
    scenario = straight(1, 90.0, speed=3.0, duration=32.0)
    outline = wall(scenario.build_path(), 50.0, 3.2)
    result = simulate(scenario, obstacles_at=present(outline, 0.0, 99.0))
    makes_for_stop = "making for a stop before what is in the way: obstacles[0] at (49."
    assert any(reason.startswith(makes_for_stop) for reason in result.cycles.reason)
    assert result.cycles.status[-1] is Status.BLOCKED
    assert abs(result.truth.v[-1]) <= 0.02
    assert 50.0 - result.truth.poses[-1, 0] < scenario.vehicle.front + 2.0
    assert np.abs(result.truth.poses[-1, 1:]).max() < 0.05


@pytest.mark.acceptance
@pytest.mark.parametrize("length", [24.0, pytest.param(40.0, marks=pytest.mark.acceptance)])
def test_between_two_obstacles_it_finds_the_passage_from_near_and_from_far(length: float) -> None:
    """From far the first plan's end lies between them, and is not there yet after the usual iterations."""
    found = docking_figures(simulate(between_obstacles(1, length=length)))
    assert found["docked"]
    assert found["min_clearance_m"] > 0.0
