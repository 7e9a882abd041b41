"""GoalPoseFilter: where the goal is, from detections that are noisy, late, missing or wrong.

What the detections say at their stamps is a `Belief`; how one more changes it: `estimation.belief`. Here is
the time: a late detection is put where its stamp belongs. The filter goes back and processes what came after
again, so the order of arrival does not matter.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from dataclasses import replace
from math import inf

from estimation.belief import Belief, GoalPrior, later
from estimation.measurement import Detection, GoalMeasurement, in_world, is_time
from estimation.settings import GoalFilterConfig
from estimation.track import TrackFilter
from estimation.types import GoalEstimate, GoalStatus, Judgement, Outcome
from geometry import Pose2
from geometry.validation import validated

CLOCK_SKEW = 0.05
"""A stamp may lie so far ahead of the clock [s]."""
_COAST_AFTER = 0.5  # time without an accepted detection until COASTING [s]
_MILLISECONDS = 1e3  # in a second: a stamp that fits the clock once divided by it is in milliseconds


class GoalPoseFilter:
    """The goal's pose in the world from detections. Time is told by `predict`, stamps are on the same clock.

    Args:
        config: settings, all with defaults.
    """

    @validated()
    def __init__(self, config: GoalFilterConfig | None = None) -> None:
        self.config = config or GoalFilterConfig()
        self._tracks = TrackFilter(self.config)
        self._prior: GoalPrior | None = None
        self.reset()

    def reset(self) -> None:
        """Forget everything but the planned goal: SEARCHING."""
        self._now: float | None = None
        self._origin = Belief(time=-inf)
        self._past: list[tuple[Detection, Belief]] = []

    @validated()
    def expect(self, prior: GoalPrior | None) -> None:
        """The planned goal, and how wrong it may be; None: nothing is known of it."""
        self._prior = prior

    @validated()
    def predict(self, now: float) -> None:
        """Tell the time [s].

        A clock that runs back by no more than `history` is waited for; beyond that it was set anew, and the
        estimate is carried over to the new time.
        """
        if not is_time(now):
            return
        if self._now is not None and now < self._now - self.config.history:
            self._origin = _on_clock(self._latest, now - self._now)
            self._past, self._now = [], now
        if self._now is None:
            # Nothing was too early as long as no time was told.
            del self._past[bisect_right(self._past, now + CLOCK_SKEW, key=_stamp) :]
        self._now = now if self._now is None else max(now, self._now)
        self._settle(self._now)

    @validated()
    def update(self, measurement: GoalMeasurement) -> Judgement:
        """Take in one detection, at the time of its stamp; says what became of it. Raises nothing."""
        detection = self._usable(measurement)
        if isinstance(detection, str):
            return Judgement(stamp=measurement.stamp, outcome=Outcome.REFUSED, reason=detection)
        if self._now is None:
            self._settle(detection.stamp)
        place = bisect_right(self._past, detection.stamp, key=_stamp)
        later_ones = [step[0] for step in self._past[place:]]
        del self._past[place:]
        for each in (detection, *later_ones):
            self._past.append((each, later(self._latest, each, self._prior, self._tracks)))
        judgement = self._past[place][1].judged
        assert judgement is not None
        return judgement

    @validated()
    def estimate(self, now: float) -> GoalEstimate:
        """What is known of the goal at `now` [s], in so far as it has been told."""
        belief, judged = self._latest, self._latest.judged
        innovation, nis = (judged.innovation, judged.nis) if judged else (None, None)
        told = (each for each in (now, belief.time, self._now) if each is not None and is_time(each))
        now = max(told, default=0.0)
        estimate = GoalEstimate(
            status=GoalStatus.SEARCHING, innovation=innovation, nis=nis, elsewhere=belief.elsewhere(now)
        )
        if belief.track is None:
            return estimate
        track = self._tracks.predicted(belief.track, now)
        lost_for = now - track.seen_at - self.config.lost_after
        pose, covariance = track.estimate.pose
        velocity = track.agile.rates.mean.copy()
        if track.steady is None and lost_for > 0.0:
            # A goal that is lost is not carried on any further: its rates are as noisy as they are old.
            pose = pose - lost_for * velocity
        covariance.flags.writeable = velocity.flags.writeable = False
        moves, age = belief.track.moves, now - track.seen_at
        status = GoalStatus.COASTING if age > _COAST_AFTER else GoalStatus.TRACKING
        return replace(
            estimate,
            status=GoalStatus.LOST if age > self.config.lost_after else status,
            pose=Pose2(*pose.tolist()),
            covariance=covariance,
            velocity=velocity if self.config.moving or moves else None,
            moves=moves,
            age=age,
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

    def _usable(self, measurement: GoalMeasurement) -> Detection | str:
        """A measurement as a detection in the world, or why it is not usable."""
        problem = self._timing_problem(measurement.stamp) if is_time(measurement.stamp) else ""
        detection = problem or in_world(measurement, self.config)
        if isinstance(detection, Detection) and any(detection.same(known) for known, _ in self._past):
            return "told already"
        return detection

    def _timing_problem(self, stamp: float) -> str:
        """Why a stamp cannot be used, or ""."""
        now = self._now
        if now is not None and not -self.config.history <= stamp - now <= CLOCK_SKEW:
            read = now - stamp / _MILLISECONDS
            hint = ": is it in milliseconds?" if -CLOCK_SKEW <= read <= self.config.history else ""
            late = f"older than `history`, {self.config.history:g} s: {now - stamp:.3f} s before the clock"
            ahead = f"ahead of the clock by {stamp - now:.3f} s"
            return (
                f"stamp {stamp:.3f} is {ahead if stamp > now else late}; stamps are seconds on the clock of "
                f"`now`, {now:.3f}{hint}"
            )
        if stamp < self._origin.time:
            return f"stamp {stamp:.3f} s is before what was settled at {self._origin.time:.3f} s"
        return ""


def _on_clock(belief: Belief, seconds: float) -> Belief:
    """The same belief on a clock that was set by `seconds`; rival tracks are forgotten."""
    if belief.track is None:
        return Belief(time=-inf)
    track = belief.track.shifted(seconds)
    return replace(belief, time=belief.time + seconds, track=track, rivals=())


def _stamp(step: tuple[Detection, Belief]) -> float:
    return step[0].stamp
