"""The controller of a scenario and the plant in closed loop: measure, step, wait for the dead time, move."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import astuple
from math import inf
from time import perf_counter
from typing import Any, Protocol

import numpy as np

from estimation import GoalMeasurement
from geometry import Pose2, ReferencePath
from geometry.outline import outline_at
from rti_mpcc.config import ControllerConfig
from rti_mpcc.docking import DockingController
from rti_mpcc.errors import InputError
from rti_mpcc.mission import DockingMission
from rti_mpcc.recording.moment import wrapped
from rti_mpcc.simulation.faults import Disturbances
from rti_mpcc.simulation.goal_feed import Detector, GoalFeed, GoalSource, Seen, detector_of, source_in
from rti_mpcc.simulation.plant import SAME_TIME, PlantState, advance, issue
from rti_mpcc.simulation.result import DOCK_TIME, STANDSTILL_SPEED, RunResult, Truth, cycle_table
from rti_mpcc.simulation.scenario import Scenario
from rti_mpcc.simulation.scenery import Outlines, Scenery, touches, with_body
from rti_mpcc.types import Command, Status, VehicleState

AFTER_DOCKING, AFTER_STOP = 0.5, 5.0
"""The run continues for this time after docking, and after a latched stop [s]."""
UNTIL_SAID = 5.0  # a docked vehicle is watched for this time at most until the controller says so [s]
LATCHED = (Status.STALLED, Status.GOAL_BEHIND, Status.GOAL_REJECTED, Status.FAILED)


class Controller(Protocol):
    """What can be put into the loop in place of `DockingController`."""

    def step(
        self,
        state: VehicleState,
        *,
        now: float,
        goal: Pose2 | None = None,
        measurements: Sequence[GoalMeasurement] = (),
        obstacles: Outlines | None = None,
    ) -> Command:
        """The command to apply until the next step, see `DockingController.step`.

        It is given a `clock`, too, in the cycles of a fault of the solver.
        """


def controller_of(scenario: Scenario, config: ControllerConfig) -> DockingController:
    """The controller along the scenario's path, or in its area. Raises InputError."""
    if scenario.in_area:
        return DockingController.in_area(scenario.build_area(), config)
    path = scenario.build_path()
    return DockingController(path, scenario.build_corridor(path), config)


def mission_of(scenario: Scenario, controller: DockingController) -> DockingMission | DockingController:
    """The controller with the scenario's mission, or itself where there is none."""
    if not scenario.mission:
        return controller
    goal = scenario.planned_goal() if scenario.in_area else None
    body = None if scenario.goal.body is None else np.array(scenario.goal.body)
    home = None if scenario.home is None else Pose2(*scenario.home.pose)
    return DockingMission(controller, [each.build(goal, body) for each in scenario.mission], home=home)


def docking_controller(
    scenario: Scenario,
    *,
    preset: str = "default",
    method: str | None = None,
    goal_source: GoalSource = GoalSource.DETECTED,
) -> DockingController:
    """The controller that `simulate` makes, without the mission. Raises InputError."""
    source = source_in(scenario.name, goal_source, detector=scenario.goal.measurement is not None)
    config = scenario.controller_config(preset, method=method, detections=source is GoalSource.DETECTED)
    return controller_of(scenario, config)


def driver_of(scenario: Scenario, **options: Any) -> DockingController | DockingMission:
    """`docking_controller` and its options, with the scenario's mission if there is one."""
    return mission_of(scenario, docking_controller(scenario, **options))


def simulate(
    scenario: Scenario,
    *,
    preset: str = "default",
    method: str | None = None,
    seed: int = 0,
    progress: Callable[[float], None] | None = None,
    controller: Controller | None = None,
    obstacles_at: Callable[[float], Outlines] | None = None,
    goal_source: GoalSource = GoalSource.DETECTED,
    detector: Detector | None = None,
    seen: Seen | None = None,
) -> RunResult:
    """Run a scenario until 0.5 s after docking, 5 s after a latched stop, or its duration.

    Docking is the true one: inside tolerance of the true goal with |v| <= 0.02 m/s for 0.5 s. The run waits
    for the controller to say so, for 5 s at most, and for the end of a fault that acts. A stop counts from
    the end of the last fault on.

    Args:
        preset, method, seed: as on the command line; measured state and detections have a random stream each.
        progress: called after each cycle with the simulated time [s].
        controller: drives in place of a `DockingController` made from the scenario.
        obstacles_at: obstacle polygons (k, 2) [m] at a time [s], in place of the scenario's, or beside those
            of its area; those of its faults, and the moving ones, are added. The controller is given them
            every cycle.
        goal_source: how the goal is known; must be the default in a run without a detector.
        detector: looks for the goal in place of the one that the scenario describes.
        seen: called with every picture of the scenario's camera, see `Seen`.

    Raises InputError for an unknown preset or method, a negative seed, a goal source without a detector, or a
    command that is not finite.
    """
    if seed < 0:
        raise InputError(f"seed = {seed}: must be >= 0")
    watched = detector is not None or scenario.goal.measurement is not None
    source = source_in(scenario.name, goal_source, detector=watched)
    config = scenario.controller_config(preset, method=method, detections=source is GoalSource.DETECTED)
    corridor = None if scenario.in_area else scenario.build_corridor(scenario.build_path())
    goal = scenario.goal_pose()
    if detector is None:
        detector = detector_of(scenario.goal, seed, seen)
    first, shifts = scenario.planned_goal(), scenario.goal.shifts
    feed = GoalFeed(source=source, planned=first, goal=goal, shifts=shifts, detector=detector)
    scenery = Scenery(
        corridor=corridor,
        vehicle=config.vehicle,
        faults=tuple(fault for fault in scenario.faults if fault.kind == "blocked"),
        moving=scenario.moving,
        obstacles_at=obstacles_at,
    )
    controller = controller or mission_of(scenario, controller_of(scenario, config))
    run = _Run(scenario, config, controller, scenery, feed, np.random.default_rng(seed))
    ended = run.to_its_end(progress)
    log = () if run.mission is None else run.mission.log
    planner = run.planner
    seconds, replans = (planner.planning_seconds, planner.replans) if planner is not None else (0.0, 0)
    return RunResult(
        scenario=scenario,
        preset=preset,
        method=method or scenario.controller.method,
        seed=seed,
        goal_source=source,
        config=config,
        detector=watched,
        paths=tuple(run.paths),
        obstacles=with_body(scenery.changes, log, goal, scenario.goal.body),
        corridor=corridor,
        area=scenario.build_area() if scenario.in_area else None,
        planning_seconds=seconds if scenario.in_area or replans else None,
        replans=replans,
        truth=Truth.of(run.samples, run.parameters),
        cycles=cycle_table(run.cycles),
        mission=log,
        mission_result=None if run.mission is None else run.mission.result,
        ended=ended,
    )


class _Run:
    """The state of a run, and its records."""

    def __init__(
        self,
        scenario: Scenario,
        config: ControllerConfig,
        controller: Controller,
        scenery: Scenery,
        feed: GoalFeed,
        random: np.random.Generator,
    ) -> None:
        self.scenario, self.config, self.controller = scenario, config, controller
        self.scenery, self.feed, self.random = scenery, feed, random
        self.parameters = scenario.plant_parameters()
        layers = wrapped(controller)
        self.planner: DockingController | None = layers[-1] if hasattr(layers[-1], "replans") else None
        self.mission: DockingMission | None = next((each for each in layers if hasattr(each, "docks")), None)
        self.disturbances = Disturbances(faults=scenario.faults)
        start = scenario.start_pose()
        self.plant = PlantState(x=start.x, y=start.y, phi=start.phi)
        path = None if scenario.in_area else scenario.build_path()
        if self.planner is not None:
            # The controller smooths a given path where it cannot be driven.
            path = self.planner.path
        self.paths: list[tuple[float, ReferencePath]] = [] if path is None else [(0.0, path)]
        # Progress along the route [m], and its active part.
        self.theta, self.part = 0.0 if path is None else path.parts[0].start, 0
        self.since: dict[str, float] = {}
        self.samples: list[tuple[float, ...]] = []
        self.cycles: list[tuple[float, float, Command]] = []

    @property
    def path(self) -> ReferencePath | None:
        """The current route, or the last one while the controller replans."""
        return self.paths[-1][1] if self.paths else None

    def to_its_end(self, progress: Callable[[float], None] | None) -> str:
        """Alternate plant and controller on their own clocks until the run ends; returns why."""
        simulation, cycle = self.scenario.simulation, 0
        # Rounded products instead of sums: no drift of one clock against the other.
        for step in range(round(simulation.duration / simulation.plant_step) + 1):
            time = round(step * simulation.plant_step, 9)
            while (next_cycle := round(cycle * simulation.cycle, 9)) <= time + SAME_TIME:
                self._move(next_cycle)
                self._control(next_cycle)
                cycle += 1
                if progress is not None:
                    progress(next_cycle)
            self._move(time)
            plant, goal = self.plant, self.feed.approach(self.plant.pose)
            # The first projection of a part is given its start: a self-near route must not put it elsewhere.
            if self.path is not None:
                self.theta = self.path.parts[self.part].project(plant.x, plant.y, near=self.theta)
            state = astuple(plant.measured)
            self.samples.append((time, *state, self.theta, self.part, goal.x, goal.y, goal.phi))
            if (reason := self._ending(time)) is not None:
                return reason
        return "duration"

    def _move(self, until: float) -> None:
        """Let the vehicle drive up to `until` [s], and the detector look for the goal at its own times."""
        while (stamp := self.feed.next_exposure(until)) is not None:
            self.plant = advance(self.plant, self.parameters, stamp)
            self.feed.approach(self.plant.pose)
            docks = self.mission is None or self.mission.docks
            last_part = docks and self.path is not None and self.part == len(self.path.parts) - 1
            self.feed.expose(stamp, self.plant.pose, last_part=last_part)
        self.plant = advance(self.plant, self.parameters, until)

    def _control(self, now: float) -> None:
        """One cycle: measure, step, issue the command; or lose the cycle."""
        plant, faults = self.plant, self.disturbances
        self.feed.approach(plant.pose)
        noise = self.random.standard_normal(5) * self.scenario.simulation.state_noise
        measured = VehicleState(*(astuple(plant.measured) + noise).tolist())
        state = faults.measured(measured, now)
        obstacles = self.scenery.obstacles(now, plant.pose, self.path, self.part, self.theta)
        if faults.acting("lost_cycles", now):
            return
        arguments = self._arguments(now, measured, obstacles)
        began = perf_counter()
        command = self.controller.step(state, now=now - faults.total("clock_back", now), **arguments)
        self.cycles.append((now, 1e3 * (perf_counter() - began), command))
        self._onto_route(command, now)
        rates = {"acceleration": command.acceleration, "steering_rate": command.steering_rate}
        self.plant = issue(plant, self.parameters, **rates, delay=faults.total("late_cycles", now))

    def _arguments(self, now: float, measured: VehicleState, obstacles: Outlines) -> dict[str, Any]:
        feed, faults = self.feed, self.disturbances
        goal, detections = feed.given(now, measured)
        if feed.detector is not None and feed.source is GoalSource.DETECTED:
            detections = tuple(faults.detection(each, now) for each in detections)
        else:
            # Without a path there is always a goal, and it is given.
            goal = faults.goal(goal, now, feed.goal if self.path is None else self.path.end)
        given = obstacles if self.scenery.changing else None
        arguments: dict[str, Any] = {"goal": goal, "measurements": detections, "obstacles": given}
        if self.mission is not None:
            body = self.scenario.goal.body
            outline = None if body is None else outline_at(body, feed.goal)
            arguments["signal"] = touches(self.plant.pose, self.config.vehicle, outline)
        if (clock := faults.clock(now, self.config.deadline)) is not None:
            arguments["clock"] = clock
        return arguments

    def _onto_route(self, command: Command, now: float) -> None:
        """Count progress on the current part, which may be of a route that was planned in this cycle."""
        path = self.path if self.planner is None else self.planner.path
        if path is None:
            return  # the vehicle stands and plans: its last route is over
        another = path is not self.path
        if another:
            self.paths.append((now, path))
        if another or command.diagnostics.part != self.part:
            self.part = command.diagnostics.part
            self.theta = path.parts[self.part].start

    def _ending(self, time: float) -> str | None:
        """Why the run ends now, or None, see `simulate`; a mission ends by itself."""
        if self.mission is not None:
            over = self._since("over", self.mission.over, time)
            return "mission over" if time - over >= AFTER_DOCKING - SAME_TIME else None
        last = self.cycles[-1][2] if self.cycles else None
        standing = abs(self.plant.v) <= STANDSTILL_SPEED
        tolerance = self.scenario.goal.tolerance
        inside = standing and self.plant.pose.relative_to(self.feed.goal).within(tolerance)
        docked = self._since("docked", inside, time)
        stopped = self._since("stopped", standing and last is not None and last.status in LATCHED, time)
        faults = self.scenario.faults
        most = DOCK_TIME + (AFTER_DOCKING if last is not None and last.docked else UNTIL_SAID)
        if time - docked >= most - SAME_TIME and not any(fault.acts(time) for fault in faults):
            return "docked"
        if time - max(stopped, *(fault.end for fault in faults), 0.0) >= AFTER_STOP - SAME_TIME:
            return "stopped"
        return None

    def _since(self, name: str, condition: bool, time: float) -> float:
        """Time since which a condition holds without a break [s]; inf where it does not hold."""
        if not condition:
            self.since.pop(name, None)
            return inf
        return self.since.setdefault(name, time)
