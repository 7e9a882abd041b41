"""A vehicle that cannot get on along its path plans another way, in closed loop."""

from __future__ import annotations

from itertools import groupby
from math import radians

import pytest

from geometry import Pose2
from rti_mpcc.docking import DockingController
from rti_mpcc.simulation import (
    RunResult,
    Scenario,
    changed,
    docking_controller,
    load_scenario,
    simulate,
    summary,
)
from rti_mpcc.types import Status
from tests.lists import acceptance, some_of
from tests.rti_mpcc.docking_runs import drive, on_segments, straight

LENGTH, ASIDE = 20.0, 0.6


def beside_a_wall(side: int) -> Scenario:
    """A goal 1.1 m before the end of an S, near the wall on the outside of its last bend and turned."""
    segments, start = [(1, side * -0.08, 8.0), (1, side * 0.11, 8.8)], (4.0, -3.0, 3.0)  # headings pass pi
    return on_segments(segments, start, goal={"offset": [-1.1, side * -1.3, side * 0.3]})


def said(result: RunResult) -> list[Status]:
    return [status for status, _ in groupby(result.cycles.status)]


def assert_docked(result: RunResult, within: float) -> None:
    """In this time [s], clear of everything, by one other way."""
    figures = summary(result)
    assert figures["docked"]
    assert figures["time_to_dock_s"] < within
    assert figures["min_clearance_m"] > 0.05
    assert figures["planning"]["replans"] == 1


# -- from rest: a goal that the path does not lead to ------------------------------------------------------


@pytest.mark.parametrize("side", some_of([1, -1]))
def test_a_goal_turned_against_the_bend_is_come_to_by_another_way(side: int) -> None:
    result = simulate(beside_a_wall(side))
    assert_docked(result, 30.0)
    assert said(result)[0] is Status.PLANNING
    assert Status.STALLED not in said(result)
    assert summary(result)["direction_changes"] == 1


@pytest.mark.parametrize("turn", [-60.0, *map(acceptance, (-90.0, 180.0))])
def test_a_start_turned_off_the_path_is_driven_from(turn: float) -> None:
    turned = {"simulation.start_offset": [0.0, 0.0, radians(turn)], "simulation.cycle": 0.1}
    result = simulate(changed(load_scenario("docking_inside"), turned))
    assert_docked(result, 45.0)


def test_a_goal_that_the_last_part_of_a_path_misses_is_come_to_by_another_way_from_the_start() -> None:
    """Forward, then 8 m in reverse to a goal 2.5 m aside."""
    segments, wide = [(1, 0.05, 12.0), (-1, 0.1, 8.0)], {"left": 4.0, "right": -4.0}
    goal = {"offset": [0.5, 2.5, 0.3]}
    result = simulate(on_segments(segments, (3.0, -2.0, 2.9), corridor=wide, goal=goal))
    figures = summary(result)
    assert result.cycles.reason[0].startswith("planning a route: ")
    assert figures["docked"]
    assert figures["direction_changes"] <= 1
    assert figures["time_to_dock_s"] <= 1.15 * figures["expected_time_s"]
    assert figures["min_clearance_m"] > 0.0
    assert figures["planning"]["replans"] == 1


# -- a goal that moves --------------------------------------------------------------------------------------


@pytest.mark.acceptance
@pytest.mark.parametrize("direction", [1, -1])
def test_a_goal_that_jumps_aside_at_the_end_is_come_to_by_another_way(direction: int) -> None:
    goals = [Pose2(direction * LENGTH, y, 0.0) for y in (0.0, ASIDE)]
    scenario = straight(direction, LENGTH)
    run = list(drive(scenario, 60.0, goal_at=lambda now: goals[now > 16.0]))
    plant, command = run[-1]
    assert command.docked
    error = Pose2(plant.x, plant.y, plant.phi).relative_to(goals[1])
    assert max(abs(error.x), abs(error.y)) <= 0.05
    # It does not try to get there from where it cannot: no acceleration beyond twice comfort.
    peak = max(abs(command.acceleration) for _, command in run[:-20])
    assert peak < 1.2


# -- what the user sees -------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def left() -> DockingController:
    """One that has left its path for another way."""
    scenario = beside_a_wall(1)
    controller = docking_controller(scenario)
    for _ in drive(scenario, 5.0, controller=controller):
        pass
    return controller


def test_the_controller_tells_of_its_other_way(left: DockingController) -> None:
    manoeuvre = left.manoeuvre
    assert manoeuvre is not None
    assert manoeuvre.found
    assert left.replans == 1
    assert left.path is not None
    assert left.path.parts[0] is manoeuvre.segments[0].part
    assert left.corridor.area is not None
    assert left.planning_seconds > 0.0
