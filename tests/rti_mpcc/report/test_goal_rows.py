"""The goal in the timeline: errors in the true goal's frame, clipped axes, the filter's status."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from math import degrees, pi
from typing import Any

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.collections import PathCollection
from matplotlib.colors import to_rgb

from estimation import GoalStatus, Judgement, Outcome
from geometry import Pose2
from rti_mpcc.report import style
from rti_mpcc.report.goal_rows import FARTHEST, NAMES, goal_errors_of
from rti_mpcc.report.timeline import timeline_figure
from rti_mpcc.simulation import GoalSource, RunResult, Tracking
from rti_mpcc.types import Array

COMMON = ["v [m/s]", "delta [rad]", "a [m/s²]", "theta [m]", "effective weights", "time a cycle [ms]"]
GOAL = Pose2(20.0, -3.0, 0.5 * pi)


def rows(result: RunResult, figures: dict[str, Any]) -> list[Axes]:
    return timeline_figure(result, figures).axes[4:-2]


def curve(axes: Axes, color: str) -> Array:
    """(m, 2) time and value of the one curve over the cycles in this colour."""
    drawn = [one for one in axes.get_lines() if one.get_color() == color]
    (found,) = [np.asarray(one.get_xydata()) for one in drawn if len(np.asarray(one.get_xdata())) > 2]
    return found


def legend(axes: Axes) -> list[str]:
    found = axes.get_legend()
    assert found is not None
    return [text.get_text() for text in found.get_texts()]


def markers(axes: Axes, color: str) -> Array:
    """(k, 2) time and value of the markers of one colour."""
    drawn = [one for one in axes.collections if isinstance(one, PathCollection)]
    kept = [one for one in drawn if tuple(np.asarray(one.get_facecolor())[0, :3]) == to_rgb(color)]
    return np.concatenate([np.zeros((0, 2)), *[np.asarray(one.get_offsets()) for one in kept]])


def told(stamp: float, offset: Pose2, outcome: Outcome = Outcome.ACCEPTED, goal: Pose2 = GOAL) -> Judgement:
    return Judgement(stamp=stamp, outcome=outcome, pose=goal.compose(offset), nis=1.0)


def known(
    run: RunResult,
    *,
    estimate: Pose2 | None = None,
    aim: Pose2 = GOAL,
    status: GoalStatus | None = GoalStatus.TRACKING,
    covariance: Array | None = None,
    detections: tuple[Judgement, ...] = (),
    moves_at: float = 1e3,
) -> RunResult:
    """The run with one estimate throughout, and GOAL as the true goal, which goes 1 m ahead at `moves_at`."""
    count = len(run.cycles.times)
    goals = np.tile((GOAL.x, GOAL.y, GOAL.phi), (len(run.truth.times), 1))
    goals[run.truth.times >= moves_at - 1e-9, 1] += 1.0
    truth = replace(run.truth, goals=goals, part=np.full_like(run.truth.part, len(run.path.parts) - 1))
    pose = (np.nan,) * 3 if estimate is None else (estimate.x, estimate.y, estimate.phi)
    tracking = Tracking(
        aims=np.tile((aim.x, aim.y, aim.phi), (count, 1)),
        estimates=np.tile(pose, (count, 1)),
        covariances=np.tile(np.full((3, 3), np.nan) if covariance is None else covariance, (count, 1, 1)),
        status=(status,) * count,
        detections=detections,
        arrivals=np.array([judged.stamp for judged in detections]),
    )
    return replace(run, truth=truth, tracking=tracking, goal_source=GoalSource.DETECTED)


def test_rows_are_there_where_a_filter_watched_the_goal(
    watched: RunResult, watched_figures: dict[str, Any], run: RunResult, figures: dict[str, Any]
) -> None:
    figure = timeline_figure(watched, watched_figures)
    assert [axes.get_ylabel() for axes in figure.axes] == [*COMMON[:4], *NAMES, *COMMON[4:]]
    assert {axes.get_xlim() for axes in figure.axes} == {(0.0, watched.truth.times[-1])}
    assert [axes.get_ylabel() for axes in timeline_figure(run, figures).axes] == COMMON


@pytest.mark.parametrize("source", [GoalSource.RAW, GoalSource.KNOWN])
def test_rows_are_left_out_without_a_filter(
    watched: RunResult, watched_figures: dict[str, Any], source: GoalSource
) -> None:
    figure = timeline_figure(replace(watched, goal_source=source), watched_figures)
    assert [axes.get_ylabel() for axes in figure.axes] == COMMON
    assert tuple(figure.get_size_inches()) == (10.0, 12.0)


def test_estimate_band_and_aim_are_in_the_frame_of_the_true_goal(
    run: RunResult, figures: dict[str, Any]
) -> None:
    # The goal looks along y: what is known well along y is known well longitudinally.
    covariance = np.diag([0.04**2, 0.01**2, 0.002**2])
    result = known(
        run,
        estimate=GOAL.compose(Pose2(0.03, -0.02, 0.01)),
        aim=GOAL.compose(Pose2(0.2, 0.1, -0.03)),
        covariance=covariance,
    )
    expected = [(0.03, 0.01, 0.2), (-0.02, 0.04, 0.1), (degrees(0.01), degrees(0.002), degrees(-0.03))]
    for axes, (error, std, aim) in zip(rows(result, figures), expected, strict=True):
        for color, value in ((style.BLUE, error), (style.BLACK, aim)):
            times, values = curve(axes, color).T
            assert times == pytest.approx(run.cycles.times)
            assert values == pytest.approx(np.full_like(values, value), abs=1e-9)
        band = axes.collections[0].get_paths()[0].get_extents()
        assert (band.y0, band.y1) == pytest.approx((error - 3.0 * std, error + 3.0 * std), abs=1e-9)


def test_heading_error_is_the_small_one(run: RunResult, figures: dict[str, Any]) -> None:
    turned = Pose2(GOAL.x, GOAL.y, GOAL.phi - 4.0 * pi + 0.02)
    axes = rows(known(run, estimate=turned, covariance=1e-6 * np.eye(3)), figures)[2]
    assert curve(axes, style.BLUE)[:, 1] == pytest.approx(np.full(len(run.cycles.times), degrees(0.02)))


def test_detections_stand_at_their_stamp_against_the_goal_of_that_time(
    run: RunResult, figures: dict[str, Any]
) -> None:
    detections = (
        told(0.987, Pose2(0.04, -0.03, 0.01), Outcome.ACQUIRED),
        told(2.5, Pose2(1.04, 0.02, 0.0)),
        told(1.5, Pose2(-0.02, 0.06, 0.0), Outcome.REJECTED),
        Judgement(stamp=1.0, outcome=Outcome.REFUSED, reason="told already"),
    )
    axes = rows(known(run, detections=detections, moves_at=2.0), figures)
    assert markers(axes[0], style.GREEN) == pytest.approx(np.array([(0.987, 0.04), (2.5, 0.04)]))
    assert markers(axes[1], style.GREEN) == pytest.approx(np.array([(0.987, -0.03), (2.5, 0.02)]))
    assert markers(axes[0], style.RED) == pytest.approx(np.array([(1.5, -0.02)]))
    assert markers(axes[2], style.GREEN)[0] == pytest.approx((0.987, degrees(0.01)))


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_wrong_detection_is_marked_at_the_edge_and_leaves_the_axis_alone(
    run: RunResult, figures: dict[str, Any], side: float
) -> None:
    good = told(1.0, Pose2(0.1, 0.0, 0.0))
    wrong = told(2.0, Pose2(side * 1.2, 0.01, 0.0), Outcome.REJECTED)
    axes = rows(known(run, detections=(good, wrong)), figures)
    low, high = axes[0].get_ylim()
    assert (low, high) == pytest.approx((-0.11, 0.11))
    ((time, value),) = markers(axes[0], style.RED)
    assert time == 2.0
    assert 0.09 < side * value < 0.11
    assert markers(axes[1], style.RED) == pytest.approx(np.array([(2.0, 0.01)]))
    assert "rejected, farther off" in legend(axes[1])


def test_axes_hold_curves_and_accepted_detections_up_to_a_limit(
    run: RunResult, figures: dict[str, Any]
) -> None:
    aside = GOAL.compose(Pose2(0.4, -0.3, 0.1))
    far = told(1.0, Pose2(0.0, 0.5, 0.0))
    axes = rows(known(run, aim=aside, detections=(far,)), figures)
    assert [one.get_ylim()[1] for one in axes] == pytest.approx([0.44, 0.55, 1.1 * degrees(0.1)])
    tolerance = run.config.goal_tolerance
    axes = rows(known(run), figures)
    assert [one.get_ylim()[1] for one in axes] == pytest.approx(
        [1.65 * tolerance[0], 1.65 * tolerance[1], 1.65 * degrees(tolerance[2])]
    )
    wide = np.diag([1.0, 1.0, 1.0])
    axes = rows(known(run, estimate=GOAL, covariance=wide), figures)
    assert [one.get_ylim()[1] for one in axes] == list(FARTHEST)


def test_stop_on_the_way_does_not_widen_the_axes(run: RunResult, figures: dict[str, Any]) -> None:
    stop = GOAL.compose(Pose2(8.0, 0.0, 0.0))
    axes = rows(known(run, estimate=GOAL, aim=stop, covariance=1e-6 * np.eye(3)), figures)
    assert axes[0].get_ylim()[1] < 0.1


def test_aim_is_not_drawn_before_the_last_part(run: RunResult) -> None:
    result = known(run)
    assert result.tracking is not None
    part = np.where(run.truth.times < 1.0, 0, 1)
    errors = goal_errors_of(replace(result, truth=replace(result.truth, part=part)), result.tracking)
    assert np.isnan(errors.aim[errors.times < 0.95]).all()
    assert not errors.aim[errors.times > 0.95].any()


def test_status_is_the_background_and_only_what_occurred_is_named(
    watched: RunResult, watched_figures: dict[str, Any]
) -> None:
    tracking = watched.tracking
    assert tracking is not None
    names = [status.value for status in GoalStatus]
    axes = rows(watched, watched_figures)
    assert legend(axes[2]) == names
    for one in axes:
        spans = [patch.get_extents().transformed(one.transData.inverted()) for patch in one.patches]
        borders = [0.0, *[watched.cycles.times[tracking.status.index(s)] for s in list(GoalStatus)[1:]]]
        assert [span.x0 for span in spans] == pytest.approx(borders, abs=1e-6)
        assert [span.x1 for span in spans] == pytest.approx([*borders[1:], 7.0], abs=1e-6)


def test_legends_name_everything_once(watched: RunResult, watched_figures: dict[str, Any]) -> None:
    axes = rows(watched, watched_figures)
    assert legend(axes[0]) == ["± 3 sigma", "pose aimed at", "estimate"]
    assert legend(axes[1]) == ["goal tolerance", "accepted", "rejected", "rejected, farther off"]


def test_run_that_never_knew_anything_is_drawn(run: RunResult, figures: dict[str, Any]) -> None:
    result = known(run, status=None)
    figure = timeline_figure(result, figures)
    figure.draw_without_rendering()
    assert len(figure.axes) == 9
    assert not figure.axes[4].patches


def test_nothing_is_cut_off_and_no_legend_covers_another(
    watched: RunResult, watched_figures: dict[str, Any]
) -> None:
    figure = timeline_figure(watched, watched_figures)
    figure.draw_without_rendering()
    boxes = []
    for axes in figure.axes:
        drawn, found = axes.get_tightbbox(), axes.get_legend()
        assert drawn is not None
        assert found is not None
        assert (drawn.x0 >= 0.0, drawn.y0 >= 0.0) == (True, True)
        assert (drawn.x1 <= figure.bbox.x1, drawn.y1 <= figure.bbox.y1) == (True, True)
        assert found.get_window_extent().x0 >= axes.get_window_extent().x1
        boxes.append(found.get_window_extent())
    assert all(upper.y0 >= lower.y1 for upper, lower in pairwise(boxes))
