"""The controller and the plant in closed loop: measure, step, wait for the dead time, move."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from math import hypot
from time import perf_counter
from typing import Protocol

import numpy as np

from geometry import Corridor, Pose2, ReferencePath
from rti_mpcc.config import ControllerConfig
from rti_mpcc.errors import InputError
from rti_mpcc.simulation.assembly import assemble_cycles, assemble_truth
from rti_mpcc.simulation.plant import SAME_TIME, PlantParameters, PlantState, advance, issue
from rti_mpcc.simulation.result import RunResult, inside_tolerance
from rti_mpcc.simulation.scenario import Scenario, ShiftSection
from rti_mpcc.types import Array, Command, Status, VehicleState

METHODS = ("dynamic",)
STANDSTILL_SPEED = 0.02
"""Slower than this [m/s] is standing."""
DOCK_TIME = 0.5
"""So long [s] inside tolerance and standing is docked."""
AFTER_DOCKING = 0.5
"""The run goes on so long after docking [s]."""
AFTER_STOP = 5.0
"""The run goes on so long after a latched stop [s]."""
_LATCHED = (Status.STALLED, Status.FAILED)

Obstacles = Sequence[Array]


class Controller(Protocol):
    """What can be put into the loop in place of `DockingController`."""

    def step(
        self,
        state: VehicleState,
        *,
        now: float,
        goal: Pose2 | None = None,
        obstacles: Obstacles | None = None,
    ) -> Command:
        """The command to apply until the next step, see `DockingController.step`."""
        ...


def simulate(
    scenario: Scenario,
    *,
    preset: str = "default",
    method: str = "dynamic",
    seed: int = 0,
    progress: Callable[[float], None] | None = None,
    controller: Controller | None = None,
    start: VehicleState | None = None,
    obstacles_at: Callable[[float], Obstacles] | None = None,
) -> RunResult:
    """Run a scenario until 0.5 s after docking, 5 s after a latched stop, or its duration.

    Docking is the true one: inside tolerance of the true goal with |v| <= 0.02 m/s for 0.5 s. Garbage
    collection stays on: the cycle times are those of a user's program.

    Args:
        preset, method, seed: as on the command line; the seed drives the noise of the measured state.
        progress: called after each cycle with the simulated time [s].
        controller: drives in place of a `DockingController` made from the scenario.
        start: true state at the beginning; default: at rest on the path's first pose, steering straight.
        obstacles_at: obstacle polygons (k, 2) [m] at a time [s], in place of the scenario's; they are told to
            the controller every cycle.

    Raises InputError for an unknown preset or method, a negative seed, or a command that is not finite.
    """
    if method not in METHODS:
        raise InputError(f"method = {method!r}: must be one of {', '.join(METHODS)}")
    if seed < 0:
        raise InputError(f"seed = {seed}: must be >= 0")
    config = scenario.controller_config(preset)
    path = scenario.build_path()
    loop = _Loop(
        scenario=scenario,
        path=path,
        corridors=[(0.0, scenario.build_corridor(path))],
        plant=_starting_plant(path, start),
        goal=_Goal(
            pose=scenario.goal_pose(path), given=not scenario.goal_is_path_end, shifts=scenario.goal.shifts
        ),
        random=np.random.default_rng(seed),
        obstacles_at=obstacles_at,
        theta=path.parts[0].start,
    )
    if controller is None:
        controller = _docking_controller(path, loop.corridors[0][1], config)
    ended = _run(loop, controller, progress)
    return RunResult(
        scenario=scenario,
        preset=preset,
        method=method,
        seed=seed,
        config=config,
        path=path,
        corridors=tuple(loop.corridors),
        truth=assemble_truth(loop.samples, scenario.plant_parameters()),
        cycles=assemble_cycles(loop.cycle_times, loop.commands, loop.step_ms),
        ended=ended,
    )


def _docking_controller(path: ReferencePath, corridor: Corridor, config: ControllerConfig) -> Controller:
    # Not at the top: the harness serves other controllers without loading this one's solver.
    from rti_mpcc.docking import DockingController

    return DockingController(path, corridor, config)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Goal:
    """The true goal, whether the controller is told a pose at all, and the shifts still to come."""

    pose: Pose2
    given: bool
    shifts: tuple[ShiftSection, ...]

    def seen_from(self, x: float, y: float) -> _Goal:
        """Moved by every shift whose distance the rear axle has come within."""
        goal = self
        for shift in self.shifts:
            if hypot(x - goal.pose.x, y - goal.pose.y) <= shift.at_distance:
                left = tuple(other for other in goal.shifts if other is not shift)
                goal = _Goal(pose=goal.pose.compose(Pose2(*shift.offset)), given=True, shifts=left)
        return goal


@dataclass(frozen=True, slots=True)
class _Ending:
    """Since when the vehicle has been docked in truth, and stopped for good by its own word [s]."""

    docked_since: float | None = None
    stopped_since: float | None = None

    def after(self, time: float, *, docked: bool, stopped: bool) -> _Ending:
        """One sample later."""
        return _Ending(
            (time if self.docked_since is None else self.docked_since) if docked else None,
            (time if self.stopped_since is None else self.stopped_since) if stopped else None,
        )

    def reason(self, time: float) -> str | None:
        """Why the run ends now, or None."""
        if (
            self.docked_since is not None
            and time - self.docked_since >= DOCK_TIME + AFTER_DOCKING - SAME_TIME
        ):
            return "docked"
        if self.stopped_since is not None and time - self.stopped_since >= AFTER_STOP - SAME_TIME:
            return "stopped"
        return None


@dataclass(slots=True, kw_only=True)
class _Loop:
    """The run under way: what it runs with, where it is, and what was recorded."""

    scenario: Scenario
    path: ReferencePath
    corridors: list[tuple[float, Corridor]]
    plant: PlantState
    goal: _Goal
    random: np.random.Generator
    obstacles_at: Callable[[float], Obstacles] | None
    theta: float
    part: int = 0
    told: Obstacles | None = None
    samples: list[tuple[float, ...]] = field(default_factory=list)
    commands: list[Command] = field(default_factory=list)
    cycle_times: list[float] = field(default_factory=list)
    step_ms: list[float] = field(default_factory=list)


def _starting_plant(path: ReferencePath, start: VehicleState | None) -> PlantState:
    if start is None:
        return PlantState(x=path.start.x, y=path.start.y, phi=path.start.phi)
    return PlantState(x=start.x, y=start.y, phi=start.phi, v=start.v, delta=start.delta)


def _run(loop: _Loop, controller: Controller, progress: Callable[[float], None] | None) -> str:
    """Alternate plant and controller on their own clocks until the run ends; returns why."""
    simulation = loop.scenario.simulation
    parameters = loop.scenario.plant_parameters()
    ending = _Ending()
    # Rounded products instead of sums: no drift of one clock against the other.
    for step in range(round(simulation.duration / simulation.plant_step) + 1):
        time = round(step * simulation.plant_step, 9)
        while (next_cycle := round(len(loop.commands) * simulation.cycle, 9)) <= time + SAME_TIME:
            loop.plant = advance(loop.plant, parameters, next_cycle)
            _control(loop, controller, parameters, next_cycle)
            if progress is not None:
                progress(next_cycle)
        loop.plant = advance(loop.plant, parameters, time)
        loop.goal = loop.goal.seen_from(loop.plant.x, loop.plant.y)
        _sample(loop, time)
        ending = ending.after(time, docked=_docked(loop), stopped=_stopped(loop))
        if (reason := ending.reason(time)) is not None:
            return reason
    return "duration"


def _control(loop: _Loop, controller: Controller, parameters: PlantParameters, now: float) -> None:
    """One cycle: measure with noise, step, send the command off."""
    plant = loop.plant
    loop.goal = loop.goal.seen_from(plant.x, plant.y)
    noise = loop.random.standard_normal(5) * loop.scenario.simulation.state_noise
    values = np.array([plant.x, plant.y, plant.phi, plant.v, plant.delta]) + noise
    measured = VehicleState(**dict(zip(("x", "y", "phi", "v", "delta"), values.tolist(), strict=True)))
    goal = loop.goal.pose if loop.goal.given else None
    obstacles = _obstacles(loop, now)
    began = perf_counter()
    if obstacles is None:
        command = controller.step(measured, now=now, goal=goal)
    else:
        command = controller.step(measured, now=now, goal=goal, obstacles=obstacles)
    loop.step_ms.append(1e3 * (perf_counter() - began))
    loop.cycle_times.append(now)
    loop.commands.append(command)
    if command.diagnostics.part != loop.part:
        loop.part = command.diagnostics.part
        loop.theta = loop.path.parts[loop.part].start
    loop.plant = issue(
        plant, parameters, acceleration=command.acceleration, steering_rate=command.steering_rate
    )


def _obstacles(loop: _Loop, now: float) -> Obstacles | None:
    """The obstacles to tell the controller; a change of them is kept for the clearance."""
    if loop.obstacles_at is None:
        return None
    obstacles, known = loop.obstacles_at(now), loop.told
    if known is None or len(known) != len(obstacles) or not all(map(np.array_equal, known, obstacles)):
        corridor = loop.corridors[0][1].with_obstacles(obstacles)
        # Before the first cycle nothing was driven: what it is told holds from the beginning.
        loop.corridors = [*(loop.corridors if known is not None else []), (now, corridor)]
        loop.told = obstacles
    return obstacles


def _sample(loop: _Loop, time: float) -> None:
    plant, goal = loop.plant, loop.goal.pose
    # The first projection of a part is told its start: a self-near route must not put it elsewhere.
    loop.theta = loop.path.parts[loop.part].project(plant.x, plant.y, near=loop.theta)
    pose = (plant.x, plant.y, plant.phi)
    loop.samples.append((time, *pose, plant.v, plant.delta, loop.theta, loop.part, goal.x, goal.y, goal.phi))


def _docked(loop: _Loop) -> bool:
    plant = loop.plant
    if abs(plant.v) > STANDSTILL_SPEED:
        return False
    pose = Pose2(plant.x, plant.y, plant.phi)
    return inside_tolerance(pose, loop.goal.pose, loop.scenario.goal.tolerance)


def _stopped(loop: _Loop) -> bool:
    return abs(loop.plant.v) <= STANDSTILL_SPEED and loop.commands[-1].status in _LATCHED
