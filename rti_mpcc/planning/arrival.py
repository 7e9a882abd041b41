"""When to begin a planned arrival, and how long it takes.

An arrival at rest of least acceleration energy over the way D from the speed v is a cubic in time. The
one whose final deceleration is a takes

(T1)  t_go = (-v + sqrt(v² + 6 a D)) / a.

Along that cubic t_go falls exactly by the time passed, so the rule needs no second thought on the way.
Out of a cruise at v the cubic begins without a step in acceleration at

(T2)  D = 4 v² / (3 a).
"""

from __future__ import annotations

from math import sqrt

from rti_mpcc.config import ControllerConfig

FLOOR = 1.0
"""Shortest time to go that is planned [s]; closer in, the plan always ends this far ahead."""


def time_to_go(way: float, speed: float, comfort: float) -> float:
    """Duration [s] of the arrival over `way` [m] from `speed` >= 0 [m/s], Eq. (T1), at least `FLOOR`.

    Where stopping takes more than the comfort acceleration, it is the constant deceleration that does.
    """
    way = max(way, 1e-6)
    a = max(comfort, speed**2 / (2.0 * way))
    return max((-speed + sqrt(speed**2 + 6.0 * a * way)) / a, FLOOR)


def peak_speed(way: float, speed: float, duration: float) -> float:
    """Highest speed [m/s] on the cubic arrival over `way` [m] from `speed` [m/s] in `duration` [s]."""
    first = 6.0 * way / duration**2 - 4.0 * speed / duration
    last = -6.0 * way / duration**2 + 2.0 * speed / duration
    if first <= 0.0:
        return speed
    return speed + 0.5 * first * duration * first / (first - last)


def within_reach(way: float, speed: float, config: ControllerConfig) -> bool:
    """Whether the planned arrival should begin: short enough, and either slow enough or due (T2)."""
    comfort = config.comfort_acceleration
    duration = time_to_go(way, speed, comfort)
    due = way <= 4.0 * speed**2 / (3.0 * comfort)
    return duration <= config.arrival_horizon and (
        due or peak_speed(way, speed, duration) <= config.limits.speed
    )
