"""Random vehicles of unknown dead times and lags, in three built-in scenes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely

from benchmarks.foreign import Car, Interface, Ride, drive
from benchmarks.foreign_sensors import Faulty, healthy
from geometry import Pose2
from geometry.outline import drawn_shape, shape_of
from rti_mpcc import ActuatorModel, ControllerConfig, Vehicle
from rti_mpcc.simulation import Scenario, load_scenario
from rti_mpcc.simulation.closed_loop import controller_of

SCENES = ("docking_behind", "docking_inside", "bay_perpendicular")
LONGEST_LAG, LONGEST_DEAD_TIME = 0.5, 0.3  # [s]
NOISE = np.array((0.01, 0.01, 0.002, 0.01, 0.003))
"""Standard deviations of x, y [m], phi [rad], v [m/s], delta [rad]."""


@dataclass(frozen=True, slots=True)
class Case:
    """One vehicle in one scene; `actuators` of a `Car`; `noise`: share of `NOISE`."""

    scene: str
    interface: Interface
    actuators: dict[str, float]
    noise: float
    seed: int

    @property
    def told(self) -> ActuatorModel:
        """What a user would give who knows the vehicle."""
        return Car.of(Vehicle(), **self.actuators).actuators


def case(seed: int) -> Case:
    """The random case of a seed."""
    random = np.random.default_rng(seed)
    names = ("drive_dead_time", "steering_dead_time", "drive_lag", "steering_lag")
    most = np.array((LONGEST_DEAD_TIME, LONGEST_DEAD_TIME, LONGEST_LAG, LONGEST_LAG))
    values = (most * random.uniform(size=4)).tolist()
    return Case(
        scene=SCENES[random.integers(len(SCENES))],
        interface="rates" if random.uniform() < 0.5 else "setpoints",
        actuators=dict(zip(names, values, strict=True)),
        noise=float(random.choice((0.0, 0.5, 1.0))),
        seed=seed,
    )


@dataclass(frozen=True, slots=True)
class Figures:
    """Of a ride: whether it truly docked, and when [s]; `peak`: hardest acceleration over comfort.

    `touched`: something solid; `moved`: after DOCKED [m].
    """

    docked: bool
    seconds: float
    peak: float
    touched: bool
    moved: float
    ride: Ride


def driven(
    case: Case, actuators: ActuatorModel | None = None, seconds: float = 120.0, **changes: Any
) -> Figures:
    """A ride with default settings, or with `actuators` given; `seconds`: at most [s]."""
    scenario = load_scenario(case.scene)
    changes = {"actuators": actuators or ActuatorModel(), "deadline": None} | changes
    config = scenario.controller_config().changed(**changes)
    goal = scenario.goal_pose()
    done = drive(
        controller_of(scenario, config).step,
        Car.driven_by(config, interface=case.interface, **case.actuators),
        scenario.start_pose() if scenario.in_area else scenario.build_path().start,
        cycle=config.cycle,
        seconds=seconds,
        sensor=Faulty(healthy, noise=tuple((case.noise * NOISE).tolist())),
        goal=goal,
        seed=case.seed,
        after_docked=5.0,
    )
    return _figures(done, scenario, config, goal)


def hardest(done: Ride) -> float:
    """The largest true acceleration over a cycle of 0.05 s [m/s²]."""
    return float(np.abs(np.convolve(done.acceleration, np.full(10, 0.1), "valid")).max())


def _figures(done: Ride, scenario: Scenario, config: ControllerConfig, goal: Pose2) -> Figures:
    at = done.docked_at
    return Figures(
        docked=at is not None and done.inside(goal, config.goal_tolerance),
        seconds=np.inf if at is None else at,
        peak=hardest(done) / config.comfort_acceleration,
        touched=done.touches(solid(scenario)),
        moved=np.inf if at is None else done.moved_after(at),
        ride=done,
    )


def solid(scenario: Scenario) -> shapely.Geometry:
    """Walls and obstacles of a scene."""
    if scenario.in_area:
        return shapely.union_all([drawn_shape(shape_of(each)) for each in scenario.build_area().obstacles])
    path = scenario.build_path()
    lines = [line for part in range(len(path.parts)) for side in _lines(scenario, part) for line in side]
    return shapely.union_all([shapely.LineString(line) for line in lines])


def _lines(scenario: Scenario, part: int) -> tuple[tuple[Any, ...], tuple[Any, ...]]:
    path = scenario.build_path()
    return scenario.build_corridor(path).lines(part)
