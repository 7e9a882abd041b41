"""A camera on the vehicle and a board at the dock: where a point of the board appears in the image.

Vehicle frame: origin on the ground below the middle of the rear axle, x forward, y left, z up. Camera frame:
origin in the optical centre, z into the picture, x right, y down. Goal frame: the vehicle frame of the docked
vehicle. With yaw psi, pitch theta and roll rho of the camera, and A the axes of one that looks ahead,

(K1)  p_vehicle = R p_camera + c,  R = Rz(psi) Ry(theta) Rx(rho) A,  A = [[0, 0, 1], [-1, 0, 0], [0, -1, 0]],
(K2)  u = fx X'/Z' + cx,  v = fy Y'/Z' + cy,  (X', Y', Z') being p_camera distorted by the lens (Brown),
(K3)  p_goal = b + (right, down, -normal) (p_board - m),  normal = (cos nu, sin nu, 0),  down = (0, 0, -1),

c the optical centre, b the board's middle in the goal frame, m the same in the board's own frame (origin in
its upper left corner, x right, y down, as seen by who reads it), nu the yaw of its normal.
"""

from __future__ import annotations

import re
from math import cos, pi, sin
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike
from pydantic import Field, model_validator

from estimation.types import Array
from geometry import InputError
from geometry.settings import Positive, Settings
from geometry.validation import to_rows, validated

Pixels = Annotated[int, Field(ge=16, le=20000)]
Metres = Annotated[float, Field(ge=-1e3, le=1e3)]
Angle = Annotated[float, Field(ge=-2.0 * pi, le=2.0 * pi)]
Squares = Annotated[int, Field(ge=3, le=100)]
Marker = Annotated[int, Field(ge=0, le=10_000)]
Std = Annotated[float, Field(gt=0.0, le=1.0)]
_FAMILY = re.compile(r"^(?P<family>DICT_\dX\d)_(?P<size>\d+)$")
"""Names of dictionaries of which a larger one begins with all markers of the smaller ones of its family."""


class Camera(Settings):
    """A camera: what its lens does and how it sits on the vehicle. The default looks back from the bumper.

    Attributes:
        width, height: of the image [px].
        fx, fy: focal lengths [px]; cx, cy: principal point [px], pixel centres at whole numbers.
        distortion: k1, k2, p1, p2, k3, as OpenCV's calibration gives them.
        x, y, z: optical centre in the vehicle frame [m].
        yaw: of the optical axis, 0 ahead, pi backwards [rad]; pitch: positive looks down [rad]; roll: about
            the optical axis, clockwise to who looks along it [rad].
        corner_std: least standard deviation of a corner's pixel coordinates that is believed, for what the
            calibration leaves [px].
        height_std: how well the height between camera and board is known [m].
        tilt_std: how well roll and pitch of the vehicle against the ground at the board are known, springs
            and slopes included [rad].
    """

    width: Pixels = 1280
    height: Pixels = 960
    fx: Positive = 950.0
    fy: Positive = 950.0
    cx: float = 639.5
    cy: float = 479.5
    distortion: tuple[float, float, float, float, float] = (0.0, 0.0, 0.0, 0.0, 0.0)
    x: Metres = -0.7
    y: Metres = 0.0
    z: Metres = 1.0
    yaw: Angle = pi
    pitch: Angle = 0.0
    roll: Angle = 0.0
    corner_std: Std = 0.05
    height_std: Std = 0.01
    tilt_std: Std = 0.005

    @property
    def matrix(self) -> Array:
        """(3, 3) intrinsic matrix [px]."""
        return np.array([[self.fx, 0.0, self.cx], [0.0, self.fy, self.cy], [0.0, 0.0, 1.0]])

    @property
    def position(self) -> Array:
        """(3,) optical centre c in the vehicle frame [m]."""
        return np.array([self.x, self.y, self.z])

    @property
    def rotation(self) -> Array:
        """(3, 3) R of Eq. (K1): its columns are the camera's axes in the vehicle frame."""
        c, s = cos(self.pitch), sin(self.pitch)
        pitched = np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
        k, w = cos(self.roll), sin(self.roll)
        rolled = np.array([[1.0, 0.0, 0.0], [0.0, k, -w], [0.0, w, k]])
        ahead = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
        rotation: Array = turn(self.yaw) @ pitched @ rolled @ ahead
        return rotation

    @validated()
    def seen(self, points: ArrayLike) -> Array:
        """(n, 3) points of the vehicle frame [m] in the camera frame [m], Eq. (K1)."""
        return (to_rows(points, 3, "points") - self.position) @ self.rotation

    @validated()
    def project(self, points: ArrayLike) -> Array:
        """(n, 2) pixels of (n, 3) vehicle frame points [m], Eq. (K2). Raises InputError if one is behind."""
        seen = self.seen(points)
        if np.any(seen[:, 2] <= 0.0):
            raise InputError("points: every one must lie before the camera")
        x, y = (seen[:, :2] / seen[:, 2:]).T
        k1, k2, p1, p2, k3 = self.distortion
        r2 = x**2 + y**2
        radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
        across = x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x**2)
        down = y * radial + p1 * (r2 + 2.0 * y**2) + 2.0 * p2 * x * y
        return np.column_stack([self.fx * across + self.cx, self.fy * down + self.cy])


class CharucoBoard(Settings):
    """A ChArUco board, upright at the dock: what is printed on it and where it stands.

    Attributes:
        columns, rows: of squares.
        square, marker: side of a square and of the marker in every white one [m].
        dictionary: name of the markers' dictionary, as in OpenCV; first_marker: number of its first marker in
            that. Boards that can be seen together need markers of their own: one with the same cannot be told
            from this one.
        x, y, z: the board's middle in the goal frame [m].
        yaw: of its normal in the goal frame, 0 points the way that the docked vehicle faces [rad].
    """

    columns: Squares = 5
    rows: Squares = 4
    square: Positive = 0.2
    marker: Positive = 0.14
    dictionary: str = "DICT_4X4_50"
    first_marker: Marker = 0
    x: Metres = -2.6
    y: Metres = 0.0
    z: Metres = 0.7
    yaw: Angle = 0.0

    @model_validator(mode="after")
    def _marker_fits(self) -> CharucoBoard:
        if self.marker >= self.square:
            raise ValueError(f"marker = {self.marker}: must be smaller than square = {self.square}")
        return self

    @property
    def markers(self) -> range:
        """Numbers of its markers in the dictionary: one in every white square."""
        return range(self.first_marker, self.first_marker + self.columns * self.rows // 2)

    @property
    def dictionary_size(self) -> int | None:
        """Number of markers of its dictionary; None where its name does not tell."""
        found = _FAMILY.fullmatch(self.dictionary)
        return None if found is None else int(found["size"])

    @validated()
    def shares_markers(self, other: CharucoBoard) -> bool:
        """Whether both have a marker, so that one board can be taken for the other."""
        mine, theirs = (_FAMILY.sub(r"\g<family>", board.dictionary) for board in (self, other))
        begin = max(self.markers.start, other.markers.start)
        return mine == theirs and begin < min(self.markers.stop, other.markers.stop)

    @property
    def size(self) -> tuple[float, float]:
        """Width and height [m]."""
        return self.columns * self.square, self.rows * self.square

    @property
    def middle(self) -> Array:
        """(3,) b of Eq. (K3): the board's middle in the goal frame [m]."""
        return np.array([self.x, self.y, self.z])

    @property
    def axes(self) -> Array:
        """(3, 3) of Eq. (K3): columns right, down, and into the board, in the goal frame."""
        c, s = cos(self.yaw), sin(self.yaw)
        return np.array([[-s, 0.0, -c], [c, 0.0, -s], [0.0, -1.0, 0.0]])

    @validated()
    def in_goal_frame(self, points: ArrayLike) -> Array:
        """(n, 3) in the goal frame of (n, 2) points of the board, right and down from its corner [m]."""
        flat = to_rows(points, 2, "points") - 0.5 * np.array(self.size)
        placed: Array = flat @ self.axes[:, :2].T + self.middle
        return placed


def turn(angle: float) -> Array:
    """(3, 3) rotation about the vertical axis by `angle` [rad]."""
    c, s = cos(angle), sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
