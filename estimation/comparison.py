"""What the readings of a track (`estimation.odometry`) say of pose, speed and steering.

Pose and speed are compared over windows; the steering sensor with turns of the pose, and with its commands.
"""

from __future__ import annotations

from math import cos, sqrt, tan
from typing import NamedTuple

import numpy as np

from estimation.odometry import (
    ALONG,
    ASIDE,
    AT,
    DELTA,
    DRIVEN,
    LEAPS,
    PHI,
    POSE_ROUGHNESS,
    POSE_SPEED,
    REPORTED,
    SPEED,
    SPEED_ROUGHNESS,
    STEERED,
    STEERING,
    TURNED,
    VV,
    Geometry,
    confirmed_speed,
    index_before,
    leap,
    ways,
)
from estimation.vehicle_filter import Noise
from geometry.compiled import Array2, Out2, inner, kernel

WINDOWS = (0.3, 1.0, 2.0)  # [s]
SHORT = 0.15  # [s], a window in which a pose that has stopped soon stands
SIGMAS = 5.0  # standard deviations of the noise that are no disagreement
_FLOOR, _SHARE = 0.015, 0.05
"""Two distances that differ by so much agree: [m], and share. Wheels are known to some per cent."""
_POINT_TURN = 0.02  # [rad]; the pose has to turn by so much to show of which point it is
_POINT_SHARE = 0.15  # of the wheelbase, from which on another point matters
_POINT_SHOWN, _POINT_LEFT = 0.01, 0.2  # [m] aside that are explained by it, share that is not
_TURN_FLOOR, _ANGLE = 0.008, 0.12
"""Two turns that differ by so much agree [rad]; offsets of the steering up to so much [rad] are learnt."""
_STEERING_LAG, STEERING_WINDOW = 0.7, 1.4
"""An angle commanded longer ago than this is reached [s]; compared since this time [s]."""
_STEERING_GAP = 0.15  # [rad] between the steering and all angles commanded in that time
_TURN_LEAST = 0.002  # [rad] by which a turn is off at least
_DRIFT, _DRIFT_WAY = 0.06, 0.08
"""The angle between turns and steering sensor may change by so much [rad] in 1 s; seen over this way [m]."""
_UNMOVED_TIME, _UNMOVED_LEAST, _UNMOVED_MOST = 0.3, 0.03, 0.002
"""A sensor that has changed by no more than the last [rad] has stayed as it is. That is told where at least
the second [rad] was commanded, so long ago [s], and so long after its last change: the longest dead time."""
_FARTHEST = 1.3  # [rad] that wheels are turned
_STEERING_STOP = 0.15  # [rad] from its limit, where a steering may end


class Gap(NamedTuple):
    """Distances [m] by pose, speed and commands since a time [s], and by how much two may differ."""

    since: float
    moved: float
    reported: float
    driven: float
    most: float

    @property
    def agree(self) -> bool:
        """Whether pose and speed agree."""
        return abs(self.moved - self.reported) <= self.most


class Comparison(NamedTuple):
    """What the readings of a track say.

    Attributes:
        distance: driven since the reading before [m]; 0 at rest, where noise is no way that was driven.
        leap: by how much the speed has leapt [m/s] where the pose does not show it, or 0.
        agree: pose and speed agree in all `gaps`, the rows (windows, 5) of a `Gap` each.
        confirmed: what the speed of (W3) becomes where they agree [m/s].
        ahead: of the rear axle, the point whose pose is measured [m]; 0 where it is the rear axle itself.
        aside: window in which the steering sensor disagrees with the turns [s], or 0.
        drift: change of the angle between turns and steering sensor in `STEERING_WINDOW` [rad].
        unfollowed: by how much the steering stays aside of all that was commanded lately [rad], or 0.
        unmoved: change that was commanded while the steering sensor stayed as it was [rad], or 0.
    """

    distance: float
    leap: float
    agree: bool
    gaps: Out2
    confirmed: float
    ahead: float
    aside: float
    drift: float
    unfollowed: float
    unmoved: float


@kernel
def compare(track: Array2, noise: Noise, body: Geometry, late: float, out: bool) -> Comparison:
    """Compare at the last of at least two readings.

    `late`: delay of the pose [s]; `out`: the steering sensor is left out already.
    """
    now, wheelbase = track[-1], body.wheelbase
    moves = abs(now[POSE_SPEED]) > 3.0 * sqrt(now[VV])
    distance = abs(now[ALONG] - track[-2, ALONG]) if moves else 0.0
    gaps, agree = _gaps(track, WINDOWS, noise, late), True
    for k in range(len(gaps)):
        agree = agree and abs(gaps[k, 1] - gaps[k, 2]) <= gaps[k, 4]
    return Comparison(
        distance,
        leap(track, noise.speed),
        agree,
        gaps,
        confirmed_speed(track),
        _point_ahead(track, noise, wheelbase),
        _aside_for(track, SIGMAS * sqrt(2.0) * noise.heading, wheelbase, out),
        _drifted(track, STEERING_WINDOW, wheelbase)[0],
        _unfollowed(track, noise.steering, max(body.steering - _STEERING_STOP, 0.0)),
        _unmoved(track, noise.steering, body.steering),
    )


@kernel
def gaps_if_late(track: Array2, noise: Noise, late: float) -> Out2:
    """The gaps (windows, 5) of a pose that is `late` [s], the first one over the `SHORT` window."""
    return _gaps(track, (SHORT, *WINDOWS), noise, late)


@inner
def _gaps(track: Array2, windows: tuple[float, ...], noise: Noise, late: float) -> Out2:
    """Rows (windows, 5) of a `Gap` each. The noise of pose and speed is what the track shows, at least.

    Speed and commands are so much earlier than the pose as that is `late` [s], and the readings must reach
    back so far. A speed may be off by its leaps, and by when it changes from one reading to the next.
    """
    gaps, now, last = np.empty((len(windows), 5)), track[-1], len(track) - 1
    along = max(noise.along, sqrt(now[POSE_ROUGHNESS]))
    speed = max(noise.speed, sqrt(now[SPEED_ROUGHNESS]))
    for i in range(len(windows)):
        k = index_before(track, windows[i])
        while track[k, AT] < track[0, AT] + late - 1e-9 and k < last:
            k += 1
        then = track[k]
        moved, length = now[ALONG] - then[ALONG], now[AT] - then[AT]
        reported, driven = now[REPORTED] - then[REPORTED], now[DRIVEN] - then[DRIVEN]
        if late > 0.0:
            ends, starts = ways(track, now[AT] - late), ways(track, then[AT] - late)
            reported, driven = ends[0] - starts[0], ends[1] - starts[1]
        between = 0.5 * (length / max(last - k, 1)) * abs(now[SPEED] - then[SPEED])
        random = sqrt(2.0) * along + sqrt(length * (length / max(last, 1))) * speed
        most = max(_FLOOR, between) + _SHARE * max(abs(moved), abs(reported)) + SIGMAS * random
        most += now[LEAPS] - then[LEAPS]
        gaps[i, 0], gaps[i, 1], gaps[i, 2], gaps[i, 3], gaps[i, 4] = then[AT], moved, reported, driven, most
    return gaps


@inner
def _point_ahead(track: Array2, noise: Noise, wheelbase: float) -> float:
    """How far ahead of the rear axle [m] the point is whose pose is measured, or 0.

    Such a point moves aside by that distance for each radian turned: least squares over the track. The turn
    is that of speed and steering: a pose that jumps, as one that is corrected by a map, turns nobody.
    """
    turned, aside, n = track[:, TURNED], track[:, ASIDE], len(track)
    if turned.max() - turned.min() < _POINT_TURN + SIGMAS * noise.heading:
        return 0.0
    turns, asides, both = 0.0, 0.0, 0.0
    for k in range(n):
        turn, off = turned[k] - turned.mean(), aside[k] - aside.mean()
        turns, asides, both = turns + turn * turn / n, asides + off * off / n, both + turn * off / n
    ahead = both / turns
    shown, left = abs(ahead) * sqrt(turns), sqrt(max(asides - ahead * both, 0.0))  # root mean squares [m]
    along = max(noise.along, sqrt(track[-1, POSE_ROUGHNESS]))
    seen = abs(ahead) > _POINT_SHARE * wheelbase and shown > _POINT_SHOWN + SIGMAS * along
    return ahead if seen and left < _POINT_LEFT * shown else 0.0


@inner
def _aside_for(track: Array2, noisy: float, wheelbase: float, out: bool) -> float:
    """The window [s] in which the steering sensor disagrees, 0 for none; `noisy`: noise of a turn [rad]."""
    now = track[-1]
    for seconds in WINDOWS:
        then = track[index_before(track, seconds)]
        moved, turned, reported = now[ALONG] - then[ALONG], now[PHI] - then[PHI], now[TURNED] - then[TURNED]
        angle = _ANGLE / _curving(now[DELTA], then[DELTA])
        most = _TURN_FLOOR + noisy + 0.1 * abs(turned) + angle * abs(moved) / wheelbase
        if abs(turned - reported) > most and (out or _explains(track, seconds, turned, reported, wheelbase)):
            return seconds
    changed, moved = _drifted(track, 1.0, wheelbase)
    if moved == 0.0:
        return 0.0
    then = track[index_before(track, 1.0)]
    reported, commanded = now[DELTA] - then[DELTA], now[STEERED] - then[STEERED]
    most = _DRIFT + 0.15 * abs(reported) + 2.0 * wheelbase * (noisy + _TURN_LEAST) / moved
    explained = out or abs(reported + changed - commanded) < abs(reported - commanded)
    return WINDOWS[0] if abs(changed) > most and explained else 0.0


@inner
def _explains(track: Array2, seconds: float, turned: float, reported: float, wheelbase: float) -> bool:
    """Whether the commands of a window [s] explain the turn of the pose [rad] better than that of the
    steering sensor."""
    first, explained = index_before(track, seconds), 0.0
    for k in range(first + 1, len(track)):
        half = 0.5 * (track[k, STEERED] + track[k - 1, STEERED])
        angle = track[first, STEERING] + half - track[first, STEERED]
        explained += (track[k, ALONG] - track[k - 1, ALONG]) * tan(max(min(angle, 1.4), -1.4)) / wheelbase
    return abs(turned - explained) < abs(reported - explained)


@inner
def _drifted(track: Array2, seconds: float, wheelbase: float) -> tuple[float, float]:
    """By how much the angle [rad] between turns and steering sensor has changed in so long [s], and the
    shorter of the two ways [m] that it is known from; 0 where the vehicle has hardly moved."""
    now, then = track[-1], track[index_before(track, seconds)]
    ends = (now, then)
    least, angle = 1e9, 0.0
    for k in range(2):
        end = ends[k]
        start = track[index_before(track, now[AT] - end[AT] + WINDOWS[0])]
        distance = end[ALONG] - start[ALONG]
        least = min(least, abs(distance))
        if least < _DRIFT_WAY:
            return 0.0, 0.0
        aside = (end[PHI] - start[PHI] - end[TURNED] + start[TURNED]) / distance
        angle = aside if k == 0 else angle - aside
    return wheelbase * angle * _curving(now[DELTA], then[DELTA]), least


@inner
def _curving(one: float, other: float) -> float:
    """By how much an angle changes with its tangent, at the larger of two angles of the steering [rad]."""
    return cos(min(max(abs(one), abs(other)), _FARTHEST)) ** 2


@inner
def _unmoved(track: Array2, noise: float, limit: float) -> float:
    """The largest change that was commanded while the steering sensor stayed as it was [rad], or 0.

    `noise`: of the steering sensor [rad]; no change leads beyond the `limit` [rad].
    """
    now, k, most = track[-1], len(track) - 1, _UNMOVED_MOST + SIGMAS * noise
    then, wanted, least = index_before(track, _UNMOVED_TIME), 0.0, _UNMOVED_LEAST + SIGMAS * noise
    while k > 0 and abs(track[k - 1, DELTA] - now[DELTA]) <= most:
        k -= 1
    for j in range(k, then):
        change = track[then, STEERED] - track[j, STEERED]
        if track[j, AT] >= track[k, AT] + _UNMOVED_TIME and abs(change) > abs(wanted):
            wanted = change
    commanded = max(min(now[DELTA] + wanted, limit), -limit) - now[DELTA]
    return commanded if min(abs(wanted), abs(commanded)) >= least else 0.0


@inner
def _unfollowed(track: Array2, noise: float, out: float) -> float:
    """By how much the steering is beyond all angles [rad] commanded in the last `_STEERING_LAG`, or 0.

    `noise`: of the steering sensor [rad]. Angles beyond `out` [rad] count as that: steered far out it may be
    at a stop that is nearer than the limit.
    """
    now, first = track[-1], index_before(track, STEERING_WINDOW)
    since = max(now[AT] - _STEERING_LAG, track[first, AT])
    least, most = now[STEERED], now[STEERED]
    for k in range(len(track)):
        if track[k, AT] >= since:
            least, most = min(least, track[k, STEERED]), max(most, track[k, STEERED])
    aside = track[first, DELTA] - track[first, STEERED]
    least, most = max(min(least + aside, out), -out), max(min(most + aside, out), -out)
    delta = max(min(now[DELTA], out), -out)
    gap = delta - min(max(delta, least), most)
    return gap if abs(gap) > _STEERING_GAP + SIGMAS * sqrt(2.0) * noise else 0.0
