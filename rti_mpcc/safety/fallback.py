"""The fallback: which plan is driven, and what is driven instead when there is none.

1. The solution of this cycle, if `planning.search.rejection_reason` has none: OSQP calls it solved, all of it
   is finite, it begins within the input limits, its first 2 s obey the dynamics, and its slack is that of a
   plan that goes past what is in its way, not through it.
2. If it does not hold and there is time, the same sought once more from a clean start: from the last plan
   without a complaint, with nothing kept of the solver's last answers.
3. The last plan that was driven, or came too late for that, rolled forward from where the vehicle is, for at
   most `PLAN_LIFE`, and as long as the vehicle is within `PLAN_OFFSET` of it.
4. Braking at `ControllerConfig.firm_deceleration` with the steering held, to a standstill. It stays until
   there is a plan again, which is then sought from a fresh first guess.

What is driven by 1 to 3 is checked with the exact body: if it is not clear of everything over the way that
the vehicle needs to stop in comfort, and a share more, the vehicle brakes instead, along the plan that it was
driving, as gently as it stands in time. It is blocked until the way has been clear for a while, see
`planning.stops.halted`. Whatever is driven passes `safety.limiter`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import hypot, sqrt

import numpy as np

from geometry import wrap
from rti_mpcc.config import ControllerConfig
from rti_mpcc.model.bicycle import rollout
from rti_mpcc.model.layout import DELTA, DELTA_DOT, PHI, A, V, X, Y
from rti_mpcc.ocp.horizon import read_only, resample, stage_times
from rti_mpcc.planning.context import PlanningContext
from rti_mpcc.types import Array, Source, Trajectory

PLAN_LIFE = 1.0  # [s] for which the last plan may be driven on
PLAN_OFFSET = (0.5, 0.2)  # [m], [rad]; a plan that starts farther from the vehicle is not driven on
SETTLING_FACTOR = 1.05  # times comfort, at most, for a stop at the target: some millimetres more are better
SETTLING_LEAST = 0.5  # times comfort, at least
SETTLING_TIME = 0.15  # [s], time constant with which the last of the speed is taken out,
HOLDING_TIME = 0.5  # [s], the same while standing, so that noise hardly shows
STOP_DISTANCE = 0.3  # [m] to a contact at which a blocked vehicle means to stand
STEERING_SPEED = 0.1  # [m/s]; slower, the steering is not turned while braking


@dataclass(frozen=True, slots=True, kw_only=True)
class ControlInput:
    """What is sent to the vehicle: acceleration [m/s²], steering rate [rad/s], and where it comes from."""

    acceleration: float
    steering_rate: float
    source: Source


def follow(controls: Array, source: Source) -> ControlInput:
    """Drive the first control (3,) of a plan."""
    return ControlInput(
        acceleration=float(controls[A]), steering_rate=float(controls[DELTA_DOT]), source=source
    )


def brake(
    state: Array,
    deceleration: float,
    config: ControllerConfig,
    steering_rate: float = 0.0,
    before: float | None = None,
) -> ControlInput:
    """Brake at `deceleration` [m/s²] to a standstill, a soft one unless it is harder than firm.

    `steering_rate` is kept on [rad/s]; `before`: deceleration until now [m/s²], or None.
    """
    speed, comfort = float(state[V]), config.comfort
    wanted = min(deceleration, config.limits.acceleration)
    if deceleration > config.firm_deceleration:
        wanted = min(wanted, abs(speed) / config.cycle)
    else:
        if before is not None and deceleration <= comfort.acceleration:
            wanted = min(wanted, max(before, 0.0) + comfort.jerk * config.cycle)
        # The brakes are let go evenly, the faster the harder they were.
        jerk = comfort.jerk * max(deceleration / comfort.acceleration, 1.0)
        settling = max(SETTLING_TIME, config.cycle)
        wanted = min(wanted, sqrt(jerk * abs(speed)), abs(speed) / settling)
    rate = steering_rate if abs(speed) > STEERING_SPEED else 0.0
    return ControlInput(
        acceleration=-float(np.sign(speed)) * wanted, steering_rate=rate, source=Source.BRAKING
    )


def shifted_plan(
    plan: Trajectory | None, accepted_at: float | None, context: PlanningContext, config: ControllerConfig
) -> Trajectory | None:
    """The last accepted plan, driven on from where the vehicle is; None if it is too old or too far off."""
    if plan is None or accepted_at is None or not 0.0 <= context.now - accepted_at <= PLAN_LIFE:
        return None
    times = stage_times(context.begin, np.diff(plan.times))
    shifted = resample(plan, times, config.vehicle.wheelbase)
    off = context.state - shifted.states[0]
    position, heading = PLAN_OFFSET
    if hypot(off[X], off[Y]) > position or abs(wrap(float(off[PHI]))) > heading:
        return None
    states = rollout(context.state, shifted.controls, np.diff(times), config.vehicle.wheelbase)
    read_only(times, states, shifted.controls)
    return Trajectory(times=times, states=states, controls=shifted.controls)


def hold(state: Array, config: ControllerConfig, before: float = 0.0) -> ControlInput:
    """Stay at a standstill: what speed is left fades out gently, so that noise hardly shows.

    `before`: acceleration until now [m/s²]; brakes that stop no more than that speed are let go evenly.
    """
    most, speed, jerk = config.limits.acceleration, float(state[V]), config.comfort.jerk
    wanted = max(min(-speed / max(HOLDING_TIME, config.cycle), most), -most)
    if before * speed < 0.0 and before**2 <= 2.0 * jerk * abs(speed):
        step = jerk * config.cycle
        wanted = max(min(wanted, before + step), before - step)
    return ControlInput(acceleration=wanted, steering_rate=0.0, source=Source.STANDSTILL)


def turn_wheels(state: Array, angle: float, config: ControllerConfig) -> ControlInput:
    """Stay at a standstill and turn the wheels to an angle [rad], as fast as comfort has it."""
    most = min(config.comfort_steering_rate, config.limits.steering_rate)
    rate = (angle - float(state[DELTA])) / config.cycle
    return replace(hold(state, config), steering_rate=max(min(rate, most), -most))


def braking_over(distance: float, speed: float, most: float, config: ControllerConfig) -> float:
    """Deceleration [m/s²] to stand after `distance` [m], the comfort one at least and `most` at most."""
    if distance <= 0.0:
        return most
    return min(max(speed**2 / (2.0 * distance), config.comfort_acceleration), most)


def before_contact(speed: float, distance: float, config: ControllerConfig) -> float:
    """Deceleration [m/s²] to stand `STOP_DISTANCE` before a contact `distance` [m] ahead, or comfort."""
    return braking_over(distance - STOP_DISTANCE, speed, config.limits.acceleration, config)


def settling_deceleration(context: PlanningContext, config: ControllerConfig) -> float:
    """Deceleration [m/s²], about comfort, to rest at the target's length, without a step, see `_eased`."""
    before, comfort = context.deceleration, config.comfort
    # What the soft end of `brake` takes more than to brake on to the end.
    left = -context.direction * context.error.x - max(before, 0.0) ** 3 / (6.0 * comfort.jerk**2)
    least = SETTLING_LEAST * comfort.acceleration
    most = min(SETTLING_FACTOR * comfort.acceleration, config.limits.acceleration)
    wanted = most if left <= 0.0 else _eased(context.speed, left, before, config.cycle)
    step = comfort.jerk * config.cycle
    return min(max(min(max(wanted, before - step), before + step), least), most)


def _eased(speed: float, distance: float, before: float, seconds: float) -> float:
    """Deceleration [m/s²] after so many seconds of a stop after `distance` [m] whose deceleration changes
    evenly, from `before` [m/s²] on.

    From v and b it takes T with s = 2/3 v T - b T² / 6; where b would stop it short, it is let go evenly.
    """
    root = 4.0 * speed**2 / 9.0 - 2.0 / 3.0 * before * distance
    if root <= 0.0 and before <= 0.0:
        return 0.0  # it stands
    duration = 2.0 * distance / (2.0 / 3.0 * speed + sqrt(root)) if root > 0.0 else 2.0 * speed / before
    if duration <= seconds:
        return speed / seconds
    return before - 2.0 * seconds * (before * duration - speed) / duration**2
