"""Rides of foreign vehicles with one faulty sensor each, and what is said of them.

    OMP_NUM_THREADS=1 python -m benchmarks.foreign_faults [--write]

Each fault is driven on a given path in reverse, into a bay on a planned route, and in a mission. The table
has rides by accelerations, tests/acceptance also rides by set-points. The limits: the body stays inside the
free space, its top speed is at most 1.3 times that of the healthy ride, it ends docked or standing, and the
sensor is named.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cache
from math import pi
from typing import Any, Final

import numpy as np
import shapely

from benchmarks.foreign import STEP, Array, Car, Event, Interface, Ride, drive
from benchmarks.foreign_sensors import (
    NOISE,
    VISIBLE,
    Fault,
    Faulty,
    dead_band,
    dead_speed,
    drifting_pose,
    frozen,
    frozen_motion,
    healthy,
    inverted_steering,
    jumping_pose,
    late_pose,
    late_speed,
    offset_steering,
    pose_of,
    scaled_speed,
    stuck_speed,
    stuck_steering,
    unsigned_speed,
)
from benchmarks.tables import ROOT, command_line, number, origin, replace_block, table, told
from geometry import Area, Corridor, Pose2, ReferencePath
from rti_mpcc import Command, ControllerConfig, Dock, DockingController, DockingMission, Undock, Wait

CONFIG: Final = ControllerConfig(deadline=None)
SECONDS = {"path": 90.0, "bay": 75.0, "mission": 120.0}
"""Length of a ride [s], longer than a healthy one takes."""
AFTER_DOCKED = 10.0
"""How long a ride goes on for after it has docked [s]."""
TOP_SPEED_SHARE, TOP_SPEED_MORE = 1.3, 0.05
"""A faulty ride is at most so much faster than the healthy one: a share, and [m/s]."""
STANDS = 0.02  # [m/s]
KINDS = ("path", "bay", "mission")


@dataclass(frozen=True, slots=True)
class Case:
    """A fault.

    Attributes:
        fault: of the sensor; begins: [s]; named: words of which one has to be said.
        car: changes of the car; events: of the world.
        clock: time that the controller is told at a true time [s].
    """

    fault: Fault = healthy
    begin: float = 0.0
    named: tuple[str, ...] = ()
    car: Mapping[str, Any] = field(default_factory=dict)
    events: tuple[Event, ...] = ()
    clock: Callable[[float], float] = lambda now: now


NAMED_WITHIN = 0.5
"""Farthest that a vehicle drives with a visible fault before it is named [m]; see VISIBLE."""
SPEED, POSE, STEERING = ("speed sensor",), ("pose",), ("steering",)
CASES: Final[Mapping[str, Case]] = {
    "healthy": Case(),
    "speed without sign": Case(unsigned_speed, named=SPEED),
    "speed dead": Case(dead_speed, named=SPEED),
    "speed dead from 2 s": Case(dead_speed, 2.0, SPEED),
    "speed stuck from 2 s": Case(stuck_speed, 2.0, SPEED),
    "speed x 0.7": Case(scaled_speed(0.7), named=SPEED),
    "speed x 1.3": Case(scaled_speed(1.3), named=SPEED),
    "speed 0.1 s late": Case(late_speed(0.1), named=SPEED),
    "speed 0.3 s late": Case(late_speed(0.3), named=SPEED),
    "speed 0 below 0.1 m/s": Case(dead_band(0.1), named=SPEED),
    "all frozen": Case(frozen, named=("does not change",)),
    "all frozen from 3 s": Case(frozen, 3.0, ("does not change", "pose")),
    "position, speed frozen from 3 s": Case(frozen_motion, 3.0, ("pose", "speed sensor")),
    "steering + 0.1 rad": Case(offset_steering(0.1), named=STEERING),
    "steering - 0.05 rad": Case(offset_steering(-0.05), named=STEERING),
    "steering of wrong sign": Case(inverted_steering, named=STEERING),
    "steering stuck": Case(stuck_steering, named=STEERING),
    "steering stuck from 3 s": Case(stuck_steering, 3.0, STEERING),
    "steering limp": Case(named=STEERING, car={"rate": 0.0}),
    "pose 0.1 s late": Case(late_pose(0.1), named=POSE),
    "pose 0.3 s late": Case(late_pose(0.3), named=POSE),
    "pose jumping 0.5 m": Case(jumping_pose(0.5), 1.0, ("jumped", "pose")),
    "pose drifting 0.1 m/s ahead": Case(drifting_pose(0.1, 0.3), 1.0, POSE),
    "pose drifting 0.2 m/s aside": Case(drifting_pose(0.2, 1.9), 1.0, POSE),
    "pose of the middle": Case(pose_of(1.4), named=POSE),
    "kerb": Case(events=(Event("kerb", 5.0),)),
    "stopped for 0.3 s": Case(events=(Event("stopped", 5.0, 5.3),)),
    "stopped for 3 s": Case(events=(Event("stopped", 5.0, 8.0),)),
    "world reset": Case(events=(Event("moved", 5.0, shift=(1.0, 0.3, 0.1)),)),
    "time stands still from 3 s": Case(clock=lambda now: min(now, 3.0)),
}


@dataclass(frozen=True, slots=True, eq=False)
class Outcome:
    """A faulty ride beside the healthy one.

    Attributes:
        ride, usual: the faulty and the healthy one; left: the body left the free space.
        said: what the controller said first of the sensor, or ""; after: [m] driven with a visible fault.
        kind, name: of the ride and of the fault.
    """

    ride: Ride
    usual: Ride
    left: bool
    said: str
    after: float
    kind: str
    name: str

    @property
    def further(self) -> float:
        """Driven farther than the healthy ride [m]."""
        return self.ride.distance - self.usual.distance

    @property
    def too_fast(self) -> bool:
        """Whether its top speed is beyond the limit."""
        return self.ride.top_speed > TOP_SPEED_SHARE * self.usual.top_speed + TOP_SPEED_MORE

    @property
    def named(self) -> bool:
        """Whether the sensor was named in time, or its fault could never be seen."""
        unseen = self.after == 0.0 and not self.said
        return not CASES[self.name].named or unseen or (self.said != "" and self.after <= NAMED_WITHIN)

    @property
    def end(self) -> str:
        """How the ride ended."""
        last = self.ride.commands[-1]
        still = float(np.abs(self.ride.truth[-100:, 4]).max()) <= STANDS
        return f"{last.status.value}{'' if still else ', moving'}"

    @property
    def fine(self) -> bool:
        """Whether the ride keeps within the limits."""
        return not (self.left or self.too_fast or "moving" in self.end)


@cache
def free_space(kind: str) -> shapely.Polygon:
    """Where the body may be [m]."""
    if kind == "path":
        path = _path()
        at = [part.reference(np.linspace(part.start, part.end, 100)) for part in path.parts]
        lines = [shapely.LineString(np.column_stack((each.x, each.y))) for each in at]
        return shapely.unary_union([line.buffer(5.0) for line in lines])
    return shapely.Polygon(YARD).difference(shapely.unary_union([shapely.Polygon(w) for w in WALLS]))


YARD = [(-16.0, -10.0), (16.0, -10.0), (16.0, 12.0), (-16.0, 12.0)]
WALLS = [[(-9.0, -10.0), (-1.8, -10.0), (-1.8, -3.0), (-9.0, -3.0)]]
WALLS += [[(1.8, -10.0), (9.0, -10.0), (9.0, -3.0), (1.8, -3.0)]]
BAY = Pose2(0.0, -8.0, 0.5 * pi)


def _path() -> ReferencePath:
    return ReferencePath.from_segments(
        Pose2(0.0, 0.0, 0.0), [(-1, 0.0, 6.0), (-1, 0.12, 8.0), (-1, 0.0, 6.0)]
    )


def ridden(
    kind: str, case: Case, interface: Interface, seed: int, *, noisy: bool = False
) -> tuple[Ride, Array]:
    """A ride with a fault, from a start of the seed; and in which cycles its sensor was wrong."""
    rng = np.random.default_rng(seed)
    dx, dy, turn = rng.uniform(-1.0, 1.0, 3) * (0.3, 0.2, 0.05)
    sensor = Faulty(case.fault, case.begin, NOISE if noisy else None)
    car = replace(Car(interface=interface), **case.car)
    goal: Pose2 | None = None
    if kind == "path":
        path = _path()
        start = Pose2(dx, dy, turn)
        corridor = Corridor.from_offsets(path, left=5.0, right=-5.0)
        controller = DockingController(path, corridor, CONFIG)
        steps: Callable[..., Command] = controller.step
    else:
        start = Pose2(-9.0 + 3.0 * dx, 3.0 + 3.0 * dy, turn)
        controller = DockingController.in_area(Area(boundary=YARD, obstacles=WALLS), CONFIG)
        steps, goal = controller.step, BAY
        if kind == "mission":
            mission = DockingMission(controller, [Dock(BAY), Wait(1.0), Undock(6.0)])
            steps, goal = mission.step, None

    def told(state: object, *, now: float, **given: object) -> Command:
        return steps(state, now=case.clock(now), **given)

    seconds = SECONDS[kind]
    ride = drive(
        told,
        car,
        start,
        cycle=CONFIG.cycle,
        seconds=seconds,
        sensor=sensor,
        events=case.events,
        goal=goal,
        seed=seed,
        after_docked=None if kind == "mission" else AFTER_DOCKED,
    )
    return ride, np.array(sensor.wrong)


@cache
def healthy_ride(kind: str, interface: Interface, seed: int, noisy: bool) -> Ride:
    """The same without a fault."""
    return ridden(kind, Case(), interface, seed, noisy=noisy)[0]


def judged(kind: str, name: str, interface: Interface, seed: int, *, noisy: bool = False) -> Outcome:
    """A ride with a fault, compared with the healthy one."""
    case = CASES[name]
    ride, wrong = ridden(kind, case, interface, seed, noisy=noisy)
    usual = healthy_ride(kind, interface, seed, noisy)
    if "rate" in case.car:
        meant = np.array([command.steering for command in ride.commands])
        at = np.minimum(np.round(ride.stamps / STEP).astype(int), len(ride.truth) - 1)
        wrong = np.abs(meant - ride.truth[at, 5]) > VISIBLE[4]
    said, after, driven = "", 0.0, np.abs(ride.truth[:, 4]) * STEP
    per_cycle = round(CONFIG.cycle / STEP)
    for k, command in enumerate(ride.commands):
        reason = command.diagnostics.reason
        if any(word in reason for word in case.named):
            said = reason
            break
        if wrong[k]:
            after += float(driven[k * per_cycle + 1 : (k + 1) * per_cycle + 1].sum())
    return Outcome(ride, usual, ride.leaves(free_space(kind)), said, after, kind, name)


def row(found: Mapping[str, Outcome]) -> list[str]:
    """A fault on each kind of ride, as a row of docs/faults.md."""
    rides = list(found.values())
    said = next((each.said for each in rides if each.said), "–")
    return [
        rides[0].name,
        number(max(each.further for each in rides), 2),
        number(max(each.ride.top_speed / each.usual.top_speed for each in rides), 2),
        said.split("; ")[-1] if "standing inside" in said else said.split("; ")[0],
        number(max(each.after for each in rides), 2) if said != "–" else "–",
        ", ".join(f"{kind}: {each.end}" for kind, each in found.items()),
    ]


def main() -> None:
    parser = command_line(__doc__, "python -m benchmarks.foreign_faults")
    parser.add_argument("--write", action="store_true", help="write the table of docs/faults.md")
    given, source, rows = parser.parse_args(), origin("python -m benchmarks.foreign_faults --write"), []
    for name in CASES:
        rows.append(row({kind: judged(kind, name, "rates", 0) for kind in KINDS}))
        print(*rows[-1], sep=" | ", flush=True)
    header = ["fault", "farther than healthy [m]", "top speed / healthy", "the controller says first"]
    header += ["after [m]", "in the end"]
    if given.write:
        replace_block(ROOT / "docs" / "faults.md", "sensors", f"{table(header, rows)}\n\n{told(source)}")


if __name__ == "__main__":
    main()
