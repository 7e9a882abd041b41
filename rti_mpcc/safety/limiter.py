"""The limits: the last check of every command, and whether they leave enough to drive with."""

from __future__ import annotations

from math import degrees, isfinite, nan

from rti_mpcc.config import ControllerConfig
from rti_mpcc.model.disturbance import UNDISTURBED, Disturbance
from rti_mpcc.model.layout import DELTA, V
from rti_mpcc.safety.fallback import ControlInput, brake
from rti_mpcc.types import Array


def saturate(
    control: ControlInput,
    state: Array,
    measured: Array | None,
    config: ControllerConfig,
    disturbance: Disturbance = UNDISTURBED,
) -> ControlInput:
    """The command with which `control` acts, (O4), from `state` (6,) on, for a vehicle `measured` (6,).

    Inputs stay within their limits. Speed and steering are not led beyond theirs, nor further out than
    measured; from outside they return, at the rate limit if that is far.
    """
    acting = float(state[DELTA])
    acceleration = disturbance.commanded(control.acceleration)
    steering_rate = disturbance.commanded_rate(control.steering_rate, acting, config.cycle)
    if not (isfinite(acceleration) and isfinite(steering_rate)):
        control = brake(state, config.firm_deceleration, config)
        acceleration, steering_rate = control.acceleration, control.steering_rate
    limits = config.limits
    v, delta = (nan, nan) if measured is None else (float(measured[V]), float(measured[DELTA]))
    speed, steering = (limits.speed, limits.acceleration), (limits.steering, limits.steering_rate)
    a = _within(acceleration, float(state[V]), v, *speed, config, disturbance)
    rate = _within(steering_rate, disturbance.measured_steering(acting), delta, *steering, config)
    return ControlInput(a, rate, control.source)


def _within(
    slope: float,
    value: float,
    measured: float,
    limit: float,
    most: float,
    config: ControllerConfig,
    disturbance: Disturbance = UNDISTURBED,
) -> float:
    """A slope of at most `most` that keeps `value` within `limit` over a cycle, or brings it back."""
    lowest = max(min(disturbance.commanded((-limit - value) / config.cycle), most), -most)
    highest = max(min(disturbance.commanded((limit - value) / config.cycle), most), -most)
    slope = min(max(slope, lowest), highest)
    if not isfinite(measured) or abs(measured) <= limit:
        return slope
    return min(slope, 0.0) if measured > 0.0 else max(slope, 0.0)


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
