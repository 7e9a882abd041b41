"""What the camera of a run saw: its pictures, with what was detected on them, small enough to be kept."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from estimation import CharucoDetection, CharucoGoalDetector
from estimation.charuco import opencv
from rti_mpcc.simulation.camera import Image
from rti_mpcc.simulation.scenario_camera import CameraSection

WIDTH = 560
"""Of the kept pictures [px]."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Frame:
    """A picture (height, width, 3), red, green, blue; when it was taken [s]; whether the board was found."""

    stamp: float
    picture: Image
    found: bool


@dataclass(slots=True)
class CameraFrames:
    """Keeps the pictures of a run; to be given to `simulate` as `seen`.

    Args:
        section: the scenario's camera.
    """

    section: CameraSection
    frames: list[Frame] = field(default_factory=list)

    def __call__(self, stamp: float, picture: Image, detection: CharucoDetection | None) -> None:
        """Keep a picture."""
        cv2: Any = opencv()
        eye = CharucoGoalDetector(self.section.mount, self.section.board)
        drawn = eye.annotated(picture, detection)
        height, width = drawn.shape[:2]
        small = cv2.resize(drawn, (WIDTH, round(WIDTH * height / width)), interpolation=cv2.INTER_AREA)
        self.frames.append(Frame(stamp=stamp, picture=small[..., ::-1].copy(), found=detection is not None))
