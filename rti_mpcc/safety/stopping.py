"""Motions of a vehicle that brakes to a standstill: with its steering held, or along a plan."""

from __future__ import annotations

from math import inf

import numpy as np

from geometry import wrap
from rti_mpcc.config import ControllerConfig
from rti_mpcc.model.layout import CONTROLS, DELTA, DELTA_DOT, PHI, THETA, A, V, X, Y
from rti_mpcc.ocp.horizon import read_only, stage_lengths, stage_times
from rti_mpcc.planning.context import PlanningContext
from rti_mpcc.planning.state import ControllerState
from rti_mpcc.safety import contact, fallback
from rti_mpcc.types import Array, Trajectory

BRAKING_OFFSET = (0.2, 0.1)  # [m], [rad]; a plan that passes farther from the vehicle is not braked along
LEAST_DECELERATION = 1e-3  # [m/s²] of a motion that is checked


def braking(
    context: PlanningContext, deceleration: float, config: ControllerConfig, along: Trajectory | None = None
) -> Trajectory:
    """The motion of a vehicle that brakes at `deceleration` [m/s²], along a plan that it is near to."""
    lengths = stage_lengths(config.cruise_horizon, config.cycle, config.stages)
    times = stage_times(context.begin, lengths)
    motion = None if along is None else _stopping_along(along, context.state, times, deceleration)
    return motion or stopping_motion(context.state, times, deceleration, config.vehicle.wheelbase)


def slowing(context: PlanningContext, plan: Trajectory, config: ControllerConfig) -> Trajectory:
    """The motion along a plan that stops after the whole distance that is checked for a stop."""
    speed = float(context.state[V])
    need = contact.stopping_distance(speed, config)
    return braking(context, max(speed**2 / (2.0 * need), LEAST_DECELERATION), config, plan)


def braking_in_time(
    s: ControllerState,
    context: PlanningContext,
    wanted: float,
    config: ControllerConfig,
    along: Trajectory | None = None,
) -> tuple[Trajectory, float]:
    """The gentlest braking that stops before a contact, and its deceleration [m/s²], `wanted` at least.

    `along`: a plan to brake along, where that is as gentle as with the steering held.
    """
    speed, found = float(context.state[V]), []
    for plan in (None,) if along is None else (along, None):
        motion = braking(context, wanted, config, plan)
        distance = contact.clear_distance(s, motion, config)
        needed = wanted if distance == inf else max(wanted, fallback.before_contact(speed, distance, config))
        found.append((motion, needed, plan))
    motion, needed, plan = min(found, key=lambda each: each[1])
    return (motion if needed == wanted else braking(context, needed, config, plan)), needed


def stopping_motion(state: Array, times: Array, deceleration: float, wheelbase: float) -> Trajectory:
    """Constant `deceleration` [m/s²] from `state` (6,) to rest on an arc, at `times` (N+1,) [s]."""
    speed, forward = abs(float(state[V])), float(np.sign(state[V]))
    elapsed = np.minimum(times - times[0], speed / deceleration)
    travelled = forward * (speed * elapsed - 0.5 * deceleration * elapsed**2)
    states = arc(state, travelled, float(state[DELTA]), wheelbase)
    states[:, V] = forward * (speed - deceleration * elapsed)
    states[:, THETA] += np.abs(travelled)
    return _with_controls(times, states)


def arc(state: Array, ways: Array, steering: float, wheelbase: float) -> Array:
    """States (n, 6) after `ways` (n,) [m] from `state` (6,) at one steering angle."""
    half = 0.5 * ways * np.tan(steering) / wheelbase
    states = np.tile(state, (len(ways), 1))
    chord = ways * np.sinc(half / np.pi)
    states[:, X] += chord * np.cos(state[PHI] + half)
    states[:, Y] += chord * np.sin(state[PHI] + half)
    states[:, PHI] += 2.0 * half
    states[:, DELTA] = steering
    return states


def _stopping_along(plan: Trajectory, state: Array, times: Array, deceleration: float) -> Trajectory | None:
    """The same beside a plan; None where the vehicle is not near it, or the plan goes the other way."""
    travelled, states = _way_of(plan)
    speed, here = abs(float(state[V])), _distance_to(state, states, travelled)
    at_here = _states_at(states, travelled, np.array([here]))[0]
    off = state - at_here
    aside, turned = float(np.hypot(off[X], off[Y])), abs(float(wrap(off[PHI])))
    position, heading = BRAKING_OFFSET
    if aside > position or turned > heading or float(at_here[V] * state[V]) <= 0.0:
        return None
    elapsed = np.minimum(times - times[0], speed / deceleration)
    left = here + speed * elapsed - 0.5 * deceleration * elapsed**2
    found = _states_at(states, travelled, left)
    found[:, : PHI + 1] += off[: PHI + 1]
    found[:, V] = np.sign(state[V]) * (speed - deceleration * elapsed)
    found[:, DELTA] += off[DELTA] * (elapsed == 0.0)
    found[:, THETA] = state[THETA] + (left - here)
    found[0] = state
    return _with_controls(times, found)


def distance_to_end(plan: Trajectory, state: Array) -> float:
    """Distance [m] along a plan from its place nearest to `state` (6,) to its end."""
    travelled, states = _way_of(plan)
    return float(travelled[-1]) - _distance_to(state, states, travelled)


def _way_of(plan: Trajectory) -> tuple[Array, Array]:
    """Distances (n,) [m] that a plan has driven at its states (n, 6), without those where it stands."""
    steps = np.hypot(np.diff(plan.states[:, X]), np.diff(plan.states[:, Y]))
    driven = np.append(True, steps > 1e-9)
    return np.append(0.0, np.cumsum(steps))[driven], plan.states[driven]


def _distance_to(state: Array, states: Array, travelled: Array) -> float:
    """The distance [m] at which the polyline of `states` (n, 6) is nearest to `state`."""
    if len(states) < 2:
        return 0.0
    place = states[:, X] + 1j * states[:, Y]
    pieces, lengths = np.diff(place), np.diff(travelled)
    share = ((complex(state[X], state[Y]) - place[:-1]) * pieces.conj()).real / np.abs(pieces) ** 2
    share = np.clip(share, 0.0, 1.0)
    nearest = int(np.argmin(np.abs(place[:-1] + share * pieces - complex(state[X], state[Y]))))
    return float(travelled[nearest] + share[nearest] * lengths[nearest])


def _states_at(states: Array, travelled: Array, at: Array) -> Array:
    """States (m, 6) after the distances `at` (m,) [m]; straight on behind the end."""
    found = np.stack([np.interp(at, travelled, column) for column in states.T], axis=-1)
    beyond = np.maximum(at - travelled[-1], 0.0) * np.sign(states[0, V])
    found[:, X] += beyond * np.cos(found[:, PHI])
    found[:, Y] += beyond * np.sin(found[:, PHI])
    return found


def _with_controls(times: Array, states: Array) -> Trajectory:
    """States (N+1, 6) at `times` (N+1,) [s] with the controls that lead from one to the next."""
    controls, lengths = np.zeros((len(times) - 1, CONTROLS)), np.diff(times)
    controls[:, A] = np.diff(states[:, V]) / lengths
    controls[:, DELTA_DOT] = np.diff(states[:, DELTA]) / lengths
    read_only(times, states, controls)
    return Trajectory(times=times, states=states, controls=controls)
