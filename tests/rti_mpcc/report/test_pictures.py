"""The pictures show what they promise."""

from __future__ import annotations

import sys
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure

from estimation import Judgement, Outcome
from geometry import Pose2
from rti_mpcc.model.footprint import body_polygons
from rti_mpcc.report.overview import overview_figure
from rti_mpcc.report.timeline import timeline_figure
from rti_mpcc.simulation import GoalSource, RunResult


def collection(figure: Figure, label: str) -> Any:
    return next(one for one in figure.axes[0].collections if one.get_label() == label)


def test_overview_shows_path_corridor_bodies_goal_and_obstacles(run: RunResult) -> None:
    figure = overview_figure(run)
    (axes,) = figure.axes
    legend = axes.get_legend()
    assert legend is not None
    labels = {text.get_text() for text in legend.get_texts()}
    assert {"path", "corridor", "obstacle", "goal", "body each second", "body at the end"} <= labels
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("x [m]", "y [m]")
    assert axes.get_aspect() == 1.0
    # At 0, 1, 2, 3 s and at the end.
    assert len(collection(figure, "body each second").get_paths()) == 5


def test_goal_body_stands_at_the_goal(run: RunResult) -> None:
    shape = collection(overview_figure(run), "goal")
    assert isinstance(shape, PolyCollection)
    corners = np.asarray(shape.get_paths()[0].vertices)[:4]
    x, y, phi = run.truth.goals[-1]
    ahead = 0.5 * (3.6775 - 0.8027)
    assert corners.mean(axis=0) == pytest.approx((x + ahead * np.cos(phi), y + ahead * np.sin(phi)), abs=1e-9)


def goal_labels(figure: Figure) -> list[str]:
    """What the legend says of goals and detections."""
    legend = figure.axes[0].get_legend()
    assert legend is not None
    labels = [text.get_text() for text in legend.get_texts()]
    return [label for label in labels if "goal" in label or "detection" in label]


def test_goals_before_and_after_a_move_planned_goal_and_detections(watched: RunResult) -> None:
    figure = overview_figure(watched)
    assert goal_labels(figure) == [
        "goal before it moved",
        "goal",
        "planned goal",
        "detection, accepted",
        "detection, rejected",
    ]
    tracking = watched.tracking
    assert tracking is not None
    for accepted, label in ((True, "detection, accepted"), (False, "detection, rejected")):
        poses = [judged.pose for judged in tracking.detections if judged.accepted is accepted]
        expected = np.array([(pose.x, pose.y) for pose in poses if pose is not None])
        assert np.asarray(collection(figure, label).get_offsets()) == pytest.approx(expected)


def test_each_goal_is_drawn_where_it_was(watched: RunResult) -> None:
    figure = overview_figure(watched)
    first, last = watched.truth.goals[0], watched.truth.goals[-1]
    planned = Pose2(*first.tolist()).compose(Pose2(0.4, -0.3, 0.1))
    wanted = {
        "goal before it moved": first,
        "goal": last,
        "planned goal": np.array([planned.x, planned.y, planned.phi]),
    }
    for label, pose in wanted.items():
        (path,) = collection(figure, label).get_paths()
        (body,) = body_polygons(pose[None], watched.config.vehicle)
        assert np.asarray(path.vertices)[:4] == pytest.approx(body)


def test_known_goal_has_no_planned_one(watched: RunResult, run: RunResult) -> None:
    assert goal_labels(overview_figure(run)) == ["goal"]
    source = replace(watched, goal_source=GoalSource.KNOWN, tracking=None)
    assert goal_labels(overview_figure(source)) == ["goal before it moved", "goal"]


def test_wild_detection_does_not_widen_the_view(watched: RunResult) -> None:
    tracking = watched.tracking
    assert tracking is not None
    wild = Judgement(stamp=1.0, outcome=Outcome.REJECTED, pose=Pose2(500.0, 0.0, 0.0))
    wilder = replace(watched, tracking=replace(tracking, detections=(*tracking.detections, wild)))
    before, after = overview_figure(watched), overview_figure(wilder)
    assert before.axes[0].get_xlim() == after.axes[0].get_xlim()
    assert tuple(before.get_size_inches()) == tuple(after.get_size_inches())


def test_everything_drawn_lies_in_view_and_the_legend_beside_it(run: RunResult) -> None:
    figure = overview_figure(run)
    figure.draw_without_rendering()
    (axes,) = figure.axes
    for line in run.corridors[0][1].lines(1)[0]:
        assert (line[:, 0] >= axes.get_xlim()[0]).all()
        assert (line[:, 0] <= axes.get_xlim()[1]).all()
    legend = axes.get_legend()
    assert legend is not None
    assert legend.get_window_extent().x0 >= axes.get_window_extent().x1
    # Nothing of it is cut off by the edges of the picture.
    whole, drawn = figure.bbox, axes.get_tightbbox()
    assert drawn is not None
    assert (drawn.x0 >= whole.x0, drawn.y0 >= whole.y0) == (True, True)
    assert (drawn.x1 <= whole.x1, drawn.y1 <= whole.y1) == (True, True)


def test_timeline_shares_its_time_axis_and_names_units(run: RunResult, figures: dict[str, Any]) -> None:
    figure = timeline_figure(run, figures)
    names = ["v [m/s]", "delta [rad]", "a [m/s²]", "theta [m]", "effective weights", "time a cycle [ms]"]
    assert [axes.get_ylabel() for axes in figure.axes] == names
    assert {axes.get_xlim() for axes in figure.axes} == {(0.0, run.truth.times[-1])}
    assert figure.axes[-1].get_xlabel() == "time [s]"


@pytest.mark.parametrize(("tolerance", "dock", "marks"), [(None, None, 0), (1.0, None, 1), (1.0, 2.0, 2)])
def test_timeline_marks_arrival_and_docking(
    run: RunResult, figures: dict[str, Any], tolerance: float | None, dock: float | None, marks: int
) -> None:
    times = {"time_to_tolerance_s": tolerance, "time_to_dock_s": dock}
    figure = timeline_figure(run, {**figures, **times})
    for axes in figure.axes:
        names = [line.get_label() for line in axes.get_lines()]
        assert sum(name in ("inside tolerance", "docked") for name in names) == marks


def test_pictures_need_no_pyplot(run: RunResult, figures: dict[str, Any]) -> None:
    timeline_figure(run, figures).draw_without_rendering()
    assert "matplotlib.pyplot" not in sys.modules
