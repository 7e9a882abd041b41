"""A vehicle that is no rectangle docks where only its own shape fits."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import shapely

from benchmarks.problems.variants import mirrored, turned_round
from geometry import Pose2
from rti_mpcc.config import Vehicle
from rti_mpcc.model.footprint import body_of, body_polygons
from rti_mpcc.simulation import RunResult, Scenario, simulate, summary
from rti_mpcc.simulation.metrics import errors_to
from rti_mpcc.simulation.scenario import changed, load_scenario, save_scenario
from tests.lists import some_of
from tests.rti_mpcc.docking_runs import on_segments

FORKS = ((-0.4, -0.6), (1.0, -0.6), (1.0, -0.3), (2.2, -0.3), (2.2, 0.3), (1.0, 0.3), (1.0, 0.6), (-0.4, 0.6))
"""A body 1.2 m wide with forks 0.6 m wide before it."""
ROOM = 0.1
"""Beside the forks at the goal, between two blocks [m]."""


def forklift() -> Scenario:
    """Round a bend, and with the forks between two blocks that the body has no room between."""
    scenario = on_segments(
        [(1, 0.15, 5.0), (1, 0.0, 5.0)],
        vehicle={"wheelbase": 1.1, "outline": [list(point) for point in FORKS]},
        limits={"speed": 1.5, "acceleration": 1.0, "steering": 0.7, "steering_rate": 1.0},
        corridor={"left": 1.5, "right": -1.5},
        goal={"offset": [0.0, 0.0, 0.0]},
        simulation={"dead_time": 0.1},
    )
    goal = scenario.build_path().end
    blocks = []
    for low, high in ((0.3 + ROOM, 1.3), (-1.3, -0.3 - ROOM)):
        corners = ((1.15, low), (2.6, low), (2.6, high), (1.15, high))
        blocks.append([[at.x, at.y] for at in (goal.compose(Pose2(*corner, 0.0)) for corner in corners)])
    return changed(scenario, {"corridor.obstacles": blocks})


@pytest.fixture(scope="module")
def scenario() -> Scenario:
    return forklift()


@pytest.fixture(scope="module")
def usual(scenario: Scenario) -> RunResult:
    return simulate(scenario)


def test_the_forks_dock_where_a_rectangle_would_not_fit(scenario: Scenario, usual: RunResult) -> None:
    figures = summary(usual)  # shapely's clearance of the outline
    assert figures["docked"]
    assert figures["min_clearance_m"] > 0.5 * ROOM
    assert figures["fallback_cycles"] == 0
    box = Vehicle(wheelbase=1.1, width=1.2, front=2.2, rear=0.4)
    bodies = shapely.polygons(body_polygons(usual.truth.poses[-1:], box))
    assert scenario.corridor is not None
    assert any(shapely.Polygon(each).intersects(bodies[0]) for each in scenario.corridor.obstacles)


@pytest.mark.parametrize("variant", some_of([mirrored, turned_round]))
def test_it_docks_as_well_mirrored_and_the_other_way_round(
    variant: Callable[[Scenario], Scenario], scenario: Scenario, usual: RunResult
) -> None:
    other = simulate(variant(scenario))
    assert summary(other)["docked"]
    assert summary(other)["time_to_dock_s"] == pytest.approx(summary(usual)["time_to_dock_s"], abs=0.1)
    last = np.abs([errors_to(one.truth.goals, one.truth.poses)[-1] for one in (usual, other)])
    assert last[0] == pytest.approx(last[1], abs=2e-3)


def test_an_outline_that_is_the_rectangle_is_driven_like_it() -> None:
    box = Vehicle()
    half = 0.5 * box.width
    corners = [(-box.rear, -half), (box.front, -half), (box.front, half), (-box.rear, half)]
    outlined = Vehicle(outline=tuple(corners))
    assert (outlined.width, outlined.front, outlined.rear) == (box.width, box.front, box.rear)
    np.testing.assert_array_equal(body_of(outlined).corners, body_of(box).corners)
    states = np.array([[1.0, 2.0, 0.3]])
    np.testing.assert_array_equal(body_polygons(states, outlined), body_polygons(states, box))


def test_a_scenario_file_keeps_the_outline(scenario: Scenario, tmp_path: Path) -> None:
    file = save_scenario(scenario, tmp_path)
    assert load_scenario(file) == scenario
    assert scenario.vehicle.outline == FORKS
