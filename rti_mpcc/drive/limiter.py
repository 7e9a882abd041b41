"""What goes out: commands within the limits, and set-points without steps.

The set-points of speed and steering continue from the last ones, whatever is measured: a measurement lags
behind what was commanded, and a set-point that starts from it anew would hold the vehicle back. They are led
to where they would come to rest by the commands under way, with `CORRECTION`, and are never farther from it
than what unknown lag explains.
"""

from __future__ import annotations

from dataclasses import replace
from math import degrees, exp, isfinite, nan

from rti_mpcc.config import ControllerConfig
from rti_mpcc.drive.fallback import ControlInput, brake
from rti_mpcc.model.actuators import UNDISTURBED, Actuation, Disturbance, still_acting
from rti_mpcc.model.layout import DELTA, V
from rti_mpcc.state import ControllerState
from rti_mpcc.types import Array, Source


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
    # So far speed and steering may change in a cycle.
    speed, steering, cycle = float(state[V]), disturbance.measured_steering(acting), config.cycle
    slower = disturbance.commanded((-limits.speed - speed) / cycle)
    faster = disturbance.commanded((limits.speed - speed) / cycle)
    turn = (-limits.steering - steering) / cycle, (limits.steering - steering) / cycle
    a = _within(acceleration, (slower, faster), limits.acceleration, v, limits.speed)
    rate = _within(steering_rate, turn, limits.steering_rate, delta, limits.steering)
    return ControlInput(a, rate, control.source)


def _within(slope: float, room: tuple[float, float], most: float, measured: float, limit: float) -> float:
    """A slope, at most `most`, that leads a value through its `room` in a cycle at most, and one `measured`
    beyond its limit not further out."""
    lowest, highest = room
    slope = min(max(slope, max(min(lowest, most), -most)), max(min(highest, most), -most))
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


# -- what is sent ---------------------------------------------------------------------------------------

CORRECTION = 3.0
"""Time constant [s] by which set-points return to what is measured: some times the lag of any actuator."""
KEPT = 3.0
"""Commands are kept for so long [s]: longer than they are under way, and longer than what they leave acts."""
FARTHEST_AHEAD = 0.6
"""Set-points may be ahead of the vehicle by this time [s] at comfort acceleration, as by an unknown lag."""


def sent(
    s: ControllerState,
    control: ControlInput,
    begins: float,
    begin: Array,
    before: tuple[float, float],
    config: ControllerConfig,
) -> ControllerState:
    """With `control` on its way, acting from `begins` [s] on, in the state `begin` (6,): there the next cycle
    looks for its progress. `before`: acceleration and steering rate that the last commands made by then."""
    actuators, cycle, limits = s.vehicle.actuators, config.cycle, config.limits
    drive, steering = actuators
    a = drive.commanded(control.acceleration, before[0], cycle, limits.acceleration)
    rate = steering.commanded(control.steering_rate, before[1], cycle, limits.steering_rate)
    # What drive and wheels would come to without more commands.
    disturbance = s.vehicle.disturbance
    speed = float(begin[V]) + drive.lag * disturbance.acting(before[0])
    angle = disturbance.measured_steering(float(begin[DELTA])) + steering.lag * before[1]
    if s.sent:
        last, comfort = s.sent[-1], config.comfort
        speed = _led(last.speed, speed, comfort.acceleration, cycle)
        angle = _led(last.steering, angle, comfort.steering_rate, cycle)
    now = begin if s.vehicle.monitor.state is None else s.vehicle.monitor.state
    setpoint = _limited(speed + cycle * disturbance.acting(a), limits.speed, float(now[V]))
    if control.source is Source.STANDSTILL and s.vehicle.monitor.doubt:
        setpoint = 0.0  # nobody sees what a sum of small errors would drive
    actuation = Actuation(
        begins=begins,
        acceleration=a,
        steering_rate=rate,
        before=before,
        speed=setpoint,
        steering=_limited(angle + cycle * rate, limits.steering, float(now[DELTA])),
    )
    queue = (*still_acting(s.queue, s.clock.now), actuation.queued(actuators, cycle))
    earlier = s.sent[-round(KEPT / cycle) :]
    if not earlier:  # an actuator that waits is sent this for a while
        still = replace(actuation, acceleration=0.0, steering_rate=0.0, speed=speed, steering=angle)
        earlier = (replace(still, begins=begins - cycle),)
    return replace(s, queue=queue, sent=(*earlier, actuation), start_state=begin)


def _led(last: float, at_rest: float, comfort: float, seconds: float) -> float:
    """The last set-point, led in comfort towards where the vehicle would come to, if it is far from it."""
    led = at_rest + (last - at_rest) * exp(-seconds / CORRECTION)
    most = FARTHEST_AHEAD * comfort
    wanted = min(max(led, at_rest - most), at_rest + most)
    return min(max(wanted, led - comfort * seconds), led + comfort * seconds)


def _limited(value: float, limit: float, now: float) -> float:
    """A planned value within its limit, or no farther beyond it than the vehicle is now."""
    return min(max(value, min(-limit, now)), max(limit, now))
