"""Drives among obstacles, judged by nothing of the product: an own plant, an own body, shapely.

The plant is a kinematic bicycle in small Euler steps behind a dead time, where asked with actuators that lag,
on a slope, with wheels that stand beside what is measured. The body is a polygon of four corners.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from math import cos, sin, tan

import numpy as np
import shapely

from geometry import Corridor, Pose2, ReferencePath
from rti_mpcc import Command, ControllerConfig, DockingController, Source, Vehicle, VehicleState
from rti_mpcc.types import Array

STEP = 0.005
"""Of the plant [s]."""
FAST = 0.1
"""A contact at more than this speed is a collision [m/s]."""

Outlines = Sequence[Array]


@dataclass(frozen=True, slots=True, kw_only=True)
class Car:
    """What drives: the controller knows the dead time, and none of the rest.

    Attributes:
        lag: time constant of both actuators [s]; 0: none.
        slope: acceleration that comes on top of what is commanded [m/s²].
        offset: by which the wheels stand to the left of what is measured [rad].
        turn: so many times as tightly it turns as its wheelbase says.
    """

    config: ControllerConfig = field(default_factory=ControllerConfig)
    lag: float = 0.0
    slope: float = 0.0
    offset: float = 0.0
    turn: float = 1.0

    @property
    def vehicle(self) -> Vehicle:
        """What the controller was told of it."""
        return self.config.vehicle


@dataclass(slots=True, kw_only=True)
class Plant:
    """The truth, and what is on its way to the actuators."""

    car: Car
    x: float
    y: float
    phi: float
    v: float = 0.0
    delta: float = 0.0
    time: float = 0.0
    a: float = 0.0
    rate: float = 0.0
    pending: list[tuple[float, float, float]] = field(default_factory=list)
    told: tuple[float, float] = (0.0, 0.0)

    @property
    def measured(self) -> VehicleState:
        """The true state, as it is measured."""
        return VehicleState(x=self.x, y=self.y, phi=self.phi, v=self.v, delta=self.delta)

    @property
    def body(self) -> shapely.Polygon:
        """Where the body is [m]."""
        return body_at(self.x, self.y, self.phi, self.car.vehicle)

    def command(self, acceleration: float, steering_rate: float) -> None:
        """Commands [m/s²], [rad/s], which act after the dead time."""
        self.pending.append((self.time + self.car.config.dead_time, acceleration, steering_rate))

    def obey(self, command: Command, seconds: float) -> None:
        """A command of the controller, and on for these seconds."""
        self.command(command.acceleration, command.steering_rate)
        for _ in self.advance(seconds):
            pass

    def advance(self, seconds: float) -> Iterator[None]:
        """Move on in small steps, and stop after each."""
        car, limits = self.car, self.car.config.limits
        for _ in range(max(round(seconds / STEP), 1)):
            while self.pending and self.pending[0][0] <= self.time + 1e-9:
                _, *self.told = self.pending.pop(0)  # type: ignore[assignment]
            share = 1.0 if car.lag == 0.0 else STEP / (car.lag + STEP)
            self.a += share * (self.told[0] - self.a)
            self.rate += share * (self.told[1] - self.rate)
            v = self.v + 0.5 * STEP * (self.a + car.slope)
            self.x += STEP * v * cos(self.phi)
            self.y += STEP * v * sin(self.phi)
            self.phi += STEP * v * car.turn * tan(self.delta + car.offset) / car.vehicle.wheelbase
            self.v += STEP * (self.a + car.slope)
            self.delta = min(max(self.delta + STEP * self.rate, -limits.steering), limits.steering)
            self.time += STEP
            yield


def on_lane(
    path: ReferencePath | float, half: float, config: ControllerConfig | None = None
) -> DockingController:
    """On a path, or so far [m] straight along x, in a corridor `half` [m] to both sides."""
    if not isinstance(path, ReferencePath):
        path = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(1, 0.0, path)])
    return DockingController(path, Corridor.from_offsets(path, left=half, right=-half), config)


def body_at(x: float, y: float, phi: float, vehicle: Vehicle) -> shapely.Polygon:
    """The body polygon at a pose."""
    c, s, half = cos(phi), sin(phi), 0.5 * vehicle.width
    corners = [(-vehicle.rear, -half), (vehicle.front, -half), (vehicle.front, half), (-vehicle.rear, half)]
    return shapely.Polygon([(x + c * u - s * w, y + s * u + c * w) for u, w in corners])


def square(x: float, y: float, size: float, turned: float = 0.0) -> Array:
    """Outline (4, 2) of a square [m]."""
    c, s, h = cos(turned), sin(turned), 0.5 * size
    return np.array([(x + c * u - s * w, y + s * u + c * w) for u, w in ((-h, -h), (h, -h), (h, h), (-h, h))])


@dataclass(frozen=True, slots=True, kw_only=True)
class Contact:
    """A contact that begins: when [s], at which speed of the vehicle [m/s], and where on the body.

    Attributes:
        front: it is at the end of the body that goes ahead.
    """

    time: float
    speed: float
    front: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class Drive:
    """What happened, a row a cycle."""

    states: Array  # (n, 5) x, y, phi, v, delta
    times: Array
    commands: tuple[Command, ...]
    overlaps: tuple[bool, ...]
    contacts: tuple[Contact, ...]
    clearance: float
    """Least distance of the body to any obstacle [m], 0 where it touches one."""

    @property
    def collisions(self) -> tuple[Contact, ...]:
        """Contacts at speed."""
        return tuple(contact for contact in self.contacts if abs(contact.speed) > FAST)

    @property
    def docked(self) -> bool:
        """Whether it is docked in the end."""
        return self.commands[-1].docked

    @property
    def resumptions(self) -> list[float]:
        """Times at which a vehicle that braked, or stood, drives on [s]."""
        braking = [command.source in (Source.BRAKING, Source.STANDSTILL) for command in self.commands]
        return [float(self.times[k]) for k in range(1, len(braking)) if braking[k - 1] and not braking[k]]


def drive(
    controller: DockingController,
    car: Car,
    start: Pose2,
    seconds: float,
    *,
    obstacles_at: Callable[[float], Outlines] | None = None,
    goal: Pose2 | None = None,
    v: float = 0.0,
    delta: float = 0.0,
    noise: np.random.Generator | None = None,
    stds: Sequence[float] = (0.0,) * 5,
    until_docked: bool = True,
    before_cycle: Callable[[Plant], None] | None = None,
) -> Drive:
    """Drive for `seconds` [s], or until half a second after the controller says that it has docked.

    Obstacles that the vehicle is in contact with at the begin make no new contact. `before_cycle` is shown
    the plant before each step.
    """
    plant = Plant(car=car, x=start.x, y=start.y, phi=start.phi, v=v, delta=delta)
    cycle = car.config.cycle
    rows, times, commands, overlaps, contacts = [], [], [], [], []
    clearance, touching, docked_for = np.inf, True, 0.0
    for k in range(round(seconds / cycle)):
        now = k * cycle
        if before_cycle is not None:
            before_cycle(plant)
        state = plant.measured
        if noise is not None:
            off = noise.standard_normal(5) * stds
            state = VehicleState(
                *(np.array([state.x, state.y, state.phi, state.v, state.delta]) + off).tolist()
            )
        outlines = None if obstacles_at is None else obstacles_at(now)
        command = controller.step(state, now=now, goal=goal, obstacles=outlines)
        shapes = [] if outlines is None else [shapely.Polygon(outline) for outline in outlines]
        rows.append((plant.x, plant.y, plant.phi, plant.v, plant.delta))
        times.append(now)
        commands.append(command)
        overlaps.append(any(plant.body.intersects(shape) for shape in shapes))
        plant.command(command.acceleration, command.steering_rate)
        for _ in plant.advance(cycle):
            if obstacles_at is None:
                continue
            shapes = [shapely.Polygon(outline) for outline in obstacles_at(plant.time)]
            body = plant.body
            apart = min((body.distance(shape) for shape in shapes), default=np.inf)
            clearance = min(clearance, apart)
            if apart == 0.0 and not touching:
                met = next(shape for shape in shapes if body.intersects(shape))
                contacts.append(Contact(time=plant.time, speed=plant.v, front=_is_ahead(plant, met)))
            touching = apart == 0.0
        docked_for = docked_for + cycle if command.docked else 0.0
        if until_docked and docked_for >= 0.5:
            break
    return Drive(
        states=np.array(rows),
        times=np.array(times),
        commands=tuple(commands),
        overlaps=tuple(overlaps),
        contacts=tuple(contacts),
        clearance=float(clearance),
    )


def _is_ahead(plant: Plant, shape: shapely.Polygon) -> bool:
    """Whether what is met is at the end of the body that goes ahead, not beside it or behind."""
    vehicle, sign = plant.car.vehicle, 1.0 if plant.v >= 0.0 else -1.0
    met = shape.intersection(plant.body).centroid
    along = cos(plant.phi) * (met.x - plant.x) + sin(plant.phi) * (met.y - plant.y)
    return bool(along > vehicle.front - 0.3 if sign > 0.0 else along < 0.3 - vehicle.rear)


def stops_in_time(plant: Plant, obstacles_at: Callable[[float], Outlines], *, seconds: float = 10.0) -> bool:
    """Whether braking at the limit from now on, steering held, meets nothing at more than `FAST`.

    `plant` is moved on: pass a copy.
    """
    plant.pending = list(plant.pending)
    most, cycle = plant.car.config.limits.acceleration, plant.car.config.cycle
    for _ in range(round(seconds / cycle)):
        # What still acts before the command does is not known to the sender: it brakes until it stands.
        sign = np.sign(plant.v) if abs(plant.v) > 1e-3 else 0.0
        wanted = min(most, abs(plant.v) / cycle)
        plant.command(-sign * wanted, 0.0)
        for _ in plant.advance(cycle):
            if abs(plant.v) <= FAST and not plant.pending:
                return True
            body = plant.body
            shapes = (shapely.Polygon(outline) for outline in obstacles_at(plant.time))
            if abs(plant.v) > FAST and any(body.intersects(shape) for shape in shapes):
                return False
        if abs(plant.v) <= FAST:
            return True
    return True


def copied(plant: Plant, **changes: object) -> Plant:
    """The same again, to be driven on in thought."""
    return replace(plant, pending=list(plant.pending), **changes)  # type: ignore[arg-type]
