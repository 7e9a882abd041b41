"""The sensors of a vehicle, compared with each other: the pose, the speed, the steering, and the commands.

Over windows of `_WINDOWS` each of these says how far the vehicle has moved and turned
(`estimation.odometry`). The sensor that disagrees with the other two is left out. Two sensors that agree
outvote the commands: a vehicle that was stopped is where its sensors say.

- *speed*: it disagrees with the motion of the pose, which the commands explain better. The speed of the pose
  is used until the two have agreed for some distance.
- *pose*: it disagrees with the speed, which the commands explain better. If a delay of the pose explains
  that, the pose is driven on by the delay. Otherwise the pose is in doubt, and so is a speed that then does
  not change as commanded.
- *steering*: it disagrees with how the pose turns, which the commands explain better. The angle then follows
  from the commands and the turns of the pose. Where both sensors agree that the steering stays aside of all
  that was commanded lately, the steering is at fault, not its sensor.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import atan, cos, exp, inf, sin, sqrt, tan
from typing import NamedTuple

import numpy as np

from estimation.odometry import Moment, Track, agreeing, moved_on
from estimation.types import Array

_WINDOWS = (0.3, 1.0, 2.0)  # [s]
_SIGMAS = 5.0  # standard deviations of the noise that are no disagreement
_FLOOR, _SHARE = 0.015, 0.05
"""Two distances that differ by so much agree: [m], and share. Wheels are known to some per cent."""
_TURN_FLOOR, _ANGLE = 0.008, 0.12
"""Two turns that differ by so much agree [rad]; offsets of the steering up to so much [rad] are learnt."""
_FIRST_MOMENTS = 7  # before which noise is not known
_LATEST = 0.4  # [s]; a pose later than that is none
_LATE_STEP = 0.05  # [s]
_LATE_TIME = 0.3  # [s] for which a delay stays the same: of a pose that has stopped it grows
_SHORT = 0.15  # [s], a window in which a pose that has stopped soon stands
_POINT_TURN = 0.05  # [rad]; the pose has to turn by so much to show of which point it is
_POINT_SHARE = 0.15  # of the wheelbase, from which on another point matters
_POINT_SHOWN, _POINT_LEFT = 0.01, 0.2  # [m] aside that are explained by it, share that is not
_PROOF = 1.0
"""A sensor that was left out is used again after it has agreed over this distance [m], the next time over
twice as much."""
_UNFOLLOWED, _UNFOLLOWED_SHARE = 0.15, 0.5
"""A speed that alone is left follows its commands to this [m/s], and share of their change."""
_STEERING_LAG, _STEERING_WINDOW = 0.7, 1.4
"""An angle commanded longer ago than this is reached [s]; compared since this time [s]."""
_STEERING_GAP = 0.15  # [rad] between the steering and all angles commanded in that time
_TURN_LEAST = 0.002  # [rad] by which a turn is off at least
_DRIFT, _DRIFT_WAY = 0.06, 0.08
"""The angle between turns and steering sensor may change by so much [rad] in 1 s; seen over this way [m]."""
_STEERING_STOP = 0.15  # [rad] from its limit, where a steering may end
_OBSERVED = 0.5  # [s], time constant with which turns of the pose correct the steering
_OBSERVED_STD = 0.05  # [rad]; the noise of a turn that counts half


class LeftOut(NamedTuple):
    """Whether a sensor is left out: why, or ""; the distance [m] for which it has agreed since; how often."""

    problem: str = ""
    agreed: float = 0.0
    times: int = 0

    def judged(self, problem: str, way: float) -> LeftOut:
        """After one more comparison, `way` [m] further on."""
        if problem:
            return LeftOut(problem, 0.0, self.times + (not self.problem))
        agreed = self.agreed + way
        proven = agreed >= _PROOF * 2.0 ** max(self.times - 1, 0)
        return LeftOut("" if proven else self.problem, agreed, self.times)


_IN_USE = LeftOut()


@dataclass(frozen=True, slots=True, kw_only=True)
class Sensors:
    """What is known of the sensors.

    Attributes:
        track: the last moments, or None before the first.
        speed, steering: whether they are left out; pose: why it is in doubt, or "".
        elsewhere: it is the pose of another point of the vehicle, and stays so.
        late: delay of the pose [s]; seen_late: one that would explain the pose [s], since late_since [s].
        angle: the steering while its sensor is left out [rad].
        unsteered: why the steering itself is at fault, or "".
        leap: by how much the speed has leapt [m/s] where the pose does not show it yet.
        consistent: pose and speed agree.
        moved: distance driven by sensors that were believed [m], since they were tried anew.
    """

    track: Track | None = None
    speed: LeftOut = _IN_USE
    steering: LeftOut = _IN_USE
    pose: str = ""
    elsewhere: bool = False
    late: float = 0.0
    seen_late: float = -1.0
    late_since: float = 0.0
    angle: float = 0.0
    unsteered: str = ""
    leap: float = 0.0
    consistent: bool = True
    moved: float = 0.0

    @property
    def remarks(self) -> tuple[str, ...]:
        """What is said of the sensors."""
        late = f"the pose is {self.late:.2f} s late: it is driven on by that" if self.late else ""
        leap = f"speed sensor has leapt by {self.leap:+.2f} m/s, the pose has not: it is not used"
        leapt = leap if self.leap and not self.speed.problem else ""
        return tuple(filter(None, (self.speed.problem, leapt, self.steering.problem, late)))

    def usable(self, measured: Array, wheelbase: float) -> Array:
        """The measurement (6,) without the sensors that are left out."""
        if self.track is None or not (self.speed.problem or self.leap or self.steering.problem or self.late):
            return measured
        usable = measured.copy()
        if self.speed.problem:
            # Where nobody tells the speed: what the commands have made of the last one that was believed, or
            # the motion that a pose in doubt shows all the same.
            by_commands, by_pose = self.track.last.explained, self.track.v
            usable[3] = max(by_commands, by_pose, key=abs) if self.pose else by_pose
        elif self.leap:
            usable[3] = self.track.last.explained
        if self.steering.problem:
            usable[4] = self.angle
        if self.late:
            last = self.track.last
            way = last.told - self.track.ways_at(last.at - self.late)[0]
            turn = way * tan(float(usable[4])) / wheelbase
            middle = float(usable[2]) + 0.5 * turn
            usable[0] += way * cos(middle)
            usable[1] += way * sin(middle)
            usable[2] += turn
        return usable

    def restarted(self, at: float, measured: Array, speed: float, steering: float) -> Sensors:
        """After a pose that jumped: the odometers start again, what was found of the sensors stays."""
        return replace(self, track=Track.start(at, measured, speed, steering), leap=0.0)

    def trusted(self, at: float, measured: Array, speed: float, steering: float) -> Sensors:
        """The pose and the steering are tried once more."""
        return replace(self.restarted(at, measured, speed, steering), pose="", unsteered="", moved=0.0)

    def believing(self, steering: float) -> Sensors:
        """With what is believed of the present steering [rad]."""
        return self if self.track is None else replace(self, track=self.track.believing(steering))


class Asked(NamedTuple):
    """What the commands change from one measurement to the next: speed [m/s], steering [rad]."""

    speed: float
    steering: float


class Geometry(NamedTuple):
    """Of the vehicle: its wheelbase [m], and the largest angle of its steering [rad]."""

    wheelbase: float
    steering: float


class Noise(NamedTuple):
    """Standard deviations: along [m], heading [rad], speed [m/s]; pairs of neighbours they are known from."""

    along: float
    heading: float
    speed: float
    steering: float
    pairs: int


def compared(
    known: Sensors, at: float, measured: Array, asked: Asked, noise: Noise, body: Geometry
) -> Sensors:
    """The sensors after one more measurement (6,) whose pose has not jumped, at `at` [s]."""
    track = known.track
    if track is None or at <= track.last.at:
        return known
    before = track.last
    track = moved_on(track, at, measured, *asked, noise.along, body.wheelbase)
    known = replace(known, track=track, leap=0.0 if known.pose else track.leap(noise.speed))
    if len(track.moments) < _FIRST_MOMENTS:
        return known
    pose, speed = (sqrt(each) for each in track.roughness)
    noise = noise._replace(along=max(noise.along, pose), speed=max(noise.speed, speed))
    # Noise of a vehicle at rest is no way that it has driven.
    moves = abs(track.v) > 3.0 * sqrt(track.p[2])
    way = abs(track.last.along - before.along) if moves else 0.0
    if known.pose:
        gaps = [_gap(track, seconds, noise, known.late) for seconds in _WINDOWS]
        known = replace(known, consistent=all(gap.agree for gap in gaps))
    else:
        known = _speed_or_pose(known, track, noise, way)
        known = known if known.pose else _reference_point(known, track, noise, body)
    if known.pose:
        return replace(known, speed=known.speed.judged(_unfollowed(track), 0.0))
    return _steering(known, track, asked.steering, noise, way, body)


# -- speed and pose -----------------------------------------------------------------------------------------


class _Gap(NamedTuple):
    """Distances [m] by pose, speed and commands in a window since `then`, and by how much two may differ."""

    then: Moment
    moved: float
    told: float
    driven: float
    most: float

    @property
    def agree(self) -> bool:
        return abs(self.moved - self.told) <= self.most


def _gap(track: Track, seconds: float, noise: Noise, late: float) -> _Gap:
    now, then = track.last, track.since(seconds, late)
    length = now.at - then.at
    moved = now.along - then.along
    told, driven = now.told - then.told, now.driven - then.driven
    if late:
        ends = zip(track.ways_at(now.at - late), track.ways_at(then.at - late), strict=True)
        told, driven = (end - start for end, start in ends)
    cycle = length / max(len(track.moments) - 1, 1)
    random = sqrt(2.0) * noise.along + sqrt(length * cycle) * noise.speed
    most = _FLOOR + _SHARE * max(abs(moved), abs(told)) + _SIGMAS * random + now.leaps - then.leaps
    return _Gap(then, moved, told, driven, most)


def _speed_or_pose(known: Sensors, track: Track, noise: Noise, way: float) -> Sensors:
    """With the verdict on speed and pose."""
    gaps = [_gap(track, seconds, noise, known.late) for seconds in _WINDOWS]
    wide = next((gap for gap in gaps if not gap.agree), None)
    known = replace(known, consistent=wide is None)
    if wide is None:
        track = track if known.speed.problem else agreeing(track)
        return replace(known, track=track, speed=known.speed.judged("", way))
    if known.speed.problem or (not known.late and _blames_speed(track, wide)):
        seconds = max(track.last.at - wide.then.at, 1e-3)
        by_pose = wide.moved / seconds
        problem = (
            f"speed sensor says {wide.told / seconds:.2f} m/s, the pose moves at {by_pose:.2f} m/s: "
            f"speed from the pose is used"
        )
        if known.speed.problem:
            problem = known.speed.problem  # said once, with the first figures
        return replace(known, speed=known.speed.judged(problem, way))
    late = _delay(track, noise)
    if late is not None:
        steady = abs(late - known.seen_late) < 1.5 * _LATE_STEP
        since = known.late_since if steady else track.last.at
        if track.last.at - since >= _LATE_TIME:
            return replace(known, late=late, seen_late=late, late_since=since)
        return replace(known, seen_late=known.seen_late if steady else late, late_since=since)
    problem = f"the pose moves {wide.moved:.2f} m where the speed sensor says {wide.told:.2f} m"
    return replace(known, pose=problem, late=0.0)


def _blames_speed(track: Track, gap: _Gap) -> bool:
    """Whether the pose is right, not the speed."""
    now, then = track.last, gap.then
    if abs(gap.moved - gap.driven) <= abs(gap.told - gap.driven):
        return True
    stands, moves = abs(gap.told) <= gap.most, abs(gap.moved) > gap.most
    return stands and moves and abs(now.aside - then.aside) <= 0.2 * abs(gap.moved)


def _delay(track: Track, noise: Noise) -> float | None:
    """The delay of the pose [s] that makes it agree with the speed, or None."""
    best, found = inf, None
    for k in range(round(_LATEST / _LATE_STEP) + 1):
        late = k * _LATE_STEP
        gaps = [_gap(track, seconds, noise, late) for seconds in (_SHORT, *_WINDOWS)]
        off = sum(abs(gap.moved - gap.told) for gap in gaps)
        if all(gap.agree for gap in gaps) and off < best and gaps[-1].then.at <= track.last.at - _SHORT:
            best, found = off, late
    return found


def _reference_point(known: Sensors, track: Track, noise: Noise, body: Geometry) -> Sensors:
    """With the pose in doubt where it is that of another point: it moves aside by a times what it turns."""
    first = track.moments[0]
    turned = np.array([each.phi - first.phi for each in track.moments])
    aside = np.array([each.aside - first.aside for each in track.moments])
    if float(np.ptp(turned)) < _POINT_TURN + _SIGMAS * noise.heading:
        return known
    turned, aside = turned - turned.mean(), aside - aside.mean()
    ahead = float(turned @ aside) / float(turned @ turned)
    shown, left = float(np.std(ahead * turned)), float(np.std(aside - ahead * turned))
    seen = abs(ahead) > _POINT_SHARE * body.wheelbase and shown > _POINT_SHOWN + _SIGMAS * noise.along
    if not (seen and left < _POINT_LEFT * shown):
        return known
    where = "ahead of" if ahead > 0.0 else "behind"
    problem = f"the pose is that of a point {abs(ahead):.2f} m {where} the middle of the rear axle"
    return replace(known, pose=problem, elsewhere=True)


def _unfollowed(track: Track) -> str:
    """Why the speed sensor is not to be relied on while the pose is in doubt, or ""."""
    now, then = track.last, track.before(0.5)
    asked, told = now.asked - then.asked, now.v - then.v
    if abs(told - asked) <= _UNFOLLOWED + _UNFOLLOWED_SHARE * abs(asked):
        return ""
    return f"speed sensor changes by {told:.2f} m/s where {asked:.2f} m/s was commanded: it is not used"


# -- steering -------------------------------------------------------------------------------------------


def _steering(
    known: Sensors, track: Track, steered: float, noise: Noise, way: float, body: Geometry
) -> Sensors:
    """With the verdict on the steering, and its angle."""
    now, out = track.last, known.steering.problem != ""
    angle = known.angle + steered if out else now.delta
    problem = _left_aside(track, noise, body, out=out)
    unsteered = known.unsteered
    gap = 0.0 if problem or out else _unfollowed_angle(track, noise, body)
    if gap and abs(_drifted(track, _STEERING_WINDOW, body)[0]) > 0.5 * abs(gap):
        problem = _steering_words(track, _WINDOWS[0], body)
    elif gap:
        unsteered = unsteered or f"the steering does not follow its commands: {gap:+.2f} rad off"
    if problem and not out:
        then = track.before(_STEERING_WINDOW)
        angle = then.steering + now.steered - then.steered
    if problem or out:
        angle = _observed(track, angle, noise, body)
    judged = known.steering.judged(known.steering.problem if problem and out else problem, way)
    moved = 0.0 if unsteered else known.moved + way
    return replace(known, steering=judged, angle=angle, unsteered=unsteered, moved=moved)


def _left_aside(track: Track, noise: Noise, body: Geometry, *, out: bool) -> str:
    """Why the steering sensor is to be left out, or ""; `out`: it is left out already.

    Either the pose turns otherwise than any offset explains, or what lies between the two has changed.
    """
    now, noisy = track.last, _SIGMAS * sqrt(2.0) * noise.heading
    for seconds in _WINDOWS:
        then = track.before(seconds)
        moved, turned, told = now.along - then.along, now.phi - then.phi, now.turned - then.turned
        most = _TURN_FLOOR + noisy + 0.1 * abs(turned) + _ANGLE * abs(moved) / body.wheelbase
        if abs(turned - told) > most and (out or _explains(track, then, turned, told, body.wheelbase)):
            return _steering_words(track, seconds, body)
    changed, moved = _drifted(track, 1.0, body)
    then = track.before(1.0)
    told, asked = now.delta - then.delta, now.steered - then.steered
    if not moved:
        return ""
    most = _DRIFT + 0.15 * abs(told) + 2.0 * body.wheelbase * (noisy + _TURN_LEAST) / moved
    explained = out or abs(told + changed - asked) < abs(told - asked)
    return _steering_words(track, _WINDOWS[0], body) if abs(changed) > most and explained else ""


def _steering_words(track: Track, seconds: float, body: Geometry) -> str:
    """What is said of a steering sensor that disagrees with the pose over a window [s]."""
    now, then = track.last, track.before(seconds)
    moved, turned, told = now.along - then.along, now.phi - then.phi, now.turned - then.turned
    says, seen = (atan(body.wheelbase * each / moved) if moved else 0.0 for each in (told, turned))
    return (
        f"steering sensor says {says:+.2f} rad, the pose turns as at {seen:+.2f} rad: "
        f"steering from the turns is used"
    )


def _drifted(track: Track, seconds: float, body: Geometry) -> tuple[float, float]:
    """By how much the angle [rad] between turns and steering sensor has changed, and the shorter of the
    two ways [m] that it is known from; 0 where the vehicle has hardly moved."""
    ends = (track.last, track.before(seconds))
    starts = [track.before(track.last.at - end.at + _WINDOWS[0]) for end in ends]
    ways = [end.along - start.along for end, start in zip(ends, starts, strict=True)]
    least = min(map(abs, ways))
    if least < _DRIFT_WAY:
        return 0.0, 0.0
    now, then = (
        (end.phi - start.phi - end.turned + start.turned) / way
        for end, start, way in zip(ends, starts, ways, strict=True)
    )
    return body.wheelbase * (now - then), least


def _explains(track: Track, then: Moment, turned: float, told: float, wheelbase: float) -> bool:
    """Whether the commands explain the turn of the pose [rad] better than that of the steering sensor."""
    explained, last = 0.0, then
    for each in track.moments:
        if each.at <= then.at:
            continue
        angle = then.steering + 0.5 * (each.steered + last.steered) - then.steered
        explained += (each.along - last.along) * tan(max(min(angle, 1.4), -1.4)) / wheelbase
        last = each
    return abs(turned - explained) < abs(told - explained)


def _observed(track: Track, angle: float, noise: Noise, body: Geometry) -> float:
    """The steering [rad], from that of its commands, by how the pose turns."""
    now, then = track.last, track.before(_WINDOWS[0])
    moved, turned = now.along - then.along, now.phi - then.phi
    if abs(moved) < _FLOOR:
        return angle
    lag = 0.5 * (now.steered - then.steered)  # the turn is that of the middle of the window
    std = body.wheelbase * sqrt(2.0) * (noise.heading + 1e-3) / abs(moved)
    share = (1.0 - exp(-(now.at - track.moments[-2].at) / _OBSERVED)) / (1.0 + (std / _OBSERVED_STD) ** 2)
    return angle + share * (atan(body.wheelbase * turned / moved) + lag - angle)


def _unfollowed_angle(track: Track, noise: Noise, body: Geometry) -> float:
    """By how much the steering stays aside [rad] of all that was commanded lately; 0 where it does not."""
    now, then = track.last, track.before(_STEERING_WINDOW)
    late = [each.steered for each in track.moments if each.at >= max(now.at - _STEERING_LAG, then.at)]
    first = then.delta - then.steered
    # Steered far out it may be at a stop that is nearer than the limit.
    out = max(body.steering - _STEERING_STOP, 0.0)
    least, most, delta = (
        max(min(each, out), -out) for each in (min(late) + first, max(late) + first, now.delta)
    )
    gap = delta - min(max(delta, least), most)
    return gap if abs(gap) > _STEERING_GAP + _SIGMAS * sqrt(2.0) * noise.steering else 0.0


def noise_of(stds: Array, pairs: int) -> Noise:
    """From the standard deviations (5,) of along, across, heading, speed, steering."""
    along, _, heading, speed, steering = np.asarray(stds).tolist()
    return Noise(along, heading, speed, steering, pairs)
