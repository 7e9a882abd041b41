"""The picture of a camera beside a film."""

from __future__ import annotations

from typing import Any

from matplotlib.artist import Artist
from matplotlib.axes import Axes

from rti_mpcc.report.camera_frames import Frame


class CameraView:
    """The last picture at each time, on axes of its own.

    Args:
        axes: to draw on; frames: at least one, in order of time.
    """

    def __init__(self, axes: Axes, frames: tuple[Frame, ...]) -> None:
        self._frames = frames
        blank = frames[0].picture.copy()
        blank[:] = 200
        self._blank = blank
        axes.set_axis_off()
        axes.set_title("rear camera")
        self._image = axes.imshow(blank)
        place: dict[str, Any] = {"transform": axes.transAxes, "ha": "center", "va": "center"}
        self._word = axes.text(0.5, 0.5, "no picture yet", **place)

    @property
    def moving(self) -> list[Artist]:
        """What changes."""
        return [self._image, self._word]

    def show(self, time: float) -> None:
        """Show the last picture at this time [s]."""
        before = [frame for frame in self._frames if frame.stamp <= time]
        self._image.set_data(before[-1].picture if before else self._blank)
        self._word.set_text("" if before else "no picture yet")
