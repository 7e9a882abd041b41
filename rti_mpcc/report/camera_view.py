"""The picture of a camera beside a film."""

from __future__ import annotations

from bisect import bisect_right
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes

from rti_mpcc.report.camera_frames import Frame

_GREY = 200
"""Of the picture before the first one."""


class CameraView:
    """The last picture at each time, on axes of its own.

    Args:
        axes: to draw on; frames: at least one, in order of time.
    """

    def __init__(self, axes: Axes, frames: tuple[Frame, ...]) -> None:
        self._frames = frames
        self._blank = np.full_like(frames[0].picture, _GREY)
        self._shown: Frame | None = None
        axes.set_axis_off()
        axes.set_title("camera")
        self._image = axes.imshow(self._blank)
        place: dict[str, Any] = {"transform": axes.transAxes, "ha": "center", "va": "center"}
        self._word = axes.text(0.5, 0.5, "no picture yet", **place)

    @property
    def moving(self) -> list[Artist]:
        """What changes."""
        return [self._image, self._word]

    def show(self, time: float) -> None:
        """Show the last picture at this time [s]."""
        place = bisect_right(self._frames, time, key=lambda frame: frame.stamp) - 1
        last = None if place < 0 else self._frames[place]
        if last is not self._shown:
            self._shown = last
            self._image.set_data(self._blank if last is None else last.picture)
        self._word.set_text("no picture yet" if last is None else "")
