"""What a cycle plans in: where its command begins to act, against what the segment is to end in."""

from __future__ import annotations

from dataclasses import dataclass
from math import copysign, hypot

from geometry import Pose2
from rti_mpcc.model.layout import POSE, V
from rti_mpcc.ocp.targets import Target
from rti_mpcc.planning.speed_profile import ComfortSpeeds
from rti_mpcc.types import Array, Trajectory


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanningContext:
    """Where the vehicle will be when the command of this cycle starts to act.

    Attributes:
        now, start_time: [s]; start_time = now + dead time.
        state: (6,) at `start_time`, heading on the route's branch, with the steering that acts, see (O4).
        acceleration: that acts until then [m/s²]; measured_speed: estimate at `now` [m/s].
        doubt: why nothing can be planned from this state, or "".
        target: of the segment, or a stop on it; free: it is the segment's own.
        direction: of the segment; ends_at_goal: whether it ends at the goal; profile: its speed limits.
        along: distance to the target along the path [m], negative where that was passed; distance: with the
            distance across, never negative, see `sensing.distance_left`.
        speed: towards the target [m/s].
        error: pose at `start_time` in the target's frame (longitudinal, lateral, heading).
        standing_error: the same, at rest averaged over the last moments.
        stop_error: the same after braking at the comfort acceleration from now on.
        tolerance: (longitudinal, lateral, heading) of the target.
        half_turn: length of the tightest half circle that the vehicle can drive [m].
    """

    now: float
    start_time: float
    state: Array
    acceleration: float
    measured_speed: float
    doubt: str
    target: Target
    direction: int
    ends_at_goal: bool
    free: bool
    along: float
    distance: float
    speed: float
    profile: ComfortSpeeds
    error: Pose2
    standing_error: Pose2
    stop_error: Pose2
    tolerance: tuple[float, float, float]
    half_turn: float

    @property
    def deceleration(self) -> float:
        """With which the vehicle brakes until `begin` [m/s²]; negative where it gains speed."""
        return -copysign(self.acceleration, self.acceleration * float(self.state[V]))

    def inside(self, error: Pose2, share: float = 1.0) -> bool:
        """Whether `error` lies within `share` of the tolerance, and the path is driven: at the start of one
        that comes back, more than half a turn is left."""
        return self.along < self.half_turn and self.within(error, share)

    def within(self, error: Pose2, share: float = 1.0) -> bool:
        """Whether `error` lies within `share` of the tolerance."""
        return error.within(self.tolerance, share)

    def missed_by(self, plan: Trajectory, clip: tuple[float, float]) -> bool:
        """Whether a plan ends farther from the target than `clip` [m], [rad]."""
        error = self._end_error(plan)
        return hypot(error.x, error.y) > clip[0] or abs(error.phi) > clip[1]

    def reached_by(self, plan: Trajectory, share: float = 1.0) -> bool:
        """Whether a plan ends within `share` of the tolerance."""
        return self.within(self._end_error(plan), share)

    def _end_error(self, plan: Trajectory) -> Pose2:
        return Pose2(*plan.states[-1, :POSE].tolist()).relative_to(self.target.pose)
