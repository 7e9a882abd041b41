"""The stages of a plan, and a plan's way from one grid of stages to another.

The first stage lasts exactly one cycle and carries the command, so that the command neither outlasts
nor undercuts it. The others are equal where they are short; over a long horizon they grow
geometrically, fine where the vehicle is about to be and coarse far ahead.
"""

from __future__ import annotations

from math import cos, exp, expm1, hypot, log1p, sin
from typing import NamedTuple

import numpy as np

from geometry.compiled import Array1, Array2, Out1, Out2, inner, kernel
from rti_mpcc.model.bicycle import pose_rate
from rti_mpcc.model.layout import CONTROLS, PHI, POSE, STATES, THETA, THETA_DOT, V, X, Y
from rti_mpcc.types import Array, Trajectory

FINE_STAGE = 0.1
"""Length of the second stage where stages grow; also the longest equal stage [s]."""
MOST_STEPS = 100
"""Of Newton's method for the growth of stages; some 10 are needed."""


class Grid(NamedTuple):
    """Stages: begin and duration of them all [s], length of the first [s], and their number."""

    begin: float
    duration: float
    first: float
    stages: int


class PlanStages(NamedTuple):
    """A plan in the QP's frame: states (N+1, 6), controls (N, 3) and lengths (N,) [s] of its stages."""

    states: Out2
    controls: Out2
    lengths: Out1


@kernel
def stage_lengths(duration: float, first: float, stages: int) -> Out1:
    """Lengths (stages,) [s] of (G1) that sum up to `duration` [s], the first of them `first` [s].

    A duration shorter than three first stages is stretched to that.
    """
    lengths, count, total = np.empty(stages), stages - 1, 0.0
    rest = max(duration, 3.0 * first) - first
    # A growth too small to be told from rounding is none.
    growth = _growth(rest / FINE_STAGE, count) if rest > FINE_STAGE * count * (1.0 + 1e-6) else 0.0
    lengths[0] = first
    for k in range(count):
        lengths[k + 1] = exp(k * log1p(growth))
        total += lengths[k + 1]
    for k in range(count):
        lengths[k + 1] *= rest / total
    return lengths


@inner
def _growth(total: float, count: int) -> float:
    """The g > 0 with 1 + (1 + g) + ... + (1 + g)^(count - 1) = `total` > count.

    Newton's steps from beyond come down to it one by one, as the sum is convex in g.
    """
    g: float = total ** (1.0 / (count - 1)) - 1.0  # the last term alone
    for _ in range(MOST_STEPS):
        grown = expm1(count * log1p(g))
        slope = (count * (grown + 1.0) / (1.0 + g) - grown / g) / g
        step = (grown / g - total) / slope
        g -= step
        if step <= 1e-15 * g:
            break
    return g


@kernel
def stage_times(begin: float, lengths: Array1) -> Out1:
    """Times (N+1,) [s] of the stages' ends, from `begin` [s] on."""
    times, elapsed = np.empty(len(lengths) + 1), 0.0
    times[0] = begin
    for k in range(len(lengths)):
        elapsed += lengths[k]
        times[k + 1] = elapsed + begin
    return times


@kernel
def distances(states: Array2) -> Out1:
    """Distance (n,) [m] that states (n, 6) have driven by each of them, 0 by the first."""
    driven, total = np.zeros(len(states)), 0.0
    for k in range(len(states) - 1):
        total += hypot(states[k + 1, X] - states[k, X], states[k + 1, Y] - states[k, Y])
        driven[k + 1] = total
    return driven


def states_at(plan: Trajectory, times: Array, wheelbase: float) -> Array:
    """States (n, 6) of a plan at `times` (n,), which do not fall.

    Within a stage the speed, steering and progress are linear, as they are planned, and the pose is
    the cubic that has the rates of both ends. Behind the plan's end it keeps its last speed and
    heading; before its begin it is held.
    """
    return interpolated(plan.times, plan.states, plan.controls, times, wheelbase)


def resample(plan: Trajectory, times: Array, wheelbase: float) -> Trajectory:
    """The same motion on another grid `times` (n+1,), which rise.

    Controls are means over each stage: they keep the integrals, so that speed, steering and progress agree
    with `states_at`. Outside the plan a and delta_dot are 0; theta_dot is held behind the end.
    """
    states, controls = _resample(plan.times, plan.states, plan.controls, times, wheelbase)
    return Trajectory(times=times, states=states, controls=controls)


@kernel
def shift(
    own: Array1, states: Array2, controls: Array2, grid: Grid, wheelbase: float
) -> tuple[Out1, Out2, Out2, Out1]:
    """The shift of the real-time iteration: times, states and controls of a plan with the times `own`,
    resampled on the stages of a grid, and the lengths (N,) [s] of these."""
    lengths = stage_lengths(grid.duration, grid.first, grid.stages)
    times = stage_times(grid.begin, lengths)
    resampled, mean = _resample(own, states, controls, times, wheelbase)
    return times, resampled, mean, lengths


@inner
def _share(own: Array, k: int, time: float) -> float:
    """How much of stage k of a plan with the times `own` is over at `time`, 0 and 1 outside of it."""
    share: float = (time - own[k]) / (own[k + 1] - own[k])
    return min(max(share, 0.0), 1.0)


@kernel
def interpolated(own: Array1, states: Array2, controls: Array2, times: Array1, wheelbase: float) -> Out2:
    """What `states_at` returns, of a plan with the times `own` (N+1,)."""
    found = np.empty((len(times), STATES))
    last, k = len(own) - 1, 0
    for i in range(len(times)):
        while k < last - 1 and own[k + 1] <= times[i]:
            k += 1
        h, s = own[k + 1] - own[k], _share(own, k, times[i])
        for j in range(STATES):
            found[i, j] = states[k, j] + s * (states[k + 1, j] - states[k, j])
        # Hermite's cubic: what it has beyond the straight line.
        begin, end = pose_rate(states[k], wheelbase), pose_rate(states[k + 1], wheelbase)
        for j in range(POSE):
            rise = states[k + 1, j] - states[k, j]
            found[i, j] += s * (1.0 - s) * ((1.0 - s) * (h * begin[j] - rise) - s * (h * end[j] - rise))
        beyond = times[i] - own[last]
        if beyond > 0.0:
            found[i, X] += beyond * found[i, V] * cos(found[i, PHI])
            found[i, Y] += beyond * found[i, V] * sin(found[i, PHI])
            found[i, THETA] += beyond * controls[last - 1, THETA_DOT]
    return found


@kernel
def _resample(
    own: Array1, states: Array2, controls: Array2, times: Array1, wheelbase: float
) -> tuple[Out2, Out2]:
    mean = np.empty((len(times) - 1, CONTROLS))
    last, k = len(own) - 1, 0
    gone = np.zeros(CONTROLS)  # integrals up to stage k, up to the time before and up to this one
    before, here = np.zeros(CONTROLS), np.zeros(CONTROLS)
    for i in range(len(times)):
        while k < last - 1 and own[k + 1] <= times[i]:
            for j in range(CONTROLS):
                gone[j] += (own[k + 1] - own[k]) * controls[k, j]
            k += 1
        s = _share(own, k, times[i])
        for j in range(CONTROLS):
            here[j] = gone[j] + s * (own[k + 1] - own[k]) * controls[k, j]
        here[THETA_DOT] += max(times[i] - own[last], 0.0) * controls[last - 1, THETA_DOT]
        for j in range(CONTROLS):
            if i > 0:
                mean[i - 1, j] = (here[j] - before[j]) / (times[i] - times[i - 1])
            before[j] = here[j]
    return interpolated(own, states, controls, times, wheelbase), mean


def read_only(*arrays: Array) -> None:
    """Close arrays that are handed out to writing."""
    for array in arrays:
        array.flags.writeable = False
