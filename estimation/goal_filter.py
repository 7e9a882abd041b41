"""GoalPoseFilter: where the goal is, from detections that are noisy, late, missing or wrong.

A Kalman filter on x, y, heading and, for a moving goal, their rates. What a plain one lacks:

- A detection is set against the prediction before it may act: with innovation y and S = H P H' + R, it
  passes the gate if y' S^-1 y is below the chi-square quantile of 3 (`gate`).
- Rejected detections are kept until one is accepted. Those that agree with the newest of them (the same
  gate, between two detections and with what the goal may have moved in between) over `reacquire_after` are
  the goal's new place, if they are at least half of those rejected meanwhile. While SEARCHING or LOST there
  is nothing to doubt them by: then `confirmations` of them are enough, however short the time.
- A late detection is put where its stamp belongs: the filter goes back and processes what came after
  again, so the order of arrival does not matter.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.special import chdtri

from estimation.candidates import agreeing, prevailing, still_kept
from estimation.measurement import Detection, GoalMeasurement, in_world, is_time
from estimation.settings import GoalFilterConfig
from estimation.types import Array, GoalEstimate, GoalStatus, Judgement, Outcome
from geometry import Pose2, lift


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Belief:
    """What the detections up to `time` [s] say.

    Attributes:
        mean: (n,) x, y, heading and for a moving goal their rates; None before the goal was seen.
        covariance: (n, n); seen_at: stamp of the last accepted detection [s].
        rejected: detections rejected since then, by stamp.
        judged: the last detection set against a prediction.
    """

    time: float
    mean: Array | None = None
    covariance: Array | None = None
    seen_at: float | None = None
    rejected: tuple[Detection, ...] = ()
    judged: Judgement | None = None


class GoalPoseFilter:
    """The goal's pose in the world from detections. Time is told by `predict`, stamps are on the same clock.

    Args:
        config: settings, all with defaults.
    """

    def __init__(self, config: GoalFilterConfig | None = None) -> None:
        # filterpy loads scipy.linalg and more: only who filters pays for it.
        from filterpy.kalman import KalmanFilter

        self.config = c = config or GoalFilterConfig()
        size = 6 if self.config.moving else 3
        self._kalman: Any = KalmanFilter(dim_x=size, dim_z=3)
        self._kalman.H = np.eye(3, size)
        self._gate = float(chdtri(3, 1.0 - self.config.gate))
        # Variances (3,) of x, y, heading: per second, of their rates per second, of their rates at first.
        self._pose_walk = np.square([c.position_drift, c.position_drift, c.heading_drift])
        self._rate_walk = np.square([c.velocity_drift, c.velocity_drift, c.turn_rate_drift])
        self._first_rates = np.square([c.velocity_std, c.velocity_std, c.turn_rate_std])
        self.reset()

    def reset(self) -> None:
        """Forget everything: SEARCHING."""
        self._now: float | None = None
        self._origin = Belief(time=-np.inf)
        self._past: list[tuple[Detection, Belief]] = []

    def predict(self, now: float) -> None:
        """Tell the time [s].

        A clock that runs back by no more than `history` is waited for; beyond that it was set anew, and the
        estimate is carried over to the new time.
        """
        if not is_time(now):
            return
        if self._now is not None and now < self._now - self.config.history:
            back = self._now - now
            self._origin = _shifted(self._latest, -back)
            self._past = []
            self._now = now
        if self._now is None:
            # Nothing was too early as long as no time was told.
            del self._past[bisect_right(self._past, now + self.config.clock_skew, key=_stamp) :]
        self._now = now if self._now is None else max(now, self._now)
        # Whatever may still be put in order or told again stays; the last belief before is where it begins.
        settled = bisect_left(self._past, self._now - self.config.history, key=_stamp)
        if settled:
            self._origin = self._past[settled - 1][1]
            del self._past[:settled]

    def update(self, measurement: GoalMeasurement) -> Judgement:
        """Take in one detection, at the time of its stamp; says what became of it. Raises nothing."""
        detection = in_world(measurement, self.config)
        problem = detection if isinstance(detection, str) else self._timing_problem(detection)
        if isinstance(detection, str) or problem:
            return Judgement(stamp=measurement.stamp, outcome=Outcome.REFUSED, reason=problem)
        place = bisect_right(self._past, detection.stamp, key=_stamp)
        later = [step[0] for step in self._past[place:]]
        del self._past[place:]
        judgement = self._append(detection)
        for other in later:
            self._append(other)
        return judgement

    def estimate(self, now: float) -> GoalEstimate:
        """What is known of the goal at `now` [s], in so far as it has been told."""
        belief, judged = self._latest, self._latest.judged
        innovation = judged.innovation if judged else None
        nis = judged.nis if judged else None
        if belief.mean is None:
            return GoalEstimate(status=GoalStatus.SEARCHING, innovation=innovation, nis=nis)
        assert belief.seen_at is not None
        told = [time for time in (now, belief.time, self._now) if time is not None and is_time(time)]
        now = max(told)
        mean, covariance = self._predicted(belief, now)
        covariance, velocity = covariance[:3, :3].copy(), mean[3:].copy() if self.config.moving else None
        for array in (covariance, velocity):
            if array is not None:
                array.flags.writeable = False
        return GoalEstimate(
            status=self._status(now - belief.seen_at),
            pose=Pose2(float(mean[0]), float(mean[1]), float(mean[2])),
            covariance=covariance,
            velocity=velocity,
            age=now - belief.seen_at,
            innovation=innovation,
            nis=nis,
        )

    # -- time ---------------------------------------------------------------------------------------

    @property
    def _latest(self) -> Belief:
        return self._past[-1][1] if self._past else self._origin

    def _status(self, age: float) -> GoalStatus:
        if age > self.config.lost_after:
            return GoalStatus.LOST
        return GoalStatus.COASTING if age > self.config.coast_after else GoalStatus.TRACKING

    def _timing_problem(self, detection: Detection) -> str:
        """Why a detection's stamp is not usable, or ""."""
        if self._now is not None and detection.stamp > self._now + self.config.clock_skew:
            return f"stamp {detection.stamp:.3f} s is ahead of the clock, {self._now:.3f} s"
        if self._now is not None and detection.stamp < self._now - self.config.history:
            return f"stamp {detection.stamp:.3f} s is too old at {self._now:.3f} s"
        if detection.stamp < self._origin.time:
            return f"stamp {detection.stamp:.3f} s is before what was settled at {self._origin.time:.3f} s"
        if any(detection.same(known) for known, _ in self._past):
            return "told already"
        return ""

    # -- detections ---------------------------------------------------------------------------------

    def _append(self, detection: Detection) -> Judgement:
        belief, judgement = self._judge(self._latest, detection)
        self._past.append((detection, belief))
        return judgement

    def _judge(self, belief: Belief, detection: Detection) -> tuple[Belief, Judgement]:
        """The belief after one more detection, and what became of that."""
        verdict = Judgement(stamp=detection.stamp, outcome=Outcome.REJECTED, pose=detection.pose)
        if belief.mean is not None:
            mean, covariance = self._predicted(belief, detection.stamp)
            innovation, nis = _innovation(mean, covariance, detection)
            verdict = replace(verdict, innovation=innovation, nis=nis)
            belief = replace(belief, time=detection.stamp, mean=mean, covariance=covariance)
            if nis <= self._gate:
                verdict = replace(verdict, outcome=Outcome.ACCEPTED)
                return self._corrected(replace(belief, judged=verdict), detection), verdict
        waiting = still_kept(belief.rejected, detection.stamp)
        agreed = agreeing(waiting, detection, self.config, self._gate)
        confirmed = self._confirmed(belief, waiting, agreed)
        if confirmed:
            verdict = replace(verdict, outcome=Outcome.ACQUIRED)
            return replace(self._fused(confirmed, belief.mean), judged=verdict), verdict
        verdict = replace(verdict, reason=self._rejection(verdict, len(agreed)))
        rejected = (*waiting, detection)
        return replace(belief, time=detection.stamp, rejected=rejected, judged=verdict), verdict

    def _rejection(self, verdict: Judgement, agreed: int) -> str:
        if verdict.nis is None:
            return f"waits for others that agree with it ({agreed} of {self.config.confirmations})"
        return f"NIS {verdict.nis:.1f} is above the gate, {self._gate:.1f}"

    def _confirmed(
        self, belief: Belief, waiting: Sequence[Detection], agreed: Sequence[Detection]
    ) -> Sequence[Detection]:
        """Those detections that show where the goal is now; empty while they do not suffice."""
        unknown = belief.seen_at is None or agreed[-1].stamp - belief.seen_at > self.config.lost_after
        if unknown:
            return prevailing(waiting, agreed, count=self.config.confirmations, seconds=0.0)
        return prevailing(waiting, agreed, count=1, seconds=self.config.reacquire_after)

    def _fused(self, detections: Sequence[Detection], before: Array | None) -> Belief:
        """The belief that these detections alone give, its heading on the branch of the mean `before`."""
        first = detections[0]
        belief = self._born(first, before)
        for detection in detections[1:]:
            mean, covariance = self._predicted(belief, detection.stamp)
            belief = replace(belief, time=detection.stamp, mean=mean, covariance=covariance)
            belief = self._corrected(belief, detection)
        return belief

    # -- the Kalman filter --------------------------------------------------------------------------

    def _born(self, detection: Detection, before: Array | None) -> Belief:
        mean, covariance = detection.value.copy(), detection.covariance
        if before is not None:
            mean[2] = lift(float(mean[2]), float(before[2]))
        if self.config.moving:
            mean = np.concatenate([mean, np.zeros(3)])
            none = np.zeros((3, 3))
            covariance = np.block([[covariance, none], [none, np.diag(self._first_rates)]])
        return Belief(time=detection.stamp, mean=mean, covariance=covariance, seen_at=detection.stamp)

    def _predicted(self, belief: Belief, time: float) -> tuple[Array, Array]:
        """Mean and covariance at `time` [s], which is not before the belief's."""
        assert belief.mean is not None
        assert belief.covariance is not None
        seconds = max(time - belief.time, 0.0)
        kalman, size = self._kalman, len(belief.mean)
        kalman.x, kalman.P = belief.mean[:, None], belief.covariance
        motion = np.eye(size) + seconds * np.eye(size, k=3)
        kalman.predict(F=motion, Q=self._walk(seconds))
        return kalman.x[:, 0].copy(), 0.5 * (kalman.P + kalman.P.T)

    def _walk(self, seconds: float) -> Array:
        """Covariance (n, n) that the goal's random walk adds in `seconds`."""
        pose, rates = np.diag(self._pose_walk), np.diag(self._rate_walk)
        if not self.config.moving:
            return pose * seconds
        return np.block(
            [
                [pose * seconds + rates * seconds**3 / 3.0, rates * seconds**2 / 2.0],
                [rates * seconds**2 / 2.0, rates * seconds],
            ]
        )

    def _corrected(self, belief: Belief, detection: Detection) -> Belief:
        """After a detection that is taken in, at its own stamp."""
        assert belief.mean is not None
        kalman = self._kalman
        kalman.x, kalman.P = belief.mean[:, None], belief.covariance
        value = detection.value.copy()
        value[2] = lift(float(value[2]), float(belief.mean[2]))
        kalman.update(value[:, None], R=detection.covariance)
        mean, covariance = kalman.x[:, 0].copy(), 0.5 * (kalman.P + kalman.P.T)
        return replace(belief, mean=mean, covariance=covariance, seen_at=detection.stamp, rejected=())


def _stamp(step: tuple[Detection, Belief]) -> float:
    return step[0].stamp


def _innovation(mean: Array, covariance: Array, detection: Detection) -> tuple[Array, float]:
    """Detection minus mean (3,), heading on the mean's branch, and its square in units of S = H P H' + R."""
    innovation = detection.value - mean[:3]
    innovation[2] = lift(float(detection.value[2]), float(mean[2])) - mean[2]
    innovation.flags.writeable = False
    spread = covariance[:3, :3] + detection.covariance
    return innovation, float(innovation @ np.linalg.solve(spread, innovation))


def _shifted(belief: Belief, seconds: float) -> Belief:
    """The same belief on a clock that was set by `seconds`; what was rejected is forgotten."""
    if belief.mean is None:
        return Belief(time=-np.inf)
    assert belief.seen_at is not None
    return replace(belief, time=belief.time + seconds, seen_at=belief.seen_at + seconds, rejected=())
