"""Pictures of a camera for the tests of films."""

from __future__ import annotations

import cv2
import numpy as np

from rti_mpcc.report.camera_frames import Frame


def grey_frame(stamp: float, grey: int) -> Frame:
    """A small picture in one grey."""
    picture = np.full((6, 8, 3), grey, dtype=np.uint8)
    return Frame(stamp=stamp, jpeg=cv2.imencode(".jpg", picture)[1].tobytes(), found=False)
