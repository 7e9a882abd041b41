"""DriveTo: drive to a pose and stand there."""

from __future__ import annotations

from dataclasses import dataclass, field

from geometry import Pose2
from rti_mpcc.mission.step import THREE, DrivingStep, Started, StepStart, all_positive, refuse_unless
from rti_mpcc.orders import GoTo
from rti_mpcc.world.goals import GoalTerms


@dataclass(frozen=True, slots=True)
class DriveTo(DrivingStep):
    """Drive to a pose and stand there.

    Attributes:
        pose: of the rear axle, world frame.
        tolerance: longitudinal [m], lateral [m], heading [rad]; None: that of the settings.
    """

    word = "drive_to"
    pose: Pose2
    tolerance: tuple[float, float, float] | None = field(default=None, kw_only=True)

    def _check(self) -> None:
        refuse_unless(all_positive(self.tolerance), self, "tolerance", THREE)

    def start(self, at: StepStart) -> Started:
        """Leave the dock, if there is one, for the pose."""
        terms = GoalTerms(tolerance=self.tolerance, detected=False)
        return Started(at.mission_state.at(None), GoTo(goal=self.pose, terms=terms), self.pose)
