"""What the camera of a run saw: its pictures, with what was detected on them, small enough to be kept."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from estimation import CharucoDetection, CharucoGoalDetector
from estimation.charuco import opencv
from rti_mpcc.simulation import CameraSection
from rti_mpcc.simulation.camera import Image

WIDTH = 560
"""Of the kept pictures [px]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Frame:
    """A picture of a camera, compressed: a run has some hundred.

    Attributes:
        stamp: when it was taken [s].
        jpeg: the picture as a file.
        found: whether the controller is told of the board in it.
    """

    stamp: float
    jpeg: bytes
    found: bool

    @property
    def picture(self) -> Image:
        """(height, width, 3), red, green, blue."""
        cv2: Any = opencv()
        decoded: Image = cv2.imdecode(np.frombuffer(self.jpeg, np.uint8), cv2.IMREAD_COLOR)
        return decoded[..., ::-1]


@dataclass(slots=True)
class CameraFrames:
    """Keeps the pictures of a run; to be given to `simulate` as `seen`. Needs OpenCV.

    Args:
        section: the scenario's camera.
    """

    section: CameraSection
    frames: list[Frame] = field(default_factory=list, init=False)
    _eye: CharucoGoalDetector = field(init=False)

    def __post_init__(self) -> None:
        self._eye = CharucoGoalDetector(self.section.mount, self.section.board)

    def __call__(self, stamp: float, picture: Image, detection: CharucoDetection | None) -> None:
        """Keep a picture."""
        cv2: Any = opencv()
        drawn = self._eye.annotated(picture, detection)
        height, width = drawn.shape[:2]
        small = cv2.resize(drawn, (WIDTH, round(WIDTH * height / width)), interpolation=cv2.INTER_AREA)
        jpeg = cv2.imencode(".jpg", small)[1].tobytes()
        self.frames.append(Frame(stamp=stamp, jpeg=jpeg, found=detection is not None))
