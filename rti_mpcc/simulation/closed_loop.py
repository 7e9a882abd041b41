"""The controller and the plant in closed loop: measure, step, wait for the dead time, move."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from time import perf_counter
from typing import Any, Protocol

import numpy as np

from estimation import GoalMeasurement
from geometry import Pose2, ReferencePath
from geometry.outline import placed
from rti_mpcc.config import ControllerConfig
from rti_mpcc.errors import InputError
from rti_mpcc.planning.agenda import StepRecord
from rti_mpcc.simulation.assembly import assemble_cycles, assemble_tracking, assemble_truth
from rti_mpcc.simulation.controllers import Planner, planner_in
from rti_mpcc.simulation.detector import Detector, Lookout, SimulatedDetector
from rti_mpcc.simulation.disturbances import Disturbances
from rti_mpcc.simulation.ending import LATCHED, STANDSTILL_SPEED, Ending
from rti_mpcc.simulation.goal_feed import GoalFeed, GoalSource, TrueGoal, source_in
from rti_mpcc.simulation.mission import Mission, mission_in, mission_of, touches
from rti_mpcc.simulation.plant import SAME_TIME, PlantParameters, PlantState, advance, issue
from rti_mpcc.simulation.result import Planning, RunResult
from rti_mpcc.simulation.scenario import Scenario
from rti_mpcc.simulation.scenario_camera import ScenarioCamera, Seen
from rti_mpcc.simulation.scenery import Obstacles, Scenery
from rti_mpcc.simulation.site import Changes, Site
from rti_mpcc.types import Command, VehicleState


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

        Measurements are passed in runs with a detector only, obstacles in runs with changing ones only. In
        the cycles of a fault of the solver, and only there, `clock` is passed: `DockingController.step`.
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
    seen: Seen | None = None,
) -> RunResult:
    """Run a scenario until 0.5 s after docking, 5 s after a latched stop, or its duration.

    Docking is the true one: inside tolerance of the true goal with |v| <= 0.02 m/s for 0.5 s. Where the
    controller does not say that it has docked, the run goes on until it does, for 5 s at most. A fault that
    acts at that time is watched to its end. A stop counts from the end of the last fault on: the vehicle may
    go on then. Garbage collection stays on: the cycle times are those of a user's program.

    Args:
        preset, method, seed: as on the command line; the seed drives the noise of the measured state and of
            the detections, each by a stream of its own.
        progress: called after each cycle with the simulated time [s].
        controller: drives in place of a `DockingController` made from the scenario.
        start: true state at the beginning; default: at rest on the path's first pose or at the scenario's
            start, steering straight.
        obstacles_at: obstacle polygons (k, 2) [m] at a time [s], in place of the scenario's, or besides those
            of its area; those of its faults come on top. They are told to the controller every cycle.
        goal_source: how the goal is known in a run with a detector; without one it is known exactly, and only
            the default is allowed.
        detector: looks for the goal in place of the one that the scenario describes.
        seen: is told of every picture of the scenario's camera: stamp [s], picture, and the detection that
            the controller is told of, or None.

    Raises InputError for an unknown preset or method, a negative seed, a goal source that needs a detector
    where there is none, or a command that is not finite.
    """
    if seed < 0:
        raise InputError(f"seed = {seed}: must be >= 0")
    watched = detector is not None or scenario.goal.measurement is not None
    source = source_in(scenario.name, goal_source, detector=watched)
    config = scenario.controller_config(preset, method=method, detections=source is GoalSource.DETECTED)
    site = Site.of(scenario)
    goal = scenario.goal_pose(site.path)
    if controller is None:
        controller = mission_of(scenario, site.controller(config))
    planner, mission = planner_in(controller), mission_in(controller)
    # Where a given path cannot be driven the controller has made it smooth.
    path = site.path if planner is None else planner.path
    loop = _Loop(
        scenario=scenario,
        config=config,
        path=path,
        planner=planner,
        mission=mission,
        scenery=Scenery(
            path=path,
            corridor=site.corridor,
            vehicle=config.vehicle,
            faults=tuple(fault for fault in scenario.faults if fault.kind == "blocked"),
            obstacles_at=obstacles_at,
        ),
        plant=_starting_plant(site.start, start),
        goal=TrueGoal(pose=goal, shifts=scenario.goal.shifts),
        feed=GoalFeed(
            source=source,
            planned=scenario.planned_goal(site.path),
            lookout=_lookout(scenario, detector, seed, seen),
        ),
        disturbances=Disturbances(faults=scenario.faults),
        random=np.random.default_rng(seed),
        paths=[] if path is None else [(0.0, path)],
        theta=0.0 if path is None else path.parts[0].start,
    )
    ended = _run(loop, controller, progress)
    log = () if mission is None else mission.log
    changes = _with_body(loop.scenery.changes, log, goal, scenario)
    return RunResult(
        scenario=scenario,
        preset=preset,
        method=method,
        seed=seed,
        goal_source=source,
        config=config,
        paths=tuple(loop.paths),
        corridors=site.corridors(changes),
        area=site.area,
        besides=site.besides(changes),
        planning=_planning(loop),
        truth=assemble_truth(loop.samples, scenario.plant_parameters()),
        cycles=assemble_cycles(loop.cycle_times, loop.commands, loop.step_ms),
        tracking=assemble_tracking(loop.cycle_times, loop.commands) if watched else None,
        mission=log,
        mission_result=None if mission is None else mission.result,
        ended=ended,
    )


def _with_body(
    changes: Changes, log: Sequence[StepRecord], goal: Pose2, scenario: Scenario
) -> list[tuple[float, Obstacles]]:
    """The obstacles of each time, with what is docked at until the vehicle drives on straight to touch it."""
    body = scenario.goal.body
    if body is None:
        return list(changes)
    outline = placed(body, goal)
    touched = next((record.begin for record in log if record.kind == "straight" and record.dock), None)
    if touched is None:
        return [(at, (*some, outline)) for at, some in changes]
    found = [(at, (*some, outline)) for at, some in changes if at < touched]
    last = next((some for at, some in reversed(changes) if at <= touched), ())
    return [*found, (touched, last), *((at, some) for at, some in changes if at > touched)]


def _lookout(scenario: Scenario, detector: Detector | None, seed: int, seen: Seen | None) -> Lookout | None:
    if detector is not None:
        return Lookout(detector=detector)
    section, camera = scenario.goal.measurement, scenario.goal.camera
    if section is None:
        return None
    if camera is not None:
        return Lookout(detector=ScenarioCamera.of(camera, section, seed, seen))
    return Lookout(detector=SimulatedDetector(section=section, random=np.random.default_rng([seed, 1])))


@dataclass(slots=True, kw_only=True)
class _Loop:
    """The run under way: what it runs with, where it is, and what was recorded."""

    scenario: Scenario
    config: ControllerConfig
    path: ReferencePath | None
    planner: Planner | None
    mission: Mission | None
    scenery: Scenery
    plant: PlantState
    goal: TrueGoal
    feed: GoalFeed
    disturbances: Disturbances
    random: np.random.Generator
    paths: list[tuple[float, ReferencePath]]
    theta: float
    part: int = 0
    cycle: int = 0
    samples: list[tuple[float, ...]] = field(default_factory=list)
    commands: list[Command] = field(default_factory=list)
    cycle_times: list[float] = field(default_factory=list)
    step_ms: list[float] = field(default_factory=list)


def _planning(loop: _Loop) -> Planning | None:
    planner = loop.planner
    if planner is None:
        return Planning() if loop.scenario.in_area else None
    if not loop.scenario.in_area and planner.replans == 0:
        return None
    return Planning(seconds=planner.planning_seconds, replans=planner.replans)


def _starting_plant(given: Pose2, start: VehicleState | None) -> PlantState:
    if start is None:
        return PlantState(x=given.x, y=given.y, phi=given.phi)
    return PlantState(x=start.x, y=start.y, phi=start.phi, v=start.v, delta=start.delta)


def _run(loop: _Loop, controller: Controller, progress: Callable[[float], None] | None) -> str:
    """Alternate plant and controller on their own clocks until the run ends; returns why."""
    simulation = loop.scenario.simulation
    parameters = loop.scenario.plant_parameters()
    ending = Ending()
    # Rounded products instead of sums: no drift of one clock against the other.
    for step in range(round(simulation.duration / simulation.plant_step) + 1):
        time = round(step * simulation.plant_step, 9)
        while (next_cycle := round(loop.cycle * simulation.cycle, 9)) <= time + SAME_TIME:
            _expose(loop, parameters, next_cycle)
            loop.plant = advance(loop.plant, parameters, next_cycle)
            _control(loop, controller, parameters, next_cycle)
            loop.cycle += 1
            if progress is not None:
                progress(next_cycle)
        # Before the plant goes past it: an exposure need not fall on a cycle.
        _expose(loop, parameters, time)
        loop.plant = advance(loop.plant, parameters, time)
        loop.goal = loop.goal.seen_from(loop.plant.x, loop.plant.y)
        _sample(loop, time)
        if loop.mission is None:
            ending = ending.after(time, docked=_docked(loop), stopped=_stopped(loop), said=_said(loop))
        else:
            ending = ending.after_mission(time, over=loop.mission.over)
        if (reason := ending.reason(time, loop.scenario.faults)) is not None:
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
            last_part=_looks(loop),
        )


def _looks(loop: _Loop) -> bool:
    """Whether the vehicle is on the last part of its way to the goal."""
    docks = loop.mission is None or loop.mission.docks
    return docks and loop.path is not None and loop.part == len(loop.path.parts) - 1


def _control(loop: _Loop, controller: Controller, parameters: PlantParameters, now: float) -> None:
    """One cycle: measure, step, send the command off; or lose it."""
    plant, faults = loop.plant, loop.disturbances
    loop.goal = loop.goal.seen_from(plant.x, plant.y)
    measured = _measure(loop)
    state = faults.measured(measured, now)
    obstacles = loop.scenery.obstacles(now, Pose2(plant.x, plant.y, plant.phi), loop.part, loop.theta)
    if faults.acting("lost_cycles", now):
        return
    arguments = _given(loop, now, measured, obstacles)
    began = perf_counter()
    command = controller.step(state, now=now - faults.total("clock_back", now), **arguments)
    loop.step_ms.append(1e3 * (perf_counter() - began))
    loop.cycle_times.append(now)
    loop.commands.append(command)
    _onto_route(loop, command, now)
    loop.plant = issue(
        plant,
        parameters,
        acceleration=command.acceleration,
        steering_rate=command.steering_rate,
        delay=faults.total("late_cycles", now),
    )


def _onto_route(loop: _Loop, command: Command, now: float) -> None:
    """Count progress on the part that is driven now, maybe of a way that was planned in this cycle."""
    path = loop.path if loop.planner is None else loop.planner.path
    if path is None:
        return  # it stands and plans: what it was on is over
    another = path is not loop.path
    if another:
        loop.path = loop.scenery.path = path
        loop.paths.append((now, path))
    if another or command.diagnostics.part != loop.part:
        loop.part = command.diagnostics.part
        loop.theta = path.parts[loop.part].start


def _measure(loop: _Loop) -> VehicleState:
    """The state with its noise."""
    plant = loop.plant
    noise = loop.random.standard_normal(5) * loop.scenario.simulation.state_noise
    values = np.array([plant.x, plant.y, plant.phi, plant.v, plant.delta]) + noise
    return VehicleState(**dict(zip(("x", "y", "phi", "v", "delta"), values.tolist(), strict=True)))


def _given(loop: _Loop, now: float, measured: VehicleState, obstacles: Obstacles) -> dict[str, Any]:
    """What a step is given besides state and time."""
    feed, faults = loop.feed, loop.disturbances
    detected = feed.lookout is not None and feed.source is GoalSource.DETECTED
    # Without a path there is always a goal, and it is told.
    end = loop.goal.pose if loop.path is None else loop.path.end
    goal, measurements = faults.given(feed.given(now, measured, loop.goal), now, end, detected=detected)
    arguments: dict[str, Any] = {"goal": goal}
    if feed.lookout is not None:
        arguments["measurements"] = measurements
    if loop.scenery.changing:
        arguments["obstacles"] = obstacles
    if loop.mission is not None:
        arguments["signal"] = _in_contact(loop)
    if (clock := faults.clock(now, loop.config.deadline)) is not None:
        arguments["clock"] = clock
    return arguments


def _in_contact(loop: _Loop) -> bool:
    """Whether the vehicle touches what it docks at."""
    body, plant = loop.scenario.goal.body, loop.plant
    if body is None:
        return False
    pose = Pose2(plant.x, plant.y, plant.phi)
    return touches(pose, loop.config.vehicle, placed(body, loop.goal.pose))


def _sample(loop: _Loop, time: float) -> None:
    plant, goal = loop.plant, loop.goal.pose
    # The first projection of a part is told its start: a self-near route must not put it elsewhere.
    if loop.path is not None:
        loop.theta = loop.path.parts[loop.part].project(plant.x, plant.y, near=loop.theta)
    pose = (plant.x, plant.y, plant.phi)
    loop.samples.append((time, *pose, plant.v, plant.delta, loop.theta, loop.part, goal.x, goal.y, goal.phi))


def _docked(loop: _Loop) -> bool:
    plant = loop.plant
    if abs(plant.v) > STANDSTILL_SPEED:
        return False
    pose = Pose2(plant.x, plant.y, plant.phi)
    return pose.relative_to(loop.goal.pose).within(loop.scenario.goal.tolerance)


def _stopped(loop: _Loop) -> bool:
    standing = abs(loop.plant.v) <= STANDSTILL_SPEED
    return standing and bool(loop.commands) and loop.commands[-1].status in LATCHED


def _said(loop: _Loop) -> bool:
    return bool(loop.commands) and loop.commands[-1].docked
