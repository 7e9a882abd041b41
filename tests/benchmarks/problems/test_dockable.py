"""The proof: what it finds is feasible by an independent look, and what cannot be docked in is refused."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.problems.courses import CAMPAIGN, drawn_course
from benchmarks.problems.dockable import cramped, find_witness
from rti_mpcc.simulation import Scenario, changed, load_scenario
from tests.benchmarks.problems.witnesses import check, course


@pytest.mark.parametrize("index", range(4))
def test_witnesses_of_courses_are_feasible(index: int) -> None:
    check(drawn_course(1, index))


@pytest.mark.parametrize("index", range(4))
def test_witnesses_of_wider_courses_are_feasible(index: int) -> None:
    check(drawn_course(1, index, CAMPAIGN))


@pytest.mark.parametrize("name", ["docking_behind", "docking_inside", "long_approach", "path_following"])
def test_witnesses_of_built_in_scenarios_are_feasible(name: str) -> None:
    check(load_scenario(name))


@pytest.mark.acceptance
@pytest.mark.parametrize("direction", [pytest.param(1, marks=pytest.mark.acceptance), -1])
def test_a_goal_beside_a_long_way_is_reached_and_beside_a_short_one_not(direction: int) -> None:
    check(course(direction=direction))
    assert find_witness(course(direction=direction, length=1.0)) is None


def test_a_goal_without_room_for_the_body_is_refused() -> None:
    assert find_witness(course({"corridor.left": 3.1})) is None
    assert cramped(course({"corridor.left": 3.1}))
    check(course({"corridor.left": 3.2}))
    assert not cramped(course({"corridor.left": 3.2}))


def test_a_start_and_a_cusp_without_room_are_told() -> None:
    beside = [[0.0, 1.1], [1.0, 1.1], [1.0, 2.0], [0.0, 2.0]]
    assert cramped(course({"corridor.obstacles": [beside]}))
    cusp = [
        {"direction": -1, "curvature": 0.0, "length": 10.0},
        {"direction": 1, "curvature": 0.0, "length": 30.0},
    ]
    at_cusp = [[x - 10.0, y - 0.065] for x, y in beside]
    there_and_back = course({"path.segments": cusp, "corridor.obstacles": [at_cusp]})
    assert cramped(there_and_back)
    assert find_witness(there_and_back) is None
    # Within the tolerance of the cusp there is room.
    farther = [[x, y + 0.05] for x, y in at_cusp]
    assert not cramped(changed(there_and_back, {"corridor.obstacles": [farther]}))


def test_a_bend_that_the_vehicle_cannot_steer_is_refused() -> None:
    def bend(curvature: float) -> Scenario:
        segments = [{"direction": 1, "curvature": curvature, "length": 0.6 * np.pi / curvature}]
        return course({"path.segments": segments, "goal.offset": [0.0, 0.0, 0.0]})

    check(bend(0.15))
    assert find_witness(changed(bend(0.4), {"corridor.left": 1.4, "corridor.right": -1.4})) is None


@pytest.mark.acceptance
def test_a_swing_round_an_obstacle_takes_two_curves() -> None:
    def standing_in(left: float) -> Scenario:
        box = [[12.0, left], [13.0, left], [13.0, 3.5], [12.0, 3.5]]
        return course({"corridor.obstacles": [box], "goal.offset": [5.0, 1.0, 0.0]}, length=25.0)

    assert find_witness(standing_in(-2.0)) is None
    assert not check(standing_in(-0.2)).searched
