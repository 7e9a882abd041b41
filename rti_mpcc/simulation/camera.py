"""Camera pictures of a ChArUco board for the closed loop: perspective, lens, blur, exposure, noise.

The board's print is warped by the homography of its plane four times finer than the picture and averaged
down to it, as a sensor does: a board far away doesn't alias. Eq. (K1) to (K3) of `estimation.camera` give the
pinhole's homography, p being a point of the board's plane [m] and u_f a finer pixel of a window from u_0 on:

(K4)  p_camera = R' (Rz(phi) (A_2 (p - m) + b) + (x, y, 0) - c) = H (p, 1),  u ~ K H (p, 1),
(K5)  u_f = FINER (u - u_0 + 1/2) - 1/2,

x, y, phi the goal in the vehicle frame, A_2 the board's right and down. A distorting lens is a second warp,
of the finer picture.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import pi
from typing import Annotated, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from estimation import Camera, CharucoBoard
from estimation.camera import turn
from estimation.charuco import opencv, opencv_board
from geometry import Pose2
from geometry.settings import NonNegative, Positive, Settings
from rti_mpcc.types import Array

Image = NDArray[np.uint8]
Grey = NDArray[np.float32]

FINER = 4  # so many times finer than the picture the board is drawn before it is averaged
SQUARE_PIXELS = 128  # side of a square of the print [px]
NEAREST = 0.1  # a board with a corner nearer to the lens plane than this, or behind it, is not drawn [m]


class Optics(Settings):
    """The way of the light into the picture.

    Attributes:
        blur: standard deviation of the lens's blur [px].
        exposure: factor on the brightness; beyond 255 it is clipped.
        noise: standard deviation of a pixel [grey levels of 255]; border: white paper around the board
            [squares].
    """

    blur: NonNegative = 0.8
    exposure: Positive = 1.0
    noise: NonNegative = 4.0
    border: Annotated[float, Field(ge=0.0, le=5.0)] = 0.5


class _Print(NamedTuple):
    """A board as it is printed: grey and coverage (h, w, 2) with a border, from fine to coarse by halves."""

    board: CharucoBoard
    levels: tuple[Grey, ...]


class BoardCamera:
    """Takes grey pictures of a board by the true camera, board and optics.

    `random` draws the background once, and each picture's noise. `others`: boards of other docks with their
    poses in the world; a nearer board hides a farther one.
    """

    def __init__(
        self,
        camera: Camera,
        board: CharucoBoard,
        optics: Optics,
        random: np.random.Generator,
        others: Sequence[tuple[CharucoBoard, Pose2]] = (),
    ) -> None:
        self.camera, self.board, self.optics = camera, board, optics
        self._cv2: Any = opencv()
        self._random = random
        self._own = self._printed(board)
        self._others = [(self._printed(other), dock) for other, dock in others]
        self._round_about = round(2.0 * pi * camera.fx)
        once = surroundings(self._round_about, camera.height, random)
        self._surroundings = np.pad(once, ((0, 0), (0, camera.width)), mode="wrap")

    def expose(self, vehicle: Pose2, goal: Pose2) -> Image:
        """(height, width) picture taken from `vehicle` with the board at `goal`, both in the world."""
        # The surroundings are far away, so they only turn.
        first = round(-(vehicle.phi + self.camera.yaw) * self.camera.fx) % self._round_about
        picture = self._surroundings[:, first : first + self.camera.width].copy()
        seen = []
        for print_, dock in (*self._others, (self._own, goal)):
            homography = self._homography(print_.board, dock.relative_to(vehicle))
            if homography is not None:
                seen.append((homography, print_))
        for homography, print_ in sorted(seen, key=lambda each: -each[0][2, 2]):
            self._draw(picture, homography, print_)
        if self.optics.blur > 0.0:
            picture = self._cv2.GaussianBlur(picture, (0, 0), self.optics.blur)
        # In place: a picture is 5 MB, and making room for another one takes longer than the arithmetic.
        noise = self._random.standard_normal(picture.shape, dtype=np.float32)
        noise *= self.optics.noise
        picture *= self.optics.exposure
        picture += noise
        np.clip(np.rint(picture, out=picture), 0.0, 255.0, out=picture)
        return picture.astype(np.uint8)

    def _printed(self, board: CharucoBoard) -> _Print:
        border = round(self.optics.border * SQUARE_PIXELS)
        size = (board.columns * SQUARE_PIXELS, board.rows * SQUARE_PIXELS)
        face = np.pad(opencv_board(board).generateImage(size), border, constant_values=255)
        # Ink and paper of a real print are neither black nor white.
        grey = (20.0 + 200.0 / 255.0 * face).astype(np.float32)
        levels = [np.dstack([grey, np.ones_like(grey)])]
        while min(levels[-1].shape[:2]) >= 64:
            height, width = levels[-1].shape[:2]
            smaller = (width // 2, height // 2)
            levels.append(self._cv2.resize(levels[-1], smaller, interpolation=self._cv2.INTER_AREA))
        return _Print(board=board, levels=tuple(levels))

    def _homography(self, board: CharucoBoard, goal: Pose2) -> Array | None:
        """(3, 3) H of Eq. (K4), from the board's plane [m] to the camera; None if its face is not seen."""
        camera = self.camera
        plane = np.column_stack([board.axes[:, :2], np.zeros(3)])
        plane[:, 2] = board.middle - plane @ (*(0.5 * np.array(board.size)), 0.0)
        in_vehicle = turn(goal.phi) @ plane
        in_vehicle[:, 2] += (goal.x - camera.x, goal.y - camera.y, -camera.z)
        homography: Array = camera.rotation.T @ in_vehicle
        into_board = np.cross(homography[:, 0], homography[:, 1])
        depth = (homography @ self._outline(board, 2))[2]
        return homography if depth.min() > NEAREST and into_board @ homography[:, 2] > 0.0 else None

    def _outline(self, board: CharucoBoard, points: int) -> Array:
        """(3, 4 points) homogeneous coordinates along the paper's four sides [m]."""
        border, (width, height) = self.optics.border * board.square, board.size
        right, low = width + border, height + border
        corners = np.array([(-border, -border), (right, -border), (right, low), (-border, low)])
        paper = np.linspace(corners, np.roll(corners, -1, axis=0), points).reshape(-1, 2)
        return np.vstack([paper.T, np.ones(len(paper))])

    def _draw(self, picture: Grey, homography: Array, drawn: _Print) -> None:
        cv2, camera = self._cv2, self.camera
        outline = (homography @ self._outline(drawn.board, 20)).T
        pixels = camera.project(outline @ camera.rotation.T + camera.position)
        low = np.maximum(np.floor(pixels.min(axis=0)).astype(int) - 2, 0)
        high = np.minimum(np.ceil(pixels.max(axis=0)).astype(int) + 3, (camera.width, camera.height))
        width, height = (high - low).tolist()
        if width <= 0 or height <= 0:
            return
        warp = self._distorted if any(camera.distortion) else self._warped
        fine = warp(homography, low, width, height, drawn)
        coarse = cv2.resize(fine, (width, height), interpolation=cv2.INTER_AREA)
        window = picture[low[1] : high[1], low[0] : high[0]]
        window *= 1.0 - coarse[:, :, 1]
        window += coarse[:, :, 0]

    def _warped(self, homography: Array, low: Array, width: int, height: int, drawn: _Print) -> Grey:
        """(FINER height, FINER width, 2) of the pinhole's window that begins at pixel `low`, Eq. (K5)."""
        to_fine = np.array([[FINER, 0.0, 0.0], [0.0, FINER, 0.0], [0.0, 0.0, 1.0]])
        to_fine[:2, 2] = FINER * (0.5 - np.asarray(low)) - 0.5
        # The coarsest print whose pixels are not larger than the finer ones.
        pixel = homography[2, 2] / (FINER * self.camera.fx)
        step = drawn.board.square / SQUARE_PIXELS
        level = int(np.clip(np.floor(np.log2(max(pixel / step, 1.0))), 0, len(drawn.levels) - 1))
        step *= 2.0**level
        first = 0.5 * step - self.optics.border * drawn.board.square
        to_board = np.array([[step, 0.0, first], [0.0, step, first], [0.0, 0.0, 1.0]])
        fine: Grey = self._cv2.warpPerspective(
            drawn.levels[level],
            to_fine @ self.camera.matrix @ homography @ to_board,
            (FINER * width, FINER * height),
        )
        return fine

    def _distorted(self, homography: Array, low: Array, width: int, height: int, drawn: _Print) -> Grey:
        """As `_warped`, through the lens: each pixel takes what the pinhole has where its ray comes from."""
        cv2, matrix = self._cv2, self.camera.matrix
        across, down = np.meshgrid(np.arange(low[0], low[0] + width), np.arange(low[1], low[1] + height))
        seen = np.column_stack([across.ravel(), down.ravel()]).astype(np.float64)[:, None]
        ideal = cv2.undistortPoints(seen, matrix, np.array(self.camera.distortion), P=matrix)[:, 0]
        first = np.floor(ideal.min(axis=0)).astype(int) - 1
        last = np.ceil(ideal.max(axis=0)).astype(int) + 2
        wide, high = (last - first).tolist()
        fine = self._warped(homography, first, wide, high, drawn)
        where = (FINER * (ideal - first + 0.5) - 0.5).reshape(height, width, 2).astype(np.float32)
        where = cv2.resize(where, (FINER * width, FINER * height), interpolation=cv2.INTER_LINEAR)
        found: Grey = cv2.remap(fine, where, None, cv2.INTER_LINEAR)
        return found


def surroundings(width: int, height: int, random: np.random.Generator) -> Grey:
    """(height, width) of a wall above a floor, with boxes before it, grain on it and uneven light."""
    picture = np.full((height, width), 120.0, np.float32)
    picture[int(0.55 * height) :] = 85.0
    for _ in range(width // 40):
        left, wide = int(random.integers(width)), int(random.integers(20, 160))
        top, tall = int(random.integers(int(0.8 * height))), int(random.integers(20, height // 3))
        picture[top : top + tall, left : left + wide] = random.uniform(30.0, 200.0)
    picture += 6.0 * random.standard_normal((height, width), dtype=np.float32)
    picture *= (1.0 + 0.15 * np.sin(np.arange(width) * (2.0 * pi * 3.0 / width))).astype(np.float32)
    return picture
