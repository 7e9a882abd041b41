"""Animations of a ride, or of several side by side at the same time, as GIF or MP4."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from math import ceil
from pathlib import Path
from subprocess import CalledProcessError
from typing import Any

import numpy as np
from matplotlib.animation import FFMpegWriter
from matplotlib.artist import Artist
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_rgba_array
from matplotlib.figure import Figure
from numpy.typing import NDArray
from PIL import Image

from rti_mpcc.errors import InputError
from rti_mpcc.report import draw
from rti_mpcc.report.ride import Ride
from rti_mpcc.report.scene import CameraView, Scene, WeightBars

Picture = NDArray[np.uint8]
Progress = Callable[[float, float], None]

RATE = 10  # pictures a second
MOST = 500
"""Largest number of pictures: rides up to 50 s are shown at their speed, others 2, 3, ... times as
fast. Pillow holds all pictures of a GIF until it is written."""
HELD = 15  # number of times that the last picture is shown
DPI = 100  # resolution [dots/inch]
_ABREAST = 3  # largest number of scenes in a row
_WIDEST, _ALL, _HIGHEST, _CAMERA = 7.5, 15.0, 6.0, 5.4
"""Bounds on the widths of a scene and a row of scenes, the height of a scene; the camera's width [inch]."""
_BARS, _LABELS, _LEGEND, _ENTRY = 0.9, 1.5, 0.8, 1.75
"""Heights of the weights, of all labels of a scene, and of the legend; width of an entry of it [inch]."""


def animation_file(given: Path | None, folder: Path) -> Path:
    """The file to write: the one asked for, or animation.mp4 in `folder`, .gif where there is no ffmpeg.

    Raises InputError for a suffix that is neither, or .mp4 without ffmpeg.
    """
    ffmpeg = bool(FFMpegWriter.isAvailable())
    file = given or folder / ("animation.mp4" if ffmpeg else "animation.gif")
    if file.suffix.lower() not in (".mp4", ".gif"):
        raise InputError(f"{file}: an animation must end in .mp4 or .gif")
    if file.suffix.lower() == ".mp4" and not ffmpeg:
        raise InputError(f"{file}: .mp4 needs the program ffmpeg, which is not installed; .gif needs nothing")
    return file


def write_animation(rides: Sequence[Ride], file: Path, *, progress: Progress | None = None) -> None:
    """Write an animation of rides with moments, as .mp4 or .gif, all at the same time.

    `progress` is called for each picture with the shown time and the last one [s]. Raises InputError as
    `animation_file` and if ffmpeg fails, OSError.
    """
    file = animation_file(file, file.parent)
    shown = pictures(rides, picture_times(rides), progress=progress)
    if file.suffix.lower() == ".mp4":
        _write_mp4(shown, file)
        return
    # One palette for all, shades of the colours of `draw`: with one for each picture they flicker. The
    # palest is not too near white: Pillow would take the paper for it.
    full, shares = 255.0 * to_rgba_array(draw.COLORS)[:, :3], np.linspace(0.1, 1.0, 31)[:, None, None]
    shades = np.concatenate([[[255.0] * 3], (shares * full + (1.0 - shares) * 255.0).reshape(-1, 3)])
    palette = Image.new("P", (1, 1))
    palette.putpalette(shades.round().astype(np.uint8).tobytes())
    frames = (
        Image.fromarray(each).convert("RGB").quantize(palette=palette, dither=Image.Dither.NONE)
        for each in shown
    )
    next(frames).save(file, save_all=True, append_images=frames, duration=1000 // RATE, loop=0)


def picture_times(rides: Sequence[Ride]) -> list[float]:
    """Times of the pictures [s], at most `MOST` and `HELD` times the last one, at the end or after it."""
    start = min(ride.moments[0].time for ride in rides)
    end = max(ride.moments[-1].time for ride in rides)
    count = ceil(RATE * (end - start) - 1e-6)
    every = max(1, ceil(count / (MOST - 1)))
    last = ceil(count / every)
    return [start + min(k, last) * every / RATE for k in range(last + HELD)]


def pictures(
    rides: Sequence[Ride], times: Sequence[float], *, progress: Progress | None = None
) -> Iterator[Picture]:
    """The pictures (height, width, 4), RGBA, at these times [s]."""
    stage = Stage(rides)
    canvas: Any = FigureCanvasAgg(stage.figure)  # its stub has no types
    for artist in stage.moving:
        artist.set_animated(True)
    canvas.draw()  # the layout needs the tick labels of the final size
    canvas.draw()
    still = canvas.copy_from_bbox(stage.figure.bbox)
    for time in times:
        stage.show(time)
        canvas.restore_region(still)
        for artist in stage.moving:
            stage.figure.draw_artist(artist)
        yield np.array(canvas.buffer_rgba())
        if progress is not None:
            progress(time, times[-1])


class Stage:
    """The figure of an animation: a scene for each ride, weights below and the camera's picture beside it.

    `moving` are the artists that change, in the order in which they are drawn.
    """

    def __init__(self, rides: Sequence[Ride]) -> None:
        self.figure = Figure(dpi=DPI, layout="constrained")
        rows, beside = ceil(len(rides) / _ABREAST), any(ride.frames for ride in rides)
        abreast = ceil(len(rides) / rows)
        wide = min(_WIDEST, _ALL / abreast)
        grid = self.figure.add_gridspec(2 * rows, abreast * (1 + beside))
        grid.set_width_ratios([wide, _CAMERA][: 1 + beside] * abreast)
        largest = max(max(moment.weights) for ride in rides for moment in ride.moments)
        self.scenes, self.bars, self.cameras = list[Scene](), list[WeightBars](), list[CameraView | None]()
        for place, ride in enumerate(rides):
            row, column = 2 * (place // abreast), (1 + beside) * (place % abreast)
            self.scenes.append(Scene(self.figure.add_subplot(grid[row, column]), ride))
            self.bars.append(WeightBars(self.figure.add_subplot(grid[row + 1, column]), largest))
            camera = self.figure.add_subplot(grid[row, column + 1]) if ride.frames else None
            self.cameras.append(None if camera is None else CameraView(camera, ride.frames))
        views = [(np.ptp(scene.axes.get_xlim()), np.ptp(scene.axes.get_ylim())) for scene in self.scenes]
        high = float(min(_HIGHEST, (wide - _LABELS) * max(tall / across for across, tall in views)))
        grid.set_height_ratios([high, _BARS] * rows)
        shown = [each for each in (*self.scenes, *self.bars, *self.cameras) if each is not None]
        self.moving: list[Artist] = [artist for each in shown for artist in each.moving]
        width, height = abreast * (wide + _CAMERA * beside), rows * (high + _BARS + _LABELS) + _LEGEND
        # MP4 needs an even number of dots.
        self.figure.set_size_inches(2 * ceil(0.5 * DPI * width) / DPI, 2 * ceil(0.5 * DPI * height) / DPI)
        handles, labels = draw.entries_once(scene.axes for scene in self.scenes)
        look = {"ncols": max(1, int(width / _ENTRY)), "frameon": False, "fontsize": "small"}
        self.figure.legend(handles, labels, loc="outside lower center", **look)

    def show(self, time: float) -> None:
        """Show each ride at this time [s]."""
        for scene, bars, camera in zip(self.scenes, self.bars, self.cameras, strict=True):
            index = scene.ride.at(time)
            scene.show(index)
            bars.show(scene.ride.moments[index])
            if camera is not None:
                camera.show(time)


def _write_mp4(shown: Iterator[Picture], file: Path) -> None:
    first = next(shown)
    height, width = first.shape[:2]
    screen = Figure(figsize=(width / DPI, height / DPI), dpi=DPI)
    image = screen.figimage(first)
    writer = FFMpegWriter(fps=RATE, metadata={"title": file.stem})
    try:
        with writer.saving(screen, str(file), DPI):
            writer.grab_frame()
            for picture in shown:
                image.set_data(picture)
                writer.grab_frame()
    except (CalledProcessError, BrokenPipeError) as error:
        raise InputError(f"{file}: ffmpeg could not write it ({error}); .gif does without") from error
