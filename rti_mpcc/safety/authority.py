"""Whether the drive and the steering are strong enough for what acts beside the commands."""

from __future__ import annotations

from math import degrees

from rti_mpcc.config import ControllerConfig
from rti_mpcc.model.disturbance import Disturbance

LEAST = 0.05
"""Share of a limit that must be left to move the vehicle with, beyond what it takes to hold it."""


def exceeded(disturbance: Disturbance, config: ControllerConfig) -> str:
    """Why the vehicle cannot be held or steered, or ""."""
    limits = config.limits
    d, o = disturbance
    if abs(d) > (1.0 - LEAST) * limits.acceleration:
        return (
            f"the drive cannot hold the vehicle: {-d:+.2f} m/s² are needed against the slope, "
            f"the limit is {limits.acceleration:.2f} m/s²"
        )
    if abs(o) > (1.0 - LEAST) * limits.steering:
        return (
            f"the steering cannot hold a straight line: {degrees(-o):+.1f} deg are needed, "
            f"the limit is {degrees(limits.steering):.1f} deg"
        )
    return ""
