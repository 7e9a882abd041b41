"""The estimate of the vehicle's state, and why the measurement is doubted.

In every cycle the sensors are compared with each other and with the commands (`estimation.sensors`): a speed
or a steering that is left out is replaced. The last estimate is predicted by the commands and compared with
the measurement, which is filtered (`estimation.vehicle_filter`). A measurement is doubted if it is no state
of a vehicle, if its pose jumps, if its pose or its steering is at fault, or if it has not changed although
the vehicle must have moved. The estimate is then dead-reckoned from the commands, with the speed that is
measured. The measurement is trusted again once it agrees with the estimate, or, as the vehicle may have been
relocated, once it agrees with itself for `CONFIRMATION` while the vehicle stands: `TRIES` times, until the
vehicle has moved as its sensors say.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from math import hypot, isfinite, pi, remainder

import numpy as np

from estimation import MeasurementNoise
from estimation.odometry import AT, CommandedChange, Geometry
from estimation.sensors import Sensors, compare_sensors
from estimation.vehicle_filter import Elapsed, filtered
from rti_mpcc.config import ControllerConfig
from rti_mpcc.errors import BAD_INPUT
from rti_mpcc.model.actuators import UNDISTURBED, Disturbance, QueuedCommand, mean_rates, roll_forward
from rti_mpcc.model.layout import DELTA, STATES, V, X, Y
from rti_mpcc.types import Array, VehicleState

FROZEN_DISTANCE = 0.2  # [m] that the vehicle must have moved for an unchanged measurement to be an old one
FROZEN_SPEED = 0.3  # [m/s], the same for its speed
CONFIRMATION = 3.0  # [s] for which a standing vehicle has to be measured in the same place to be there
RESET_CONFIRMATION = 0.3  # [s], the same where place and speed changed at once: the vehicle was set there
TRIES = 3
"""So often a measurement is trusted once more that never shows a motion, each time after twice the time."""
RESET_LEAP = 0.2  # [m/s] by which the speed leaps where the vehicle was set elsewhere
PROVEN = 1.0  # [m] moved with sensors that agree
REST_SPEED = 0.05  # [m/s]; a vehicle measured slower stands, as far as a doubted measurement can say
MODEL_MISMATCH = 0.3  # of what a vehicle can do in the meantime: so wrong may its model be
LONGEST_GAP = 1.0  # [s] without a cycle, after which a measurement is taken as it is
FARTHEST = 1e10  # [m]; coordinates beyond this are no places on earth
LARGEST_HEADING = 1e4  # [rad]; headings beyond this have lost their precision
LARGEST_STEERING = 1.5  # [rad]
SPEED_SHARE = 3.0  # times the speed limit: no speed is beyond that


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StateMonitor:
    """The estimate at the time `at` [s], and why the measurement is doubted.

    Attributes:
        state: (6,) the estimate, progress 0; None before the first usable measurement.
        given: (6,) the last measurement; None before the first; unfit: it is no state of a vehicle.
        measured: (6,) the same without the sensors that are left out.
        dead_reckoned: (6,) dead-reckoned since `given` last changed.
        sensors: what is known of each sensor.
        doubt: what is wrong, or ""; since: from when on [s].
        agrees_since: when doubted measurements of a standing vehicle began to agree [s], or None.
        relocalised: the vehicle was just relocalised.
        odd_since: when measurements began to contradict one another [s], or None.
        disputed: the last possible speed that was measured contradicts the estimated one, or it is not known
            how long ago that was.
        gap: there was no usable measurement since a time without cycles.
        reset: place and speed changed at once when the doubt began.
        tries: number of times that a measurement was trusted again since the vehicle last moved with it.
        noise: of the measurements.
        commanded, acting: mean acceleration since the last cycle [m/s²], without and with the disturbance.
    """

    at: float = 0.0
    state: Array | None = None
    given: Array | None = None
    unfit: bool = False
    measured: Array | None = None
    dead_reckoned: Array | None = None
    sensors: Sensors = field(default_factory=Sensors)
    doubt: str = ""
    since: float = 0.0
    agrees_since: float | None = None
    relocalised: bool = False
    odd_since: float | None = None
    disputed: bool = False
    gap: bool = False
    reset: bool = False
    tries: int = 0
    noise: MeasurementNoise = field(default_factory=MeasurementNoise)
    commanded: float = 0.0
    acting: float = 0.0

    @property
    def steering_fault(self) -> bool:
        """Whether the steering is doubted, not the measurement."""
        return self.doubt != "" and self.doubt == self.sensors.unsteered

    def usable_measurement(self, config: ControllerConfig) -> Array | None:
        """The measurement (6,) for the last check of a command, None without any: the speed as it was given,
        unless its sensor is left out. Among measurements that contradict one another for long, an impossible
        one counts as in the direction in which the vehicle is estimated to move: it does not keep it from
        braking."""
        if self.measured is None or self.given is None:
            return self.measured
        usable = self.measured.copy()
        if not self.sensors.speed.problem:
            usable[V] = self.given[V]
        speed = 0.0 if self.state is None else float(self.state[V])
        for_long = self.odd_since is not None and self.at - self.odd_since > config.plausibility.blind
        known = for_long and not self.disputed and abs(speed) > REST_SPEED
        if known and not _possible(float(usable[V]), config):
            usable[V] = np.copysign(usable[V], speed)
        return usable


def validate_measurement(
    last: StateMonitor,
    given: VehicleState,
    queue: tuple[QueuedCommand, ...],
    now: float,
    config: ControllerConfig,
    disturbance: Disturbance = UNDISTURBED,
) -> StateMonitor:
    """What to believe at `now` [s] after one more measurement; `queue`: the commands since the last cycle."""
    read, problem = _read(given, config)
    seconds, unfit = now - last.at, problem != ""
    if last.gap or seconds > LONGEST_GAP or last.state is None or last.given is None:
        reached, until = last.state, min(now, last.at + LONGEST_GAP)
        if reached is not None:
            reached = roll_forward(reached, queue, last.at, until, config, disturbance)
        return _first(last, read, problem, now, reached)
    assert last.measured is not None
    assert last.dead_reckoned is not None
    known = np.array((last.state, last.measured, last.dead_reckoned))
    expected, follows, driven_on = roll_forward(known, queue, last.at, now, config, disturbance)
    commanded = mean_rates(queue, last.at, now)[0]
    gained, acting = seconds * commanded, disturbance.acting(commanded)
    same, sensors = not problem and read.tolist() == last.given.tolist(), last.sensors
    alike = not (unfit or last.unfit)
    alike = alike and not _far(read, last.given + follows - last.measured, seconds, config)
    counted = alike and seconds <= config.longest_cycle
    if counted and sensors.track is not None and now > sensors.track[-1, AT]:
        steered = float(follows[DELTA] - last.measured[DELTA])
        asked = CommandedChange(gained, steered, float(last.state[DELTA]), seconds * acting)
        body = Geometry(config.vehicle.wheelbase, config.limits.steering)
        sensors = compare_sensors(sensors, now, read, asked, last.noise.stds, body)
    elif not problem:
        sensors = sensors.restarted(now, read, last.state)
    measured = read if problem else sensors.usable(read, config.vehicle.wheelbase)
    dead_reckoned = driven_on if same else measured
    frozen = _frozen(measured, dead_reckoned) if same else ""
    jump = "" if problem else _far(measured, expected, seconds, config)
    problem = problem or frozen or sensors.pose or jump or sensors.unsteered
    fault = problem == sensors.unsteered != ""
    alike = alike or not problem
    speed, steady, disputed = float(measured[V]), alike, last.disputed
    if _possible(speed, config):  # it speaks for itself where the place does not
        followed = float(last.given[V]) + float(follows[V]) - float(last.measured[V])
        steady = steady or abs(speed - followed) <= config.plausibility.speed
        disputed = not steady and abs(speed - float(expected[V])) > config.plausibility.speed
    rests = abs(float(measured[V])) <= REST_SPEED
    agrees = problem and alike and rests
    if frozen or sensors.pose or fault:
        agrees = agrees and last.tries < TRIES and abs(float(dead_reckoned[V])) <= REST_SPEED
    if sensors.pose:
        agrees = agrees and sensors.consistent and not sensors.elsewhere
    if problem and not fault:
        state = dead_reckoned if frozen else _dead_reckoned(measured, expected, steady, config)
        noise = last.noise.broken()
    elif problem or last.doubt or same or not config.vehicle_filter.enabled:
        state, noise = measured, last.noise.broken()
    else:
        since = Elapsed(float(seconds), float(gained), config.max_curvature)
        state, noise = filtered(last.noise, measured, follows, expected, since)
    leapt = abs(float(measured[V] - expected[V])) > RESET_LEAP
    monitor = StateMonitor(
        at=now,
        state=state,
        given=read,
        unfit=unfit,
        measured=measured,
        dead_reckoned=dead_reckoned,
        sensors=sensors,
        doubt=problem,
        since=last.since if problem and last.doubt else now,
        agrees_since=(now if last.agrees_since is None else last.agrees_since) if agrees else None,
        odd_since=None if alike else (now if last.odd_since is None else last.odd_since),
        disputed=disputed,
        reset=problem != "" and (last.reset if last.doubt else jump != "" and rests and leapt),
        tries=0 if sensors.moved > PROVEN else last.tries,
        noise=noise,
        commanded=commanded,
        acting=acting,
    )
    return _tried_again(monitor, limited=bool(frozen or sensors.pose or fault)) if agrees else monitor


def _tried_again(monitor: StateMonitor, *, limited: bool) -> StateMonitor:
    """A doubted measurement is trusted once it agrees with itself for long; `limited`: `TRIES` times."""
    since, read, measured = monitor.agrees_since, monitor.given, monitor.measured
    needed = RESET_CONFIRMATION if monitor.reset else CONFIRMATION * 2**monitor.tries
    if since is None or read is None or measured is None or monitor.at - since < needed:
        return monitor
    return replace(
        monitor,
        state=measured,
        dead_reckoned=measured,
        sensors=monitor.sensors.trusted(monitor.at, read, measured),
        doubt="",
        relocalised=True,
        tries=monitor.tries + limited,
    )


def _first(
    last: StateMonitor, measured: Array, problem: str, now: float, reached: Array | None
) -> StateMonitor:
    """The first measurement, or the first one after a gap, in which too much may have happened.

    `reached`: (6,) the last estimate, driven on by the commands; None without one.
    """
    if not problem:
        return StateMonitor(
            at=now,
            state=measured,
            given=measured,
            measured=measured,
            dead_reckoned=measured,
            sensors=last.sensors._replace(elsewhere=False).trusted(now, measured, measured),
            relocalised=last.state is not None,
            noise=last.noise.broken(),
        )
    return replace(
        last,
        at=now,
        state=reached,
        given=measured,
        unfit=True,
        measured=measured,
        doubt=problem,
        since=last.since if last.doubt else now,
        agrees_since=None,
        odd_since=now if last.odd_since is None else last.odd_since,
        disputed=last.state is not None,
        relocalised=False,
        gap=last.state is not None,
    )


def _read(given: VehicleState, config: ControllerConfig) -> tuple[Array, str]:
    """The given state (6,), and why it is no state of a vehicle, or ""."""
    numbers = []
    for name in ("x", "y", "phi", "v", "delta"):
        if not hasattr(given, name):
            got = "None" if given is None else type(given).__name__
            return np.full(STATES, np.nan), f"expected VehicleState, got {got}"
        try:
            numbers.append(float(getattr(given, name)))
        except BAD_INPUT:
            return np.full(STATES, np.nan), f"state.{name} is not a number: {getattr(given, name)!r:.40}"
    x, y, phi, v, delta = numbers
    state, finite = np.array((*numbers, 0.0)), all(map(isfinite, numbers))
    placed = max(abs(x), abs(y)) <= FARTHEST and abs(phi) <= LARGEST_HEADING
    if finite and placed and _possible(v, config) and abs(delta) <= LARGEST_STEERING:
        return state, ""
    told = f"(x = {x:.6g}, y = {y:.6g}, phi = {phi:.6g}, v = {v:.6g}, delta = {delta:.6g})"
    return state, f"{'not a state that the vehicle can have' if finite else 'not a finite state'} {told}"


def _frozen(measured: Array, dead_reckoned: Array) -> str:
    """Why this measurement must be an old one, or ""."""
    distance = hypot(measured[X] - dead_reckoned[X], measured[Y] - dead_reckoned[Y])
    if distance <= FROZEN_DISTANCE and abs(float(measured[V] - dead_reckoned[V])) <= FROZEN_SPEED:
        return ""
    return f"the measured state does not change, but by its commands the vehicle has moved {distance:.2f} m"


def _far(measured: Array, expected: Array, seconds: float, config: ControllerConfig) -> str:
    """Why the vehicle cannot have come from the expected state to this one, or ""."""
    allowed = config.plausibility
    x, y, phi, _, delta, _ = (measured - expected).tolist()
    jump, turn, steered, far = hypot(x, y), abs(remainder(phi, 2.0 * pi)), abs(delta), []
    share = 1.0 if seconds > config.longest_cycle else MODEL_MISMATCH
    distance = share * max(abs(float(measured[V])), abs(float(expected[V]))) * seconds
    if jump > allowed.position + distance:
        far.append(f"position by {jump:.2f} m")
    if turn > allowed.heading + distance * config.max_curvature:
        far.append(f"heading by {turn:.2f} rad")
    if steered > allowed.steering + share * config.limits.steering_rate * seconds:
        far.append(f"steering by {steered:.2f} rad")
    return f"the measured state has jumped: {', '.join(far)}" if far else ""


def _possible(speed: float, config: ControllerConfig) -> bool:
    """Whether a vehicle can be so fast [m/s]."""
    return abs(speed) <= SPEED_SHARE * config.limits.speed


def _dead_reckoned(measured: Array, expected: Array, steady: bool, config: ControllerConfig) -> Array:
    """The state (6,) to go by after a doubted measurement: of it only what can be true.

    `steady`: the speed has changed as commanded since the last measurement, or so has the place.
    """
    believed, off = expected.copy(), np.abs(measured - expected)
    if steady or off[V] <= config.plausibility.speed:  # steady: never what is reckoned alone
        believed[V] = measured[V]
    if off[DELTA] <= config.plausibility.steering:
        believed[DELTA] = measured[DELTA]
    return believed
