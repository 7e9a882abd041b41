"""Bounds of every stage on speed, steering, progress and controls."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

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
    retreat: float = 0.0,
    reach: float | None = None,
    ends: bool = True,
    most: Array | None = None,
    disturbance: Disturbance = UNDISTURBED,
) -> StageBounds:
    """The limits, one direction of motion, and the speed profile where the configuration has one.

    Args:
        direction: d of the part: d v >= -retreat [m/s].
        theta: (N+1,) progress of the plan that is linearised about [m].
        retreat: speed allowed against the direction [m/s], from `reach` [m] before the stop point on; None:
            `Retries.retreat_reach`.
        ends: whether the progress ends at the stop point; a cruise that turns to a planned arrival before
            it gets there goes on along the extrapolated path.
        most: (N,) speeds at stages 1..N that the room allows [m/s]; None: any.
        disturbance: the limits are of what is commanded and measured, the bounds of what acts, (O4).
    """
    limits, progress, stages = config.limits, config.progress, len(theta) - 1
    speed = np.full(stages, limits.speed)
    profile = config.speed_profile
    if profile is not None:
        final = profile.at_stop(target.behind)
        left = np.maximum(target.stop - theta[1:], 0.0)
        speed = np.minimum(speed, np.sqrt(final**2 + 2.0 * profile.deceleration * left))
    if most is not None:
        speed = np.minimum(speed, most)
    states = np.empty((stages, 2, 3))
    reach = config.retries.retreat_reach if reach is None else reach
    slow = np.where(theta[1:] >= target.stop - reach, min(retreat, limits.speed), 0.0)
    states[:, 0, 0], states[:, 1, 0] = (-slow, speed) if direction > 0 else (-speed, slow)
    d, o, gain = disturbance
    strongest = gain * limits.acceleration
    states[:, 0, 1], states[:, 1, 1] = o - limits.steering, o + limits.steering
    states[:, 0, 2], states[:, 1, 2] = -np.inf, target.stop + overrun(target, progress) if ends else np.inf
    controls = np.empty((stages, 2, 3))
    controls[:, :, 0] = [d - strongest, d + strongest]
    controls[:, :, 1] = [-limits.steering_rate, limits.steering_rate]
    ahead = speed if profile is not None else progress.headroom * speed
    controls[:, 1, 2] = ahead
    controls[:, 0, 2] = -ahead if config.progress_reverses else 0.0
    return StageBounds(states=states, controls=controls)
