"""Camera and board: by hand, against OpenCV's own projection, and what is refused."""

from __future__ import annotations

from math import pi
from typing import Any

import cv2
import numpy as np
import pytest

from estimation import Camera, CharucoBoard
from geometry import InputError
from geometry.errors import ConfigError

REAR = Camera(x=-0.7, y=0.1, z=1.0, yaw=pi)


def test_a_rear_camera_by_hand() -> None:
    # 2 m behind the lens, 0.3 m to the vehicle's left and 0.2 m below it: right and down in the picture.
    pixel = REAR.project([[-2.7, 0.4, 0.8]])[0]
    assert pixel == pytest.approx([REAR.cx + REAR.fx * 0.15, REAR.cy + REAR.fy * 0.1])


@pytest.mark.parametrize("seed", range(5))
def test_projection_is_opencvs(seed: int) -> None:
    random = np.random.default_rng(seed)
    yaw, pitch, roll = random.uniform([-pi, -0.5, -0.5], [pi, 0.5, 0.5]).tolist()
    x, y, z = random.uniform(-2.0, 2.0, 3).tolist()
    bent = random.uniform(-0.1, 0.1, 5) * (1.0, 1.0, 0.05, 0.05, 0.5)
    camera = Camera(
        x=x, y=y, z=z, yaw=yaw, pitch=pitch, roll=roll, fx=900.0, fy=920.0, distortion=tuple(bent.tolist())
    )
    seen = random.uniform([-1.5, -1.0, 2.0], [1.5, 1.0, 8.0], (30, 3))
    points = seen @ camera.rotation.T + camera.position
    rotation = camera.rotation.T
    expected, _ = cv2.projectPoints(
        points, cv2.Rodrigues(rotation)[0], -rotation @ camera.position, camera.matrix, bent
    )
    assert camera.seen(points) == pytest.approx(seen)
    assert camera.project(points) == pytest.approx(expected[:, 0], abs=1e-6)


def test_points_behind_the_camera_are_refused() -> None:
    with pytest.raises(InputError, match="before the camera"):
        REAR.project([[3.0, 0.0, 1.0]])


def test_the_boards_first_corner_is_upper_left_to_its_reader() -> None:
    board = CharucoBoard(x=-2.0, y=0.5, z=1.2)
    width, height = board.size
    first, last = board.in_goal_frame([[0.0, 0.0], [width, height]])
    # Its reader looks against the normal, along -x of the goal frame, and has +y on the right.
    assert first == pytest.approx([-2.0, 0.5 - width / 2.0, 1.2 + height / 2.0])
    assert last == pytest.approx([-2.0, 0.5 + width / 2.0, 1.2 - height / 2.0])


def test_the_board_turns_with_its_yaw() -> None:
    board = CharucoBoard(x=0.0, y=0.0, z=0.0, yaw=pi / 2)
    assert board.axes[:, 2] == pytest.approx([0.0, -1.0, 0.0])  # into the board, against the normal
    assert np.linalg.det(board.axes) == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("kind", "values", "message"),
    [
        (Camera, {"fx": 0.0}, "fx"),
        (Camera, {"width": 0}, "width"),
        (Camera, {"tilt_std": 0.0}, "tilt_std"),
        (Camera, {"zoom": 2.0}, "zoom is not a setting"),
        (Camera, {"distortion": (0.0, 0.0)}, "distortion"),
        (CharucoBoard, {"columns": 1}, "columns"),
        (CharucoBoard, {"square": 0.1, "marker": 0.1}, "must be smaller than square"),
    ],
)
def test_bad_values_are_refused(kind: Any, values: dict[str, Any], message: str) -> None:
    with pytest.raises(ConfigError, match=message):
        kind(**values)


@pytest.mark.parametrize(
    ("other", "shared"),
    [
        ({"first_marker": 9}, True),
        ({"first_marker": 10}, False),
        ({"dictionary": "DICT_4X4_1000"}, True),
        ({"dictionary": "DICT_5X5_50"}, False),
        ({"dictionary": "DICT_APRILTAG_36h11"}, False),
    ],
)
def test_boards_with_a_marker_in_common(other: dict[str, Any], shared: bool) -> None:
    first, second = CharucoBoard(), CharucoBoard(**other)
    assert first.shares_markers(second) is shared
    assert second.shares_markers(first) is shared
    assert second.shares_markers(second)
