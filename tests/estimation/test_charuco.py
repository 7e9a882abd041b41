"""The goal in pictures: drawn ones, where the truth is known, partial ones, and such without a board."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from estimation import Camera, CharucoBoard, CharucoDetection, CharucoGoalDetector, Frame
from estimation.charuco import Image
from geometry import Pose2, wrap
from geometry.errors import ConfigError, MissingExtraError
from rti_mpcc.simulation.camera import BoardCamera, Optics

CAMERA, BOARD, DOCK = Camera(), CharucoBoard(), Pose2(0.0, 0.0, 0.0)
AT_THE_DOCK = Pose2(0.0, 0.0, 0.0)


@pytest.fixture(scope="module")
def detector() -> CharucoGoalDetector:
    return CharucoGoalDetector(CAMERA, BOARD)


@pytest.fixture
def pictures() -> BoardCamera:
    return BoardCamera(CAMERA, BOARD, Optics(), np.random.default_rng(7))


def off(detection: CharucoDetection, vehicle: Pose2, goal: Pose2 = DOCK) -> np.ndarray:
    m, true = detection.measurement, goal.relative_to(vehicle)
    return np.array([m.x - true.x, m.y - true.y, wrap(m.phi - true.phi)])


def nees(detection: CharucoDetection, vehicle: Pose2) -> float:
    error = off(detection, vehicle)
    return float(error @ np.linalg.solve(np.asarray(detection.measurement.covariance), error))


@pytest.mark.parametrize(
    "vehicle", [AT_THE_DOCK, Pose2(0.5, 0.3, 0.05), Pose2(3.0, 1.2, 0.3), Pose2(7.0, -1.5, 0.1)], ids=str
)
def test_the_goal_is_found_within_its_covariance(
    detector: CharucoGoalDetector, pictures: BoardCamera, vehicle: Pose2
) -> None:
    detection = detector.detect(pictures.expose(vehicle, DOCK), stamp=1.25)
    assert detection is not None
    assert detection.measurement.stamp == 1.25
    assert detection.measurement.frame is Frame.VEHICLE
    assert nees(detection, vehicle) < 16.3  # chi-square of 3 at 0.999, the filter's gate
    assert detection.reprojection_error < 0.3
    assert len(detection.ids) == len(detection.corners) == len(detection.residuals)


def test_a_distorting_lens_is_taken_into_account() -> None:
    bent = CAMERA.model_copy(update={"distortion": (-0.25, 0.08, 0.001, -0.001, 0.0)})
    vehicle = Pose2(1.0, 0.9, 0.1)
    picture = BoardCamera(bent, BOARD, Optics(), np.random.default_rng(3)).expose(vehicle, DOCK)
    detection = CharucoGoalDetector(bent, BOARD).detect(picture, stamp=0.0)
    assert detection is not None
    assert nees(detection, vehicle) < 16.3
    ignored = CharucoGoalDetector(CAMERA, BOARD).detect(picture, stamp=0.0)
    assert ignored is None or ignored.reprojection_error > 5.0 * detection.reprojection_error


@pytest.mark.acceptance
def test_covariance_is_honest_with_pictures_and_a_mounting_within_tolerance(
    detector: CharucoGoalDetector, pictures: BoardCamera
) -> None:
    random, squares = np.random.default_rng(11), []
    for distance in (0.0, 2.0, 5.0):
        for _ in range(20):
            height, pitch, roll = random.standard_normal(3) * (CAMERA.height_std, *[CAMERA.tilt_std] * 2)
            pictures.camera = CAMERA.model_copy(update={"z": CAMERA.z + height, "pitch": pitch, "roll": roll})
            pictures.optics = Optics(blur=random.uniform(0.5, 1.2), noise=random.uniform(2.0, 6.0))
            vehicle = Pose2(distance, *random.uniform([-0.5, -0.2], [0.5, 0.2]).tolist())
            detection = detector.detect(pictures.expose(vehicle, DOCK), stamp=0.0)
            assert detection is not None
            squares.append(nees(detection, vehicle))
    assert 3.0 / 1.8 < np.mean(squares) < 3.0 * 1.5


@pytest.mark.parametrize("vehicle", [Pose2(0.0, 1.05, 0.0), Pose2(0.0, -1.05, 0.0)], ids=str)
def test_a_board_half_out_of_the_picture_is_enough(
    detector: CharucoGoalDetector, pictures: BoardCamera, vehicle: Pose2
) -> None:
    detection = detector.detect(pictures.expose(vehicle, DOCK), stamp=0.0)
    assert detection is not None
    assert len(detection.ids) < 12
    assert nees(detection, vehicle) < 16.3


def test_corners_on_one_line_are_not_enough() -> None:
    board = CharucoBoard(columns=9, rows=3, square=0.15, marker=0.11)
    detector = CharucoGoalDetector(CAMERA, board)
    picture = BoardCamera(CAMERA, board, Optics(), np.random.default_rng(5)).expose(AT_THE_DOCK, DOCK)
    whole = detector.detect(picture, stamp=0.0)
    assert whole is not None
    assert len(whole.ids) == 16
    lower = whole.corners[whole.ids >= 8]
    picture[int(lower[:, 1].min()) + 3 :] = 90
    assert detector.detect(picture, stamp=0.0) is None


def garbage() -> dict[str, np.ndarray]:
    random, size = np.random.default_rng(0), (CAMERA.height, CAMERA.width)
    return {
        "black": np.zeros(size, np.uint8),
        "noise": random.integers(0, 256, size, dtype=np.uint8),
        "coloured noise": random.integers(0, 256, (*size, 3), dtype=np.uint8),
        "empty": np.zeros((0, 0), np.uint8),
        "one row": np.zeros((1, CAMERA.width), np.uint8),
        "another size": random.integers(0, 256, (480, 640), dtype=np.uint8),
        "four channels": random.integers(0, 256, (*size, 4), dtype=np.uint8),
        "one dimension": np.zeros(100, np.uint8),
        "floats": np.zeros(size),
    }


@pytest.mark.parametrize("name", garbage())
def test_garbage_gives_none_and_never_raises(detector: CharucoGoalDetector, name: str) -> None:
    assert detector.detect(garbage()[name], stamp=0.0) is None


def test_of_two_boards_in_view_each_detector_finds_its_own() -> None:
    beside, vehicle = Pose2(0.3, 1.4, 0.1), Pose2(4.0, 0.6, 0.05)
    other = BOARD.model_copy(update={"first_marker": BOARD.markers.stop})
    eye = BoardCamera(CAMERA, BOARD, Optics(), np.random.default_rng(6), [(other, beside)])
    picture = eye.expose(vehicle, DOCK)
    for board, dock in ((BOARD, DOCK), (other, beside)):
        detection = CharucoGoalDetector(CAMERA, board).detect(picture, stamp=0.0)
        assert detection is not None
        assert np.abs(off(detection, vehicle, dock)) == pytest.approx(0.0, abs=0.03)
    gone = eye.expose(vehicle, Pose2(0.0, 60.0, 0.0))
    assert CharucoGoalDetector(CAMERA, BOARD).detect(gone, stamp=0.0) is None
    assert CharucoGoalDetector(CAMERA, other).detect(gone, stamp=0.0) is not None


def test_the_annotated_picture(detector: CharucoGoalDetector, pictures: BoardCamera) -> None:
    picture = pictures.expose(AT_THE_DOCK, DOCK)
    before = picture.copy()
    detection = detector.detect(picture, stamp=0.0)
    drawn: Image = detector.annotated(picture, detection)
    assert drawn.shape == (CAMERA.height, CAMERA.width, 3)
    assert np.array_equal(picture, before)
    assert detection is not None
    for corner in detection.corners:
        x, y = np.rint(corner).astype(int)
        around = drawn[y - 8 : y + 9, x - 8 : x + 9].astype(int)
        assert np.ptp(around, axis=2).max() > 50  # colour in a grey picture
    empty = detector.annotated(np.dstack([picture] * 3), None)
    assert not np.array_equal(empty, np.dstack([picture] * 3))


@pytest.mark.parametrize("dictionary", ["DICT_9X9_1", "CORNER_REFINE_NONE", "4X4_50"])
def test_an_unknown_dictionary_is_refused(dictionary: str) -> None:
    with pytest.raises(ConfigError, match="dictionary"):
        CharucoGoalDetector(CAMERA, CharucoBoard(dictionary=dictionary))


def test_an_opencv_that_is_half_a_pixel_off_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cv2, "__version__", "4.10.0")
    with pytest.raises(MissingExtraError, match=r"OpenCV 4\.14 or later, not 4\.10\.0"):
        CharucoGoalDetector(CAMERA, BOARD)
