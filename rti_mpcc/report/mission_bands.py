"""What pictures of a run show of its mission."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection

from geometry import Pose2
from rti_mpcc.model.footprint import body_polygons
from rti_mpcc.report import style
from rti_mpcc.simulation import RunResult
from rti_mpcc.simulation.mission import body_at
from rti_mpcc.simulation.plant import SAME_TIME
from rti_mpcc.types import MissionResult

LOWERED = "end of a wait"
"""Label of the mark at the end of each wait."""
_PALE = 0.12
_OVER = {MissionResult.SUCCEEDED: style.GREEN, MissionResult.RUNNING: style.GREY}
"""Colours of steps by what they came to; any other is red."""


def draw_bands(axes: Axes, result: RunResult, *, named: bool = False) -> None:
    """A band for each step, in the colour of what it came to, and a mark at the end of each wait.

    Args:
        named: the kinds of the steps stand above the axes.
    """
    last, waited = float(result.truth.times[-1]), LOWERED
    for record in result.mission:
        end = last if record.end is None else record.end
        color = _OVER.get(record.result, style.RED)
        axes.axvspan(record.begin, end, facecolor=color, edgecolor=color, alpha=_PALE, linewidth=0.8)
        axes.axvline(record.begin, color=style.GREY, linewidth=0.6)
        if named:
            place = (0.5 * (record.begin + end), 1.02)
            axes.text(
                *place, record.kind, transform=axes.get_xaxis_transform(), ha="center", fontsize="small"
            )
        if record.kind == "wait" and record.end is not None:
            axes.axvline(end, color=style.ORANGE, linestyle="dashed", linewidth=1.2, label=waited)
            waited = "_"


def draw_ends(axes: Axes, result: RunResult) -> None:
    """What is docked at, and the body where each step of the mission ended."""
    body = result.scenario.goal.body
    if body is not None:
        x, y, phi = result.truth.goals[-1].tolist()
        outline = body_at(np.array(body), Pose2(x, y, phi))
        look: dict[str, Any] = {"facecolors": style.PINK, "edgecolors": style.BLACK, "alpha": 0.5}
        axes.add_collection(PolyCollection([outline], label="what is docked at", **look))
    ends = [record.end for record in result.mission if record.end is not None]
    if ends:
        rows = np.searchsorted(result.truth.times, np.array(ends) - SAME_TIME)
        poses = result.truth.poses[np.minimum(rows, len(result.truth.times) - 1)]
        bodies = list(body_polygons(poses, result.config.vehicle))
        line: dict[str, Any] = {"facecolors": "none", "edgecolors": style.GREEN, "linewidths": 1.4}
        axes.add_collection(PolyCollection(bodies, label="body at the end of a step", zorder=3, **line))
