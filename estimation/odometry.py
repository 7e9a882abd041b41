"""How far a vehicle has moved by its pose, by its speed and by its commands: one odometer each.

With the heading phi_m half way between two poses, h the time in between, a what was commanded:

(W1)  along += dx cos(phi_m) + dy sin(phi_m),   aside += dy cos(phi_m) - dx sin(phi_m)
(W2)  told += h (v + v_last) / 2
(W3)  c += h a,   driven += h (c + c_last) / 2;   c is the speed as long as pose and speed agree on it
(W4)  z+ = z + h v + h² (a + d) / 2,   v+ = v + h (a + d);   along is measured, d is what acts besides

A difference of two moments says how far the vehicle moved in that time. (W4) is a Kalman filter: the speed of
the pose.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Callable
from dataclasses import dataclass, replace
from math import cos, inf, sin, sqrt, tan
from operator import attrgetter
from typing import NamedTuple

from estimation.types import Array
from geometry import wrap

LENGTH = 2.5  # [s] for which moments are kept
_ACCELERATION, _ACCELERATION_SHARE = 2e-4, 0.01
"""Spectral density of an acceleration that was not commanded [m²/s³], and its share of a² [s]. At rest it is
small: the speed of a pose with a noise of 1 cm at 20 Hz is known to 1 cm/s there."""
_ROUGHNESS_TIME = 1.0  # [s] over which the noise of pose and speed is seen in the track
_ROUGHEST = (0.1, 0.15)  # [m], [m/s]; a larger step counts as one
_LEAST_NOISE = 1e-3  # [m], standard deviation of a pose without noise
_ALIKE = 0.04  # [m/s] by which the speeds of pose and sensor differ where they agree
_BLENDING = 2.0  # [s] in which the speed of the commands becomes the one that pose and sensor agree on
_FAR = 1.0  # [m/s] by which the commands are wrong at most, while pose and speed agree about a distance
_LEAP = 0.2  # [m/s] beyond the commands, by which a speed leaps
_CORRECTION = 0.04  # [m]; larger steps that nothing explains correct the pose
_LED = 1e-9  # [m/s]; smaller differences are rounding
_FIRST_SPEED = 0.3  # [m/s], standard deviation of the first speed


WINDOWS = (0.3, 1.0, 2.0)  # [s]
SIGMAS = 5.0  # standard deviations of the noise that are no disagreement


class Geometry(NamedTuple):
    """Of the vehicle: its wheelbase [m], and the largest angle of its steering [rad]."""

    wheelbase: float
    steering: float


class Noise(NamedTuple):
    """Standard deviations: along [m], heading [rad], speed [m/s], steering [rad]."""

    along: float = 0.0
    heading: float = 0.0
    speed: float = 0.0
    steering: float = 0.0


class Asked(NamedTuple):
    """What the commands change from one measurement to the next: speed [m/s], steering [rad].

    `believed`: the steering at the first of the two [rad]; `acting`: the speed with what acts besides [m/s].
    """

    speed: float
    steering: float
    believed: float
    acting: float


class OdometerReading(NamedTuple):
    """One cycle: what was measured, and the odometers.

    Attributes:
        at: [s]; x, y [m], phi [rad, continuous], v [m/s], delta [rad]: measured.
        along, aside: (W1) [m]; told: (W2) [m]; asked [m/s], driven [m]: (W3), the sum of h a, and of h c.
        explained: c of (W3) [m/s].
        turned: heading by the measured steering on the way that the pose moved [rad].
        steered: sum of the commanded changes of the steering [rad].
        leaps: what (W2) may be off, as the speed leapt somewhere between two moments [m].
        steering: believed then [rad].
    """

    at: float
    x: float
    y: float
    phi: float
    v: float
    delta: float
    along: float = 0.0
    aside: float = 0.0
    told: float = 0.0
    asked: float = 0.0
    driven: float = 0.0
    explained: float = 0.0
    turned: float = 0.0
    steered: float = 0.0
    leaps: float = 0.0
    steering: float = 0.0


class Correction(NamedTuple):
    """A step of the pose [m] that was no motion, and when [s]."""

    step: float = 0.0
    at: float = -inf


_UNCORRECTED = Correction()
_at = attrgetter("at")


@dataclass(frozen=True, slots=True)
class Odometers:
    """The moments of the last `LENGTH`, the oldest first, and the speed of the pose, (W4).

    Attributes:
        moments: at least one.
        z, v: of (W4) [m], [m/s]; p: their covariance zz, zv, vv.
        corrected: the last step of the pose that was no motion.
        roughness: variance of the noise of pose [m²] and speed [m²/s²], as far as steps from one moment to
            the next show it; seen: steps so far.
        off: by how much the last step of the pose differed from the commands [m].
    """

    moments: tuple[OdometerReading, ...]
    z: float = 0.0
    v: float = 0.0
    p: tuple[float, float, float] = (0.0, 0.0, _FIRST_SPEED**2)
    corrected: Correction = _UNCORRECTED
    roughness: tuple[float, float] = (0.0, 0.0)
    off: float = 0.0
    seen: int = 0

    @classmethod
    def start(cls, at: float, measured: Array, speed: float, steering: float) -> Odometers:
        """A track that starts at a measurement (>= 5,) with what is believed of speed and steering."""
        x, y, phi, v, delta = measured[:5].tolist()
        first = OdometerReading(at, x, y, phi, v, delta, explained=speed, steering=steering)
        return cls(moments=(first,), v=speed)

    @property
    def last(self) -> OdometerReading:
        """The present moment."""
        return self.moments[-1]

    def commanded_anew(self, rates: Callable[[float, float], tuple[float, float]]) -> Odometers:
        """With commands that turn out to act at other times.

        `rates`: the mean acceleration [m/s²] and steering rate [rad/s] from one time to another [s].
        """
        first, *later = self.moments
        led = [*map(_is_led, self.moments, later)]
        moments = [first._replace(explained=first.v) if led[:1] == [True] else first]
        for each, agrees in zip(later, led, strict=True):
            last = moments[-1]
            h, (acceleration, steering_rate) = each.at - last.at, rates(last.at, each.at)
            by = _commanded(last, each.at, h * acceleration, h * steering_rate)
            now = each._replace(asked=by.asked, driven=by.driven, explained=by.explained, steered=by.steered)
            moments.append(_agreeing(now, now.v, h, _FAR) if agrees else now)
        return replace(self, moments=tuple(moments))

    def before(self, seconds: float) -> OdometerReading:
        """The newest moment at least so long ago [s], or the oldest."""
        later = bisect_right(self.moments, self.last.at - seconds + 1e-9, key=_at)
        return self.moments[max(later - 1, 0)]

    def leap(self, noise: float) -> float:
        """By how much the measured speed has leapt [m/s] where the pose does not show it, else 0.

        `noise`: standard deviation of the speed [m/s].
        """
        last = self.last
        off = last.v - last.explained
        if abs(off) <= _LEAP + 5.0 * noise or len(self.moments) < 2:
            return 0.0
        before = self.moments[-2]
        moves = (last.along - before.along) / (last.at - before.at)
        return off if abs(moves - last.explained) < abs(moves - last.v) else 0.0

    def recent(self, at: float) -> tuple[OdometerReading, ...]:
        """The moments from a time on [s]."""
        return self.moments[bisect_left(self.moments, at, key=_at) :]

    def since(self, seconds: float, late: float) -> OdometerReading:
        """As `before`, of moments that have one so much earlier [s]; the last one without any."""
        then, known = self.before(seconds), self.moments[0].at + late - 1e-9
        if then.at >= known:
            return then
        return next(iter(self.recent(known)), self.last)

    def ways_at(self, at: float) -> tuple[float, float]:
        """`told` and `driven` at a time [s], at the ends those of the nearest moment."""
        later = self.moments[-1]
        for each in reversed(self.moments):
            if each.at <= at:
                share = min((at - each.at) / (later.at - each.at), 1.0) if later.at > each.at else 0.0
                told = each.told + share * (later.told - each.told)
                return told, each.driven + share * (later.driven - each.driven)
            later = each
        return later.told, later.driven


def moved_on(
    track: Odometers, at: float, measured: Array, asked: Asked, noise: Noise, wheelbase: float
) -> Odometers:
    """The track with one more measurement (>= 5,), of a pose that did not jump. `wheelbase`: [m]."""
    last, (x, y, phi, v, delta) = track.last._replace(steering=asked.believed), measured[:5].tolist()
    h = at - last.at
    by = _commanded(last, at, asked.speed, asked.steering)
    told, driven = 0.5 * h * (v + last.v), by.driven - last.driven
    turn = wrap(phi - last.phi)
    middle = last.phi + 0.5 * turn
    c, s, dx, dy = cos(middle), sin(middle), x - last.x, y - last.y
    step, leap = c * dx + s * dy, v - last.v - asked.speed
    step, corrected = _step(track.corrected, at, step, told, driven, noise.along)
    now = by._replace(
        x=x,
        y=y,
        phi=last.phi + turn,
        v=v,
        delta=delta,
        along=last.along + step,
        aside=last.aside + c * dy - s * dx,
        told=last.told + told,
        turned=last.turned + step * tan(0.5 * (delta + last.delta)) / wheelbase,
        leaps=last.leaps + (0.5 * h * abs(leap) if abs(leap) > _LEAP else 0.0),
    )
    kept = (*track.recent(at - LENGTH)[:-1], last)
    z, speed, p = _filtered(track, now.along, h, asked.acting, max(noise.along, _LEAST_NOISE) ** 2)
    if abs(v - speed) <= _ALIKE + sqrt(p[2]):
        now = _agreeing(now, 0.5 * (v + speed), h, _LEAP)
    off = step - driven
    second, leapt = min(abs(off - track.off), _ROUGHEST[0]), min(abs(leap), _ROUGHEST[1])
    share = max(min(h / _ROUGHNESS_TIME, 1.0), 1.0 / (track.seen + 1))
    pose, told_speed = track.roughness
    rough = (pose + share * (second**2 / 6.0 - pose), told_speed + share * (leapt**2 / 2.0 - told_speed))
    return Odometers(
        moments=(*kept, now),
        z=z,
        v=speed,
        p=p,
        corrected=corrected,
        roughness=rough,
        off=off,
        seen=track.seen + 1,
    )


def _commanded(last: OdometerReading, at: float, speed: float, steering: float) -> OdometerReading:
    """(W3): `last` with what the commands have changed until `at` [s], speed [m/s] and steering [rad]."""
    return last._replace(
        at=at,
        asked=last.asked + speed,
        driven=last.driven + (at - last.at) * (last.explained + 0.5 * speed),
        explained=last.explained + speed,
        steered=last.steered + steering,
    )


def _is_led(before: OdometerReading, now: OdometerReading) -> bool:
    """Whether the speed of (W3) was led to the one that pose and sensor agreed on."""
    return abs((now.explained - before.explained) - (now.asked - before.asked)) > _LED


def agreeing(track: Odometers) -> Odometers:
    """With the speed of (W3) led towards the measured one, which the pose confirms."""
    if len(track.moments) < 2:
        return track
    now = track.last
    led = _agreeing(now, now.v, now.at - track.moments[-2].at, _FAR)
    return replace(track, moments=(*track.moments[:-1], led))


def _agreeing(now: OdometerReading, speed: float, h: float, most: float) -> OdometerReading:
    off = speed - now.explained
    share = 1.0 if abs(off) > most else h / (h + _BLENDING)
    return now._replace(explained=now.explained + share * off)


def _step(
    corrected: Correction, at: float, step: float, told: float, driven: float, noise: float
) -> tuple[float, Correction]:
    """How far the vehicle moved by a step of the pose [m], and what of the pose was corrected.

    A step that neither speed nor commands explain is a correction of the pose, not a motion, unless there was
    one a moment ago. The next one may take it back.
    """
    off = min(step - told, step - driven, key=abs)
    if abs(off) <= _CORRECTION + 5.0 * sqrt(2.0) * noise:
        return step, corrected
    taken_back = abs(corrected.step + off) < 0.5 * abs(off)
    if at - corrected.at <= LENGTH and not taken_back:
        return step, corrected
    return step - off, Correction(0.0 if taken_back else off, at)


def _filtered(
    track: Odometers, along: float, h: float, gained: float, r: float
) -> tuple[float, float, tuple[float, float, float]]:
    """(W4) corrected by `along`."""
    zz, zv, vv = track.p
    q = _ACCELERATION + _ACCELERATION_SHARE * (gained / h) ** 2
    zz, zv, vv = zz + h * (2.0 * zv + h * vv) + q * h**3 / 3.0, zv + h * vv + q * h**2 / 2.0, vv + q * h
    z, v = track.z + h * (track.v + 0.5 * gained), track.v + gained
    off, share = along - z, 1.0 / (zz + r)
    z, v = z + zz * share * off, v + zv * share * off
    return z, v, (zz * r * share, zv * r * share, vv - zv * zv * share)
