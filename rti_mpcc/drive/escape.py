"""Creeping out of an overlap: a decision of the user's, `ControllerConfig.escape_speed`.

It follows an arc at one steering angle on which each overlap falls from body to body until there is none, and
the body comes nearer to nothing else. The wheels are turned before the vehicle moves.
"""

from __future__ import annotations

from itertools import product

import numpy as np

from rti_mpcc.config import ControllerConfig
from rti_mpcc.drive.fallback import arc
from rti_mpcc.model.footprint import clearances
from rti_mpcc.model.layout import CONTROLS, DELTA, DELTA_DOT, A, V
from rti_mpcc.ocp.horizon import read_only
from rti_mpcc.types import Array, Trajectory
from rti_mpcc.world.surroundings import Surroundings

SPACING = 0.04  # [m] between two bodies that are checked
LONGEST = 2.0  # [m], longest escape
STEERING_SHARES = (0.0, 0.25, -0.25, 0.5, -0.5, 1.0, -1.0)  # of the largest angle, in this order
STEERING_TOLERANCE = 0.02  # [rad] within which the wheels are there
RISE_TIME = 0.3  # [s], time constant with which the speed is set


def escape_motion(
    state: Array, begin: float, surroundings: Surroundings, part: int, config: ControllerConfig
) -> Trajectory | None:
    """The motion out of an overlap from `state` (6,) at `begin` [s]: its first control turns the wheels or
    creeps. None: there is none, it is not wanted, or the vehicle is too fast."""
    most, speed, standing = config.escape_speed, float(state[V]), config.rest_speed
    if most == 0.0 or abs(speed) > most + standing:
        return None
    if abs(speed) > standing:  # it creeps already: it goes on as it does while that leads out
        arcs = [(float(np.sign(speed)), float(state[DELTA]))]
    else:
        tried = config.limits.steering * np.array(STEERING_SHARES)
        angles = sorted(tried, key=lambda angle: abs(angle - state[DELTA]))
        arcs = [(sign, float(angle)) for angle, sign in product(angles, (1.0, -1.0))]
    ways = [(_distance_until_free(state, *arc, surroundings, part, config), arc) for arc in arcs]
    way, (sign, angle) = min(ways, key=lambda each: each[0])
    return None if way == np.inf else _creep(state, sign, angle, begin, config)


def _distance_until_free(
    state: Array, sign: float, steering: float, around: Surroundings, part: int, config: ControllerConfig
) -> float:
    """Way [m] after which the body is free on an arc; inf if it is not, or the overlap does not fall."""
    least, reach = config.clearance.least, LONGEST
    ways = np.linspace(0.0, sign * reach, round(reach / SPACING) + 1)
    states = arc(state, ways, steering, config.vehicle.wheelbase)
    apart = clearances(states, around.known, part, config.vehicle)
    before = apart[0]
    overlaps, rest = before < 0.0, np.minimum(before, least)
    for way, now in zip(ways[1:].tolist(), apart[1:], strict=True):
        if (now[overlaps] <= np.minimum(before[overlaps], 0.0)).any() or (now < rest)[~overlaps].any():
            return np.inf
        if (now >= 0.0).all():
            return float(abs(way))
        before, overlaps = now, overlaps & (now < 0.0)
    return np.inf


def _creep(state: Array, sign: float, angle: float, begin: float, config: ControllerConfig) -> Trajectory:
    """Turn the wheels to `angle`, or creep on with them there, from `begin` [s] on."""
    turn, limits, speed = angle - float(state[DELTA]), config.limits, float(state[V])
    turned = abs(turn) <= STEERING_TOLERANCE or abs(speed) > config.rest_speed
    wanted, most = sign * config.escape_speed if turned else 0.0, config.comfort_acceleration
    times = np.linspace(0.0, config.stages * config.cycle, config.stages + 1)
    speeds = wanted + (speed - wanted) * np.exp(-times / max(RISE_TIME, config.cycle))
    controls = np.zeros((config.stages, CONTROLS))
    controls[:, A] = np.clip(np.diff(speeds) / config.cycle, -most, most)
    controls[0, DELTA_DOT] = np.clip(turn / config.cycle, -limits.steering_rate, limits.steering_rate)
    speeds = speed + config.cycle * np.append(0.0, np.cumsum(controls[:, A]))
    ways = config.cycle * np.append(0.0, np.cumsum(0.5 * (speeds[1:] + speeds[:-1])))
    states = arc(state, ways, angle if turned else float(state[DELTA]), config.vehicle.wheelbase)
    states[:, V], states[0] = speeds, state
    times += begin
    read_only(times, states, controls)
    return Trajectory(times=times, states=states, controls=controls)
