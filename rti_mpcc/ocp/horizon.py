"""The stages of a plan, and a plan's way from one grid of stages to another.

The first stage lasts exactly one cycle and carries the command, so that the command neither outlasts
nor undercuts it. The others are equal where they are short; over a long horizon they grow
geometrically, fine where the vehicle is about to be and coarse far ahead.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import brentq

from rti_mpcc.model.bicycle import rates
from rti_mpcc.model.layout import DELTA_DOT, PHI, THETA, THETA_DOT, A, V, X, Y
from rti_mpcc.types import Array, Trajectory

SHORTEST = 0.1
"""Length of the second stage [s] where stages grow; also the longest equal stage."""


def stage_lengths(duration: float, first: float, stages: int) -> Array:
    """Lengths (stages,) [s] that sum up to `duration` [s], the first of them `first` [s].

    A duration shorter than three first stages is stretched to that.
    """
    rest = max(duration, 3.0 * first) - first
    count = stages - 1
    lengths = np.empty(stages)
    lengths[0] = first
    target = rest / SHORTEST
    if target <= count * (1.0 + 1e-6):  # a growth too small to be told from rounding is none
        lengths[1:] = rest / count
        return lengths
    most = max(1.0, target ** (1.0 / (count - 1)) - 1.0)
    growth = brentq(lambda g: np.expm1(count * np.log1p(g)) / g - target, 1e-9, most, xtol=1e-15)
    lengths[1:] = SHORTEST * np.exp(np.log1p(growth) * np.arange(count))
    lengths[1:] *= rest / lengths[1:].sum()
    return lengths


def stage_times(begin: float, lengths: Array) -> Array:
    """Times (N+1,) [s] of the stages' ends, from `begin` [s] on."""
    times = np.empty(len(lengths) + 1)
    times[0] = begin
    np.cumsum(lengths, out=times[1:])
    times[1:] += begin
    return times


def states_at(plan: Trajectory, times: Array, wheelbase: float) -> Array:
    """States (n, 6) of a plan at `times` (n,).

    Within a stage the speed, steering and progress are linear, as they are planned, and the pose is
    the cubic that has the rates of both ends. Behind the plan's end it keeps its last speed and
    heading; before its begin it is held.
    """
    begin, end = plan.times[0], plan.times[-1]
    inside = np.clip(times, begin, end)
    k = np.clip(np.searchsorted(plan.times, inside, side="right") - 1, 0, len(plan.controls) - 1)
    h = plan.times[k + 1] - plan.times[k]
    s = ((inside - plan.times[k]) / h)[:, None]
    left, right = plan.states[k], plan.states[k + 1]
    states = left + s * (right - left)
    pose = [X, Y, PHI]
    slope_left = h[:, None] * rates(left, plan.controls[k], wheelbase)[:, pose]
    slope_right = h[:, None] * rates(right, plan.controls[k], wheelbase)[:, pose]
    rise = (right - left)[:, pose]
    states[:, pose] += s * (1.0 - s) * ((1.0 - s) * (slope_left - rise) - s * (slope_right - rise))
    beyond = np.maximum(times - end, 0.0)
    if beyond.any():
        states[:, X] += beyond * states[:, V] * np.cos(states[:, PHI])
        states[:, Y] += beyond * states[:, V] * np.sin(states[:, PHI])
        states[:, THETA] += beyond * plan.controls[-1, THETA_DOT]
    return states


def controls_over(plan: Trajectory, times: Array) -> Array:
    """Mean controls (n, 3) of a plan over the n stages between `times` (n+1,).

    The means keep the integrals, so that speed, steering and progress agree with `states_at`.
    Outside the plan a and delta_dot are 0; theta_dot is held behind the end.
    """
    lengths = np.diff(plan.times)
    grown = np.zeros((len(plan.times), plan.controls.shape[1]))
    np.cumsum(plan.controls * lengths[:, None], axis=0, out=grown[1:])
    sums = np.stack([np.interp(times, plan.times, grown[:, j]) for j in (A, DELTA_DOT, THETA_DOT)], axis=-1)
    sums[:, THETA_DOT] += np.maximum(times - plan.times[-1], 0.0) * plan.controls[-1, THETA_DOT]
    return np.diff(sums, axis=0) / np.diff(times)[:, None]


def resample(plan: Trajectory, times: Array, wheelbase: float) -> Trajectory:
    """The same motion on another grid `times` (n+1,); the shift of the real-time iteration."""
    return Trajectory(
        times=times, states=states_at(plan, times, wheelbase), controls=controls_over(plan, times)
    )


def read_only(*arrays: Array) -> None:
    """Close arrays that are handed out to writing."""
    for array in arrays:
        array.flags.writeable = False
