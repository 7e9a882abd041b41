"""What pictures, table and film show of a mission and of its camera."""

from __future__ import annotations

from math import radians
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

from benchmarks.reproduction.mission import motion_figure, verdicts
from rti_mpcc.cli import main
from rti_mpcc.report.animation import Stage
from rti_mpcc.report.camera_frames import Frame
from rti_mpcc.report.camera_view import CameraView
from rti_mpcc.report.film import film_of_run
from rti_mpcc.report.mission_bands import draw_bands, draw_ends
from rti_mpcc.report.overview import overview_figure
from rti_mpcc.report.table import mission_rows
from rti_mpcc.report.timeline import timeline_figure
from rti_mpcc.report.views import Observer
from rti_mpcc.simulation import (
    RunResult,
    Scenario,
    driver_of,
    save_scenario,
    scenario_from_dict,
    simulate,
    summary,
)

BODY = [[-4.0, -1.0], [-2.0, -1.0], [-2.0, 1.0], [-4.0, 1.0]]


def short(**changes: object) -> Scenario:
    """Two metres in reverse to a dock, a wait, and on to the contact."""
    data = {
        "name": "short",
        "start": {"pose": [3.0, 0.0, 0.0]},
        "area": {"boundary": [[-8.0, -6.0], [14.0, -6.0], [14.0, 6.0], [-8.0, 6.0]]},
        "goal": {"pose": [0.0, 0.0, 0.0], "body": BODY},
        "simulation": {"cycle": 0.05, "dead_time": 0.1, "duration": 60.0},
        "mission": [
            {"kind": "dock"},
            {"kind": "wait", "seconds": 1.0},
            {"kind": "straight", "distance": -1.22, "contact": True},
        ],
    }
    return scenario_from_dict({**data, **changes})


@pytest.fixture(scope="module")
def seen() -> tuple[RunResult, Observer]:
    observer = Observer(driver_of(short()))
    return simulate(short(), controller=observer), observer


@pytest.fixture(scope="module")
def result(seen: tuple[RunResult, Observer]) -> RunResult:
    return seen[0]


def test_the_mission_went_as_it_should(result: RunResult) -> None:
    figures = summary(result)
    assert [step["result"] for step in figures["mission"]] == ["SUCCEEDED"] * 3
    assert figures["mission_result"] == "SUCCEEDED"
    assert figures["docked"]
    assert abs(figures["final_error"]["longitudinal_m"]) < 0.05
    assert figures["min_clearance_m"] > 0.5  # until the contact


def test_a_row_for_each_step_and_one_for_its_error(result: RunResult) -> None:
    rows = mission_rows(summary(result)["mission"])
    assert [name for name, _, _ in rows if name.startswith("step")] == [
        "step 0: dock",
        "step 1: wait",
        "step 2: straight",
    ]
    assert len(rows) == 5  # a wait has no error
    assert rows[0][1].startswith("SUCCEEDED 0.00 to ")


def test_there_are_no_rows_without_a_mission() -> None:
    assert mission_rows(None) == []


def test_bands_and_marks(result: RunResult) -> None:
    axes = Figure().add_subplot()
    draw_bands(axes, result, named=True)
    assert [text.get_text() for text in axes.texts] == ["dock", "wait", "straight"]
    assert len(axes.patches) == 3
    assert axes.get_legend_handles_labels()[1] == ["end of a wait"]


def test_ends_of_steps_and_what_is_docked_at(result: RunResult) -> None:
    axes = Figure().add_subplot()
    draw_ends(axes, result)
    assert axes.get_legend_handles_labels()[1] == ["what is docked at", "body at the end of a step"]
    assert len(axes.collections[1].get_paths()) == 3


def test_whole_pictures_are_drawn(result: RunResult) -> None:
    timeline_figure(result, summary(result)).draw_without_rendering()
    overview_figure(result).draw_without_rendering()


def test_the_picture_of_the_reproduction(result: RunResult) -> None:
    figure = motion_figure(result, summary(result))
    labels = figure.axes[0].get_legend_handles_labels()[1]
    assert {"true", "T_goal", "end of a wait"} <= set(labels)
    assert [axes.get_ylabel() for axes in figure.axes] == ["v [m/s]", "delta [rad]"]


def test_sentences_of_the_reproduction(result: RunResult) -> None:
    told = verdicts(summary(result))
    assert told[0].startswith("The vehicle gets to the pose before the capsule: comes out so (")
    assert "does not come out so (1.0 s here" in told[2]
    assert told[3].startswith("It connects: comes out so (")
    figures = summary(result)
    figures["mission"][2]["final_error"]["heading_rad"] = radians(0.6)
    assert "It connects: does not come out so" in verdicts(figures)[3]
    figures["mission"] = figures["mission"][:2]
    assert verdicts(figures)[-1] == "It does not connect."


def test_the_last_picture_before_a_time_is_shown() -> None:
    frames = tuple(
        Frame(stamp=float(k), picture=np.full((6, 8, 3), 10 * k, dtype=np.uint8), found=True) for k in (1, 2)
    )
    axes = Figure().add_subplot()
    view = CameraView(axes, frames)
    for time, grey, word in ((0.5, 200, "no picture yet"), (1.5, 10, ""), (9.0, 20, "")):
        view.show(time)
        assert np.unique(np.asarray(axes.images[0].get_array())).tolist() == [grey]
        assert axes.texts[0].get_text() == word


def test_a_film_shows_the_camera_beside_the_plan(seen: tuple[RunResult, Observer]) -> None:
    run, observer = seen
    frame = Frame(stamp=1.0, picture=np.zeros((6, 8, 3), dtype=np.uint8), found=False)
    plain, watched = (
        Stage([film_of_run(run, observer.observed, frames=frames)]) for frames in ((), (frame,))
    )
    assert watched.figure.get_figwidth() > plain.figure.get_figwidth() + 5.0
    watched.show(2.0)
    (column,) = watched.columns
    assert column.camera_axes is not None
    scene, camera = column.scene.axes.get_position(), column.camera_axes.get_position()
    assert camera.x0 > scene.x1
    assert camera.x1 <= 1.0
    assert "dock, " in column.status.get_text()


def test_the_command_says_whether_the_mission_succeeded(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    well = save_scenario(short(), tmp_path)
    assert main(["run", str(well), "--no-plots", "--out", str(tmp_path / "well")]) == 0
    assert "step 2: straight" in capsys.readouterr().out
    steps = [{"kind": "dock"}, {"kind": "undock", "distance": 5.0, "timeout": 1.0}]
    badly = save_scenario(short(name="late", mission=steps), tmp_path)
    assert main(["run", str(badly), "--no-plots", "--out", str(tmp_path / "badly")]) == 1
    assert "TIMED_OUT" in capsys.readouterr().out
