"""GoalPoseFilter: where the goal is, from detections that are noisy, late, missing or wrong.

A Kalman filter on x, y, heading and, for a moving goal, their rates; equations in docs/method.md.

(E3)  covariance += drift² dt;  moving: rates walk too, and carry the pose along
(E4)  NIS = nu' S^-1 nu <= chi-square quantile of 3 (`gate`),  nu = detected - estimate,  S = H P H' + R
(E5)  moved if  nu_m' (H P H' + R_m)^-1 nu_m > chi-square quantile of 3 (`_MOVED`),
      nu_m = R_m sum R_i^-1 nu_i,  R_m = (sum R_i^-1)^-1,  P of what was believed before these detections

What a plain filter lacks:

- A detection is set against the prediction before it may act, (E4).
- The goal may have moved, by much or by less than the gate shows. The detections of the last
  `_REACQUIRE_AFTER` that agree with the newest of them (the same gate, between two detections), if they are
  the most of them and span that time, are fused by themselves; where that contradicts what was believed
  before them, (E5), the estimate begins afresh from them. While SEARCHING there is nothing to contradict:
  then `confirmations` detections that agree are enough, if they are half of those seen meanwhile.
- A late detection is put where its stamp belongs: the filter goes back and processes what came after
  again, so the order of arrival does not matter.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.special import chdtri

from estimation.belief import (
    Belief,
    Recent,
    bare,
    contradiction,
    innovation_of,
    innovations,
    prevailing,
    shifted,
)
from estimation.measurement import Detection, GoalMeasurement, in_world, is_time
from estimation.settings import GoalFilterConfig
from estimation.types import Array, GoalEstimate, GoalStatus, Judgement, Outcome
from geometry import Pose2, lift
from geometry.doors import door

KEPT = 5.0
"""Detections farther apart than this [s] are not compared with each other."""
CLOCK_SKEW = 0.05
"""A stamp may lie so far ahead of the clock [s]."""
_REACQUIRE_AFTER = 0.65
"""Detections that agree with each other over this time [s], and contradict the estimate before them, are the
goal's new place."""
_MOVED = 0.9999
"""Probability with which detections of a goal that has not moved do not count as contradicting."""
_COAST_AFTER = 0.5  # time without an accepted detection until COASTING [s]
_VELOCITY_DRIFT, _TURN_RATE_DRIFT = 0.02, 0.01  # of a moving goal [m/s/sqrt(s)], [rad/s/sqrt(s)]
_FIRST_RATES = np.square([0.2, 0.2, 0.05])  # variances when a moving goal is first seen, of [m/s], [rad/s]


class GoalPoseFilter:
    """The goal's pose in the world from detections. Time is told by `predict`, stamps are on the same clock.

    Args:
        config: settings, all with defaults.
    """

    @door()
    def __init__(self, config: GoalFilterConfig | None = None) -> None:
        # Not at the top: filterpy loads 350 modules, scipy.stats above all, which `import estimation` spares.
        from filterpy.kalman import KalmanFilter

        self.config = config or GoalFilterConfig()
        size = 6 if self.config.moving else 3
        self._kalman: Any = KalmanFilter(dim_x=size, dim_z=3)
        self._kalman.H = np.eye(3, size)
        self._still, self._carried = np.eye(size), np.eye(size, k=3)
        self._gate = float(chdtri(3, 1.0 - self.config.gate))
        self._moved = float(chdtri(3, 1.0 - _MOVED))
        self.reset()

    def reset(self) -> None:
        """Forget everything: SEARCHING."""
        self._now: float | None = None
        self._origin = Belief(time=-np.inf)
        self._past: list[tuple[Detection, Belief]] = []

    @door()
    def predict(self, now: float) -> None:
        """Tell the time [s].

        A clock that runs back by no more than `history` is waited for; beyond that it was set anew, and the
        estimate is carried over to the new time.
        """
        if not is_time(now):
            return
        if self._now is not None and now < self._now - self.config.history:
            self._origin = shifted(self._latest, now - self._now)
            self._past = []
            self._now = now
        if self._now is None:
            # Nothing was too early as long as no time was told.
            del self._past[bisect_right(self._past, now + CLOCK_SKEW, key=_stamp) :]
        self._now = now if self._now is None else max(now, self._now)
        self._settle(self._now)

    @door()
    def update(self, measurement: GoalMeasurement) -> Judgement:
        """Take in one detection, at the time of its stamp; says what became of it. Raises nothing."""
        detection = in_world(measurement, self.config)
        problem = detection if isinstance(detection, str) else self._timing_problem(detection)
        if isinstance(detection, str) or problem:
            return Judgement(stamp=measurement.stamp, outcome=Outcome.REFUSED, reason=problem)
        if self._now is None:
            self._settle(detection.stamp)
        place = bisect_right(self._past, detection.stamp, key=_stamp)
        later = [step[0] for step in self._past[place:]]
        del self._past[place:]
        judgements = []
        for each in (detection, *later):
            belief, judgement = self._judge(self._latest, each)
            self._past.append((each, belief))
            judgements.append(judgement)
        return judgements[0]

    @door()
    def estimate(self, now: float) -> GoalEstimate:
        """What is known of the goal at `now` [s], in so far as it has been told."""
        belief, judged = self._latest, self._latest.judged
        innovation, nis = (judged.innovation, judged.nis) if judged else (None, None)
        if belief.mean is None:
            return GoalEstimate(status=GoalStatus.SEARCHING, innovation=innovation, nis=nis)
        assert belief.seen_at is not None
        now = max(time for time in (now, belief.time, self._now) if time is not None and is_time(time))
        mean, covariance = self._predicted(belief, now)
        covariance, velocity = covariance[:3, :3].copy(), mean[3:].copy()
        covariance.flags.writeable = velocity.flags.writeable = False
        return GoalEstimate(
            status=self._status(now - belief.seen_at),
            pose=Pose2(float(mean[0]), float(mean[1]), float(mean[2])),
            covariance=covariance,
            velocity=velocity if self.config.moving else None,
            age=now - belief.seen_at,
            innovation=innovation,
            nis=nis,
        )

    @property
    def _latest(self) -> Belief:
        return self._past[-1][1] if self._past else self._origin

    def _settle(self, now: float) -> None:
        """Forget what can no longer be put in another order; the last belief before is where it begins."""
        settled = bisect_left(self._past, now - self.config.history, key=_stamp)
        if settled:
            self._origin = self._past[settled - 1][1]
            del self._past[:settled]

    def _status(self, age: float) -> GoalStatus:
        if age > self.config.lost_after:
            return GoalStatus.LOST
        return GoalStatus.COASTING if age > _COAST_AFTER else GoalStatus.TRACKING

    def _timing_problem(self, detection: Detection) -> str:
        if self._now is not None and detection.stamp > self._now + CLOCK_SKEW:
            return f"stamp {detection.stamp:.3f} s is ahead of the clock, {self._now:.3f} s"
        if self._now is not None and detection.stamp < self._now - self.config.history:
            return f"stamp {detection.stamp:.3f} s is too old at {self._now:.3f} s"
        if detection.stamp < self._origin.time:
            return f"stamp {detection.stamp:.3f} s is before what was settled at {self._origin.time:.3f} s"
        if any(detection.same(known) for known, _ in self._past):
            return "told already"
        return ""

    def _judge(self, belief: Belief, detection: Detection) -> tuple[Belief, Judgement]:
        """The belief after one more detection, and what became of that."""
        recent = (*self._window(belief, detection.stamp), Recent(detection=detection, before=bare(belief)))
        judged = Judgement(stamp=detection.stamp, outcome=Outcome.REJECTED, pose=detection.pose)
        if belief.mean is not None:
            mean, covariance = self._predicted(belief, detection.stamp)
            innovation, nis = innovation_of(mean, covariance, detection)
            judged = replace(judged, innovation=innovation, nis=nis)
            belief = replace(belief, mean=mean, covariance=covariance)
        belief = replace(belief, time=detection.stamp, recent=recent)
        agreeing = self._agreeing(belief, detection)
        acquired = self._acquired(belief, agreeing)
        if acquired:
            judged = replace(judged, outcome=Outcome.ACQUIRED)
            return replace(self._fused(acquired, belief.mean), judged=judged), judged
        if judged.nis is not None and judged.nis <= self._gate:
            judged = replace(judged, outcome=Outcome.ACCEPTED)
            return replace(self._corrected(belief, detection), judged=judged), judged
        reason = f"waits for others that agree with it ({len(agreeing)} of {self.config.confirmations})"
        if judged.nis is not None:
            reason = f"NIS {judged.nis:.1f} is above the gate, {self._gate:.1f}"
        judged = replace(judged, reason=reason)
        return replace(belief, judged=judged), judged

    def _window(self, belief: Belief, stamp: float) -> Sequence[Recent]:
        """The recent detections that matter at `stamp` [s]: one more than `_REACQUIRE_AFTER` goes back."""
        stamps = [one.detection.stamp for one in belief.recent]
        first = bisect_right(stamps, stamp - KEPT)
        if belief.mean is not None:
            first = max(first, bisect_right(stamps, stamp - _REACQUIRE_AFTER) - 1)
        return belief.recent[first:]

    def _acquired(self, belief: Belief, agreeing: Sequence[Recent]) -> Sequence[Recent]:
        """Those recent detections that show where the goal is now; empty while they do not suffice."""
        first, last = agreeing[0].detection.stamp, agreeing[-1].detection.stamp
        if belief.mean is None:
            return prevailing(belief.recent, agreeing, self.config.confirmations)
        before = agreeing[0].before
        # More than one more than the others: of two places seen in turn, one has both ends of the window.
        if last - first < _REACQUIRE_AFTER or 2 * len(agreeing) <= len(belief.recent) + 1:
            return ()
        if before is None or before.mean is None:
            return ()
        mean, covariance = self._predicted(before, last)
        far = contradiction(mean, covariance, [one.detection for one in agreeing]) > self._moved
        return agreeing if far else ()

    def _agreeing(self, belief: Belief, detection: Detection) -> list[Recent]:
        """Those of the recent detections that pass the gate of this one, itself the last of them.

        Both of the same goal, which may have moved in between: by its drift, and with what its rates are.
        """
        recent = [one.detection for one in belief.recent]
        seconds = detection.stamp - np.array([[one.stamp] for one in recent])
        place, moved = detection.value, np.diagonal(self.config.drift(1.0)) * seconds
        if self.config.moving:
            rates, variances = np.zeros(3), _FIRST_RATES
            if belief.mean is not None and belief.covariance is not None:
                rates, variances = belief.mean[3:], np.diagonal(belief.covariance)[3:]
            place, moved = np.concatenate([place, rates]), moved + variances * seconds**2
        spreads = np.array([one.covariance for one in recent]) + detection.covariance
        spreads += moved[:, :, None] * np.eye(3)
        apart = innovations(place, recent)
        distances = np.einsum("ki,ki->k", apart, np.linalg.solve(spreads, apart[:, :, None])[:, :, 0])
        return [one for one, gap in zip(belief.recent, distances, strict=True) if gap <= self._gate]

    def _fused(self, recent: Sequence[Recent], known: Array | None) -> Belief:
        """The belief that these detections alone give, its heading on the branch of a `known` mean."""
        belief = self._born(recent[0].detection, known)
        for one in recent[1:]:
            mean, covariance = self._predicted(belief, one.detection.stamp)
            belief = replace(belief, time=one.detection.stamp, mean=mean, covariance=covariance)
            belief = self._corrected(belief, one.detection)
        return belief

    def _born(self, detection: Detection, known: Array | None) -> Belief:
        mean, covariance = detection.value.copy(), detection.covariance
        if known is not None:
            mean[2] = lift(float(mean[2]), float(known[2]))
        if self.config.moving:
            mean, none = np.concatenate([mean, np.zeros(3)]), np.zeros((3, 3))
            covariance = np.block([[covariance, none], [none, np.diag(_FIRST_RATES)]])
        return Belief(time=detection.stamp, mean=mean, covariance=covariance, seen_at=detection.stamp)

    def _predicted(self, belief: Belief, time: float) -> tuple[Array, Array]:
        """Mean and covariance at `time` [s], which is not before the belief's."""
        assert belief.mean is not None
        assert belief.covariance is not None
        seconds = max(time - belief.time, 0.0)
        kalman = self._kalman
        kalman.x, kalman.P = belief.mean[:, None], belief.covariance
        kalman.predict(F=self._still + seconds * self._carried, Q=self._walk(seconds))
        return kalman.x[:, 0].copy(), 0.5 * (kalman.P + kalman.P.T)

    def _walk(self, seconds: float) -> Array:
        """Covariance (n, n) that the goal's random walk adds in `seconds`."""
        config = self.config
        pose = config.drift(seconds)
        if not config.moving:
            return pose
        rates = np.diag(np.square([_VELOCITY_DRIFT, _VELOCITY_DRIFT, _TURN_RATE_DRIFT]))
        both = rates * seconds**2 / 2.0
        return np.block([[pose + rates * seconds**3 / 3.0, both], [both, rates * seconds]])

    def _corrected(self, belief: Belief, detection: Detection) -> Belief:
        assert belief.mean is not None
        kalman = self._kalman
        kalman.x, kalman.P = belief.mean[:, None], belief.covariance
        value = detection.value.copy()
        value[2] = lift(float(value[2]), float(belief.mean[2]))
        kalman.update(value[:, None], R=detection.covariance)
        mean, covariance = kalman.x[:, 0].copy(), 0.5 * (kalman.P + kalman.P.T)
        return replace(belief, mean=mean, covariance=covariance, seen_at=detection.stamp)


def _stamp(step: tuple[Detection, Belief]) -> float:
    return step[0].stamp
