"""Rides with random events, judged from outside: the goal jumps, obstacles come and go, cycles are missing.

A ride is drawn from a seed and an index: where it takes place, the settings, and one to three events at
random times. The plant is exact. `problems` lists every invariant that the ride broke.
"""

from __future__ import annotations

import resource
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from math import cos, hypot, inf, isfinite, pi, sin, tan
from typing import Any

import numpy as np
import shapely
from numpy.random import Generator

from benchmarks.encounters import body_at
from estimation import Frame, GoalMeasurement
from geometry import Area, Corridor, Pose2, ReferencePath
from rti_mpcc import Command, ControllerConfig, DockingController, DockingMission, Source, Status
from rti_mpcc.mission import Dock, DriveTo, Step, Undock, Wait
from rti_mpcc.simulation.plant import PlantParameters, PlantState, advance, issue
from rti_mpcc.types import Array
from tests.rti_mpcc.docking_runs import obeyed

PLACES = ("path", "cusp", "area", "mission")
LONGEST = 240.0
"""A ride ends after this time [s]: what still drives, or is planned, by then does not come to an end."""
RESTS = 25.0
"""A vehicle that stands so long after the last event [s] has come to its end."""
DOCKED_FOR = 1.0
STILL = 0.02
"""Slower than this a vehicle stands [m/s]."""
FARTHER = 12.0
"""So much farther from the goal than it was a vehicle must never be [m]."""
LONGEST_PLAN = 200.0
LONGEST_CYCLE = 1.0
"""CPU time of one cycle [s]."""
ARRIVING_AT_REST = 5.0
MEMORY = 200e6
"""What a ride may add to the process's memory [bytes]."""
WATCHDOG = 2.0
"""Deceleration of the watchdog that brakes while the cycles stop [m/s²]."""
HELD_OUT = 2.0
"""Share of the tolerance inside which a docked vehicle may be: what it holds through for a moment."""
CONTACT = 1e-3
"""Rounding of a contact [m]."""
MAY_STAND = frozenset(Status) - {Status.FOLLOWING, Status.ARRIVING, Status.SETTLING, Status.DOCKED}

EVENTS: dict[str, tuple[str, ...]] = {
    "goal": ("ahead", "behind", "beside", "here", "turned", "walks", "alternates", "cleared"),
    "obstacle": ("ahead", "beside", "on the goal"),
    "vehicle": ("set down", "stopped", "not called"),
}
IN_MISSIONS: dict[str, tuple[str, ...]] = {
    "mission": ("cancelled", "dock moves", "not detected", "false detections"),
    "obstacle": EVENTS["obstacle"],
    "vehicle": EVENTS["vehicle"],
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Event:
    """Something that happens once.

    Attributes:
        kind: of which group, see EVENTS; what: happens.
        at: [s]; lasts: [s].
        size: how much of it, 0 to 1; side: +1 or -1.
    """

    kind: str
    what: str
    at: float
    lasts: float
    size: float
    side: int

    @property
    def over(self) -> float:
        """[s]."""
        return self.at + self.lasts


@dataclass(slots=True, kw_only=True)
class Ride:
    """One drawn ride, and what becomes of it.

    Attributes:
        place, seed, index: what it is drawn from.
        problems: the invariants that it broke; each once, as it was met first.
        trace: (time, x, y, phi, v, acceleration) of all cycles.
    """

    place: str
    seed: int
    index: int
    config: ControllerConfig = field(init=False)
    events: tuple[Event, ...] = field(init=False)
    goal: Pose2 | None = field(init=False)
    start: Pose2 = field(init=False)
    path: ReferencePath | None = None
    free: Any = None
    driver: Any = field(init=False)
    obstacles: list[tuple[Array, float]] = field(default_factory=list)
    problems: dict[str, str] = field(default_factory=dict)
    trace: list[tuple[float, ...]] = field(default_factory=list)
    commands: list[Command] = field(default_factory=list)
    docked: bool = False
    slowest: float = 0.0
    _near: tuple[Pose2 | None, float] = (None, inf)
    _line: Any = None

    def __post_init__(self) -> None:
        rng = np.random.default_rng([self.seed, PLACES.index(self.place), self.index])
        self.config = ControllerConfig(
            dead_time=float(rng.choice([0.0, 0.1, 0.18])),
            comfort_acceleration=float(rng.choice([0.4, 0.4, 0.8, 1.2])),
            ride="brisk" if rng.random() < 0.3 else "smooth",
        )
        _PLACED[self.place](self, rng)
        groups = IN_MISSIONS if self.place == "mission" else EVENTS
        names = [(kind, what) for kind, several in groups.items() for what in several]
        chosen = [names[k] for k in rng.integers(len(names), size=rng.integers(1, 4))]
        self.events = tuple(
            Event(
                kind=kind,
                what=what,
                at=float(rng.uniform(0.0 if rng.random() < 0.1 else 2.0, 20.0)),
                lasts=float(rng.uniform(0.5, 4.0) if kind == "vehicle" else rng.uniform(1.0, 12.0)),
                size=float(rng.random()),
                side=int(rng.choice([-1, 1])),
            )
            for kind, what in chosen
        )

    @property
    def name(self) -> str:
        told = ", ".join(f"{e.kind} {e.what} at {e.at:.1f}" for e in self.events)
        return f"{self.place} {self.index} of {self.seed} ({self.config.ride}; {told})"

    @property
    def asked(self) -> Pose2 | None:
        """Where the vehicle is to stand in the end."""
        if self.goal is not None:
            return self.goal
        return None if self.path is None else self.path.end

    def broke(self, invariant: str, told: str) -> None:
        self.problems.setdefault(invariant, told)

    # -- driving ------------------------------------------------------------------------------------------

    def drive(self) -> Ride:
        """Until it docked, stands for good, or has to have ended long ago."""
        config, memory = self.config, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        parameters = PlantParameters.of(config.vehicle, config.limits, dead_time=config.dead_time)
        plant = PlantState(x=self.start.x, y=self.start.y, phi=self.start.phi)
        happened: set[Event] = set()
        last, docked, stood, arriving = max(event.over for event in self.events), 0.0, 0.0, 0.0
        while plant.time < LONGEST:
            for event in self.events:
                if event.at <= plant.time and event not in happened:
                    happened.add(event)
                    plant = self._begin(event, plant)
            self._continue_plan(plant.time)
            if self._lasting("vehicle", "stopped", plant.time):
                slower = max(abs(plant.v) - config.limits.acceleration * config.cycle, 0.0)
                plant = replace(plant, v=slower * float(np.sign(plant.v)))
            if self._lasting("vehicle", "not called", plant.time):
                braking = -float(np.sign(plant.v)) * min(WATCHDOG, abs(plant.v) / config.cycle)
                plant = issue(plant, parameters, acceleration=braking, steering_rate=0.0)
                plant = advance(plant, parameters, plant.time + config.cycle)
                continue
            command = self._step(plant)
            self._judge(command, plant)
            still = abs(plant.v) < STILL
            arriving = arriving + config.cycle if still and command.status is Status.ARRIVING else 0.0
            if arriving > ARRIVING_AT_REST:
                self.broke("stands arriving", f"at {plant.time:.1f} s")
            if plant.time > last and not self.obstacles:
                over = self._over(command)
                docked = docked + config.cycle if over else 0.0
                stood = stood + config.cycle if still else 0.0
                if docked >= DOCKED_FOR or stood >= RESTS:
                    break
            plant = obeyed(plant, command, parameters, plant.time + config.cycle)
        self._judge_end(plant, stood, docked)
        grown = 1024.0 * (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - memory)
        if grown > MEMORY:
            self.broke("memory", f"{grown / 1e6:.0f} MB more")
        return self

    def _step(self, plant: PlantState) -> Command:
        given: dict[str, Any] = {"obstacles": [outline for outline, _ in self.obstacles]}
        if self.place == "mission":
            given["measurements"] = self._detections(plant)
        else:
            given["goal"] = self.goal
        begun = time.thread_time()
        command: Command = self.driver.step(plant.measured, now=plant.time, **given)
        took = time.thread_time() - begun
        self.slowest = max(self.slowest, took)
        if took > LONGEST_CYCLE:
            self.broke("cycle", f"{took:.2f} s CPU at {plant.time:.1f} s")
        self.commands.append(command)
        return command

    def _detections(self, plant: PlantState) -> list[GoalMeasurement]:
        """Of the dock, 10 a second from 12 m on."""
        here = Pose2(plant.x, plant.y, plant.phi)
        if self.goal is None or round(plant.time / self.config.cycle) % 2:
            return []
        seen = self.goal.relative_to(here)
        far = hypot(seen.x, seen.y) > 12.0
        if far or self._lasting("mission", "not detected", plant.time):
            return []
        event = self._lasting("mission", "false detections", plant.time)
        off = 0.0 if event is None or plant.time - event.at > 1.0 else 1.0
        return [
            GoalMeasurement(stamp=plant.time, x=seen.x + off, y=seen.y, phi=seen.phi, frame=Frame.VEHICLE)
        ]

    def _lasting(self, kind: str, what: str, now: float) -> Event | None:
        for event in self.events:
            if (event.kind, event.what) == (kind, what) and event.at <= now < event.over:
                return event
        return None

    # -- events -------------------------------------------------------------------------------------------

    def _begin(self, event: Event, plant: PlantState) -> PlantState:
        here = Pose2(plant.x, plant.y, plant.phi)
        if event.kind == "goal":
            if event.what == "cleared" and self.path is not None:
                self.goal = None
                self.driver.clear_goal()
            elif event.what in _JUMPS and self.asked is not None:
                jumped = _JUMPS[event.what](self, here, plant.v, event)
                self.goal = jumped if self._room_at(jumped) > 0.3 else self.goal
        elif event.kind == "obstacle":
            self._put_obstacle(event, here, plant)
        elif event.what == "set down":
            moved = _offset(
                here, event.side * event.size, (1.0 - event.size) * event.side, 0.3 * event.side * event.size
            )
            if min(self._room_at(pose) for pose in self._stopping(moved, plant)) > 0.2:
                return replace(plant, x=moved.x, y=moved.y, phi=moved.phi)
        elif event.what == "cancelled":
            self.driver.cancel()
        elif event.what == "dock moves" and self.goal is not None:
            moved = _offset(self.goal, 0.5 * event.size, 0.5 * event.side * (1.0 - event.size), 0.1)
            self.goal = moved if self._room_at(moved) > 0.3 else self.goal
        return plant

    def _continue_plan(self, now: float) -> None:
        """What changes in every cycle."""
        cycle = self.config.cycle
        self.obstacles = [(outline, until) for outline, until in self.obstacles if now < until]
        walks = self._lasting("goal", "walks", now)
        if walks is not None and self.goal is not None:
            speed = 0.3 * walks.size
            self.goal = _or(self, _offset(self.goal, 0.0, walks.side * speed * cycle, 0.0), self.goal)
        turns = self._lasting("goal", "alternates", now)
        if turns is not None and self.goal is not None and round((now - turns.at) / cycle) % 10 == 0:
            other = 1.0 if round((now - turns.at) / cycle) % 20 else -1.0
            self.goal = _or(
                self, _offset(self.goal, other * turns.side * 2.0 * turns.size, 0.0, 0.0), self.goal
            )

    def _stopping(self, here: Pose2, plant: PlantState) -> list[Pose2]:
        """From here to where the brakes stop the vehicle on the arc that it drives: there must be room, for
        an event after which they are of no use proves nothing."""
        if abs(plant.v) <= STILL:
            return [here]
        config = self.config
        way = plant.v**2 / (2.0 * config.limits.acceleration) + 0.5
        way += abs(plant.v) * (config.dead_time + config.plausibility.blind + 2.0 * config.cycle)
        curvature = tan(plant.delta) / config.vehicle.wheelbase
        ways = np.linspace(0.0, float(np.sign(plant.v)) * way, 12).tolist()
        return [_offset(here, s, 0.5 * curvature * s**2, curvature * s) for s in ways]

    def _put_obstacle(self, event: Event, here: Pose2, plant: PlantState) -> None:
        vehicle, half = self.config.vehicle, 0.3 + 0.7 * event.size
        stops = plant.v**2 / (2.0 * self.config.limits.acceleration)
        stops += abs(plant.v) * (self.config.dead_time + 2.0 * self.config.cycle)
        if event.what == "on the goal":
            if self.asked is None:
                return
            middle = _offset(self.asked, 1.0, 0.0, 0.0)
        elif event.what == "beside":
            middle = _offset(
                here, 1.4, event.side * (0.5 * vehicle.width + half + 0.02 + 0.5 * event.size), 0.0
            )
        else:
            ends = vehicle.front if plant.v >= 0.0 else vehicle.rear
            ahead = ends + half + 1.0 + stops + 3.0 * event.size
            middle = _offset(here, ahead if plant.v >= 0.0 else -ahead, event.side * event.size, 0.0)
        c, s = half * cos(here.phi), half * sin(here.phi)
        outline = np.array(
            [
                (middle.x + i * c - j * s, middle.y + i * s + j * c)
                for i, j in ((-1, -1), (1, -1), (1, 1), (-1, 1))
            ]
        )
        room = min(
            shapely.Polygon(outline).distance(_body(self, pose)) for pose in self._stopping(here, plant)
        )
        if room > (0.15 if abs(plant.v) > STILL else 0.01):
            self.obstacles.append((outline, event.over + 4.0 * event.lasts))

    # -- judging ------------------------------------------------------------------------------------------

    def _room_at(self, pose: Pose2) -> float:
        """Clearance of the body at a pose [m], 0 where it touches something."""
        body = body_at(pose.x, pose.y, pose.phi, self.config.vehicle)
        if not self.free.covers(body):
            return 0.0
        rest = min((shapely.Polygon(each).distance(body) for each, _ in self.obstacles), default=inf)
        return float(
            min(
                self.free.exterior.distance(body),
                rest,
                *(shapely.Polygon(ring).distance(body) for ring in self.free.interiors),
            )
        )

    def _over(self, command: Command) -> bool:
        if self.place == "mission":
            over: bool = self.driver.over
            return over
        return command.docked

    def _judge(self, command: Command, plant: PlantState) -> None:
        limits, now = self.config.limits, f"at {plant.time:.1f} s"
        numbers = (command.acceleration, command.steering_rate, command.speed, command.steering)
        if not all(isfinite(number) for number in numbers):
            self.broke("finite", f"{numbers} {now}")
        if abs(command.acceleration) > limits.acceleration + 1e-9:
            self.broke("limits", f"a = {command.acceleration} {now}")
        if abs(command.steering_rate) > limits.steering_rate + 1e-9:
            self.broke("limits", f"delta_dot = {command.steering_rate} {now}")
        plan = command.trajectory
        if plan.times[-1] - plan.times[0] > LONGEST_PLAN:
            self.broke("plan time", f"{plan.times[-1] - plan.times[0]:.0f} s {now}")
        if command.source is Source.SOLUTION:
            v, delta = np.abs(plan.states[:, 3]), np.abs(plan.states[:, 4])
            if v.max() > max(1.05 * limits.speed, v[0] + 0.05):
                self.broke("plan speed", f"{v.max():.2f} m/s {now}")
            if delta.max() > max(limits.steering, delta[0]) + 0.03:
                self.broke("plan steering", f"{delta.max():.3f} rad {now}")
            a, rate = np.abs(plan.controls[:, 0]).max(), np.abs(plan.controls[:, 1]).max()
            if a > 1.05 * limits.acceleration or rate > 1.05 * limits.steering_rate:
                self.broke("plan inputs", f"{a:.2f} m/s², {rate:.2f} rad/s {now}")
        if abs(plant.v) > STILL and self._room_at(Pose2(plant.x, plant.y, plant.phi)) <= CONTACT:
            self.broke("contact", f"at {plant.v:.2f} m/s {now}")
        goal = self.asked
        if command.status is Status.FAILED and not command.diagnostics.reason:
            self.broke("reason", f"none {now}")
        if "internal error" in command.diagnostics.reason:
            self.broke("mistake", f"{command.diagnostics.reason} {now}")
        self.trace.append((plant.time, plant.x, plant.y, plant.phi, plant.v, command.acceleration))
        if goal is not None and self.place != "mission":
            self._judge_distance(plant, goal, now)

    def _judge_distance(self, plant: PlantState, goal: Pose2, now: str) -> None:
        """From the goal, or from the path to it, against the least since the goal is there."""
        far = hypot(plant.x - goal.x, plant.y - goal.y)
        if self.path is not None:
            far = min(far, self._line.distance(shapely.Point(plant.x, plant.y)))
        if goal != self._near[0]:
            self._near = goal, far
        self._near = goal, min(self._near[1], far)
        if far > self._near[1] + FARTHER:
            self.broke("drives away", f"{far:.1f} m off, {self._near[1]:.1f} m before, {now}")

    @property
    def refused(self) -> bool:
        """Whether it ended at rest because the goal that was asked for is out of reach, and says so."""
        last = self.commands[-1]
        return last.status is Status.GOAL_REJECTED and "rejected" in last.diagnostics.reason

    def _judge_end(self, plant: PlantState, stood: float, docked: float) -> None:
        command, goal = self.commands[-1], self.asked
        told = f"{command.status.name}: {command.diagnostics.reason}"
        self.docked = docked >= DOCKED_FOR
        if not self.docked and stood < RESTS:
            self.broke("no end", told)
        if self.place == "mission":
            return
        if self.docked and goal is not None:
            error = Pose2(plant.x, plant.y, plant.phi).relative_to(goal)
            if not error.within(self.config.goal_tolerance, HELD_OUT):
                self.broke("docked elsewhere", f"off by {error}, {told}")
        elif not self.docked and (command.status not in MAY_STAND or not command.diagnostics.reason):
            self.broke("stands without a reason", told)


def _or(ride: Ride, wanted: Pose2, last: Pose2) -> Pose2:
    return wanted if ride._room_at(wanted) > 0.3 else last


def _body(ride: Ride, pose: Pose2) -> Any:
    return body_at(pose.x, pose.y, pose.phi, ride.config.vehicle)


def _offset(pose: Pose2, along: float, across: float, turned: float) -> Pose2:
    c, s = cos(pose.phi), sin(pose.phi)
    return Pose2(pose.x + c * along - s * across, pose.y + s * along + c * across, pose.phi + turned)


def _jump(low: float, high: float, across: float) -> Callable[[Ride, Pose2, float, Event], Pose2]:
    """To so far ahead of the vehicle, in the direction in which it drives [m]."""

    def jumped(ride: Ride, here: Pose2, speed: float, event: Event) -> Pose2:
        ahead = low + event.size * (high - low)
        return _offset(here, ahead if speed >= 0.0 else -ahead, event.side * across * event.size, 0.0)

    return jumped


def _turned(ride: Ride, here: Pose2, speed: float, event: Event) -> Pose2:
    assert ride.asked is not None
    return _offset(ride.asked, 0.0, 0.0, 0.4 * event.side * event.size)


_JUMPS: dict[str, Callable[[Ride, Pose2, float, Event], Pose2]] = {
    "ahead": _jump(4.0, 12.0, 1.0),
    "behind": _jump(-0.1, -4.0, 1.0),
    "beside": _jump(-0.3, 1.0, 2.5),
    "here": _jump(0.0, 0.2, 0.1),
    "turned": _turned,
}


# -- places -----------------------------------------------------------------------------------------------


def _on_path(ride: Ride, rng: Generator, *, cusp: bool = False) -> None:
    direction, width = int(rng.choice([-1, 1])), float(rng.uniform(4.0, 6.0))
    segments = [
        (direction, float(rng.uniform(-0.12, 0.12)), float(rng.uniform(6.0, 12.0)))
        for _ in range(rng.integers(1, 3))
    ]
    if cusp:
        segments.append((-direction, float(rng.uniform(-0.12, 0.12)), float(rng.uniform(12.0, 20.0))))
    ride.start = Pose2(0.0, 0.0, float(rng.uniform(-pi, pi)))
    ride.path = ReferencePath.from_segments(ride.start, segments)
    corridor = Corridor.from_offsets(ride.path, left=width, right=-width)
    ride.driver = DockingController(ride.path, corridor, ride.config)
    ride._line = shapely.LineString(
        np.concatenate([np.column_stack([s.x, s.y]) for s in ride.path.sample(0.5)])
    )
    # Behind the end of the route nothing bounds it, to the sides either.
    beyond = [
        _offset(ride.path.end, ride.path.parts[-1].direction * along, across, 0.0)
        for along, across in ((0.0, -40.0), (40.0, -40.0), (40.0, 40.0), (0.0, 40.0))
    ]
    behind = shapely.Polygon([(corner.x, corner.y) for corner in beyond])
    ride.free = shapely.union_all([behind, *(_lane(part, width) for part in ride.path.parts)])
    ride.goal = None
    if rng.random() < 0.7:
        ride.goal = _offset(ride.path.end, float(rng.uniform(-1, 1)), float(rng.uniform(-1, 1)), 0.0)


def _lane(part: Any, width: float) -> Any:
    """What lies within a width of a part, and beyond both of its ends."""
    at = np.linspace(part.start, part.end, 200)
    reference = part.reference(np.concatenate(([part.start - 40.0], at, [part.end + 40.0])))
    return shapely.LineString(np.column_stack([reference.x, reference.y])).buffer(width + 0.02)


BOXES = ((8.0, 9.0), (18.0, -8.0), (26.0, 8.0), (30.0, -4.0), (4.0, -9.0))


def _yard(rng: Generator) -> tuple[Area, Any]:
    boxes = [
        [(x - w, y - h), (x + w, y - h), (x + w, y + h), (x - w, y + h)]
        for (x, y), (w, h) in zip(BOXES, rng.uniform(0.5, 2.0, (len(BOXES), 2)), strict=True)
    ]
    outline = [(-10.0, -14.0), (42.0, -14.0), (42.0, 14.0), (-10.0, 14.0)]
    return Area(boundary=outline, obstacles=boxes), shapely.Polygon(outline, boxes)


def _in_area(ride: Ride, rng: Generator) -> None:
    area, ride.free = _yard(rng)
    ride.start = Pose2(0.0, float(rng.uniform(-3, 3)), float(rng.uniform(-0.5, 0.5)))
    for pose in _poses(rng):
        if ride._room_at(pose) > 0.5:
            ride.goal = pose
            break
    ride.driver = DockingController.in_area(area, ride.config)


def _poses(rng: Generator) -> Iterator[Pose2]:
    while True:
        x, y = rng.uniform((10.0, -8.0), (36.0, 8.0)).tolist()
        yield Pose2(x, y, float(rng.uniform(-pi, pi)))


def _in_mission(ride: Ride, rng: Generator) -> None:
    _in_area(ride, rng)
    assert ride.goal is not None
    steps: Sequence[Step] = (
        Dock(_offset(ride.goal, 0.1, -0.1, 0.02)),
        Wait(1.0),
        Undock(4.0) if rng.random() < 0.5 else DriveTo(ride.start),
    )
    ride.driver = DockingMission(ride.driver, steps)


_PLACED: dict[str, Callable[[Ride, Generator], None]] = {
    "path": _on_path,
    "cusp": lambda ride, rng: _on_path(ride, rng, cusp=True),
    "area": _in_area,
    "mission": _in_mission,
}
