"""The first trajectory to linearise about: along the path at a smooth speed, ending at rest at the target.

A quadratic model about rest does not know that steering moves the vehicle sideways, so the real-time
iteration never begins there: at the start, after a cusp, a stop or a change of target it begins here.
"""

from __future__ import annotations

from math import atan, cos, hypot, sin, sqrt, tan
from typing import NamedTuple

import numpy as np

from geometry import PathPart, Pose2, lift
from geometry.compiled import Array1, Out1, Out2, inner, kernel
from rti_mpcc.config import ControllerConfig
from rti_mpcc.course.arrival import cubic_motion, profiled_motion
from rti_mpcc.course.speed_profile import ComfortSpeeds
from rti_mpcc.model.bicycle import step_one
from rti_mpcc.model.layout import CONTROLS, DELTA, DELTA_DOT, PHI, STATES, THETA, THETA_DOT, A, V, X, Y
from rti_mpcc.ocp.objectives import Target
from rti_mpcc.ocp.side_clearance import SideClearance
from rti_mpcc.types import Array, Trajectory

FADE_DISTANCE = 12.0  # [m] over which an offset at the start or at the target fades into the path, at least
FADE_CURVATURE = 0.1  # [1/m] with which a large offset at the start begins to fade: the tail swings out
FADE_HEADING = 1.05  # [rad]; a heading from the path beyond this fades like this
ASTRAY = 0.05  # [rad] by which the heading may go astray while the steering turns; beyond it is turned first
LEAST_STRETCH = 0.2  # beside a bend's inside per distance along the path: not into its centre


class Course(NamedTuple):
    """The part that is driven, and the target on it."""

    part: PathPart
    target: Target


def arrival_guess(
    course: Course,
    state: Array,
    times: Array,
    distance: float,
    profile: ComfortSpeeds,
    config: ControllerConfig,
) -> Trajectory:
    """The arrival over `times` (N+1,) from the speed of `state` (6,) to rest, so far [m] further along."""
    speed = max(course.part.direction * float(state[V]), 0.0)
    elapsed, theta = times - times[0], float(state[THETA])
    s, rate = cubic_motion(elapsed, distance, speed)
    side = profile.side_clearance
    if side is not None and (rate > side.bounds(theta + s, elapsed, speed, config)).any():
        # The QP would not let it be so fast: the motion that the time was planned with.
        highest = profile.ahead(theta, distance)
        s, rate = profiled_motion(elapsed, distance, speed, config.arrival_acceleration, highest)
    return along_path(course, state, times, s, rate, config)


def cruise_guess(
    course: Course, state: Array, times: Array, profile: ComfortSpeeds, config: ControllerConfig
) -> Trajectory:
    """Speed changing in comfort to the cruise speed, as far as (P2) lets it, until the target's progress."""
    now = max(course.part.direction * float(state[V]), 0.0)
    elapsed = times - times[0]
    most = config.comfort_acceleration * elapsed
    change = np.clip(config.cruise_speed - now, -most, most)
    highest = np.maximum(config.limits.speed, now - config.limits.acceleration * elapsed)
    rate = np.minimum(now + change, highest)
    s, theta = np.append(0.0, np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(times))), float(state[THETA])
    side = profile.side_clearance
    if side is not None and (rate > side.bounds(theta + s, elapsed, now, config)).any():
        s, rate = _slowed(rate, theta, elapsed, now, side, config)
    left = max(course.target.theta - theta, 0.0)
    rate = np.where(s < left, rate, 0.0)
    return along_path(course, state, times, np.minimum(s, left), rate, config)


def _slowed(
    rate: Array,
    theta: float,
    elapsed: Array,
    speed: float,
    side_clearance: SideClearance,
    config: ControllerConfig,
) -> tuple[Array, Array]:
    """Distances (N+1,) [m] and speeds (N+1,) [m/s] that (P2) leaves of `rate`, and comfort behind it."""
    s, rate = np.zeros_like(rate), rate.copy()
    for k, seconds in enumerate(np.diff(elapsed)):
        stage = theta + s[k] + np.array([0.0, rate[k] * seconds])
        highest = side_clearance.bounds(stage, elapsed[k + 1], speed, config).min()
        rate[k + 1] = min(rate[k + 1], rate[k] + config.comfort_acceleration * seconds, highest)
        s[k + 1] = s[k] + 0.5 * (rate[k] + rate[k + 1]) * seconds
    return s, rate


def along_path(
    course: Course, state: Array, times: Array, s: Array, rate: Array, config: ControllerConfig
) -> Trajectory:
    """The trajectory that has driven `s` (N+1,) [m] at speed `rate` (N+1,) [m/s] at `times`.

    The vehicle's offset fades out over the first metres, the target's fades in over the last, as cubics whose
    slope is the heading. The guess need not obey the dynamics.
    """
    lead = _lead_in(course, state, times, rate, config)
    led = len(lead) - 1
    if led:
        s, rate, state = s[led:] - s[led], rate[led:], lead[-1]
    states = along_course(course, state, s, rate, config)
    if led:
        states = np.vstack([lead[:-1], states])
    limits, controls = config.limits, np.empty((len(times) - 1, CONTROLS))
    rates = np.diff(states, axis=0) / np.diff(times)[:, None]
    controls[:, A] = np.clip(rates[:, V], -limits.acceleration, limits.acceleration)
    controls[:, DELTA_DOT] = np.clip(rates[:, DELTA], -limits.steering_rate, limits.steering_rate)
    controls[:, THETA_DOT] = rates[:, THETA]
    return Trajectory(times=times, states=states, controls=controls)


def along_course(course: Course, state: Array, s: Array, rate: Array, config: ControllerConfig) -> Array:
    """States (n, 6) on the course, `s` (n,) [m] beyond `state` (6,), at speeds `rate` (n,) [m/s]."""
    (part, target), theta = course, state[THETA] + s
    reference, limits = part.reference(theta), config.limits
    here, there = part.pose(float(state[THETA])), part.pose(target.theta)
    begin = Pose2(float(state[X]), float(state[Y]), float(state[PHI])).relative_to(here)
    end = target.pose.relative_to(there)
    distance = max(target.theta - float(state[THETA]), 1e-3)
    reach, fade = min(FADE_DISTANCE, distance), min(_fade_length(begin.y), distance)
    path = _Samples(reference.x, reference.y, reference.phi, reference.slope, s, theta - target.theta)
    from_start = _Offset(begin.x, begin.y, _slope(begin.phi), fade)
    to_end = _Offset(end.x, end.y, _slope(end.phi), reach)
    states = _beside_path(path, rate, float(part.direction), from_start, to_end, limits.speed)
    states[:, THETA] = np.minimum(theta, target.stop)
    _steer(states, s, config.vehicle.wheelbase * part.direction, limits.steering)
    states[0] = state
    states[0, PHI] = lift(float(state[PHI]), float(states[1, PHI]))
    return states


def _lead_in(course: Course, state: Array, times: Array, rate: Array, config: ControllerConfig) -> Array:
    """States (k+1, 6) from `state` on until the steering is where the fade needs it: `state` alone, mostly.

    Else the vehicle leaves the fade before it can follow, and a linearisation about it is worth nothing.
    """
    (part, target), limits, wheelbase = course, config.limits, config.vehicle.wheelbase
    d, led = part.direction, [(*state.tolist(),)]
    for k, length in enumerate(np.diff(times)[:-1].tolist()):  # the fade needs a stage of its own
        now = led[-1]
        here = Pose2(now[X], now[Y], now[PHI]).relative_to(part.pose(now[THETA]))
        gap = _fade_steering(course, now[THETA], here, config) - now[DELTA]
        astray = abs(now[V]) * gap**2 / (2.0 * limits.steering_rate * wheelbase)
        if astray <= ASTRAY and (k == 0 or abs(gap) <= limits.steering_rate * length):
            break
        a = (d * float(rate[k + 1]) - now[V]) / length
        a = max(min(a, limits.acceleration), -limits.acceleration)
        turn = max(min(gap / length, limits.steering_rate), -limits.steering_rate)
        along = max(d * now[V] * cos(here.phi), 0.0)
        *pose, reached = step_one(now, (a, turn, along), length, wheelbase)
        led.append((*pose, max(min(reached, target.stop), now[THETA])))
    return np.array(led)


def _fade_steering(course: Course, theta: float, here: Pose2, config: ControllerConfig) -> float:
    """Steering [rad] with which the fade from `here`, in the frame of the path at `theta`, begins."""
    (part, target), slope = course, _slope(here.phi)
    d = part.direction
    fade = min(_fade_length(here.y), max(target.theta - theta, FADE_DISTANCE))
    bend = -6.0 * here.y / fade**2 - 4.0 * d * slope / fade
    curvature = float(part.reference(np.array([theta])).slope[0]) + d * bend / (1.0 + slope**2) ** 1.5
    steering = atan(config.vehicle.wheelbase * d * curvature)
    return min(max(steering, -config.limits.steering), config.limits.steering)


def _fade_length(offset: float) -> float:
    """Way over which an offset at the start fades [m]."""
    return max(FADE_DISTANCE, sqrt(6.0 * abs(offset) / FADE_CURVATURE))


class _Samples(NamedTuple):
    """Places along a path, (n,) each: poses [m], [rad], slopes [rad/m], distances from the first one and
    from the target [m]."""

    x: Out1
    y: Out1
    phi: Out1
    slope: Out1
    s: Out1
    beyond: Out1


class _Offset(NamedTuple):
    """Of a pose beside the path: along and across [m], the slope of across, and over how far it fades [m]."""

    along: float
    across: float
    slope: float
    reach: float


@kernel
def _beside_path(
    path: _Samples, rate: Array1, direction: float, begin: _Offset, end: _Offset, fastest: float
) -> Out2:
    """Beside the path by what fades of the offsets at the begin and at the end; a detour is driven at
    `fastest`. Neither steering nor progress."""
    x, y, phi, bend, s, beyond = path
    states = np.zeros((len(s), STATES))
    for k in range(len(s)):
        left, into = 1.0 - s[k] / begin.reach, 1.0 + beyond[k] / end.reach
        across_begin, slope_begin = _fade(left, begin.across, -direction * begin.slope, begin.reach)
        across_end, slope_end = _fade(into, end.across, direction * end.slope, end.reach)
        along = _smooth(left) * begin.along + _smooth(into) * end.along
        across, slope = across_begin + across_end, slope_end - slope_begin
        stretch = max(1.0 - direction * bend[k] * across, LEAST_STRETCH)
        states[k, X] = x[k] + cos(phi[k]) * along - sin(phi[k]) * across
        states[k, Y] = y[k] + sin(phi[k]) * along + cos(phi[k]) * across
        states[k, PHI] = phi[k] + direction * atan(slope / stretch)
        states[k, V] = direction * min(rate[k] * hypot(stretch, slope), max(rate[k], fastest))
    return states


@kernel
def _steer(states: Out2, s: Array1, wheelbase: float, most: float) -> None:
    """Steer as the heading turns, `most` at most; `wheelbase`: negative in reverse."""
    for k in range(len(s)):
        before, behind = max(k - 1, 0), min(k + 1, len(s) - 1)
        stages = behind - before
        turn = (
            (states[behind, PHI] - states[before, PHI]) / stages / max((s[behind] - s[before]) / stages, 1e-6)
        )
        states[k, DELTA] = min(max(atan(wheelbase * turn), -most), most)


@inner
def _fade(share: float, offset: float, slope: float, reach: float) -> tuple[float, float]:
    """Cubic from 0 with slope 0 at `share` 0 to `offset` with `slope` at `share` 1, and its slope.

    Slopes are per metre of way; `share` runs over `reach` [m].
    """
    t = min(max(share, 0.0), 1.0)
    value = offset * (3.0 - 2.0 * t) * t**2 + reach * slope * (t - 1.0) * t**2
    return value, offset * 6.0 * t * (1.0 - t) / reach + slope * (3.0 * t - 2.0) * t


def _slope(heading: float) -> float:
    """Lateral way per way of a vehicle turned by `heading` [rad] from the path, within what fades."""
    return tan(min(max(heading, -FADE_HEADING), FADE_HEADING))


@inner
def _smooth(share: float) -> float:
    """Smooth step of `share`, 0 below 0 and 1 above 1."""
    t = min(max(share, 0.0), 1.0)
    return t * t * (3.0 - 2.0 * t)
