"""Obstacles and walls on a given path: stopped before, passed, docked close to; tests/acceptance has more."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from benchmarks.encounters import Car, Drive, drive, on_lane, square
from geometry import Pose2
from rti_mpcc import ControllerConfig, Reason
from rti_mpcc.config import Vehicle
from rti_mpcc.simulation import Scenario, docking_controller, simulate, summary
from rti_mpcc.types import Array, Status
from tests.lists import acceptance
from tests.rti_mpcc.docking_runs import (
    BODY_HALF_WIDTH,
    FREE_SIDE,
    Clocked,
    before_a_wall,
    box,
    docking_figures,
    granting,
    present,
    straight,
    wall,
)
from tests.rti_mpcc.yards import block

FRONT, REAR = Vehicle().front, Vehicle().rear
NOISE = [0.005, 0.005, 0.002, 0.01, 0.002]
"""Of the measured state."""
FOREVER = 1e9


# -- stopped before --------------------------------------------------------------------------------------

WAITS, GONE = 24.0, 35.0
"""When it stands at the latest, and when the wall is taken away [s]."""


@pytest.mark.parametrize("begin", [0.0, acceptance(3.0)])
@pytest.mark.parametrize("direction", [1, acceptance(-1)])
def test_stops_before_a_wall_whose_gaps_are_too_narrow_and_resumes_when_it_is_gone(
    direction: int, begin: float
) -> None:
    scenario = straight(direction, 16.0, corridor={"left": 4.0, "right": -4.0}, duration=GONE + 20.0)
    outline = wall(scenario.build_path(), 12.0, 3.0)
    result = simulate(scenario, obstacles_at=present(outline, begin, GONE))
    found, cycles, truth = docking_figures(result), result.cycles, result.truth
    waiting = (truth.times > WAITS) & (truth.times < GONE)
    assert np.abs(truth.v[waiting]).max() <= 0.02
    # Seen from rest another route is looked for first; there is none.
    assert begin or cycles.status[int(2.0 / 0.05)] is Status.PLANNING
    assert set(cycles.status[int(WAITS / 0.05) : int((GONE - 0.1) / 0.05)]) == {Status.BLOCKED}
    assert Status.FAILED not in cycles.status
    assert found["docked"]
    assert found["min_clearance_m"] > 0.05


def test_a_wall_that_comes_into_view_on_a_long_path_is_stopped_before_on_the_path() -> None:
    """A cruise gets farther along the path aslant before it than straight; it was known from the start."""
    scenario = straight(1, 90.0, speed=3.0, duration=32.0)
    result = simulate(scenario, obstacles_at=present(wall(scenario.build_path(), 50.0, 3.2), 0.0, 99.0))
    assert any(
        "a stop in front of an obstacle: obstacles[0] at (49." in reason for reason in result.cycles.reason
    )
    assert result.cycles.status[-1] is Status.BLOCKED
    assert abs(result.truth.v[-1]) <= 0.02
    assert 50.0 - result.truth.poses[-1, 0] < FRONT + 2.0
    assert np.abs(result.truth.poses[-1, 1:]).max() < 0.05


def on_a_lane(obstacles_at: Any, seconds: float, *, v: float = 0.0) -> Drive:
    """A straight lane of 40 m, 4 m to both sides."""
    car = Car(config=ControllerConfig(dead_time=0.18))
    controller, start = on_lane(40.0, 4.0, car.config), Pose2(0.0, 0.0, 0.0)
    return drive(controller, car, start, seconds, obstacles_at=obstacles_at, v=v)


@pytest.mark.parametrize("ahead", [1.2, 2.0])
def test_a_wall_that_appears_close_ahead_is_braked_for_as_hard_as_it_needs(ahead: float) -> None:
    """At 2 m/s: comfort alone takes 5 m."""
    there = block(FRONT + ahead, -4.0, FRONT + ahead + 0.5, 4.0)
    found = on_a_lane(lambda now: [there], 6.0, v=2.0)
    hardest = max(-command.acceleration for command in found.commands)
    needed = 2.0**2 / (2.0 * (ahead - 2.0 * 0.18))
    assert needed < hardest <= 5.0
    assert found.contacts == ()


def walker(x: float, y: float, speed: float, begin: float = 0.0) -> Any:
    """Somebody who walks across the lane, to its left."""
    return lambda now: [square(x, y + speed * max(now - begin, 0.0), 0.6)]


@pytest.mark.parametrize(
    ("x", "y", "speed", "begin"),
    [(16.0, -7.0, 1.0, 2.0), acceptance(12.0, -7.0, 0.8, 0.0), acceptance(20.0, -5.0, 0.5, 2.0)],
)
def test_somebody_who_walks_across_is_waited_for_and_never_touched(
    x: float, y: float, speed: float, begin: float
) -> None:
    found = on_a_lane(walker(x, y, speed, begin), 60.0)
    assert found.docked
    assert found.clearance > 0.3
    assert Reason.CONTACT_AHEAD in {command.diagnostics.cause for command in found.commands}


# -- passed ----------------------------------------------------------------------------------------------


def half_closed(direction: int, side: int, length: float, duration: float = 60.0) -> Scenario:
    """A straight path with 5 m of room on one side, left (1) or right (-1), and 1.5 m on the other."""
    room = sorted((5.0 * side, -1.5 * side))
    return straight(direction, length, corridor={"left": room[1], "right": room[0]}, duration=duration)


def obstacle(scenario: Scenario, side: int, theta: float) -> Array:
    """Outline (4, 2) of a square on the path that reaches 0.3 m to the closed side, 1.1 m to the open one."""
    right, left = sorted((-0.3 * side, 1.1 * side))
    return box(scenario.build_path().parts[0], theta, right, left, 1.4)


SIDES = [(1, 1), acceptance(-1, -1), acceptance(1, -1), acceptance(-1, 1)]


@pytest.mark.parametrize(("direction", "side"), SIDES)
@pytest.mark.parametrize(
    ("length", "theta", "begin"),
    [(30.0, 8.0, 0.0), acceptance(30.0, 14.0, 0.0), acceptance(50.0, 26.0, 5.0), acceptance(50.0, 20.0, 3.0)],
)
def test_it_passes_an_obstacle_on_the_side_where_there_is_room(
    direction: int, side: int, length: float, theta: float, begin: float
) -> None:
    scenario = half_closed(direction, side, length)
    result = simulate(scenario, obstacles_at=present(obstacle(scenario, side, theta), begin, FOREVER))
    found, truth = docking_figures(result), result.truth
    assert found["docked"]
    assert found["min_clearance_m"] > 0.05
    assert Status.BLOCKED not in result.cycles.status
    under_way = (truth.times > 3.0) & (truth.times < 20.0)
    assert not begin or np.abs(truth.v[under_way]).min() > 0.5


@pytest.mark.acceptance
@pytest.mark.parametrize(("theta", "begin"), [(8.0, 0.0), (20.0, 3.0), (26.0, 5.0)])
@pytest.mark.parametrize("direction", [1, -1])
@pytest.mark.parametrize("iterations", [1, 2, 4])
def test_it_does_so_with_few_iterations_a_cycle(
    theta: float, begin: float, direction: int, iterations: int
) -> None:
    scenario = half_closed(direction, 1, 50.0, duration=80.0)  # a route is planned in one slice a cycle
    result = simulate(
        scenario,
        controller=Clocked(docking_controller(scenario), lambda now: granting(iterations)),
        obstacles_at=present(obstacle(scenario, 1, theta), begin, FOREVER),
    )
    found = docking_figures(result)
    assert found["docked"]
    assert found["min_clearance_m"] > 0.05


# -- docked close to -------------------------------------------------------------------------------------


def before_wall(direction: int, room: float) -> list[Any]:
    scenario = before_a_wall(direction, room)
    return [outline.tolist() for outline in scenario.build_corridor(scenario.build_path()).obstacles]


def between_blocks(direction: int, room: float) -> list[Any]:
    """Two blocks `room` ahead of the body at the goal, with a gap of half its width between them."""
    corner = np.array([12.0 + room + (FRONT if direction > 0 else REAR), 0.5 * BODY_HALF_WIDTH])
    block = corner + np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.5), (0.0, 1.5)])
    return [(block * [direction, side]).tolist() for side in (1, -1)]


@pytest.mark.parametrize(
    ("things", "direction", "room", "noise"),
    [
        (before_wall, 1, 0.3, NOISE),
        (before_wall, -1, 0.1, None),
        (between_blocks, -1, 0.16, NOISE),
        *(acceptance(before_wall, d, 0.3, noise) for d, noise in ((1, None), (-1, None), (-1, NOISE))),
        *(acceptance(between_blocks, d, 0.16, noise) for d, noise in ((1, None), (-1, None), (1, NOISE))),
    ],
)
def test_it_docks_close_to_walls_and_corners(things: Any, direction: int, room: float, noise: Any) -> None:
    told = {} if noise is None else {"state_noise": noise}
    outlines = things(direction, room)
    result = simulate(
        straight(direction, 12.0, corridor={"obstacles": outlines}, duration=40.0, **told), seed=1
    )
    figures = summary(result)
    assert figures["docked"]
    assert figures["min_clearance_m"] == pytest.approx(room, abs=0.03)
    assert figures["time_to_dock_s"] < 20.0
    assert figures["fallback_cycles"] == 0
    assert figures["solver"]["failures"] == 0


@pytest.mark.acceptance
@pytest.mark.parametrize(("direction", "offset"), [(1, 0.0175), (-1, 0.0175), (-1, -0.0175)])
def test_noise_beside_a_wall_is_not_answered_with_all_the_steering(direction: int, offset: float) -> None:
    """16 m between walls that leave 0.25 m on either side, 0.3 m beside the path, at up to 2.3 m/s."""
    half = BODY_HALF_WIDTH + FREE_SIDE
    walls = {"from": 12.0, "to": 28.0, "left": 0.3 + half, "right": 0.3 - half}
    scenario = straight(
        direction, corridor={"narrowings": [walls]}, state_noise=NOISE, steering_offset=offset
    )
    figures = summary(simulate(scenario, seed=1))
    assert figures["docked"]
    assert figures["min_clearance_m"] > 0.09
    assert figures["solver"]["failures"] == 0
    assert figures["peak"]["steering_rate"] < 0.5
    assert figures["energy"]["steering_rate"] < 0.15
