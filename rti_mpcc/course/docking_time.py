"""How long docking takes in comfort, and how much comfort a given time leaves.

The same motion in 1/f of the time has f² times the accelerations and f times the steering rates: a time is
asked for by one factor on the comfort values, in these powers (of the jerk the third). On a cruise the
contouring objective with its reward (W4) and horizon T is, on a straight path, the linear-quadratic problem
gamma (v - v² / (2 v_c)) - r a² with the feedback

(T6)  a = k (v_c - v),   k = w tanh(w T),   w² = gamma / (2 r v_c).
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from math import atan, inf, sqrt, tanh
from typing import NamedTuple

import numpy as np

from geometry import Corridor, PathPart, Pose2, ReferencePath
from geometry.validation import validated
from rti_mpcc.config import ControllerConfig
from rti_mpcc.controller import RtiMpcc
from rti_mpcc.course.arrival import paced_time, within_reach
from rti_mpcc.course.context import distance_left
from rti_mpcc.course.guess import Course, arrival_guess
from rti_mpcc.course.speed_profile import ComfortSpeeds, speed_profile_of
from rti_mpcc.errors import ConfigError
from rti_mpcc.iteration import DAMPING, DAMPING_SHARE, FIRST_DAMPING
from rti_mpcc.model.layout import THETA, V
from rti_mpcc.ocp.bounds import PASSED_DISTANCE
from rti_mpcc.ocp.horizon import stage_lengths, stage_times
from rti_mpcc.ocp.objectives import ArrivalAtRest, Target, goal_on, path_end
from rti_mpcc.ocp.side_clearance import side_clearance_along
from rti_mpcc.types import Array, Trajectory

SLOWEST = 0.1  # factor on the speeds, at least, for a given docking time
LANE = 3.0  # [m] on either side of the body, where no corridor is given
CRUISE_STEP = 0.25  # [s] of a cruise that is driven in thought

MOST_STEPS = 20_000  # of a cruise that is driven in thought: a longer one does not come to its end
PLANNED_ITERATIONS = 40  # of a plan that says how long it takes, at most
PLANNED_ACCURACY = 1e-5  # of its time, from one iteration to the next
PLANNED_TOLERANCE = 1e-5
"""Of its QPs. With the usual one the time of a gentle ride comes to its best by 5 ms an iteration: what a
second costs is about that tolerance."""


@validated()
def expected_docking_time(
    path: ReferencePath,
    config: ControllerConfig,
    goal: Pose2 | None = None,
    *,
    corridor: Corridor | None = None,
) -> float:
    """Time [s] from rest at the path's begin to rest at the goal: that of plans (T4), and of a cruise (T6)
    before long ones. inf where the vehicle does not get there along the path.

    Args:
        goal: pose to dock at; None: the path's last pose. It is not reached along the path where it
            lies behind the start of the last part.
        corridor: along the path; None: one with `LANE` on either side of the body.

    Raises:
        ConfigError: the settings plan no arrival, or no cruise by (T6), so nothing says how long they take.
        CorridorError: no corridor is given, and there is none of that width.
    """
    half = 0.5 * config.vehicle.width + LANE
    corridor = corridor or Corridor.from_offsets(path, left=half, right=-half)
    tolerance = min(config.solver.tolerance, PLANNED_TOLERANCE)
    config, total = config.changed(solver={"tolerance": tolerance}), 0.0
    for index, (part, target) in enumerate(_targets(path, config, goal)):
        side_clearance = side_clearance_along(part, corridor, index, config)
        cruise = _cruise(part, target, config, speed_profile_of(part, config, side_clearance))
        if cruise is None:
            return inf
        mpcc = RtiMpcc(part, corridor, config, index=index)
        mpcc.side_clearance = side_clearance
        total += cruise.time + _planned_time(mpcc, target, cruise)
    return total


def estimated_docking_time(path: ReferencePath, config: ControllerConfig, goal: Pose2 | None) -> float:
    """The same by (T1) to (T3), beside nothing: in much less time, with an error of some 10 %."""
    total = 0.0
    for part, target in _targets(path, config, goal):
        cruise = _cruise(part, target, config, speed_profile_of(part, config))
        if cruise is None:
            return inf
        total += cruise.time + _profiled_time(cruise, config)
    return total


@validated()
def config_for_docking_time(
    seconds: float,
    path: ReferencePath,
    config: ControllerConfig,
    goal: Pose2 | None = None,
    *,
    corridor: Corridor | None = None,
) -> ControllerConfig:
    """The settings with their three comfort values scaled so that docking is expected to take `seconds` [s].

    Args:
        path, goal, corridor: as `expected_docking_time`.

    Raises:
        ConfigError: it cannot be done so fast within the limits on acceleration or speed, or not so slowly.
    """

    @cache  # a plan of each part
    def time(factor: float) -> float:
        return expected_docking_time(path, scaled(config, factor), goal, corridor=corridor)

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


def _targets(
    path: ReferencePath, config: ControllerConfig, goal: Pose2 | None
) -> Iterator[tuple[PathPart, Target]]:
    """The parts of a path, and where they end. Raises ConfigError: see `expected_docking_time`."""
    if not config.objective.arrives_at_goal:
        raise ConfigError(
            f"objective = {type(config.objective).__name__}: only planned arrivals have a time that is known "
            "before; method 'dynamic' with preset 'default' plans one, the paper's presets do not"
        )
    for part in path.parts:
        if goal is not None and part is path.parts[-1]:
            yield part, goal_on(part, goal)
        else:
            yield part, path_end(part)


class _Cruise(NamedTuple):
    """What comes before an arrival: `time` [s] until a state (6,), `left` [m] from the target."""

    time: float
    state: Array
    left: float
    profile: ComfortSpeeds


def _cruise(
    part: PathPart, target: Target, config: ControllerConfig, profile: ComfortSpeeds
) -> _Cruise | None:
    """A cruise from rest by (T6), within its pace, until an arrival is in reach; None: it never is."""
    step = CRUISE_STEP
    along, left = distance_left(part.first, part.start, part.first, part.direction, target)
    if along < -PASSED_DISTANCE:
        return None
    begin, time, speed = part.start, config.dead_time, 0.0
    most = config.dead_time + MOST_STEPS * step
    while not within_reach(left, speed, config, profile, begin):
        if time > most:
            return None
        rise = min(_rise(config), 1.0 / step)  # no step passes the cruise speed
        gain = min(rise * (config.cruise_speed - speed), config.comfort_acceleration)
        highest = float(profile.at(np.array([begin]))[0])
        speed = min(speed + gain * step, highest)
        time, left, begin = time + step, left - speed * step, begin + speed * step
    here, steering = part.pose(begin), 0.0
    if speed > 0.0:
        steering = atan(config.vehicle.wheelbase * float(part.curvature(begin)[0]))
    state = np.array([here.x, here.y, here.phi, part.direction * speed, steering, begin])
    return _Cruise(time, state, left, profile)


def _profiled_time(cruise: _Cruise, config: ControllerConfig) -> float:
    """What the arrival takes [s], (T1) to (T3)."""
    _, state, left, profile = cruise
    return paced_time(left, abs(float(state[V])), config, profile, float(state[THETA]))


def _planned_time(mpcc: RtiMpcc, target: Target, cruise: _Cruise) -> float:
    """What the arrival takes [s], (T4) of `ocp.stage_cost`."""
    (_, state, left, profile), config = cruise, mpcc.config
    ends = _profiled_time(cruise, config)
    times = stage_times(0.0, stage_lengths(ends, config.cycle, config.stages))
    course = Course(mpcc.part, target)
    guess: Trajectory | None = arrival_guess(course, state, times, left, profile, config)
    damping = FIRST_DAMPING
    for _ in range(PLANNED_ITERATIONS):
        mpcc.prepare(0.0, target=target, plan=guess, objective=ArrivalAtRest(), damping=damping, before=0.0)
        solution = mpcc.feedback(state, 0.0)
        before, ends = ends, float(solution.trajectory.times[-1])
        settled = damping == DAMPING and abs(ends - before) < PLANNED_ACCURACY * ends
        if settled or not solution.solved:
            break
        guess, damping = None, max(DAMPING_SHARE * damping, DAMPING)
    return ends


def _rise(config: ControllerConfig) -> float:
    """k of (T6) [1/s]. Raises ConfigError where it is none."""
    weights, effort = config.weights, config.effort
    if not (weights.progress_reward > 0.0 and effort > 0.0):
        raise ConfigError(
            f"weights.progress_reward = {weights.progress_reward}, weights.acceleration = "
            f"{weights.acceleration}: a cruise has a time that is known before only if both are > 0"
        )
    w = sqrt(weights.progress_reward / (2.0 * effort * config.cruise_speed))
    return w * tanh(w * config.cruise_horizon)
