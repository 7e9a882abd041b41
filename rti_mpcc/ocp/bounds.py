"""Bounds of every stage on speed, steering, progress and controls.

(J1)  |a_k - a_before| <= jerk (t_k + h_0),   t_k from the begin of the plan to that of its stage
(J2)  |a_k| <= jerk (T - t_k),   T the end of a plan that comes to rest there
(J3)  |delta_dot_k| <= max(comfort, 0.99 |delta_dot_k| of the last plan),   unless the vehicle moves and
      something presses (`RtiMpcc`)

Where stopping at the target takes more than comfort, up to the firm deceleration, a plan may have as much,
and the same motion in 1/f of the time has f³ times the jerk:

(J4)  a <= f² a_most,   jerk <= f³ jerk,   f² = max(1, min(v²/2D, a_firm) / a_comfort).

A plan that turned the wheels faster while something pressed goes on as it was, and comes back into comfort
bit by bit: bound to it at once it may end elsewhere, off its goal or in a wall. A vehicle that comes to rest
so soon that its braking cannot fade at that rate may let it go at once. Whatever else bounds the speed gives
way to (J1), see `qp.filling.fill_motion_bounds`: there is always a plan. It does not hold for a vehicle that
is far faster than it may be.
"""

from __future__ import annotations

from math import inf, sqrt
from typing import NamedTuple

import numpy as np

from geometry.compiled import Array1, Out1, Out3, inner, kernel
from rti_mpcc.config import ControllerConfig
from rti_mpcc.model.actuators import UNDISTURBED, Disturbance, acting_steering
from rti_mpcc.model.layout import DELTA_DOT, A, V
from rti_mpcc.ocp.horizon import PlanStages
from rti_mpcc.types import Array

HEADROOM = 1.5  # of theta_dot: its bound and the one on v must not say the same twice
CALM_SPEED = 0.1  # [m/s]; slower, a plan turns the wheels within comfort
PASSED_DISTANCE = 0.5  # [m]; passed by less, the vehicle still has that distance left
FAR_SPEED = 1.1
"""A vehicle that is so many times as fast as its limit is braked at any jerk."""
TURNING_SHARE = 0.99
"""Of a steering rate beyond comfort that the last plan had, which the next one may have there, (J3). Less
than 1: what the solver is off by is not to add up."""


class StageBounds(NamedTuple):
    """Lower and upper bounds: states (N, 2, 3) on v, delta, theta at stages 1..N; controls (N, 2, 3).

    `by_time`: (N,) how the bound that a plan's acceleration is next to grows with its end T [m/s³].
    """

    states: Out3
    controls: Out3
    by_time: Out1


class Change(NamedTuple):
    """From what the acceleration changes: the one `before` [m/s²].

    `stages`: with the speeds, and the controls that the last plan had; `left`: distance over which the plan
    comes to rest [m], (J2), inf where it does not; `pressed`: whether more than the comfort steering rate may
    be needed.
    """

    before: float
    stages: PlanStages
    left: float = inf
    pressed: bool = True


def stage_bounds(
    config: ControllerConfig,
    direction: int,
    farthest: float,
    most: Array | None = None,
    disturbance: Disturbance = UNDISTURBED,
    change: Change | None = None,
) -> StageBounds:
    """The limits, and one direction of motion.

    Args:
        direction: d of the part: d v >= 0; 0: either.
        farthest: progress at most [m]; inf for a cruise that turns to a planned arrival before it comes to
            the stop point: it goes on along the extrapolated path.
        most: (N,) speeds at stages 1..N that the room allows [m/s]; None: any.
        disturbance: the limits are of what is commanded and measured, the bounds of what acts, (O5).
        change: with comfort, (J1) to (J3), the last where comfort has a weight; None: any.
    """
    limits = config.limits
    faster = 1.0
    if change is not None and change.left != inf:  # (J4): an arrival comes back from it within comfort
        needed = float(change.stages.states[0, V]) ** 2 / (2.0 * max(change.left, PASSED_DISTANCE))
        faster = sqrt(max(min(needed, config.firm_deceleration) / config.comfort_acceleration, 1.0))
    planned = faster**2 * config.planned_acceleration
    most = np.full(config.stages, limits.speed) if most is None else np.minimum(limits.speed, most)
    inputs = limits.steering, limits.acceleration, limits.steering_rate
    bounds = _stage_bounds(direction, most, farthest, planned, inputs, disturbance)
    if change is not None:
        jerk, far = faster**3 * config.comfort.jerk, FAR_SPEED * limits.speed
        _bound_change(
            change,
            bounds,
            jerk if abs(change.stages.states[0, V]) <= far else inf,
            jerk if change.left < inf else inf,
            CALM_SPEED if change.pressed else inf,
            config.comfort.steering_rate if config.weights.comfort[2] > 0.0 else inf,
        )
    return bounds


@kernel
def _stage_bounds(
    direction: int, most: Array1, farthest: float, planned: float, inputs: tuple[float, float, float],
    disturbance: Disturbance,
) -> StageBounds:  # fmt: skip
    """Of N stages: `most` (N,) is the highest speed, `planned` the largest acceleration of a plan, `inputs`
    the limits of steering, acceleration and steering rate."""
    (steering, acceleration, rate), d = inputs, disturbance.acceleration
    reach = disturbance.gain * acceleration
    # By what an angle that acts turns at least, where the wheels turn by 1, at any angle.
    rate *= min(disturbance.turn, 1.0 / disturbance.turn)
    right, left = acting_steering(disturbance, -steering), acting_steering(disturbance, steering)
    low = right, -inf, max(d - reach, -planned), -rate
    high = left, farthest, min(d + reach, planned), rate
    states, controls = np.empty((len(most), 2, 3)), np.empty((len(most), 2, 3))
    for k in range(len(most)):
        speed = most[k]
        back = speed if direction == 0 else 0.0
        states[k, 0, 0], states[k, 1, 0] = (-back, speed) if direction >= 0 else (-speed, back)
        controls[k, 0, 2], controls[k, 1, 2] = 0.0, HEADROOM * speed
        states[k, 0, 1], states[k, 0, 2], controls[k, 0, 0], controls[k, 0, 1] = low
        states[k, 1, 1], states[k, 1, 2], controls[k, 1, 0], controls[k, 1, 1] = high
    return StageBounds(states, controls, np.zeros(len(most)))


@kernel
def _bound_change(
    change: Change, bounds: StageBounds, jerk: float, jerk_at_end: float, calm: float, steering_rate: float
) -> None:
    """(J1) to (J3), where the limits and the ones before leave them; a comfort value of `inf` is no bound."""
    before, (states, planned, lengths) = change.before, change.stages
    controls, by_time, speed = bounds.controls, bounds.by_time, states[0, V]
    stages, rest = len(controls), np.sum(lengths[1:])
    free = before * speed <= 0.0 and speed * speed < (before * before / jerk) ** 2
    allowed, left = jerk * lengths[0], 0.0
    for k in range(stages):
        lowest, highest = before - allowed, before + allowed
        if free:
            lowest, highest = min(lowest, 0.0), max(highest, 0.0)
        if _narrow(controls, k, lowest, highest, planned[k, A]):
            by_time[k] = jerk * max(allowed / jerk - lengths[0] - lengths[0], 0.0) / rest
        allowed += jerk * lengths[k]
        if abs(states[k, V]) <= calm:
            most = max(steering_rate, TURNING_SHARE * abs(planned[k, DELTA_DOT]))
            controls[k, 0, 1], controls[k, 1, 1] = max(controls[k, 0, 1], -most), min(controls[k, 1, 1], most)
    for k in range(stages - 1, -1, -1):
        left += lengths[k]
        if _narrow(controls, k, -jerk_at_end * left, jerk_at_end * left, planned[k, A]):
            by_time[k] = jerk_at_end * min(left, rest) / rest


@inner
def _narrow(controls: Array, k: int, lowest: float, highest: float, planned: float) -> bool:
    """Bound the acceleration of stage k further; beyond its bounds only they count.

    Returns whether that is the nearer bound on the side of the `planned` acceleration.
    """
    low, high = max(controls[k, 0, 0], lowest), min(controls[k, 1, 0], highest)
    if low > high:
        return False
    nearer: bool = high < controls[k, 1, 0] if planned > 0.0 else low > controls[k, 0, 0]
    controls[k, 0, 0], controls[k, 1, 0] = low, high
    return nearer
