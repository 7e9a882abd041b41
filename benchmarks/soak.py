"""One controller for very many cycles: does its memory stay flat, does it ever fail, does it slow down?

    OMP_NUM_THREADS=1 python -m benchmarks.soak [--cycles 100000]

The route shuttles between two places, now and then to a farther one, so that starting, contouring, arriving,
settling and changing direction occur again and again; states and detections of the goal are noisy; walls come
and go that fill the way, that can be passed, and that leave gaps too narrow for the body. Writes
runs/soak.json; exit status 1 if memory grew by more than 2 % after the first tenth, or a cycle failed.
"""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from statistics import median
from time import perf_counter
from typing import Any

import numpy as np
import pandas as pd
from rich.console import Console
from rich.progress import track

from benchmarks.standing_costs import resident
from benchmarks.tables import ROOT, command_line, origin, write_json
from estimation import GoalMeasurement
from geometry import Corridor, Pose2, ReferencePath
from rti_mpcc import Command, ControllerConfig, DockingController, Status, VehicleState
from rti_mpcc.simulation.plant import PlantParameters, PlantState, advance, issue
from rti_mpcc.types import Array

COMMAND = "python -m benchmarks.soak"
GROWTH = 0.02
"""Share by which memory may grow from the second tenth to the last. The first one is warm-up: what is kept is
made there for the first time, as the QP of the first wall, and that is no leak."""
CYCLES_PER_PART = 250
"""A part of the shuttle takes at least so many cycles, so that the route never ends."""
PART, LONG_PART, LONG_EVERY = 20.0, 70.0, 10
"""The way there and back [m]; on the second and then every tenth one there is room to cruise."""
HALF_WIDTH = 4.0
DEAD_TIME = 0.18
STATE_NOISE = (0.005, 0.005, 0.001, 0.005, 0.001)
"""Standard deviations of the measured x, y [m], heading [rad], speed [m/s], steering [rad]."""
GOAL_NOISE = (0.05, 0.05, 0.01)
DETECTED_EVERY, WALL_EVERY = 7, 900
"""Cycles from one detection of the goal to the next, and from one wall across the way to the next."""
WALL_STAYS, WALL_AHEAD = 300, 12.0
"""Cycles for which a wall stands, and how far ahead of the vehicle [m]."""
WALLS = ((-6.0, 6.0), (1.2, 6.0), (-3.0, 3.0))
"""Right and left ends [m], in turn: it fills the way, can be passed, leaves gaps too narrow for the body."""


def shuttle(parts: int) -> ReferencePath:
    """There and back again on the same bends."""
    segments = []
    for part in range(parts):
        there = part % 2 == 0
        length = LONG_PART if part // 2 % LONG_EVERY == 1 else PART
        way = [(0.0, 5.0), (0.08, 5.0), (-0.08, 5.0), (0.0, length - 15.0)]
        segments += [(1 if there else -1, k, s) for k, s in (way if there else way[::-1])]
    return ReferencePath.from_segments(Pose2(0.0, 0.0, 3.0), segments)


@dataclass(kw_only=True)
class Shuttle:
    """A controller that shuttles, with the plant in the loop and noise on all that is measured."""

    controller: DockingController
    config: ControllerConfig
    plant: PlantState
    rng: np.random.Generator

    @classmethod
    def of(cls, cycles: int) -> Shuttle:
        """With a route that is long enough for so many cycles."""
        path = shuttle(2 + cycles // CYCLES_PER_PART)
        config = ControllerConfig(dead_time=DEAD_TIME, deadline=None)
        corridor = Corridor.from_offsets(path, left=HALF_WIDTH, right=-HALF_WIDTH)
        plant = PlantState(x=path.start.x, y=path.start.y, phi=path.start.phi)
        return cls(
            controller=DockingController(path, corridor, config),
            config=config,
            plant=plant,
            rng=np.random.default_rng(0),
        )

    def drive(self, cycles: int) -> Iterator[tuple[Command, float]]:
        """The command of each cycle, and how long its step took [s]."""
        parameters = PlantParameters.of(self.config.vehicle, self.config.limits, dead_time=DEAD_TIME)
        for cycle in range(cycles):
            self.plant = advance(self.plant, parameters, cycle * self.config.cycle)
            state, told = self._measured(), self._told(cycle)
            begun = perf_counter()
            command = self.controller.step(state, now=self.plant.time, **told)
            yield command, perf_counter() - begun
            self.plant = issue(
                self.plant,
                parameters,
                acceleration=command.acceleration,
                steering_rate=command.steering_rate,
            )

    def _measured(self) -> VehicleState:
        plant = self.plant
        true = np.array([plant.x, plant.y, plant.phi, plant.v, plant.delta])
        return VehicleState(*(true + self.rng.normal(0.0, STATE_NOISE)).tolist())

    def _told(self, cycle: int) -> dict[str, Any]:
        """Detections now and then, and a wall that comes and goes."""
        told: dict[str, Any] = {}
        if cycle % DETECTED_EVERY == 0:
            end = self.controller.state.path.end
            seen = np.array([end.x, end.y, end.phi]) + self.rng.normal(0.0, GOAL_NOISE)
            x, y, phi = seen.tolist()
            spread = np.diag(np.square(GOAL_NOISE))
            told["measurements"] = [
                GoalMeasurement(stamp=self.plant.time, x=x, y=y, phi=phi, covariance=spread)
            ]
        if cycle % WALL_EVERY == WALL_EVERY - WALL_STAYS:
            told["obstacles"] = [self._wall(*WALLS[cycle // WALL_EVERY % len(WALLS)])]
        elif cycle % WALL_EVERY == 0 and cycle:
            told["obstacles"] = []
        return told

    def _wall(self, right: float, left: float) -> Array:
        """Across the way of the vehicle, whichever way it drives, with ends so far beside it [m]."""
        direction = self.controller.state.path.parts[self.controller.state.task.segment.index].direction
        here = Pose2(self.plant.x, self.plant.y, self.plant.phi)
        corners = [(0.0, right), (0.5, right), (0.5, left), (0.0, left)]
        placed = [here.compose(Pose2(direction * (WALL_AHEAD + x), y, 0.0)) for x, y in corners]
        return np.array([[corner.x, corner.y] for corner in placed])


def failed(command: Command) -> bool:
    """Whether a cycle found no plan that could be driven."""
    return command.status is Status.FAILED or command.diagnostics.failed


def soak(cycles: int) -> dict[str, Any]:
    """Drive, and account for memory, failures and times."""
    begun = perf_counter()
    vehicle = Shuttle.of(cycles)
    built = perf_counter() - begun
    tenth = max(cycles // 10, 1)
    seconds, memory = np.empty(cycles), np.empty(cycles)
    counts: Counter[tuple[str, str]] = Counter()
    failures: Counter[str] = Counter()
    bar = track(vehicle.drive(cycles), "soak", cycles, console=Console(stderr=True), transient=True)
    for cycle, (command, took) in enumerate(bar):
        seconds[cycle], memory[cycle] = took, resident() if cycle % 100 == 0 else memory[cycle - 1]
        counts[command.status.value, command.source.value] += 1
        if failed(command):
            failures[command.diagnostics.reason] += 1
    warm, last = memory[tenth : 2 * tenth], memory[-tenth:]
    return {
        "cycles": cycles,
        "construction_s": built,
        "parts_driven": vehicle.controller.state.task.segment.index,
        "rss_second_tenth_mb": float(np.median(warm)),
        "rss_last_tenth_mb": float(np.median(last)),
        "rss_growth": float(np.median(last) / np.median(warm) - 1.0),
        "cycle_ms_first_tenth": 1e3 * median(seconds[:tenth].tolist()),
        "cycle_ms_last_tenth": 1e3 * median(seconds[-tenth:].tolist()),
        "cycles_by_status_and_source": {f"{one}, {two}": n for (one, two), n in counts.most_common()},
        "failures": dict(failures.most_common()),
    }


def main() -> int:
    parser = command_line(__doc__, COMMAND)
    parser.add_argument("--cycles", type=int, default=100_000, metavar="N", help="default: %(default)s")
    cycles = parser.parse_args().cycles
    source = origin(f"{COMMAND} --cycles {cycles}")
    found = soak(cycles)
    print(pd.json_normalize(found).T.to_string(header=False))
    target = ROOT / "runs" / "soak.json"
    target.parent.mkdir(exist_ok=True)
    write_json(target, {"origin": source, **found})
    return int(bool(found["failures"]) or found["rss_growth"] > GROWTH)


if __name__ == "__main__":
    sys.exit(main())
