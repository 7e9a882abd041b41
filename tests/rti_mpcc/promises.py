"""The promises that hold for every command, whatever the controller is given: cycles with random inputs.

A case is drawn from a seed, so that a failing one is driven again by its seed alone.
"""

from __future__ import annotations

from dataclasses import fields, replace
from math import inf, isfinite, nan, pi
from typing import Any

import numpy as np
import shapely
from numpy.random import Generator

from estimation import Frame, GoalMeasurement
from geometry import Area, Corridor, Narrowing, Pose2, ReferencePath, RtiMpccError
from rti_mpcc import (
    Command,
    ControllerConfig,
    DockingController,
    Limits,
    Reason,
    Source,
    Status,
    VehicleState,
)
from rti_mpcc.simulation.plant import PlantParameters, PlantState
from rti_mpcc.types import Array
from tests.rti_mpcc.docking_runs import obeyed

ROUNDING = 1e-9
LONGEST = 2.5
"""The plant is driven on for this time between two cycles at most [s]."""
HELD_OUT = 2.0
"""Share of the tolerance inside which DOCKED is held for a moment, although measured outside."""
MOVES = 0.04
"""A vehicle that is measured faster than this does not stand [m/s]."""
EXTREMES = (0.0, -0.0, pi, -pi, 1e-300, 5e-324, 1e9, -1e9, 1e17, 1e300, -1e300, 1.7e308, inf, -inf, nan)
NAMES = [field.name for field in fields(VehicleState)]


# -- what is drawn ---------------------------------------------------------------------------------------


def world(rng: Generator) -> tuple[ReferencePath, Corridor]:
    """A path of one to three parts, from tame to hardly drivable, and its corridor."""
    while True:
        direction, segments = int(rng.choice([-1, 1])), []
        for _ in range(rng.integers(1, 4)):
            for _ in range(rng.integers(1, 4)):
                curvature = 0.24 * rng.choice([0.0, rng.uniform(-1.0, 1.0), rng.uniform(-1.5, 1.5)])
                segments.append((direction, float(curvature), float(0.5 * 120.0 ** rng.random())))
            direction = -direction
        x, y, phi = (rng.uniform(-1.0, 1.0, 3) * (50.0, 50.0, 10.0)).tolist()
        start = Pose2(x, y, phi)
        path = ReferencePath.from_segments(start, segments)
        try:
            return path, _corridor(rng, path)
        except RtiMpccError:
            continue


def _corridor(rng: Generator, path: ReferencePath) -> Corridor:
    first = path.parts[0]
    obstacles = []
    for size in rng.uniform(0.1, 3.0, rng.integers(0, 3)):
        along, across = rng.uniform(-6.0, 6.0, 2)
        obstacles.append(box(first.pose(rng.uniform(0.0, first.end)), along, across, size))
    if rng.random() < 0.25:
        line = np.concatenate([np.stack([s.x, s.y], axis=-1) for s in path.sample(0.5)])
        outline = shapely.buffer(shapely.LineString(line), rng.uniform(1.5, 8.0))
        return Corridor.from_polygon(path, shapely.get_coordinates(outline.exterior), obstacles=obstacles)
    left, right = 1.04 * 8.0 ** rng.random(2)
    begins = rng.uniform(0.0, 0.9 * path.length, rng.integers(0, 3))
    narrowings = [
        Narrowing(begin, rng.uniform(begin + 0.01, path.length), left=rng.uniform(1.04, left))
        for begin in begins
    ]
    return Corridor.from_offsets(path, left=left, right=-right, narrowings=narrowings, obstacles=obstacles)


def box(pose: Pose2, along: float, across: float, size: float) -> Array:
    """Corners (4, 2) [m] of a square beside a pose."""
    corners = [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)]
    placed = [pose.compose(Pose2(along + size * a, across + size * b, 0.0)) for a, b in corners]
    return np.array([[corner.x, corner.y] for corner in placed])


def settings(rng: Generator) -> ControllerConfig:
    presets = [ControllerConfig, ControllerConfig, ControllerConfig.paper, ControllerConfig.paper_printed]
    preset: Any = presets[rng.integers(4)]
    made: ControllerConfig = preset(
        cycle=float(rng.choice([0.05, 0.005, 0.02, 0.1, 0.2])),
        dead_time=float(rng.choice([0.0, 0.18, 0.5])),
        stages=int(rng.choice([10, 10, 10, 20, 70])),
        deadline=0.02 if rng.random() < 0.1 else None,
        limits=Limits(speed=float(rng.choice([10.0, 3.0, 1.0]))),
    )
    return made


def wild(rng: Generator, count: int) -> list[float]:
    """Numbers of any kind."""
    return [
        float(rng.choice(EXTREMES))
        if rng.random() < 0.7
        else float(rng.normal() * 10.0 ** rng.uniform(-6, 6))
        for _ in range(count)
    ]


def pose_near(rng: Generator, path: ReferencePath, beside: float, *, end: bool = False) -> Pose2:
    """At most `beside` [m] off a path, or off its end."""
    theta = path.length if end else path.length * rng.random()
    on = next(part for part in path.parts if theta <= part.end + 1e-9).pose(theta)
    x, y, phi = rng.uniform(-1.0, 1.0, 3) * (beside, beside, min(0.4 * beside, 3.0))
    return on.compose(Pose2(x, y, phi))


def unchecked_pose(numbers: list[float]) -> Pose2:
    """A pose of any numbers, as a bridge would hand it over that checks nothing."""
    pose = object.__new__(Pose2)
    for name, value in zip(("x", "y", "phi"), numbers, strict=True):
        object.__setattr__(pose, name, value)
    return pose


def detection(rng: Generator, path: ReferencePath, here: Pose2, now: float) -> GoalMeasurement:
    frame = Frame.VEHICLE if rng.random() < 0.5 else Frame.WORLD
    pose = pose_near(rng, path, 2.0, end=True)
    if frame is Frame.VEHICLE:
        pose = pose.relative_to(here)
    x, y, phi = (pose.x, pose.y, pose.phi) if rng.random() < 0.8 else wild(rng, 3)
    spread: Any = rng.choice(4)
    covariance = (None, None, np.diag([0.0025, 0.0025, 0.001]), np.reshape(wild(rng, 9), (3, 3)))[spread]
    age = float(rng.choice([0.0, 0.0, rng.uniform(-0.1, 1.0), wild(rng, 1)[0]]))
    return GoalMeasurement(stamp=now - age, x=x, y=y, phi=phi, covariance=covariance, frame=frame)


def outlines(rng: Generator, path: ReferencePath) -> list[Any]:
    """Obstacles beside the path, and what is none."""
    found: list[Any] = []
    for _ in range(rng.integers(0, 4)):
        kind = rng.random()
        if kind < 0.6:
            found.append(
                box(pose_near(rng, path, 3.0 if kind < 0.4 else 200.0), 0.0, 0.0, rng.uniform(0.1, 1.3))
            )
        elif kind < 0.8:
            found.append(rng.uniform(-60.0, 60.0, (rng.integers(1, 7), 2)))
        else:
            found.append([wild(rng, int(rng.integers(1, 4))) for _ in range(rng.integers(0, 5))])
    return found


def given(rng: Generator, path: ReferencePath, here: Pose2, now: float) -> dict[str, Any]:
    """What a step is given besides the state."""
    told: dict[str, Any] = {}
    if (kind := rng.random()) < 0.12:
        poses = (
            pose_near(rng, path, 2.0, end=True),
            pose_near(rng, path, 200.0),
            unchecked_pose(wild(rng, 3)),
        )
        told["goal"] = poses[int(kind / 0.04)]
    if rng.random() < 0.25:
        told["measurements"] = [detection(rng, path, here, now) for _ in range(rng.integers(1, 4))]
    if rng.random() < 0.1:
        told["obstacles"] = outlines(rng, path)
    return told


def measured(rng: Generator, true: VehicleState) -> VehicleState:
    """A state as it is, or spoiled."""
    kind = rng.random()
    if kind < 0.9:
        return true
    if kind < 0.93:
        return VehicleState(*wild(rng, 5))
    return replace(true, **{str(rng.choice(NAMES)): wild(rng, 1)[0]})


def moved(rng: Generator, plant: PlantState, path: ReferencePath, limit: float, beside: float) -> PlantState:
    """The plant put down beside the path; commands under way stay."""
    pose = pose_near(rng, path, beside)
    v, delta = 1.5 * limit * rng.uniform(-1.0, 1.0), rng.uniform(-0.9, 0.9)
    return replace(plant, x=pose.x, y=pose.y, phi=pose.phi, v=float(v), delta=float(delta))


# -- what is promised ------------------------------------------------------------------------------------


def keep_promises(seed: int, *, in_area: bool = False, cycles: int = 20) -> None:
    """Drive one case; the plant follows the commands wherever the vehicle is not put down elsewhere."""
    rng = np.random.default_rng([seed, in_area])
    (path, corridor), config = world(rng), settings(rng)
    controller, calm = DockingController(path, corridor, config), 0
    if in_area:
        controller, calm = DockingController.in_area(area_around(path, corridor), config), 12
    parameters = PlantParameters.of(config.vehicle, config.limits, dead_time=config.dead_time)
    start, limit, now = path.start, config.limits.speed, 0.0
    plant = PlantState(x=start.x, y=start.y, phi=start.phi)
    if rng.random() < 0.5:
        plant = moved(rng, plant, path, limit, float(rng.choice([0.3, 3.0, 200.0])))
    elif rng.random() < 0.25:  # inside the tolerance of its goal
        plant = replace(plant, x=path.end.x + 0.02, y=path.end.y, phi=path.end.phi)
    for cycle in range(calm + int(rng.integers(5, cycles + 1))):
        pose, told, state = Pose2(plant.x, plant.y, plant.phi), {}, plant.measured
        if cycle >= calm or cycle == 0:
            told = given(rng, path, pose, now)
        if in_area and cycle == 0:
            told.setdefault("goal", path.end)
        if cycle >= calm:
            plant = moved(rng, plant, path, limit, 3.0) if rng.random() < 0.03 else plant
            state = measured(rng, plant.measured)
        command = controller.step(state, now=now, **told)
        check_numbers(command, config)
        check_return(state, plant, command, config)
        check_account(state, command, config)
        passed = (
            float(rng.choice([0.0, -1.0, 2.0, 1e4, 0.3, *wild(rng, 1)]))
            if rng.random() < 0.1
            else config.cycle
        )
        now = now + passed if rng.random() < 0.97 else wild(rng, 1)[0]
        later = plant.time + (passed if 0.0 <= passed <= LONGEST else config.cycle)
        plant = obeyed(plant, command, parameters, later)


def area_around(path: ReferencePath, corridor: Corridor) -> Area:
    """A rectangle that reaches 12 m beyond a path, with the obstacles of its corridor."""
    points = np.concatenate([np.column_stack([s.x, s.y]) for s in path.sample(0.5)])
    (left, bottom), (right, top) = points.min(axis=0) - 12.0, points.max(axis=0) + 12.0
    return Area(
        boundary=[(left, bottom), (right, bottom), (right, top), (left, top)], obstacles=corridor.obstacles
    )


def check_numbers(command: Command, config: ControllerConfig) -> None:
    """Everything is finite, within the input limits, and of the documented shape."""
    numbers = (command.acceleration, command.steering_rate, command.speed, command.steering)
    assert all(type(number) is float and isfinite(number) for number in numbers), numbers
    assert abs(command.acceleration) <= config.limits.acceleration + ROUNDING
    assert abs(command.steering_rate) <= config.limits.steering_rate + ROUNDING
    plan, stages = command.trajectory, config.stages
    shapes = ((plan.times, (stages + 1,)), (plan.states, (stages + 1, 6)), (plan.controls, (stages, 3)))
    for array, shape in shapes:
        assert array.shape == shape
        assert np.isfinite(array).all()
        assert not array.flags.writeable


def check_return(state: VehicleState, plant: PlantState, command: Command, config: ControllerConfig) -> None:
    """What is measured outside its limit is not led further out, but by braking what truly drives."""
    brakes = plant.v * command.acceleration < 0.0
    for value, limit, rate in (
        (0.0 if brakes else state.v, config.limits.speed, command.acceleration),
        (state.delta, config.limits.steering, command.steering_rate),
    ):
        if isfinite(value) and abs(value) > limit:
            assert np.sign(value) * rate <= ROUNDING, (value, limit, rate)


def check_account(state: VehicleState, command: Command, config: ControllerConfig) -> None:
    """Status, source and reason say what is the case."""
    diagnostics = command.diagnostics
    assert type(command.status) is Status
    assert type(command.source) is Source
    assert diagnostics.cause is not Reason.INTERNAL_ERROR, diagnostics.reason
    assert len(diagnostics.reason.splitlines()) <= 1
    assert not diagnostics.deadline_missed or command.source is not Source.SOLUTION
    assert command.status is not Status.FAILED or diagnostics.reason
    assert command.docked is (command.status is Status.DOCKED)
    if command.docked:
        error = Pose2(state.x, state.y, state.phi).relative_to(diagnostics.target)
        along, across, heading = (HELD_OUT * most for most in config.goal_tolerance)
        assert abs(error.x) <= along + MOVES * config.dead_time, error
        assert abs(error.y) <= across, error
        assert abs(error.phi) <= heading, error
        assert abs(state.v) <= MOVES
