"""The ladder: which plan is driven, and what is driven instead when there is none.

1. The solution, if OSQP calls it solved, it is finite, keeps the input limits and obeys the dynamics
   (`planning.search.complaint`).
2. The last accepted plan, for at most `PLAN_LIFE`.
3. Braking with the steering held.
4. Standing still.

A plan of 1 or 2 whose exact body touches a boundary or obstacle within the stopping distance is not
driven either: the vehicle brakes along its steering and is blocked until the way is free further on.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rti_mpcc.config import ControllerConfig
from rti_mpcc.model.layout import DELTA, DELTA_DOT, A, V
from rti_mpcc.planning.memory import Situation
from rti_mpcc.types import Array, Source

PLAN_LIFE = 1.0
"""How long the last accepted plan may be driven on [s]."""
SETTLING_TIME = 0.15
"""Time constant with which the last of the speed is taken out [s]."""
SPARE = 0.3
"""Distance to a contact at which a blocked vehicle means to stand [m]."""
HOLDING_TIME = 0.5
"""The same while standing [s]."""
SLOW = 0.1
"""Below this speed the steering is not turned while braking [m/s]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Drive:
    """What is sent to the vehicle: acceleration [m/s²], steering rate [rad/s], and where it comes from."""

    acceleration: float
    steering_rate: float
    source: Source


def follow(controls: Array, state: Array, source: Source, config: ControllerConfig) -> Drive:
    """Drive the first control (3,) of a plan, cut to the input limits and to the steering's stop."""
    limits = config.limits
    least, most = _rates_to_stops(state, config)
    return Drive(
        acceleration=float(np.clip(controls[A], -limits.acceleration, limits.acceleration)),
        steering_rate=float(np.clip(controls[DELTA_DOT], least, most)),
        source=source,
    )


def brake(state: Array, deceleration: float, config: ControllerConfig, steering_rate: float = 0.0) -> Drive:
    """Brake at `deceleration` [m/s²] to a soft standstill, keeping `steering_rate` [rad/s] on."""
    speed = float(state[V])
    wanted = min(deceleration, abs(speed) / max(SETTLING_TIME, config.cycle), config.limits.acceleration)
    least, most = _rates_to_stops(state, config)
    rate = float(np.clip(steering_rate, least, most)) if abs(speed) > SLOW else 0.0
    return Drive(acceleration=-float(np.sign(speed)) * wanted, steering_rate=rate, source=Source.BRAKING)


def _rates_to_stops(state: Array, config: ControllerConfig) -> tuple[float, float]:
    """Least and largest steering rate [rad/s] that pass neither the rate limit nor the steering's stops."""
    limits, delta = config.limits, float(state[DELTA])
    least = max(-limits.steering_rate, min((-limits.steering - delta) / config.cycle, 0.0))
    most = min(limits.steering_rate, max((limits.steering - delta) / config.cycle, 0.0))
    return least, most


def hold(state: Array, config: ControllerConfig) -> Drive:
    """Stay at a standstill: what speed is left fades out gently, so that noise hardly shows."""
    wanted = float(np.clip(-state[V] / HOLDING_TIME, -config.limits.acceleration, config.limits.acceleration))
    return Drive(acceleration=wanted, steering_rate=0.0, source=Source.STANDSTILL)


def braking(config: ControllerConfig) -> float:
    """Deceleration before something that blocks the way, or without a plan [m/s²]: firm, not an emergency."""
    return min(config.limits.acceleration, 4.0 * config.comfort_acceleration)


def before_contact(speed: float, way: float, config: ControllerConfig) -> float:
    """Deceleration [m/s²] to stand `SPARE` before a contact `way` [m] ahead, `braking` at least."""
    left = max(way - SPARE, 0.01)
    return min(max(speed**2 / (2.0 * left), braking(config)), config.limits.acceleration)


def landing(situation: Situation, config: ControllerConfig) -> float:
    """Deceleration [m/s²] that comes to rest at the target's length, within a factor 2 of the comfort one."""
    left = -situation.direction * situation.error.x
    comfort = config.comfort_acceleration
    if left <= 0.0:
        return min(2.0 * comfort, config.limits.acceleration)
    wanted = situation.speed**2 / (2.0 * left)
    return float(np.clip(wanted, 0.5 * comfort, min(2.0 * comfort, config.limits.acceleration)))
