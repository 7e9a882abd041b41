"""One controller from path to dock: real-time-iteration MPCC for car-like vehicles."""

from __future__ import annotations

from rti_mpcc._shadow import check_packages

check_packages()

from typing import TYPE_CHECKING

from estimation import (
    DetectionNoise,
    Frame,
    GoalEstimate,
    GoalFilterConfig,
    GoalMeasurement,
    GoalPoseFilter,
    GoalStatus,
    Judgement,
    Outcome,
)
from geometry import (
    Area,
    AreaError,
    Corridor,
    CorridorError,
    InputError,
    Narrowing,
    PathError,
    PathPart,
    Pose2,
    ReferencePath,
    RtiMpccError,
)
from geometry.later import import_later
from rti_mpcc.config import (
    ActuatorModel,
    Clearance,
    ControllerConfig,
    GoalTracking,
    Limits,
    SolverSettings,
    Vehicle,
    Weights,
)
from rti_mpcc.controller import RtiMpcc
from rti_mpcc.course.docking_time import config_for_docking_time, expected_docking_time
from rti_mpcc.docking import DockingController
from rti_mpcc.errors import ConfigError, MissingExtraError, RecordingError, ScenarioError
from rti_mpcc.iteration import Solution
from rti_mpcc.kernels import prepare_process
from rti_mpcc.manoeuvre import Manoeuvre, PlanOutcome, Segment, SegmentEnd, segments_of
from rti_mpcc.types import (
    Command,
    Diagnostics,
    EffectiveWeights,
    GoalOrigin,
    GoalSetpoint,
    MissionReport,
    MissionResult,
    Objective,
    Obstacle,
    Reason,
    Source,
    Status,
    Trajectory,
    VehicleState,
)
from rti_mpcc.version import __version__

if TYPE_CHECKING:
    from estimation import Camera, CharucoBoard, CharucoDetection, CharucoGoalDetector
    from rti_mpcc.mission import Approach, Dock, DockingMission, DockKind, DriveTo, Straight, Undock, Wait
    from rti_mpcc.route_planner.path_repair import PathChange, RepairedPath, repaired_path
    from rti_mpcc.route_planner.planner import plan_manoeuvre
else:  # imported when they are first used: cameras, missions, and the planner's kernels
    __getattr__, __dir__ = import_later(
        __name__,
        {
            "estimation": ("Camera", "CharucoBoard", "CharucoDetection", "CharucoGoalDetector"),
            "rti_mpcc.mission": (
                "Approach",
                "Dock",
                "DockKind",
                "DockingMission",
                "DriveTo",
                "Straight",
                "Undock",
                "Wait",
            ),
            "rti_mpcc.route_planner.path_repair": ("RepairedPath", "PathChange", "repaired_path"),
            "rti_mpcc.route_planner.planner": ("plan_manoeuvre",),
        },
    )

__all__ = [
    "ActuatorModel",
    "Approach",
    "Area",
    "AreaError",
    "Camera",
    "CharucoBoard",
    "CharucoDetection",
    "CharucoGoalDetector",
    "Clearance",
    "Command",
    "ConfigError",
    "ControllerConfig",
    "Corridor",
    "CorridorError",
    "DetectionNoise",
    "Diagnostics",
    "Dock",
    "DockKind",
    "DockingController",
    "DockingMission",
    "DriveTo",
    "EffectiveWeights",
    "Frame",
    "GoalEstimate",
    "GoalFilterConfig",
    "GoalMeasurement",
    "GoalOrigin",
    "GoalPoseFilter",
    "GoalSetpoint",
    "GoalStatus",
    "GoalTracking",
    "InputError",
    "Judgement",
    "Limits",
    "Manoeuvre",
    "MissingExtraError",
    "MissionReport",
    "MissionResult",
    "Narrowing",
    "Objective",
    "Obstacle",
    "Outcome",
    "PathChange",
    "PathError",
    "PathPart",
    "PlanOutcome",
    "Pose2",
    "Reason",
    "RecordingError",
    "ReferencePath",
    "RepairedPath",
    "RtiMpcc",
    "RtiMpccError",
    "ScenarioError",
    "Segment",
    "SegmentEnd",
    "Solution",
    "SolverSettings",
    "Source",
    "Status",
    "Straight",
    "Trajectory",
    "Undock",
    "Vehicle",
    "VehicleState",
    "Wait",
    "Weights",
    "__version__",
    "config_for_docking_time",
    "expected_docking_time",
    "plan_manoeuvre",
    "prepare_process",
    "repaired_path",
    "segments_of",
]
