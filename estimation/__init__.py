"""Filters: of the goal pose, of the vehicle's state, of what acts beside the commands. Knows geometry."""

from __future__ import annotations

from typing import TYPE_CHECKING

from estimation.belief import GoalPrior
from estimation.disturbance import DisturbanceEstimate
from estimation.goal_filter import GoalPoseFilter
from estimation.measurement import Frame, GoalMeasurement
from estimation.settings import DetectionNoise, DisturbanceFilterConfig, GoalFilterConfig, VehicleFilterConfig
from estimation.types import GoalEstimate, GoalStatus, Judgement, Outcome, stds_in
from estimation.vehicle_filter import MeasurementNoise, PoseHistory
from geometry.later import import_later

if TYPE_CHECKING:
    from estimation.camera import Camera, CharucoBoard
    from estimation.charuco import CharucoDetection, CharucoGoalDetector
else:
    __getattr__, __dir__ = import_later(
        __name__,
        {
            "estimation.camera": ("Camera", "CharucoBoard"),
            "estimation.charuco": ("CharucoDetection", "CharucoGoalDetector"),
        },
    )

__all__ = [
    "Camera",
    "CharucoBoard",
    "CharucoDetection",
    "CharucoGoalDetector",
    "DetectionNoise",
    "DisturbanceEstimate",
    "DisturbanceFilterConfig",
    "Frame",
    "GoalEstimate",
    "GoalFilterConfig",
    "GoalMeasurement",
    "GoalPoseFilter",
    "GoalPrior",
    "GoalStatus",
    "Judgement",
    "MeasurementNoise",
    "Outcome",
    "PoseHistory",
    "VehicleFilterConfig",
    "stds_in",
]
