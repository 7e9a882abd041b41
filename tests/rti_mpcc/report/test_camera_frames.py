"""Pictures of a run's camera, kept small, with what was detected on them."""

from __future__ import annotations

import numpy as np
import pytest

from estimation import Camera, CharucoBoard, CharucoGoalDetector
from geometry import Pose2
from rti_mpcc.report.camera_frames import WIDTH, CameraFrames
from rti_mpcc.simulation.camera import BoardCamera, Optics
from rti_mpcc.simulation.sections.camera import CameraSection

VEHICLE, DOCK = Pose2(2.0, 0.1, 0.02), Pose2(0.0, 0.0, 0.0)


@pytest.fixture(scope="module")
def frames() -> CameraFrames:
    kept, camera, board = CameraFrames(CameraSection()), Camera(), CharucoBoard()
    picture = BoardCamera(camera, board, Optics(), np.random.default_rng(0)).expose(VEHICLE, DOCK)
    detection = CharucoGoalDetector(camera, board).detect(picture, 0.4)
    assert detection is not None
    kept(0.2, picture, None)
    kept(0.4, picture, detection)
    return kept


def test_pictures_are_kept_in_order_with_what_was_found(frames: CameraFrames) -> None:
    assert [(frame.stamp, frame.found) for frame in frames.frames] == [(0.2, False), (0.4, True)]


def test_they_are_small(frames: CameraFrames) -> None:
    camera = Camera()
    for frame in frames.frames:
        assert frame.picture.shape == (round(WIDTH * camera.height / camera.width), WIDTH, 3)
        assert len(frame.jpeg) < 100_000


def test_corners_and_axes_are_drawn_where_the_board_was_found(frames: CameraFrames) -> None:
    without, found = (frame.picture.astype(int) for frame in frames.frames)
    # Coloured lines on a grey picture: red is right, green is down.
    colour = [(each.max(axis=2) - each.min(axis=2) > 60) for each in (without, found)]
    assert not colour[0].any()
    rows, columns = np.nonzero(colour[1])
    share = WIDTH / Camera().width
    board = CharucoBoard()
    middle = Camera().project([np.array([-VEHICLE.x + board.x, -VEHICLE.y, board.z])])[0] * share
    assert abs(np.median(columns) - middle[0]) < 30.0
    assert abs(np.median(rows) - middle[1]) < 30.0
    red = (found[..., 0] - found[..., 2] > 60).sum()
    assert red > 30
