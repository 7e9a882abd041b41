"""A depot of 300 rectangles in which the map flickers: does that cost time, and how long do cycles take?

    python -m benchmarks.depot [--drives N] [--first SEED]

Shelves in six rows. Their rectangles are given at 5 Hz, each edge with a chance of 5 % a cell of 10 cm off.
Prints for each drive the time with the map still and flickering, and how long the cycles of the latter take
(time of their thread): in motion, and at rest, where routes are planned.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, pi
from time import thread_time
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from benchmarks.foreign import Car, Ride, drive
from benchmarks.tables import command_line, number, origin, table, told
from geometry import Area, Pose2
from rti_mpcc import Command, ControllerConfig, DockingController, VehicleState, prepare_process
from rti_mpcc.types import Array

COMMAND = "python -m benchmarks.depot"
HEADER = (
    *("seed", "still [s]", "flickers [s]", "ratio", "cycles in motion [ms]: p50", "p99", "max"),
    "at rest: max [ms]",
)
CELL, SHARE, PERIOD = 0.1, 0.05, 0.2
"""Of the map [m], of the edges that are off, of the readings [s]."""
CONFIG = ControllerConfig(cycle=0.05)
YARD = shapely.box(0.0, -4.0, 68.0, 46.0)
AREA = Area(boundary=shapely.get_coordinates(YARD)[:-1])
SHELVES = np.array(
    [
        (8.0 + 1.04 * k, 3.0 + 7.0 * row, 9.0 + 1.04 * k, 4.2 + 7.0 * row)
        for row in range(6)
        for k in range(50)
    ]
)
"""Left, low, right and high edges (300, 4) [m]."""
SOLID = shapely.union_all(shapely.box(*SHELVES.T))


@dataclass(frozen=True, slots=True, kw_only=True)
class Drive:
    """A ride through the depot, its goal, the time of each cycle [ms], and whether it moved in that."""

    ride: Ride
    goal: Pose2
    cycles: Array
    moved: NDArray[np.bool_]

    @property
    def seconds(self) -> float:
        """Until it stood at its goal for good and had touched nothing, or inf."""
        stays = self.ride.commands[-1].docked and self.ride.inside(self.goal, CONFIG.goal_tolerance)
        at = self.ride.docked_at
        return inf if at is None or not stays or self.ride.touches(SOLID) else at


def outlines(edges: Array) -> list[Array]:
    """Of rectangles by their left, low, right and high edges (n, 4) [m]."""
    return list(shapely.get_coordinates(shapely.box(*edges.T)).reshape(-1, 5, 2)[:, :-1])


def driven(seed: int, *, flickers: bool) -> Drive:
    """From a place drawn for a seed to another one."""
    random, flicker = np.random.default_rng((5, seed)), np.random.default_rng((6, seed))
    car = Car.driven_by(CONFIG)
    start, goal = _place(random, car), _place(random, car)
    controller = DockingController.in_area(AREA, CONFIG)
    prepare_process()
    seen: list[Any] = [-inf, None]
    times, moved = list[float](), list[bool]()

    def step(state: VehicleState, *, now: float) -> Command:
        if now - seen[0] >= PERIOD - 1e-9 and (flickers or not times):
            off = CELL * flicker.choice((-1.0, 1.0), SHELVES.shape)
            edges = SHELVES + flickers * off * (flicker.uniform(size=SHELVES.shape) < SHARE)
            seen[:] = now, outlines(edges)
        given: dict[str, Any] = {} if times else {"goal": goal}
        begin = thread_time()
        command = controller.step(state, now=now, obstacles=seen[1], **given)
        times.append(1e3 * (thread_time() - begin))
        moved.append(abs(state.v) > 0.0)
        return command

    ride = drive(step, car, start, cycle=CONFIG.cycle, seconds=240.0, seed=seed, after_docked=3.0)
    return Drive(ride=ride, goal=goal, cycles=np.array(times), moved=np.array(moved))


def _place(random: np.random.Generator, car: Car) -> Pose2:
    """Along an aisle, with half a metre of room."""
    while True:
        turn = random.choice((0.0, pi)) + random.uniform(-0.2, 0.2)
        pose = Pose2(random.uniform(4.0, 64.0), random.uniform(0.0, 42.0), float(turn))
        body = car.body(pose).buffer(0.5)
        if YARD.covers(body) and not body.intersects(SOLID):
            return pose


def row(seed: int) -> list[str]:
    """Of the table: a drive with the map still, and with flicker."""
    still, found = driven(seed, flickers=False), driven(seed, flickers=True)
    times = *np.percentile(found.cycles[found.moved], (50, 99, 100)), found.cycles[~found.moved].max()
    ratio = found.seconds / still.seconds
    figures = (still.seconds, 1), (found.seconds, 1), (ratio, 2), *((float(each), 1) for each in times)
    return [str(seed), *(number(value, digits) for value, digits in figures)]


def main() -> None:
    asked = command_line(__doc__, COMMAND)
    asked.add_argument("--drives", type=int, default=20)
    asked.add_argument("--first", type=int, default=0, metavar="SEED")
    arguments = asked.parse_args()
    rows = [row(seed) for seed in range(arguments.first, arguments.first + arguments.drives)]
    print(f"{table(HEADER, rows)}\n\n{told(origin(COMMAND))}")


if __name__ == "__main__":
    main()
