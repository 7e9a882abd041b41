"""The controller and the plant in closed loop: measure, step, wait for the dead time, move."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from time import perf_counter
from typing import Any, Protocol

import numpy as np

from estimation import GoalMeasurement
from geometry import Corridor, Pose2, ReferencePath
from rti_mpcc.errors import InputError
from rti_mpcc.simulation.assembly import assemble_cycles, assemble_tracking, assemble_truth
from rti_mpcc.simulation.controllers import controller_on
from rti_mpcc.simulation.detector import Detector, Lookout, SimulatedDetector
from rti_mpcc.simulation.goal_feed import GoalFeed, GoalSource, TrueGoal, source_in
from rti_mpcc.simulation.plant import SAME_TIME, PlantParameters, PlantState, advance, issue
from rti_mpcc.simulation.result import RunResult, inside_tolerance
from rti_mpcc.simulation.scenario import Scenario
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
        measurements: Sequence[GoalMeasurement] = (),
        obstacles: Obstacles | None = None,
    ) -> Command:
        """The command to apply until the next step, see `DockingController.step`.

        Measurements are passed in runs with a detector only, obstacles in runs with changing ones only.
        """
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
    goal_source: GoalSource = GoalSource.DETECTED,
    detector: Detector | None = None,
) -> RunResult:
    """Run a scenario until 0.5 s after docking, 5 s after a latched stop, or its duration.

    Docking is the true one: inside tolerance of the true goal with |v| <= 0.02 m/s for 0.5 s. Garbage
    collection stays on: the cycle times are those of a user's program.

    Args:
        preset, method, seed: as on the command line; the seed drives the noise of the measured state and of
            the detections, each by a stream of its own.
        progress: called after each cycle with the simulated time [s].
        controller: drives in place of a `DockingController` made from the scenario.
        start: true state at the beginning; default: at rest on the path's first pose, steering straight.
        obstacles_at: obstacle polygons (k, 2) [m] at a time [s], in place of the scenario's; they are told to
            the controller every cycle.
        goal_source: how the goal is known in a run with a detector; without one it is known exactly, and only
            the default is allowed.
        detector: looks for the goal in place of the one that the scenario describes.

    Raises InputError for an unknown preset or method, a negative seed, a goal source that needs a detector
    where there is none, or a command that is not finite.
    """
    if method not in METHODS:
        raise InputError(f"method = {method!r}: must be one of {', '.join(METHODS)}")
    if seed < 0:
        raise InputError(f"seed = {seed}: must be >= 0")
    watched = detector is not None or scenario.goal.measurement is not None
    source = source_in(scenario.name, goal_source, detector=watched)
    config = scenario.controller_config(preset, detections=source is GoalSource.DETECTED)
    path = scenario.build_path()
    loop = _Loop(
        scenario=scenario,
        path=path,
        corridors=[(0.0, scenario.build_corridor(path))],
        plant=_starting_plant(path, start),
        goal=TrueGoal(pose=scenario.goal_pose(path), shifts=scenario.goal.shifts),
        feed=GoalFeed(
            source=source, planned=scenario.planned_goal(path), lookout=_lookout(scenario, detector, seed)
        ),
        random=np.random.default_rng(seed),
        obstacles_at=obstacles_at,
        theta=path.parts[0].start,
    )
    if controller is None:
        controller = controller_on(path, loop.corridors[0][1], config)
    ended = _run(loop, controller, progress)
    return RunResult(
        scenario=scenario,
        preset=preset,
        method=method,
        seed=seed,
        goal_source=source,
        config=config,
        path=path,
        corridors=tuple(loop.corridors),
        truth=assemble_truth(loop.samples, scenario.plant_parameters()),
        cycles=assemble_cycles(loop.cycle_times, loop.commands, loop.step_ms),
        tracking=assemble_tracking(loop.cycle_times, loop.commands) if watched else None,
        ended=ended,
    )


def _lookout(scenario: Scenario, detector: Detector | None, seed: int) -> Lookout | None:
    if detector is not None:
        return Lookout(detector=detector)
    section = scenario.goal.measurement
    if section is None:
        return None
    return Lookout(detector=SimulatedDetector(section=section, random=np.random.default_rng([seed, 1])))


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
    goal: TrueGoal
    feed: GoalFeed
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
            _expose(loop, parameters, next_cycle)
            loop.plant = advance(loop.plant, parameters, next_cycle)
            _control(loop, controller, parameters, next_cycle)
            if progress is not None:
                progress(next_cycle)
        # Before the plant goes past it: an exposure need not fall on a cycle.
        _expose(loop, parameters, time)
        loop.plant = advance(loop.plant, parameters, time)
        loop.goal = loop.goal.seen_from(loop.plant.x, loop.plant.y)
        _sample(loop, time)
        ending = ending.after(time, docked=_docked(loop), stopped=_stopped(loop))
        if (reason := ending.reason(time)) is not None:
            return reason
    return "duration"


def _expose(loop: _Loop, parameters: PlantParameters, until: float) -> None:
    """Let the detector look for the goal at its own times up to `until` [s]."""
    lookout = loop.feed.lookout
    while lookout is not None and lookout.next_exposure <= until + SAME_TIME:
        loop.plant = advance(loop.plant, parameters, lookout.next_exposure)
        plant = loop.plant
        loop.goal = loop.goal.seen_from(plant.x, plant.y)
        lookout.expose(
            Pose2(plant.x, plant.y, plant.phi),
            loop.goal.pose,
            last_part=loop.part == len(loop.path.parts) - 1,
        )


def _control(loop: _Loop, controller: Controller, parameters: PlantParameters, now: float) -> None:
    """One cycle: measure with noise, step, send the command off."""
    plant = loop.plant
    loop.goal = loop.goal.seen_from(plant.x, plant.y)
    noise = loop.random.standard_normal(5) * loop.scenario.simulation.state_noise
    values = np.array([plant.x, plant.y, plant.phi, plant.v, plant.delta]) + noise
    measured = VehicleState(**dict(zip(("x", "y", "phi", "v", "delta"), values.tolist(), strict=True)))
    told = loop.feed.told(now, measured, loop.goal)
    arguments: dict[str, Any] = {"goal": told.goal}
    if loop.feed.lookout is not None:
        arguments["measurements"] = told.measurements
    if (obstacles := _obstacles(loop, now)) is not None:
        arguments["obstacles"] = obstacles
    began = perf_counter()
    command = controller.step(measured, now=now, **arguments)
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
