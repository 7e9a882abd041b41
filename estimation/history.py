"""Where the vehicle has been in the last moments: detections arrive late."""

from __future__ import annotations

from bisect import bisect_left
from dataclasses import dataclass
from math import isfinite

from geometry import Pose2, lift
from geometry.validation import validated

GAP = 0.5
"""Poses farther apart in time than this [s] are not interpolated between."""


@dataclass(frozen=True, slots=True)
class PoseHistory:
    """Vehicle poses by time, the latest last. A value: `noted` gives a new one.

    Attributes:
        stamps: [s], increasing; poses: as many, world frame.
    """

    stamps: tuple[float, ...] = ()
    poses: tuple[Pose2, ...] = ()

    @validated(late=True)
    def noted(self, stamp: float, pose: Pose2, *, length: float) -> PoseHistory:
        """With one more pose, without those older than `length` [s]. A clock that runs back begins anew."""
        if not isfinite(stamp):
            return self
        if self.stamps and stamp <= self.stamps[-1]:
            if stamp == self.stamps[-1]:
                return PoseHistory(self.stamps, (*self.poses[:-1], pose))
            return PoseHistory((stamp,), (pose,))
        # One pose older than the length stays: a stamp just inside of it lies between two.
        first = max(bisect_left(self.stamps, stamp - length) - 1, 0)
        return PoseHistory((*self.stamps[first:], stamp), (*self.poses[first:], pose))

    @validated(late=True)
    def at(self, stamp: float, *, ahead: float = 0.0) -> Pose2 | None:
        """The pose at `stamp` [s], interpolated; None where it is not known.

        Up to `ahead` [s] behind the latest pose the motion is carried on from the last two.
        """
        stamps = self.stamps
        if not stamps or not isfinite(stamp) or stamp < stamps[0] or stamp > stamps[-1] + ahead:
            return None
        after = bisect_left(stamps, stamp)
        if after < len(stamps) and stamps[after] == stamp:
            return self.poses[after]
        after = min(after, len(stamps) - 1)
        first = max(after - 1, 0)
        # What is carried on is a motion over as long a time at least: in a shorter one noise looks fast.
        while first > 0 and stamps[after] - stamps[first] < stamp - stamps[after]:
            first -= 1
        if after == 0 or stamps[after] - stamps[first] > GAP:
            return None
        before, last = self.poses[first], self.poses[after]
        share = min((stamp - stamps[first]) / (stamps[after] - stamps[first]), 2.0)
        turn = lift(last.phi, before.phi) - before.phi
        return Pose2(
            before.x + share * (last.x - before.x),
            before.y + share * (last.y - before.y),
            before.phi + share * turn,
        )

    @validated(late=True)
    def mean(self, since: float) -> Pose2 | None:
        """The mean of the poses from `since` on [s], on the branch of the latest; None: there are none."""
        poses = self.poses[bisect_left(self.stamps, since) :]
        if not poses:
            return None
        last, share = poses[-1], 1.0 / len(poses)
        return Pose2(
            last.x + share * sum(pose.x - last.x for pose in poses),
            last.y + share * sum(pose.y - last.y for pose in poses),
            last.phi + share * sum(lift(pose.phi, last.phi) - last.phi for pose in poses),
        )
