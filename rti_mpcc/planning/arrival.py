"""When to begin a planned arrival, and how long it takes.

An arrival at rest of least acceleration energy over the way D from the speed v is a cubic in time. The
one whose final deceleration is a takes

(T1)  t_go = (-v + sqrt(v² + 6 a D)) / a.

Along that cubic t_go falls exactly by the time passed, so the rule needs no second thought on the way.
Out of a cruise at v the cubic begins without a step in acceleration at

(T2)  D = 4 v² / (3 a).

Where its peak is above what comfort allows on the way, `rti_mpcc.planning.pace`, and that is one speed all
along, the arrival of least energy has a cubic up to it and one down from it. On each of them, c the speed at
its vertex,

(T3)  |dv/dt| = a sqrt(1 - v / c).

Where the speed allowed changes on the way, (T3) with c(theta) the lower of the pace and the peak of (T1) is
driven forwards from the present speed and backwards from rest. That keeps to both, if not with the least
energy, and is (T1) where the pace is nowhere below that peak.
"""

from __future__ import annotations

from itertools import pairwise
from math import asin, sin, sqrt

import numpy as np

from rti_mpcc.config import ControllerConfig
from rti_mpcc.planning.pace import Pace
from rti_mpcc.types import Array


def time_to_go(way: float, speed: float, comfort: float, least: float, highest: Array | None = None) -> float:
    """Duration [s] of the arrival over `way` [m] from `speed` >= 0 [m/s], Eq. (T1), (T3).

    Where stopping takes more than the comfort acceleration, it is the constant deceleration that does.

    Args:
        comfort: acceleration a [m/s²]; least: shortest duration [s].
        highest: (m,) speeds allowed in m equal pieces of the way [m/s]; None: any.
    """
    way = max(way, 1e-6)
    a = max(comfort, speed**2 / (2.0 * way))
    free = (-speed + sqrt(speed**2 + 6.0 * a * way)) / a
    if free <= least:
        return least
    if highest is None:
        return free
    peak = _vertex_speed(way, speed, free)
    if float(highest.min()) >= peak:
        return free
    return max(_paced_time(way, speed, a, np.minimum(highest, peak).tolist()), free)


def peak_speed(way: float, speed: float, duration: float) -> float:
    """Highest speed [m/s] on the cubic arrival over `way` [m] from `speed` [m/s] in `duration` [s]."""
    rises = 3.0 * way > 2.0 * speed * duration
    return _vertex_speed(way, speed, duration) if rises else speed


def _vertex_speed(way: float, speed: float, duration: float) -> float:
    """Speed [m/s] at the vertex of that cubic's parabola of speed, which may lie before its begin."""
    first = 6.0 * way / duration**2 - 4.0 * speed / duration
    fall = 12.0 * way / duration**2 - 6.0 * speed / duration
    return speed + 0.5 * first**2 * duration / max(fall, 1e-12)


def within_reach(way: float, speed: float, config: ControllerConfig, pace: Pace, theta: float) -> bool:
    """Whether the planned arrival should begin: near enough, and either slow enough or due: by (T2), or with
    no more than `ArrivalTiming.waiting_reach` left.

    Near is what is reached at the default comfort within the arrival horizon. A gentler arrival over the same
    way takes longer, but its stages are as short in metres.

    Args:
        way: [m], from `theta` [m] on a part with this pace; speed: [m/s].
    """
    comfort, timing = config.arrival_acceleration, config.arrival_timing
    duration = time_to_go(way, speed, comfort, timing.least_time)
    due = way <= max(4.0 * speed**2 / (3.0 * comfort), timing.waiting_reach)
    if not due and peak_speed(way, speed, duration) > config.limits.speed:
        return False
    if way <= config.arrival_reach:
        return True
    horizon = config.arrival_horizon
    if duration > horizon:
        return False
    return time_to_go(way, speed, comfort, timing.least_time, pace.ahead(theta, way, config)) <= horizon


def _paced_time(way: float, speed: float, acceleration: float, bounds: list[float]) -> float:
    """Time [s] of the arrival by (T3) with c = `bounds` [m/s] in equal pieces of the way."""
    piece = way / len(bounds)
    up = _driven(speed, bounds, piece, acceleration)
    down = _driven(0.0, bounds[::-1], piece, acceleration)[::-1]
    # Faster than comfort at its begin, it brakes.
    braked = [sqrt(max(speed**2 - 2.0 * acceleration * k * piece, 0.0)) for k in range(len(up))]
    speeds = [max(min(u, d), b) for u, d, b in zip(up, down, braked, strict=True)]
    return sum(2.0 * piece / (v + w) for v, w in pairwise(speeds))


def _driven(speed: float, bounds: list[float], piece: float, acceleration: float) -> list[float]:
    """Speeds at the ends of pieces of equal length, from `speed` on, by (T3).

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
