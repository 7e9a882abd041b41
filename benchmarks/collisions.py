"""Obstacles that appear anywhere, and people who walk across: drawn, driven, and judged from outside."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from benchmarks.encounters import Car, Drive, Plant, copied, drive, on_lane, square, stops_in_time
from geometry import Pose2, ReferencePath
from rti_mpcc import ControllerConfig, Source
from rti_mpcc.types import Array

HALF = 4.0
"""Half width of the lane [m]."""
WATCHED = 6.0
"""So long it is watched what the vehicle does about what has appeared [s]."""
ROUNDING = 2e-3
"""Of speeds [m/s]."""
SQUARE = 0.6
"""Size of a person with the room around him [m]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Appearance:
    """An obstacle that is there from `cycle` on, in the frame of the vehicle at that time [m], [rad]."""

    direction: int
    curvature: float
    dead_time: float
    speed: float
    cycle: int
    along: float
    across: float
    size: float
    turned: float
    stays: float


def appearance(rng: Generator) -> Appearance:
    return Appearance(
        direction=int(rng.choice((1, -1))),
        curvature=float(rng.choice((0.0, 0.05, -0.1))),
        dead_time=float(rng.choice((0.0, 0.1, 0.18, 0.3))),
        speed=rng.uniform(0.0, 5.0),
        cycle=int(rng.integers(0, 61)),
        along=rng.uniform(-3.0, 12.0),
        across=rng.uniform(-3.0, 3.0),
        size=rng.uniform(0.1, 3.0),
        turned=rng.uniform(0.0, 1.5),
        stays=float(rng.choice((0.5, 2.0, 100.0))),
    )


def keep_promises(seed: int) -> None:
    """What appears is not driven into, or over, but where nothing could have been done about it."""
    drawn = appearance(np.random.default_rng([7, seed]))
    path = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(drawn.direction, drawn.curvature, 30.0)])
    config = ControllerConfig(dead_time=drawn.dead_time)
    car, begin = Car(config=config), drawn.cycle * config.cycle
    there: list[Array] = []
    first: list[Plant] = []

    def obstacles(now: float) -> list[Array]:
        return there if begin - 1e-9 <= now < begin + drawn.stays else []

    def appear(plant: Plant) -> None:
        if not there and plant.time >= begin - 1e-6:
            first.append(copied(plant))
            place = Pose2(plant.x, plant.y, plant.phi)
            middle = place.compose(Pose2(drawn.direction * drawn.along, drawn.across, drawn.turned))
            there.append(square(middle.x, middle.y, drawn.size, middle.phi))

    controller = on_lane(path, HALF, config)
    found = drive(
        controller,
        car,
        path.start,
        begin + min(drawn.stays, WATCHED) + 2.0,
        obstacles_at=obstacles,
        v=drawn.direction * drawn.speed,
        before_cycle=appear,
        until_docked=False,
    )
    if first:
        check_overlaps(found, config)
        collisions = [each for each in found.collisions if each.time >= begin]
        assert not collisions or not stops_in_time(first[0], lambda now: there), collisions
    check_chatter(found)


def check_overlaps(found: Drive, config: ControllerConfig) -> None:
    """(a) While the body overlaps something the vehicle gets no faster."""
    speeds = np.abs(found.states[:, 3])
    delay = round(config.dead_time / config.cycle) + 1
    for k in range(delay, len(speeds) - 1):
        told = all(found.overlaps[k - delay : k + 1])
        if told and found.commands[k - delay].source is not Source.ESCAPE:
            assert speeds[k + 1] <= speeds[k] + ROUNDING, (found.times[k], speeds[k], speeds[k + 1])


def check_chatter(found: Drive) -> None:
    """(c) Braking and driving do not alternate more than once a second."""
    between = np.diff(found.resumptions)
    assert (between >= 1.0 - 1e-6).all(), found.resumptions


# -- people who walk ----------------------------------------------------------------------------------------


def walk(rng: Generator) -> tuple[str, Callable[[float], tuple[float, float]]]:
    """What somebody does, and where he is (x, y) [m] at a time [s] in a lane along x."""
    kind = str(rng.choice(["crosses", "stops", "turns back", "comes towards", "wanders"]))
    speed, side = rng.uniform(0.3, 1.5), float(rng.choice([-1.0, 1.0]))
    x, begin, turn, y = rng.uniform(8.0, 32.0), rng.uniform(0.0, 14.0), rng.uniform(3.0, 9.0), 0.0
    if kind == "comes towards":
        y = rng.uniform(-1.5, 1.5)
        return kind, lambda now: (38.0 - speed * max(now - begin, 0.0), y)
    if kind == "wanders":
        lasts, headings = rng.uniform(0.5, 2.0), rng.uniform(-np.pi, np.pi, 60)
        steps = speed * lasts * np.stack([np.cos(headings), np.sin(headings)], axis=-1)
        places = np.vstack(([0.0, 0.0], np.cumsum(steps, axis=0))) + np.array([x, 3.0 * side])
        times = lasts * np.arange(len(places))
        return kind, lambda now: (
            float(np.interp(now, times, places[:, 0])),
            float(np.interp(now, times, places[:, 1])),
        )

    def way(now: float) -> float:
        walked = speed * max(now - begin, 0.0)
        if kind == "stops":
            return min(walked, turn)
        return walked if kind == "crosses" or walked < turn else 2.0 * turn - walked

    return kind, lambda now: (x, side * (7.0 - way(now)))


def meet(number: int, seed: int, *, lag: float, seconds: float = 60.0) -> tuple[str, Drive]:
    """Drive a straight lane on which somebody walks in plain sight."""
    rng = np.random.default_rng([seed, number])
    kind, place = walk(rng)
    direction = int(rng.choice([1, 1, -1]))
    path = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(direction, 0.0, 40.0)])
    config = ControllerConfig(dead_time=0.18)
    controller = on_lane(path, HALF, config)

    def obstacles(now: float) -> list[Array]:
        x, y = place(now)
        return [square(direction * x, y, SQUARE)]

    return kind, drive(controller, Car(config=config, lag=lag), path.start, seconds, obstacles_at=obstacles)
