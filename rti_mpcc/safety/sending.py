"""From the control that shall act to what is sent: lag taken into account, and set-points without steps.

The set-points of speed and steering continue from the last ones, whatever is measured: a measurement lags
behind what was commanded, and a set-point that starts from it anew would hold the vehicle back. They are led
to where they would come to rest by the commands under way, with `CORRECTION`, and are never farther from it
than what unknown lag explains.
"""

from __future__ import annotations

from dataclasses import replace
from math import exp

from rti_mpcc.config import ControllerConfig
from rti_mpcc.model.actuators import Actuation
from rti_mpcc.model.delay import queued
from rti_mpcc.model.layout import DELTA, V
from rti_mpcc.planning.state import ControllerState
from rti_mpcc.safety.fallback import ControlInput
from rti_mpcc.types import Array

CORRECTION = 3.0
"""Time constant [s] by which set-points return to what is measured: some times the lag of any actuator."""
KEPT = 3.0
"""Commands are kept for so long [s]: longer than they are under way, and longer than what they leave acts."""
FARTHEST_AHEAD = 0.6
"""Set-points may be ahead of the vehicle by so much time [s] at the comfort acceleration: an unknown lag
explains as much."""


def sent(
    s: ControllerState, control: ControlInput, begins: float, begin: Array, config: ControllerConfig
) -> ControllerState:
    """With `control` on its way, acting from `begins` [s] on, in the state `begin` (6,)."""
    actuators, cycle, limits = s.vehicle.actuators, config.cycle, config.limits
    drive, steering = actuators
    before = s.sent[-1].acting(begins, actuators) if s.sent else (0.0, 0.0)
    a = drive.commanded(control.acceleration, before[0], cycle, limits.acceleration)
    rate = steering.commanded(control.steering_rate, before[1], cycle, limits.steering_rate)
    speed, angle = _at_rest(s, before, begin)
    if s.sent:
        last, comfort = s.sent[-1], config.comfort
        speed = _led(last.speed, speed, comfort.acceleration, cycle)
        angle = _led(last.steering, angle, comfort.steering_rate, cycle)
    now = begin if s.vehicle.monitor.state is None else s.vehicle.monitor.state
    actuation = Actuation(
        begins=begins,
        acceleration=a,
        steering_rate=rate,
        before=before,
        speed=_within(speed + cycle * s.vehicle.disturbance.acting(a), limits.speed, float(now[V])),
        steering=_within(angle + cycle * rate, limits.steering, float(now[DELTA])),
    )
    queue = queued(s.queue, actuation.queued(actuators, cycle), s.now)
    earlier = s.sent[-round(KEPT / cycle) :] or (_nothing_yet(actuation, speed, angle, cycle),)
    return replace(s, queue=queue, sent=(*earlier, actuation))


def _nothing_yet(first: Actuation, speed: float, steering: float, cycle: float) -> Actuation:
    """What the vehicle is sent before the first command: an actuator that waits is sent it for a while."""
    return replace(
        first,
        begins=first.begins - cycle,
        acceleration=0.0,
        steering_rate=0.0,
        speed=speed,
        steering=steering,
    )


def _at_rest(s: ControllerState, before: tuple[float, float], begin: Array) -> tuple[float, float]:
    """Speed [m/s] and measured steering [rad] that drive and wheels would come to, without more commands."""
    disturbance, (drive, steering) = s.vehicle.disturbance, s.vehicle.actuators
    speed = float(begin[V]) + drive.lag * disturbance.acting(before[0])
    return speed, disturbance.measured_steering(float(begin[DELTA])) + steering.lag * before[1]


def _led(last: float, at_rest: float, comfort: float, seconds: float) -> float:
    """The last set-point, led in comfort towards where the vehicle would come to, if it is far from it."""
    led = at_rest + (last - at_rest) * exp(-seconds / CORRECTION)
    most = FARTHEST_AHEAD * comfort
    wanted = min(max(led, at_rest - most), at_rest + most)
    return min(max(wanted, led - comfort * seconds), led + comfort * seconds)


def _within(value: float, limit: float, now: float) -> float:
    """A planned value within its limit, or no farther beyond it than the vehicle is now."""
    return min(max(value, min(-limit, now)), max(limit, now))
