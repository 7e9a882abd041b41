"""Starts outside the limits, at the boundary and off the path: the first plan leads back, and it docks."""

from __future__ import annotations

from functools import cache
from math import cos, radians, sin
from typing import Any, NamedTuple

import numpy as np
import pytest

from geometry import Pose2
from rti_mpcc.model.footprint import clearances
from rti_mpcc.simulation import Scenario, load_scenario
from rti_mpcc.simulation.plant import PlantState
from rti_mpcc.types import Command, Source, Status
from tests.lists import some_of
from tests.rti_mpcc.docking_runs import BODY_HALF_WIDTH, drive, on_segments

HALF, LENGTH, SPEED = 8.0, 25.0, 2.0
"""Half width of the corridor [m], length of the path [m], speed limit [m/s]."""
FRONT, REAR = 3.6775, 0.8027
"""Body ahead of and behind the rear axle [m]."""
ROOM = 0.6
"""What a start at a boundary leaves beside the body [m]. A body over one stands, see test_collisions.py."""
RETURN = 0.85
"""Share of a rate limit at which what is outside its limit returns at least."""

Run = tuple[tuple[PlantState, Command], ...]


class Start(NamedTuple):
    """Beside the place at `theta` [m]: to the left [m], turned [deg]; speed in the part's direction [m/s].

    All are meant for a forward part; on a reverse one the turn is the other way. With `at` the outermost
    corner of the body lies `ROOM` within the left (1) or right (-1) boundary, whatever `across` says. `goal`
    is how far behind the path's end the goal lies [m].
    """

    theta: float = 0.0
    across: float = 0.0
    turned: float = 0.0
    speed: float = 0.0
    steering: float = 0.0
    goal: float = 0.0
    at: int = 0


BEHIND = "behind the end"
"""No plan leads on along the path: another route is planned first."""
STARTS = {
    "steering left": Start(steering=0.7),
    "steering right, driving": Start(steering=-0.7, speed=1.0),
    "too fast": Start(speed=3.0),
    "against the direction": Start(speed=-1.0),
    "too fast against the direction": Start(speed=-3.0),
    "before the path": Start(theta=-3.0),
    BEHIND: Start(theta=LENGTH + 1.0),
    "behind the end, before the goal": Start(theta=LENGTH + 3.0, goal=8.0),
    "at the left boundary": Start(theta=2.0, at=1),
    "at the right boundary, turned": Start(theta=5.0, at=-1, turned=15.0),
    "left of the path": Start(across=2.0),
    "turned right": Start(turned=-60.0),
    "left, turned away, steered away, too fast": Start(across=1.5, turned=40.0, steering=0.7, speed=2.5),
    "right, turned back, before the path": Start(-2.0, -2.0, turned=60.0, steering=0.7, speed=1.0),
    "left, turned back, against the direction": Start(0.0, 2.0, turned=-60.0, steering=-0.7, speed=-1.0),
    "at the boundary, steered away, too fast": Start(5.0, at=1, turned=-15.0, steering=0.7, speed=2.5),
}


def lane(direction: int, goal: float) -> Scenario:
    """A straight that bends gently, with room to both sides; headings cross pi."""
    return on_segments(
        [(direction, 0.0, 10.0), (direction, 0.03, LENGTH - 10.0)],
        (1.0, 2.0, 3.0),
        corridor={"left": HALF, "right": -HALF},
        goal={"offset": [direction * goal, 0.0, 0.0]},
        limits={"speed": SPEED},
    )


@cache
def driven(name: str, direction: int) -> Run:
    """The run from a start until it has docked."""
    start, d = STARTS[name], direction
    scenario, across, turned = lane(d, start.goal), start.across, radians(start.turned)
    if start.at:
        reach = BODY_HALF_WIDTH * cos(turned) + (REAR if d > 0 else FRONT) * abs(sin(turned))
        across = start.at * (HALF - reach - ROOM)
    part = scenario.build_path().parts[0]
    theta = min(max(start.theta, part.start), part.end)
    pose = part.pose(theta).compose(Pose2(d * (start.theta - theta), across, d * turned))
    plant = PlantState(x=pose.x, y=pose.y, phi=pose.phi, v=d * start.speed, delta=d * start.steering)
    return tuple(drive(scenario, 40.0, start=plant, after_docking=0.0))


def cases() -> list[Any]:
    """Each start in both directions; every eighth one by default, all in acceptance."""
    chosen = [(name, direction) for name in STARTS for direction in (1, -1)]
    return some_of(chosen, 8)


@pytest.mark.parametrize(("name", "direction"), cases())
def test_from_the_first_cycle_on_a_plan_is_driven_and_it_docks(name: str, direction: int) -> None:
    run, start = driven(name, direction), STARTS[name]
    assert not [command.diagnostics.reason for _, command in run if command.diagnostics.failed]
    assert run[-1][1].docked, run[-1][1].diagnostics.reason
    (first, command), planning = run[0], [command.status is Status.PLANNING for _, command in run]
    if name == BEHIND:
        assert command.diagnostics.reason == "planning a route: the first plan misses the goal"
        assert all(plant.v == 0.0 for plant, _ in run[: planning.index(False)])
        return
    assert command.source is Source.SOLUTION, command.diagnostics.reason
    if abs(start.speed) > SPEED:
        assert np.sign(first.v) * command.acceleration <= -RETURN * 5.0
        late = first.time + 0.23 + (abs(first.v) - SPEED) / (RETURN * 5.0)
        assert all(abs(plant.v) <= SPEED + 0.01 for plant, _ in run if plant.time >= late)
    if abs(start.steering) > 0.6:
        assert np.sign(first.delta) * command.steering_rate <= -RETURN
        late = first.time + 0.23 + 0.1 / RETURN
        assert all(abs(plant.delta) <= 0.601 for plant, _ in run if plant.time >= late)
    if start.at:
        scenario = lane(direction, 0.0)
        poses = np.array([[plant.x, plant.y, plant.phi, 0.0, 0.0, 0.0] for plant, _ in run])
        corridor, vehicle = (
            scenario.build_corridor(scenario.build_path()),
            scenario.controller_config().vehicle,
        )
        clearance = clearances(poses, corridor, 0, vehicle).min(axis=1)
        assert clearance[0] == pytest.approx(ROOM, abs=0.05)
        assert clearance.min() > 0.0


@pytest.mark.acceptance
@pytest.mark.parametrize(("across", "turned"), [(2.0, 0.0), (-2.0, 0.0), (0.0, 60.0), (0.0, -60.0)])
@pytest.mark.parametrize("name", ["docking_inside", "docking_behind"])
def test_a_start_off_the_path_touches_nothing_and_docks(name: str, across: float, turned: float) -> None:
    """In corridors that leave less room; turned to the right by 60 deg another route is planned."""
    scenario = load_scenario(name)
    path, config = scenario.build_path(), scenario.controller_config()
    pose = path.start.compose(Pose2(0.0, across, radians(turned)))
    run = list(drive(scenario, 60.0, start=PlantState(x=pose.x, y=pose.y, phi=pose.phi)))
    poses = np.array([[plant.x, plant.y, plant.phi, 0.0, 0.0, 0.0] for plant, _ in run])
    assert clearances(poses, scenario.build_corridor(path), 0, config.vehicle).min() > 0.0
    assert run[-1][1].status is Status.DOCKED, run[-1][1].diagnostics.reason
