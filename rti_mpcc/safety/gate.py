"""The last check of every command: nothing passes it that is not finite and within the limits."""

from __future__ import annotations

from dataclasses import replace
from math import isfinite

import numpy as np

from rti_mpcc.config import ControllerConfig
from rti_mpcc.model.layout import DELTA, V
from rti_mpcc.safety.ladder import Drive, brake, braking
from rti_mpcc.types import Array, VehicleState


def admitted(drive: Drive, state: Array, measured: VehicleState, config: ControllerConfig) -> Drive:
    """The drive, cut to what may be sent to a vehicle that will be in `state` (6,) when it begins to act.

    Inputs stay within their limits. Speed and steering are not led beyond theirs; where they are outside,
    they return, at the rate limit if that is far. Nor are they led further out than they are measured now.
    """
    if not (isfinite(drive.acceleration) and isfinite(drive.steering_rate)):
        drive = brake(state, braking(config), config)
    limits = config.limits
    a = _within(drive.acceleration, float(state[V]), measured.v, limits.speed, limits.acceleration, config)
    rate = _within(
        drive.steering_rate,
        float(state[DELTA]),
        measured.delta,
        limits.steering,
        limits.steering_rate,
        config,
    )
    return replace(drive, acceleration=a, steering_rate=rate)


def _within(
    slope: float, value: float, measured: float, limit: float, most: float, config: ControllerConfig
) -> float:
    """A slope of at most `most` that keeps `value` within `limit` over a cycle, or brings it back."""
    lowest = float(np.clip((-limit - value) / config.cycle, -most, most))
    highest = float(np.clip((limit - value) / config.cycle, -most, most))
    slope = min(max(slope, lowest), highest)
    if not isfinite(measured) or abs(measured) <= limit:
        return slope
    return min(slope, 0.0) if measured > 0.0 else max(slope, 0.0)
