"""Drawn pictures: the board is where the projection says, and light, lens and noise do what they say."""

from __future__ import annotations

from math import pi

import cv2
import numpy as np
import pytest

from estimation import Camera, CharucoBoard
from geometry import Pose2
from rti_mpcc.simulation.camera import BoardCamera, Optics
from rti_mpcc.types import Array
from tests.estimation.test_board_pose import pixels

CAMERA, BOARD, DOCK = Camera(), CharucoBoard(), Pose2(0.0, 0.0, 0.0)
CLEAR = Optics(blur=0.0, noise=0.0)
BENT = CAMERA.model_copy(update={"distortion": (-0.25, 0.08, 0.002, -0.001, 0.0)})
PITCHED = CAMERA.model_copy(update={"pitch": 0.15, "roll": 0.1, "yaw": 3.0})


def taking(camera: Camera = CAMERA, seed: int = 0, **optics: float) -> BoardCamera:
    return BoardCamera(camera, BOARD, Optics(**optics) if optics else CLEAR, np.random.default_rng(seed))


def corners(camera: Camera, vehicle: Pose2) -> Array:
    """Pixels (n, 2) of the corners between the squares."""
    goal = DOCK.relative_to(vehicle)
    return pixels(np.array([goal.x, goal.y, goal.phi]), camera, BOARD)


@pytest.mark.parametrize("camera", [CAMERA, PITCHED, BENT], ids=["plain", "pitched", "bent"])
@pytest.mark.parametrize("vehicle", [DOCK, Pose2(1.0, 0.5, 0.1), Pose2(4.0, -1.0, -0.2)], ids=str)
def test_corners_are_where_the_projection_puts_them(camera: Camera, vehicle: Pose2) -> None:
    picture = taking(camera, blur=1.0, noise=0.0).expose(vehicle, DOCK)
    expected = corners(camera, vehicle)
    # Between four squares the grey runs through a saddle; its middle is found without the detector.
    start = expected.astype(np.float32)[:, None] + np.float32(0.4)
    until = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_MAX_ITER, 50, 1e-3)
    found = cv2.cornerSubPix(picture, start, (4, 4), (-1, -1), until)[:, 0]
    assert np.abs(found - expected).max() < 0.1
    assert np.abs((found - expected).mean(axis=0)).max() < 0.03


@pytest.mark.parametrize(
    "vehicle",
    [Pose2(-8.0, 0.0, 0.0), Pose2(-1.85, 0.0, 0.0), Pose2(3.0, 9.0, 0.0), Pose2(-8.0, 0.0, pi)],
    ids=["behind the camera", "in the lens plane", "aside", "from its back"],
)
def test_a_board_that_is_not_seen_leaves_the_background(vehicle: Pose2) -> None:
    pictures = taking()
    far_off = Pose2(0.0, 1e6, 0.0)
    empty = pictures.expose(vehicle, far_off)
    assert np.array_equal(pictures.expose(vehicle, DOCK), empty)
    assert empty.std() > 10.0  # not plain


@pytest.mark.parametrize("nearer", ["own", "other"])
def test_a_nearer_board_covers_a_farther_one(nearer: str) -> None:
    ahead, vehicle = Pose2(1.0, 0.0, 0.0), Pose2(4.0, 0.0, 0.0)
    own, other = (ahead, DOCK) if nearer == "own" else (DOCK, ahead)
    others = [(BOARD.model_copy(update={"first_marker": 20}), other)]
    both = BoardCamera(CAMERA, BOARD, CLEAR, np.random.default_rng(0), others).expose(vehicle, own)
    board = BOARD if nearer == "own" else others[0][0]
    covering = BoardCamera(CAMERA, board, CLEAR, np.random.default_rng(0)).expose(vehicle, ahead)
    # Seen from right behind, the nearer paper covers all of the farther one.
    assert np.array_equal(both, covering)
