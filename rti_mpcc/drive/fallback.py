"""The fallback, step by step (docs/method.md, "What is driven"), and the motions that brake to rest.

A plan that is not clear is not driven: the vehicle brakes along its last plan, as gently as it stops in time.
It stays blocked until the plan has been clear for a while, see `driving._yielding`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import hypot, inf, sqrt

import numpy as np

from geometry import wrap
from rti_mpcc.config import ControllerConfig
from rti_mpcc.course import collision_check
from rti_mpcc.course.context import PlanningContext
from rti_mpcc.model.bicycle import rollout
from rti_mpcc.model.layout import CONTROLS, DELTA, DELTA_DOT, PHI, THETA, A, V, X, Y
from rti_mpcc.ocp.horizon import read_only, resample, stage_lengths, stage_times
from rti_mpcc.state import ControllerState
from rti_mpcc.types import Array, Source, Trajectory

PLAN_LIFE = 1.0  # [s] for which the last plan may be driven on
PLAN_OFFSET = (0.5, 0.2)  # [m], [rad]; a plan that starts farther from the vehicle is not driven on
SETTLING_FACTOR = 1.05  # times comfort, at most, for a stop at the target: some millimetres more are better
SETTLING_LEAST = 0.5  # times comfort, at least
SETTLING_TIME = 0.15  # [s], time constant with which the last of the speed is taken out,
HOLDING_TIME = 0.5  # [s], the same while standing, so that noise hardly shows
STOP_DISTANCE = 0.3  # [m] to a contact at which a blocked vehicle means to stand
STEERING_SPEED = 0.1  # [m/s]; slower, the steering is not turned while braking


@dataclass(frozen=True, slots=True)
class ControlInput:
    """Acceleration [m/s²] and steering rate [rad/s] for the vehicle, and where they come from."""

    acceleration: float
    steering_rate: float
    source: Source


def brake(
    state: Array,
    deceleration: float,
    config: ControllerConfig,
    steering_rate: float = 0.0,
    before: float | None = None,
    settling: float = 0.0,
) -> ControlInput:
    """Brake at `deceleration` [m/s²] to a standstill, softly unless it is harder than firm.

    `steering_rate` continues [rad/s]; `before`: deceleration until now [m/s²], or None; `settling`: time
    constant with which the last of the speed is taken out [s], at least `SETTLING_TIME`.
    """
    speed, comfort = float(state[V]), config.comfort
    wanted = min(deceleration, config.limits.acceleration)
    if deceleration > config.firm_deceleration:
        wanted = min(wanted, abs(speed) / config.cycle)
    else:
        if before is not None and deceleration <= comfort.acceleration:
            wanted = min(wanted, max(before, 0.0) + comfort.jerk * config.cycle)
        jerk = _release_jerk(deceleration, config)
        settling = max(settling, SETTLING_TIME, config.cycle)
        wanted = min(wanted, sqrt(jerk * abs(speed)), abs(speed) / settling)
    rate = steering_rate if abs(speed) > STEERING_SPEED else 0.0
    return ControlInput(-float(np.sign(speed)) * wanted, rate, Source.BRAKING)


def _release_jerk(deceleration: float, config: ControllerConfig) -> float:
    """Jerk [m/s³] with which `brake` releases the brakes: evenly, the faster the harder they were."""
    return config.comfort.jerk * max(deceleration / config.comfort.acceleration, 1.0)


def mean_deceleration(speed: float, deceleration: float, config: ControllerConfig) -> float:
    """The constant deceleration [m/s²] that stops in the distance in which `brake` does, releasing the brakes
    with a = sqrt(j v): from v = a² / j on in 2/3 sqrt(v³ / j), which is a³ / (6 j²) more.

    Its even begin is left out: what is needed is asked again in each cycle.
    """
    speed, jerk = abs(speed), _release_jerk(deceleration, config)
    if deceleration > config.firm_deceleration or speed == 0.0:
        return deceleration
    if speed < deceleration**2 / jerk:
        return 0.75 * sqrt(jerk * speed)
    return 1.0 / (1.0 / deceleration + deceleration**3 / (3.0 * (jerk * speed) ** 2))


def shifted_plan(
    plan: Trajectory | None, accepted_at: float | None, context: PlanningContext
) -> Trajectory | None:
    """The last accepted plan, driven on from where the vehicle is; None if it is too old or too far off."""
    config = context.config
    if plan is None or accepted_at is None or not 0.0 <= context.now - accepted_at <= PLAN_LIFE:
        return None
    times = stage_times(context.start_time, np.diff(plan.times))
    shifted = resample(plan, times, config.vehicle.wheelbase)
    off = context.state - shifted.states[0]
    position, heading = PLAN_OFFSET
    if hypot(off[X], off[Y]) > position * config.size or abs(wrap(float(off[PHI]))) > heading:
        return None
    states = rollout(context.state, shifted.controls, np.diff(times), config.vehicle.wheelbase)
    read_only(times, states, shifted.controls)
    return Trajectory(times=times, states=states, controls=shifted.controls)


def hold(state: Array, config: ControllerConfig, before: float = 0.0) -> ControlInput:
    """Stay at a standstill: the rest of the speed fades out gently, so that noise hardly shows.

    `before`: acceleration until now [m/s²]; brakes that stop no more than that speed are released evenly.
    """
    most, speed, jerk = config.limits.acceleration, float(state[V]), config.comfort.jerk
    wanted = max(min(-speed / max(HOLDING_TIME, config.cycle), most), -most)
    if before * speed < 0.0 and before**2 <= 2.0 * jerk * abs(speed):
        step = jerk * config.cycle
        wanted = max(min(wanted, before + step), before - step)
    return ControlInput(wanted, 0.0, Source.STANDSTILL)


def turn_wheels(state: Array, angle: float, config: ControllerConfig) -> ControlInput:
    """Stay at a standstill and turn the wheels to an angle [rad], as fast as comfort has it."""
    most = min(config.comfort_steering_rate, config.limits.steering_rate)
    rate = (angle - float(state[DELTA])) / config.cycle
    return replace(hold(state, config), steering_rate=max(min(rate, most), -most))


def braking_over(distance: float, speed: float, most: float, config: ControllerConfig) -> float:
    """Deceleration [m/s²] to stand after `distance` [m], the comfort one at least and `most` at most."""
    if distance <= 0.0:
        return most
    return min(max(speed**2 / (2.0 * distance), config.comfort_acceleration), most)


def before_contact(speed: float, distance: float, config: ControllerConfig) -> float:
    """Deceleration [m/s²] to stand `STOP_DISTANCE` before a contact `distance` [m] ahead, or comfort."""
    return braking_over(distance - STOP_DISTANCE * config.size, speed, config.limits.acceleration, config)


def settling_deceleration(context: PlanningContext) -> float:
    """Deceleration [m/s²], about comfort, to rest at the target's length, without a step, see `_eased`."""
    config = context.config
    before, comfort = context.deceleration, config.comfort
    # What the soft end of `brake` takes more than to brake on to the end.
    more = max(max(before, 0.0) ** 3 / (6.0 * comfort.jerk**2), 0.5 * before * context.settling**2)
    left = -context.mpcc.part.direction * context.error.x - more
    least = SETTLING_LEAST * comfort.acceleration
    most = min(SETTLING_FACTOR * comfort.acceleration, config.limits.acceleration)
    wanted = most if left <= 0.0 else _eased(context.speed, left, before, config.cycle)
    step = comfort.jerk * config.cycle
    return min(max(min(max(wanted, before - step), before + step), least), most)


def _eased(speed: float, distance: float, before: float, seconds: float) -> float:
    """Deceleration [m/s²] after `seconds` of a stop in `distance` [m] whose deceleration changes evenly from
    `before` [m/s²] on: with s = 2/3 v T - b T² / 6, or released evenly where b would stop it short."""
    root = 4.0 * speed**2 / 9.0 - 2.0 / 3.0 * before * distance
    if root <= 0.0 and before <= 0.0:
        return 0.0  # it stands
    duration = 2.0 * distance / (2.0 / 3.0 * speed + sqrt(root)) if root > 0.0 else 2.0 * speed / before
    if duration <= seconds:
        return speed / seconds
    return before - 2.0 * seconds * (before * duration - speed) / duration**2


# -- motions that brake to a standstill ------------------------------------------------------------------

BRAKING_OFFSET = (0.2, 0.1)  # [m], [rad]; a plan that passes farther from the vehicle is not braked along
LEAST_DECELERATION = 1e-3  # [m/s²] of a motion that is checked


def braking(context: PlanningContext, deceleration: float, along: Trajectory | None = None) -> Trajectory:
    """The motion of a vehicle that brakes at `deceleration` [m/s²], along a plan that it is near to."""
    config = context.config
    lengths = stage_lengths(config.cruise_horizon, config.cycle, config.stages)
    times = stage_times(context.start_time, lengths)
    motion = None if along is None else _stopping_along(along, context.state, times, deceleration)
    return motion or stopping_motion(context.state, times, deceleration, config.vehicle.wheelbase)


def slowing(context: PlanningContext, plan: Trajectory) -> Trajectory:
    """The motion along a plan that stops after the whole distance that is checked for a stop."""
    speed = float(context.state[V])
    need = collision_check.stopping_distance(speed, context.config)
    return braking(context, max(speed**2 / (2.0 * need), LEAST_DECELERATION), plan)


def braking_in_time(
    s: ControllerState, context: PlanningContext, wanted: float, along: Trajectory | None = None
) -> tuple[Trajectory, float]:
    """The gentlest braking that stops before a contact, and its deceleration [m/s²], `wanted` at least.

    `along`: a plan to brake along, where that is as gentle as with the steering held.
    """
    speed, config, found = float(context.state[V]), context.config, []
    mean = mean_deceleration(speed, wanted, config)
    for plan in (None,) if along is None else (along, None):
        motion = braking(context, mean, plan)
        distance = collision_check.clear_distance(s, motion, config)
        needed = wanted if distance == inf else max(wanted, before_contact(speed, distance, config))
        found.append((motion, needed, plan))
    motion, needed, plan = min(found, key=lambda each: each[1])
    if needed > wanted:
        motion = braking(context, mean_deceleration(speed, needed, config), plan)
    return motion, needed


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
    travelled, states = _path_of(plan)
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
    travelled, states = _path_of(plan)
    return float(travelled[-1]) - _distance_to(state, states, travelled)


def _path_of(plan: Trajectory) -> tuple[Array, Array]:
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
