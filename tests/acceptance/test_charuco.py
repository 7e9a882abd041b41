"""Docking by a rear camera alone: drawn pictures, a real detector, a mounting that is a little wrong."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from estimation import Camera, CharucoBoard, CharucoDetection, CharucoGoalDetector
from geometry import Pose2
from rti_mpcc.simulation import Detector, RunResult, Scenario, changed, load_scenario, simulate
from rti_mpcc.simulation.camera import BoardCamera, Image, Optics
from rti_mpcc.simulation.goal_feed import CameraDetector

CAMERA, BOARD = Camera(), CharucoBoard()
SEEDS = range(5)
SCENARIOS = ("docking_inside", "docking_behind")
INITIAL_OFFSET = (0.4, -0.3, 0.1)
"""From the true goal to the one that the plan begins with, in the true goal's frame [m, m, rad]."""


def by_camera(name: str) -> Scenario:
    return changed(load_scenario(name), {"goal.measurement": {"initial_offset": list(INITIAL_OFFSET)}})


def eye(seed: int, seen: list[CharucoDetection | None], optics: Optics) -> Detector:
    """A rear camera mounted and lit by chance: height, pitch and roll off as their tolerances have it."""
    random = np.random.default_rng([seed, 7])
    height, pitch, roll = random.standard_normal(3) * (CAMERA.height_std, CAMERA.tilt_std, CAMERA.tilt_std)
    true = CAMERA.model_copy(update={"z": CAMERA.z + height, "pitch": pitch, "roll": roll})

    def look(stamp: float, picture: Image, detection: CharucoDetection | None) -> None:
        seen.append(detection)

    return CameraDetector(
        pictures=BoardCamera(true, BOARD, optics, random),
        detector=CharucoGoalDetector(CAMERA, BOARD),
        seen=look,
    )


def judge(result: RunResult, seen: list[CharucoDetection | None], figures: dict[str, Any]) -> None:
    """Docked, and at the true pose: 0.05 m, 0.05 m, 2 deg."""
    truth = result.truth
    error = Pose2(*truth.poses[-1]).relative_to(Pose2(*truth.goals[-1]))
    figures["ended"], figures["time_s"] = result.ended, truth.times[-1]
    figures["error"] = {"longitudinal_m": error.x, "lateral_m": error.y, "heading_deg": np.degrees(error.phi)}
    figures["pictures"], figures["with_board"] = len(seen), sum(one is not None for one in seen)
    assert result.ended == "docked"
    assert abs(error.x) <= 0.05
    assert abs(error.y) <= 0.05
    assert abs(error.phi) <= np.radians(2.0)


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("name", SCENARIOS)
def test_docks_at_the_true_pose(name: str, seed: int, figures: dict[str, Any]) -> None:
    seen: list[CharucoDetection | None] = []
    result = simulate(by_camera(name), seed=seed, detector=eye(seed, seen, Optics()))
    judge(result, seen, figures)


@pytest.mark.parametrize(
    "optics",
    [Optics(exposure=0.3, noise=6.0), Optics(exposure=1.6), Optics(blur=1.6, noise=6.0)],
    ids=["dark", "glaring", "out of focus"],
)
def test_docks_in_bad_light_and_out_of_focus(optics: Optics, figures: dict[str, Any]) -> None:
    seen: list[CharucoDetection | None] = []
    result = simulate(by_camera("docking_inside"), seed=0, detector=eye(0, seen, optics))
    judge(result, seen, figures)
