"""Short drives in areas: the plant of the simulation, an own body and shapely to judge them by."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import shapely

from benchmarks.encounters import body_at
from estimation import GoalMeasurement
from geometry import Area, Pose2
from rti_mpcc import Command, ControllerConfig, DockingController, Status, VehicleState
from rti_mpcc.clock import CycleClock
from rti_mpcc.simulation.closed_loop import Controller
from rti_mpcc.simulation.plant import PlantParameters, PlantState, advance
from rti_mpcc.types import Array
from tests.rti_mpcc.docking_runs import obeyed

CYCLE, DEAD_TIME = 0.05, 0.18
BRISK = ControllerConfig(cycle=CYCLE, dead_time=DEAD_TIME, comfort_acceleration=1.2)
"""Settings of most drives: they are short."""
START = Pose2(0.0, 0.0, 0.0)
YARD = Area(boundary=[(-8.0, -8.0), (22.0, -8.0), (22.0, 8.0), (-8.0, 8.0)])
"""30 m by 16 m, with nothing in it."""
WALLS = [
    [(7.0, 1.5), (8.0, 1.5), (8.0, 8.0), (7.0, 8.0)],
    [(7.0, -8.0), (8.0, -8.0), (8.0, -1.5), (7.0, -1.5)],
]
ROOMS = YARD.with_obstacles(WALLS)
"""The same in two rooms, with a door 3 m wide."""
BEYOND = Pose2(14.0, 0.0, 0.0)
"""In the other room."""

Outlines = Sequence[Array]


def block(left: float, bottom: float, right: float, top: float) -> Array:
    """Corners (4, 2) of a rectangle [m]."""
    return np.array([(left, bottom), (right, bottom), (right, top), (left, top)])


DOOR = block(7.0, -1.5, 8.0, 1.5)
"""What fills the door."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Drive:
    """What happened, a row a cycle.

    Attributes:
        times: (n,) [s]; states: (n, 5) the true x, y, phi, v, delta; commands: of each cycle.
        clearance: (n,) of the body to all that stood there then [m], 0 where it touches something.
    """

    times: Array
    states: Array
    commands: tuple[Command, ...]
    clearance: Array

    @property
    def docked(self) -> bool:
        return self.commands[-1].docked

    @property
    def statuses(self) -> list[Status]:
        """In the order in which they came."""
        found: list[Status] = []
        for command in self.commands:
            if not found or found[-1] is not command.status:
                found.append(command.status)
        return found

    @property
    def reasons(self) -> list[str]:
        return [command.diagnostics.reason for command in self.commands]

    def between(self, begin: float, end: float) -> slice:
        """The cycles of a time [s]."""
        first, stop = np.searchsorted(self.times, [begin - 1e-6, end - 1e-6])
        return slice(int(first), int(stop))

    def error(self, goal: Pose2) -> Pose2:
        """Of the last pose, in the goal's frame."""
        x, y, phi = self.states[-1, :3]
        return Pose2(x, y, phi).relative_to(goal)

    def commanded(self) -> Array:
        """Acceleration and steering rate (n, 2)."""
        return np.array([(command.acceleration, command.steering_rate) for command in self.commands])


@dataclass(slots=True, kw_only=True)
class Driver:
    """What a drive is made of; by default all goes well.

    Attributes:
        area: that it is judged by; controller: that drives, or one in the area; config: of it.
        goal_at, obstacles_at, measurements_at, clock_at: what is told, at a time [s]; None: nothing.
        standing_at: what stands there besides the area, in truth; None: what is told.
        measured: what is measured of the truth; moved: the plant set down elsewhere, before a cycle.
        shown: by the user's clock at a time [s]; lost: whether the cycle of a time is lost.
    """

    area: Area
    config: ControllerConfig = BRISK
    controller: Controller | None = None
    start: Pose2 = START
    delta: float = 0.0
    goal_at: Callable[[float], Pose2 | None] = lambda now: BEYOND
    obstacles_at: Callable[[float], Outlines] | None = None
    standing_at: Callable[[float], Outlines] | None = None
    measurements_at: Callable[[float, PlantState], list[GoalMeasurement]] | None = None
    clock_at: Callable[[float], CycleClock] | None = None
    measured: Callable[[PlantState], VehicleState] = field(default=lambda plant: plant.measured)
    moved: Callable[[PlantState], PlantState] = field(default=lambda plant: plant)
    shown: Callable[[float], float] = field(default=lambda now: now)
    lost: Callable[[float], bool] = field(default=lambda now: False)

    def drive(self, seconds: float, *, after_docking: float = 0.3) -> Drive:
        """For so long, or until it has said that it docked for a while [s]."""
        if self.controller is None:
            self.controller = DockingController.in_area(self.area, self.config)
        parameters = PlantParameters.of(
            self.config.vehicle, self.config.limits, dead_time=self.config.dead_time
        )
        plant = PlantState(x=self.start.x, y=self.start.y, phi=self.start.phi, delta=self.delta)
        times, states, commands, clearance, docked_for = [], [], [], [], 0.0
        for k in range(round(seconds / CYCLE)):
            plant = self.moved(advance(plant, parameters, k * CYCLE))
            told = self._told(plant)
            if self.lost(plant.time):
                continue
            command = self.controller.step(self.measured(plant), now=self.shown(plant.time), **told)
            times.append(plant.time)
            states.append((plant.x, plant.y, plant.phi, plant.v, plant.delta))
            there = told.get("obstacles", ()) if self.standing_at is None else self.standing_at(plant.time)
            clearance.append(self._clearance(plant, there))
            commands.append(command)
            docked_for = docked_for + CYCLE if command.docked else 0.0
            if docked_for >= after_docking:
                break
            plant = obeyed(plant, command, parameters)
        return Drive(
            times=np.array(times),
            states=np.array(states),
            commands=tuple(commands),
            clearance=np.array(clearance),
        )

    def _told(self, plant: PlantState) -> dict[str, Any]:
        now = plant.time
        told: dict[str, Any] = {"goal": self.goal_at(now)}
        if self.obstacles_at is not None:
            told["obstacles"] = self.obstacles_at(now)
        if self.measurements_at is not None:
            told["measurements"] = self.measurements_at(now, plant)
        if self.clock_at is not None:
            told["clock"] = self.clock_at(now)
        return told

    def _clearance(self, plant: PlantState, told: Outlines) -> float:
        body = body_at(plant.x, plant.y, plant.phi, self.config.vehicle)
        shapes = [_shape(outline) for outline in (*self.area.obstacles, *told)]
        room = min((body.distance(shape) for shape in shapes), default=np.inf)
        if self.area.boundary is None:
            return float(room)
        inside = shapely.Polygon(self.area.boundary)
        return float(min(room, inside.exterior.distance(body) if inside.covers(body) else 0.0))


def _shape(outline: Array) -> Any:
    """A polygon, or a line or a point."""
    return shapely.Polygon(outline) if len(outline) > 2 else shapely.MultiPoint(outline).convex_hull
