"""Animations: which file, which pictures, what is on them."""

from __future__ import annotations

import os
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from shutil import which

import numpy as np
import pytest
from matplotlib.animation import FFMpegWriter
from matplotlib.figure import Figure
from PIL import Image

from rti_mpcc.errors import InputError
from rti_mpcc.report import style
from rti_mpcc.report.animation import (
    HELD,
    RATE,
    Stage,
    animate_run,
    animate_runs,
    animation_file,
    picture_times,
    pictures,
    status_line,
    write_animation,
)
from rti_mpcc.report.film import Film
from rti_mpcc.report.views import ObservedCycle
from rti_mpcc.simulation import RunResult


@pytest.fixture(scope="module")
def brief(film: Film) -> Film:
    """The first 0.3 s."""
    return replace(film, label="brief", views=film.views[:4], times=film.times[:4])


def with_ffmpeg(monkeypatch: pytest.MonkeyPatch, there: bool) -> None:
    monkeypatch.setattr(FFMpegWriter, "isAvailable", classmethod(lambda cls: there))


def count_of(picture: Image.Image) -> int:
    count = 0
    with suppress(EOFError):
        while True:
            picture.seek(count)
            count += 1
    return count


@pytest.mark.parametrize(("there", "suffix"), [(True, "mp4"), (False, "gif")])
def test_default_is_mp4_where_ffmpeg_is_there(
    monkeypatch: pytest.MonkeyPatch, there: bool, suffix: str
) -> None:
    with_ffmpeg(monkeypatch, there)
    assert animation_file(None, Path("runs/x")) == Path(f"runs/x/animation.{suffix}")
    for name in ("mine.gif", "mine.GIF"):
        assert animation_file(Path(name), Path("runs/x")) == Path(name)


def test_mp4_without_ffmpeg_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    with_ffmpeg(monkeypatch, True)
    assert animation_file(Path("mine.mp4"), Path()) == Path("mine.mp4")
    with_ffmpeg(monkeypatch, False)
    with pytest.raises(InputError, match=r"mine\.mp4: \.mp4 needs the program ffmpeg, which is not there"):
        animation_file(Path("mine.mp4"), Path())


@pytest.mark.parametrize("name", ["mine.png", "mine", "gif"])
def test_other_suffixes_are_refused(name: str) -> None:
    with pytest.raises(InputError, match=rf"{name}: an animation must end in \.mp4 or \.gif"):
        animation_file(Path(name), Path())


@pytest.mark.acceptance
def test_gif_has_a_picture_for_each_tenth_of_a_second(
    looked_at: tuple[RunResult, list[ObservedCycle]], film: Film, tmp_path: Path
) -> None:
    file, told = tmp_path / "run.gif", list[tuple[float, float]]()
    animate_run(*looked_at, file, progress=lambda time, end: told.append((time, end)))
    assert [time for time, _ in told] == pytest.approx(film.times.tolist())
    assert [end for _, end in told] == pytest.approx([3.2] * 33)
    with Image.open(file) as picture:
        # The last one is held by its duration.
        assert count_of(picture) == 33
        assert picture.info["loop"] == 0
        picture.seek(32)
        assert picture.info["duration"] == HELD * 1000 / RATE
        last = np.asarray(picture.convert("RGB"))
        picture.seek(0)
        assert picture.info["duration"] == 1000 / RATE
        assert (np.asarray(picture.convert("RGB")) != last).any()
    assert (last[:, 0] == 255).all()  # the paper is white


def test_colours_are_those_of_the_other_pictures(brief: Film, tmp_path: Path) -> None:
    write_animation([replace(brief, views=brief.views[:1], times=brief.times[:1])], tmp_path / "one.gif")
    with Image.open(tmp_path / "one.gif") as picture:
        colors = picture.convert("RGB").getcolors(256)
    assert colors is not None
    shown = np.array([color for _, color in colors])
    for color in (style.BLUE, style.RED, style.GREEN, style.ORANGE, style.GREY, style.BLACK):
        wanted = np.array([int(color[k : k + 2], 16) for k in (1, 3, 5)])
        assert np.abs(shown - wanted).max(axis=1).min() <= 3


def test_pictures_begin_with_the_first_and_end_with_the_last(film: Film, brief: Film) -> None:
    later = replace(brief, times=brief.times + 1.0)
    assert picture_times([brief]) == pytest.approx([0.1 * k for k in range(4)])
    assert picture_times([brief, later]) == pytest.approx([0.1 * k for k in range(14)])
    fine = replace(brief, times=np.array([0.0, 0.07, 0.14, 0.21]))
    assert picture_times([fine]) == pytest.approx([0.0, 0.1, 0.2, 0.3])
    assert picture_times([replace(brief, views=brief.views[:1], times=brief.times[:1])]) == [0.0]


@pytest.mark.parametrize(("end", "step", "count"), [(49.9, 0.1, 500), (50.0, 0.2, 251), (120.0, 0.3, 401)])
def test_long_runs_are_shown_faster(film: Film, end: float, step: float, count: int) -> None:
    times = picture_times([replace(film, times=np.array([0.0, end]), views=film.views[:2])])
    assert len(times) == count
    assert np.diff(times) == pytest.approx(np.full(count - 1, step))
    assert times[-1] >= end - 1e-6


def test_pictures_have_even_sizes_and_what_moves_is_drawn_over_what_stands(brief: Film) -> None:
    shown = list(pictures([brief]))
    assert len(shown) == 4 + HELD - 1
    assert {picture.dtype for picture in shown} == {np.dtype(np.uint8)}
    height, width, channels = shown[0].shape
    assert (height % 2, width % 2, channels) == (0, 0, 4)
    # The same as if all was drawn at that time.
    stage = Stage([brief])
    stage.show(0.2)
    whole = np.asarray(_drawn(stage.figure))
    assert np.abs(whole.astype(int) - shown[2]).mean() < 0.2


def _drawn(figure: Figure) -> np.ndarray[tuple[int, ...], np.dtype[np.uint8]]:
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    canvas = FigureCanvasAgg(figure)
    canvas.draw()  # type: ignore[no-untyped-call]
    return np.array(canvas.buffer_rgba())  # type: ignore[no-untyped-call]


def test_several_runs_share_the_time_and_what_has_ended_stands(film: Film, brief: Film) -> None:
    stage = Stage([film, brief])
    stage.show(2.0)
    first, second = stage.columns
    assert first.status.get_text() == status_line(film.views[20])
    assert second.status.get_text() == status_line(brief.views[3])
    assert second.status.get_text().startswith("0.3 s: ")
    titles = [column.scene.axes.get_title() for column in stage.columns]
    assert titles == ["docking_full_course (default)", "brief"]
    (legend,) = stage.figure.legends
    names = [text.get_text() for text in legend.get_texts()]
    assert len(names) == len(set(names))
    assert first.bars_axes.get_xlim() == second.bars_axes.get_xlim()


@pytest.mark.acceptance
@pytest.mark.parametrize("count", [1, 3, 4, 7])
def test_nothing_is_cut_off_or_covered(film: Film, count: int) -> None:
    stage = Stage([film] * count)
    stage.show(3.0)
    stage.figure.draw_without_rendering()
    (legend,) = stage.figure.legends
    boxes = [axes.get_tightbbox() for axes in stage.figure.axes] + [legend.get_window_extent()]
    whole = stage.figure.bbox
    for place, box in enumerate(boxes):
        assert box is not None
        assert box.x0 >= whole.x0
        assert box.x1 <= whole.x1
        assert box.y0 >= whole.y0
        assert box.y1 <= whole.y1
        assert not [other for other in boxes[:place] if other is not None and box.overlaps(other)]


def test_labelled_runs_go_into_one_file(
    looked_at: tuple[RunResult, list[ObservedCycle]], tmp_path: Path
) -> None:
    run, observed = looked_at
    few = replace(run, cycles=replace(run.cycles, times=run.cycles.times[:3]))
    animate_runs([("one", few, observed[:3]), ("other", few, observed[:3])], tmp_path / "both.gif")
    animate_runs([("one", few, observed[:3])], tmp_path / "one.gif")
    with Image.open(tmp_path / "both.gif") as both, Image.open(tmp_path / "one.gif") as one:
        assert count_of(both) == count_of(one) == 3
        assert both.width > 1.3 * one.width


@pytest.mark.skipif(which("ffmpeg") is None, reason="ffmpeg is not installed")
def test_mp4_is_one(brief: Film, tmp_path: Path) -> None:
    write_animation([brief], tmp_path / "brief.mp4")
    assert (tmp_path / "brief.mp4").read_bytes()[4:8] == b"ftyp"


@pytest.mark.skipif(os.name == "nt", reason="needs a shell")
def test_ffmpeg_that_fails_is_told(brief: Film, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    program = tmp_path / "ffmpeg"
    program.write_text("#!/bin/sh\ncat > /dev/null\nexit 1\n")
    program.chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path), prepend=os.pathsep)
    with pytest.raises(InputError, match=r"brief\.mp4: ffmpeg could not write it"):
        write_animation([brief], tmp_path / "brief.mp4")
