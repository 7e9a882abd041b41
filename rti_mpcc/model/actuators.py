"""What acts when something is commanded, and what has to be commanded for what shall act.

**Lag and dead time.** Drive and steering answer a command u after a dead time T by a lag of first order. With
the value w that acts (acceleration or steering rate), w_0 at the begin of a command and h the time that it
acts for:

(D2)  w(t) = u + (w_0 - u) exp(-t / tau)
(D3)  u    = w_0 + (w - w_0) / (1 - exp(-h / tau)),   so that w acts after h

Plans are in terms of what acts. The queue of commands on their way holds the mean of (D2) over each command's
cycle, so the prediction (D1) of what the vehicle will be doing needs no more states. Set-points of speed and
steering are the integrals of the commanded rates. A speed control with the lag tau therefore answers them as
a drive with that lag answers accelerations: one model fits both interfaces.

**Disturbance.** The controller plans with what acts, the *effective* acceleration and steering; what is
commanded and measured is without what acts beside the commands:

(O4)  a_eff = (1 + g) a + d,   tan(delta_eff) = (1 + c) tan(delta + o)

A vehicle that turns too tightly, by a wrong wheelbase say, acts as if its wheels stood otherwise.
So the model (M1) stays as it is. Only where something comes in (the measured state, the commands under way)
or goes out (a command, a plan) one is turned into the other.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import atan, exp, isfinite, tan
from operator import attrgetter
from typing import NamedTuple, Self

import numpy as np

from geometry.compiled import Array2, Out2, inner, kernel
from rti_mpcc.config import ActuatorModel, ControllerConfig
from rti_mpcc.model.bicycle import propagate
from rti_mpcc.model.layout import CONTROLS, DELTA, DELTA_DOT, STATES, A
from rti_mpcc.types import Array

ACROSS = 1.55
"""Wheels turned farther than this are across the vehicle [rad]: the tangent ends there."""


class Disturbance(NamedTuple):
    """d, along the body's axis, to the front [m/s²]; o, of the wheels to the left [rad]; 1 + g, 1 + c."""

    acceleration: float = 0.0
    steering: float = 0.0
    gain: float = 1.0
    turn: float = 1.0

    def commanded(self, acceleration: float) -> float:
        """What has to be commanded [m/s²] for an acceleration that acts."""
        return (acceleration - self.acceleration) / self.gain

    def acting(self, commanded: float) -> float:
        """The acceleration [m/s²] that acts when this is commanded."""
        return self.gain * commanded + self.acceleration

    def acting_steering(self, measured: float) -> float:
        """The angle [rad] that acts when this is measured, (O4)."""
        if self.turn == 1.0:
            return measured + self.steering
        return atan(self.turn * tan(min(max(measured + self.steering, -ACROSS), ACROSS)))

    def measured_steering(self, acting: float) -> float:
        """The angle [rad] that is measured when this acts, (O4); NaN stays."""
        if self.turn == 1.0 or not isfinite(acting):
            return acting - self.steering
        return atan(tan(acting) / self.turn) - self.steering

    def commanded_rate(self, rate: float, acting: float, seconds: float) -> float:
        """The steering rate [rad/s] by which an angle that acts changes at `rate` [rad/s] for so long [s]."""
        if self.turn == 1.0:
            return rate
        end = self.measured_steering(acting + seconds * rate)
        return (end - self.measured_steering(acting)) / seconds

    def effective(self, measured: Array) -> Array:
        """The state (6,) with the steering that acts."""
        state = measured.copy()
        state[DELTA] = self.acting_steering(float(state[DELTA]))
        return state


acting_steering, measured_steering = inner(Disturbance.acting_steering), inner(Disturbance.measured_steering)
"""In kernels."""
UNDISTURBED = Disturbance()


# -- commands on their way ------------------------------------------------------------------------------


class QueuedCommand(NamedTuple):
    """A command on its way to the actuators: it acts from `begins` [s] on, until the next one does."""

    begins: float
    acceleration: float
    steering_rate: float


def roll_forward(
    states: Array,
    queue: Sequence[QueuedCommand],
    now: float,
    until: float,
    config: ControllerConfig,
    disturbance: Disturbance = UNDISTURBED,
) -> Array:
    """One state (6,), or several (n, 6), at `until`, driven from `now` on by the queued commands, (D1).

    Args:
        queue: ordered by `begins`; before the first one nothing acts.
        config: with the wheelbase, and the mechanical stop of the steering.
        disturbance: what acts besides, see (O4); all states have the steering that is measured.
    """
    commands = np.array(queue, np.float64).reshape(-1, len(QueuedCommand._fields))
    reached, most, wheelbase = states.copy(), config.limits.steering, config.vehicle.wheelbase
    rows = reached.reshape(-1, STATES)
    _roll_forward(commands, (now, until), disturbance, most, wheelbase, rows)
    return reached


@kernel
def _roll_forward(
    commands: Array2, span: tuple[float, float], disturbance: Disturbance, most: float, wheelbase: float,
    states: Out2,
) -> None:  # fmt: skip
    """Drive all states on over a `span` of time, by (O4) and (M1), from one command's begin to the next's.

    Their steering is the measured one, on the way the one that acts.
    """
    control = np.zeros(CONTROLS)
    for state in states:
        (begin, until), coming = span, 0
        delta = state[DELTA]
        state[DELTA] = acting_steering(disturbance, delta)
        while begin < until:
            while coming < len(commands) and commands[coming, 0] <= begin:
                coming += 1
            end = min(commands[coming, 0], until) if coming < len(commands) else until
            a = commands[coming - 1, 1] if coming > 0 else 0.0
            rate = commands[coming - 1, 2] if coming > 0 else 0.0
            seconds = end - begin
            delta = min(max(delta + rate * seconds, min(-most, delta)), max(most, delta))
            control[A] = disturbance.gain * a + disturbance.acceleration
            control[DELTA_DOT] = (acting_steering(disturbance, delta) - state[DELTA]) / seconds
            propagate(state, control, seconds, wheelbase, state)
            begin = end
        state[DELTA] = delta


def still_acting(queue: Sequence[QueuedCommand], now: float) -> tuple[QueuedCommand, ...]:
    """The queue without commands that another one has replaced by `now`."""
    begun = bisect_right(queue, now, key=attrgetter("begins"))
    return tuple(queue[max(begun - 1, 0) :])


def mean_rates(queue: Sequence[QueuedCommand], begin: float, end: float) -> tuple[float, float]:
    """Mean acceleration [m/s²] and steering rate [rad/s] that act from `begin` to `end` [s]; before the first
    command 0."""
    if end <= begin:
        return 0.0, 0.0
    speed, steering, ends = 0.0, 0.0, end  # each acts until the next one begins
    for command in reversed(queue):
        begins = max(command.begins, begin)
        if begins < ends:
            speed += (ends - begins) * command.acceleration
            steering += (ends - begins) * command.steering_rate
            ends = begins
    return speed / (end - begin), steering / (end - begin)


# -- lag ------------------------------------------------------------------------------------------------

MOST_LEAD = 6.0
"""Most by which (D3) raises a step of what shall act. It is reached at a lag of 5.5 cycles; beyond, the whole
lead would make of each noisy plan a jerk of the actuator."""
SHORT = 0.1
"""A lag up to this [s] is not inverted: for a dead time taken for it, that would be a jerk."""


class Actuator(NamedTuple):
    """Dead time [s] and time constant of the lag [s] of drive or steering."""

    dead_time: float = 0.0
    lag: float = 0.0

    def commanded(self, wanted: float, acting: float, seconds: float, most: float) -> float:
        """(D3): the command, `most` at most, by which `wanted` acts after `seconds`, from `acting` on."""
        if self.lag <= SHORT:
            return wanted
        return min(max(acting + self._lead(seconds) * (wanted - acting), -most), most)

    def continued(self, commanded: float, before: float, acting: float, seconds: float) -> float:
        """What the next plan continues from: what the last one wanted to act after `seconds`.

        That is what is `acting`, if (D3) inverted all of the lag. Else it is a part of what was wanted: plans
        that continued from a part would change it too slowly.
        """
        if self.lag <= SHORT:
            return commanded
        lead = self._lead(seconds)
        return acting if lead < MOST_LEAD else before + (commanded - before) / lead

    def _lead(self, seconds: float) -> float:
        """By how much (D3) raises a step of what shall act."""
        return min(1.0 / (1.0 - exp(-seconds / self.lag)), MOST_LEAD)

    def acting(self, commanded: float, before: float, seconds: float) -> float:
        """(D2): what acts `seconds` after a command began to act, where `before` acted."""
        if self.lag <= 0.0:
            return commanded
        return commanded + (before - commanded) * exp(-seconds / self.lag)

    def mean(self, commanded: float, before: float, seconds: float) -> float:
        """Mean of (D2) over the first `seconds`."""
        if self.lag <= 0.0:
            return commanded
        left = self.lag / seconds * (1.0 - exp(-seconds / self.lag))
        return commanded + (before - commanded) * left


class Actuators(NamedTuple):
    """Drive and steering."""

    drive: Actuator = Actuator()
    steering: Actuator = Actuator()

    @classmethod
    def of(cls, model: ActuatorModel) -> Self:
        """As given."""
        turning = model.dead_time if model.steering_dead_time is None else model.steering_dead_time
        return cls(Actuator(model.dead_time, model.drive_lag), Actuator(turning, model.steering_lag))

    @property
    def dead_time(self) -> float:
        """After which both act [s]: the quicker one waits."""
        return max(self.drive.dead_time, self.steering.dead_time)


@dataclass(frozen=True, slots=True, kw_only=True)
class Actuation:
    """The last command, and what acts at its begin.

    Attributes:
        begins: when it begins to act [s].
        acceleration, steering_rate: commanded [m/s²], [rad/s].
        before: (acceleration, steering rate) that act when it begins.
        speed, steering: the set-points that were sent with it [m/s], [rad].
    """

    begins: float
    acceleration: float
    steering_rate: float
    before: tuple[float, float]
    speed: float
    steering: float

    def acting(self, at: float, actuators: Actuators) -> tuple[float, float]:
        """Acceleration and steering rate that act at `at` [s]."""
        seconds = max(at - self.begins, 0.0)
        return (
            actuators.drive.acting(self.acceleration, self.before[0], seconds),
            actuators.steering.acting(self.steering_rate, self.before[1], seconds),
        )

    def queued(self, actuators: Actuators, seconds: float) -> QueuedCommand:
        """What acts on the mean of the first `seconds`."""
        drive, steering = actuators
        return QueuedCommand(
            self.begins,
            drive.mean(self.acceleration, self.before[0], seconds),
            steering.mean(self.steering_rate, self.before[1], seconds),
        )


def waits(actuators: Actuators, cycle: float) -> tuple[int, int]:
    """Cycles that commands of drive and steering wait, so that both act at the same time."""
    (drive, steering), longest = actuators, actuators.dead_time
    return round((longest - drive.dead_time) / cycle), round((longest - steering.dead_time) / cycle)


def going_out(sent: Sequence[Actuation], actuators: Actuators, cycle: float) -> tuple[Actuation, Actuation]:
    """The commands that drive and steering are sent now: the quicker of the two waits for the other one."""
    if actuators.drive.dead_time == actuators.steering.dead_time:
        return sent[-1], sent[-1]
    (drive, steering), oldest = waits(actuators, cycle), len(sent) - 1
    return sent[-1 - min(drive, oldest)], sent[-1 - min(steering, oldest)]


def answered_by(
    sent: Sequence[Actuation], before: Actuators, actuators: Actuators, cycle: float
) -> tuple[Actuation, ...]:
    """The commands `sent`, as actuators answer them that turned out not to be those `before`.

    Where one of them waits longer from now on, its last command goes on; where shorter, commands that still
    wait are dropped.
    """
    old, new = waits(before, cycle), waits(actuators, cycle)
    later = actuators.dead_time - before.dead_time
    found: list[Actuation] = []
    ahead = tuple(now - then for now, then in zip(new, old, strict=True))
    for place in range(min(-max(ahead), 0), len(sent)):
        drive, wheels = (_shifted(sent, place + cycles) for cycles in ahead)
        each = sent[max(place, 0)]
        begins = each.begins + later + min(place, 0) * cycle
        acting = found[-1].acting(begins, actuators) if found else each.before
        both = replace(drive, steering_rate=wheels.steering_rate, steering=wheels.steering)
        found.append(replace(both, begins=begins, before=acting))
    return tuple(found)


def _shifted(sent: Sequence[Actuation], place: int) -> Actuation:
    """The command at a place, that may be before the first one or behind the last one."""
    beyond = place - (len(sent) - 1)
    if beyond <= 0 or len(sent) < 2:
        return sent[min(max(place, 0), len(sent) - 1)]
    last, previous = sent[-1], sent[-2]
    return replace(
        last,
        speed=last.speed + beyond * (last.speed - previous.speed),
        steering=last.steering + beyond * (last.steering - previous.steering),
    )
