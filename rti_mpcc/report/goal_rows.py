"""Rows of the timeline: what detections told of the goal, against the true goal and in its frame."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from estimation import GoalStatus, Judgement, stds_in
from rti_mpcc.report import style
from rti_mpcc.simulation import GoalSource, RunResult, Tracking
from rti_mpcc.simulation.goal_metrics import errors_to, rows_at
from rti_mpcc.types import Array

NAMES = ("goal error\nlongitudinal [m]", "goal error\nlateral [m]", "goal error\nheading [deg]")
"""What the rows show: of all that was known of the goal, the error to the true one, in its frame."""
SIGMAS = 3.0
"""Half the width of the band around the estimate [standard deviations]."""
FARTHEST = (1.0, 1.0, 30.0)
"""No row reaches farther than this [m], [m], [deg]."""
_UNITS = np.array([1.0, 1.0, 180.0 / np.pi])
_ROOM = 1.1
_TOLERANCES = 1.5
"""Each row shows at least so many times the goal tolerance."""
_SHADES = {
    GoalStatus.SEARCHING: (style.GREY, 0.3),
    GoalStatus.TRACKING: (style.SKY, 0.1),
    GoalStatus.COASTING: (style.ORANGE, 0.25),
    GoalStatus.LOST: (style.PINK, 0.35),
}
_TAKEN = ("accepted", style.GREEN, ".")
_REJECTED = ("rejected", style.RED, "x")
_AT_EDGE = 0.95
"""Where the marker of a detection beyond the axis stands [share of the axis]."""
_SIZE = 14.0
"""Area of a marker [points²]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class GoalErrors:
    """Errors to the true goal at the same time, in its frame: columns [m], [m], [deg].

    Attributes:
        times: (m,) of the cycles [s].
        estimate, spread: (m, 3) the estimate and its standard deviations; NaN without one.
        aim: (m, 3) the pose made for; NaN before the last part of the route, where that is a cusp.
        stamps: (k,) of the detections that say something about the goal [s].
        detections: (k, 3) of these.
        accepted: (k,) whether the estimate took them in.
    """

    times: Array
    estimate: Array
    spread: Array
    aim: Array
    stamps: Array
    detections: Array
    accepted: NDArray[np.bool_]


def has_goal_rows(result: RunResult) -> bool:
    """Whether a filter watched the goal in this run."""
    return result.tracking is not None and result.goal_source is GoalSource.DETECTED


def draw_goal_rows(rows: Sequence[Axes], result: RunResult) -> None:
    """Fill three axes: longitudinal, lateral, heading. Each legend names a third of what all three show."""
    tracking = result.tracking
    assert tracking is not None
    errors = goal_errors_of(result, tracking)
    tolerance = np.array(result.config.goal_tolerance) * _UNITS
    reach, end = _reach(errors, tolerance), float(result.truth.times[-1])
    for column, axes in enumerate(rows):
        _draw_status(axes, errors.times, tracking.status, end, named=column == 2)
        _draw_curves(axes, errors, column, named=column == 0)
        for side in (-1.0, 1.0):
            label = "goal tolerance" if side > 0.0 and column == 1 else None
            axes.axhline(
                side * tolerance[column], color=style.GREY, linestyle="dashdot", linewidth=0.8, label=label
            )
        _draw_detections(axes, errors, column, reach, named=column == 1)
        axes.set_ylim(-reach[column], reach[column])
        axes.set_ylabel(NAMES[column])


def goal_errors_of(result: RunResult, tracking: Tracking) -> GoalErrors:
    """Everything known of the goal, set against the truth; a detection at its stamp."""
    truth, times = result.truth, result.cycles.times
    rows = rows_at(truth, times)
    goals = truth.goals[rows]
    on_last_part = result.on_last_part(rows)
    aim = np.where(on_last_part[:, None], errors_to(goals, tracking.aims), np.nan) * _UNITS
    told = [judged for judged in tracking.detections if judged.pose is not None]
    stamps = np.array([judged.stamp for judged in told], dtype=np.float64)
    poses = np.array([_triple(judged) for judged in told], dtype=np.float64).reshape(-1, 3)
    return GoalErrors(
        times=times,
        estimate=errors_to(goals, tracking.estimates) * _UNITS,
        spread=stds_in(goals, tracking.covariances) * _UNITS,
        aim=aim,
        stamps=stamps,
        detections=errors_to(truth.goals[rows_at(truth, stamps)], poses) * _UNITS,
        accepted=np.array([judged.accepted for judged in told], dtype=np.bool_),
    )


def _triple(judged: Judgement) -> tuple[float, float, float]:
    pose = judged.pose
    assert pose is not None
    return pose.x, pose.y, pose.phi


def _reach(errors: GoalErrors, tolerance: Array) -> Array:
    """(3,) where the axes end: curves and accepted detections lie within, rejected ones need not."""
    bands = np.abs(errors.estimate) + SIGMAS * errors.spread
    # What is farther off is a stop on the way that is made for, and not the goal.
    aims = errors.aim[(np.abs(errors.aim) <= FARTHEST).all(axis=1)]
    shown = np.concatenate([bands, aims, errors.detections[errors.accepted], np.zeros((1, 3))])
    largest = np.max(np.abs(np.nan_to_num(shown)), axis=0)
    reach: Array = np.minimum(_ROOM * np.maximum(largest, _TOLERANCES * tolerance), FARTHEST)
    return reach


def _draw_curves(axes: Axes, errors: GoalErrors, column: int, *, named: bool) -> None:
    middle, half = errors.estimate[:, column], SIGMAS * errors.spread[:, column]
    axes.fill_between(
        errors.times,
        middle - half,
        middle + half,
        color=style.BLUE,
        alpha=0.4,
        linewidth=0.0,
        label=f"± {SIGMAS:g} sigma" if named else None,
    )
    aim = errors.aim[:, column]
    axes.plot(errors.times, aim, color=style.BLACK, linewidth=0.8, label="pose aimed at" if named else None)
    axes.plot(errors.times, middle, color=style.BLUE, linewidth=1.2, label="estimate" if named else None)


def _draw_detections(axes: Axes, errors: GoalErrors, column: int, reach: Array, *, named: bool) -> None:
    """Markers at the stamps; what lies beyond the axis is a triangle at its edge."""
    values, edge = errors.detections[:, column], float(reach[column])
    for (name, color, marker), kind in ((_TAKEN, errors.accepted), (_REJECTED, ~errors.accepted)):
        inside = kind & (np.abs(values) <= edge)
        # Named where any row has one: the legend stands beside one row for all three.
        label = name if named and kind.any() else None
        axes.scatter(errors.stamps[inside], values[inside], s=_SIZE, color=color, marker=marker, label=label)
        far = kind & (np.abs(errors.detections) > reach).any(axis=1)
        label = f"{name}, farther off" if named and far.any() else None
        for side, triangle in ((1.0, "^"), (-1.0, "v")):
            out = kind & (side * values > edge)
            places = np.full(np.count_nonzero(out), _AT_EDGE * side * edge)
            axes.scatter(errors.stamps[out], places, s=_SIZE, color=color, marker=triangle, label=label)
            label = None


def _draw_status(
    axes: Axes, times: Array, statuses: Sequence[GoalStatus | None], end: float, *, named: bool
) -> None:
    """The filter's status as the background."""
    missing = set(_SHADES) if named else set()
    for begin, until, status in _spans(times, statuses, end):
        color, alpha = _SHADES[status]
        label = status.value if status in missing else None
        missing.discard(status)
        axes.axvspan(begin, until, color=color, alpha=alpha, linewidth=0.0, zorder=0, label=label)


def _spans(
    times: Array, statuses: Sequence[GoalStatus | None], end: float
) -> Iterator[tuple[float, float, GoalStatus]]:
    """Begin, end [s] and status of each stretch of cycles with one status; the last until `end` [s]."""
    begins = [k for k, status in enumerate(statuses) if k == 0 or status is not statuses[k - 1]]
    borders = [*times[begins].tolist(), end]
    for place, begin in enumerate(begins):
        status = statuses[begin]
        if status is not None:
            yield borders[place], borders[place + 1], status
