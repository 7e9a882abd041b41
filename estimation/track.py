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
from typing import Any

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


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Track:
    """What detections that agree with each other say, as a value.

    Attributes:
        time: of the estimates [s]; first, seen_at: stamps of its first and last detection [s].
        mean, covariance: the agile estimate (6,), (6, 6): x, y, heading and their rates.
        still, still_covariance: the steady one (3,), (3, 3); None for a goal that moves.
        count: number of its detections; others: of those since the first that were not its own.
        barred: its detections contradict the prior, it cannot be the goal.
        moving_since: since when it moves [s], or None.
    """

    time: float
    first: float
    seen_at: float
    mean: Array
    covariance: Array
    still: Array | None = None
    still_covariance: Array | None = None
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
    def values(self) -> tuple[Array, Array]:
        """Mean (n,) and covariance (n, n) of the estimate: of a goal that moves with its rates."""
        if self.still is None or self.still_covariance is None:
            return self.mean, self.covariance
        return self.still, self.still_covariance

    @property
    def pose(self) -> Pose2:
        """The goal."""
        x, y, phi = self.values[0][:3].tolist()
        return Pose2(x, y, phi)


class TrackFilter:
    """The two Kalman filters of a track."""

    def __init__(self, config: GoalFilterConfig) -> None:
        # Not at the top: filterpy loads 350 modules, scipy.stats above all, which `import estimation` spares.
        from filterpy.kalman import KalmanFilter

        self._config = config
        self._kalman: dict[int, Any] = {size: KalmanFilter(dim_x=size, dim_z=3) for size in (3, 6)}
        for size, kalman in self._kalman.items():
            kalman.H = np.eye(3, size)
        self.confirmations = config.confirmations
        self.gate = float(chdtri(3, 1.0 - config.gate))
        self._moved = float(chdtri(6, 1.0 - _MOVED))
        self._rests, self._moving, self._surely_moving = (
            float(chdtri(3, 1.0 - share)) for share in (_RESTS, _MOVING, _SURELY_MOVING)
        )

    def born(self, detection: Detection, *, barred: bool = False) -> Track:
        """The track of one detection."""
        none = np.zeros((3, 3))
        steady = not self._config.moving
        return Track(
            time=detection.stamp,
            first=detection.stamp,
            seen_at=detection.stamp,
            mean=np.concatenate([detection.value, np.zeros(3)]),
            covariance=np.block([[detection.covariance, none], [none, np.diag(_FIRST_RATES)]]),
            still=detection.value.copy() if steady else None,
            still_covariance=detection.covariance if steady else None,
            barred=barred,
        )

    def predicted(self, track: Track, time: float) -> Track:
        """The track at `time` [s], which is not before its own."""
        still, spread = track.still, track.still_covariance
        seconds = max(time - track.time, 0.0)
        if still is not None and spread is not None:
            still, spread = self._carried(still, spread, seconds)
            if time - track.seen_at > KEPT:
                none = np.zeros((3, 3))
                mean = np.concatenate([still, np.zeros(3)])
                covariance = np.block([[spread, none], [none, np.diag(_FIRST_RATES)]])
                return replace(
                    track, time=time, mean=mean, covariance=covariance, still=still, still_covariance=spread,
                    moving_since=None,
                )  # fmt: skip
        mean, covariance = self._carried(track.mean, track.covariance, seconds)
        return replace(
            track, time=time, mean=mean, covariance=covariance, still=still, still_covariance=spread
        )

    def joined(self, track: Track, detection: Detection) -> tuple[Track, bool]:
        """The track, predicted to a detection that fits it, with this; whether it stands elsewhere now."""
        mean, covariance = track.mean, track.covariance
        agile = self.born(detection)
        if innovation_of(mean, covariance, detection)[1] <= self.gate:
            mean, covariance = self._corrected(mean, covariance, detection)
        else:  # it fits the steady estimate alone
            mean, covariance = agile.mean.copy(), agile.covariance
            mean[2] = lift(float(mean[2]), float(track.mean[2]))
        still, spread = track.still, track.still_covariance
        if still is not None and spread is not None:
            still, spread = self._corrected(still, spread, detection)
        track = replace(
            track, seen_at=detection.stamp, mean=mean, covariance=covariance, still=still,
            still_covariance=spread, count=track.count + 1,
        )  # fmt: skip
        return self._restarted(replace(track, moving_since=self._moving_since(track)))

    def taken_over(self, track: Track, known: Track | None) -> Track:
        """A track that is taken for the goal from now on, its headings on the branch of the known one.

        It has seen the goal since this moved, not a shift: rates that are significant are a motion at once.
        """
        mean, still, since = track.mean.copy(), track.still, track.moving_since
        if known is not None:
            branch = float(known.values[0][2])
            mean[2] = lift(float(mean[2]), branch)
            if still is not None:
                still = np.array([still[0], still[1], lift(float(still[2]), branch)])
        if since is not None and _square(track.mean[3:], track.covariance[3:, 3:]) > self._surely_moving:
            since, still = min(since, track.seen_at - _MOVING_FOR), None
        spread = None if still is None else track.still_covariance
        return replace(track, mean=mean, still=still, still_covariance=spread, moving_since=since)

    def _restarted(self, track: Track) -> tuple[Track, bool]:
        """With another steady estimate, or none, if the goal does not stand where that is."""
        if self._config.moving:
            return track, False
        pose, spread = track.mean[:3].copy(), track.covariance[:3, :3].copy()
        if track.still is None or track.still_covariance is None:
            if track.moving_since is not None:
                return track, False
            return replace(track, still=pose, still_covariance=spread), True
        if self._contradiction(track) <= self._moved:
            return track, False
        if track.moves:
            return replace(track, still=None, still_covariance=None), True
        return replace(track, still=pose, still_covariance=spread), True

    def _contradiction(self, track: Track) -> float:
        """How far the goal is from standing where the steady estimate has it, Eq. (E5)."""
        assert track.still is not None
        assert track.still_covariance is not None
        off, spread = track.mean.copy(), track.covariance.copy()
        off[:3] -= track.still
        spread[:3, :3] -= track.still_covariance
        return _square(off, spread + 1e-3 * np.diag(np.diagonal(track.covariance)))

    def _moving_since(self, track: Track) -> float | None:
        """Since when the goal moves [s], or None: its rates are significant."""
        rates = track.mean[3:]
        if float(np.hypot(rates[0], rates[1])) <= _LEAST_SPEED and abs(float(rates[2])) <= _LEAST_TURN_RATE:
            return None
        started = track.moving_since
        significant = _square(rates, track.covariance[3:, 3:]) > (
            self._moving if started is None else self._rests
        )
        if not significant:
            return None
        return track.seen_at if started is None else started

    def _carried(self, mean: Array, covariance: Array, seconds: float) -> tuple[Array, Array]:
        """Mean and covariance some seconds later, Eq. (E3)."""
        size, drift = len(mean), self._config.drift(seconds)
        kalman = self._kalman[size]
        kalman.x, kalman.P = mean[:, None], covariance
        if size == 6:
            rates = np.diag(np.square([_VELOCITY_DRIFT, _VELOCITY_DRIFT, _TURN_RATE_DRIFT]))
            both = rates * seconds**2 / 2.0
            drift = np.block([[drift + rates * seconds**3 / 3.0, both], [both, rates * seconds]])
        kalman.predict(F=np.eye(size) + seconds * np.eye(size, k=3), Q=drift)
        return kalman.x[:, 0].copy(), 0.5 * (kalman.P + kalman.P.T)

    def _corrected(self, mean: Array, covariance: Array, detection: Detection) -> tuple[Array, Array]:
        kalman = self._kalman[len(mean)]
        kalman.x, kalman.P = mean[:, None], covariance
        value = detection.value.copy()
        value[2] = lift(float(value[2]), float(mean[2]))
        kalman.update(value[:, None], R=detection.covariance)
        return kalman.x[:, 0].copy(), 0.5 * (kalman.P + kalman.P.T)


def innovation_of(mean: Array, covariance: Array, detection: Detection) -> tuple[Array, float]:
    """Detection minus mean (3,), heading on the mean's branch, and its square in units of S, Eq. (E4)."""
    innovation = detection.value - mean[:3]
    innovation[2] = lift(float(detection.value[2]), float(mean[2])) - mean[2]
    innovation.flags.writeable = False
    spread = covariance[:3, :3] + detection.covariance
    return innovation, float(innovation @ np.linalg.solve(spread, innovation))


def _square(off: Array, covariance: Array) -> float:
    """off' covariance^-1 off, in units in which the variances are 1; 0 where rounding decides over it."""
    scale = np.sqrt(np.diagonal(covariance).clip(1e-300))
    try:
        square = float(off / scale @ np.linalg.solve(covariance / np.outer(scale, scale), off / scale))
    except np.linalg.LinAlgError:
        return 0.0
    return square if np.isfinite(square) else 0.0


def shifted(track: Track, seconds: float) -> Track:
    """The same track on a clock that was set by `seconds`."""
    since = track.moving_since
    return replace(
        track, time=track.time + seconds, first=track.first + seconds, seen_at=track.seen_at + seconds,
        moving_since=None if since is None else since + seconds,
    )  # fmt: skip
