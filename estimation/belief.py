"""What detections up to some time say about the goal, as a value, and what one more makes of that.

One track is taken for the goal. Detections that do not fit it make rival tracks: outliers, bursts of false
detections, a goal that is elsewhere now. A rival becomes the goal if it outlasts a burst, and if more
detections since its first one are its own than not. While no goal is known, `confirmations` detections are
enough, unless the planned goal contradicts them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import degrees, hypot, inf, pi

import numpy as np

from estimation.measurement import Detection
from estimation.track import KEPT, Track, TrackFilter, innovation_of
from estimation.types import Judgement, Outcome
from geometry import Pose2

BURST = 1.8
"""Detections that agree with each other over this time [s] are no burst of false ones."""
SHORTEST_BURST = 0.65
"""The same where the present track is not worth more: it was seen for a shorter time, or long ago."""
AGREED_FOR = 1.0
"""Detections that agree on another goal over this time [s] are told: who stands there is not docked."""

_FAR = (0.5, 0.2)
"""A goal that has moved by less than this [m], [rad] is followed sooner, in proportion: less is at stake."""
_AGREEING = 9  # detections that agree, for each that does not; few that are read turned are in a row
_SPREAD = 3.3
"""A detection is off by at most so many of its standard deviations, in 999 of 1000 cases."""


@dataclass(frozen=True, slots=True, kw_only=True)
class GoalPrior:
    """The planned goal, against which detections are judged from the first one on.

    Attributes:
        pose: the planned goal.
        position, heading: its largest errors [m], [rad]. Detections that are farther off are rejected.
        expected_position, expected_heading: its usual errors [m], [rad]. The nearer to them detections are,
            the longer they have to agree with each other before they count.
    """

    pose: Pose2
    position: float = inf
    heading: float = 0.5 * pi
    expected_position: float = inf
    expected_heading: float = inf

    def problem(self, detection: Detection) -> str:
        """Why a detection cannot be of this goal, or "".

        A marker may be read turned by 180 deg. Of the two headings that it may have, the one nearer to the
        planned goal's is right: a detection turned by more than 90 deg is a misread one.
        """
        far, turn = self._off(detection.pose)
        variances = np.diagonal(detection.covariance)
        position, heading = (_SPREAD * float(np.sqrt(each)) for each in (variances[:2].max(), variances[2]))
        if turn > 0.5 * pi:
            left = degrees(pi - turn)
            return (
                f"turned by {degrees(turn):.0f} deg against the planned goal: its marker is taken to be read "
                f"turned by 180 deg ({left:.0f} deg are left when turned back)"
            )
        if far > self.position + position or turn > self.heading + heading:
            return (
                f"{far:.2f} m and {degrees(turn):.0f} deg from the planned goal, which is wrong by at most "
                f"{self.position:.3g} m and {degrees(self.heading):.0f} deg"
            )
        return ""

    def surprise(self, pose: Pose2) -> float:
        """How unexpected a goal there is: 0 at the planned one, 1 where that is not usually as wrong."""
        far, turn = self._off(pose)
        return min(max(far / self.expected_position, turn / self.expected_heading), 1.0) ** 2

    def _off(self, pose: Pose2) -> tuple[float, float]:
        off = pose.relative_to(self.pose)
        return hypot(off.x, off.y), abs(off.phi)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Belief:
    """What the detections up to `time` [s] say.

    Attributes:
        track: taken for the goal; None before the goal was seen.
        rivals: tracks of detections that did not fit it.
        judged: the last detection set against a prediction.
    """

    time: float
    track: Track | None = None
    rivals: tuple[Track, ...] = ()
    judged: Judgement | None = None

    def elsewhere(self, now: float) -> Pose2 | None:
        """Where the detections of the last moment agree that the goal is, if not at the track; or None."""
        agreed = [
            rival
            for rival in self.rivals
            if rival.lasted >= AGREED_FOR >= now - rival.seen_at and rival.count > _AGREEING * rival.others
        ]
        return max(agreed, key=lambda rival: rival.count).pose if agreed else None


def later(belief: Belief, detection: Detection, prior: GoalPrior | None, tracks: TrackFilter) -> Belief:
    """The belief after one more detection; `judged` says what became of it."""
    stamp, rivals = detection.stamp, belief.rivals
    track = None if belief.track is None else tracks.predicted(belief.track, stamp)
    innovation, nis = (None, None) if track is None else innovation_of(track.estimate, detection)
    why, outcome = "" if prior is None else prior.problem(detection), Outcome.ACQUIRED
    if track is None or nis is None or why or nis > tracks.gate:
        rivals, rival = _joined(rivals, detection, tracks, barred=why != "")
        why = why or _not_yet(rival, track, nis, prior, tracks)
        if why:
            rivals, outcome = (*rivals, rival), Outcome.REJECTED
        else:
            track = tracks.taken_over(rival, track)
    else:
        track, elsewhere = tracks.joined(track, detection)
        rivals, outcome = _outnumbered(rivals), outcome if elsewhere else Outcome.ACCEPTED
    judged = Judgement(
        stamp=stamp,
        outcome=outcome,
        reason=why,
        pose=detection.pose,
        covariance=detection.covariance,
        innovation=innovation,
        nis=nis,
    )
    return Belief(time=stamp, track=track, rivals=rivals, judged=judged)


def _joined(
    rivals: Sequence[Track], detection: Detection, tracks: TrackFilter, *, barred: bool
) -> tuple[tuple[Track, ...], Track]:
    """The other rivals, and the one that a detection fits best, or a new one, with it."""
    known = [
        tracks.predicted(each, detection.stamp) for each in rivals if detection.stamp - each.seen_at <= KEPT
    ]
    alike = [k for k, each in enumerate(known) if each.barred == barred]
    squares = {k: innovation_of(known[k].agile, detection)[1] for k in alike}
    best = min(squares, key=lambda k: squares[k], default=None)
    if best is None or squares[best] > tracks.gate:
        return _outnumbered(known, barred=barred), tracks.born(detection, barred=barred)
    rival = known.pop(best)
    return _outnumbered(known, barred=barred), tracks.joined(rival, detection)[0]


def _outnumbered(rivals: Sequence[Track], *, barred: bool = False) -> tuple[Track, ...]:
    """The rivals after a detection that is not theirs, without those that most detections speak against.

    A barred detection speaks against other barred ones only.
    """
    counted = [
        each if barred and not each.barred else replace(each, others=each.others + 1) for each in rivals
    ]
    return tuple(each for each in counted if each.others <= each.count)


def _not_yet(
    rival: Track, track: Track | None, nis: float | None, prior: GoalPrior | None, tracks: TrackFilter
) -> str:
    """Why a rival is not taken for the goal yet, or ""."""
    doubted = 0.0 if prior is None else BURST * prior.surprise(rival.pose)
    if track is None or nis is None:
        enough = tracks.confirmations
        if rival.count < enough or rival.count < rival.others:
            return f"waits for others that agree with it ({rival.count} of {enough})"
        if rival.lasted < doubted:
            return f"waits for others that agree with it for {doubted:.1f} s, far from the planned goal"
        return ""
    worth = max(min(track.lasted, BURST), doubted)
    if rival.first - track.seen_at > BURST:
        worth = 0.0  # it was lost before
    off = rival.pose.relative_to(track.pose)
    share = min(max(hypot(off.x, off.y) / _FAR[0], abs(off.phi) / _FAR[1]), 1.0)
    needed = SHORTEST_BURST + max(worth - SHORTEST_BURST, 0.0) * share
    # Of two that are seen in turn neither has clearly more detections since its first one.
    if rival.lasted >= needed and rival.count > rival.others + 1:
        return ""
    return (
        f"NIS {nis:.1f} is above the gate, {tracks.gate:.1f}; {rival.count} agree with it over "
        f"{rival.lasted:.1f} s of {needed:.1f} s"
    )
