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
from estimation import (
    Camera,
    CharucoBoard,
    GoalFilterConfig,
    GoalMeasurement,
    GoalPoseFilter,
)
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
from rti_mpcc.manoeuvre import PlannedStop
from rti_mpcc.ocp.objectives import CONTOURING
from rti_mpcc.orders import Stand

PACKAGES = (geometry, estimation, rti_mpcc)
MADE_BY_US = frozenset(
    [
        "CharucoDetection",
        "Command",
        "Contacts",
        "Diagnostics",
        "DisturbanceEstimate",
        "EffectiveWeights",
        "GoalEstimate",
        "GoalSetpoint",
        "Judgement",
        "Manoeuvre",
        "MeasurementNoise",
        "PoseHistory",
        "MendedPath",
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
        "DockingMission.told",
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


def _filter() -> GoalPoseFilter:
    made = GoalPoseFilter()
    made.predict(1.0)
    return made


DOORS: dict[str, Door] = {
    # -- geometry --------------------------------------------------------------------------------
    "Area": Door(call=Area, valid={"boundary": SQUARE, "obstacles": [SQUARE]}),
    "Area.from_grid": Door(
        call=Area.from_grid,
        valid={
            "array": np.eye(3),
            "resolution": 0.5,
            "origin": (0.0, 0.0, 0.0),
            "unknown_is_free": False,
        },
    ),
    "Area.solid_beside": Door(call=AREA.solid_beside, valid={"other": Area(), "least": 0.1}),
    "AreaLines": Door(
        call=geometry.AreaLines, valid={"boundary": np.array(SQUARE), "obstacles": (np.array(SQUARE),)}
    ),
    "Area.bounded": Door(call=Area().bounded, valid={"points": POINTS, "beyond": 2.0}),
    "Area.with_obstacles": Door(call=AREA.with_obstacles, valid={"polygons": [SQUARE]}),
    "Area.signed_distances": Door(
        call=AREA.signed_distances, valid={"body": BODY, "poses": np.zeros((2, 3)), "within": 3.0}
    ),
    "Corridor.from_offsets": Door(
        call=Corridor.from_offsets,
        valid={
            "path": PATH,
            "left": 4.0,
            "right": -4.0,
            "narrowings": [Narrowing(1.0, 2.0, left=3.0)],
            "obstacles": [SQUARE],
        },
    ),
    "Corridor.from_polygon": Door(
        call=Corridor.from_polygon,
        valid={
            "path": PATH,
            "polygon": [(-9.0, -9.0), (20.0, -9.0), (20.0, 9.0), (-9.0, 9.0)],
            "obstacles": [SQUARE],
        },
    ),
    "Corridor.in_area": Door(call=Corridor.in_area, valid={"area": AREA}),
    "Corridor.from_lines": Door(call=Corridor.from_lines, valid={"lines": CORRIDOR.to_lines()}),
    "Corridor.with_obstacles": Door(call=CORRIDOR.with_obstacles, valid={"obstacles": [SQUARE]}),
    "Corridor.clearance": Door(call=CORRIDOR.clearance, valid={"part": 0, "bodies": [SQUARE]}),
    "Corridor.collides": Door(call=CORRIDOR.collides, valid={"part": 0, "bodies": [SQUARE], "margin": 1.0}),
    "Corridor.signed_distances": Door(
        call=CORRIDOR.signed_distances,
        valid={"part": 0, "body": BODY, "poses": np.zeros((2, 3)), "within": 3.0},
    ),
    "Corridor.contacts": Door(
        call=CORRIDOR.contacts,
        valid={"part": 0, "body": BODY, "poses": np.zeros((2, 3)), "within": 3.0, "outward": 1.0},
    ),
    "Corridor.beyond": Door(call=CORRIDOR.beyond, valid={"part": 0, "points": np.array(POINTS)}),
    "Corridor.near_obstacles": Door(
        call=CORRIDOR.near_obstacles, valid={"points": np.array(POINTS), "within": 2.0}
    ),
    "Corridor.cut_off": Door(
        call=CORRIDOR.cut_off, valid={"part": 0, "one": (0.0, 0.0), "other": (5.0, 0.0)}
    ),
    "Corridor.narrowest": Door(call=CORRIDOR.narrowest, valid={"part": 0}),
    "Corridor.lines": Door(call=CORRIDOR.lines, valid={"part": 0}),
    "Corridor": Door(
        call=Corridor, valid={"walls": CORRIDOR.walls, "kept_out": CORRIDOR.kept_out, "area": None}
    ),
    "CorridorLines": Door(
        call=geometry.CorridorLines,
        valid={"parts": CORRIDOR.to_lines().parts, "obstacles": (np.array(SQUARE),), "area": None},
    ),
    "PartLines": Door(
        call=geometry.PartLines,
        valid={
            "left": (np.array(POINTS),),
            "right": (np.array(POINTS),),
            "joined": False,
            "narrowest": (1.0, 2.0),
        },
    ),
    "Narrowing": Door(call=Narrowing, valid={"start": 1.0, "end": 2.0, "left": 1.0, "right": -1.0}),
    "PathPart": Door(
        call=geometry.PathPart,
        valid={
            "direction": 1,
            "knots": np.array([0.0, 2.0]),
            "curvatures": np.array([0.0]),
            "x": np.array([0.0, 2.0]),
            "y": np.zeros(2),
            "phi": np.zeros(2),
        },
    ),
    "PathPart.reference": Door(call=PART.reference, valid={"theta": [1.0, 2.0]}),
    "PathPart.places": Door(call=PART.places, valid={"spacing": 1.0, "least": 2}),
    "PathPart.curvature": Door(call=PART.curvature, valid={"theta": [1.0, 2.0]}),
    "PathPart.pose": Door(call=PART.pose, valid={"theta": 2.0}),
    "PathPart.progress": Door(call=PART.progress, valid={"pose": ORIGIN, "theta": 0.0}),
    "PathPart.project": Door(
        call=PART.project, valid={"x": 1.0, "y": 1.0, "near": 1.0, "reach": 2.0, "heading": 0.0}
    ),
    "Pose2": Door(call=Pose2, valid={"x": 1.0, "y": 2.0, "phi": 0.0}),
    "Pose2.compose": Door(call=ORIGIN.compose, valid={"offset": ORIGIN}),
    "Pose2.relative_to": Door(call=ORIGIN.relative_to, valid={"frame": ORIGIN}),
    "Pose2.within": Door(call=ORIGIN.within, valid={"tolerance": (1.0, 1.0, 1.0), "share": 1.0}),
    "ReferencePath": Door(call=ReferencePath, valid={"parts": PATH.parts}),
    "ReferencePath.from_segments": Door(
        call=ReferencePath.from_segments, valid={"start": ORIGIN, "segments": [(1, 0.0, 40.0)]}
    ),
    "ReferencePath.from_poses": Door(
        call=ReferencePath.from_poses,
        valid={"poses": [(0.0, 0.0, 0.0), (4.0, 0.0, 0.0)], "directions": 1},
    ),
    "ReferencePath.from_waypoints": Door(
        call=ReferencePath.from_waypoints, valid={"points": POINTS, "direction": 1}
    ),
    "ReferencePath.sample": Door(call=PATH.sample, valid={"spacing": 1.0}),
    "lift": Door(call=geometry.lift, valid={"angle": 1.0, "near": 7.0}),
    "wrap": Door(call=geometry.wrap, valid={"angle": 4.0}),
    # -- estimation ------------------------------------------------------------------------------
    "Camera.seen": Door(call=CAMERA.seen, valid={"points": [(-3.0, 0.0, 1.0)]}),
    "Camera.project": Door(call=CAMERA.project, valid={"points": [(-3.0, 0.0, 1.0)]}),
    "CharucoBoard.shares_markers": Door(call=BOARD.shares_markers, valid={"other": BOARD}),
    "CharucoBoard.in_goal_frame": Door(call=BOARD.in_goal_frame, valid={"points": [(0.0, 0.0)]}),
    "DetectionNoise.covariance": Door(call=GoalFilterConfig().noise.covariance, valid={"distance": 2.0}),
    "GoalFilterConfig.drift": Door(call=GoalFilterConfig().drift, valid={"seconds": 2.0}),
    "GoalPoseFilter": Door(call=GoalPoseFilter, valid={"config": GoalFilterConfig()}),
    "GoalPoseFilter.predict": Door(call=_filter().predict, valid={"now": 2.0}),
    "GoalPoseFilter.update": Door(call=_filter().update, valid={"measurement": MEASUREMENT}),
    "GoalPoseFilter.estimate": Door(call=_filter().estimate, valid={"now": 2.0}),
    "stds_in": Door(
        call=estimation.stds_in, valid={"goals": np.zeros((1, 3)), "covariances": np.ones((1, 3, 3))}
    ),
    # -- rti_mpcc --------------------------------------------------------------------------------
    "Approach": Door(call=rti_mpcc.Approach, valid={"length": 2.0, "direction": 1}),
    "ControllerConfig.for_vehicle": Door(call=ControllerConfig.for_vehicle, valid={"kind": "van"}),
    "Dock": Door(
        call=Dock,
        valid={
            "pose": ORIGIN,
            "timeout": 9.0,
            "patience": 5.0,
            "retries": 1,
            "retry_from": 0,
            "then": "stop",
            "name": "A",
            "kind": rti_mpcc.DockKind.KNOWN,
            "board": None,
            "approach": rti_mpcc.Approach(2.0, 1),
            "tolerance": (0.1, 0.1, 0.1),
            "body": SQUARE,
            "contact": rti_mpcc.Straight(0.5),
            "uncertainty": (0.1, 0.1),
        },
    ),
    "Dock.body_at": Door(call=Dock(ORIGIN, body=SQUARE).body_at, valid={"pose": ORIGIN}),
    "DockingController": Door(
        call=DockingController,
        valid={"path": PATH, "corridor": CORRIDOR, "config": CONFIG, "segments": None},
    ),
    "DockingController.in_area": Door(call=DockingController.in_area, valid={"area": AREA, "config": CONFIG}),
    "DockingController.set_area": Door(
        call=DockingController.in_area(AREA, CONFIG).set_area, valid={"area": AREA}
    ),
    "DockingController.check_area": Door(
        call=DockingController.in_area(AREA, CONFIG).check_area, valid={"area": AREA}
    ),
    "DockingController.assign": Door(
        call=DockingController.in_area(AREA, CONFIG).assign, valid={"order": Stand()}
    ),
    "DockingMission": Door(
        call=DockingMission,
        valid={
            "controller": DockingController.in_area(AREA, CONFIG),
            "steps": [Wait(1.0), DriveTo(ORIGIN)],
            "home": ORIGIN,
        },
    ),
    "DriveTo": Door(
        call=DriveTo,
        valid={
            "pose": ORIGIN,
            "timeout": 9.0,
            "patience": 5.0,
            "retries": 1,
            "retry_from": 0,
            "then": "stop",
            "tolerance": (0.1, 0.1, 0.1),
        },
    ),
    "RtiMpcc": Door(call=RtiMpcc, valid={"part": PART, "corridor": CORRIDOR, "config": CONFIG, "index": 0}),
    "RtiMpcc.set_goal": Door(call=RtiMpcc(PART, CORRIDOR, CONFIG).set_goal, valid={"goal": ORIGIN}),
    "RtiMpcc.set_obstacles": Door(
        call=RtiMpcc(PART, CORRIDOR, CONFIG).set_obstacles, valid={"corridor": CORRIDOR}
    ),
    "Segment": Door(
        call=Segment,
        valid={
            "part": PART,
            "index": 0,
            "end": rti_mpcc.SegmentEnd.CUSP,
            "tolerance": (0.1, 0.1, 0.1),
            "speed": 1.0,
            "steering": 0.5,
            "wheels": 0.0,
            "margin": 0.1,
            "dwell": 1.0,
            "objective": CONTOURING,
            "target": None,
            "stop": None,
            "piece_of": None,
        },
    ),
    "Segment.stopped": Door(
        call=SEGMENT.stopped,
        valid={
            "stop": PlannedStop(at=1.0, goal=None, obstacles=None, since=0.0),
            "tolerance": (0.1, 0.1, 0.1),
        },
    ),
    "Segment.limited": Door(call=SEGMENT.limited, valid={"config": CONFIG}),
    "Straight": Door(
        call=rti_mpcc.Straight,
        valid={
            "distance": 1.0,
            "timeout": 9.0,
            "patience": 5.0,
            "retries": 1,
            "retry_from": 0,
            "then": "stop",
            "speed": 0.2,
            "steering": 0.1,
            "tolerance": (0.1, 0.1),
            "until": bool,
        },
    ),
    "Undock": Door(
        call=rti_mpcc.Undock,
        valid={
            "distance": 1.0,
            "timeout": 9.0,
            "patience": 5.0,
            "retries": 1,
            "retry_from": 0,
            "then": "stop",
        },
    ),
    "Wait": Door(
        call=Wait,
        valid={
            "seconds": 1.0,
            "timeout": 9.0,
            "patience": 5.0,
            "retries": 1,
            "retry_from": 0,
            "then": "stop",
            "until": bool,
        },
    ),
    "config_for_docking_time": Door(
        call=rti_mpcc.config_for_docking_time,
        valid={"seconds": 40.0, "path": PATH, "config": CONFIG, "goal": None},
    ),
    "expected_docking_time": Door(
        call=rti_mpcc.expected_docking_time, valid={"path": PATH, "config": CONFIG, "goal": None}
    ),
    "mended_path": Door(call=rti_mpcc.mended_path, valid={"path": PATH, "area": AREA, "config": CONFIG}),
    "plan_manoeuvre": Door(
        call=rti_mpcc.plan_manoeuvre,
        valid={"start": ORIGIN, "goal": Pose2(6.0, 0.0, 0.0), "area": AREA, "config": CONFIG},
    ),
    "segments_of": Door(call=rti_mpcc.segments_of, valid={"path": PATH, "config": CONFIG}),
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
