"""What the measured state is worth: the state that is believed, and why the measured one is not.

Every cycle the state believed last is rolled forward by the commands under way and set against the
measurement, which is believed as far as it is no noise (`estimation.vehicle_filter`). Doubted is a
measurement that cannot be (not finite, no vehicle's), that has not changed although the vehicle must have
moved, or that is farther off than the vehicle can be. What is believed is then reckoned from the commands.
It is trusted again once it agrees with the reckoning; or, as the vehicle may have been set down elsewhere,
once it has agreed with itself for `CONFIRMATION` while the vehicle stands. A steering that
moves otherwise than commanded is found out in the same way, and is given as much time. A measurement that
stays the same to the last bit may be an old one, or that of a vehicle that cannot move, told in round
numbers: once the vehicle must stand, it is tried again, but not for ever.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from math import exp, hypot, isfinite

import numpy as np

from estimation import MeasurementNoise
from estimation.vehicle_filter import filtered
from geometry import wrap
from rti_mpcc.config import ControllerConfig
from rti_mpcc.model.delay import QueuedCommand, mean_acceleration, roll_forward
from rti_mpcc.model.disturbance import UNDISTURBED, Disturbance
from rti_mpcc.model.layout import DELTA, STATES, V, X, Y
from rti_mpcc.types import Array, VehicleState

FROZEN_DISTANCE = 0.2  # [m] that the vehicle must have moved for an unchanged measurement to be an old one
FROZEN_SPEED = 0.3  # [m/s], the same for its speed
STEERING_GAP = 0.2  # [rad] by which the steering may move otherwise than commanded within STEERING_TIME
STEERING_TIME = 1.0  # [s]
CONFIRMATION = 3.0  # [s] for which a standing vehicle has to be measured in the same place to be there
FROZEN_TRIES = 3
"""So often a frozen measurement of a standing vehicle is trusted once more, each time after twice the
time."""
REST_SPEED = 0.05  # [m/s]; a vehicle measured slower stands, as far as a doubted measurement can say
MODEL_MISMATCH = 0.3  # of what a vehicle can do in the meantime: so wrong may its model be
LONGEST_GAP = 1.0  # [s] without a cycle, after which a measurement is taken as it is
FARTHEST = 1e10  # [m]; coordinates beyond this are no places on earth
LARGEST_HEADING = 1e4  # [rad]; headings beyond this have lost their precision
LARGEST_STEERING = 1.5  # [rad]
SPEED_SHARE = 3.0  # times the speed limit: no speed is beyond that


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StateMonitor:
    """What is believed at the time `at` [s], and why the measurement is not.

    Attributes:
        state: (6,) believed, progress 0; None before the first measurement that can be one.
        measured: (6,) the last measurement, whatever it was; None before the first.
        reckoned: (6,) where the commands have brought the vehicle since `measured` last changed.
        steering_gap: by how much the steering has lately moved otherwise than commanded [rad].
        why: what is wrong, or ""; since: for how long [s].
        steering_fault: it is the steering that cannot be relied on, not the measurement.
        agrees_since: since when doubted measurements agree with one another while the vehicle stands [s], or
            None.
        found: the vehicle was just found elsewhere than it was believed to be.
        odd_since: since when measurements contradict one another [s], or None.
        gap: there was no usable measurement since a time without cycles.
        tries: so often a frozen measurement was trusted once more since it last changed.
        noise: what is known of that of the measurements.
    """

    at: float = 0.0
    state: Array | None = None
    measured: Array | None = None
    reckoned: Array | None = None
    steering_gap: float = 0.0
    why: str = ""
    steering_fault: bool = False
    since: float = 0.0
    agrees_since: float | None = None
    found: bool = False
    odd_since: float | None = None
    gap: bool = False
    tries: int = 0
    noise: MeasurementNoise = field(default_factory=MeasurementNoise)

    def heeded(self, config: ControllerConfig) -> Array | None:
        """The measurement (6,) as far as it may hold a command back, NaN where not; None without any.

        Measurements that contradict one another for long must not keep a moving vehicle from braking.
        """
        if self.measured is None or self.state is None or self.odd_since is None:
            return self.measured
        checks = config.plausibility
        if abs(float(self.state[V])) <= REST_SPEED or self.at - self.odd_since <= checks.blind:
            return self.measured
        heeded = self.measured.copy()
        heeded[V] = np.nan
        return heeded

    def doubting(self, problem: str, last: StateMonitor) -> StateMonitor:
        """With a `problem` that has nothing to do with the vehicle's state, "" for none."""
        if not problem or self.why:
            return self
        return replace(self, why=problem, since=last.since if last.why else self.at)


def validate_measurement(
    last: StateMonitor,
    given: VehicleState,
    queue: tuple[QueuedCommand, ...],
    now: float,
    config: ControllerConfig,
    disturbance: Disturbance = UNDISTURBED,
) -> StateMonitor:
    """What to believe at `now` [s] after one more measurement; `queue`: the commands since the last cycle."""
    measured = _array(given)
    problem = _unfit(measured, config)
    if problem:
        problem = _no_state(given) or problem
    seconds = now - last.at
    anew = last.gap or seconds > LONGEST_GAP
    if last.state is None or last.measured is None or last.reckoned is None or anew:
        return _first(last, measured, problem, queue, now, config, disturbance)

    def rolled(state: Array) -> Array:
        return by_commands(state, queue, last.at, now, config, disturbance)

    expected = rolled(last.state)
    same = not problem and measured.tolist() == last.measured.tolist()
    reckoned = rolled(last.reckoned) if same else measured
    frozen = _frozen(measured, reckoned) if same else ""
    problem = problem or frozen or _far(measured, expected, seconds, config)
    gap, fault = last.steering_gap * exp(-seconds / STEERING_TIME), ""
    follows = expected if last.why else rolled(last.measured)
    if not problem:
        gap += float(measured[DELTA] - follows[DELTA])
        problem = fault = _steering_fault(gap, last)
    alike = not problem or _alike(measured, last.measured, rolled, seconds, config)
    agrees = problem and alike and abs(float(measured[V])) <= REST_SPEED
    if frozen:
        agrees = agrees and last.tries < FROZEN_TRIES and abs(float(reckoned[V])) <= REST_SPEED
    state, noise = measured, last.noise.broken()
    if problem and not fault:
        state = _believed(measured, expected, reckoned if frozen else None, config)
    elif not (problem or last.why or same) and config.vehicle_filter.enabled:
        gained = seconds * mean_acceleration(queue, last.at, now)
        state, noise = filtered(
            last.noise, measured, follows, expected, seconds, gained, config.max_curvature
        )
    monitor = StateMonitor(
        at=now,
        state=state,
        measured=measured,
        reckoned=reckoned,
        steering_gap=gap,
        why=problem,
        steering_fault=bool(fault),
        since=last.since if problem and last.why else now,
        agrees_since=(now if last.agrees_since is None else last.agrees_since) if agrees else None,
        found=False,
        odd_since=None if alike else (now if last.odd_since is None else last.odd_since),
        tries=last.tries if same else 0,
        noise=noise,
    )
    since = monitor.agrees_since
    if since is None or now - since < CONFIRMATION * 2**monitor.tries:
        return monitor
    tries = monitor.tries + bool(frozen)
    return replace(
        monitor,
        state=measured,
        reckoned=measured,
        steering_gap=0.0,
        why="",
        steering_fault=False,
        found=True,
        tries=tries,
    )


def _first(
    last: StateMonitor,
    measured: Array,
    problem: str,
    queue: tuple[QueuedCommand, ...],
    now: float,
    config: ControllerConfig,
    disturbance: Disturbance,
) -> StateMonitor:
    """The first measurement, or the first one after a gap, in which too much may have happened."""
    if not problem:
        found = last.state is not None
        noise = last.noise.broken()
        return StateMonitor(
            at=now, state=measured, measured=measured, reckoned=measured, found=found, noise=noise
        )
    since = last.since if last.why else now
    state = last.state
    if state is not None:
        until = min(now, last.at + LONGEST_GAP)
        state = by_commands(state, queue, last.at, until, config, disturbance)
    return replace(
        last,
        at=now,
        state=state,
        measured=measured,
        why=problem,
        steering_fault=False,
        since=since,
        agrees_since=None,
        odd_since=now if last.odd_since is None else last.odd_since,
        found=False,
        gap=state is not None,
    )


def _array(state: VehicleState) -> Array:
    try:
        return np.array([state.x, state.y, state.phi, state.v, state.delta, 0.0], dtype=np.float64)
    except (AttributeError, TypeError, ValueError, OverflowError):
        return np.full(STATES, np.nan)


def _no_state(given: VehicleState) -> str:
    """Why this cannot even be read as a state, or ""."""
    for name in ("x", "y", "phi", "v", "delta"):
        if not hasattr(given, name):
            return f"expected VehicleState, got {'None' if given is None else type(given).__name__}"
        try:
            float(getattr(given, name))
        except (TypeError, ValueError, OverflowError):
            return f"state.{name} is not a number: {getattr(given, name)!r:.40}"
    return ""


def by_commands(
    state: Array,
    queue: tuple[QueuedCommand, ...],
    begin: float,
    end: float,
    config: ControllerConfig,
    disturbance: Disturbance = UNDISTURBED,
) -> Array:
    """The state (6,) at `end` [s] by the commands and what acts beside them, from the one at `begin`."""
    return roll_forward(
        state,
        queue,
        begin,
        end,
        wheelbase=config.vehicle.wheelbase,
        steering=config.limits.steering,
        disturbance=disturbance,
    )


def _unfit(state: Array, config: ControllerConfig) -> str:
    """Why this is no state of a vehicle, or ""."""
    x, y, phi, v, delta, _ = state.tolist()
    finite = all(map(isfinite, (x, y, phi, v, delta)))
    placed = max(abs(x), abs(y)) <= FARTHEST and abs(phi) <= LARGEST_HEADING
    moving = abs(v) <= SPEED_SHARE * config.limits.speed
    if finite and placed and moving and abs(delta) <= LARGEST_STEERING:
        return ""
    given = f"(x = {x:.6g}, y = {y:.6g}, phi = {phi:.6g}, v = {v:.6g}, delta = {delta:.6g})"
    return f"{'not a state that the vehicle can have' if finite else 'not a finite state'} {given}"


def _frozen(measured: Array, reckoned: Array) -> str:
    """Why this measurement must be an old one, or ""."""
    distance = hypot(measured[X] - reckoned[X], measured[Y] - reckoned[Y])
    if distance <= FROZEN_DISTANCE and abs(float(measured[V] - reckoned[V])) <= FROZEN_SPEED:
        return ""
    return f"the measured state does not change, but by its commands the vehicle has moved {distance:.2f} m"


def _far(measured: Array, expected: Array, seconds: float, config: ControllerConfig) -> str:
    """Why the vehicle cannot have come from the expected state to this one, or ""."""
    limits, allowed = config.limits, config.plausibility
    speed = max(abs(float(measured[V])), abs(float(expected[V])))
    share = 1.0 if seconds > config.longest_cycle else MODEL_MISMATCH
    distance = share * speed * seconds
    x, y, phi, v, delta, _ = (measured - expected).tolist()
    jumps = (
        ("position", "m", hypot(x, y), allowed.position + distance),
        ("heading", "rad", abs(wrap(phi)), allowed.heading + distance * config.max_curvature),
        ("speed", "m/s", abs(v), allowed.speed + share * limits.acceleration * seconds),
        ("steering", "rad", abs(delta), allowed.steering + share * limits.steering_rate * seconds),
    )
    far = [f"{name} by {jump:.2f} {unit}" for name, unit, jump, most in jumps if jump > most]
    return f"the measured state has jumped: {', '.join(far)}" if far else ""


def _alike(
    measured: Array, before: Array, rolled: Callable[[Array], Array], seconds: float, config: ControllerConfig
) -> bool:
    """Whether this measurement and the one before it are of one vehicle."""
    if _unfit(measured, config) or _unfit(before, config):
        return False
    return not _far(measured, rolled(before), seconds, config)


def _steering_fault(gap: float, last: StateMonitor) -> str:
    """Why the steering is not to be relied on, or ""; once found, until it was given its time."""
    if last.steering_fault:
        return last.why
    if abs(gap) > STEERING_GAP:
        return f"the steering does not follow its commands: {gap:+.2f} rad off"
    return ""


def _believed(measured: Array, expected: Array, frozen: Array | None, config: ControllerConfig) -> Array:
    """The state (6,) to go by after a doubted measurement: of it only what can be true."""
    if frozen is not None:
        return frozen
    believed = expected.copy()
    for quantity, most in ((V, config.plausibility.speed), (DELTA, config.plausibility.steering)):
        if abs(measured[quantity] - expected[quantity]) <= most:
            believed[quantity] = measured[quantity]
    return believed
