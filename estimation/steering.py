"""The steering sensor, compared with the turns of the pose and with the commands."""

from __future__ import annotations

from math import atan, exp, sqrt, tan

from estimation.odometry import SIGMAS, WINDOWS, Geometry, Noise, OdometerReading, Odometers

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


def left_aside(track: Odometers, noise: Noise, body: Geometry, *, out: bool) -> str:
    """Why the steering sensor is to be left out, or ""; `out`: it is left out already.

    Either the pose turns otherwise than any offset explains, or what lies between the two has changed.
    """
    now, noisy = track.last, SIGMAS * sqrt(2.0) * noise.heading
    for seconds in WINDOWS:
        then = track.before(seconds)
        moved, turned, told = now.along - then.along, now.phi - then.phi, now.turned - then.turned
        most = _TURN_FLOOR + noisy + 0.1 * abs(turned) + _ANGLE * abs(moved) / body.wheelbase
        if abs(turned - told) > most and (out or _explains(track, then, turned, told, body.wheelbase)):
            return steering_words(track, seconds, body)
    changed, moved = drifted(track, 1.0, body)
    then = track.before(1.0)
    told, asked = now.delta - then.delta, now.steered - then.steered
    if not moved:
        return ""
    most = _DRIFT + 0.15 * abs(told) + 2.0 * body.wheelbase * (noisy + _TURN_LEAST) / moved
    explained = out or abs(told + changed - asked) < abs(told - asked)
    return steering_words(track, WINDOWS[0], body) if abs(changed) > most and explained else ""


def steering_words(track: Odometers, seconds: float, body: Geometry) -> str:
    """What is said of a steering sensor that disagrees with the pose over a window [s]."""
    now, then = track.last, track.before(seconds)
    moved, turned, told = now.along - then.along, now.phi - then.phi, now.turned - then.turned
    says, seen = (atan(body.wheelbase * each / moved) if moved else 0.0 for each in (told, turned))
    return (
        f"steering sensor says {says:+.2f} rad, the pose turns as at {seen:+.2f} rad: "
        f"steering from the turns is used"
    )


def drifted(track: Odometers, seconds: float, body: Geometry) -> tuple[float, float]:
    """By how much the angle [rad] between turns and steering sensor has changed, and the shorter of the
    two ways [m] that it is known from; 0 where the vehicle has hardly moved."""
    ends = (track.last, track.before(seconds))
    starts = [track.before(track.last.at - end.at + WINDOWS[0]) for end in ends]
    ways = [end.along - start.along for end, start in zip(ends, starts, strict=True)]
    least = min(map(abs, ways))
    if least < _DRIFT_WAY:
        return 0.0, 0.0
    now, then = (
        (end.phi - start.phi - end.turned + start.turned) / way
        for end, start, way in zip(ends, starts, ways, strict=True)
    )
    return body.wheelbase * (now - then), least


def _explains(track: Odometers, then: OdometerReading, turned: float, told: float, wheelbase: float) -> bool:
    """Whether the commands explain the turn of the pose [rad] better than that of the steering sensor."""
    explained, last = 0.0, then
    for each in track.moments:
        if each.at <= then.at:
            continue
        angle = then.steering + 0.5 * (each.steered + last.steered) - then.steered
        explained += (each.along - last.along) * tan(max(min(angle, 1.4), -1.4)) / wheelbase
        last = each
    return abs(turned - explained) < abs(told - explained)


def observe_steering(track: Odometers, angle: float, noise: Noise, body: Geometry) -> float:
    """The steering [rad], from that of its commands, by how the pose turns."""
    now, then = track.last, track.before(WINDOWS[0])
    moved, turned = now.along - then.along, now.phi - then.phi
    if abs(moved) < _LEAST_WAY:
        return angle
    lag = 0.5 * (now.steered - then.steered)  # the turn is that of the middle of the window
    std = body.wheelbase * sqrt(2.0) * (noise.heading + 1e-3) / abs(moved)
    share = (1.0 - exp(-(now.at - track.moments[-2].at) / _OBSERVED)) / (1.0 + (std / _OBSERVED_STD) ** 2)
    return angle + share * (atan(body.wheelbase * turned / moved) + lag - angle)


def unmoved(track: Odometers, noise: Noise) -> str:
    """What is said of a steering sensor that stays as it is although another angle is commanded, or ""."""
    now = then = track.last
    for each in reversed(track.moments):
        if abs(each.delta - now.delta) > _UNMOVED_MOST + SIGMAS * noise.steering:
            break
        then = each
    asked = now.steered - then.steered
    if now.at - then.at < _UNMOVED_TIME - 1e-9 or abs(asked) < _UNMOVED_LEAST + SIGMAS * noise.steering:
        return ""
    return (
        f"steering sensor has stayed at {now.delta:+.2f} rad where a change by {asked:+.2f} rad was commanded"
    )


def unfollowed_angle(track: Odometers, noise: Noise, body: Geometry) -> float:
    """By how much the steering stays aside [rad] of all that was commanded lately; 0 where it does not."""
    now, then = track.last, track.before(STEERING_WINDOW)
    late = [each.steered for each in track.recent(max(now.at - _STEERING_LAG, then.at))]
    first = then.delta - then.steered
    # Steered far out it may be at a stop that is nearer than the limit.
    out = max(body.steering - _STEERING_STOP, 0.0)
    least, most, delta = (
        max(min(each, out), -out) for each in (min(late) + first, max(late) + first, now.delta)
    )
    gap = delta - min(max(delta, least), most)
    return gap if abs(gap) > _STEERING_GAP + SIGMAS * sqrt(2.0) * noise.steering else 0.0
