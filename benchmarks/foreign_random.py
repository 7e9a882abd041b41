"""Foreign vehicles with everything at random that an integrator may have.

    OMP_NUM_THREADS=1 python -m benchmarks.foreign_random [--draws N] [--seed S]

Kind of vehicle and ride, cycle, stamps (uneven, seconds since 1970), place on a map, interface, actuators
(given or not), slope, noise, dead band, goals that are corrected, obstacles that tremble, lost cycles,
cycles without time, unusable states. Each is to dock where it was last asked to, to stay there, and to
accuse no healthy sensor.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import dataclass
from math import pi
from typing import Any, get_args

import numpy as np
from numpy.random import Generator

from benchmarks.foreign import Car, Interface, Ride, drive
from benchmarks.foreign_sensors import NOISE, Faulty, dead_band, healthy
from benchmarks.tables import command_line
from rti_mpcc import (
    ActuatorModel,
    Command,
    ControllerConfig,
    Corridor,
    DockingController,
    Pose2,
    ReferencePath,
    VehicleState,
)
from rti_mpcc.clock import Decisions, PlayedBack

KINDS = ("rc_car", "delivery_robot", "forklift", "car", "van", "bus")
CYCLES = (0.02, 0.03, 0.05, 0.07, 0.1)  # [s]
SECONDS, AFTER = 180.0, 20.0  # of a ride at most, and after the first DOCKED [s]
PLENTY = 40  # iterations of a cycle that has time
ACCUSES = ("leapt", "does not follow", "sensor", "internal error")


@dataclass(frozen=True, slots=True, kw_only=True)
class Draw:
    """One ride.

    Attributes:
        config: of the controller; path, half: its corridor's width to either side [m]; goals: the first one,
            and corrections of it, with their times [s].
        car: the vehicle; noise: share of `NOISE`; dead_band: speeds below are measured as 0 [m/s].
        since: time at the start [s]; uneven: share of the cycle by which stamps are off.
        lost, blind: begin and length [s] of a time without cycles, and of one with unusable states.
        trembles: an obstacle beside the route is seen with noise of 1 cm.
        busy: share of the cycles that have no time for an iteration, as on a loaded machine.
    """

    config: ControllerConfig
    path: ReferencePath
    half: float
    goals: tuple[tuple[float, Pose2], ...]
    car: Car
    noise: float
    dead_band: float
    since: float
    uneven: float
    lost: tuple[float, float]
    blind: tuple[float, float]
    trembles: bool
    busy: float
    seed: int

    @property
    def goal(self) -> Pose2:
        """The last one."""
        return self.goals[-1][1]

    def drive(self) -> Ride:
        """What truly happens."""
        fault = dead_band(self.dead_band) if self.dead_band else healthy
        return drive(
            _loop(self),
            self.car,
            self.path.start,
            cycle=self.config.cycle,
            seconds=SECONDS,
            sensor=Faulty(fault, noise=tuple(self.noise * each for each in NOISE)),
            seed=self.seed,
            after_docked=AFTER + max(time for time, _ in self.goals),
        )


def drawn(seed: int) -> Draw:
    """The random ride of a seed."""
    random = np.random.default_rng(seed)
    kind, ride = str(random.choice(KINDS)), "brisk" if seed % 3 == 0 else "smooth"
    config = ControllerConfig.for_vehicle(kind, ride=ride)
    unknown = {
        "drive_dead_time": 0.3 * random.uniform(),
        "steering_dead_time": 0.3 * random.uniform(),
        "drive_lag": 0.5 * random.uniform(),
        "steering_lag": 0.5 * random.uniform(),
    }
    actuators = {name: float(value) * (random.uniform() < 0.7) for name, value in unknown.items()}
    given = Car.of(config.vehicle, **actuators).actuators if random.uniform() < 0.4 else ActuatorModel()
    config = config.changed(cycle=float(random.choice(CYCLES)), deadline=None, actuators=given)
    path, interface = _path(random, config), str(random.choice(get_args(Interface)))
    small = min(config.goal_tolerance[0] / 0.05, 1.0)
    slow = float(random.choice((0.0, 0.05))) * small  # [m/s]
    return Draw(
        config=config,
        path=path,
        half=float(random.uniform(1.8, 3.5)) * config.vehicle.width,
        goals=tuple(_goals(random, path.end, config)),
        car=Car.driven_by(
            config,
            interface=interface,
            slope=float(random.choice((0.0, random.uniform(-0.05, 0.05)))),
            uphill=float(random.uniform(-pi, pi)),
            creep=float(random.choice((0.0, 0.2))),
            brake=bool(random.uniform() < 0.3),
            **actuators,
        ),
        noise=0.0 if slow else float(random.choice((0.0, 0.3, 0.7))) * small,
        dead_band=slow,
        since=float(random.choice((0.0, 1.7e9))),
        uneven=float(random.choice((0.0, 0.1))),
        lost=_spell(random, 0.8),
        blind=_spell(random, 0.4),
        trembles=bool(random.uniform() < 0.3),
        busy=float(random.choice((0.0, 0.3))),
        seed=seed,
    )


def _path(random: Generator, config: ControllerConfig) -> ReferencePath:
    """One to three arcs in one direction, at a place of a map."""
    x, y = random.choice(((0.0, 0.0), (4.5e5, 5.4e6)))
    direction, radius = int(random.choice((-1, 1))), 1.4 / config.max_curvature
    arcs = [
        (
            direction,
            float(random.uniform(-0.5, 0.5)) * config.max_curvature,
            float(random.uniform(1.5, 3.0)) * radius,
        )
        for _ in range(random.integers(1, 4))
    ]
    return ReferencePath.from_segments(
        start=Pose2(float(x), float(y), float(random.uniform(-pi, pi))), segments=arcs
    )


def _goals(random: Generator, end: Pose2, config: ControllerConfig) -> list[tuple[float, Pose2]]:
    """A goal near the path's end, and up to two corrections by centimetres, each given once."""
    size, times = config.vehicle.wheelbase, np.cumsum(random.uniform(1.0, 8.0, random.integers(0, 3)))
    off = random.uniform(-1.0, 1.0, 3) * (0.3 * size, 0.05 * size, 0.05)
    goals = [(0.0, end.compose(Pose2(*off.tolist())))]
    for time in times.tolist():
        x, y, turn = (random.uniform(-1.0, 1.0, 3) * (0.05 * size, 0.02 * size, 0.03)).tolist()
        goals.append((time, goals[-1][1].compose(Pose2(x, y, turn))))
    return goals


def _spell(random: Generator, longest: float) -> tuple[float, float]:
    """Begin and length of a time [s]; in half of the rides there is none."""
    begin, length = random.uniform(2.0, 15.0), longest * random.uniform()
    return float(begin), float(length) * (random.uniform() < 0.5)


def _loop(draw: Draw) -> Callable[..., Command]:
    """The step of a controller in a loop that is not perfect."""
    random, left = np.random.default_rng(draw.seed), list(draw.goals)
    load = np.random.default_rng((draw.seed, 1))
    corridor = Corridor.from_offsets(draw.path, left=draw.half, right=-draw.half)
    controller, last = DockingController(draw.path, corridor, draw.config), list[Command]()
    aside = draw.half - 0.15 * draw.config.vehicle.width  # beside the body, at the middle of the path
    part = draw.path.parts[0]
    middle = part.pose(0.5 * (part.start + part.end)).compose(Pose2(0.0, aside, 0.0))
    box = np.array(((0.0, 0.0), (0.1, 0.0), (0.1, 0.1), (0.0, 0.1))) * draw.config.vehicle.width

    def step(state: VehicleState, *, now: float) -> Command:
        if last and 0.0 <= now - draw.lost[0] < draw.lost[1]:
            return last[-1]  # the vehicle goes on with it
        given: dict[str, Any] = {}
        if left and now >= left[0][0]:
            given["goal"] = left.pop(0)[1]
        if draw.trembles:
            place = (middle.x, middle.y) + 0.01 * random.normal(size=2)
            given["obstacles"] = [box + place]
        if 0.0 <= now - draw.blind[0] < draw.blind[1]:
            state = VehicleState(x=np.nan, y=state.y, phi=state.phi, v=state.v, delta=state.delta)
        late = draw.uneven * draw.config.cycle * random.uniform()
        iterations = 0 if load.uniform() < draw.busy else PLENTY
        clock = PlayedBack(Decisions(granted=(True,) * iterations))
        last.append(controller.step(state, now=draw.since + now + late, clock=clock, **given))
        return last[-1]

    return step


def faults(draw: Draw, ride: Ride) -> list[str]:
    """What is wrong with a ride."""
    found, tolerance = [], draw.config.goal_tolerance
    if not ride.commands[-1].docked:
        found.append(f"not docked: {ride.commands[-1].diagnostics.reason}")
    elif not ride.inside(draw.goal, tolerance):
        found.append(f"docked {np.round(ride.errors(draw.goal)[-1], 3).tolist()} off")
    said = {word for each in ride.commands for word in ACCUSES if word in each.diagnostics.reason}
    if draw.dead_band:  # its speed sensor is not healthy
        said.discard("sensor")
    if draw.lost[1]:  # the vehicle went on with a set-point meanwhile
        said.discard("leapt")
    return [*found, *(f"said: {word}" for word in sorted(said))]


def count_good(parser: argparse.ArgumentParser, wrong: Callable[[int], list[str]], good: str) -> None:
    """Drive as many seeds as the command asks for: print what is wrong with any, and how many are good."""
    parser.add_argument("--draws", type=int, default=60)
    parser.add_argument("--seed", type=int, default=1)
    given, count = parser.parse_args(), 0
    for seed in range(given.seed, given.seed + given.draws):
        found = wrong(seed)
        count += not found
        if found:
            print(f"seed {seed}: {'; '.join(found)}", flush=True)
    print(f"{count} of {given.draws} {good}")


def main() -> None:
    def wrong(seed: int) -> list[str]:
        draw = drawn(seed)
        return faults(draw, draw.drive())

    parser = command_line(__doc__, "python -m benchmarks.foreign_random")
    count_good(parser, wrong, "rides dock, stay and accuse nobody")


if __name__ == "__main__":
    main()
