"""When to start a planned arrival, and what it begins its iterations with: how long it takes, and its motion.

An arrival at rest of least acceleration energy over the way D from the speed v is a cubic in time. The
one whose final deceleration is a takes

(T1)  t_go = (-v + sqrt(v² + 6 a D)) / a + a / 2 j,   j the jerk at which it ends.

Along that motion t_go falls exactly by the time passed. A cruise at v joins it without a step in a at

(T2)  D = 4 v² / (3 a).

Where its peak is above one comfortable speed, `rti_mpcc.course.speed_profile`, the arrival of least energy
has a cubic up to that speed and one down from it. On each of them, V the speed at its vertex,

(T3)  |dv/dt| = a sqrt(1 - v / V).

Where the comfortable speed changes, (T3) with V(theta) the lower of the pace and the peak of (T1) is driven
forwards from the present speed and backwards from rest: not the least energy, but (T1) where the pace is
nowhere below that peak. How long an arrival takes in the end the QP finds: (T4), `rti_mpcc.ocp.stage_cost`.
"""

from __future__ import annotations

from math import asin, inf, sin, sqrt

import numpy as np

from rti_mpcc.config import ControllerConfig
from rti_mpcc.course.speed_profile import ComfortSpeeds
from rti_mpcc.ocp.stage_cost import LEAST_TIME
from rti_mpcc.types import Array

WAITING_REACH = 30.0
"""No arrival within reach waits until it is nearer [m]: (T2) leaves a slow vehicle no room to get across to a
goal beside its path. With a speed limit of 0.5 m/s it began 0.9 m before such a goal and stalled
(docs/decisions/01-arrival-at-rest.md)."""


def time_to_go(
    distance: float, speed: float, comfort: float, highest: Array | None = None, *, jerk: float = inf
) -> float:
    """Duration [s] of the arrival over `distance` [m] from `speed` >= 0 [m/s], (T1), (T3), >= `LEAST_TIME`.

    Where stopping takes more than the comfort acceleration, it is the constant deceleration that does; the
    ramp is that of comfort all the same, so that no arrival takes longer than the one from rest.

    Args:
        comfort: acceleration a [m/s²].
        highest: (m,) speeds allowed in m equal pieces of the way [m/s]; None: any.
        jerk: at which it ends to brake [m/s³].
    """
    distance = max(distance, 1e-6)
    a, ramp = _deceleration(distance, speed, comfort), 0.5 * comfort / jerk
    free = _free_time(distance, speed, a)
    peak = _vertex_speed(distance, speed, free)
    if free + ramp <= LEAST_TIME:
        return LEAST_TIME
    if highest is None or float(highest.min()) >= peak:
        return free + ramp
    paced = _profiled(distance, speed, a, np.minimum(highest, peak))[0]
    return max(float(paced[-1]), free) + ramp


def cubic_motion(elapsed: Array, distance: float, speed: float) -> tuple[Array, Array]:
    """Distances (n,) [m] and speeds (n,) [m/s] at times `elapsed` (n,) [s] of an arrival that is a cubic."""
    span = float(elapsed[-1])
    tau = elapsed / span
    # Hermite cubic s(0) = 0, s'(0) = speed, s(1) = distance, s'(1) = 0
    s = speed * span * (tau - 2.0 * tau**2 + tau**3) + distance * (3.0 * tau**2 - 2.0 * tau**3)
    rate = speed * (1.0 - 4.0 * tau + 3.0 * tau**2) + distance / span * 6.0 * (tau - tau**2)
    return np.maximum.accumulate(s), np.maximum(rate, 0.0)


def profiled_motion(
    elapsed: Array, distance: float, speed: float, comfort: float, highest: Array
) -> tuple[Array, Array]:
    """`cubic_motion` by (T3), stretched to the time that there is: it starts with `speed`."""
    distance = max(distance, 1e-6)
    a = _deceleration(distance, speed, comfort)
    peak = _vertex_speed(distance, speed, _free_time(distance, speed, a))
    times, speeds = _profiled(distance, speed, a, np.minimum(highest, peak))
    slower = float(times[-1]) / float(elapsed[-1])
    at, pieces = elapsed * slower, len(highest)
    rate = np.interp(at, times, speeds)
    started = np.minimum(np.searchsorted(times, at, side="right") - 1, pieces - 1)
    s = started * distance / pieces + 0.5 * (speeds[started] + rate) * (at - times[started])
    return s, rate * slower


def peak_speed(distance: float, speed: float, duration: float) -> float:
    """Highest speed [m/s] on the cubic arrival over `distance` [m] from `speed` [m/s] in `duration` [s]."""
    rises = 3.0 * distance > 2.0 * speed * duration
    return _vertex_speed(distance, speed, duration) if rises else speed


def _vertex_speed(distance: float, speed: float, duration: float) -> float:
    """Speed [m/s] at the vertex of that cubic's parabola of speed, which may lie before its begin."""
    first = 6.0 * distance / duration**2 - 4.0 * speed / duration
    fall = 12.0 * distance / duration**2 - 6.0 * speed / duration
    return speed + 0.5 * first**2 * duration / max(fall, 1e-12)


def within_reach(
    distance: float, speed: float, config: ControllerConfig, profile: ComfortSpeeds, theta: float
) -> bool:
    """Whether the planned arrival should start: near enough; and slow, or due by (T2) or distance.

    Near is what is reached at the default comfort within the arrival horizon; a gentler arrival takes longer,
    but its stages are as short in metres. `distance` [m] counts from `theta` [m].
    """
    duration = time_to_go(distance, speed, config.arrival_acceleration, jerk=config.comfort.jerk)
    due = distance <= max(4.0 * speed**2 / (3.0 * config.arrival_acceleration), WAITING_REACH)
    if not due and peak_speed(distance, speed, duration) > config.limits.speed:
        return False
    if distance <= config.arrival_reach:
        return True
    horizon = config.arrival_horizon
    return duration <= horizon and paced_time(distance, speed, config, profile, theta) <= horizon


def paced_time(
    distance: float, speed: float, config: ControllerConfig, profile: ComfortSpeeds, theta: float
) -> float:
    """Duration [s] of the arrival, by the pace of the segment from `theta` [m] on."""
    acceleration, jerk = config.arrival_acceleration, config.comfort.jerk
    return time_to_go(distance, speed, acceleration, profile.ahead(theta, distance), jerk=jerk)


def _deceleration(distance: float, speed: float, comfort: float) -> float:
    """What is planned with [m/s²]: the comfort one, or what stopping takes at least."""
    return max(comfort, speed**2 / (2.0 * distance))


def _free_time(distance: float, speed: float, acceleration: float) -> float:
    """Duration [s] by (T1)."""
    return (-speed + sqrt(speed**2 + 6.0 * acceleration * distance)) / acceleration


def _profiled(distance: float, speed: float, acceleration: float, bounds: Array) -> tuple[Array, Array]:
    """Times (m+1,) [s] and speeds (m+1,) [m/s] of the arrival by (T3), at the ends of m equal pieces
    of the way, with c = `bounds` (m,) [m/s] in them."""
    piece = distance / len(bounds)
    up = _speeds_along(speed, bounds.tolist(), piece, acceleration)
    down = _speeds_along(0.0, bounds[::-1].tolist(), piece, acceleration)[::-1]
    # Faster than comfort at its begin, it brakes.
    braked = [sqrt(max(speed**2 - 2.0 * acceleration * k * piece, 0.0)) for k in range(len(up))]
    speeds = np.array([max(min(u, d), b) for u, d, b in zip(up, down, braked, strict=True)])
    return np.append(0.0, np.cumsum(2.0 * piece / (speeds[1:] + speeds[:-1]))), speeds


def _speeds_along(speed: float, bounds: list[float], piece: float, acceleration: float) -> list[float]:
    """Speeds at the ends of pieces of this length [m], from `speed` on, by (T3).

    With u = sqrt(1 - v / c) the way left to c is 2 c² / a (u - u³ / 3), and u - u³ / 3 = 2/3 sin 3x for
    u = 2 sin x.
    """
    speeds = [speed]
    for bound in bounds:
        u = sqrt(1.0 - min(speed, bound) / bound)
        left = 1.5 * (u - u**3 / 3.0 - 0.5 * acceleration * piece / bound**2)
        speed = bound if left <= 0.0 else bound * (1.0 - (2.0 * sin(asin(min(left, 1.0)) / 3.0)) ** 2)
        speeds.append(speed)
    return speeds
