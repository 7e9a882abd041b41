"""Does a foreign vehicle stay where it docked? Random vehicles on the README's path, in their own size.

After the first DOCKED a ride goes on for 60 s: the true pose must stay inside the tolerance, and move by no
more than a third of it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import pi, radians

import numpy as np

from benchmarks.encounters import on_lane
from benchmarks.foreign import Car, Ride, Sensor, drive
from benchmarks.foreign_sensors import Faulty, dead_band, healthy
from rti_mpcc import ControllerConfig, Pose2, ReferencePath, Vehicle
from tests.rti_mpcc.actuator_draws import NOISE

AFTER = 60.0  # [s] after DOCKED
SECONDS = 240.0  # of a ride, at most [s]
LARGEST_SHARE = 1.0 / 3.0  # of the tolerance, that it may move after DOCKED
DEFAULT = Vehicle()
SEGMENTS = [(-1, -0.2, 10.0), (-1, 0.2, 10.0), (-1, 0.0, 5.0), (-1, 0.2, 5.0)]
GOAL = (11.08, -15.24, 1.171)


@dataclass(frozen=True, slots=True, kw_only=True)
class Draw:
    """A vehicle, and how it measures its speed.

    Attributes:
        wheelbase: [m]; the rest of the body is in proportion to that of the default car.
        tolerance: along and across [m]; dead_band: speeds below it are measured as 0 [m/s].
        actuators: fields of a `Car`; cycle: of the loop [s]; noise: share of `NOISE`.
    """

    wheelbase: float
    tolerance: float
    dead_band: float
    actuators: dict[str, object]
    cycle: float = 0.05
    noise: float = 0.0

    @property
    def scale(self) -> float:
        """Share of the default car."""
        return self.wheelbase / DEFAULT.wheelbase

    @property
    def goal(self) -> Pose2:
        """Where it docks."""
        x, y, phi = GOAL
        return Pose2(self.scale * x, self.scale * y, phi)

    @property
    def tolerances(self) -> tuple[float, float, float]:
        """Longitudinal [m], lateral [m], heading [rad]."""
        return self.tolerance, self.tolerance, radians(2.0)

    def drive(self, after: float = AFTER) -> Ride:
        """Dock, and stand for so many seconds."""
        scale = self.scale
        vehicle = Vehicle(
            wheelbase=self.wheelbase,
            width=scale * DEFAULT.width,
            front=scale * DEFAULT.front,
            rear=scale * DEFAULT.rear,
        )
        start, segments = Pose2(0.0, 0.0, pi / 2), [(d, c / scale, scale * way) for d, c, way in SEGMENTS]
        path = ReferencePath.from_segments(start=start, segments=segments)
        config = ControllerConfig(
            cycle=self.cycle, deadline=None, vehicle=vehicle, goal_tolerance=self.tolerances
        )
        return drive(
            on_lane(path, 5.0 * scale, config).step,
            Car.of(vehicle, **self.actuators),
            start,
            cycle=self.cycle,
            seconds=SECONDS,
            sensor=self._sensor(),
            goal=self.goal,
            after_docked=after,
        )

    def _sensor(self) -> Sensor:
        noisy = Faulty(healthy, noise=tuple((self.noise * NOISE).tolist()) if self.noise else None)
        hides = dead_band(self.dead_band)
        return lambda history, rng: hides(noisy(history, rng), history, history[-1])


@dataclass(frozen=True, slots=True, kw_only=True)
class Stay:
    """What a vehicle did after DOCKED.

    Attributes:
        docked_at: [s], or None; share: of the tolerance that it moved, at most; worst: error over tolerance.
        lost: cycles after the first DOCKED that were not docked.
    """

    docked_at: float | None
    share: float = 0.0
    worst: float = 0.0
    lost: int = 0

    @property
    def good(self) -> bool:
        """Whether it docked and stayed."""
        return self.docked_at is not None and self.worst <= 1.0 and self.share <= LARGEST_SHARE


def draws(count: int, seed: int) -> Iterator[Draw]:
    """Random vehicles: lag to 0.5 s, slopes of 5 % whichever way, dead bands, creep torque, any size."""
    for index in range(count):
        rng = np.random.default_rng((seed, index))
        wheelbase, tolerance = np.exp(rng.uniform(np.log((0.3, 0.005)), np.log((6.0, 0.05)))).tolist()
        actuators: dict[str, object] = {
            "drive_lag": float(rng.choice((0.0, 1.0)) * rng.uniform(0.0, 0.5)),
            "slope": float(rng.uniform(-0.05, 0.05)),
            "uphill": GOAL[2] + float(rng.choice((0.0, rng.uniform(-pi, pi)))),
            "creep": float(rng.choice((0.0, 0.3))),
            "brake": bool(rng.uniform() < 0.25),
        }
        dead_band = float(rng.choice((0.0, 0.1)))
        yield Draw(wheelbase=wheelbase, tolerance=tolerance, dead_band=dead_band, actuators=actuators)


def stay_of(draw: Draw, ride: Ride) -> Stay:
    """What the vehicle of a ride did after DOCKED."""
    docked = ride.docked_at
    if docked is None:
        return Stay(docked_at=None)
    later = ride.truth[:, 0] >= docked - 1e-9
    shares = np.abs(ride.errors(draw.goal)[later]) / draw.tolerances
    said = zip(ride.stamps, ride.commands, strict=True)
    return Stay(
        docked_at=docked,
        share=ride.moved_after(docked) / draw.tolerance,
        worst=float(shares.max()),
        lost=sum(not command.docked for at, command in said if at >= docked),
    )
