"""How long docking takes in comfort, and how much comfort a given time leaves.

The same motion in 1/f of the time has f² times the accelerations and f times the steering rates: a time is
asked for by one factor on the comfort values, in these powers (of the jerk the third). On a cruise the
contouring objective with its reward (W4) and horizon T is, on a straight path, the linear-quadratic problem
gamma (v - v² / (2 v_c)) - r a² with the feedback

(T4)  a = k (v_c - v),   k = w tanh(w T),   w² = gamma / (2 r v_c).
"""

from __future__ import annotations

from math import inf, sqrt, tanh

import numpy as np

from geometry import PathPart, Pose2, ReferencePath
from geometry.validation import validated
from rti_mpcc.config import ControllerConfig
from rti_mpcc.errors import ConfigError
from rti_mpcc.ocp.bounds import PASSED_DISTANCE
from rti_mpcc.ocp.targets import Target, goal_on, path_end
from rti_mpcc.planning.arrival import arrival_time, within_reach
from rti_mpcc.planning.sensing import distance_left
from rti_mpcc.planning.speed_profile import speed_profile_of

SLOWEST = 0.1  # factor on the speeds, at least, for a given docking time
CRUISE_STEP = 0.25  # [s] of a cruise that is driven in thought

MOST_STEPS = 20_000  # of a cruise that is driven in thought: a longer one does not come to its end


@validated()
def expected_docking_time(path: ReferencePath, config: ControllerConfig, goal: Pose2 | None = None) -> float:
    """Time [s] from rest at the path's begin to rest at the goal, with nothing in the way and no corridor
    that slows the vehicle; inf where the vehicle does not get there along the path.

    Args:
        goal: pose to dock at; None: the path's last pose. It is not reached along the path where it
            lies behind the start of the last part.

    Raises:
        ConfigError: the settings plan no arrival, or no cruise by (T4), so nothing says how long they take.
    """
    if not config.objective.arrives_at_goal:
        raise ConfigError(
            f"objective = {type(config.objective).__name__}: only planned arrivals have a time that is known "
            "before; method 'dynamic' with preset 'default' plans one, the paper's presets do not"
        )
    total = 0.0
    for part in path.parts:
        last = part is path.parts[-1]
        target = goal_on(part, goal) if last and goal is not None else path_end(part)
        total += _part_time(part, target, config)
    return total


@validated()
def config_for_docking_time(
    seconds: float, path: ReferencePath, config: ControllerConfig, goal: Pose2 | None = None
) -> ControllerConfig:
    """The settings with their three comfort values scaled so that docking is expected to take `seconds` [s].

    Args:
        path, goal: as `expected_docking_time`.

    Raises:
        ConfigError: it cannot be done so fast within the limits on acceleration or speed, or not so slowly.
    """

    def time(factor: float) -> float:
        return expected_docking_time(path, scaled(config, factor), goal)

    # Under a speed limit, gentler may be a little sooner: only one side of the present settings is searched.
    fastest, usual = sqrt(config.limits.acceleration / config.comfort_acceleration), time(1.0)
    least, most = (SLOWEST, 1.0) if seconds >= usual else (1.0, fastest)
    if not time(most) <= seconds <= time(least):
        takes = (time(SLOWEST), usual, time(fastest))
        if usual == inf:
            raise ConfigError(
                "docking_time: the goal is not reached along the path, nothing says how long that takes"
            )
        raise ConfigError(
            f"docking_time = {seconds!r} s: within the limits docking here takes {min(takes):.4g} to "
            f"{max(takes):.4g} s"
        )
    from scipy.optimize import brentq  # here: a tenth of a second to import, and seldom needed

    found = brentq(lambda factor: time(factor) - seconds, least, most, xtol=1e-4)
    return scaled(config, float(found))


def scaled(config: ControllerConfig, factor: float) -> ControllerConfig:
    """The settings with the comfort of the same motion `factor` times as fast."""
    comfort = config.comfort
    return config.changed(
        comfort_acceleration=min(comfort.acceleration * factor**2, config.limits.acceleration),
        comfort_lateral_acceleration=comfort.lateral_acceleration * factor**2,
        comfort_steering_rate=min(comfort.steering_rate * factor, config.limits.steering_rate),
        comfort_jerk=comfort.jerk * factor**3,
    )


def _part_time(part: PathPart, target: Target, config: ControllerConfig) -> float:
    """Time [s] of a part from rest to rest: a cruise by (T4), within its pace, and the arrival."""
    profile, step = speed_profile_of(part, config), CRUISE_STEP
    along, left = distance_left(part.first, part.start, part.first, part, target)
    if along < -PASSED_DISTANCE:
        return inf
    begin, time, speed = part.start, config.dead_time, 0.0
    most = config.dead_time + MOST_STEPS * step
    while not within_reach(left, speed, config, profile, begin):
        if time > most:
            return inf
        rise = min(_rise(config), 1.0 / step)  # no step passes the cruise speed
        gain = min(rise * (config.cruise_speed - speed), config.comfort_acceleration)
        highest = float(profile.at(np.array([begin]))[0])
        speed = min(speed + gain * step, highest)
        time, left, begin = time + step, left - speed * step, begin + speed * step
    return time + arrival_time(left, speed, config, profile.ahead(begin, left))


def _rise(config: ControllerConfig) -> float:
    """k of (T4) [1/s]. Raises ConfigError where it is none."""
    weights, effort = config.weights, config.cruise_effort
    if not (weights.progress_reward > 0.0 and effort > 0.0):
        raise ConfigError(
            f"weights.progress_reward = {weights.progress_reward}, weights.acceleration = "
            f"{weights.acceleration}: a cruise has a time that is known before only if both are > 0"
        )
    w = sqrt(weights.progress_reward / (2.0 * effort * config.cruise_speed))
    return w * tanh(w * config.cruise_horizon)
