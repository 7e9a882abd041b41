"""Moving pictures of a run, or of several side by side at the same time, as GIF or MP4."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from math import ceil
from pathlib import Path
from subprocess import CalledProcessError
from typing import Any

import numpy as np
from matplotlib.animation import FFMpegWriter
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_rgba_array
from matplotlib.figure import Figure
from numpy.typing import NDArray
from PIL import Image

from rti_mpcc.errors import InputError
from rti_mpcc.report import style
from rti_mpcc.report.axes import entries_once
from rti_mpcc.report.bars import WeightBars
from rti_mpcc.report.camera_frames import Frame
from rti_mpcc.report.camera_view import CameraView
from rti_mpcc.report.film import Film, film_of_run
from rti_mpcc.report.overlay import Overlay
from rti_mpcc.report.scene import Scene, extent
from rti_mpcc.report.views import CycleView, ObservedCycle
from rti_mpcc.simulation import RunResult

Picture = NDArray[np.uint8]
Progress = Callable[[float, float], None]

RATE = 10
"""Pictures a second."""
MOST = 500
"""Of longer runs so many pictures at most: up to 50 s they are shown at their speed, then 2, 3, ... times as
fast. Pillow holds all pictures of a GIF until it is written."""
HELD = 15
"""So often the last picture is shown."""
DPI = 100
"""Resolution [dots/inch]."""
_ABREAST = 3
"""So many scenes at most stand in a row."""
_WIDEST, _ALL, _HIGHEST = 6.5, 13.0, 6.0
"""Bounds on the size of one scene, and on the width of a row together [inch]."""
_LEFT, _RIGHT, _TOP = 1.45, 0.3, 0.7
"""Room beside and above each scene [inch]."""
_GAP, _BARS, _UNDER, _LEGEND = 0.65, 0.85, 0.6, 0.4
"""Below a scene: axis labels, bars, their labels; below all: the legend [inch]."""
_CAMERA = 5.4
"""Width of the camera's picture beside a scene [inch]."""
_ENTRY = 1.75
"""Width of an entry of the legend [inch]."""
_SHADES, _PALEST = 31, 0.1
"""Of each colour in a GIF, and the share that it has of the palest."""


def animation_file(asked: Path | None, folder: Path) -> Path:
    """The file to write: the one asked for, or animation.mp4 in `folder`, .gif where there is no ffmpeg.

    Raises InputError for a suffix that is neither, or .mp4 without ffmpeg.
    """
    ffmpeg = bool(FFMpegWriter.isAvailable())
    file = folder / ("animation.mp4" if ffmpeg else "animation.gif") if asked is None else asked
    if file.suffix.lower() not in (".mp4", ".gif"):
        raise InputError(f"{file}: an animation must end in .mp4 or .gif")
    if file.suffix.lower() == ".mp4" and not ffmpeg:
        raise InputError(f"{file}: .mp4 needs the program ffmpeg, which is not there; .gif does without")
    return file


def animate_run(
    result: RunResult,
    observed: Sequence[ObservedCycle],
    file: Path,
    *,
    frames: Sequence[Frame] = (),
    progress: Progress | None = None,
) -> None:
    """Write the animation of a run and what an `Observer` and its camera saw of it; see `write_animation`."""
    write_animation([film_of_run(result, observed, frames=frames)], file, progress=progress)


def animate_runs(
    runs: Sequence[tuple[str, RunResult, Sequence[ObservedCycle]]],
    file: Path,
    *,
    progress: Progress | None = None,
) -> None:
    """Write one animation of several runs side by side: label, result, and what was seen of each.

    All run at the same time scale from the same time on; what has ended stands. See `write_animation`.
    """
    films = [film_of_run(result, observed, label=label) for label, result, observed in runs]
    write_animation(films, file, progress=progress)


def write_animation(films: Sequence[Film], file: Path, *, progress: Progress | None = None) -> None:
    """Write an animation; the suffix of `file` decides between .mp4 and .gif.

    Args:
        progress: called for each picture with the shown time and the last one [s].

    Raises:
        InputError: see `animation_file`, or ffmpeg fails.
        OSError: the file cannot be written.
    """
    file = animation_file(file, file.parent)
    shown = pictures(films, progress=progress)
    if file.suffix.lower() == ".gif":
        _write_gif(shown, file)
    else:
        _write_mp4(shown, file)


def picture_times(films: Sequence[Film]) -> list[float]:
    """When the pictures show the films [s], at most `MOST`; the last one is at the end or after it."""
    begin = min(float(film.times[0]) for film in films)
    end = max(float(film.times[-1]) for film in films)
    count = ceil(RATE * (end - begin) - 1e-6)
    every = max(1, ceil(count / (MOST - 1)))
    return [begin + k * every / RATE for k in range(ceil(count / every) + 1)]


def pictures(films: Sequence[Film], *, progress: Progress | None = None) -> Iterator[Picture]:
    """The pictures (height, width, 4), RGBA, in order."""
    stage = Stage(films)
    canvas: Any = FigureCanvasAgg(stage.figure)  # its stub has no types
    overlay = Overlay(stage.figure, [artist for column in stage.columns for artist in column.moving])
    canvas.draw()
    times = picture_times(films)
    for place, time in enumerate(times):
        stage.show(time)
        overlay.update()
        picture = np.array(canvas.buffer_rgba())
        for _ in range(HELD if place == len(times) - 1 else 1):
            yield picture
        if progress is not None:
            progress(time, times[-1])


class Stage:
    """The figure of an animation: one column for each film, at most three abreast.

    Args:
        films: at least one.
    """

    def __init__(self, films: Sequence[Film]) -> None:
        self.figure = Figure(dpi=DPI)
        self.columns = [Column(self.figure, film, films) for film in films]
        self._fit(films)

    def show(self, time: float) -> None:
        """Show each film at this time [s]."""
        for column in self.columns:
            column.show(time)

    def _fit(self, films: Sequence[Film]) -> None:
        """By hand: matplotlib's own layouts cut labels off where the aspect is fixed."""
        extents = [extent(film) for film in films]
        rows = ceil(len(films) / _ABREAST)
        abreast = ceil(len(films) / rows)
        wide = min(_WIDEST, _ALL / abreast)
        high = min(_HIGHEST, wide * max((top - low) / (right - left) for left, right, low, top in extents))
        handles, labels = entries_once(column.scene.axes for column in self.columns)
        beside = _CAMERA + _RIGHT if any(film.frames for film in films) else 0.0
        whole = abreast * (_LEFT + wide + _RIGHT + beside)
        entries = max(1, int(whole / _ENTRY))
        legend = _LEGEND + 0.2 * (ceil(len(labels) / entries) - 1)
        cell = _TOP + high + _GAP + _BARS + _UNDER
        # Even numbers of dots: films need them.
        size = (_even(whole), _even(rows * cell + legend))
        self.figure.set_size_inches(size)
        for place, column in enumerate(self.columns):
            row, across = divmod(place, abreast)
            left = (across * (_LEFT + wide + _RIGHT + beside) + _LEFT) / size[0]
            bars = legend + (rows - 1 - row) * cell + _UNDER
            below = (bars + _BARS + _GAP) / size[1]
            column.scene.axes.set_position((left, below, wide / size[0], high / size[1]))
            column.bars_axes.set_position((left, bars / size[1], wide / size[0], _BARS / size[1]))
            if column.camera_axes is not None:
                right, tall = left + (wide + _RIGHT) / size[0], min(high, _CAMERA) / size[1]
                column.camera_axes.set_position(
                    (right, below + high / size[1] - tall, _CAMERA / size[0], tall)
                )
        self.figure.legend(
            handles, labels, loc="lower center", ncols=entries, frameon=False, fontsize="small"
        )


def _even(length: float) -> float:
    """Not less than this length, and an even number of dots [inch]."""
    return 2 * ceil(0.5 * DPI * length) / DPI


class Column:
    """One film: its scene, with time and status above and the weights below it.

    Args:
        figure: to draw on; film: what is shown; films: all that are shown together.
    """

    def __init__(self, figure: Figure, film: Film, films: Sequence[Film]) -> None:
        self.film = film
        self.scene = Scene(figure.add_subplot(), film)
        self.bars_axes = figure.add_subplot()
        self.bars = WeightBars(self.bars_axes, films)
        axes = self.scene.axes
        axes.set_title(film.label, pad=20.0)
        self.status = axes.text(0.5, 1.01, "", transform=axes.transAxes, ha="center", va="bottom")
        self.camera_axes = figure.add_subplot() if film.frames else None
        self.camera = None if self.camera_axes is None else CameraView(self.camera_axes, film.frames)
        seen = [] if self.camera is None else self.camera.moving
        self.moving = [*self.scene.moving, *self.bars.moving, *seen, self.status]

    def show(self, time: float) -> None:
        """Show the film at this time [s]."""
        index = self.film.at(time)
        view = self.film.views[index]
        self.scene.show(index)
        self.bars.show(view)
        if self.camera is not None:
            self.camera.show(time)
        self.status.set_text(status_line(view))


def status_line(view: CycleView) -> str:
    """Time, status and source of a cycle."""
    command = view.observed.command
    step = "" if command.mission is None else f"{command.mission.kind}, "
    return f"{view.time:.1f} s: {step}{command.status.value} ({command.source.value})"


def _write_gif(shown: Iterator[Picture], file: Path) -> None:
    """All pictures with one palette: made picture by picture they flicker and take twice the room."""
    palette = _palette()
    frames = (
        Image.fromarray(picture).convert("RGB").quantize(palette=palette, dither=Image.Dither.NONE)
        for picture in shown
    )
    first = next(frames)
    first.save(file, save_all=True, append_images=frames, duration=1000 // RATE, loop=0)


def _palette() -> Image.Image:
    """The colours of `style` on white, in shades."""
    colors = (
        style.BLACK,
        style.GREY,
        style.ORANGE,
        style.SKY,
        style.GREEN,
        style.BLUE,
        style.RED,
        style.PINK,
    )
    full = 255.0 * to_rgba_array(colors)[:, :3]
    # The palest is not too near white: Pillow would take the paper for it.
    shares = np.linspace(_PALEST, 1.0, _SHADES)[:, None, None]
    shades = np.concatenate([[[255.0] * 3], (shares * full + (1.0 - shares) * 255.0).reshape(-1, 3)])
    palette = Image.new("P", (1, 1))
    palette.putpalette(shades.round().astype(np.uint8).tobytes())
    return palette


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
