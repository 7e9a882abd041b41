"""The goal's pose in a camera picture of a ChArUco board. Needs OpenCV: pip install '.[vision]' in the clone.

OpenCV's `CharucoDetector` finds the corners between the squares, `solvePnPGeneric` (IPPE) gives the two poses
that a flat board can be seen in, and `fit_board` makes of them the goal's pose with its covariance.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import atan2
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from estimation.board_pose import BoardPose, fit_board
from estimation.camera import Camera, CharucoBoard, turn
from estimation.measurement import Frame, GoalMeasurement
from estimation.types import Array
from geometry.errors import ConfigError, check_extra, missing_extra
from geometry.validation import validated

Image = NDArray[np.uint8]
Ids = NDArray[np.int32]

OLDEST = (4, 14)
"""Until then OpenCV gave corners 0.5 px too far to the right and too low, and missed boards seen in part."""
FEWEST_CORNERS = 6
"""With fewer corners a board is not believed."""
LARGEST_ERROR = 2.0
"""Corners that miss the best pose by more in the root mean square [px] are no board."""
FARTHEST_OFF = 5.0
"""So many times the median residual a single corner may be off; one that is farther was misread."""
GREEN, ORANGE, BLUE, RED = (80, 200, 80), (0, 140, 255), (255, 120, 0), (40, 40, 230)


def opencv() -> ModuleType:
    """OpenCV with its aruco module; loaded at the first call. Raises MissingExtraError without it."""
    need = "detecting a ChArUco board needs"
    check_extra("vision", need, "cv2")
    import cv2

    if tuple(map(int, cv2.__version__.split(".")[:2])) < OLDEST:
        least = ".".join(map(str, OLDEST))
        raise missing_extra("vision", f"{need} OpenCV {least} or later, not {cv2.__version__}")
    return cv2


def opencv_board(board: CharucoBoard) -> Any:
    """The board as OpenCV knows it. Raises ConfigError for a dictionary that is unknown or too small."""
    aruco = opencv().aruco
    number = getattr(aruco, board.dictionary, None) if board.dictionary.startswith("DICT_") else None
    if not isinstance(number, int):
        raise ConfigError(f"CharucoBoard.dictionary = {board.dictionary!r}: not one of OpenCV's")
    dictionary = aruco.getPredefinedDictionary(number)
    needed = board.markers.stop
    if len(dictionary.bytesList) < needed:
        raise ConfigError(f"CharucoBoard.dictionary = {board.dictionary!r}: the board needs {needed} markers")
    markers = np.array(board.markers, dtype=np.int32)
    return aruco.CharucoBoard((board.columns, board.rows), board.square, board.marker, dictionary, markers)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CharucoDetection:
    """The board found in one picture.

    Attributes:
        measurement: the goal's pose in the vehicle frame, with its covariance.
        corners: (n, 2) [px]; ids: (n,) of them.
        residuals: (n, 2) corner seen minus corner expected [px].
    """

    measurement: GoalMeasurement
    corners: Array
    ids: Ids
    residuals: Array

    @property
    def reprojection_error(self) -> float:
        """Root mean square of the corners' distances to where they are expected [px]."""
        return float(np.sqrt(np.mean(np.sum(self.residuals**2, axis=1))))


class CharucoGoalDetector:
    """Finds the goal in pictures of a camera. Raises MissingExtraError where OpenCV is not installed.

    Args:
        camera: that takes the pictures; board: that stands at the goal.
    """

    @validated()
    def __init__(self, camera: Camera, board: CharucoBoard) -> None:
        self.camera, self.board = camera, board
        self._cv2: Any = opencv()
        printed = opencv_board(board)
        self._detector: Any = self._cv2.aruco.CharucoDetector(printed)
        self._detector.setDetectorParameters(self._reading())
        self._flat = np.asarray(printed.getChessboardCorners(), dtype=np.float64).reshape(-1, 3)[:, :2]
        self._corners = board.in_goal_frame(self._flat)
        self._distortion = np.array(camera.distortion)

    @validated(late=True)
    def detect(self, image: Image, stamp: float) -> CharucoDetection | None:
        """The goal in a picture exposed at `stamp` [s], or None.

        Args:
            image: (height, width) grey or (height, width, 3) blue, green, red. One of another size than the
                camera's, or without a usable board, gives None.
        """
        found = self._find(image)
        posed = found and self._posed(*found)
        if not posed:
            return None
        pose, corners, ids = posed
        x, y, phi = pose.value.tolist()
        measurement = GoalMeasurement(
            stamp=stamp, x=x, y=y, phi=phi, covariance=pose.covariance, frame=Frame.VEHICLE
        )
        return CharucoDetection(measurement=measurement, corners=corners, ids=ids, residuals=pose.residuals)

    @validated(late=True)
    def annotated(self, image: Image, detection: CharucoDetection | None) -> Image:
        """(height, width, 3) copy of a picture with corners, the board's axes and the goal's pose on it."""
        cv2 = self._cv2
        canvas: Image = image.copy()
        if canvas.ndim == 2 or canvas.shape[2] == 1:
            canvas = cv2.cvtColor(canvas, cv2.COLOR_GRAY2BGR)
        if detection is None:
            self._write(canvas, ["no board"])
            return canvas
        for corner in detection.corners:
            cv2.circle(canvas, tuple(np.rint(corner).astype(int).tolist()), 5, GREEN, 2, cv2.LINE_AA)
        # The board's middle, and two squares from there: right, down and along its normal.
        m, axes = detection.measurement, 2.0 * self.board.square * self.board.axes.T * [[1.0], [1.0], [-1.0]]
        in_goal = self.board.middle + np.vstack([np.zeros(3), axes])
        points = in_goal @ turn(m.phi).T + np.array([m.x, m.y, 0.0])
        seen = self.camera.seen(points)
        if seen[:, 2].min() > 0.0:
            middle, *tips = np.rint(self.camera.project(points)).astype(int).tolist()
            for tip, colour in zip(tips, (RED, GREEN, BLUE), strict=True):
                cv2.line(canvas, tuple(middle), tuple(tip), colour, 3, cv2.LINE_AA)
        away = float(np.linalg.norm(seen[0]))
        std, error = np.sqrt(np.diag(np.asarray(m.covariance))), detection.reprojection_error
        lines = [
            f"goal from rear axle: x {m.x:.3f} m, y {m.y:.3f} m, heading {np.degrees(m.phi):.2f} deg",
            f"std: {1e3 * std[0]:.1f} mm, {1e3 * std[1]:.1f} mm, {np.degrees(std[2]):.2f} deg",
            f"board {away:.2f} m away, {len(detection.ids)} corners, reprojection error {error:.2f} px",
        ]
        self._write(canvas, lines)
        return canvas

    def _reading(self) -> Any:
        """How markers are read. Far away a bit is 2 px wide, and blur reaches into it from its neighbours.

        OpenCV's defaults lose markers below 4 px a bit. Sampled finer, without the bits' margins, and with
        all the errors corrected that the dictionary allows for, they are read down to 2 px.
        """
        parameters = self._cv2.aruco.DetectorParameters()
        parameters.perspectiveRemovePixelPerCell = 8
        parameters.perspectiveRemoveIgnoredMarginPerCell = 0.3
        parameters.errorCorrectionRate = 1.0
        # The default ends the search for a corner at a step of 0.1 px, where neighbours are off together.
        parameters.cornerRefinementMinAccuracy = 0.002
        parameters.cornerRefinementMaxIterations = 60
        return parameters

    def _find(self, image: Image) -> tuple[Array, Ids] | None:
        size = (self.camera.height, self.camera.width)
        if image.shape not in (size, (*size, 1), (*size, 3)) or image.dtype != np.uint8:
            return None
        try:
            corners, ids, _, _ = self._detector.detectBoard(np.ascontiguousarray(image))
        except self._cv2.error:
            # OpenCV asserts here and there on what it did not expect to find; that is no board.
            return None
        if corners is None or ids is None:
            return None
        # (n, 1, 2) before OpenCV 5
        return np.asarray(corners, dtype=np.float64).reshape(-1, 2), np.asarray(ids, dtype=np.int32).ravel()

    def _posed(self, corners: Array, ids: Ids, *, again: bool = True) -> tuple[BoardPose, Array, Ids] | None:
        """The goal's pose and the corners that it is made of, which are not those misread; or None."""
        flat = self._flat[ids]
        if len(ids) < FEWEST_CORNERS:
            return None
        spread = np.linalg.svd(flat - flat.mean(axis=0), compute_uv=False)[1]
        pose = self._fit(corners, ids) if spread > 0.5 * self.board.square else None
        if pose is None:
            return None
        errors = np.hypot(*pose.residuals.T)
        good = errors <= FARTHEST_OFF * max(float(np.median(errors)), self.camera.corner_std)
        if again and not good.all():
            return self._posed(corners[good], ids[good], again=False)
        return (pose, corners, ids) if float(np.sqrt(np.mean(errors**2))) <= LARGEST_ERROR else None

    def _fit(self, corners: Array, ids: Ids) -> BoardPose | None:
        cv2, matrix = self._cv2, self.camera.matrix
        flat = np.column_stack([self._flat[ids], np.zeros(len(ids))])
        try:
            # without distortion, in pixels
            pixels = cv2.undistortPoints(corners[:, None, :], matrix, self._distortion, P=matrix)[:, 0]
            _, turns, ways, _ = cv2.solvePnPGeneric(flat, pixels, matrix, None, flags=cv2.SOLVEPNP_IPPE)
        except cv2.error:
            return None
        turned = [cv2.Rodrigues(each)[0] for each in turns]
        starts = [self._goal(each, way.ravel()) for each, way in zip(turned, ways, strict=True)]
        return fit_board(self.camera, self._corners[ids], pixels, [s for s in starts if np.isfinite(s).all()])

    def _goal(self, turned: Array, way: Array) -> Array:
        """(3,) x, y, phi of the goal if the board is turned (3, 3) and moved (3,) into the camera frame."""
        board, camera = self.board, self.camera
        middle = turned @ (*(0.5 * np.array(board.size)), 0.0) + way
        normal = -camera.rotation @ turned[:, 2]
        phi = atan2(normal[1], normal[0]) - board.yaw
        at = camera.rotation @ middle + camera.position - turn(phi) @ board.middle
        return np.array([at[0], at[1], phi])

    def _write(self, canvas: Image, lines: list[str]) -> None:
        for row, line in enumerate(lines):
            at = (20, 40 + 34 * row)
            for colour, thickness in ((0, 0, 0), 5), ((255, 255, 255), 2):
                style = self._cv2.FONT_HERSHEY_SIMPLEX, 0.9, colour, thickness, self._cv2.LINE_AA
                self._cv2.putText(canvas, line, at, *style)
