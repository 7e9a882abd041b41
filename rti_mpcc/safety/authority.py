"""Whether the drive and the steering are strong enough for what acts beside the commands."""

from __future__ import annotations

from math import degrees

from rti_mpcc.config import ControllerConfig
from rti_mpcc.model.disturbance import Disturbance

AUTHORITY_RESERVE = 0.15
"""Share of a limit that must be left to drive with, beyond what it takes to hold the vehicle on a slope, or
straight: with a fifth of the acceleration it still docks, with a tenth it no longer does."""


def exceeded(disturbance: Disturbance, config: ControllerConfig) -> str:
    """Why the vehicle cannot be driven with this disturbance, or ""."""
    limits, most = config.limits, 1.0 - AUTHORITY_RESERVE
    holding, o = disturbance.commanded(0.0), disturbance.steering
    if abs(holding) > most * limits.acceleration:
        return (
            f"the drive is too weak for the slope: to hold the vehicle takes {holding:+.2f} m/s², "
            f"the limit is {limits.acceleration:.2f} m/s²"
        )
    if abs(o) > most * limits.steering:
        return (
            f"the steering is too far off: to go straight takes {degrees(-o):+.1f} deg, "
            f"the limit is {degrees(limits.steering):.1f} deg"
        )
    return ""
