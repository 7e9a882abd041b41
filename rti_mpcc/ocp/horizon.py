"""The stages of a plan, and a plan's way from one grid of stages to another.

The first stage lasts exactly one cycle and carries the command, so that the command neither outlasts
nor undercuts it. The others are equal where they are short; over a long horizon they grow
geometrically, fine where the vehicle is about to be and coarse far ahead.
"""

from __future__ import annotations

from math import expm1, log1p
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rti_mpcc.model.bicycle import pose_rates
from rti_mpcc.model.layout import PHI, POSE, THETA, THETA_DOT, V, X, Y
from rti_mpcc.types import Array, Trajectory

MOST_STEPS = 100
"""Of Newton's method for the growth of stages; some 10 are needed."""


def stage_lengths(duration: float, first: float, stages: int, fine: float) -> Array:
    """Lengths (stages,) [s] that sum up to `duration` [s], the first of them `first` [s].

    A duration shorter than three first stages is stretched to that. Stages are equal up to `fine` [s];
    where they grow it is the second one's.
    """
    rest = max(duration, 3.0 * first) - first
    count = stages - 1
    lengths = np.empty(stages)
    lengths[0] = first
    target = rest / fine
    if target <= count * (1.0 + 1e-6):  # a growth too small to be told from rounding is none
        lengths[1:] = rest / count
        return lengths
    lengths[1:] = np.exp(log1p(_growth(target, count)) * np.arange(count))
    lengths[1:] *= rest / lengths[1:].sum()
    return lengths


def _growth(total: float, count: int) -> float:
    """The g > 0 with 1 + (1 + g) + ... + (1 + g)^(count - 1) = `total` > count.

    Newton's steps from beyond come down to it one by one, as the sum is convex in g.
    """
    g = float(total ** (1.0 / (count - 1)) - 1.0)  # the last term alone
    for _ in range(MOST_STEPS):
        grown = expm1(count * log1p(g))
        slope = (count * (grown + 1.0) / (1.0 + g) - grown / g) / g
        step = (grown / g - total) / slope
        g -= step
        if step <= 1e-15 * g:
            break
    return g


def stage_times(begin: float, lengths: Array) -> Array:
    """Times (N+1,) [s] of the stages' ends, from `begin` [s] on."""
    times = np.empty(len(lengths) + 1)
    times[0] = begin
    np.cumsum(lengths, out=times[1:])
    times[1:] += begin
    return times


class Marks(NamedTuple):
    """Where times (n,) lie in a plan: stage (n,), share of it that is over (n,), and time after its end."""

    stage: NDArray[np.int64]
    share: Array
    lengths: Array  # (N,) of the plan's stages [s]
    beyond: Array | None  # (n,) [s]; None: at no time

    @classmethod
    def of(cls, plan: Trajectory, times: Array) -> Marks:
        """Marks of `times`; before its begin and behind its end a plan is held where it is."""
        own = plan.times
        late = times[-1] > own[-1] or times[0] < own[0]
        inside = np.minimum(np.maximum(times, own[0]), own[-1]) if late else times
        stage = own[1:-1].searchsorted(inside, side="right")
        lengths = own[1:] - own[:-1]
        share = (inside - own[stage]) / lengths[stage]
        beyond = np.maximum(times - own[-1], 0.0) if times[-1] > own[-1] else None
        return cls(stage, share, lengths, beyond)


def states_at(plan: Trajectory, times: Array, wheelbase: float) -> Array:
    """States (n, 6) of a plan at `times` (n,), which do not fall.

    Within a stage the speed, steering and progress are linear, as they are planned, and the pose is
    the cubic that has the rates of both ends. Behind the plan's end it keeps its last speed and
    heading; before its begin it is held.
    """
    return _states(plan, Marks.of(plan, times), wheelbase)


def _states(plan: Trajectory, marks: Marks, wheelbase: float) -> Array:
    k, s = marks.stage, marks.share[:, None]
    rise = (plan.states[1:] - plan.states[:-1])[k]
    states: Array = plan.states[k] + s * rise
    # Hermite's cubic: what it has beyond the straight line.
    slopes, h = pose_rates(plan.states, wheelbase), marks.lengths[:, None]
    left, right = slopes[:-1] * h, slopes[1:] * h
    pose = rise[:, :POSE]
    states[:, :POSE] += s * (1.0 - s) * ((1.0 - s) * (left[k] - pose) - s * (right[k] - pose))
    if marks.beyond is not None:
        states[:, X] += marks.beyond * states[:, V] * np.cos(states[:, PHI])
        states[:, Y] += marks.beyond * states[:, V] * np.sin(states[:, PHI])
        states[:, THETA] += marks.beyond * plan.controls[-1, THETA_DOT]
    return states


def controls_over(plan: Trajectory, times: Array) -> Array:
    """Mean controls (n, 3) of a plan over the n stages between `times` (n+1,).

    The means keep the integrals, so that speed, steering and progress agree with `states_at`.
    Outside the plan a and delta_dot are 0; theta_dot is held behind the end.
    """
    return _controls(plan, Marks.of(plan, times), times)


def _controls(plan: Trajectory, marks: Marks, times: Array) -> Array:
    gains = plan.controls * marks.lengths[:, None]
    sums = np.add.accumulate(gains, axis=0)
    sums -= gains
    grown = sums[marks.stage] + marks.share[:, None] * gains[marks.stage]
    if marks.beyond is not None:
        grown[:, THETA_DOT] += marks.beyond * plan.controls[-1, THETA_DOT]
    controls: Array = (grown[1:] - grown[:-1]) / (times[1:] - times[:-1])[:, None]
    return controls


def resample(plan: Trajectory, times: Array, wheelbase: float) -> Trajectory:
    """The same motion on another grid `times` (n+1,); the shift of the real-time iteration."""
    marks = Marks.of(plan, times)
    return Trajectory(
        times=times, states=_states(plan, marks, wheelbase), controls=_controls(plan, marks, times)
    )


def read_only(*arrays: Array) -> None:
    """Close arrays that are handed out to writing."""
    for array in arrays:
        array.flags.writeable = False
