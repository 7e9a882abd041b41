"""Kalman filters: the goal pose from noisy detections, and what acts beside the commands. Knows geometry."""

from __future__ import annotations

from estimation.camera import Camera, CharucoBoard
from estimation.charuco import CharucoDetection, CharucoGoalDetector
from estimation.disturbance import DisturbanceEstimate
from estimation.goal_filter import GoalPoseFilter
from estimation.history import PoseHistory
from estimation.measurement import Frame, GoalMeasurement
from estimation.settings import DetectionNoise, DisturbanceFilterConfig, GoalFilterConfig
from estimation.types import GoalEstimate, GoalStatus, Judgement, Outcome, stds_in

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
    "GoalStatus",
    "Judgement",
    "Outcome",
    "PoseHistory",
    "stds_in",
]
