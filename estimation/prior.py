"""What is known of the goal before any detection: the planned goal, and how wrong it may be."""

from __future__ import annotations

from dataclasses import dataclass
from math import degrees, hypot, inf, pi

import numpy as np

from estimation.measurement import Detection
from geometry import Pose2

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
