"""Animations: which file, which pictures, what is on them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from shutil import which

import numpy as np
import pytest
from matplotlib.animation import FFMpegWriter
from PIL import Image

from rti_mpcc.report import draw
from rti_mpcc.report.animation import HELD, RATE, Stage, animation_file, picture_times, write_animation
from rti_mpcc.report.ride import Ride
from rti_mpcc.report.scene import status_line


@pytest.fixture(scope="module")
def brief(ride: Ride) -> Ride:
    """The first 0.3 s."""
    return replace(ride, title="brief", moments=ride.moments[:4])


def at(ride: Ride, *times: float) -> Ride:
    """A ride with moments at these times [s]."""
    return replace(ride, moments=tuple(replace(ride.moments[0], time=time) for time in times))


def with_ffmpeg(monkeypatch: pytest.MonkeyPatch, there: bool) -> None:
    monkeypatch.setattr(FFMpegWriter, "isAvailable", classmethod(lambda cls: there))


@pytest.mark.parametrize(("there", "suffix"), [(True, "mp4"), (False, "gif")])
def test_default_is_mp4_where_ffmpeg_is_installed(
    monkeypatch: pytest.MonkeyPatch, there: bool, suffix: str
) -> None:
    with_ffmpeg(monkeypatch, there)
    assert animation_file(None, Path("runs/x")) == Path(f"runs/x/animation.{suffix}")
    assert animation_file(Path("mine.GIF"), Path("runs/x")) == Path("mine.GIF")


def test_gif_has_a_picture_for_each_tenth_of_a_second_in_the_colours_of_the_other_pictures(
    brief: Ride, tmp_path: Path
) -> None:
    file, told = tmp_path / "run.gif", list[float]()
    write_animation([brief], file, progress=lambda time, end: told.append(time))
    assert told[:4] == pytest.approx([moment.time for moment in brief.moments])
    with Image.open(file) as picture:
        assert (picture.n_frames, picture.info["loop"]) == (4, 0)  # type: ignore[attr-defined]
        picture.seek(3)
        assert picture.info["duration"] == HELD * 1000 / RATE
        last = np.asarray(picture.convert("RGB"))
    assert (last[:, 0] == 255).all()  # the paper is white
    for color in (draw.BLUE, draw.RED, draw.GREEN, draw.ORANGE, draw.GREY, draw.BLACK):
        wanted = np.array([int(color[k : k + 2], 16) for k in (1, 3, 5)])
        assert np.abs(last.astype(int) - wanted).max(axis=2).min() <= 3


@pytest.mark.parametrize(("end", "step", "count"), [(49.9, 0.1, 500), (50.0, 0.2, 251), (120.0, 0.3, 401)])
def test_long_rides_are_shown_faster(ride: Ride, end: float, step: float, count: int) -> None:
    times = picture_times([at(ride, 0.0, end)])[: 1 - HELD]
    assert len(times) == count
    assert np.diff(times) == pytest.approx(np.full(count - 1, step))
    assert times[-1] >= end - 1e-6


def test_several_rides_share_the_time_and_one_that_has_ended_stays(ride: Ride, brief: Ride) -> None:
    stage = Stage([ride, brief])
    stage.show(2.0)
    first, second = stage.scenes
    assert first.status.get_text() == status_line(ride.moments[20])
    assert second.status.get_text() == status_line(brief.moments[3])
    assert [scene.axes.get_title() for scene in stage.scenes] == ["docking_full_course (default)", "brief"]
    (legend,) = stage.figure.legends
    names = [text.get_text() for text in legend.get_texts()]
    assert len(names) == len(set(names))


@pytest.mark.skipif(which("ffmpeg") is None, reason="ffmpeg is not installed")
def test_mp4_is_one(brief: Ride, tmp_path: Path) -> None:
    write_animation([brief], tmp_path / "brief.mp4")
    assert (tmp_path / "brief.mp4").read_bytes()[4:8] == b"ftyp"
