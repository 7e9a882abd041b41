"""What pictures of a run show of its mission."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection

from geometry import Pose2
from geometry.outline import placed
from rti_mpcc.model.footprint import body_polygons
from rti_mpcc.planning.agenda import StepRecord
from rti_mpcc.report import style
from rti_mpcc.simulation import RunResult
from rti_mpcc.simulation.goal_metrics import rows_at
from rti_mpcc.simulation.plant import SAME_TIME
from rti_mpcc.types import Array, MissionResult

LOWERED = "end of a wait"
"""Label of the mark at the end of each wait."""
_PALE = 0.12
_OVER = {
    MissionResult.SUCCEEDED: (style.GREEN, "step, succeeded"),
    MissionResult.RUNNING: (style.GREY, "step, not over"),
}
_FAILED = (style.RED, "step, failed")
"""Colours and labels of steps by what they came to."""
BAND_LABELS = tuple(label for _, label in (*_OVER.values(), _FAILED))
_LINE, _FIRST_LINE = 0.1, 1.02
"""Of the names above the axes: distance of two lines, and height of the first one, in heights of the axes."""
_LETTER = 0.012
"""Width of a letter of a name, in widths of the axes."""
_POINTS = 12.0
"""Height of a line of names [points]."""


def draw_bands(axes: Axes, result: RunResult, *, waited: str = LOWERED) -> None:
    """A band for each step, in the colour of what it came to, and a mark at the end of each wait.

    Args:
        waited: label of that mark.
    """
    last = float(result.truth.times[-1])
    for record in result.mission:
        color, label = _OVER.get(record.result, _FAILED)
        if label in axes.get_legend_handles_labels()[1]:
            label = "_"
        begin, end = _span(record, last)
        axes.axvspan(begin, end, facecolor=color, edgecolor=color, alpha=_PALE, linewidth=0.8, label=label)
        axes.axvline(begin, color=style.GREY, linewidth=0.6)
        if record.kind == "wait" and record.end is not None:
            axes.axvline(end, color=style.ORANGE, linestyle="dashed", linewidth=1.2, label=waited)
            waited = "_"


def name_bands(axes: Axes, result: RunResult) -> float:
    """The kinds of the steps above the axes, and the results of those that failed, on as many lines as they
    need; returns how much room they take there [points]."""
    last = float(result.truth.times[-1])
    names = [_name(record) for record in result.mission]
    middles = [0.5 * sum(_span(record, last)) for record in result.mission]
    lines = _lines(names, [middle / max(last, SAME_TIME) for middle in middles])
    for name, middle, line in zip(names, middles, lines, strict=True):
        place = (middle, _FIRST_LINE + line * _LINE)
        axes.text(*place, name, transform=axes.get_xaxis_transform(), ha="center", fontsize="small")
    return _POINTS * (1 + max(lines)) if lines else 0.0


def _name(record: StepRecord) -> str:
    return record.kind if record.result in _OVER else f"{record.kind}: {record.result.value}"


def _span(record: StepRecord, last: float) -> tuple[float, float]:
    return record.begin, last if record.end is None else record.end


def _lines(names: Sequence[str], middles: Sequence[float]) -> list[int]:
    """The line of each name, 0 the lowest, so that none lies over another; `middles` are from 0 to 1."""
    free: list[float] = []  # from where on each line is
    found = []
    for name, middle in zip(names, middles, strict=True):
        half = 0.5 * _LETTER * (len(name) + 1)
        fits = [line for line, begin in enumerate(free) if begin <= middle - half]
        line = fits[0] if fits else len(free)
        free[line : line + 1] = [middle + half]
        found.append(line)
    return found


def docked_at(result: RunResult) -> Array | None:
    """Outline (k, 2) [m] of what is docked at, where it is at the end of the run, or None."""
    body = result.scenario.goal.body
    return None if body is None else placed(body, Pose2(*result.truth.goals[-1].tolist()))


def draw_ends(axes: Axes, result: RunResult) -> None:
    """What is docked at, and the body where each step of the mission ended."""
    outline = docked_at(result)
    if outline is not None:
        look: dict[str, Any] = {"facecolors": style.PINK, "edgecolors": style.BLACK}
        axes.add_collection(PolyCollection([outline], label="what is docked at", zorder=1.5, **look))
    ends = [record.end for record in result.mission if record.end is not None]
    if ends:
        poses = result.truth.poses[rows_at(result.truth, np.array(ends))]
        bodies = list(body_polygons(poses, result.config.vehicle))
        line: dict[str, Any] = {"facecolors": "none", "edgecolors": style.GREEN, "linewidths": 1.4}
        axes.add_collection(PolyCollection(bodies, label="body at the end of a step", zorder=3, **line))
