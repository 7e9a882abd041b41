"""The command line: `run --animate` and `watch`."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import matplotlib
import pytest
from matplotlib.animation import FFMpegWriter
from PIL import Image

from rti_mpcc import cli
from rti_mpcc.cli import main
from rti_mpcc.report.ride import Ride
from tests.rti_mpcc.cli_runs import write_mission, write_short

ROOT = Path(__file__).parents[2]

SEEN = """
name = "seen"
[path]
start = [4.0, 0.3, 0.05]
segments = [{ direction = -1, curvature = 0.0, length = 4.0 }]
[corridor]
left = 3.0
right = -3.0
[goal.measurement]
rate = 5.0
[goal.camera]
board = { x = -2.0, dictionary = "DICT_4X4_50" }
[simulation]
duration = 0.5
"""
"""A scenario with a camera that is over soon."""
WINDOW = """
from matplotlib.backend_bases import FigureManagerBase
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib._pylab_helpers import Gcf

class Manager(FigureManagerBase):
    @classmethod
    def pyplot_show(cls, *, block=None):
        for manager in Gcf.get_all_fig_managers():
            manager.canvas.draw()
            figure = manager.canvas.figure
            print("window", figure.subfigs[0].subfigs[1].get_suptitle().splitlines()[0])

class FigureCanvas(FigureCanvasAgg):
    manager_class = Manager
    required_interactive_framework = "headless"
"""
"""A backend that opens windows as far as matplotlib can tell; what it shows, it prints."""


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(FFMpegWriter, "isAvailable", classmethod(lambda cls: False))
    write_short(0.3, "state_noise = [0.01, 0.01, 0.001, 0.0, 0.0]")


@pytest.fixture
def rides(monkeypatch: pytest.MonkeyPatch) -> list[Ride]:
    """What is watched in this process, as if a window could be opened."""
    shown: list[Ride] = []
    monkeypatch.setattr("rti_mpcc.report.viewer.open_window", lambda: None)
    monkeypatch.setattr("rti_mpcc.report.viewer.watch", lambda window, ride: shown.append(ride))
    return shown


def refusal(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    """The one line on stderr of a call that must be refused."""
    assert main(arguments) == 2
    said = capsys.readouterr()
    assert said.out == ""
    (line,) = said.err.splitlines()
    return line


def in_a_process(backend: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    """pyplot, once loaded, stays: not here."""
    return subprocess.run(
        [sys.executable, "-m", "rti_mpcc", *arguments],
        env=os.environ | {"PYTHONPATH": f"{ROOT}{os.pathsep}{Path.cwd()}", "MPLBACKEND": backend},
        capture_output=True,
        text=True,
    )


def test_animation_goes_beside_the_other_files(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", "short.toml", "--no-plots", "--animate"]) == 1
    assert "runs/short/animation.gif" in capsys.readouterr().out
    with Image.open("runs/short/animation.gif") as picture:
        picture.seek(3)
        with pytest.raises(EOFError):
            picture.seek(4)
    names = {file.name for file in Path("runs/short").iterdir()}
    assert names == {"summary.json", "trajectory.csv", "animation.gif"}


def test_animation_goes_where_it_is_asked_for_with_a_recording(capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["--animate", "films/mine.gif", "--record", "run.jsonl", "--out", "out"]
    assert main(["run", "short.toml", "--no-plots", *arguments]) == 1
    assert Path("films/mine.gif").read_bytes().startswith(b"GIF8")
    assert main(["replay", "run.jsonl"]) == 0


def test_a_mission_is_animated_while_it_is_recorded(capsys: pytest.CaptureFixture[str]) -> None:
    write_mission(0.4)
    arguments = ["--animate", "mine.gif", "--record", "run.jsonl"]
    assert main(["run", "delivery.toml", "--no-plots", *arguments]) == 1
    assert Path("mine.gif").read_bytes().startswith(b"GIF8")
    assert main(["replay", "run.jsonl"]) == 0


def test_run_is_the_same_when_it_is_looked_at() -> None:
    for more, folder in ((["--animate"], "with"), ([], "without")):
        main(["run", "short.toml", "--no-plots", "--seed", "3", "--out", folder, *more])
    assert Path("with/trajectory.csv").read_text() == Path("without/trajectory.csv").read_text()


@pytest.mark.parametrize(
    ("file", "message"),
    [
        ("mine.mp4", "mine.mp4: .mp4 needs the program ffmpeg, which is not installed; .gif needs nothing"),
        ("mine.png", "mine.png: an animation must end in .mp4 or .gif"),
        ("short.toml/mine.gif", "short.toml: File exists"),
    ],
)
def test_bad_animation_is_refused_before_the_run(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, file: str, message: str
) -> None:
    monkeypatch.setattr(cli.run, "simulate", None)
    line = refusal(capsys, "run", "short.toml", "--animate", file)
    assert line == f"rti-mpcc: error: {message}"
    assert not Path("runs/short/summary.json").exists()


def test_watching_a_scenario(rides: list[Ride]) -> None:
    assert main(["watch", "short.toml", "--preset", "paper", "--seed", "2"]) == 0
    assert main(["watch", "short.toml"]) == 0
    assert main(["watch", "short.toml", "--method", "separated"]) == 0
    other, ride, separated = rides
    titles = [each.title for each in rides]
    assert titles == ["short (paper)", "short (default)", "short (separated, default)"]
    assert len(ride.moments) == len(separated.moments) == 7
    assert all(moment.goal is not None for moment in ride.moments)
    assert other.moments[0].state != ride.moments[0].state
    assert not Path("runs").exists()


def test_watching_a_mission_and_its_recording(rides: list[Ride]) -> None:
    write_mission(1.0)
    main(["run", "delivery.toml", "--no-plots", "--record", "run.jsonl"])
    Path("run.jsonl").rename("renamed")
    assert main(["watch", "renamed"]) == 0
    assert main(["watch", "delivery.toml"]) == 0
    recorded, run = rides
    assert recorded.title == "renamed"
    for one, other in zip(recorded.moments, run.moments, strict=True):
        assert one.command.mission == other.command.mission
        assert (one.route is None) == (other.route is None)
    assert run.moments[-1].route is not None


def test_what_cannot_be_watched_is_refused(rides: list[Ride], capsys: pytest.CaptureFixture[str]) -> None:
    assert "nowhere.jsonl: cannot be read" in refusal(capsys, "watch", "nowhere.jsonl")
    assert "docking: must be a .toml file or one of" in refusal(capsys, "watch", "docking")
    Path("notes").write_text("something else\n")
    assert "notes: is not a recording of rti-mpcc" in refusal(capsys, "watch", "notes")
    for option in ("--preset=paper", "--seed=0", "--method=dynamic"):
        line = refusal(capsys, "watch", "run.jsonl", option)
        assert line.endswith("run.jsonl: a recording has its own method, preset and seed, leave them out")
    assert rides == []


def test_watch_without_a_display_says_so_before_the_run() -> None:
    done = in_a_process("Agg", "watch", "docking_inside")
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == (
        "rti-mpcc: error: watch opens a window, which needs a display: "
        "matplotlib's backend is Agg, which only writes files\n"
    )


def test_watch_with_a_toolkit_that_fails_says_so(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def no_figure(**_: Any) -> None:
        raise RuntimeError("no screen\nat all")

    toolkit = SimpleNamespace(figure=no_figure, get_backend=lambda: "any")
    monkeypatch.setitem(sys.modules, "matplotlib.pyplot", toolkit)
    monkeypatch.setattr(matplotlib, "pyplot", toolkit, raising=False)
    line = refusal(capsys, "watch", "docking_inside")
    assert line.endswith("watch opens a window, which needs a display: no screen at all")


@pytest.mark.acceptance
def test_watch_opens_a_window_until_it_is_closed() -> None:
    Path("window.py").write_text(WINDOW)
    done = in_a_process("module://window", "watch", "short.toml")
    assert (done.returncode, done.stderr) == (0, "")
    (shown,) = done.stdout.splitlines()
    assert shown.startswith("window cycle")
    assert "cycle 1 of 7, " in shown


def test_animation_of_a_run_with_a_camera_has_its_view(capsys: pytest.CaptureFixture[str]) -> None:
    Path("seen.toml").write_text(SEEN)
    sizes = []
    for name in ("seen", "short"):
        assert main(["run", f"{name}.toml", "--no-plots", "--animate", "--out", name]) == 1
        with Image.open(f"{name}/animation.gif") as picture:
            sizes.append(picture.size)
    assert sizes[0][0] > sizes[1][0] + 500


@pytest.mark.parametrize(
    ("dictionary", "opencv", "message"),
    [
        ("DICT_4X4_50", False, "needs OpenCV 4.14 or later: pip install '.[vision]' in rti-mpcc's folder"),
        ("DICT_9", True, "CharucoBoard.dictionary = 'DICT_9': not one of OpenCV's"),
    ],
)
def test_a_camera_that_can_take_no_picture_is_refused_before_the_run(
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    dictionary: str,
    opencv: bool,
    message: str,
) -> None:
    if not opencv:
        monkeypatch.setitem(sys.modules, "cv2", None)
    Path("seen.toml").write_text(SEEN.replace("DICT_4X4_50", dictionary))
    assert refusal(capsys, "run", "seen.toml").endswith(message)
    assert not Path("runs").exists()
