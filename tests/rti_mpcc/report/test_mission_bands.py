"""What pictures, table and film show of a mission and of its camera."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest
from matplotlib.figure import Figure

from rti_mpcc.cli import main
from rti_mpcc.report.animation import Stage
from rti_mpcc.report.film import film_of_run
from rti_mpcc.report.mission_bands import draw_bands, draw_ends, name_bands
from rti_mpcc.report.overview import overview_figure
from rti_mpcc.report.table import failure_lines, mission_rows
from rti_mpcc.report.timeline import timeline_figure
from rti_mpcc.report.views import Observer
from rti_mpcc.simulation import (
    RunResult,
    driver_of,
    save_scenario,
    simulate,
    summary,
)
from rti_mpcc.types import MissionResult
from tests.rti_mpcc.report.frames import grey_frame
from tests.rti_mpcc.short_missions import short


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
    assert failure_lines(None) == []


def test_another_try_is_told_and_why_the_first_one_failed(result: RunResult) -> None:
    first = summary(result)["mission"][0]
    steps = [{**first, "result": "BLOCKED", "reason": "a wall"}, {**first, "attempt": 1, "end_s": None}]
    rows = mission_rows(steps)
    assert [rows[0][0], rows[2][0]] == ["step 0: dock", "step 0: dock, try 2"]
    assert rows[2][1] == "SUCCEEDED 0.00 to "
    assert failure_lines(steps) == ["step 0: dock: BLOCKED: a wall"]
    assert failure_lines([{**steps[0], "reason": ""}]) == ["step 0: dock: BLOCKED"]


def test_bands_and_marks(result: RunResult) -> None:
    axes = Figure().add_subplot()
    draw_bands(axes, result)
    room = name_bands(axes, result)
    assert [text.get_text() for text in axes.texts] == ["dock", "wait", "straight"]
    assert len({text.get_position()[1] for text in axes.texts}) == 1
    assert room > 0.0
    assert len(axes.patches) == 3
    assert axes.get_legend_handles_labels()[1] == ["step, succeeded", "end of a wait"]


def test_bands_of_what_failed_is_under_way_and_is_short(result: RunResult) -> None:
    first, wait, move = result.mission
    late = replace(first, result=MissionResult.TIMED_OUT, end=first.begin + 0.2)
    again = replace(first, begin=first.begin + 0.2, end=first.begin + 0.4, attempt=1)
    on = replace(move, result=MissionResult.RUNNING, end=None)
    axes = Figure().add_subplot()
    changed = replace(result, mission=(late, again, wait, on))
    draw_bands(axes, changed, waited="lowered")
    labels = ["step, failed", "step, succeeded", "step, not over", "lowered"]
    assert sorted(axes.get_legend_handles_labels()[1]) == sorted(labels)
    last = axes.patches[-1].get_window_extent().transformed(axes.transData.inverted())
    assert last.x1 == pytest.approx(float(result.truth.times[-1]))
    plain = name_bands(Figure().add_subplot(), result)
    assert name_bands(axes, changed) == 2.0 * plain  # on two lines
    assert [text.get_text() for text in axes.texts] == ["dock: TIMED_OUT", "dock", "wait", "straight"]
    low, high = (text.get_position()[1] for text in axes.texts[:2])
    assert high > low


def test_no_bands_without_a_mission(result: RunResult) -> None:
    axes = Figure().add_subplot()
    without = replace(result, mission=(), mission_result=None)
    draw_bands(axes, without)
    assert name_bands(axes, without) == 0.0
    assert not axes.patches
    assert not axes.texts


def test_ends_of_steps_and_what_is_docked_at(result: RunResult) -> None:
    axes = Figure().add_subplot()
    draw_ends(axes, result)
    assert axes.get_legend_handles_labels()[1] == ["what is docked at", "body at the end of a step"]
    assert len(axes.collections[1].get_paths()) == 3


def test_whole_pictures_are_drawn(result: RunResult) -> None:
    timeline = timeline_figure(result, summary(result))
    timeline.draw_without_rendering()
    first, second = (axes.get_legend() for axes in timeline.axes[:2])
    assert first is not None
    assert second is not None
    marks = {"step, succeeded", "end of a wait", "inside tolerance", "docked"}
    assert {text.get_text() for text in first.get_texts()} == marks | {"true"}
    assert not {text.get_text() for text in second.get_texts()} & marks
    assert [len(axes.patches) for axes in timeline.axes] == [3, 3, 3, 0, 0, 0]
    plane = overview_figure(result)
    plane.draw_without_rendering()
    labels = plane.axes[0].get_legend_handles_labels()[1]
    assert "what is docked at" in labels
    assert "obstacle" not in labels  # what is docked at is drawn as that alone


def test_a_film_shows_the_camera_beside_the_plan(seen: tuple[RunResult, Observer]) -> None:
    run, observer = seen
    frame = grey_frame(1.0, 0)
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
    assert "step 1: undock: TIMED_OUT: it took 1 s" in capsys.readouterr().out


def test_of_a_step_that_is_tried_again_the_last_try_counts(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    again = save_scenario(
        short(name="again", mission=[{"kind": "dock", "timeout": 4.0, "retries": 3}]), tmp_path
    )
    assert main(["run", str(again), "--no-plots", "--out", str(tmp_path / "again")]) == 0
    said = capsys.readouterr().out
    assert "step 0: dock, try 2" in said
    assert "step 0: dock: TIMED_OUT: it took 4 s" in said


def test_a_mission_that_goes_on_after_a_failure_is_none_of_all_steps(tmp_path: Path) -> None:
    late = {"kind": "undock", "distance": 5.0, "timeout": 1.0, "then": "continue"}
    steps = [{"kind": "dock"}, late, {"kind": "wait", "seconds": 0.1}]
    on = save_scenario(short(name="on", mission=steps), tmp_path)
    assert main(["run", str(on), "--no-plots", "--out", str(tmp_path / "on")]) == 1
    told = json.loads((tmp_path / "on" / "summary.json").read_text(encoding="utf-8"))
    assert (told["mission_result"], told["docked"]) == ("SUCCEEDED", True)
