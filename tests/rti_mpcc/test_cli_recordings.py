"""The command line: `run --record`, `run --animate`, `run --page`, `replay` and `show`."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest
from matplotlib.animation import FFMpegWriter
from PIL import Image

from rti_mpcc.cli import main
from rti_mpcc.recording import read_recording
from rti_mpcc.simulation import changed, load_scenario, simulate
from tests.rti_mpcc.cli_runs import Printed, refused, write_mission, write_short
from tests.rti_mpcc.recording.recordings import change

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
NOISY = "state_noise = [0.01, 0.01, 0.001, 0.0, 0.0]"


@pytest.fixture(autouse=True)
def _short(elsewhere: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(FFMpegWriter, "isAvailable", classmethod(lambda cls: False))
    write_short(0.3, NOISY)


def run(name: str = "short.toml", *options: str) -> int:
    return main(["run", name, "--no-plots", *options])


@pytest.fixture(scope="module")
def seven_cycles(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(tmp_path_factory.mktemp("recorded"))
        write_short(0.3, NOISY)
        assert run("short.toml", "--record", "made/run.jsonl") == 1
        return Path("made/run.jsonl").read_bytes()


@pytest.fixture
def recording(seven_cycles: bytes) -> Path:
    """Of 7 cycles."""
    Path("made").mkdir()
    Path("made/run.jsonl").write_bytes(seven_cycles)
    return Path("made/run.jsonl")


def replayed(capsys: Printed, *options: str, status: int = 0) -> str:
    """What a replay of run.jsonl prints."""
    capsys.readouterr()
    assert main(["replay", *options]) == status
    said = capsys.readouterr()
    assert said.err == ""
    return said.out


def test_a_recorded_run_replays_identically(recording: Path, capsys: Printed) -> None:
    told = "identical: 7 cycles compared bit for bit, on the same machine and versions\n"
    assert replayed(capsys, str(recording)) == told


def test_a_mission_replays_and_a_changed_contact_is_shown(capsys: Printed) -> None:
    write_mission(30.0, cycle=0.1)
    assert run("delivery.toml", "--record", "run.jsonl") == 0
    said = capsys.readouterr().out
    assert "run.jsonl" in said
    for step in ("dock", "wait", "straight", "undock"):
        assert any(f": {step} " in line and "SUCCEEDED" in line for line in said.splitlines()), step
    cycles = read_recording("run.jsonl").cycles
    (touched,) = [cycle for cycle in cycles if cycle.inputs.signal]
    assert f"identical: {len(cycles)} cycles compared bit for bit" in replayed(capsys, "run.jsonl")
    text = Path("run.jsonl").read_text()
    Path("run.jsonl").write_text(text.replace('"signal":true', '"signal":false'))
    said = replayed(capsys, "run.jsonl", status=1)
    assert said.startswith(f"different: cycle {touched.number} at ")
    assert "command.mission.result: recorded" in said


def test_a_difference_is_shown_and_exits_1(recording: Path, capsys: Printed) -> None:
    lines = recording.read_text().splitlines(keepends=True)
    speed = f'"v":{read_recording(recording).cycles[6].inputs.state.v!r}'
    assert speed in lines[7]
    recording.write_text("".join([*lines[:7], lines[7].replace(speed, '"v":0.05', 1), *lines[8:]]))
    said = replayed(capsys, str(recording), status=1).splitlines()
    assert said[0] == "different: cycle 6 at 0.300 s: its line was changed after it was recorded"
    assert said[1].startswith("  command.acceleration: recorded ")
    assert ", difference " in said[1]
    assert said[-1].startswith("7 cycles compared bit for bit")


def test_the_tolerance_is_1e_9_on_another_machine(recording: Path, capsys: Printed) -> None:
    assert "within 1e-06, on the same machine" in replayed(capsys, str(recording), "--tolerance", "1e-6")
    elsewhere = change(recording, -1, lambda header: header["machine"].update(processor=""), checked=True)
    assert "within 1e-09, on another machine or other versions" in replayed(capsys, str(elsewhere))


def test_a_truncated_recording(recording: Path, capsys: Printed) -> None:
    recording.write_bytes(recording.read_bytes()[:-3000])
    assert refused(capsys, "replay", str(recording)) == (
        "rti-mpcc: error: made/run.jsonl: is truncated: it holds 6 whole cycles and no end "
        "(replay those with --partial, allow_truncated=True in Python)\n"
    )
    assert "6 cycles" in (said := replayed(capsys, str(recording), "--partial"))
    assert said.endswith("; the recording is truncated\n")


def test_animation_is_written_and_changes_nothing(capsys: Printed) -> None:
    write_mission(0.4)
    files = ["--animate", "animations/mine.gif", "--record", "run.jsonl", "--out", "with"]
    for options in (files, ["--animate", "--out", "default"], ["--out", "without"]):
        assert run("delivery.toml", "--seed", "3", *options) == 1
    said = capsys.readouterr().out
    for file in (Path("animations/mine.gif"), Path("default/animation.gif")):
        assert str(file) in said
        assert file.read_bytes().startswith(b"GIF8")
    assert {file.name for file in Path("without").iterdir()} == {"summary.json", "trajectory.csv"}
    assert Path("with/trajectory.csv").read_text() == Path("without/trajectory.csv").read_text()
    assert main(["replay", "run.jsonl"]) == 0


def test_animation_of_a_run_with_a_camera_has_its_view() -> None:
    Path("seen.toml").write_text(SEEN)
    sizes = []
    for name in ("seen", "short"):
        assert run(f"{name}.toml", "--animate", "--out", name) == 1
        with Image.open(f"{name}/animation.gif") as picture:
            sizes.append(picture.size)
    assert sizes[0][0] > sizes[1][0] + 500


@pytest.mark.parametrize(
    ("option", "file", "message"),
    [
        ("--animate", "mine.mp4", "mine.mp4: .mp4 needs the program ffmpeg, which is not installed"),
        ("--animate", "mine.png", "mine.png: an animation must end in .mp4 or .gif"),
        ("--animate", "short.toml/mine.gif", "short.toml: File exists"),
        ("--record", "folder", "folder: Is a directory"),
    ],
)
def test_files_that_cannot_be_written_are_refused_before_the_run(
    capsys: Printed, option: str, file: str, message: str
) -> None:
    Path("folder").mkdir()
    assert message in refused(capsys, "run", "short.toml", option, file)
    assert not Path("runs/short/summary.json").exists()


@pytest.mark.parametrize(
    ("dictionary", "opencv", "message"),
    [
        (
            "DICT_4X4_50",
            False,
            "needs OpenCV, which is not installed: pip install '.[vision]' in rti-mpcc's folder\n",
        ),
        ("DICT_9", True, "CharucoBoard.dictionary = 'DICT_9': not one of OpenCV's\n"),
    ],
)
def test_a_camera_that_can_take_no_picture_is_refused_before_the_run(
    capsys: Printed,
    monkeypatch: pytest.MonkeyPatch,
    dictionary: str,
    opencv: bool,
    message: str,
) -> None:
    if not opencv:
        monkeypatch.setitem(sys.modules, "cv2", None)
    Path("seen.toml").write_text(SEEN.replace("DICT_4X4_50", dictionary))
    assert refused(capsys, "run", "seen.toml").endswith(message)
    assert not Path("runs").exists()


def written(folder: str) -> set[str]:
    return {file.name for file in Path(folder).iterdir()}


def test_show_writes_what_run_writes(recording: Path, capsys: Printed) -> None:
    files = ["--mcap", "logs/ride.mcap", "--animation", "films/ride.gif"]
    assert main(["show", str(recording), *files]) == 0
    said = capsys.readouterr().out
    assert written("runs/run") == {
        "summary.json",
        "trajectory.csv",
        "overview.png",
        "timeline.png",
        "page.html",
    }
    figures = json.loads(Path("runs/run/summary.json").read_text())
    assert (figures["recording"], figures["cycles"], figures["docked"]) == ("run.jsonl", 7, False)
    assert len(Path("runs/run/trajectory.csv").read_text().splitlines()) == 1 + 7
    assert Path("logs/ride.mcap").read_bytes().startswith(b"\x89MCAP")
    assert Path("films/ride.gif").read_bytes().startswith(b"GIF8")
    for file in ("page.html", "logs/ride.mcap", "films/ride.gif"):
        assert file in said


def test_a_run_writes_the_page_and_the_mcap_file_that_are_asked_for() -> None:
    assert run("short.toml", "--page", "--mcap", "ride.mcap", "--out", "made") == 1
    assert written("made") == {"summary.json", "trajectory.csv", "page.html"}
    assert Path("ride.mcap").read_bytes().startswith(b"\x89MCAP")
    assert run("short.toml", "--out", "plain") == 1
    assert written("plain") == {"summary.json", "trajectory.csv"}


def test_a_mission_and_its_truncated_recording_are_shown() -> None:
    write_mission(1.0)
    run("delivery.toml", "--record", "run.jsonl")
    Path("cut").write_bytes(Path("run.jsonl").read_bytes()[:-3000])
    for name in ("run.jsonl", "cut"):
        assert main(["show", name, "--no-plots", "--out", f"shown {name}"]) == 0
        page = Path(f"shown {name}/page.html").read_text()
        assert ("(truncated)" in page) is (name == "cut")


def test_what_cannot_be_shown_is_refused(
    recording: Path, capsys: Printed, monkeypatch: pytest.MonkeyPatch
) -> None:
    Path("notes").write_text("something else\n")
    monkeypatch.setitem(sys.modules, "mcap", None)
    for arguments, message in (
        ("nowhere.jsonl", "nowhere.jsonl: cannot be read"),
        ("notes", "notes: is not a recording of rti-mpcc"),
        (
            f"{recording} --mcap x.mcap",
            "an MCAP file needs mcap, which is not installed: pip install '.[mcap]'",
        ),
        (f"{recording} --animation x.png", "x.png: an animation must end in .mp4 or .gif"),
    ):
        assert message in refused(capsys, "show", *arguments.split())
    assert "pip install '.[mcap]'" in refused(capsys, "run", "short.toml", "--mcap", "x.mcap", "--out", "new")
    assert not Path("new").exists()


def test_keys_of_the_controller_are_set(capsys: Printed) -> None:
    keys = ["--set", "weights.contouring=5", "--set", "comfort_jerk = 0.8", "--set", "ride=brisk"]
    assert run("short.toml", "--record", "set.jsonl", *keys) == 1
    config = read_recording("set.jsonl").header.config
    switched = changed(load_scenario("short.toml"), {"controller.method": "switched"})
    assert [simulate(switched, method=each).method for each in (None, "dynamic")] == ["switched", "dynamic"]
    assert (config.weights.contouring, config.comfort.jerk, config.ride) == (5.0, 0.8, "brisk")
    capsys.readouterr()
    for given, message in (
        ("weights.contouring", "'weights.contouring' must be KEY=VALUE, such as weights.contouring=5"),
        ("ride=[brisk", "'ride=[brisk' must be KEY=VALUE"),
        ("method=swtched", "controller.method = 'swtched': must be one of dynamic, separated, switched"),
        ("comfort=1", "controller.comfort = 1: unknown key"),
    ):
        assert message in refused(capsys, "run", "short.toml", "--set", given)
