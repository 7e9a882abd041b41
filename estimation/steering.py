"""The steering sensor, compared with the turns of the pose and with the commands."""

from __future__ import annotations

from math import atan, exp, sqrt, tan

from estimation.odometry import (
    ALONG,
    AT,
    DELTA,
    PHI,
    SIGMAS,
    STEERED,
    STEERING,
    TURNED,
    WINDOWS,
    Geometry,
    before,
    index_before,
    latest,
)
from estimation.types import Array
from estimation.vehicle_filter import Noise
from geometry.compiled import Array2, inner, kernel

_TURN_FLOOR, _ANGLE = 0.008, 0.12
"""Two turns that differ by so much agree [rad]; offsets of the steering up to so much [rad] are learnt."""
_STEERING_LAG, STEERING_WINDOW = 0.7, 1.4
"""An angle commanded longer ago than this is reached [s]; compared since this time [s]."""
_STEERING_GAP = 0.15  # [rad] between the steering and all angles commanded in that time
_TURN_LEAST = 0.002  # [rad] by which a turn is off at least
_DRIFT, _DRIFT_WAY = 0.06, 0.08
"""The angle between turns and steering sensor may change by so much [rad] in 1 s; seen over this way [m]."""
_UNMOVED_TIME, _UNMOVED_LEAST, _UNMOVED_MOST = 0.3, 0.03, 0.002
"""A sensor that has changed by no more than the last [rad] for at least this time [s] has stayed as it is.
That is told where at least the second [rad] was commanded since."""
_STEERING_STOP = 0.15  # [rad] from its limit, where a steering may end
_OBSERVED = 0.5  # [s], time constant with which turns of the pose correct the steering
_OBSERVED_STD = 0.05  # [rad]; the noise of a turn that counts half
_LEAST_WAY = 0.015  # [m] on which a turn tells nothing


def left_aside(track: Array, noise: Noise, body: Geometry, *, out: bool) -> str:
    """Why the steering sensor is to be left out, or ""; `out`: it is left out already.

    Either the pose turns otherwise than any offset explains, or what lies between the two has changed.
    """
    seconds = _aside_for(track, SIGMAS * sqrt(2.0) * noise.heading, body.wheelbase, out)
    return steering_words(track, seconds, body) if seconds else ""


@kernel
def _aside_for(track: Array2, noisy: float, wheelbase: float, out: bool) -> float:
    """The window [s] in which the steering sensor disagrees, 0 for none; `noisy`: noise of a turn [rad]."""
    now = track[-1]
    for seconds in WINDOWS:
        then = track[index_before(track, seconds)]
        moved, turned, reported = now[ALONG] - then[ALONG], now[PHI] - then[PHI], now[TURNED] - then[TURNED]
        most = _TURN_FLOOR + noisy + 0.1 * abs(turned) + _ANGLE * abs(moved) / wheelbase
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


def steering_words(track: Array, seconds: float, body: Geometry) -> str:
    """What is said of a steering sensor that disagrees with the pose over a window [s]."""
    now, then = latest(track), before(track, seconds)
    moved, turned, reported = (now[k] - then[k] for k in (ALONG, PHI, TURNED))
    says, seen = (atan(body.wheelbase * each / moved) if moved else 0.0 for each in (reported, turned))
    return (
        f"steering sensor says {says:+.2f} rad, the pose turns as at {seen:+.2f} rad: "
        f"steering from the turns is used"
    )


@kernel
def drifted(track: Array2, seconds: float, wheelbase: float) -> tuple[float, float]:
    """See `_drifted`."""
    return _drifted(track, seconds, wheelbase)


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
    return wheelbase * angle, least


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


def observe_steering(track: Array, angle: float, noise: Noise, body: Geometry) -> float:
    """The steering [rad], from that of its commands, by how the pose turns."""
    now, then = latest(track), before(track, WINDOWS[0])
    moved, turned = now[ALONG] - then[ALONG], now[PHI] - then[PHI]
    if abs(moved) < _LEAST_WAY:
        return angle
    lag = 0.5 * (now[STEERED] - then[STEERED])  # the turn is that of the middle of the window
    std = body.wheelbase * sqrt(2.0) * (noise.heading + 1e-3) / abs(moved)
    cycle = now[AT] - float(track[-2, AT])
    share = (1.0 - exp(-cycle / _OBSERVED)) / (1.0 + (std / _OBSERVED_STD) ** 2)
    return angle + share * (atan(body.wheelbase * turned / moved) + lag - angle)


def unmoved(track: Array, noise: Noise) -> str:
    """What is said of a steering sensor that stays as it is although another angle is commanded, or ""."""
    seconds, commanded = _still(track, _UNMOVED_MOST + SIGMAS * noise.steering)
    if seconds < _UNMOVED_TIME - 1e-9 or abs(commanded) < _UNMOVED_LEAST + SIGMAS * noise.steering:
        return ""
    delta = track[-1, DELTA]
    return (
        f"steering sensor has stayed at {delta:+.2f} rad where a change by {commanded:+.2f} rad was commanded"
    )


@kernel
def _still(track: Array2, most: float) -> tuple[float, float]:
    """Time [s] for which the steering sensor has changed by `most` [rad] at most, and what was commanded
    since [rad]."""
    last = len(track) - 1
    k = last
    while k > 0 and abs(track[k - 1, DELTA] - track[last, DELTA]) <= most:
        k -= 1
    return track[last, AT] - track[k, AT], track[last, STEERED] - track[k, STEERED]


def unfollowed_angle(track: Array, noise: Noise, body: Geometry) -> float:
    """By how much the steering stays aside [rad] of all that was commanded lately; 0 where it does not."""
    # Steered far out it may be at a stop that is nearer than the limit.
    gap: float = _beyond(track, max(body.steering - _STEERING_STOP, 0.0))
    return gap if abs(gap) > _STEERING_GAP + SIGMAS * sqrt(2.0) * noise.steering else 0.0


@kernel
def _beyond(track: Array2, out: float) -> float:
    """By how much the steering is beyond all angles [rad] commanded in the last `_STEERING_LAG`; angles
    beyond `out` [rad] count as that."""
    now, first = track[-1], index_before(track, STEERING_WINDOW)
    since = max(now[AT] - _STEERING_LAG, track[first, AT])
    least, most = now[STEERED], now[STEERED]
    for k in range(len(track)):
        if track[k, AT] >= since:
            least, most = min(least, track[k, STEERED]), max(most, track[k, STEERED])
    aside = track[first, DELTA] - track[first, STEERED]
    least, most = max(min(least + aside, out), -out), max(min(most + aside, out), -out)
    delta = max(min(now[DELTA], out), -out)
    return float(delta - min(max(delta, least), most))
