"""A track: where a run of detections that agree with each other says that the goal is.

Each track is estimated twice by Kalman filters. The steady one takes the goal for a pose that stands, up to
a slow drift. The agile one has the pose and its rates, and so a memory of about a second. Equations in
docs/method.md.

(E3)  covariance += drift² dt;  agile: the rates walk too, and carry the pose along
(E4)  NIS = y' S^-1 y <= chi-square quantile of 3 (`gate`),   y = z - H x,  S = H P H' + R
(E5)  the goal does not stand where the steady estimate s says, if for the agile one a
      e' (P_a - P_s)^-1 e > chi-square quantile of 6 (`_MOVED`),   e = (a_pose - s, a_rates)

(E5) is Hausman's test: while the goal stands, s is efficient, so the covariance of e is the difference.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.special import chdtri

from estimation.measurement import Detection
from estimation.settings import GoalFilterConfig
from estimation.types import Array
from geometry import Pose2, lift

KEPT = 5.0
"""Detections farther apart than this [s] say nothing about rates, and belong to no rival track."""
_MOVED = 0.99
"""Probability with which a goal that stands does not count as moved, for (E5). The agile estimate allows for
rates that such a goal has not, so in truth it counts far more seldom: 0 times in 3000 detections."""
_MOVING, _SURELY_MOVING = 0.99, 0.9999  # the same of rates that are taken for a motion: in time, at once
_RESTS = 0.95  # probability with which the rates of a goal that stands again are this small
_MOVING_FOR = 1.0
"""A goal moves if it has been seen to for this time [s]: a goal that was shifted seems to for a moment."""
_LEAST_SPEED, _LEAST_TURN_RATE = 0.02, 0.01  # of a goal that moves [m/s], [rad/s]
_VELOCITY_DRIFT, _TURN_RATE_DRIFT = 0.02, 0.01  # of the rates [m/s/sqrt(s)], [rad/s/sqrt(s)]
_FIRST_RATES = np.square([0.2, 0.2, 0.05])  # variances when a goal is first seen, of [m/s], [rad/s]


class Gaussian(NamedTuple):
    """Mean (n,) and covariance (n, n) of x, y [m], heading [rad], and with n = 6 of their rates."""

    mean: Array
    covariance: Array

    @property
    def pose(self) -> Gaussian:
        """Without the rates."""
        return Gaussian(self.mean[:3].copy(), self.covariance[:3, :3].copy())

    @property
    def rates(self) -> Gaussian:
        """The rates alone."""
        return Gaussian(self.mean[3:], self.covariance[3:, 3:])

    def with_rates(self) -> Gaussian:
        """This pose with rates that are not known yet."""
        none = np.zeros((3, 3))
        covariance = np.block([[self.covariance, none], [none, np.diag(_FIRST_RATES)]])
        return Gaussian(np.concatenate([self.mean, np.zeros(3)]), covariance)

    def near(self, heading: float) -> Gaussian:
        """The same on the branch of a heading [rad]."""
        mean = self.mean.copy()
        mean[2] = lift(float(mean[2]), heading)
        return Gaussian(mean, self.covariance)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Track:
    """What detections that agree with each other say, as a value.

    Attributes:
        time: of the estimates [s]; first, seen_at: stamps of its first and last detection [s].
        agile: the estimate with rates; steady: the one of a pose that stands, None for a goal that moves.
        count: number of its detections; others: of those since the first that were not its own.
        barred: its detections contradict the prior, it cannot be the goal.
        moving_since: since when it moves [s], or None.
    """

    time: float
    first: float
    seen_at: float
    agile: Gaussian
    steady: Gaussian | None
    count: int = 1
    others: int = 0
    barred: bool = False
    moving_since: float | None = None

    @property
    def lasted(self) -> float:
        """Time from its first detection to its last one [s]."""
        return self.seen_at - self.first

    @property
    def moves(self) -> bool:
        """Whether its goal moves."""
        return self.moving_since is not None and self.seen_at - self.moving_since >= _MOVING_FOR

    @property
    def estimate(self) -> Gaussian:
        """The steady one where there is one."""
        return self.agile if self.steady is None else self.steady

    @property
    def pose(self) -> Pose2:
        """The goal."""
        return Pose2(*self.estimate.mean[:3].tolist())

    def shifted(self, seconds: float) -> Track:
        """The same track on a clock that was set by `seconds`."""
        since = None if self.moving_since is None else self.moving_since + seconds
        time, first, seen_at = self.time + seconds, self.first + seconds, self.seen_at + seconds
        return replace(self, time=time, first=first, seen_at=seen_at, moving_since=since)


class TrackFilter:
    """The two Kalman filters of a track."""

    def __init__(self, config: GoalFilterConfig) -> None:
        # Not at the top: filterpy loads 350 modules, scipy.stats above all, which `import estimation` spares.
        from filterpy.kalman import predict, update

        self._config, self._predict, self._update = config, predict, update
        self.confirmations = config.confirmations
        self.gate = float(chdtri(3, 1.0 - config.gate))
        self._moved = float(chdtri(6, 1.0 - _MOVED))
        self._rests, self._moving, self._surely_moving = (
            float(chdtri(3, 1.0 - share)) for share in (_RESTS, _MOVING, _SURELY_MOVING)
        )

    def born(self, detection: Detection, *, barred: bool = False) -> Track:
        """The track of one detection."""
        seen, stamp = Gaussian(detection.value, detection.covariance), detection.stamp
        steady = None if self._config.moving else seen
        return Track(
            time=stamp, first=stamp, seen_at=stamp, agile=seen.with_rates(), steady=steady, barred=barred
        )

    def predicted(self, track: Track, time: float) -> Track:
        """The track at `time` [s], which is not before its own."""
        seconds = max(time - track.time, 0.0)
        steady = None if track.steady is None else self._carried(track.steady, seconds)
        if steady is not None and time - track.seen_at > KEPT:
            return replace(track, time=time, agile=steady.with_rates(), steady=steady, moving_since=None)
        return replace(track, time=time, agile=self._carried(track.agile, seconds), steady=steady)

    def joined(self, track: Track, detection: Detection) -> tuple[Track, bool]:
        """The track, predicted to a detection that fits it, with this; whether it stands elsewhere now."""
        agile, steady = track.agile, track.steady
        if innovation_of(agile, detection)[1] <= self.gate:
            agile = self._corrected(agile, detection)
        else:  # it fits the steady estimate alone
            agile = self.born(detection).agile.near(float(agile.mean[2]))
        if steady is not None:
            steady = self._corrected(steady, detection)
        track = replace(track, seen_at=detection.stamp, agile=agile, steady=steady, count=track.count + 1)
        return self._restarted(replace(track, moving_since=self._moving_since(track)))

    def taken_over(self, track: Track, known: Track | None) -> Track:
        """A rival that is taken for the goal from now on, its headings on the branch of the known one.

        It has seen the goal since this moved, not a shift: rates that are significant are a motion at once.
        """
        agile, steady, since = track.agile, track.steady, track.moving_since
        if known is not None:
            heading = float(known.estimate.mean[2])
            agile, steady = agile.near(heading), None if steady is None else steady.near(heading)
        if since is not None and _square(*track.agile.rates) > self._surely_moving:
            since, steady = min(since, track.seen_at - _MOVING_FOR), None
        return replace(track, agile=agile, steady=steady, moving_since=since)

    def _restarted(self, track: Track) -> tuple[Track, bool]:
        """With another steady estimate, or none, if the goal does not stand where that is."""
        if self._config.moving or (track.steady is None and track.moving_since is not None):
            return track, False
        if track.steady is not None and _contradiction(track.agile, track.steady) <= self._moved:
            return track, False
        moves = track.steady is not None and track.moves
        return replace(track, steady=None if moves else track.agile.pose), True

    def _moving_since(self, track: Track) -> float | None:
        """Since when the goal moves [s], or None: its rates are significant."""
        rates, started = track.agile.rates, track.moving_since
        x, y, turn = rates.mean.tolist()
        if np.hypot(x, y) <= _LEAST_SPEED and abs(turn) <= _LEAST_TURN_RATE:
            return None
        if _square(*rates) <= (self._moving if started is None else self._rests):
            return None
        return track.seen_at if started is None else started

    def _carried(self, estimate: Gaussian, seconds: float) -> Gaussian:
        """An estimate some seconds later, Eq. (E3)."""
        size, drift = len(estimate.mean), self._config.drift(seconds)
        if size == 6:
            rates = np.diag(np.square([_VELOCITY_DRIFT, _VELOCITY_DRIFT, _TURN_RATE_DRIFT]))
            both = rates * seconds**2 / 2.0
            drift = np.block([[drift + rates * seconds**3 / 3.0, both], [both, rates * seconds]])
        motion = np.eye(size) + seconds * np.eye(size, k=3)
        return _symmetric(*self._predict(*estimate, F=motion, Q=drift))

    def _corrected(self, estimate: Gaussian, detection: Detection) -> Gaussian:
        value, pose = detection.value.copy(), np.eye(3, len(estimate.mean))
        value[2] = lift(float(value[2]), float(estimate.mean[2]))
        return _symmetric(*self._update(*estimate, value, detection.covariance, pose))


def _symmetric(mean: Array, covariance: Array) -> Gaussian:
    return Gaussian(mean, 0.5 * (covariance + covariance.T))


def innovation_of(estimate: Gaussian, detection: Detection) -> tuple[Array, float]:
    """Detection minus mean (3,), heading on the mean's branch, and its square in units of S, Eq. (E4)."""
    mean = estimate.mean
    innovation = detection.value - mean[:3]
    innovation[2] = lift(float(detection.value[2]), float(mean[2])) - mean[2]
    innovation.flags.writeable = False
    spread = estimate.covariance[:3, :3] + detection.covariance
    return innovation, float(innovation @ np.linalg.solve(spread, innovation))


def _contradiction(agile: Gaussian, steady: Gaussian) -> float:
    """How far the goal is from standing where the steady estimate has it, Eq. (E5)."""
    off, spread = agile.mean.copy(), agile.covariance.copy()
    off[:3] -= steady.mean
    spread[:3, :3] -= steady.covariance
    return _square(off, spread + 1e-3 * np.diag(np.diagonal(agile.covariance)))


def _square(off: Array, covariance: Array) -> float:
    """off' covariance^-1 off, in units in which the variances are 1; 0 where rounding decides over it."""
    scale = np.sqrt(np.diagonal(covariance).clip(1e-300))
    try:
        square = float(off / scale @ np.linalg.solve(covariance / np.outer(scale, scale), off / scale))
    except np.linalg.LinAlgError:
        return 0.0
    return square if np.isfinite(square) else 0.0
