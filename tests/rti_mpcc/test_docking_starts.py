"""Starts outside the limits, at the boundary and off the path: each gives a plan that leads back."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache
from math import cos, pi, radians, sin
from typing import Any

import numpy as np
import pytest

from geometry import PathPart, Pose2, lift
from rti_mpcc.config import ControllerConfig
from rti_mpcc.controller import RtiMpcc
from rti_mpcc.model.footprint import body_polygons
from rti_mpcc.ocp.horizon import stage_lengths, stage_times
from rti_mpcc.planning.guess import cruise_guess
from rti_mpcc.planning.pace import pace_of
from rti_mpcc.simulation import Scenario, scenario_from_dict
from rti_mpcc.simulation.plant import PlantState
from rti_mpcc.types import Array, Command, Source, Status
from tests.rti_mpcc.docking_runs import BODY_HALF_WIDTH, drive

HALF = 8.0
"""Half width of the corridor [m]."""
LENGTH = 25.0
SPEED = 2.0
"""Speed limit [m/s]."""
FRONT, REAR = 3.6775, 0.8027
"""Body ahead of and behind the rear axle [m]."""
HEADING = 3.0
"""Of the path's begin [rad]: the vehicle's crosses pi."""
RETURN = 0.85
"""Share of a rate limit at which what is outside its limit returns at least."""

LEFT, RIGHT = 1, -1
ROOM = 0.6
"""What a start at a boundary leaves beside the body [m]. A body over one stands, see test_collisions.py."""

ANOTHER_WAY = ("behind the end",)
"""Where none leads on along the path: another way is planned first."""

Run = list[tuple[PlantState, Command]]


@dataclass(frozen=True, slots=True, kw_only=True)
class Start:
    """A start beside the place at `theta` [m]: to the left [m], turned [rad]; speed in the part's direction.

    `across` and `turned` are meant for a forward part; on a reverse one the turn is the other way, so that
    the way of the vehicle is the mirror image. With `at` the outermost corner of the body lies `ROOM` within
    the left (+) or right (-) boundary [m], whatever `across` says. `goal` is how far behind the path's end
    the goal lies [m].
    """

    theta: float = 0.0
    across: float = 0.0
    turned: float = 0.0
    speed: float = 0.0
    steering: float = 0.0
    goal: float = 0.0
    at: int = 0

    @property
    def off(self) -> bool:
        """Whether it is off the path or turned away from it."""
        return bool(self.across or self.at or self.turned)


LIMITS = {
    "steering left": Start(steering=0.7),
    "steering right": Start(steering=-0.7),
    "steering left, driving": Start(steering=0.7, speed=1.0),
    "too fast": Start(speed=3.0),
    "against the direction": Start(speed=-1.0),
    "too fast against the direction": Start(speed=-3.0),
}
PLACES = {
    "before the path": Start(theta=-3.0),
    "behind the end": Start(theta=LENGTH + 1.0),
    "behind the end, before the goal": Start(theta=LENGTH + 3.0, goal=8.0),
    "at the left boundary": Start(theta=2.0, at=LEFT),
    "at the right boundary": Start(theta=2.0, at=RIGHT),
    "at the left boundary, turned": Start(theta=5.0, at=LEFT, turned=radians(-15.0)),
    "at the right boundary, turned": Start(theta=5.0, at=RIGHT, turned=radians(15.0)),
    "left of the path": Start(across=2.0),
    "right of the path": Start(across=-2.0),
    "turned left": Start(turned=radians(60.0)),
    "turned right": Start(turned=radians(-60.0)),
}
BOTH = {
    "left, turned away, steered away, too fast": Start(
        across=1.5, turned=radians(40.0), steering=0.7, speed=2.5
    ),
    "right, turned back, before the path": Start(
        theta=-2.0, across=-2.0, turned=radians(60.0), steering=0.7, speed=1.0
    ),
    "left, turned back, against the direction": Start(
        across=2.0, turned=radians(-60.0), steering=-0.7, speed=-1.0
    ),
    "at the boundary, steered away, too fast": Start(
        theta=5.0, at=LEFT, turned=radians(-15.0), steering=0.7, speed=2.5
    ),
}
STARTS = {**LIMITS, **PLACES, **BOTH}


def room(direction: int, goal: float) -> Scenario:
    """A straight that bends gently, with room to both sides; the goal lies behind its end."""
    bends = [(0.0, 10.0), (0.03, LENGTH - 10.0)]
    return scenario_from_dict(
        {
            "name": "room",
            "path": {
                "start": [1.0, 2.0, HEADING],
                "segments": [{"direction": direction, "curvature": k, "length": s} for k, s in bends],
            },
            "corridor": {"left": HALF, "right": -HALF},
            "goal": {"offset": [direction * goal, 0.0, 0.0]},
            "limits": {"speed": SPEED},
            "simulation": {"dead_time": 0.18, "cycle": 0.05, "duration": 60.0},
        }
    )


def begin(part: PathPart, start: Start) -> PlantState:
    """The plant at a start."""
    d, theta = part.direction, min(max(start.theta, part.start), part.end)
    beside = Pose2(d * (start.theta - theta), _across(start, d), d * start.turned)
    pose = part.pose(theta).compose(beside)
    return PlantState(x=pose.x, y=pose.y, phi=pose.phi, v=d * start.speed, delta=d * start.steering)


def _across(start: Start, direction: int) -> float:
    """Of the rear axle, to the left [m]: the corner that is last in the way reaches farthest."""
    if not start.at:
        return start.across
    trailing = REAR if direction > 0 else FRONT
    reach = BODY_HALF_WIDTH * cos(start.turned) + trailing * abs(sin(start.turned))
    return start.at * (HALF - reach - ROOM)


@cache
def driven(name: str, direction: int) -> tuple[tuple[PlantState, Command], ...]:
    """The run from a start until it has docked; without a plan in the first cycle, nor for one to be planned,
    no more than that."""
    scenario = room(direction, STARTS[name].goal)
    run: Run = []
    for plant, command in drive(scenario, 40.0, start=begin(scenario.build_path().parts[0], STARTS[name])):
        run.append((plant, command))
        first = run[0][1]
        if command.docked or (first.source is not Source.SOLUTION and first.status is not Status.PLANNING):
            break
    return tuple(run)


def deviations(name: str, direction: int, states: Array) -> tuple[Array, Array]:
    """Distance (n,) [m] and angle (n,) [rad], unsigned, between states (n, 6) and the path."""
    part = room(direction, STARTS[name].goal).build_path().parts[0]
    poses = [part.pose(part.project(x, y)) for x, y in states[:, :2]]
    apart = [np.hypot(x - pose.x, y - pose.y) for (x, y), pose in zip(states[:, :2], poses, strict=True)]
    turned = [lift(phi, pose.phi) - pose.phi for phi, pose in zip(states[:, 2], poses, strict=True)]
    return np.array(apart), np.abs(turned)


# -- closed loop -----------------------------------------------------------------------------------------


def cases(names: Iterable[str], every: int = 1000) -> list[Any]:
    """Each start in both directions; of two mirror images one forward, the other in reverse.

    The first one and `every` so many on are driven by default, all in acceptance.
    """
    twins = {"left": 1, "right": -1}
    chosen: list[tuple[str, int]] = []
    for name in names:
        side = next((side for side in twins if side in name and name not in BOTH), "")
        chosen += [(name, direction) for direction in (1, -1) if twins.get(side, direction) == direction]
    return [
        case if place % every == 0 else pytest.param(*case, marks=pytest.mark.acceptance)
        for place, case in enumerate(chosen)
    ]


every_case = pytest.mark.parametrize(("name", "direction"), cases(STARTS, every=12))
every_start = pytest.mark.parametrize("name", STARTS)
both_directions = pytest.mark.parametrize("direction", [1, -1])


@every_case
def test_the_first_cycle_already_drives_a_plan(name: str, direction: int) -> None:
    """Or another way is planned, where none leads on: the vehicle stands, and then drives to its end."""
    run = driven(name, direction)
    command = run[0][1]
    assert not command.diagnostics.failed
    if name not in ANOTHER_WAY:
        assert command.source is Source.SOLUTION, command.diagnostics.reason
        return
    assert command.diagnostics.reason == "planning a way: the first plan misses the goal"
    planning = [command.status is Status.PLANNING for _, command in run]
    begun = planning.index(False)
    assert not any(planning[begun:])
    assert all(plant.v == 0.0 for plant, _ in run[:begun])


@every_case
def test_no_cycle_fails_and_it_docks(name: str, direction: int) -> None:
    run = driven(name, direction)
    assert not [command.diagnostics.reason for _, command in run if command.diagnostics.failed]
    assert run[-1][1].docked, run[-1][1].diagnostics.reason


@pytest.mark.parametrize(
    ("name", "direction"), cases([name for name in STARTS if abs(STARTS[name].steering) > 0.6])
)
def test_steering_returns_at_the_rate_limit_and_stays(name: str, direction: int) -> None:
    run = driven(name, direction)
    side = np.sign(run[0][0].delta)
    assert side * run[0][1].steering_rate <= -RETURN * 1.0
    back = [abs(plant.delta) <= 0.6 + 1e-3 for plant, _ in run]
    first = back.index(True)
    assert run[first][0].time <= 0.18 + 0.1 / RETURN + 0.05
    assert all(back[first:])


@pytest.mark.parametrize(
    ("name", "direction"), cases([name for name in STARTS if abs(STARTS[name].speed) > SPEED])
)
def test_speed_returns_at_the_acceleration_limit_and_stays(name: str, direction: int) -> None:
    run = driven(name, direction)
    side = np.sign(run[0][0].v)
    assert side * run[0][1].acceleration <= -RETURN * 5.0
    back = [abs(plant.v) <= SPEED + 0.01 for plant, _ in run]
    first = back.index(True)
    assert run[first][0].time <= 0.18 + (abs(run[0][0].v) - SPEED) / (RETURN * 5.0) + 0.05
    assert all(back[first:])


@pytest.mark.parametrize(("name", "direction"), cases([name for name in STARTS if STARTS[name].speed < 0.0]))
def test_motion_against_the_direction_is_braked_to_a_stop_first(name: str, direction: int) -> None:
    """In comfort: nothing is known of that makes a hard stop better."""
    run, comfort = driven(name, direction), ControllerConfig().comfort
    assert direction * run[0][1].acceleration > 0.0
    ramp = comfort.acceleration / comfort.jerk
    turned = 0.18 + ramp + abs(run[0][0].v) / comfort.acceleration + 0.1
    assert all(direction * plant.v >= -0.02 for plant, _ in run if plant.time >= turned)


@pytest.mark.parametrize(
    ("name", "direction"),
    cases(
        [name for name in STARTS if abs(STARTS[name].across) > 1.0 or STARTS[name].at or STARTS[name].turned]
    ),
)
def test_plan_and_vehicle_lead_back_to_the_path(name: str, direction: int) -> None:
    run = driven(name, direction)
    plan = run[0][1].trajectory.states
    driven_states = np.array([[plant.x, plant.y, plant.phi] for plant, _ in run])
    for states in (plan, driven_states):
        apart, turned = deviations(name, direction, states)
        # Steered away and too fast, it is led away first: in comfort that takes room.
        assert apart[-1] <= max(0.5 * apart.max(), 0.1)
        assert turned[-1] <= max(0.5 * turned[0], 0.1)


@pytest.mark.parametrize(("name", "direction"), cases([name for name in STARTS if STARTS[name].at]))
def test_a_body_at_the_boundary_stays_in(name: str, direction: int) -> None:
    scenario, run = room(direction, 0.0), driven(name, direction)
    corridor, vehicle = scenario.build_corridor(scenario.build_path()), scenario.controller_config().vehicle
    poses = np.array([[plant.x, plant.y, plant.phi, 0.0, 0.0, 0.0] for plant, _ in run])
    clearance = corridor.clearance(0, body_polygons(poses, vehicle))
    assert clearance[0] == pytest.approx(ROOM, abs=0.05)
    assert clearance.min() > 0.0


# -- one QP ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("about", ["the start", "the path"])
@every_start
@both_directions
def test_one_qp_is_solved_wherever_it_is_linearised(name: str, direction: int, about: str) -> None:
    scenario = room(direction, STARTS[name].goal)
    path, config = scenario.build_path(), scenario.controller_config()
    part = path.parts[0]
    mpcc = RtiMpcc(part, scenario.build_corridor(path), config)
    mpcc.set_goal(scenario.goal_pose(path))
    plant = begin(part, STARTS[name])
    theta = part.project(plant.x, plant.y, heading=plant.phi)
    state = np.array([plant.x, plant.y, plant.phi, plant.v, plant.delta, theta])
    on_path = part.pose(theta)
    usual = np.array([on_path.x, on_path.y, on_path.phi, 0.0, 0.0, theta])
    lengths = stage_lengths(config.cruise_horizon, config.cycle, config.stages)
    times = stage_times(0.0, lengths)
    begun = state if about == "the start" else usual
    mpcc.prepare(0.0, plan=cruise_guess(part, mpcc.target, begun, times, pace_of(part, config), config))
    solution = mpcc.feedback(state, 0.0, patience=mpcc.config.search.first_patience)
    assert solution.solved, solution.status
    states = solution.trajectory.states
    np.testing.assert_allclose(states[0, :5], state[:5], atol=2e-3)
    assert np.isfinite(states).all()


def test_the_headings_of_the_starts_cross_pi() -> None:
    part = room(1, 0.0).build_path().parts[0]
    assert part.first.phi < pi < part.last.phi
