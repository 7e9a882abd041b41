"""Bounds of every stage on speed, steering, progress and controls."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, sqrt

import numpy as np

from geometry.compiled import Array1, Out3, kernel
from rti_mpcc.config import ControllerConfig, Progress
from rti_mpcc.model.disturbance import UNDISTURBED, Disturbance
from rti_mpcc.ocp.targets import Target, TargetKind
from rti_mpcc.types import Array


@dataclass(frozen=True, slots=True, kw_only=True)
class StageBounds:
    """Lower and upper bounds: states (N, 2, 3) on v, delta, theta at stages 1..N; controls (N, 2, 3)."""

    states: Array
    controls: Array


def overrun(target: Target, progress: Progress) -> float:
    """How far the progress may pass the stop point [m]: at a path's end not at all, it would end there."""
    return progress.overrun if target.kind is TargetKind.POSE else 0.0


def stage_bounds(
    config: ControllerConfig,
    target: Target,
    direction: int,
    theta: Array,
    *,
    turns: bool = False,
    ends: bool = True,
    most: Array | None = None,
    disturbance: Disturbance = UNDISTURBED,
) -> StageBounds:
    """The limits, one direction of motion, and the speed profile where the configuration has one.

    Args:
        direction: d of the part: d v >= 0.
        theta: (N+1,) progress of the plan that is linearised about [m].
        turns: whether it may also drive against that direction.
        ends: whether the progress ends at the stop point; a cruise that turns to a planned arrival before
            it gets there goes on along the extrapolated path.
        most: (N,) speeds at stages 1..N that the room allows [m/s]; None: any.
        disturbance: the limits are of what is commanded and measured, the bounds of what acts, (O4).
    """
    limits, progress, profile = config.limits, config.progress, config.speed_profile
    d, o, gain = disturbance
    states, controls = np.empty((2, len(theta) - 1, 2, 3))
    _stage_bounds(
        np.ascontiguousarray(theta),
        direction,
        limits.speed,
        np.empty(0) if most is None else most,
        target.stop,
        inf if profile is None else profile.at_stop(target.behind),
        0.0 if profile is None else profile.deceleration,
        limits.speed if turns else 0.0,
        1.0 if profile is not None else progress.headroom,
        config.progress_reverses,
        (o - limits.steering, o + limits.steering),
        target.stop + overrun(target, progress) if ends else inf,
        (d - gain * limits.acceleration, d + gain * limits.acceleration),
        limits.steering_rate,
        states,
        controls,
    )
    return StageBounds(states=states, controls=controls)


@kernel
def _stage_bounds(
    theta: Array1,
    direction: int,
    limit: float,
    most: Array1,
    stop: float,
    final: float,
    deceleration: float,
    back: float,
    headroom: float,
    reverses: bool,
    steering: tuple[float, float],
    farthest: float,
    acceleration: tuple[float, float],
    steering_rate: float,
    states: Out3,
    controls: Out3,
) -> None:
    """With the speed profile v² <= final² + 2 deceleration (theta_stop - theta)."""
    for k in range(len(states)):
        left = max(stop - theta[k + 1], 0.0)
        speed = min(limit, sqrt(final * final + 2.0 * deceleration * left))
        if len(most) > 0:
            speed = min(speed, most[k])
        virtual = headroom * speed
        states[k, 0, 0], states[k, 1, 0] = (-back, speed) if direction > 0 else (-speed, back)
        states[k, 0, 1], states[k, 1, 1] = steering
        states[k, 0, 2], states[k, 1, 2] = -inf, farthest
        controls[k, 0, 0], controls[k, 1, 0] = acceleration
        controls[k, 0, 1], controls[k, 1, 1] = -steering_rate, steering_rate
        controls[k, 0, 2], controls[k, 1, 2] = -virtual if reverses else 0.0, virtual
