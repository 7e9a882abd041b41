"""A foreign vehicle: an own plant, own sensors and an own check.

It knows nothing of the product's simulation. The plant is a kinematic bicycle in small Euler steps with dead
times and first-order lags of both actuators, a slope, a creep torque and a parking brake. It is driven by
rates (acceleration and steering rate) or by set-points (speed and steering). A `Sensor` turns the true states
so far into what is measured, a `Camera` into detections of the goal. `drive` closes the loop around a
controller or mission and returns the true `Ride`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from math import cos, exp, sin, tan
from typing import Literal, Protocol

import numpy as np
import shapely
from numpy.typing import NDArray

from estimation import GoalMeasurement
from geometry import Pose2, wrap
from rti_mpcc import ActuatorModel, Command, ControllerConfig, Vehicle, VehicleState

STEP = 0.005  # of the plant [s]
Interface = Literal["rates", "setpoints"]
Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Car:
    """The true vehicle.

    Attributes:
        wheelbase, front, rear, width: [m]; front and rear from the rear axle.
        speed, steering: the largest [m/s], [rad]; acceleration, rate: the actuators' largest [m/s²], [rad/s].
        interface: which fields of a command it obeys.
        drive_dead_time, steering_dead_time, drive_lag, steering_lag: of the actuators [s].
        gain: true over commanded acceleration (rates) or speed (set-points).
        slope: rise of the ground along the world's direction `uphill` [rad]; 0.05 are 5 %.
        creep: acceleration of an idling drive at rest and low speed [m/s²].
        brake: it has a parking brake, which obeys `command.hold`.
    """

    wheelbase: float = 2.875
    front: float = 3.6775
    rear: float = 0.8027
    width: float = 2.069
    speed: float = 10.0
    steering: float = 0.6
    acceleration: float = 5.0
    rate: float = 1.0
    interface: Interface = "rates"
    drive_dead_time: float = 0.0
    steering_dead_time: float = 0.0
    drive_lag: float = 0.0
    steering_lag: float = 0.0
    gain: float = 1.0
    slope: float = 0.0
    uphill: float = 0.0
    creep: float = 0.0
    brake: bool = False

    @classmethod
    def of(cls, vehicle: Vehicle, **changes: object) -> Car:
        """A car of a product's vehicle size."""
        size = cls(wheelbase=vehicle.wheelbase, front=vehicle.front, rear=vehicle.rear, width=vehicle.width)
        return replace(size, **changes)  # type: ignore[arg-type]

    @classmethod
    def driven_by(cls, config: ControllerConfig, **changes: object) -> Car:
        """A car of the size and within the limits that a controller is configured for."""
        limits = config.limits
        able = {"speed": limits.speed, "steering": limits.steering, "acceleration": limits.acceleration}
        return cls.of(config.vehicle, **able, rate=max(limits.steering_rate, 1.0), **changes)

    @property
    def actuators(self) -> ActuatorModel:
        """What a user would give who knows the vehicle."""
        return ActuatorModel(
            dead_time=self.drive_dead_time,
            steering_dead_time=self.steering_dead_time,
            drive_lag=self.drive_lag,
            steering_lag=self.steering_lag,
        )

    def body(self, pose: Pose2 | Array) -> shapely.Polygon:
        """The body [m] with its rear axle at a pose (x, y, heading)."""
        x, y, phi = (pose.x, pose.y, pose.phi) if isinstance(pose, Pose2) else pose[:3]
        c, s, half = cos(phi), sin(phi), 0.5 * self.width
        corners = ((self.front, half), (-self.rear, half), (-self.rear, -half), (self.front, -half))
        return shapely.Polygon([(x + c * a - s * b, y + s * a + c * b) for a, b in corners])


@dataclass(frozen=True, slots=True)
class Event:
    """Something that happens to the vehicle from `begin` to `end` [s].

    "stopped" holds it at rest; "kerb" stops it once, at `begin`; "moved" sets it elsewhere at `begin`, by
    `shift` (x, y, heading) in its own axes.
    """

    kind: Literal["stopped", "kerb", "moved"]
    begin: float
    end: float = 0.0
    shift: tuple[float, float, float] = (0.0, 0.0, 0.0)


class Sensor(Protocol):
    """Measures the state."""

    def __call__(self, history: Array, rng: np.random.Generator) -> VehicleState:
        """`history` (k, 6): t, x, y, heading, v, delta up to now, every `STEP`."""
        ...


class Camera(Protocol):
    """Detects the goal."""

    def __call__(self, history: Array, rng: np.random.Generator) -> Sequence[GoalMeasurement]:
        """`history`: as of a `Sensor`."""
        ...


def exact(history: Array, rng: np.random.Generator) -> VehicleState:
    """The sensor without any error."""
    return state_of(history[-1])


def state_of(row: Array) -> VehicleState:
    """A row t, x, y, heading, v, delta as a measurement."""
    _, x, y, phi, v, delta = map(float, row)
    return VehicleState(x=x, y=y, phi=phi, v=v, delta=delta)


@dataclass(slots=True)
class Plant:
    """The truth, and the commands on their way."""

    car: Car
    state: Array  # (5,) x, y, heading, v, delta
    time: float = 0.0
    drive: float = 0.0  # what acts: acceleration (rates) or speed (set-points)
    wheels: float = 0.0  # what acts: steering rate or steering
    sent: list[tuple[float, float, float, bool]] = field(default_factory=list)

    def command(self, command: Command) -> None:
        """Send a command now."""
        rates = self.car.interface == "rates"
        a = command.acceleration if rates else command.speed
        b = command.steering_rate if rates else command.steering
        self.sent.append((self.time, float(a), float(b), bool(getattr(command, "hold", False))))

    def _acting(self, dead_time: float, column: int) -> float:
        for row in reversed(self.sent):
            if row[0] + dead_time <= self.time + 1e-9:
                return float(row[column])
        at_rest = column == 3 or self.car.interface == "rates"
        return 0.0 if at_rest else float(self.state[column + 2])

    def advance(self, events: Sequence[Event]) -> None:
        """Move on by one `STEP`."""
        car, (x, y, phi, v, delta), t = self.car, self.state, self.time
        drive = _lagged(self.drive, self._acting(car.drive_dead_time, 1), car.drive_lag)
        wheels = _lagged(self.wheels, self._acting(car.steering_dead_time, 2), car.steering_lag)
        most = car.acceleration
        if car.interface == "rates":
            a, rate = car.gain * drive, wheels
        else:
            a = (car.gain * drive - v) / STEP
            rate = (wheels - delta) / STEP
        pull = -9.81 * sin(car.slope) * cos(phi - car.uphill)
        creep = car.creep * max(1.0 - abs(v), 0.0)
        if car.interface == "setpoints":  # its own speed control works against slope and creep
            pull, creep = 0.3 * pull, 0.3 * creep
        a = min(max(a, -most), most) + pull + creep
        rate = min(max(rate, -car.rate), car.rate)
        before = v
        v = min(max(v + a * STEP, -car.speed), car.speed)
        delta = min(max(delta + rate * STEP, -car.steering), car.steering)
        held = car.brake and bool(self._acting(car.drive_dead_time, 3)) and abs(before) < 0.05
        for event in events:
            stops = event.kind == "stopped" and event.begin <= t < event.end
            if stops or (event.kind == "kerb" and 0.0 <= t - event.begin < STEP):
                v = 0.0
            if event.kind == "moved" and 0.0 <= t - event.begin < STEP:
                dx, dy, turn = event.shift
                x, y, phi = x + cos(phi) * dx - sin(phi) * dy, y + sin(phi) * dx + cos(phi) * dy, phi + turn
                v = 0.0
        if held:
            v = 0.0
        self.drive, self.wheels = drive, wheels
        phi_new = phi + v * tan(delta) / car.wheelbase * STEP
        self.state = np.array((x + v * cos(phi) * STEP, y + v * sin(phi) * STEP, phi_new, v, delta))
        self.time = t + STEP


def _lagged(value: float, towards: float, lag: float) -> float:
    return towards if lag <= 0.0 else towards + (value - towards) * exp(-STEP / lag)


@dataclass(frozen=True, slots=True, eq=False)
class Ride:
    """What truly happened.

    Attributes:
        truth: (k, 6) t, x, y, heading, v, delta every `STEP`; commands: one a cycle; stamps: their times [s].
        car: the vehicle.
    """

    truth: Array
    commands: tuple[Command, ...]
    stamps: Array
    car: Car

    @property
    def acceleration(self) -> Array:
        """True acceleration of each `STEP` [m/s²]."""
        return np.diff(self.truth[:, 4]) / STEP

    @property
    def top_speed(self) -> float:
        """The largest true speed [m/s]."""
        return float(np.abs(self.truth[:, 4]).max())

    @property
    def distance(self) -> float:
        """Driven [m]."""
        return float(np.abs(self.truth[:, 4]).sum() * STEP)

    @property
    def docked_at(self) -> float | None:
        """When the controller first said DOCKED [s]."""
        return next((float(t) for t, c in zip(self.stamps, self.commands, strict=True) if c.docked), None)

    def errors(self, goal: Pose2) -> Array:
        """(k, 3) longitudinal [m], lateral [m], heading [rad] of the true poses against a true goal."""
        x, y, phi = self.truth[:, 1] - goal.x, self.truth[:, 2] - goal.y, self.truth[:, 3] - goal.phi
        c, s = cos(goal.phi), sin(goal.phi)
        return np.column_stack((c * x + s * y, c * y - s * x, np.asarray(wrap(phi))))

    def inside(self, goal: Pose2, tolerance: Sequence[float], at: int = -1) -> bool:
        """Whether the true pose of one moment is inside a tolerance of the true goal."""
        return bool((np.abs(self.errors(goal)[at]) <= np.asarray(tolerance)).all())

    def moved_after(self, moment: float) -> float:
        """How far the rear axle was at most from where it was at a moment, later on [m]."""
        later = self.truth[self.truth[:, 0] >= moment - 1e-9]
        return float(np.hypot(*(later[:, 1:3] - later[0, 1:3]).T).max()) if len(later) else 0.0

    def touches(self, solid: shapely.Geometry) -> bool:
        """Whether the body ever touches something solid."""
        return any(solid.intersects(self.car.body(row[1:4])) for row in self.truth[::10])

    def leaves(self, free: shapely.Geometry) -> bool:
        """Whether the body ever leaves the free space."""
        return any(not free.covers(self.car.body(row[1:4])) for row in self.truth[::10])

    def said(self) -> dict[str, float]:
        """Each status with each first words of a reason, and when it was first said [s]."""
        found: dict[str, float] = {}
        for t, command in zip(self.stamps, self.commands, strict=True):
            found.setdefault(f"{command.status.value}: {command.diagnostics.reason}", float(t))
        return found


def drive(
    steps: Callable[..., Command],
    car: Car,
    start: Pose2,
    *,
    cycle: float,
    seconds: float,
    sensor: Sensor = exact,
    camera: Camera | None = None,
    events: Sequence[Event] = (),
    goal: Pose2 | None = None,
    seed: int = 0,
    after_docked: float | None = None,
) -> Ride:
    """Drive `controller.step` or `mission.step` for so many seconds, or until some time after DOCKED.

    Args:
        steps: the step; start: true first pose, at rest; cycle: of the loop [s].
        goal: given in the first cycle, None: none; camera: None: no detections.
        after_docked: seconds that the ride goes on for after the first DOCKED; None: to its end.
    """
    rng, plant = np.random.default_rng(seed), Plant(car, np.array((start.x, start.y, start.phi, 0.0, 0.0)))
    per_cycle = max(round(cycle / STEP), 1)
    rows, count = np.empty((round(seconds / STEP) + per_cycle + 2, 6)), 1
    rows[0] = 0.0, *plant.state
    commands: list[Command] = []
    stamps: list[float] = []
    docked: float | None = None
    while plant.time < seconds - 1e-9:
        history = rows[:count]
        given: dict[str, object] = {}
        if goal is not None and not commands:
            given["goal"] = goal
        if camera is not None:
            given["measurements"] = camera(history, rng)
        command = steps(sensor(history, rng), now=plant.time, **given)
        plant.command(command)
        commands.append(command)
        stamps.append(plant.time)
        docked = plant.time if command.docked and docked is None else docked
        if after_docked is not None and docked is not None and plant.time >= docked + after_docked:
            break
        for _ in range(per_cycle):
            plant.advance(events)
            rows[count] = plant.time, *plant.state
            count += 1
    return Ride(rows[:count].copy(), tuple(commands), np.array(stamps), car)


def at_time(history: Array, before: float) -> Array:
    """The true row (6,) some time ago [s], the first one at most."""
    row: Array = history[max(len(history) - 1 - round(before / STEP), 0)]
    return row
