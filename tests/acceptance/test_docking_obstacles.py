"""A wall across the corridor, and passages hardly wider than the body."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from rti_mpcc.simulation import Scenario, load_scenario, simulate
from rti_mpcc.simulation.metrics import body_clearances
from rti_mpcc.types import Status
from tests.rti_mpcc.docking_runs import (
    between_obstacles,
    docking_figures,
    narrow,
    present,
    statuses,
    straight,
    wall,
)

LEAST_WAIT = 2.0
"""A vehicle that is stopped by a wall stands before it so long at least [s]."""


def drive_to_a_wall(
    scenario: Scenario,
    figures: dict[str, Any],
    *,
    theta: float,
    begin: float,
    end: float,
    half_width: float = 3.2,
) -> None:
    """It stops before a wall that is there from `begin` to `end` [s], goes on when it is gone, and docks.

    Or it goes round, where the open ends of the corridor leave another way.
    """
    outline = wall(scenario.build_path(), theta, half_width)
    result = simulate(scenario, obstacles_at=present(outline, begin, end))
    found, cycles, truth = docking_figures(result), result.cycles, result.truth
    figures.update(found)
    figures["statuses"] = statuses(result)
    figures["largest_deceleration"] = float(np.abs(truth.acceleration).max())
    there = (truth.times >= begin) & (truth.times < end)
    standing = there & (np.abs(truth.v) <= 0.02) & (truth.times > 1.0)
    figures["stands_before_the_wall_s"] = float(np.count_nonzero(standing) * 0.01)
    if standing.any():
        figures["clearance_standing_m"] = float(body_clearances(result)[np.flatnonzero(standing)[-1]])
    last = int(np.flatnonzero(cycles.times < end)[-1])
    assert found["min_clearance_m"] > 0.0
    goes_round = result.replans > 0
    figures["goes_round"] = goes_round
    if not goes_round:
        assert abs(truth.v[np.searchsorted(truth.times, end) - 1]) <= 0.02
        assert figures["stands_before_the_wall_s"] >= LEAST_WAIT
        assert cycles.status[last] in (Status.BLOCKED, Status.PLANNING)
    assert found["docked"]
    assert cycles.status[-1] is Status.DOCKED


@pytest.mark.parametrize("direction", [1, -1])
@pytest.mark.parametrize(
    ("length", "speed", "theta", "begin", "end"),
    [
        (40.0, None, 20.0, 0.0, 30.0),
        (40.0, 3.0, 20.0, 0.0, 30.0),
        (120.0, 3.0, 60.0, 0.0, 50.0),  # far away
        (120.0, 3.0, 40.0, 12.0, 50.0),  # suddenly in a cruise
        (40.0, None, 24.0, 9.0, 40.0),  # suddenly in an arrival
        (40.0, None, None, 0.0, 20.0),  # close to the start
    ],
)
def test_a_wall_across_a_straight(
    length: float,
    speed: float | None,
    theta: float | None,
    begin: float,
    end: float,
    direction: int,
    figures: dict[str, Any],
) -> None:
    theta = theta or (5.5 if direction == 1 else 2.5)
    drive_to_a_wall(straight(direction, length, speed=speed), figures, theta=theta, begin=begin, end=end)


@pytest.mark.parametrize(("name", "theta"), [("docking_inside", 15.0), ("docking_full_course", 18.0)])
@pytest.mark.parametrize("begin", [0.0, 4.0])
def test_a_wall_in_a_bend(name: str, theta: float, begin: float, figures: dict[str, Any]) -> None:
    drive_to_a_wall(load_scenario(name), figures, theta=theta, begin=begin, end=begin + 26.0, half_width=4.9)


@pytest.mark.parametrize("passage", [narrow, between_obstacles])
@pytest.mark.parametrize("aside", [0.0, 0.8, -0.8])
@pytest.mark.parametrize("direction", [1, -1])
def test_a_passage_with_a_quarter_metre_on_either_side(
    direction: int, aside: float, passage: Callable[[int, float], Scenario], figures: dict[str, Any]
) -> None:
    result = simulate(passage(direction, aside))
    found = docking_figures(result)
    figures.update(found)
    figures["statuses"] = statuses(result)
    assert found["docked"]
    assert found["min_clearance_m"] > 0.0
    assert found["direction_changes"] == 0
