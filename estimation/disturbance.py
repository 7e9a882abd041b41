"""What acts beside the commands: a disturbance of the acceleration and an offset of the steering.

A Kalman filter on v, d, g, phi, o, c. With a the mean acceleration that the commands asked for over h, vm and
dm the means of the measured speed and steering, L the wheelbase:

(O1)  v+   = v + h (a (1 + g) + d)
(O2)  phi+ = phi + h vm (1 + c) tan(dm + o) / L,   linearised in o and c
(O3)  d, o, g, c walk at random;   v and phi are measured

Speed and steering may change anywhere between two readings: phi+ is known to what half of their change makes.

d [m/s²] is a slope, or whatever else acts along the body's axis (positive to the front, whichever way it
drives); o [rad] the angle by which the wheels stand to the left of what is measured. g and c are shares by
which the drive answers too strongly, and the vehicle turns too tightly (a wrong wheelbase), so that they are
not mistaken for d and o. Who counts on d has to count on g: at rest on a slope only (1 + g) a + d = 0 is
known.

A vehicle that is held at rest (by a brake of its own, say) although it is commanded to drive off tells
nothing about d: for `_HELD_TIME` nothing is learnt from that, nor from the step in which its speed leaves
zero, as at the end of a sensor's dead band. What is learnt of a slope after that is forgotten if the vehicle
starts as it would have before. Nothing is learnt from a speed that changes by more than (O1) and any slope
explain: somebody else brakes the vehicle.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from math import cos, sqrt, tan
from typing import NamedTuple

import numpy as np

from estimation.settings import DisturbanceFilterConfig
from estimation.types import Array
from geometry import lift
from geometry.compiled import Out1, Out2, kernel

V, D, G, PHI, O, C = range(6)  # noqa: E741 - as in the equations
"""Speed [m/s], disturbance of the acceleration [m/s²], share by which the drive answers too strongly, heading
[rad], offset of the steering [rad], share by which the vehicle turns too tightly."""
STATES = 6
STEEPEST = 1.5  # [rad] that the wheels are turned at most

REST = 0.03
"""A vehicle measured slower than this [m/s] may be held at rest."""
NOISE = 3.0
"""What noise may explain, in standard deviations."""
LEAP = 0.05  # [m/s] by which a speed leaves the dead band of its sensor: noise and a late start leap by less
JUMP = 0.08
"""A heading farther off [rad] has jumped: that is no offset of the steering. Noise of 1 deg is no jump."""
_ACCELERATION_WALK = 0.005
"""Random walk of d [m/s²/sqrt(s)]. From rest d is found within a second, as nothing is known of it then; a
slope that starts on the way takes some 3 s. Four times as much follows twice as fast, and then a gain that is
10 to 20 % off passes for a slope that changes with each braking: the last half second before the dock took up
to a second longer."""
_STEERING_WALK = 5e-4
"""Random walk of o [rad/sqrt(s)]. At 1 m/s o follows within some 2 m, and knows 1 mrad."""
_SPEED_WALK, _HEADING_WALK = 0.005, 5e-4
"""What nobody models [m/s/sqrt(s)], [rad/sqrt(s)]: lag of the drive, slip."""
_FIRST_STDS = (0.2, 0.1, 0.03, 0.03)
"""Standard deviations of d [m/s²], g, o [rad], c before the first measurement: 2 % of slope, 10 % of the
drive, 1.7 deg, 3 % of the curvature. A larger slope is found after some tenths of a second all the same; the
more, the more the first cycles of a noisy speed make of it."""
_MOST = (3.0, 0.3, 0.1, 0.2)
"""Largest |d| [m/s²] (a slope of 30 %), |g|, |o| [rad] (6 deg) and |c|."""
_HELD_TIME = 1.0
"""So long a vehicle may stand although it is commanded to drive off before that counts as a slope [s]: as a
parking brake takes to open."""
_GAP = 1.0  # after so long without a measurement [s] nothing is learnt of the time in between
DRIVES_OFF = 0.05
"""What has to be commanded beyond the disturbance [m/s²] for a vehicle at rest to be held."""
SLOWER = 1e-3  # [m/s] by which a held vehicle is slower than predicted, at least: rounding does not decide


class Motion(NamedTuple):
    """What is measured at a time: speed v [m/s], heading phi [rad] on any branch, steering delta [rad]."""

    v: float
    phi: float
    delta: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DisturbanceEstimate:
    """What the filter knows.

    Attributes:
        mean: (6,) v [m/s], d [m/s²], g, phi [rad], o [rad], c; covariance: (6, 6). Read-only.
        at: when [s]; None before the first measurement, and after one that is not believed.
        motion: measured last, or None.
        held_since: since when the vehicle is at rest although it should drive off [s], or None.
        free: what was known before that, or None.
        unmoved: what was known when the measurement changed last, or None if it has just changed.
        acceleration: d [m/s²]; steering: o [rad]; gain: 1 + g; turn: 1 + c, all by `mean`.
        stds: standard deviations of d [m/s²] and o [rad].
    """

    mean: Array
    covariance: Array
    at: float | None = None
    motion: Motion | None = None
    held_since: float | None = None
    free: DisturbanceEstimate | None = None
    unmoved: DisturbanceEstimate | None = None
    acceleration: float = field(init=False)
    steering: float = field(init=False)
    gain: float = field(init=False)
    turn: float = field(init=False)
    stds: tuple[float, float] = field(init=False)

    def __post_init__(self) -> None:
        self.mean.setflags(write=False)
        self.covariance.setflags(write=False)
        _, d, g, _, o, c = self.mean.tolist()
        stds = float(self.covariance[D, D]) ** 0.5, float(self.covariance[O, O]) ** 0.5
        found = {"acceleration": d, "steering": o, "gain": 1.0 + g, "turn": 1.0 + c, "stds": stds}
        for name, value in found.items():
            object.__setattr__(self, name, value)


def first_estimate(config: DisturbanceFilterConfig) -> DisturbanceEstimate:
    """What is known before the first measurement."""
    d, g, o, c = _FIRST_STDS
    stds = np.array((config.speed_std, d, g, config.heading_std, o, c))
    return DisturbanceEstimate(mean=np.zeros(STATES), covariance=np.diag(stds**2))


def unseated(estimate: DisturbanceEstimate) -> DisturbanceEstimate:
    """After a measurement that is not believed: nothing is learnt until the second one that is.

    What was learnt while the measurement stayed the same is forgotten: its sensors may have stood, not the
    vehicle.
    """
    known = estimate.unmoved or estimate
    return known if known.at is None else replace(known, at=None, held_since=None, free=None)


def updated(
    estimate: DisturbanceEstimate,
    motion: Motion,
    now: float,
    acceleration: float,
    wheelbase: float,
    config: DisturbanceFilterConfig,
    *,
    turns: bool = True,
) -> DisturbanceEstimate:
    """The estimate after one more measurement, at `now` [s].

    Args:
        acceleration: mean of what the commands asked for since the last measurement [m/s²].
        wheelbase: L [m].
        turns: whether the speed is measured, so that turns tell of the steering.
    """
    last = estimate.motion
    if estimate.at is None or last is None or not 0.0 <= now - estimate.at <= _GAP:
        return _seated(estimate, motion, now, config)
    seconds = now - estimate.at
    if seconds == 0.0 or (motion == last and abs(motion.v) > REST):
        return estimate  # told once more: the next one tells of the time since then
    change = motion.v - last.v
    off = abs(change - seconds * (acceleration * estimate.gain + estimate.acceleration))
    if off > seconds * _MOST[0] + NOISE * sqrt(2.0) * config.speed_std:
        return _seated(estimate, motion, now, config)  # somebody else brakes it
    mean, covariance = estimate.mean.copy(), estimate.covariance.copy()
    steering = 0.5 * (last.delta + motion.delta)
    distance = 0.5 * seconds * (last.v + motion.v)
    _predict(mean, covariance, steering, seconds, acceleration, distance / wheelbase)
    # By set-points the means are off on the same side in each cycle.
    by_speed = abs(seconds * change * tan(steering))
    by_steering = abs(distance * (motion.delta - last.delta)) / cos(steering) ** 2
    covariance[PHI, PHI] += (0.5 * (by_speed + by_steering) / wheelbase) ** 2
    held = _is_held(mean, motion, acceleration)
    since, free = estimate.held_since, estimate.free
    if since is not None and free is not None and not held:
        if off > LEAP:
            return _seated(estimate, motion, now, config)
        before = abs(change - seconds * (acceleration * free.gain + free.acceleration))
        if now - since >= _HELD_TIME and before < off:
            return _seated(free, motion, now, config)  # it was no slope that held it
    if held and since is None:
        since, free = now, estimate
    elif not held:
        since, free = None, None
    if since is not None and now - since < _HELD_TIME:
        # With the speed as it is measured, whatever the offsets would make of it.
        _measured(mean, covariance, V, motion.v, config.speed_std)
    phi = lift(motion.phi, float(mean[PHI]))
    if abs(phi - mean[PHI]) > JUMP:
        return _seated(estimate, motion, now, config)
    if not turns:
        _measured(mean, covariance, PHI, phi, config.heading_std)
    _correct(mean, covariance, motion.v, phi, config.speed_std, config.heading_std)
    unmoved = (estimate.unmoved or estimate) if motion == last else None
    return DisturbanceEstimate(
        mean=mean, covariance=covariance, at=now, motion=motion, held_since=since, free=free, unmoved=unmoved
    )


def _seated(
    estimate: DisturbanceEstimate, motion: Motion, now: float, config: DisturbanceFilterConfig
) -> DisturbanceEstimate:
    """Begin again at a measurement: of what was known before the offsets stay."""
    mean, covariance = estimate.mean.copy(), estimate.covariance.copy()
    _measured(mean, covariance, V, motion.v, config.speed_std)
    _measured(mean, covariance, PHI, motion.phi, config.heading_std)
    return DisturbanceEstimate(mean=mean, covariance=covariance, at=now, motion=motion)


def _measured(mean: Array, covariance: Array, quantity: int, value: float, std: float) -> None:
    """Of this quantity only what is measured is known from here on."""
    mean[quantity] = value
    covariance[quantity, :] = covariance[:, quantity] = 0.0
    covariance[quantity, quantity] = std**2


@kernel
def _predict(
    mean: Out1, covariance: Out2, steering: float, seconds: float, acceleration: float, wheelbases: float
) -> None:
    """(O1) to (O3), F P F' + Q, over a distance in wheelbases; of no offset is less known than in the
    beginning."""
    gained = seconds * (acceleration * (1.0 + mean[G]) + mean[D])
    angle = min(max(steering + mean[O], -STEEPEST), STEEPEST)
    carried, half = np.eye(STATES), np.zeros((STATES, STATES))
    carried[V, D], carried[V, G] = seconds, seconds * acceleration
    carried[PHI, O] = wheelbases * (1.0 + mean[C]) / cos(angle) ** 2
    carried[PHI, C] = wheelbases * tan(angle)
    mean[V] += gained
    mean[PHI] += wheelbases * (1.0 + mean[C]) * tan(angle)
    for i in range(STATES):
        for j in range(STATES):
            for k in range(STATES):
                half[i, j] += carried[i, k] * covariance[k, j]
    for i in range(STATES):
        for j in range(STATES):
            covariance[i, j] = 0.0
            for k in range(STATES):
                covariance[i, j] += half[i, k] * carried[j, k]
    d = _ACCELERATION_WALK**2
    covariance[V, V] += d * seconds**3 / 3.0 + _SPEED_WALK**2 * seconds
    covariance[V, D] += d * seconds**2 / 2.0
    covariance[D, V] += d * seconds**2 / 2.0
    covariance[D, D] += d * seconds
    covariance[PHI, PHI] += _HEADING_WALK**2 * seconds
    covariance[O, O] += _STEERING_WALK**2 * seconds
    for i, most in ((D, _FIRST_STDS[0]), (G, _FIRST_STDS[1]), (O, _FIRST_STDS[2]), (C, _FIRST_STDS[3])):
        if covariance[i, i] > most**2:
            share = most / sqrt(covariance[i, i])
            for j in range(STATES):
                covariance[i, j] *= share
                covariance[j, i] *= share


def _is_held(mean: Array, motion: Motion, acceleration: float) -> bool:
    """Whether the vehicle rests although it was commanded to drive off, from the predicted `mean` (6,)."""
    driven = acceleration * (1.0 + mean[G]) + mean[D]
    away = abs(mean[V]) > abs(motion.v) + SLOWER and driven * mean[V] > 0.0
    return bool(abs(motion.v) <= REST and abs(driven) >= DRIVES_OFF and away)


@kernel
def _correct(
    mean: Out1, covariance: Out2, v: float, phi: float, speed_std: float, heading_std: float
) -> None:
    """Kalman's update by v and phi, one after the other as their noises are independent."""
    gain, row = np.empty(STATES), np.empty(STATES)
    for i, value, std in ((V, v, speed_std), (PHI, phi, heading_std)):
        for j in range(STATES):
            row[j] = covariance[i, j]
            gain[j] = covariance[j, i] / (covariance[i, i] + std**2)
        innovation = value - mean[i]
        for j in range(STATES):
            mean[j] += gain[j] * innovation
        for j in range(STATES):
            for k in range(STATES):
                covariance[j, k] -= gain[j] * row[k]
    for i, most in ((D, _MOST[0]), (G, _MOST[1]), (O, _MOST[2]), (C, _MOST[3])):
        bounded = min(max(mean[i], -most), most)
        if bounded != mean[i]:  # what is beyond its bound tells nothing of the others
            mean[i] = bounded
            for j in range(STATES):
                if j != i:
                    covariance[i, j] = covariance[j, i] = 0.0
    for j in range(STATES):
        for k in range(j):
            covariance[j, k] = covariance[k, j] = 0.5 * (covariance[j, k] + covariance[k, j])
