"""What the closed-loop tests share: scenarios, obstacles across the way, and figures of a run."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from itertools import pairwise
from math import inf
from typing import Any

import numpy as np

from geometry import PathPart, Pose2, ReferencePath, wrap
from rti_mpcc.clock import CycleClock, Decisions, PlayedBack
from rti_mpcc.config import Vehicle
from rti_mpcc.docking import DockingController
from rti_mpcc.qp.solver import Stop
from rti_mpcc.simulation import RunResult, Scenario, docking_controller, scenario_from_dict, summary
from rti_mpcc.simulation.closed_loop import Controller
from rti_mpcc.simulation.plant import PlantParameters, PlantState, advance, issue
from rti_mpcc.types import Array, Command, Objective, VehicleState

DOCKING = ("docking_inside", "docking_behind", "docking_full_course", "long_approach")
"""The built-in scenarios that end in a goal pose."""
BODY_HALF_WIDTH = 2.069 / 2
"""Of the default vehicle [m]."""
FREE_SIDE = 0.25
"""What the passage leaves on either side of the body [m]."""
PASSAGE = (0.375, 0.425)
"""Where the passage begins and ends, in shares of the straight path."""

Obstacles = list[Array]


def on_segments(
    segments: Sequence[tuple[int, float, float]],
    start: Sequence[float] = (0.0, 0.0, 0.0),
    *,
    corridor: dict[str, Any] | None = None,
    simulation: dict[str, Any] | None = None,
    **tables: Any,
) -> Scenario:
    """A scenario on segments of (direction, curvature [1/m], length [m]), 3 m to both sides; 60 s."""
    rows = [{"direction": d, "curvature": k, "length": s} for d, k, s in segments]
    return scenario_from_dict(
        {
            "name": "on_segments",
            "path": {"start": list(start), "segments": rows},
            "corridor": {"left": 3.0, "right": -3.0, **(corridor or {})},
            "simulation": {"dead_time": 0.18, "cycle": 0.05, "duration": 60.0, **(simulation or {})},
            **tables,
        }
    )


def straight(
    direction: int,
    length: float = 40.0,
    *,
    corridor: dict[str, Any] | None = None,
    speed: float | None = None,
    **simulation: Any,
) -> Scenario:
    """A straight route along x in a corridor 3 m to both sides; the goal pose is its end."""
    return on_segments(
        [(direction, 0.0, length)],
        name="straight",
        corridor=corridor,
        goal={"offset": [0.0, 0.0, 0.0]},
        simulation={"duration": 120.0, **simulation},
        limits={} if speed is None else {"speed": speed},
    )


def narrow(direction: int, aside: float = 0.0, length: float = 40.0) -> Scenario:
    """`straight` with a narrowing that leaves the body 0.25 m on either side, `aside` [m] of the path."""
    half = BODY_HALF_WIDTH + FREE_SIDE
    begin, end = (length * share for share in PASSAGE)
    piece = {"from": begin, "to": end, "left": aside + half, "right": aside - half}
    return straight(direction, length, corridor={"narrowings": [piece]})


def between_obstacles(direction: int, aside: float = 0.0, length: float = 40.0) -> Scenario:
    """The same passage between two obstacles."""
    half = BODY_HALF_WIDTH + FREE_SIDE
    begin, end = (direction * length * share for share in PASSAGE)
    sides = [(aside + half, 2.9), (-2.9, aside - half)]
    outlines = [[[begin, low], [end, low], [end, high], [begin, high]] for low, high in sides]
    return straight(direction, length, corridor={"obstacles": outlines})


def before_a_wall(direction: int, room: float) -> Scenario:
    """12 m to a goal with a wall 3 m wide across the way, `room` [m] ahead of the body there."""
    vehicle = Vehicle()
    near = 12.0 + room + (vehicle.front if direction > 0 else vehicle.rear)
    begin, end = direction * near, direction * (near + 0.3)
    outline = [[begin, -1.5], [end, -1.5], [end, 1.5], [begin, 1.5]]
    return straight(direction, 12.0, corridor={"obstacles": [outline]}, duration=40.0)


def wall(path: ReferencePath, theta: float, half_width: float, thickness: float = 0.5) -> Array:
    """Outline (4, 2) [m] across the path at progress `theta` [m], `half_width` [m] to both sides."""
    part = next(part for part in path.parts if theta <= part.end)
    return box(part, theta, -half_width, half_width, thickness)


def box(part: PathPart, theta: float, right: float, left: float, length: float) -> Array:
    """Outline (4, 2) in the frame of the path at progress `theta`, from `right` to `left` of it [m]."""
    half, pose = 0.5 * length, part.pose(theta)
    corners = [(-half, right), (half, right), (half, left), (-half, left)]
    placed = [pose.compose(Pose2(x, y, 0.0)) for x, y in corners]
    return np.array([[corner.x, corner.y] for corner in placed])


def present(outline: Array, begin: float, end: float) -> Callable[[float], Obstacles]:
    """An obstacle that is there from `begin` to `end` [s]."""
    return lambda now: [outline] if begin <= now < end else []


class Wrapped:
    """A controller that is told headings between -pi and pi only, as a localisation gives them."""

    def __init__(self, controller: Controller) -> None:
        self.controller = controller

    def step(self, state: VehicleState, *, goal: Pose2 | None = None, **told: Any) -> Command:
        state = replace(state, phi=float(wrap(state.phi)))
        if goal is not None:
            goal = replace(goal, phi=float(wrap(goal.phi)))
        return self.controller.step(state, goal=goal, **told)


class Clocked:
    """A controller whose clock says in every cycle what it is told to say; None: the wall clock."""

    def __init__(self, controller: DockingController, clock_at: Callable[[float], CycleClock | None]) -> None:
        self.controller = controller
        self._clock_at = clock_at

    def step(self, state: VehicleState, *, now: float, **told: Any) -> Command:
        return self.controller.step(state, now=now, clock=self._clock_at(now), **told)


def granting(iterations: int, *, late: bool = False, stops: tuple[Stop | None, ...] = ()) -> CycleClock:
    """Grants so many iterations in its cycle; `stops` end its QPs, in order."""
    return PlayedBack(Decisions(granted=(True,) * iterations, stops=stops, late=late))


def docking_figures(result: RunResult) -> dict[str, Any]:
    """What is recorded of every run."""
    found = summary(result)
    names = (
        "docked",
        "time_to_tolerance_s",
        "time_to_dock_s",
        "final_error",
        "min_clearance_m",
        "direction_changes",
        "energy",
        "fallback_cycles",
    )
    return {
        **{name: found[name] for name in names},
        "solver_failures": found["solver"]["failures"],
        "iterations_p95": found["solver"]["iterations_p95"],
        "cycle_ms_p50": found["cycle_ms"]["p50"],
        "step_at_change_over": step_at_change_over(result),
    }


def assert_docked(result: RunResult) -> dict[str, Any]:
    """Docked, and nothing was touched."""
    found = docking_figures(result)
    assert found["docked"], (found, result.cycles.status[-1], result.cycles.reason[-1])
    assert found["min_clearance_m"] > 0.0
    return found


def step_at_change_over(result: RunResult) -> float:
    """Largest change [m/s²] of the commanded acceleration where contouring turns into an arrival."""
    changes, objectives = np.abs(np.diff(result.cycles.acceleration)), pairwise(result.cycles.objective)
    order = (Objective.CONTOURING, Objective.ARRIVAL)
    return max((float(c) for c, pair in zip(changes, objectives, strict=True) if pair == order), default=0.0)


def deviation(base: Array, other: Array) -> float:
    """Largest distance [m] between two runs' poses (n, 3), (m, 3) at the same times."""
    count = min(len(base), len(other))
    difference = base[:count, :2] - other[:count, :2]
    return float(np.hypot(difference[:, 0], difference[:, 1]).max())


def seen_from(frame: Pose2, poses: Array) -> Array:
    """World poses (n, 3) in the coordinates of `frame`; headings are kept continuous."""
    c, s = np.cos(frame.phi), np.sin(frame.phi)
    x, y = poses[:, 0] - frame.x, poses[:, 1] - frame.y
    return np.stack([c * x + s * y, -s * x + c * y, poses[:, 2] - frame.phi], axis=-1)


def statuses(result: RunResult) -> dict[str, int]:
    """How many cycles each status lasted."""
    names = [status.value for status in result.cycles.status]
    return {name: names.count(name) for name in dict.fromkeys(names)}


def short(**simulation: Any) -> Scenario:
    """An S of 12 m in reverse with a goal pose beside and behind its end: docks in about 15 s."""
    goal, segments = {"offset": [-0.5, 0.3, 0.05]}, [(-1, 0.08, 6.0), (-1, -0.08, 6.0)]
    return on_segments(segments, (1.0, 2.0, 1.0), simulation=simulation, name="short", goal=goal)


def obeyed(
    plant: PlantState, command: Command, parameters: PlantParameters, until: float | None = None
) -> PlantState:
    """The plant with a command on its way to the actuators; `until`: driven on to a time [s]."""
    plant = issue(plant, parameters, acceleration=command.acceleration, steering_rate=command.steering_rate)
    return plant if until is None else advance(plant, parameters, until)


def drive(
    scenario: Scenario,
    seconds: float,
    *,
    goal_at: Callable[[float], Pose2 | None] | None = None,
    controller: Controller | None = None,
    start: PlantState | None = None,
    after_docking: float = inf,
) -> Iterator[tuple[PlantState, Command]]:
    """The true state that each cycle measures, and its command, for `seconds` [s] whatever happens.

    Or until it has stayed docked for `after_docking` [s]. The plant begins at `start`, by default at rest at
    the begin of the path.
    """
    path, simulation = scenario.build_path(), scenario.simulation
    controller = controller or docking_controller(scenario)
    parameters = scenario.plant_parameters()
    plant, docked = start or PlantState(x=path.start.x, y=path.start.y, phi=path.start.phi), 0.0
    for cycle in range(round(seconds / simulation.cycle)):
        plant = advance(plant, parameters, cycle * simulation.cycle)
        state = plant.measured
        goal = scenario.goal_pose() if goal_at is None else goal_at(plant.time)
        command = controller.step(state, now=plant.time, goal=goal)
        yield plant, command
        if command.docked and docked >= after_docking:
            return
        docked = docked + simulation.cycle if command.docked else 0.0
        plant = obeyed(plant, command, parameters)
