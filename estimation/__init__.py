"""The goal pose from noisy detections: a gated Kalman filter with a clock of its own. Knows geometry only."""

from __future__ import annotations

from estimation.camera import Camera, CharucoBoard
from estimation.charuco import CharucoDetection, CharucoGoalDetector
from estimation.goal_filter import GoalPoseFilter
from estimation.history import PoseHistory
from estimation.measurement import Frame, GoalMeasurement
from estimation.settings import DetectionNoise, GoalFilterConfig
from estimation.types import GoalEstimate, GoalStatus, Judgement, Outcome, stds_in

__all__ = [
    "Camera",
    "CharucoBoard",
    "CharucoDetection",
    "CharucoGoalDetector",
    "DetectionNoise",
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
