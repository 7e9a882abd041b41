"""Valid arguments of every public constructor and function, so that wrong ones can be put in their places."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from enum import Enum
from typing import Any

import numpy as np
from pydantic import BaseModel

import estimation
import geometry
import rti_mpcc
from estimation import Camera, CharucoBoard, GoalFilterConfig, GoalMeasurement, GoalPoseFilter, GoalPrior
from geometry import Area, Corridor, Narrowing, Pose2, ReferencePath
from geometry.shape_grid import Body
from rti_mpcc import (
    ControllerConfig,
    Dock,
    DockingController,
    DockingMission,
    DriveTo,
    RtiMpcc,
    Segment,
    Trajectory,
    Vehicle,
    Wait,
)
from rti_mpcc.ocp.objectives import CONTOURING
from rti_mpcc.orders import Stand

PACKAGES = (geometry, estimation, rti_mpcc)
MADE_BY_US = frozenset(
    [
        "CharucoDetection",
        "Command",
        "Diagnostics",
        "GoalPrior",
        "DisturbanceEstimate",
        "EffectiveWeights",
        "GoalEstimate",
        "GoalSetpoint",
        "Judgement",
        "Manoeuvre",
        "MeasurementNoise",
        "PoseHistory",
        "RepairedPath",
        "MissionReport",
        "PathChange",
        "PathReference",
        "Solution",
        "Trajectory",
    ]
)
"""Results: nobody else makes them."""
NEVER_RAISES = frozenset(
    [
        "VehicleState",
        "GoalMeasurement",
        "DockingController.step",
        "DockingMission.step",
        "DockingMission.signalled",
        "PlanOutcome",
    ]
)
"""What comes in each cycle: unusable values are ignored, and the reason says so (tests/rti_mpcc)."""
OF_RESULTS = frozenset(["MeasurementNoise.broken", "RtiMpcc.prepare", "RtiMpcc.feedback"])
"""Take what other calls have made."""
NEEDS_OPENCV = frozenset(
    {"CharucoGoalDetector", "CharucoGoalDetector.detect", "CharucoGoalDetector.annotated"}
)


@dataclass(frozen=True, kw_only=True)
class Door:
    """A public function and valid arguments for it."""

    call: Callable[..., Any]
    valid: dict[str, Any] = field(default_factory=dict)


ORIGIN = Pose2(0.0, 0.0, 0.0)
PATH = ReferencePath.from_segments(ORIGIN, [(1, 0.0, 8.0), (-1, 0.1, 4.0)])
PART = PATH.parts[0]
SHORT = ReferencePath.from_segments(ORIGIN, [(1, 0.0, 2.0)])
CORRIDOR = Corridor.from_offsets(
    PATH, left=4.0, right=-4.0, obstacles=[[(20.0, 0.0), (21.0, 0.0), (21.0, 1.0)]]
)
AREA = Area(boundary=[(-9.0, -9.0), (20.0, -9.0), (20.0, 9.0), (-9.0, 9.0)])
BODY = Body.of([(0.0, -1.0), (1.0, -1.0), (1.0, 1.0), (0.0, 1.0)])
SQUARE = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]
POINTS = [(0.0, 0.0), (3.0, 0.0), (6.0, 1.0)]
CONFIG = ControllerConfig()
BOARD, CAMERA = CharucoBoard(), Camera()
MEASUREMENT = GoalMeasurement(stamp=1.0, x=1.0, y=2.0, phi=0.0)
SEGMENT = Segment(part=PART, index=0)


def door(function: Callable[..., Any], /, **valid: Any) -> Door:
    return Door(call=function, valid=valid)


STEP: dict[str, Any] = {"timeout": 9.0, "patience": 5.0, "retries": 1, "retry_from": 0, "then": "stop"}
"""Valid for every step of a mission."""


def _filter() -> GoalPoseFilter:
    made = GoalPoseFilter()
    made.predict(1.0)
    return made


DOORS: dict[str, Door] = {
    # -- geometry ------------------------------
    "Area": door(Area, boundary=SQUARE, obstacles=[SQUARE]),
    "Area.from_grid": door(
        Area.from_grid, array=np.eye(3), resolution=0.5, origin=(0.0, 0.0, 0.0), unknown_is_free=False
    ),
    "Area.solid_beside": door(AREA.solid_beside, other=Area(), least=0.1),
    "Area.bounded": door(Area().bounded, points=POINTS, beyond=2.0),
    "Area.with_obstacles": door(AREA.with_obstacles, polygons=[SQUARE]),
    "Area.signed_distances": door(AREA.signed_distances, body=BODY, poses=np.zeros((2, 3)), within=3.0),
    "Corridor.from_offsets": door(
        Corridor.from_offsets,
        path=PATH,
        left=4.0,
        right=-4.0,
        narrowings=[Narrowing(1.0, 2.0, left=3.0)],
        obstacles=[SQUARE],
    ),
    "Corridor.from_polygon": door(
        Corridor.from_polygon,
        path=PATH,
        polygon=[(-9.0, -9.0), (20.0, -9.0), (20.0, 9.0), (-9.0, 9.0)],
        obstacles=[SQUARE],
    ),
    "Corridor.in_area": door(Corridor.in_area, area=AREA),
    "Corridor.with_obstacles": door(CORRIDOR.with_obstacles, obstacles=[SQUARE]),
    "Corridor.cut_off": door(CORRIDOR.cut_off, part=0, one=(0.0, 0.0), other=(5.0, 0.0)),
    "Corridor.lines": door(CORRIDOR.lines, part=0),
    "Corridor": door(Corridor, walls=CORRIDOR.walls, obstacles=CORRIDOR.obstacles, area=None),
    "PartLines": door(
        geometry.PartLines,
        left=(np.array(POINTS),),
        right=(np.array(POINTS),),
        joined=False,
        narrowest=(1.0, 2.0),
    ),
    "Narrowing": door(Narrowing, start=1.0, end=2.0, left=1.0, right=-1.0),
    "PathPart": door(
        geometry.PathPart,
        direction=1,
        knots=np.array([0.0, 2.0]),
        curvatures=np.array([0.0]),
        x=np.array([0.0, 2.0]),
        y=np.zeros(2),
        phi=np.zeros(2),
    ),
    "PathPart.reference": door(PART.reference, theta=[1.0, 2.0]),
    "PathPart.places": door(PART.places, spacing=1.0),
    "PathPart.curvature": door(PART.curvature, theta=[1.0, 2.0]),
    "PathPart.pose": door(PART.pose, theta=2.0),
    "PathPart.progress": door(PART.progress, pose=ORIGIN, theta=0.0),
    "PathPart.project": door(PART.project, x=1.0, y=1.0, near=1.0, reach=2.0, heading=0.0),
    "Pose2": door(Pose2, x=1.0, y=2.0, phi=0.0),
    "Pose2.compose": door(ORIGIN.compose, offset=ORIGIN),
    "Pose2.relative_to": door(ORIGIN.relative_to, frame=ORIGIN),
    "Pose2.within": door(ORIGIN.within, tolerance=(1.0, 1.0, 1.0), share=1.0),
    "ReferencePath": door(ReferencePath, parts=PATH.parts),
    "ReferencePath.from_segments": door(ReferencePath.from_segments, start=ORIGIN, segments=[(1, 0.0, 40.0)]),
    "ReferencePath.from_poses": door(
        ReferencePath.from_poses, poses=[(0.0, 0.0, 0.0), (4.0, 0.0, 0.0)], directions=1
    ),
    "ReferencePath.from_waypoints": door(ReferencePath.from_waypoints, points=POINTS, direction=1),
    "ReferencePath.sample": door(PATH.sample, spacing=1.0),
    "lift": door(geometry.lift, angle=1.0, near=7.0),
    "wrap": door(geometry.wrap, angle=4.0),
    # -- estimation ------------------------------
    "Camera.seen": door(CAMERA.seen, points=[(-3.0, 0.0, 1.0)]),
    "Camera.project": door(CAMERA.project, points=[(-3.0, 0.0, 1.0)]),
    "CharucoBoard.shares_markers": door(BOARD.shares_markers, other=BOARD),
    "CharucoBoard.in_goal_frame": door(BOARD.in_goal_frame, points=[(0.0, 0.0)]),
    "DetectionNoise.covariance": door(GoalFilterConfig().noise.covariance, distance=2.0),
    "GoalFilterConfig.drift": door(GoalFilterConfig().drift, seconds=2.0),
    "GoalPoseFilter": door(GoalPoseFilter, config=GoalFilterConfig()),
    "GoalPoseFilter.expect": door(_filter().expect, prior=GoalPrior(pose=Pose2(1.0, 2.0, 0.3))),
    "GoalPoseFilter.predict": door(_filter().predict, now=2.0),
    "GoalPoseFilter.update": door(_filter().update, measurement=MEASUREMENT),
    "GoalPoseFilter.estimate": door(_filter().estimate, now=2.0),
    "stds_in": door(estimation.stds_in, goals=np.zeros((1, 3)), covariances=np.ones((1, 3, 3))),
    # -- rti_mpcc ------------------------------
    "Obstacle": door(rti_mpcc.Obstacle, polygon=SQUARE, velocity=(1.0, 0.0), turn_rate=0.1, name="cart"),
    "Approach": door(rti_mpcc.Approach, length=2.0, direction=1),
    "ControllerConfig.for_vehicle": door(ControllerConfig.for_vehicle, kind="van"),
    "Dock": door(
        Dock,
        pose=ORIGIN,
        **STEP,
        name="A",
        kind=rti_mpcc.DockKind.KNOWN,
        board=None,
        approach=rti_mpcc.Approach(2.0, 1),
        tolerance=(0.1, 0.1, 0.1),
        body=SQUARE,
        contact=rti_mpcc.Straight(0.5),
        uncertainty=(0.1, 0.1),
    ),
    "Dock.body_at": door(Dock(ORIGIN, body=SQUARE).body_at, pose=ORIGIN),
    "DockingController": door(DockingController, path=PATH, corridor=CORRIDOR, config=CONFIG, segments=None),
    "DockingController.in_area": door(DockingController.in_area, area=AREA, config=CONFIG),
    "DockingController.set_area": door(DockingController.in_area(AREA, CONFIG).set_area, area=AREA),
    "DockingController.check_area": door(DockingController.in_area(AREA, CONFIG).check_area, area=AREA),
    "DockingController.assign": door(DockingController.in_area(AREA, CONFIG).assign, order=Stand()),
    "DockingMission": door(
        DockingMission,
        controller=DockingController.in_area(AREA, CONFIG),
        steps=[Wait(1.0), DriveTo(ORIGIN)],
        home=ORIGIN,
    ),
    "DriveTo": door(DriveTo, pose=ORIGIN, **STEP, tolerance=(0.1, 0.1, 0.1)),
    "RtiMpcc": door(RtiMpcc, part=PART, corridor=CORRIDOR, config=CONFIG, index=0),
    "RtiMpcc.set_goal": door(RtiMpcc(PART, CORRIDOR, CONFIG).set_goal, goal=ORIGIN),
    "RtiMpcc.set_obstacles": door(RtiMpcc(PART, CORRIDOR, CONFIG).set_obstacles, corridor=CORRIDOR),
    "Segment": door(
        Segment,
        part=PART,
        index=0,
        end=rti_mpcc.SegmentEnd.CUSP,
        tolerance=(0.1, 0.1, 0.1),
        speed=1.0,
        steering=0.5,
        wheels=0.0,
        margin=0.1,
        dwell=1.0,
        objective=CONTOURING,
        target=None,
    ),
    "Segment.limited": door(SEGMENT.limited, config=CONFIG),
    "Straight": door(
        rti_mpcc.Straight, distance=1.0, **STEP, speed=0.2, steering=0.1, tolerance=(0.1, 0.1), until=bool
    ),
    "Undock": door(rti_mpcc.Undock, distance=1.0, **STEP),
    "Wait": door(Wait, seconds=1.0, **STEP, until=bool),
    "config_for_docking_time": door(
        rti_mpcc.config_for_docking_time, seconds=8.0, path=SHORT, config=CONFIG, goal=None, corridor=None
    ),
    "expected_docking_time": door(
        rti_mpcc.expected_docking_time, path=PATH, config=CONFIG, goal=None, corridor=None
    ),
    "repaired_path": door(rti_mpcc.repaired_path, path=PATH, area=AREA, config=CONFIG),
    "plan_manoeuvre": door(
        rti_mpcc.plan_manoeuvre, start=ORIGIN, goal=Pose2(6.0, 0.0, 0.0), area=AREA, config=CONFIG
    ),
    "segments_of": door(rti_mpcc.segments_of, path=PATH, config=CONFIG),
}
"""By name; a file's reader (`from_csv`, `from_map`) has tests of its own."""


def public() -> Iterator[tuple[str, Callable[..., Any]]]:
    """Every public constructor and function that takes arguments, but those of settings and results."""
    seen: set[int] = set()
    for package in PACKAGES:
        for name in package.__all__:
            thing = getattr(package, name)
            if id(thing) in seen or (inspect.isclass(thing) and issubclass(thing, Enum | Exception)):
                continue
            seen.add(id(thing))
            if not inspect.isclass(thing):
                if callable(thing):
                    yield name, thing
                continue
            if name not in MADE_BY_US and not issubclass(thing, BaseModel):
                yield name, thing
            for method, member in vars(thing).items():
                inner = getattr(member, "__func__", member)
                if not method.startswith("_") and inspect.isfunction(inner):
                    yield f"{name}.{method}", getattr(thing, method)


def parameters(function: Callable[..., Any]) -> tuple[str, ...]:
    """Names of what a function takes."""
    found = inspect.signature(function).parameters.values()
    return tuple(each.name for each in found if each.name != "self" and each.kind is not each.VAR_KEYWORD)


__all__ = ["DOORS", "Trajectory", "Vehicle", "parameters", "public"]
