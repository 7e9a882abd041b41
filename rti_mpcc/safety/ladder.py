"""The ladder: which plan is driven, and what is driven instead when there is none.

1. The solution, if OSQP calls it solved, it is finite, keeps the input limits and obeys the dynamics.
2. The last accepted plan, for at most `PLAN_LIFE`.
3. Braking with the steering held.
4. Standing still.

A plan of 1 or 2 whose exact body touches a boundary or obstacle within the stopping distance is not
driven either: the vehicle brakes along its steering and is blocked until the way is free further on.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import radians

import numpy as np

from rti_mpcc.config import ControllerConfig
from rti_mpcc.controller import Solution
from rti_mpcc.model.bicycle import step
from rti_mpcc.model.layout import A, DELTA, DELTA_DOT, PHI, V, X, Y
from rti_mpcc.planning.memory import Situation
from rti_mpcc.types import Array, Source, Trajectory

PLAN_LIFE = 1.0
"""How long the last accepted plan may be driven on [s]."""
CHECKED_SPAN = 2.0
"""Beginning of a plan over which it has to obey the dynamics [s]."""
POSITION_DEFECT = 0.05
"""Largest position error of a plan against the dynamics over that span [m]."""
HEADING_DEFECT = radians(2.0)
"""The same for the heading [rad]."""
INPUT_SLACK = 0.02
"""Share of an input limit by which a solver's answer may pass it before it is cut."""
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


def complaint(solution: Solution, config: ControllerConfig) -> str:
    """Why a solution must not be driven, or ""."""
    if not solution.solved:
        return f"the QP was not solved: {solution.status}"
    plan, limits = solution.trajectory, config.limits
    if not (np.isfinite(plan.states).all() and np.isfinite(plan.controls).all()):
        return "the plan is not finite"
    a, rate = plan.controls[0, A], plan.controls[0, DELTA_DOT]
    most = 1.0 + INPUT_SLACK
    if abs(a) > most * limits.acceleration or abs(rate) > most * limits.steering_rate:
        return f"the plan begins outside the input limits: a = {a:.3g} m/s², delta_dot = {rate:.3g} rad/s"
    position, heading = defect(plan, config.vehicle.wheelbase)
    if position > POSITION_DEFECT or heading > HEADING_DEFECT:
        return f"the plan breaks the dynamics by {position:.2f} m and {np.degrees(heading):.1f} deg"
    return ""


def defect(plan: Trajectory, wheelbase: float) -> tuple[float, float]:
    """Errors [m], [rad] that a plan's first `CHECKED_SPAN` adds up to against the dynamics."""
    stages = int(np.searchsorted(plan.times - plan.times[0], CHECKED_SPAN))
    stages = min(max(stages, 1), len(plan.controls))
    lengths = np.diff(plan.times[: stages + 1])
    reached = step(plan.states[:stages], plan.controls[:stages], lengths, wheelbase)
    gap = reached - plan.states[1 : stages + 1]
    return float(np.hypot(gap[:, X], gap[:, Y]).sum()), float(np.abs(gap[:, PHI]).sum())


def follow(controls: Array, source: Source, config: ControllerConfig) -> Drive:
    """Drive the first control (3,) of a plan, cut to the input limits."""
    limits = config.limits
    return Drive(
        acceleration=float(np.clip(controls[A], -limits.acceleration, limits.acceleration)),
        steering_rate=float(np.clip(controls[DELTA_DOT], -limits.steering_rate, limits.steering_rate)),
        source=source,
    )


def brake(state: Array, deceleration: float, config: ControllerConfig, steering_rate: float = 0.0) -> Drive:
    """Brake at `deceleration` [m/s²] to a standstill, softly at its end, keeping `steering_rate` [rad/s] on."""
    speed = float(state[V])
    wanted = min(deceleration, abs(speed) / max(SETTLING_TIME, config.cycle), config.limits.acceleration)
    stop = config.limits.steering
    least, most = (-stop - state[DELTA]) / config.cycle, (stop - state[DELTA]) / config.cycle
    rate = float(np.clip(steering_rate, min(least, 0.0), max(most, 0.0))) if abs(speed) > SLOW else 0.0
    return Drive(acceleration=-float(np.sign(speed)) * wanted, steering_rate=rate, source=Source.BRAKING)


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
