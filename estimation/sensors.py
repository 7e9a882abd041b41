"""The sensors of a vehicle, compared with each other: the pose, the speed, the steering, and the commands.

Over windows of `WINDOWS` each of these says how far the vehicle has moved and turned
(`estimation.odometry`). The sensor that disagrees with the other two is left out; docs/faults.md lists what
happens then. A pose in doubt leaves no speed that does not change as commanded. Where pose and steering
sensor agree that the steering stays aside of all that was commanded lately, the steering is at fault.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, inf, sin, sqrt, tan
from statistics import median
from typing import NamedTuple

import numpy as np

from estimation.odometry import (
    ALONG,
    ASIDE,
    AT,
    COMMANDED,
    EXPLAINED,
    PHI,
    POSE_ROUGHNESS,
    POSE_SPEED,
    REPORTED,
    SIGMAS,
    SPEED,
    SPEED_ROUGHNESS,
    STEERED,
    STEERING,
    VV,
    WINDOWS,
    CommandedChange,
    Geometry,
    agreeing,
    before,
    distances_at,
    distances_since,
    latest,
    leap,
    moved_on,
    track_from,
)
from estimation.steering import (
    STEERING_WINDOW,
    drifted,
    left_aside,
    observe_steering,
    steering_words,
    unfollowed_angle,
    unmoved,
)
from estimation.types import Array
from estimation.vehicle_filter import Noise
from geometry.compiled import Array1, Array2, Out2, kernel

_FLOOR, _SHARE = 0.015, 0.05
"""Two distances that differ by so much agree: [m], and share. Wheels are known to some per cent."""
_FIRST_READINGS = 7  # before which noise is not known
_LATEST = 0.4  # [s]; a pose later than that is none
_LATE_STEP = 0.05  # [s]
_LATE_TIME = 0.3  # [s] for which a delay stays the same: of a pose that has stopped it grows
_SHORT = 0.15  # [s], a window in which a pose that has stopped soon stands
_COMPARED, _COMPARED_LATE = np.array(WINDOWS), np.array((_SHORT, *WINDOWS))
_POINT_TURN = 0.02  # [rad]; the pose has to turn by so much to show of which point it is
_POINT_SHARE = 0.15  # of the wheelbase, from which on another point matters
_POINT_SHOWN, _POINT_LEFT = 0.01, 0.2  # [m] aside that are explained by it, share that is not
_PROOF = 1.0
"""A sensor that was left out is used again after it has agreed over this distance [m], the next time over
twice as much."""
_TELLING = 0.05  # [rad]; straight on, a steering sensor proves nothing
_UNFOLLOWED, _UNFOLLOWED_SHARE = 0.15, 0.5
"""A speed that alone is left follows its commands to this [m/s], and share of their change."""


class LeftOut(NamedTuple):
    """Whether a sensor is left out: why, or ""; the distance [m] for which it has agreed since; how often."""

    problem: str = ""
    agreed: float = 0.0
    times: int = 0

    def judged(self, problem: str, distance: float) -> LeftOut:
        """After one more comparison, `distance` [m] further on."""
        if not (problem or self.problem):
            return self
        if problem:
            return LeftOut(problem, 0.0, self.times + (not self.problem))
        agreed = self.agreed + distance
        proven = agreed >= _PROOF * 2.0 ** max(self.times - 1, 0)
        return LeftOut("" if proven else self.problem, agreed, self.times)


class Sensors(NamedTuple):
    """What is known of the sensors.

    Attributes:
        track: see `estimation.odometry`, or None before the first measurement.
        speed, steering: whether they are left out; pose: why it is in doubt, or "".
        elsewhere: it is the pose of another point of the vehicle, and stays so.
        late: delay of the pose [s]; seen_late: one that would explain the pose [s], since late_since [s].
        angle: the steering while its sensor is left out [rad].
        unsteered: why the steering itself is at fault, or "".
        unmoved: what is said of a steering that stays as it is, or "".
        leap: by how much the speed has leapt [m/s] where the pose does not show it yet.
        consistent: pose and speed agree.
        moved: distance driven by sensors that were believed [m], since they were tried anew.
    """

    track: Array | None = None
    speed: LeftOut = LeftOut()
    steering: LeftOut = LeftOut()
    pose: str = ""
    elsewhere: bool = False
    late: float = 0.0
    seen_late: float = -1.0
    late_since: float = 0.0
    angle: float = 0.0
    unsteered: str = ""
    unmoved: str = ""
    leap: float = 0.0
    consistent: bool = True
    moved: float = 0.0

    @property
    def remarks(self) -> tuple[str, ...]:
        """What is said of the sensors."""
        speed, steering, late = self.speed.problem, self.steering.problem or self.unmoved, ""
        if self.leap and not speed:
            speed = f"speed sensor has leapt by {self.leap:+.2f} m/s, the pose has not: it is not used"
        if self.late:
            late = f"the pose is {self.late:.2f} s late: it is driven on by that"
        return tuple(filter(None, (speed, steering, late)))

    def usable(self, measured: Array, wheelbase: float) -> Array:
        """The measurement (6,) without the sensors that are left out."""
        if self.track is None or not (self.speed.problem or self.leap or self.steering.problem or self.late):
            return measured
        usable = measured.copy()
        if self.speed.problem:
            by_commands, by_pose = self.track[-1, [EXPLAINED, POSE_SPEED]].tolist()
            # Where nobody is believed alone, one of the three may be wrong.
            usable[3] = median((by_commands, by_pose, float(measured[3]))) if self.pose else by_pose
        elif self.leap:
            usable[3] = self.track[-1, EXPLAINED]
        if self.steering.problem:
            usable[4] = self.angle
        if self.late:
            at, reported = self.track[-1, [AT, REPORTED]].tolist()
            distance = reported - distances_at(self.track, at - self.late)[0]
            turn = distance * tan(float(usable[4])) / wheelbase
            middle = float(usable[2]) + 0.5 * turn
            usable[0] += distance * cos(middle)
            usable[1] += distance * sin(middle)
            usable[2] += turn
        return usable

    def restarted(self, at: float, measured: Array, believed: Array) -> Sensors:
        """After a pose that jumped: the odometers start again, what was found of the sensors stays."""
        return self._replace(track=track_from(at, measured, believed), leap=0.0)

    def trusted(self, at: float, measured: Array, believed: Array) -> Sensors:
        """The pose and the steering are tried once more."""
        return self.restarted(at, measured, believed)._replace(pose="", unsteered="", moved=0.0)


def compare_sensors(
    known: Sensors, at: float, measured: Array, commanded: CommandedChange, noise: Noise, body: Geometry
) -> Sensors:
    """The sensors after one more measurement (6,) whose pose has not jumped, at `at` [s]."""
    track = known.track
    if track is None or at <= track[-1, AT]:
        return known
    track = moved_on(track, at, measured, commanded, noise, body.wheelbase)
    leapt = 0.0 if known.pose else leap(track, noise.speed)
    if len(track) < _FIRST_READINGS:
        return known._replace(track=track, leap=leapt)
    now = latest(track)
    pose, speed = sqrt(now[POSE_ROUGHNESS]), sqrt(now[SPEED_ROUGHNESS])
    noise = noise._replace(along=max(noise.along, pose), speed=max(noise.speed, speed))
    # Noise of a vehicle at rest is no way that it has driven.
    moves = abs(now[POSE_SPEED]) > 3.0 * sqrt(now[VV])
    distance = abs(now[ALONG] - float(track[-2, ALONG])) if moves else 0.0
    gaps = _gaps(track, _COMPARED, noise, known.late)
    agree = all(gap.agree for gap in gaps)
    if not (known.pose or agree):
        known = _speed_or_pose(known, track, gaps, noise, distance)
    elif not known.pose and known.speed.problem:
        known = known._replace(speed=known.speed.judged("", distance))
    elif not known.pose:
        track = agreeing(track)
    if not known.pose:
        known = _reference_point(known, track, noise, body)
    if known.pose:
        known = known._replace(speed=known.speed.judged(_unfollowed(track), 0.0))
    else:
        known = _steering(known, track, commanded.steering, noise, distance, body)
    moved = known.moved if known.pose or known.unsteered else known.moved + distance
    return known._replace(track=track, leap=leapt, consistent=agree, moved=moved)


# -- speed and pose -----------------------------------------------------------------------------------------


class _Gap(NamedTuple):
    """Distances [m] by pose, speed and commands since a time [s], and by how much two may differ."""

    since: float
    moved: float
    reported: float
    driven: float
    most: float

    @property
    def agree(self) -> bool:
        return abs(self.moved - self.reported) <= self.most


def _gaps(track: Array, windows: Array, noise: Noise, late: float) -> list[_Gap]:
    """Of each of the `windows` [s], with a pose that is `late` [s]."""
    gaps = np.empty((len(windows), len(_Gap._fields)))
    _compare(track, windows, noise.along, noise.speed, late, gaps)
    return [_Gap(*gap) for gap in gaps.tolist()]


@kernel
def _compare(track: Array2, windows: Array1, along: float, speed: float, late: float, gaps: Out2) -> None:
    """Into `gaps` (windows, 5); `along`, `speed`: noise [m], [m/s]."""
    for k in range(len(windows)):
        since, moved, reported, driven, leaps = distances_since(track, windows[k], late)
        length = track[-1, AT] - since
        cycle = length / max(len(track) - 1, 1)
        random = sqrt(2.0) * along + sqrt(length * cycle) * speed
        most = _FLOOR + _SHARE * max(abs(moved), abs(reported)) + SIGMAS * random + leaps
        gaps[k, 0], gaps[k, 1], gaps[k, 2], gaps[k, 3], gaps[k, 4] = since, moved, reported, driven, most


def _speed_or_pose(
    known: Sensors, track: Array, gaps: Sequence[_Gap], noise: Noise, distance: float
) -> Sensors:
    """With the verdict on speed and pose, which disagree in some of the `gaps`."""
    wide, now = next(gap for gap in gaps if not gap.agree), float(track[-1, AT])
    if known.speed.problem or (not known.late and _blames_speed(track, wide)):
        seconds = max(now - wide.since, 1e-3)
        by_pose = wide.moved / seconds
        problem = known.speed.problem or (  # said once, with the first figures
            f"speed sensor says {wide.reported / seconds:.2f} m/s, the pose moves at {by_pose:.2f} m/s: "
            f"speed from the pose is used"
        )
        return known._replace(speed=known.speed.judged(problem, distance))
    late = _delay(track, noise)
    if late is not None:
        steady = abs(late - known.seen_late) < 1.5 * _LATE_STEP
        since = known.late_since if steady else now
        if now - since >= _LATE_TIME:
            return known._replace(late=late, seen_late=late, late_since=since)
        return known._replace(seen_late=known.seen_late if steady else late, late_since=since)
    problem = f"the pose moves {wide.moved:.2f} m where the speed sensor says {wide.reported:.2f} m"
    return known._replace(pose=problem, late=0.0)


def _blames_speed(track: Array, gap: _Gap) -> bool:
    """Whether the pose is right, not the speed."""
    now, then = latest(track), before(track, float(track[-1, AT]) - gap.since)
    if now[SPEED] == 0.0 and now[REPORTED] != then[REPORTED]:
        return True  # the sensor has just fallen into its dead band
    if abs(gap.moved - gap.driven) <= abs(gap.reported - gap.driven):
        return True
    stands, moves = abs(gap.reported) <= gap.most, abs(gap.moved) > gap.most
    return stands and moves and abs(now[ASIDE] - then[ASIDE]) <= 0.2 * abs(gap.moved)


def _delay(track: Array, noise: Noise) -> float | None:
    """The delay of the pose [s] that makes it agree with the speed, or None."""
    best, found = inf, None
    for k in range(round(_LATEST / _LATE_STEP) + 1):
        late = k * _LATE_STEP
        gaps = _gaps(track, _COMPARED_LATE, noise, late)
        off = sum(abs(gap.moved - gap.reported) for gap in gaps)
        if all(gap.agree for gap in gaps) and off < best and gaps[-1].since <= track[-1, AT] - _SHORT:
            best, found = off, late
    return found


def _reference_point(known: Sensors, track: Array, noise: Noise, body: Geometry) -> Sensors:
    """With the pose in doubt where it is that of another point: it moves aside by a times what it turns."""
    ahead, shown, left = _beside_turns(track, _POINT_TURN + SIGMAS * noise.heading)
    seen = abs(ahead) > _POINT_SHARE * body.wheelbase and shown > _POINT_SHOWN + SIGMAS * noise.along
    if not (seen and left < _POINT_LEFT * shown):
        return known
    where = "ahead of" if ahead > 0.0 else "behind"
    problem = f"the pose is that of a point {abs(ahead):.2f} m {where} the middle of the rear axle"
    return known._replace(pose=problem, elsewhere=True)


@kernel
def _beside_turns(track: Array2, least: float) -> tuple[float, float, float]:
    """Metres aside for each radian turned, by least squares over the track, and root mean squares [m] of what
    that explains and of what it leaves; 0 if the headings differ by less than `least` [rad]."""
    phi, aside, n = track[:, PHI], track[:, ASIDE], len(track)
    if phi.max() - phi.min() < least:
        return 0.0, 0.0, 0.0
    turns, asides, both = 0.0, 0.0, 0.0
    for k in range(n):
        turn, off = phi[k] - phi.mean(), aside[k] - aside.mean()
        turns, asides, both = turns + turn * turn / n, asides + off * off / n, both + turn * off / n
    ahead = both / turns
    return ahead, abs(ahead) * sqrt(turns), sqrt(max(asides - ahead * both, 0.0))


def _unfollowed(track: Array) -> str:
    """Why the speed sensor is not to be relied on while the pose is in doubt, or ""."""
    now, then = latest(track), before(track, 0.5)
    commanded, reported = now[COMMANDED] - then[COMMANDED], now[SPEED] - then[SPEED]
    if abs(reported - commanded) <= _UNFOLLOWED + _UNFOLLOWED_SHARE * abs(commanded):
        return ""
    return (
        f"speed sensor changes by {reported:.2f} m/s where {commanded:.2f} m/s was commanded: it is not used"
    )


# -- steering -------------------------------------------------------------------------------------------


def _steering(
    known: Sensors, track: Array, steered: float, noise: Noise, distance: float, body: Geometry
) -> Sensors:
    """With the verdict on the steering, and its angle while its sensor is left out."""
    out, unsteered = known.steering.problem != "", known.unsteered
    problem = left_aside(track, noise, body, out=out)
    gap = 0.0 if problem or out else unfollowed_angle(track, noise, body)
    if gap and abs(drifted(track, STEERING_WINDOW, body.wheelbase)[0]) > 0.5 * abs(gap):
        problem = steering_words(track, WINDOWS[0], body)
    elif gap:
        unsteered = unsteered or f"the steering does not follow its commands: {gap:+.2f} rad off"
    still = "" if unsteered else unmoved(track, noise)
    if not (problem or out):
        if unsteered == known.unsteered and still == known.unmoved:
            return known
        return known._replace(unsteered=unsteered, unmoved=still, moved=0.0 if unsteered else known.moved)
    then = before(track, STEERING_WINDOW)
    angle = known.angle + steered if out else then[STEERING] + float(track[-1, STEERED]) - then[STEERED]
    angle = observe_steering(track, angle, noise, body)
    proof = distance if abs(angle) > _TELLING else 0.0
    # It is said once, with the first figures.
    judged = known.steering.judged(known.steering.problem if problem and out else problem, proof)
    return known._replace(steering=judged, angle=angle, unmoved=still)
