"""The sensors of a vehicle, compared with each other: the pose, the speed, the steering, and the commands.

Over windows each of these says how far the vehicle has moved and turned (`estimation.odometry`,
`estimation.comparison`). The sensor that disagrees with the other two is left out; docs/faults.md lists what
happens then. A pose in doubt leaves no speed that does not change as commanded. Where pose and steering
sensor agree that the steering stays aside of all that was commanded lately, the steering is at fault.
"""

from __future__ import annotations

from math import atan, cos, exp, sin, sqrt, tan
from statistics import median
from typing import NamedTuple

from estimation.comparison import (
    SHORT,
    SIGMAS,
    STEERING_WINDOW,
    WINDOWS,
    Comparison,
    Gap,
    compare,
    gaps_if_late,
)
from estimation.odometry import (
    ALONG,
    ASIDE,
    AT,
    COMMANDED,
    DELTA,
    EXPLAINED,
    PHI,
    POSE_SPEED,
    REPORTED,
    SPEED,
    STEERED,
    STEERING,
    TURNED,
    CommandedChange,
    Geometry,
    distances_at,
    moved_on,
    now_and_before,
    track_from,
)
from estimation.types import Array
from estimation.vehicle_filter import Noise

_FIRST_READINGS = 7  # before which noise is not known
_LATEST = 0.4  # [s]; a pose later than that is none
_LATE_STEP = 0.05  # [s]
_LATE_TIME = 0.3  # [s] for which a delay stays the same: of a pose that has stopped it grows
_PROOF = 1.0
"""A sensor that was left out is used again after it has agreed over this distance [m], the next time over
twice as much."""
_TELLING = 0.05  # [rad]; straight on, a steering sensor proves nothing
_UNFOLLOWED, _UNFOLLOWED_SHARE = 0.15, 0.5
"""A speed that alone is left follows its commands to this [m/s], and share of their change."""
_OBSERVED = 0.5  # [s], time constant with which turns of the pose correct the steering
_OBSERVED_STD = 0.05  # [rad]; the noise of a turn that counts half
_LEAST_WAY = 0.015  # [m] on which a turn tells nothing


class LeftOut(NamedTuple):
    """Whether a sensor is left out: why, or ""; the distance [m] for which it has agreed since; how often."""

    problem: str = ""
    agreed: float = 0.0
    times: int = 0

    def judged(self, problem: str, distance: float) -> LeftOut:
        """After one more comparison, `distance` [m] further on."""
        if problem:
            return LeftOut(problem, 0.0, self.times + (not self.problem))
        if not self.problem:
            return self
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
    """The sensors after one more measurement (6,), later than the last one, whose pose has not jumped.

    `at`: its time [s].
    """
    assert known.track is not None
    track = moved_on(known.track, at, measured, commanded, noise, body.wheelbase)
    found = compare(track, noise, body, known.late, known.steering.problem != "")
    leapt = 0.0 if known.pose else found.leap
    if len(track) < _FIRST_READINGS:
        return known._replace(track=track, leap=leapt)
    if not (known.pose or found.agree):
        known = _speed_or_pose(known, track, found, noise)
    elif not known.pose and known.speed.problem:
        known = known._replace(speed=known.speed.judged("", found.distance))
    elif not known.pose:
        track[-1, EXPLAINED] = found.confirmed
    if found.ahead and not known.pose:
        where = "ahead of" if found.ahead > 0.0 else "behind"
        pose = f"the pose is that of a point {abs(found.ahead):.2f} m {where} the middle of the rear axle"
        known = known._replace(pose=pose, elsewhere=True)
    if known.pose:
        known = known._replace(speed=known.speed.judged(_unfollowed(track), 0.0))
    else:
        known = _steering(known, track, found, commanded.steering, noise, body)
    moved = known.moved if known.pose or known.unsteered else known.moved + found.distance
    return known._replace(track=track, leap=leapt, consistent=found.agree, moved=moved)


# -- speed and pose -----------------------------------------------------------------------------------------


def _speed_or_pose(known: Sensors, track: Array, found: Comparison, noise: Noise) -> Sensors:
    """With the verdict on speed and pose, which disagree in some of the gaps."""
    gaps, now = [Gap(*gap) for gap in found.gaps.tolist()], float(track[-1, AT])
    wide = next(gap for gap in gaps if not gap.agree)
    if known.speed.problem or (not known.late and _blames_speed(track, wide, noise)):
        seconds = max(now - wide.since, 1e-3)
        by_pose = wide.moved / seconds
        problem = known.speed.problem or (  # said once, with the first figures
            f"speed sensor says {wide.reported / seconds:.2f} m/s, the pose moves at {by_pose:.2f} m/s: "
            f"speed from the pose is used"
        )
        return known._replace(speed=known.speed.judged(problem, found.distance))
    late = _delay(track, noise)
    if late is not None:
        steady = abs(late - known.seen_late) < 1.5 * _LATE_STEP
        since = known.late_since if steady else now
        if now - since >= _LATE_TIME:
            return known._replace(late=late, seen_late=late, late_since=since)
        return known._replace(seen_late=known.seen_late if steady else late, late_since=since)
    problem = f"the pose moves {wide.moved:.2f} m where the speed sensor says {wide.reported:.2f} m"
    return known._replace(pose=problem, late=0.0)


def _blames_speed(track: Array, gap: Gap, noise: Noise) -> bool:
    """Whether the pose is right, not the speed."""
    now, then = now_and_before(track, float(track[-1, AT]) - gap.since)
    if now[SPEED] == 0.0 and now[REPORTED] != then[REPORTED]:
        return True  # the sensor has just fallen into its dead band
    if abs(gap.moved - gap.driven) <= abs(gap.reported - gap.driven):
        return True
    stands, moves = abs(gap.reported) <= gap.most, abs(gap.moved) > gap.most
    aside = abs(now[ASIDE] - then[ASIDE]) - SIGMAS * sqrt(2.0) * noise.across
    return stands and moves and aside <= 0.2 * abs(gap.moved)


def _delay(track: Array, noise: Noise) -> float | None:
    """The delay of the pose [s] that makes it agree with the speed, or None."""
    found = {}
    for k in range(round(_LATEST / _LATE_STEP) + 1):
        gaps = [Gap(*gap) for gap in gaps_if_late(track, noise, k * _LATE_STEP).tolist()]
        if all(gap.agree for gap in gaps) and gaps[-1].since <= track[-1, AT] - SHORT:
            found[k * _LATE_STEP] = sum(abs(gap.moved - gap.reported) for gap in gaps)
    return min(found, key=lambda late: found[late], default=None)


def _unfollowed(track: Array) -> str:
    """Why the speed sensor is not to be relied on while the pose is in doubt, or ""."""
    now, then = now_and_before(track, 0.5)
    commanded, reported = now[COMMANDED] - then[COMMANDED], now[SPEED] - then[SPEED]
    if abs(reported - commanded) <= _UNFOLLOWED + _UNFOLLOWED_SHARE * abs(commanded):
        return ""
    return (
        f"speed sensor changes by {reported:.2f} m/s where {commanded:.2f} m/s was commanded: it is not used"
    )


# -- steering -------------------------------------------------------------------------------------------


def _steering(
    known: Sensors, track: Array, found: Comparison, steered: float, noise: Noise, body: Geometry
) -> Sensors:
    """With the verdict on the steering, and its angle while its sensor is left out.

    Its sensor is left out where the pose turns otherwise than any offset explains, or where what lies between
    the two has changed.
    """
    out, unsteered = known.steering.problem != "", known.unsteered
    problem = _steering_words(track, found.aside, body) if found.aside else ""
    gap = 0.0 if problem or out else found.unfollowed
    if gap and abs(found.drift) > 0.5 * abs(gap):
        problem = _steering_words(track, WINDOWS[0], body)
    elif gap:
        unsteered = unsteered or f"the steering does not follow its commands: {gap:+.2f} rad off"
    still = ""
    if found.unmoved and not unsteered:
        stays = f"steering sensor has stayed at {track[-1, DELTA]:+.2f} rad"
        still = f"{stays} where a change by {found.unmoved:+.2f} rad was commanded"
    if not (problem or out):
        if unsteered == known.unsteered and still == known.unmoved:
            return known
        return known._replace(unsteered=unsteered, unmoved=still, moved=0.0 if unsteered else known.moved)
    now, then = now_and_before(track, STEERING_WINDOW)
    angle = known.angle + steered if out else then[STEERING] + now[STEERED] - then[STEERED]
    angle = _observed(track, angle, noise, body)
    proof = found.distance if abs(angle) > _TELLING else 0.0
    # It is said once, with the first figures.
    judged = known.steering.judged(known.steering.problem if problem and out else problem, proof)
    return known._replace(steering=judged, angle=angle, unmoved=still)


def _steering_words(track: Array, seconds: float, body: Geometry) -> str:
    """What is said of a steering sensor that disagrees with the pose over a window [s]."""
    now, then = now_and_before(track, seconds)
    moved, turned, reported = (now[k] - then[k] for k in (ALONG, PHI, TURNED))
    says, seen = (atan(body.wheelbase * each / moved) if moved else 0.0 for each in (reported, turned))
    return (
        f"steering sensor says {says:+.2f} rad, the pose turns as at {seen:+.2f} rad: "
        f"steering from the turns is used"
    )


def _observed(track: Array, angle: float, noise: Noise, body: Geometry) -> float:
    """The steering [rad], from that of its commands, by how the pose turns."""
    now, then = now_and_before(track, WINDOWS[0])
    moved, turned = now[ALONG] - then[ALONG], now[PHI] - then[PHI]
    if abs(moved) < _LEAST_WAY:
        return angle
    lag = 0.5 * (now[STEERED] - then[STEERED])  # the turn is that of the middle of the window
    std = body.wheelbase * sqrt(2.0) * (noise.heading + 1e-3) / abs(moved)
    cycle = now[AT] - float(track[-2, AT])
    share = (1.0 - exp(-cycle / _OBSERVED)) / (1.0 + (std / _OBSERVED_STD) ** 2)
    return angle + share * (atan(body.wheelbase * turned / moved) + lag - angle)
