"""Foreign vehicles on missions in a yard, whose pose comes from a map that is corrected now and then.

    OMP_NUM_THREADS=1 python -m benchmarks.foreign_missions [--draws N] [--seed S]

At random: interface, cycle, actuators (given or not), gain, slope, creep torque, noise, the start, whether
the dock is known or detected by a camera, corrections of the map by up to 6 cm, the steps. Each mission is to
succeed inside of the yard, docked where the dock truly is, and to move little while it waits.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import groupby
from math import pi
from typing import get_args

import numpy as np

from benchmarks.foreign import STEP, Array, Car, Interface, Ride, Sensor, drive
from benchmarks.foreign_cameras import DockCamera, MovingDock
from benchmarks.foreign_faults import BAY, WALLS, YARD, free_space
from benchmarks.foreign_random import count_good
from benchmarks.foreign_sensors import NOISE, Faulty, healthy
from benchmarks.tables import command_line
from rti_mpcc import (
    ActuatorModel,
    Area,
    ControllerConfig,
    Dock,
    DockingController,
    DockingMission,
    DockKind,
    DriveTo,
    MissionResult,
    Pose2,
    Undock,
    VehicleState,
    Wait,
)

INTERFACES: tuple[Interface, ...] = get_args(Interface)
SECONDS = 200.0  # of a ride, the time after the mission included
CORRECTIONS = (0.06, 0.06, 0.01)  # of the map, at most [m], [m], [rad]
MEASURED = (0.02, 0.02, 0.015)  # by which a docked vehicle may be farther off, by noise of pose and camera
MOVED_SHARE = 0.5  # of the tolerance, that a vehicle may move while it waits
STEPS = (
    ("dock", "wait", "undock"),
    ("drive_to", "wait", "dock", "wait"),
    ("dock", "undock", "drive_to", "dock", "wait"),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Draw:
    """One mission.

    Attributes:
        config: of the controller; car: the vehicle; start: its true first pose.
        dock: the true one; seen: it is detected, else its pose is known.
        steps: kinds of the steps; noise: share of `NOISE`.
        corrected: the map is: times [s], and what it is off until then (k, 3) [m], [m], [rad].
    """

    config: ControllerConfig
    car: Car
    start: Pose2
    dock: Pose2
    seen: bool
    steps: tuple[str, ...]
    noise: float
    corrected: tuple[Array, Array]
    seed: int

    def drive(self) -> tuple[Ride, list[str]]:
        """What truly happens, and what is wrong with it."""
        controller = DockingController.in_area(Area(boundary=YARD, obstacles=WALLS), self.config)
        known = Dock(BAY, kind=DockKind.DETECTED) if self.seen else Dock(self.dock)
        there = DriveTo(Pose2(2.0, 4.0, 0.3))
        meant = {"dock": known, "wait": Wait(8.0), "undock": Undock(6.0), "drive_to": there}
        mission = DockingMission(controller, [meant[word] for word in self.steps])
        camera = DockCamera(dock=MovingDock(pose=self.dock), delay=0.1, noise=(0.03, 0.02))
        ride = drive(
            mission.step,
            self.car,
            self.start,
            cycle=self.config.cycle,
            seconds=SECONDS,
            sensor=self._sensor(),
            camera=camera if self.seen else None,
            seed=self.seed,
        )
        wrong = [] if mission.result is MissionResult.SUCCEEDED else [f"mission {mission.result.value}"]
        return ride, [*wrong, *self._wrong(ride)]

    def _sensor(self) -> Sensor:
        noisy = Faulty(healthy, noise=tuple(self.noise * each for each in NOISE))
        times, off = self.corrected

        def sensor(history: Array, rng: np.random.Generator) -> VehicleState:
            state, (x, y, turn) = noisy(history, rng), off[times.searchsorted(history[-1, 0])].tolist()
            return replace(state, x=state.x + x, y=state.y + y, phi=state.phi + turn)

        return sensor

    def _wrong(self, ride: Ride) -> list[str]:
        """What is wrong with the true motion."""
        if ride.leaves(free_space("bay")):
            return ["leaves the yard"]
        found, tolerance = [], np.array(self.config.goal_tolerance)
        off_map = 2.0 * np.array(CORRECTIONS) * self.corrected[1].any()
        most = tolerance + MEASURED + (0.0 if self.seen else off_map)
        # Corrections that noise hides are followed.
        far = MOVED_SHARE * tolerance[0] + off_map[0] * (self.noise > 0.0)
        said = zip(np.round(ride.stamps / STEP).astype(int).tolist(), ride.commands, strict=True)
        for kind, cycles in groupby(said, key=lambda each: each[1].mission and each[1].mission.kind):
            step = list(cycles)
            docked = next((at for at, command in step if command.docked), None)
            if kind == "dock" and docked is not None:
                off = ride.errors(self.dock)[docked]
                if (np.abs(off) > most).any():
                    found.append(f"docked {np.round(off, 3).tolist()} off")
            stood = ride.truth[step[0][0] : step[-1][0] + 1, 1:3]
            moved = float(np.hypot(*(stood - stood[0]).T).max())
            if kind == "wait" and moved > far:
                found.append(f"moved {moved:.3f} m while it waited for {len(stood) * STEP:.0f} s")
        return found


def drawn(seed: int) -> Draw:
    """The random mission of a seed."""
    random = np.random.default_rng((seed, 5))

    def sometimes(most: float) -> float:
        return float(random.choice((0.0, 1.0)) * random.uniform(0.0, most))

    car = Car(
        interface=INTERFACES[random.integers(2)],
        drive_lag=sometimes(0.5),
        steering_lag=sometimes(0.4),
        drive_dead_time=sometimes(0.3),
        steering_dead_time=sometimes(0.3),
        gain=float(random.uniform(0.85, 1.15)),
        slope=float(random.uniform(-0.04, 0.04)),
        uphill=float(random.uniform(-pi, pi)),
        creep=float(random.choice((0.0, 0.2))),
    )
    given = car.actuators if random.uniform() < 0.4 else ActuatorModel()
    cycle, times = float(random.choice((0.03, 0.05, 0.1))), np.cumsum(random.uniform(4.0, 12.0, 60))
    is_corrected = random.uniform() < 0.5
    corrections = random.uniform(-1.0, 1.0, (61, 3)) * CORRECTIONS * is_corrected
    corrections[0] = 0.0
    return Draw(
        config=ControllerConfig(deadline=None, cycle=cycle, actuators=given),
        car=car,
        start=Pose2(-9.0, 3.0, 0.0).compose(
            Pose2(*(random.uniform(-1.0, 1.0, 3) * (2.0, 2.0, 0.6)).tolist())
        ),
        dock=BAY.compose(Pose2(*(random.uniform(-1.0, 1.0, 3) * (0.15, 0.1, 0.03)).tolist())),
        seen=bool(random.uniform() < 0.6),
        steps=STEPS[random.integers(len(STEPS))],
        noise=float(random.choice((0.0, 0.3, 0.7))),
        corrected=(times, corrections),
        seed=seed,
    )


def main() -> None:
    parser = command_line(__doc__, "python -m benchmarks.foreign_missions")
    good = "missions succeed, dock where the dock is, and stay while they wait"
    count_good(parser, lambda seed: drawn(seed).drive()[1], good)


if __name__ == "__main__":
    main()
