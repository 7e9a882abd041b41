"""Obstacles on the path that can be passed on one side, not the one that a guess along the path leads to."""

from __future__ import annotations

import numpy as np
import pytest

from rti_mpcc.simulation import Scenario, docking_controller, simulate
from rti_mpcc.types import Array, Status
from tests.rti_mpcc.docking_runs import Clocked, box, docking_figures, granting, present, statuses, straight

LENGTH = 1.4
FOREVER = 1e9


def half_closed(direction: int, side: int, length: float) -> Scenario:
    """A straight route with 5 m of room on one side, left (1) or right (-1), and 1.5 m on the other."""
    room = sorted((5.0 * side, -1.5 * side))
    return straight(direction, length, corridor={"left": room[1], "right": room[0]}, duration=60.0)


def obstacle(scenario: Scenario, side: int, theta: float) -> Array:
    """Outline (4, 2) of a square on the path that reaches 0.3 m to the closed side, 1.1 m to the open one."""
    right, left = sorted((-0.3 * side, 1.1 * side))
    return box(scenario.build_path().parts[0], theta, right, left, LENGTH)


ALL = [
    (1, 1),
    *(pytest.param(*each, marks=pytest.mark.acceptance) for each in ((-1, -1), (1, -1), (-1, 1))),
]


@pytest.mark.parametrize(("direction", "side"), ALL)
@pytest.mark.parametrize("theta", [8.0, pytest.param(14.0, marks=pytest.mark.acceptance)])
def test_it_passes_an_obstacle_on_the_side_where_there_is_room(
    direction: int, side: int, theta: float
) -> None:
    scenario = half_closed(direction, side, 30.0)
    outline = obstacle(scenario, side, theta)
    result = simulate(scenario, obstacles_at=present(outline, 0.0, FOREVER))
    found = docking_figures(result)
    assert found["docked"]
    assert found["min_clearance_m"] > 0.05
    assert Status.BLOCKED not in result.cycles.status


@pytest.mark.acceptance
@pytest.mark.parametrize(
    ("direction", "side"),
    [ALL[0], *(pytest.param(*each, marks=pytest.mark.acceptance) for each in ((-1, -1), (1, -1), (-1, 1)))],
)
@pytest.mark.parametrize(
    ("theta", "begin"), [(26.0, 5.0), pytest.param(20.0, 3.0, marks=pytest.mark.acceptance)]
)
def test_one_that_appears_while_it_drives_is_passed_without_a_stop(
    direction: int, side: int, theta: float, begin: float
) -> None:
    scenario = half_closed(direction, side, 50.0)
    outline = obstacle(scenario, side, theta)
    result = simulate(scenario, obstacles_at=present(outline, begin, FOREVER))
    found, truth = docking_figures(result), result.truth
    under_way = (truth.times > 3.0) & (truth.times < 20.0)
    assert found["docked"]
    assert found["min_clearance_m"] > 0.05
    assert np.abs(truth.v[under_way]).min() > 0.5


CUT = [
    pytest.param(*place, direction, iterations, marks=[pytest.mark.acceptance])
    for place in ((8.0, 0.0), (20.0, 3.0), (26.0, 5.0))
    for direction in (1, -1)
    for iterations in (1, 2, 4)
]


@pytest.mark.parametrize(("theta", "begin", "direction", "iterations"), CUT)
def test_the_search_goes_on_from_cycle_to_cycle_where_the_deadline_cuts_it(
    theta: float, begin: float, direction: int, iterations: int
) -> None:
    scenario = half_closed(direction, 1, 50.0)
    result = simulate(
        scenario,
        controller=Clocked(docking_controller(scenario), lambda now: granting(iterations)),
        obstacles_at=present(obstacle(scenario, 1, theta), begin, FOREVER),
    )
    found = docking_figures(result)
    assert found["docked"], statuses(result)
    assert found["min_clearance_m"] > 0.05
