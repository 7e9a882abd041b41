"""Pictures of runs in an area: what is solid, what came besides, and the paths that were planned."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure

from geometry import Corridor, Pose2, ReferencePath
from rti_mpcc.errors import InputError
from rti_mpcc.report.animation import write_animation
from rti_mpcc.report.files import write_files
from rti_mpcc.report.film import Film, film_of_run
from rti_mpcc.report.overview import overview_figure
from rti_mpcc.report.scene import Scene, extent
from rti_mpcc.report.table import summary_table
from rti_mpcc.report.timeline import timeline_figure
from rti_mpcc.report.views import Observer, held_by
from rti_mpcc.simulation import RunResult, scenario_from_dict, simulate, summary
from tests.rti_mpcc.planned import OnPlannedPath

PATH = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(1, 0.05, 6.0), (-1, 0.0, 4.0)])
OTHER = ReferencePath.from_segments(Pose2(0.5, 0.0, 0.0), [(1, 0.0, 6.0)])
WALL = np.array([[14.0, -3.0], [14.5, -3.0], [14.5, -2.0], [14.0, -2.0]])
HALL = {
    "name": "hall",
    "start": {"pose": [0.0, 0.0, 0.0]},
    "area": {
        "boundary": [[-5.0, -6.0], [25.0, -6.0], [25.0, 6.0], [-5.0, 6.0]],
        "obstacles": [[[8.0, 4.0], [10.0, 4.0], [10.0, 5.0], [8.0, 5.0]]],
    },
    "goal": {"pose": [PATH.end.x, PATH.end.y, PATH.end.phi]},
    "simulation": {"duration": 2.0, "cycle": 0.1},
}


@pytest.fixture(scope="module")
def looked_at() -> tuple[RunResult, Observer]:
    scenario = scenario_from_dict(HALL)
    observer = Observer(OnPlannedPath(PATH, scenario.controller_config()))
    obstacles_at = lambda now: [WALL] if now > 0.95 else []  # noqa: E731
    return simulate(scenario, controller=observer, obstacles_at=obstacles_at), observer


@pytest.fixture(scope="module")
def run(looked_at: tuple[RunResult, Observer]) -> RunResult:
    return looked_at[0]


@pytest.fixture(scope="module")
def film(looked_at: tuple[RunResult, Observer]) -> Film:
    result, observer = looked_at
    return film_of_run(result, observer.observed)


def legend(figure: Figure) -> set[str]:
    found = figure.axes[0].get_legend()
    assert found is not None
    return {text.get_text() for text in found.get_texts()}


def drawn(figure: Figure, label: str) -> Any:
    return next(one for one in figure.axes[0].get_children() if one.get_label() == label)


def test_overview_shows_what_is_solid_what_came_and_the_path(run: RunResult) -> None:
    assert run.paths == ((0.0, PATH),)
    figure = overview_figure(run)
    labels = {"solid", "obstacle", "path", "body each second", "rear axle, driven", "body at the end", "goal"}
    assert legend(figure) == labels
    (outline,) = drawn(figure, "obstacle").get_paths()
    assert np.asarray(outline.vertices)[:4] == pytest.approx(WALL)


def test_overview_tells_paths_that_were_driven_before(run: RunResult) -> None:
    figure = overview_figure(replace(run, paths=((0.0, PATH), (0.5, OTHER), (1.0, PATH))))
    assert {"path", "earlier path"} <= legend(figure)
    figure = overview_figure(replace(run, paths=()))
    assert not {"path", "earlier path"} & legend(figure)


def test_overview_shows_what_is_driven_and_no_more_than_the_area(run: RunResult) -> None:
    axes = overview_figure(run).axes[0]
    (left, right), (bottom, top) = axes.get_xlim(), axes.get_ylim()
    assert left < run.truth.poses[:, 0].min()
    assert left >= -6.0
    assert right <= 26.0
    assert (bottom >= -7.0, top <= 7.0) == (True, True)


def test_timeline_marks_where_it_was_planned_anew(run: RunResult) -> None:
    figure = timeline_figure(replace(run, paths=((0.0, PATH), (0.5, OTHER))), summary(run))
    axes = next(one for one in figure.axes if one.get_ylabel() == "theta [m]")
    assert {"true", "cusp", "planned anew"} == set(axes.get_legend_handles_labels()[1])
    (cusp,) = (line for line in axes.get_lines() if line.get_label() == "cusp")
    assert np.asarray(cusp.get_xydata()) == pytest.approx(np.array([(0.0, 6.0), (0.5, 6.0)]))


def test_timeline_without_a_path_has_no_cusps(run: RunResult) -> None:
    figure = timeline_figure(replace(run, paths=()), summary(run))
    axes = next(one for one in figure.axes if one.get_ylabel() == "theta [m]")
    assert axes.get_legend_handles_labels()[1] == ["true"]


def test_film_has_the_area_and_each_view_its_path(film: Film, run: RunResult) -> None:
    assert (film.path, film.corridor) == (None, None)
    assert film.area is run.area
    assert all(view.observed.path is PATH for view in film.views)
    assert [len(view.obstacles) for view in film.views] == [0] * 10 + [1] * 11


def test_scene_draws_solid_things_and_the_path_of_the_cycle(film: Film) -> None:
    assert film.area is not None
    hall = Corridor.in_area(film.area)
    views = tuple(
        replace(view, observed=replace(view.observed, path=path, corridor=hall))
        for view, path in ((film.views[0], None), (film.views[1], OTHER), (film.views[-1], PATH))
    )
    scene = Scene(Figure().add_subplot(), replace(film, views=views))
    assert [len(scene.planned.get_segments())] == [0]
    for index, path in ((1, OTHER), (2, PATH)):
        scene.show(index)
        ends = [np.asarray(line)[-1] for line in scene.planned.get_segments()]
        assert ends == [pytest.approx((part.last.x, part.last.y)) for part in path.parts]
    labels = set(scene.axes.get_legend_handles_labels()[1])
    assert {"solid", "path", "obstacle", "body", "goal"} <= labels
    assert "corridor" not in labels
    (wall,) = scene.obstacles.get_paths()
    assert np.asarray(wall.vertices)[:4] == pytest.approx(WALL)


def test_scene_shows_all_that_is_driven_and_stands_in_the_way(film: Film) -> None:
    left, right, bottom, top = extent(film)
    points = np.vstack([*(view.pose[:2] for view in film.views), WALL])
    assert (points > (left, bottom)).all()
    assert (points < (right, top)).all()


def test_without_a_corridor_no_half_plane_is_active(film: Film) -> None:
    command = film.views[5].observed.command
    planes, lack = held_by(command, None, film.config)
    assert len(planes.points) == 0
    assert lack == pytest.approx(np.zeros(len(command.trajectory.states) - 1))


def test_files_and_animation_are_written(film: Film, run: RunResult, tmp_path: Path) -> None:
    written = write_files(run, summary(run), tmp_path)
    assert {file.name for file in written} == {
        "summary.json",
        "trajectory.csv",
        "overview.png",
        "timeline.png",
    }
    short = replace(film, views=film.views[:3], times=film.times[:3])
    write_animation([short], tmp_path / "run.gif")
    assert (tmp_path / "run.gif").stat().st_size > 0


def test_trajectory_far_from_the_origin_keeps_its_digits(run: RunResult, tmp_path: Path) -> None:
    poses = run.truth.poses + np.array([7_008_600_719.29408, -8_722_360_256.93465, 0.0])
    far = replace(run, truth=replace(run.truth, poses=poses))
    write_files(far, summary(run), tmp_path, plots=False)
    row = (tmp_path / "trajectory.csv").read_text().splitlines()[1].split(",")
    assert (float(row[1]), float(row[2])) == (poses[0, 0], poses[0, 1])


def test_table_tells_of_the_planning(run: RunResult) -> None:
    figures = summary(run)
    names = list(summary_table(figures).columns[0].cells)
    assert {"time of planning", "planned anew", "planned way", "cusps of it"} <= set(names)
    none = {**figures, "planning": {"seconds": 0.5, "replans": 0, "length_m": None, "cusps": None}}
    table = summary_table(none)
    rows = dict(zip(table.columns[0].cells, table.columns[1].cells, strict=True))
    assert (rows["planned way"], rows["cusps of it"]) == ("none", "-")


def test_a_film_of_another_run_is_refused(run: RunResult) -> None:
    with pytest.raises(InputError, match=r"observed has 0 cycles"):
        film_of_run(run, [])
