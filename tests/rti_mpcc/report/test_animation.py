"""Animations: which file, which pictures, what is on them."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path
from shutil import which

import numpy as np
import pytest
from matplotlib.animation import FFMpegWriter
from PIL import Image

from rti_mpcc.errors import InputError
from rti_mpcc.report import style
from rti_mpcc.report.animation import (
    HELD,
    RATE,
    Stage,
    animation_file,
    picture_times,
    write_animation,
)
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
    for color in (style.BLUE, style.RED, style.GREEN, style.ORANGE, style.GREY, style.BLACK):
        wanted = np.array([int(color[k : k + 2], 16) for k in (1, 3, 5)])
        assert np.abs(last.astype(int) - wanted).max(axis=2).min() <= 3


def test_pictures_start_with_the_first_and_end_with_the_last(brief: Ride) -> None:
    later = at(brief, 1.0, 1.3)
    for rides, count in (
        ([brief], 3),
        ([brief, later], 13),
        ([at(brief, 0.0, 0.07, 0.21)], 3),
        ([at(brief, 0.0)], 0),
    ):
        times = picture_times(rides)
        assert times == pytest.approx([0.1 * min(k, count) for k in range(count + HELD)])


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


def test_the_camera_is_beside_the_scene(brief: Ride, tmp_path: Path) -> None:
    Image.new("RGB", (8, 6)).save(tmp_path / "frame.jpg")
    seen = replace(brief, frames=((0.1, (tmp_path / "frame.jpg").read_bytes()),))
    plain, stage = Stage([brief]), Stage([seen])
    assert stage.figure.get_figwidth() > plain.figure.get_figwidth() + 5.0
    stage.show(0.2)
    stage.figure.draw_without_rendering()
    (camera,) = stage.cameras
    assert camera is not None
    scene, picture = (axes.get_position() for axes in (stage.scenes[0].axes, stage.figure.axes[-1]))
    assert scene.x1 < picture.x0 < picture.x1 <= 1.0


@pytest.mark.acceptance
@pytest.mark.parametrize("count", [1, 3, 4, 7])
def test_nothing_is_cut_off_or_covered(ride: Ride, count: int) -> None:
    stage = Stage([ride] * count)
    stage.show(3.0)
    for _ in range(2):
        stage.figure.draw_without_rendering()
    (legend,) = stage.figure.legends
    boxes = [axes.get_tightbbox() for axes in stage.figure.axes] + [legend.get_window_extent()]
    whole = stage.figure.bbox.padded(1.0)
    for place, box in enumerate(boxes):
        assert box is not None
        assert whole.x0 <= box.x0 <= box.x1 <= whole.x1
        assert whole.y0 <= box.y0 <= box.y1 <= whole.y1
        assert not [other for other in boxes[:place] if other is not None and box.overlaps(other)]


@pytest.mark.skipif(which("ffmpeg") is None, reason="ffmpeg is not installed")
def test_mp4_is_one(brief: Ride, tmp_path: Path) -> None:
    write_animation([brief], tmp_path / "brief.mp4")
    assert (tmp_path / "brief.mp4").read_bytes()[4:8] == b"ftyp"


@pytest.mark.skipif(os.name == "nt", reason="needs a shell")
def test_ffmpeg_that_fails_is_told(brief: Ride, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    program = tmp_path / "ffmpeg"
    program.write_text("#!/bin/sh\ncat > /dev/null\nexit 1\n")
    program.chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path), prepend=os.pathsep)
    with pytest.raises(InputError, match=r"brief\.mp4: ffmpeg could not write it"):
        write_animation([brief], tmp_path / "brief.mp4")
