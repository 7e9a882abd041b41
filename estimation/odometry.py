"""How far a vehicle has moved by its pose, by its speed and by its commands: one odometer each.

With the heading phi_m half way between two poses, h the time in between, a what was commanded:

(W1)  along += dx cos(phi_m) + dy sin(phi_m),   aside += dy cos(phi_m) - dx sin(phi_m)
(W2)  reported += h (v + v_last) / 2
(W3)  c += h a,   driven += h (c + c_last) / 2;   c is the speed as long as pose and speed agree on it
(W4)  z+ = z + h v + h² w / 2,   v+ = v + h w,   w = a + d + b;   along is measured, b walks at random

What acts besides the commands is d as far as it is known, and b beyond that.

A track (n, COLUMNS) holds the readings of the last `LENGTH`, the oldest first. A difference of two readings
says how far the vehicle moved in that time. (W4) is a Kalman filter: the speed of the pose.
"""

from __future__ import annotations

from collections.abc import Callable
from math import ceil, cos, inf, pi, sin, sqrt, tan
from typing import NamedTuple

import numpy as np

from estimation.types import Array
from estimation.vehicle_filter import Noise
from geometry.compiled import Array1, Array2, Out1, Out2, copy_row, copy_rows, inner, kernel

AT, X, Y, PHI, SPEED, DELTA = range(6)
"""Time [s]; measured x, y [m], heading (continuous) [rad], speed [m/s] and steering [rad]."""
ALONG, ASIDE, REPORTED, COMMANDED, DRIVEN, EXPLAINED = range(6, 12)
"""(W1) twice [m]; (W2) [m]; of (W3) the sum of h a [m/s], the distance [m] and c [m/s]."""
TURNED, STEERED, STEERING, LEAPS = range(12, 16)
"""Heading by the measured steering on the way that the pose moved [rad]; sum of the commanded changes of the
steering [rad]; the steering that was believed then [rad]; by how much (W2) may be off, as the speed leapt
somewhere between two readings [m]."""
AHEAD, POSE_SPEED, BESIDE, ZZ, ZV, ZB, VV, VB, BB = range(16, 25)
"""z [m], v [m/s] and b [m/s²] of (W4), and their covariance."""
STEP, STEP_AT, OFF = range(25, 28)
"""The last step of the pose that was no motion [m], its time [s]; by how much the last step of the pose
differed from the commands [m]."""
POSE_ROUGHNESS, SPEED_ROUGHNESS, SEEN = range(28, 31)
"""Variances of the noise of pose [m²] and speed [m²/s²], as far as steps between two readings show it;
number of steps so far."""
COLUMNS = 31

LENGTH = 2.5  # [s] for which readings are kept
_ACCELERATION, _ACCELERATION_SHARE = 2e-4, 0.01
"""Spectral density of an acceleration that was not commanded [m²/s³], and its share of a² [s]. At rest it is
small: the speed of a pose with a noise of 1 cm at 20 Hz is known to 1 cm/s there."""
_BESIDE_WALK = 1e-3  # spectral density of the rate of b [m²/s⁵]
_ROUGHNESS_TIME = 1.0  # [s] over which the noise of pose and speed is seen in the track
_ROUGHEST_POSE, _ROUGHEST_SPEED = 0.1, 0.15  # [m], [m/s]; a larger step counts as one
_LEAST_NOISE = 1e-3  # [m], standard deviation of a pose without noise
_ALIKE = 0.04  # [m/s] by which the speeds of pose and sensor differ where they agree
_BLENDING = 2.0  # [s] in which the speed of the commands becomes the one that pose and sensor agree on
_FAR = 1.0  # [m/s] by which the commands are wrong at most, while pose and speed agree about a distance
_LEAP = 0.2  # [m/s] beyond the commands, by which a speed leaps
_CORRECTION = 0.04  # [m]; larger steps that nothing explains correct the pose
_LED = 1e-9  # [m/s]; smaller differences are rounding
_FIRST_SPEED = 0.3  # [m/s], standard deviation of the first speed


class Geometry(NamedTuple):
    """Of the vehicle: its wheelbase [m], and the largest angle of its steering [rad]."""

    wheelbase: float
    steering: float


class CommandedChange(NamedTuple):
    """What the commands change from one measurement to the next: speed [m/s], steering [rad].

    `estimated`: the steering at the first of the two [rad]; `acting`: the speed with what acts besides [m/s].
    """

    speed: float
    steering: float
    estimated: float
    acting: float


def track_from(at: float, measured: Array, believed: Array) -> Array:
    """A track (1, COLUMNS) from a measurement (>= 5,), and the state (>= 5,) that is believed."""
    track = np.zeros((1, COLUMNS))
    track[0, AT], track[0, X:ALONG] = at, measured[:5]
    track[0, [EXPLAINED, POSE_SPEED]], track[0, STEERING] = believed[3], believed[4]
    track[0, VV], track[0, STEP_AT] = _FIRST_SPEED**2, -inf
    return track


@kernel
def moved_on(
    track: Array2, at: float, measured: Array1, commanded: CommandedChange, noise: Noise, wheelbase: float
) -> Out2:
    """The track with one more measurement (>= 5,), of a pose that did not jump, by (W1) to (W4).

    `wheelbase`: [m].
    """
    gone = 0
    while gone < len(track) - 1 and track[gone, AT] < at - LENGTH:
        gone += 1
    longer = np.empty((len(track) - gone + 1, COLUMNS))
    copy_rows(track[gone:], longer[:-1])
    last, now = longer[-2], longer[-1]
    last[STEERING], now[AT] = commanded.estimated, at
    copy_row(measured, now[X:ALONG])
    h = now[AT] - last[AT]
    turn = now[PHI] - last[PHI]
    turn -= 2.0 * pi * ceil((turn - pi) / (2.0 * pi))
    middle = last[PHI] + 0.5 * turn
    c, s, dx, dy = cos(middle), sin(middle), now[X] - last[X], now[Y] - last[Y]
    now[PHI] = last[PHI] + turn
    _command(last, commanded.speed, commanded.steering, now)
    reported, driven = 0.5 * h * (now[SPEED] + last[SPEED]), now[DRIVEN] - last[DRIVEN]
    leap = now[SPEED] - last[SPEED] - commanded.speed
    step = _step(last, c * dx + s * dy, reported, driven, noise.along, now)
    now[ALONG] = last[ALONG] + step
    now[ASIDE] = last[ASIDE] + c * dy - s * dx
    now[REPORTED] = last[REPORTED] + reported
    now[TURNED] = last[TURNED] + step * tan(0.5 * (now[DELTA] + last[DELTA])) / wheelbase
    now[LEAPS] = last[LEAPS] + (0.5 * h * abs(leap) if abs(leap) > _LEAP else 0.0)
    now[STEERING] = 0.0
    _filter(last, h, commanded.acting, max(noise.along, _LEAST_NOISE) ** 2, now)
    if abs(now[SPEED] - now[POSE_SPEED]) <= _ALIKE + sqrt(now[VV]):
        now[EXPLAINED] = _led(now[EXPLAINED], 0.5 * (now[SPEED] + now[POSE_SPEED]), h, _LEAP)
    now[OFF] = step - driven
    second, leapt = min(abs(now[OFF] - last[OFF]), _ROUGHEST_POSE), min(abs(leap), _ROUGHEST_SPEED)
    share = max(min(h / _ROUGHNESS_TIME, 1.0), 1.0 / (last[SEEN] + 1.0))
    pose, speed = last[POSE_ROUGHNESS], last[SPEED_ROUGHNESS]
    now[POSE_ROUGHNESS] = pose + share * (second**2 / 6.0 - pose)
    now[SPEED_ROUGHNESS] = speed + share * (leapt**2 / 2.0 - speed)
    now[SEEN] = last[SEEN] + 1.0
    return longer


@inner
def _command(last: Array1, gained: float, steered: float, now: Out1) -> None:
    """(W3): what the commands have changed since the `last` reading, speed [m/s] and steering [rad]."""
    now[COMMANDED] = last[COMMANDED] + gained
    now[DRIVEN] = last[DRIVEN] + (now[AT] - last[AT]) * (last[EXPLAINED] + 0.5 * gained)
    now[EXPLAINED] = last[EXPLAINED] + gained
    now[STEERED] = last[STEERED] + steered


@inner
def _led(explained: float, speed: float, h: float, most: float) -> float:
    """The speed of (W3), led towards the one that is agreed on; at once if it is farther off than `most`."""
    off = speed - explained
    return explained + (1.0 if abs(off) > most else h / (h + _BLENDING)) * off


@inner
def _step(last: Array1, step: float, reported: float, driven: float, noise: float, now: Out1) -> float:
    """How far the vehicle moved by a step of the pose [m]; sets what of the pose was corrected.

    A step that neither speed nor commands explain is a correction of the pose, not a motion, unless there was
    one a moment ago. The next one may take it back.
    """
    now[STEP], now[STEP_AT] = last[STEP], last[STEP_AT]
    off = step - reported if abs(step - reported) <= abs(step - driven) else step - driven
    if abs(off) <= _CORRECTION + 5.0 * sqrt(2.0) * noise:
        return step
    taken_back = abs(last[STEP] + off) < 0.5 * abs(off)
    if now[AT] - last[STEP_AT] <= LENGTH and not taken_back:
        return step
    now[STEP], now[STEP_AT] = 0.0 if taken_back else off, now[AT]
    return step - off


@inner
def _filter(last: Array1, h: float, gained: float, r: float, now: Out1) -> None:
    """(W4) corrected by `along`."""
    zz, zv, zb, vv, vb, bb = last[ZZ], last[ZV], last[ZB], last[VV], last[VB], last[BB]
    q = _ACCELERATION + _ACCELERATION_SHARE * (gained / h) ** 2
    # F P F' + Q, from the first row to the last.
    zz += h * (2.0 * zv + h * (vv + zb + h * (vb + 0.25 * h * bb))) + q * h**3 / 3.0
    zv += h * (vv + zb + h * (1.5 * vb + 0.5 * h * bb)) + q * h**2 / 2.0
    zb += h * (vb + 0.5 * h * bb)
    vv += h * (2.0 * vb + h * bb) + q * h
    vb += h * bb
    bb += _BESIDE_WALK * h
    gained += h * last[BESIDE]
    z, v = last[AHEAD] + h * (last[POSE_SPEED] + 0.5 * gained), last[POSE_SPEED] + gained
    off, share = now[ALONG] - z, 1.0 / (zz + r)
    now[AHEAD], now[POSE_SPEED] = z + zz * share * off, v + zv * share * off
    now[BESIDE] = last[BESIDE] + zb * share * off
    now[ZZ], now[ZV], now[ZB] = zz * r * share, zv * r * share, zb * r * share
    now[VV], now[VB], now[BB] = vv - zv * zv * share, vb - zv * zb * share, bb - zb * zb * share


@inner
def index_before(track: Array2, seconds: float) -> int:
    """Of the newest reading at least so long before the last one [s], or of the oldest."""
    k, until = len(track) - 1, track[-1, AT] - seconds + 1e-9
    while k > 0 and track[k, AT] > until:
        k -= 1
    return k


def now_and_before(track: Array, seconds: float) -> tuple[list[float], list[float]]:
    """The last reading (COLUMNS,), and the newest one at least so long before it [s], or the oldest."""
    k = int(track[:, AT].searchsorted(track[-1, AT] - seconds + 1e-9, side="right")) - 1
    return track[-1].tolist(), track[max(k, 0)].tolist()


@inner
def ways(track: Array2, at: float) -> tuple[float, float]:
    """Distances [m] by speed (W2) and commands (W3) at a time [s], at the ends of the nearest reading."""
    later = len(track) - 1
    for k in range(len(track) - 1, -1, -1):
        if track[k, AT] <= at:
            length, share = track[later, AT] - track[k, AT], 0.0
            if length > 0.0:
                share = min((at - track[k, AT]) / length, 1.0)
            reported = track[k, REPORTED] + share * (track[later, REPORTED] - track[k, REPORTED])
            return reported, track[k, DRIVEN] + share * (track[later, DRIVEN] - track[k, DRIVEN])
        later = k
    return track[later, REPORTED], track[later, DRIVEN]


@kernel
def distances_at(track: Array2, at: float) -> tuple[float, float]:
    """See `ways`."""
    return ways(track, at)


@inner
def leap(track: Array2, noise: float) -> float:
    """By how much the measured speed has leapt [m/s] where the pose does not show it, else 0.

    `noise`: standard deviation of the speed [m/s].
    """
    then, now = track[-2], track[-1]
    off = now[SPEED] - now[EXPLAINED]
    moves = (now[ALONG] - then[ALONG]) / (now[AT] - then[AT])
    shown = abs(moves - now[EXPLAINED]) >= abs(moves - now[SPEED])
    leapt = now[LEAPS] > track[0, LEAPS]  # else it differs from the commands little by little, as a lag does
    return off if leapt and not shown and abs(off) > _LEAP + 5.0 * noise else 0.0


@inner
def confirmed_speed(track: Array2) -> float:
    """The speed of (W3) [m/s], led towards the measured one, which the pose confirms."""
    now = track[-1]
    return _led(now[EXPLAINED], now[SPEED], now[AT] - track[-2, AT], _FAR)


def with_commands(track: Array, rates: Callable[[float, float], tuple[float, float]]) -> Array:
    """The track with commands that turn out to act at other times.

    `rates`: the mean acceleration [m/s²] and steering rate [rad/s] from one time to another [s].
    """
    changes = np.diff(track[:, [EXPLAINED, COMMANDED]], axis=0)
    led = abs(changes[:, 0] - changes[:, 1]) > _LED  # to the speed that pose and sensor agreed on
    anew = track.copy()
    if led[:1].any():
        anew[0, EXPLAINED] = anew[0, SPEED]
    for k in range(1, len(anew)):
        h = anew[k, AT] - anew[k - 1, AT]
        acceleration, steering_rate = rates(anew[k - 1, AT], anew[k, AT])
        _recommand(anew[k - 1], h * acceleration, h * steering_rate, led[k - 1], anew[k])
    return anew


@kernel
def _recommand(last: Array1, gained: float, steered: float, agrees: bool, now: Out1) -> None:
    """(W3) once more, led to the measured speed where pose and sensor agreed on it."""
    _command(last, gained, steered, now)
    if agrees:
        now[EXPLAINED] = _led(now[EXPLAINED], now[SPEED], now[AT] - last[AT], _FAR)
