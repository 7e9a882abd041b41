"""Does the vehicle stand? Judged by the measured speed, and by the poses of the last moments.

A speed sensor may read zero while the vehicle rolls: the poses then move farther along the body's axis than
the measured speeds explain, and the difference is added to the measured speed. Until there are enough poses,
a speed that has leapt to rest goes on as the commands explain, if the pose does. Noisy poses tell it by their
filter, (W4) of `estimation.odometry`, which knows of no measured speed.

A car stands if it is slower than 0.02 m/s, a small vehicle if it is slower by its size; at the dock it must
come to rest within a third of the tolerance. Whether it stays there: `drive.holding`.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from math import cos, exp, inf, sin, sqrt
from operator import attrgetter
from typing import NamedTuple

import numpy as np

from estimation.odometry import AHEAD, ALONG, AT, BESIDE, POSE_SPEED, VV
from estimation.vehicle_filter import Noise
from rti_mpcc.config import ControllerConfig
from rti_mpcc.config.controller import MOVING_FACTOR
from rti_mpcc.model.layout import PHI, V, X, Y
from rti_mpcc.types import Array
from rti_mpcc.world.monitor import StateMonitor

REST_SHARE = 1.0 / 3.0  # of the tolerance, that a docked vehicle moves at most
DOCK_SHARE = 1.0 - REST_SHARE  # of the tolerance, within which a vehicle is docked
UNKNOWN_LAG = 0.5  # [s] of a drive that nobody has told of
LAG = 0.3  # [s] of a drive, or by which it lags otherwise than was found
WINDOW = 1.0  # [s] over which motion is looked at
SLIP_TIME = 0.5  # [s] over which poses and measured speeds are compared, at most
FEWEST = 4  # moments that tell a speed
NOISE = 3.0  # standard deviations that noise explains
PROOF_TIME = 1.0  # [s] for which a vehicle that moves otherwise than commanded has to stand
LEAST_MOMENTS = 6  # for an acceleration by poses
LEAST_NOISE = 1e-4  # [m], [m/s], standard deviation of poses and speeds without noise
LARGEST_STEP = 1.0  # [s]; after a longer gap the motion is looked at anew
JUMP, UNMEASURED = 0.01, 0.2  # [m], [m/s] that a speed sensor may not show: by more a pose has jumped
_at = attrgetter("at")


@dataclass(frozen=True, slots=True)
class AxisReading:
    """At time `at` [s].

    Attributes:
        driven: distance along the axis by poses [m]; speed: estimated [m/s]; measured: by the sensor [m/s].
        unexplained: the estimated speed less what commands and disturbance make of it [m/s].
        gained, planned: speed [m/s] and distance [m] by the commands alone.
        commanded: acceleration until then [m/s²]; coming: what of it a drive that lags by `LAG` has not made.
    """

    at: float
    driven: float = 0.0
    unexplained: float = 0.0
    speed: float = 0.0
    measured: float = 0.0
    gained: float = 0.0
    planned: float = 0.0
    commanded: float = 0.0
    coming: float = 0.0


class SlowMotion(NamedTuple):
    """What (W4) says of a motion that the speed sensor does not show, among noisy poses.

    Attributes:
        ahead: how far the vehicle is ahead of the estimated pose [m].
        faster, std: by how much it is faster than estimated, and the standard deviation of that [m/s].
        beside: acceleration that acts besides what is known [m/s²].
    """

    ahead: float
    faster: float
    std: float
    beside: float


@dataclass(frozen=True, slots=True, kw_only=True)
class AxisMotion:
    """What poses and speeds say of the motion along the body's axis.

    Attributes:
        moments: of the last `WINDOW`.
        pose: the last one, x [m], y [m], heading [rad].
        noise: of the measurements.
        unseen: speed by poses of a vehicle that is measured to stand [m/s]; 0 if it is slow, or may be noise.
        slow: None where the speed is measured, or the poses are not noisy.
    """

    moments: tuple[AxisReading, ...] = ()
    pose: tuple[float, float, float] = (0.0, 0.0, 0.0)
    noise: Noise = field(default_factory=Noise)
    unseen: float = 0.0
    slow: SlowMotion | None = None

    def noted(self, monitor: StateMonitor, config: ControllerConfig) -> AxisMotion:
        """With the estimate of this cycle; nothing is known of the time before one that is doubted."""
        state, now = monitor.state, monitor.at
        if state is None or monitor.measured is None or monitor.doubt:
            return AxisMotion()
        pose, speed = (float(state[X]), float(state[Y]), float(state[PHI])), float(state[V])
        measured, noise = float(monitor.measured[V]), monitor.noise.stds
        last = self.moments[-1] if self.moments else None
        if last is not None and now == last.at:
            return self
        if last is None or monitor.relocalised or not 0.0 < now - last.at <= LARGEST_STEP:
            first = AxisReading(now, speed=speed, measured=measured)
            return AxisMotion(moments=(first,), pose=pose, noise=noise)
        heading = 0.5 * (pose[2] + self.pose[2])
        step = cos(heading) * (pose[0] - self.pose[0]) + sin(heading) * (pose[1] - self.pose[1])
        seconds = now - last.at
        gained = monitor.commanded * seconds
        moment = AxisReading(
            now,
            driven=last.driven + step,
            unexplained=last.unexplained + speed - last.speed - monitor.acting * seconds,
            speed=speed,
            measured=measured,
            gained=last.gained + gained,
            planned=last.planned + (last.gained + 0.5 * gained) * seconds,
            commanded=monitor.commanded,
            coming=(last.coming + monitor.commanded - last.commanded) * exp(-seconds / LAG),
        )
        motion = AxisMotion(moments=(*self._last(WINDOW - seconds), moment), pose=pose, noise=noise)
        if noise.along > LEAST_NOISE:
            motion = replace(motion, slow=motion._slow(monitor, config))
        found, std = motion.by_poses(config)
        if std == inf and measured == 0.0:  # as in a dead band
            found, std = motion._leapt(self.unseen, monitor.acting)
        unseen = abs(found) > NOISE * std and abs(found) > least_unseen(config)
        return replace(motion, unseen=found) if unseen else motion

    def by_poses(self, config: ControllerConfig) -> tuple[float, float]:
        """What the poses say of the speed beyond what is measured [m/s], and its standard deviation.

        By as few poses as noise allows. 0 and inf if the vehicle is not measured to stand, or if the measured
        speed changes: a sensor in its dead band measures the same again and again.
        """
        if not self.moments or abs(self.moments[-1].measured) > config.moving_speed:
            return 0.0, inf
        rest = self._at_rest(config)
        if len(rest) < FEWEST:
            return 0.0, inf
        if self.slow is not None:
            return self.slow.faster, self.slow.std
        for count in (FEWEST, 2 * FEWEST, len(rest)):
            last = rest[:count]
            found, std = _slope([(m.at, m.driven) for m in last], self.noise.along)
            if NOISE * std <= least_unseen(config):
                break
        return found - sum([m.speed for m in last]) / len(last), std

    def _at_rest(self, config: ControllerConfig) -> list[AxisReading]:
        """The last moments, the latest first, at which the same speed was measured again and again, of a
        vehicle that stands."""
        rest: list[AxisReading] = []
        for moment in reversed(self._last(SLIP_TIME)):
            if abs(moment.measured) > config.moving_speed or moment.measured != self.moments[-1].measured:
                break
            rest.append(moment)
        return rest

    def _slow(self, monitor: StateMonitor, config: ControllerConfig) -> SlowMotion | None:
        """See `slow`."""
        track, measured = monitor.sensors.track, monitor.measured
        if track is None or measured is None:
            return None
        if not monitor.sensors.speed.problem and len(self._at_rest(config)) < FEWEST:
            return None
        x, y, phi = self.pose
        off = cos(phi) * (float(measured[X]) - x) + sin(phi) * (float(measured[Y]) - y)
        ahead, along, speed, beside, variance = track[-1, [AHEAD, ALONG, POSE_SPEED, BESIDE, VV]].tolist()
        return SlowMotion(off + ahead - along, speed - self.moments[-1].speed, sqrt(variance), beside)

    def _leapt(self, unseen: float, acting: float) -> tuple[float, float]:
        """What the last measured speed lacks [m/s], if it has leapt and the pose has not, and its standard
        deviation; else 0 and inf. `unseen`: of the cycle before; `acting`: acceleration [m/s²]."""
        *_, last, now = self.moments
        before, seconds = last.speed + unseen, now.at - last.at
        expected, moved = before + seconds * acting, (now.driven - last.driven) / seconds
        leaps = abs(expected - now.speed) > NOISE * sqrt(2.0) * self.noise.speed
        goes_on = abs(moved - 0.5 * (before + expected)) < abs(moved - 0.5 * (before + now.speed))
        if not (leaps and goes_on):
            return 0.0, inf
        return expected - now.speed, sqrt(2.0) * self.noise.along / seconds

    def speed_beyond_noise(self, seconds: float) -> float:
        """Mean speed by the poses of the last `seconds` [m/s], less what noise explains."""
        speed, std = _slope([(m.at, m.driven) for m in self._last(seconds)], self.noise.along)
        return max(abs(speed) - NOISE * std, 0.0)

    def spread(self, seconds: float = WINDOW) -> float:
        """How far the poses of the last `seconds` are apart [m]."""
        driven = [m.driven for m in self._last(seconds)]
        return max(driven) - min(driven) if driven else 0.0

    def unexplained(self) -> float:
        """By how much the speed has changed lately otherwise than expected [m/s], beyond what noise explains:
        within `SLIP_TIME`, or evenly within `WINDOW`."""
        found = [m.unexplained for m in self._last(SLIP_TIME)]
        at_once = max(found) - min(found) - NOISE * self.noise.speed if found else 0.0
        change, std = _slope([(m.at, m.unexplained) for m in self.moments], self.noise.speed)
        return max(at_once, (abs(change) - NOISE * std) * WINDOW, 0.0)

    def surprise(self) -> float:
        """Unexpected acceleration of the last two cycles [m/s²], beyond what noise explains."""
        if len(self.moments) < 3:
            return 0.0
        first, last = self.moments[-3], self.moments[-1]
        change = abs(last.unexplained - first.unexplained) - NOISE * self.noise.speed
        return max(change, 0.0) / (last.at - first.at)

    def jump(self) -> float:
        """By how much the pose has jumped along the axis in the last cycle [m], as one that is corrected by a
        map does, or 0: no motion that the speeds or noise explain."""
        if len(self.moments) < 2:
            return 0.0
        *_, last, now = self.moments
        seconds = now.at - last.at
        off = now.driven - last.driven - 0.5 * (last.speed + now.speed) * seconds
        most = JUMP + UNMEASURED * seconds + self.noise.along
        return off if abs(off) > most else 0.0

    def still_coming(self) -> float:
        """Acceleration [m/s²] that a drive that lags by `LAG` still has to follow its commands by."""
        return self.moments[-1].coming if self.moments else inf

    def beside(self, lag: float = UNKNOWN_LAG) -> tuple[float, float]:
        """Acceleration that acts beside the commands [m/s²], and its standard deviation.

        By poses or speeds of the last `WINDOW`, whichever are less noisy; inf if too little is known. A speed
        that is measured the same all the time may be that of a sensor in its dead band: then by poses.
        A lag of the drive that is not known, about `lag` [s], is no such acceleration.
        """
        if self.seconds < 0.5 * WINDOW or len(self.moments) < LEAST_MOMENTS:
            return 0.0, inf
        t = np.array([m.at - self.moments[-1].at for m in self.moments])
        known = np.array([(m.driven, m.planned, m.speed, m.gained) for m in self.moments])
        driven, planned, speeds, gained = known.T
        one, rates = np.ones(len(t)), np.gradient(gained, t)
        by_poses = _coefficient(0.5 * t**2, (one, t), gained, driven - planned, self.noise.along, lag)
        if self.unseen != 0.0 or len({m.measured for m in self.moments}) == 1:
            return by_poses
        by_speeds = _coefficient(t, (one,), rates, speeds - gained, self.noise.speed, lag)
        return min(by_poses, by_speeds, key=lambda each: each[1])

    @property
    def seconds(self) -> float:
        """For which the motion is known [s]."""
        return self.moments[-1].at - self.moments[0].at if self.moments else 0.0

    def _last(self, seconds: float) -> tuple[AxisReading, ...]:
        """The moments since the last one that is at least so old: cycles seldom begin right then."""
        begin = self.moments[-1].at - seconds if self.moments else 0.0
        return self.moments[max(bisect_right(self.moments, begin + 1e-9, key=_at) - 1, 0) :]


def drift(track: Array, seconds: float, noise: float) -> tuple[float, float]:
    """Speed by the measured poses of a track in the last `seconds` [m/s], and its standard deviation.

    `noise`: standard deviation of a pose [m].
    """
    lately = track[track[:, AT] >= track[-1, AT] - seconds - 1e-9]
    return _slope(lately[:, [AT, ALONG]].tolist(), noise)


def rest_distance(tolerance: tuple[float, float, float], config: ControllerConfig) -> float:
    """By which a vehicle that is docked within this tolerance moves at most [m]."""
    return REST_SHARE * min(*tolerance[:2], *config.goal_tolerance[:2])


def dock_speed(tolerance: tuple[float, float, float], config: ControllerConfig) -> float:
    """A slower vehicle stands at its dock [m/s]: within `UNKNOWN_LAG` it moves by `rest_distance` at most."""
    return min(config.rest_speed, rest_distance(tolerance, config) / UNKNOWN_LAG)


def update_standing(since: float | None, speeds: tuple[float, ...], now: float, least: float) -> float | None:
    """Since when the vehicle stands [s], or None.

    `since`: of the last cycle; `speeds`: now, when a command of now starts to act, and by the poses [m/s].
    """
    most = least if since is None else MOVING_FACTOR * least
    for speed in speeds:
        if abs(speed) > most:
            return None
    return now if since is None else since


def least_unseen(config: ControllerConfig) -> float:
    """A speed that is not measured matters from here on [m/s]."""
    return 0.5 * dock_speed(config.goal_tolerance, config)


def _slope(points: Sequence[Sequence[float]], noise: float) -> tuple[float, float]:
    """Slope of the line through points (t, value), and its standard deviation; `noise`: that of a value."""
    n = len(points)
    if n < 3:
        return 0.0, 0.0
    t0, y0 = sum([t for t, _ in points]) / n, sum([y for _, y in points]) / n
    square = sum([(t - t0) ** 2 for t, _ in points])
    if square <= 0.0:
        return 0.0, 0.0
    return sum([(t - t0) * (y - y0) for t, y in points]) / square, noise / sqrt(square)


def _coefficient(
    wanted: Array, others: Sequence[Array], by_lag: Array, values: Array, noise: float, lag: float
) -> tuple[float, float]:
    """How much of a course is in `values`, beside `others`, and its standard deviation.

    A drive that lags by about `lag` [s] takes that time of `by_lag` from them.
    """
    columns = np.stack((wanted, *others, by_lag)) / max(noise, LEAST_NOISE)
    precision = columns @ columns.T
    precision[-1, -1] += lag**-2.0
    covariance = np.linalg.inv(precision)
    found = covariance @ columns @ (values / max(noise, LEAST_NOISE))
    return float(found[0]), sqrt(float(covariance[0, 0]))
