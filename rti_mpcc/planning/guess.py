"""The first trajectory to linearise about: along the path at a smooth speed, ending at rest at the target.

A quadratic model about rest does not know that steering moves the vehicle sideways, so the real-time
iteration never begins there: at the start, after a cusp, a stop or a change of target it begins here.
"""

from __future__ import annotations

from math import tan

import numpy as np

from geometry import PathPart, Pose2, lift
from rti_mpcc.config import ControllerConfig
from rti_mpcc.model.layout import CONTROLS, DELTA, DELTA_DOT, PHI, STATES, THETA, THETA_DOT, A, V, X, Y
from rti_mpcc.ocp.objectives import Target
from rti_mpcc.types import Array, Trajectory

BLEND = 12.0
"""Way over which an offset at the start or at the target fades into the path [m]."""


def arrival_guess(
    part: PathPart, target: Target, state: Array, times: Array, way: float, config: ControllerConfig
) -> Trajectory:
    """A cubic over `times` (N+1,) from the speed of `state` (6,) to rest, `way` [m] further along."""
    span = times[-1] - times[0]
    tau = (times - times[0]) / span
    speed = max(part.direction * float(state[V]), 0.0)
    # Hermite cubic s(0) = 0, s'(0) = speed, s(1) = way, s'(1) = 0
    s = speed * span * (tau - 2.0 * tau**2 + tau**3) + way * (3.0 * tau**2 - 2.0 * tau**3)
    rate = speed * (1.0 - 4.0 * tau + 3.0 * tau**2) + way / span * 6.0 * (tau - tau**2)
    return along_path(part, target, state, times, np.maximum.accumulate(s), np.maximum(rate, 0.0), config)


def cruise_guess(
    part: PathPart, target: Target, state: Array, times: Array, config: ControllerConfig
) -> Trajectory:
    """Speed changing at the comfort acceleration to the cruise speed, until the target's progress."""
    now = max(part.direction * float(state[V]), 0.0)
    elapsed = times - times[0]
    most = config.comfort_acceleration * elapsed
    change = np.clip(config.cruise_speed - now, -most, most)
    rate = now + change
    s = np.append(0.0, np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(times)))
    left = max(target.theta - float(state[THETA]), 0.0)
    rate = np.where(s < left, rate, 0.0)
    return along_path(part, target, state, times, np.minimum(s, left), rate, config)


def along_path(
    part: PathPart,
    target: Target,
    state: Array,
    times: Array,
    s: Array,
    rate: Array,
    config: ControllerConfig,
) -> Trajectory:
    """The trajectory that has driven the way `s` (N+1,) [m] at speed `rate` (N+1,) [m/s] at `times`.

    The vehicle's offset from the path fades out over the first metres, the target's fades in over the last,
    both as cubics whose slope is the heading. The guess need not obey the dynamics, the first iterations
    see to that, but the less it slips sideways the less they have to change.
    """
    theta = state[THETA] + s
    reference = part.reference(theta)
    here, there = part.pose(float(state[THETA])), part.pose(target.theta)
    begin = Pose2(float(state[X]), float(state[Y]), float(state[PHI])).relative_to(here)
    end = target.pose.relative_to(there)
    reach = min(BLEND, max(target.theta - float(state[THETA]), 1e-3))
    left, into = 1.0 - s / reach, 1.0 + (theta - target.theta) / reach
    across_begin, slope_begin = _fade(left, begin.y, -part.direction * _slope(begin.phi), reach)
    across_end, slope_end = _fade(into, end.y, part.direction * _slope(end.phi), reach)
    along = _smooth(left) * begin.x + _smooth(into) * end.x
    across, slope = across_begin + across_end, slope_end - slope_begin
    c, sn = np.cos(reference.phi), np.sin(reference.phi)
    stretch = np.maximum(1.0 - part.direction * reference.slope * across, 0.2)

    states = np.empty((len(times), STATES))
    states[:, X] = reference.x + c * along - sn * across
    states[:, Y] = reference.y + sn * along + c * across
    states[:, PHI] = reference.phi + part.direction * np.arctan(slope / stretch)
    states[:, V] = part.direction * rate * np.hypot(stretch, slope)
    states[:, THETA] = np.minimum(theta, target.stop)
    turn = np.gradient(states[:, PHI]) / np.maximum(np.gradient(s), 1e-6)
    steering = np.arctan(config.vehicle.wheelbase * part.direction * turn)
    states[:, DELTA] = np.clip(steering, -config.limits.steering, config.limits.steering)
    states[0] = state
    states[0, PHI] = lift(float(state[PHI]), float(states[1, PHI]))
    lengths = np.diff(times)
    controls = np.empty((len(lengths), CONTROLS))
    controls[:, A] = np.diff(states[:, V]) / lengths
    controls[:, DELTA_DOT] = np.diff(states[:, DELTA]) / lengths
    controls[:, THETA_DOT] = np.diff(states[:, THETA]) / lengths
    limits = config.limits
    controls[:, A] = np.clip(controls[:, A], -limits.acceleration, limits.acceleration)
    controls[:, DELTA_DOT] = np.clip(controls[:, DELTA_DOT], -limits.steering_rate, limits.steering_rate)
    return Trajectory(times=times, states=states, controls=controls)


def _fade(share: Array, offset: float, slope: float, reach: float) -> tuple[Array, Array]:
    """Cubic from 0 with slope 0 at `share` 0 to `offset` with `slope` at `share` 1, and its slope.

    Slopes are per metre of way; `share` runs over `reach` [m].
    """
    t = np.clip(share, 0.0, 1.0)
    value = offset * (3.0 - 2.0 * t) * t**2 + reach * slope * (t - 1.0) * t**2
    return value, offset * 6.0 * t * (1.0 - t) / reach + slope * (3.0 * t - 2.0) * t


def _slope(heading: float) -> float:
    """Lateral way per way of a vehicle turned by `heading` [rad] from the path, within 60 deg."""
    return tan(min(max(heading, -1.05), 1.05))


def _smooth(share: Array) -> Array:
    """Smooth step of `share`, 0 below 0 and 1 above 1."""
    t = np.clip(share, 0.0, 1.0)
    return t * t * (3.0 - 2.0 * t)
