"""The actuators: what acts when something is commanded, and what has to be commanded for what shall act.

Drive and steering answer a command u after a dead time T by a lag of first order. With the value w that acts
(acceleration or steering rate), w_0 at the begin of a command and h the time that it acts for:

(D2)  w(t) = u + (w_0 - u) exp(-t / tau)
(D3)  u    = w_0 + (w - w_0) / (1 - exp(-h / tau)),   so that w acts after h

Plans are in terms of what acts. The queue (`model.delay`) holds the mean of (D2) over each command's cycle,
so the prediction (D1) needs no more states. Set-points of speed and steering are the integrals of the
commanded rates. A speed control with the lag tau therefore answers them as a drive with that lag answers
accelerations: one model fits both interfaces.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import exp
from typing import NamedTuple, Self

from rti_mpcc.config import ActuatorModel
from rti_mpcc.model.delay import QueuedCommand

MOST_LEAD = 6.0
"""Most by which (D3) raises a step of what shall act. It is reached at a lag of 5.5 cycles; beyond, the whole
lead would make of each noisy plan a jerk of the actuator."""
SHORT = 2.0
"""A lag of so many cycles is not inverted: for a dead time taken for it, that would be a jerk."""


class Actuator(NamedTuple):
    """Dead time [s] and time constant of the lag [s] of drive or steering."""

    dead_time: float = 0.0
    lag: float = 0.0

    def commanded(self, wanted: float, acting: float, seconds: float, most: float) -> float:
        """(D3): the command, `most` at most, by which `wanted` acts after `seconds`, from `acting` on."""
        if self.lag <= SHORT * seconds:
            return wanted
        lead = min(1.0 / (1.0 - exp(-seconds / self.lag)), MOST_LEAD)
        return min(max(acting + lead * (wanted - acting), -most), most)

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
    drive, steering = actuators
    longest = max(drive.dead_time, steering.dead_time)
    return round((longest - drive.dead_time) / cycle), round((longest - steering.dead_time) / cycle)


def going_out(sent: Sequence[Actuation], actuators: Actuators, cycle: float) -> tuple[Actuation, Actuation]:
    """The commands that drive and steering are sent now: the quicker of the two waits for the other one."""
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
        found.append(
            Actuation(
                begins=begins,
                acceleration=drive.acceleration,
                steering_rate=wheels.steering_rate,
                before=acting,
                speed=drive.speed,
                steering=wheels.steering,
            )
        )
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
