"""What a cycle plans in: where its command begins to act, against what the segment is to end in."""

from __future__ import annotations

from dataclasses import dataclass
from math import copysign, hypot, nan, pi

import numpy as np

from geometry import PathPart, Pose2, lift
from geometry.part import closest_to, pose_at
from geometry.pose import offset
from rti_mpcc.clock import CycleClock
from rti_mpcc.config import ControllerConfig
from rti_mpcc.controller import RtiMpcc
from rti_mpcc.course import route_start
from rti_mpcc.course.speed_profile import ComfortSpeeds
from rti_mpcc.manoeuvre import SegmentEnd
from rti_mpcc.model.bicycle import step_one
from rti_mpcc.model.layout import PHI, POSE, THETA, V
from rti_mpcc.ocp.bounds import PASSED_DISTANCE
from rti_mpcc.ocp.targets import Target, stop_on
from rti_mpcc.state import ControllerState
from rti_mpcc.types import Array, Trajectory
from rti_mpcc.world.vehicle import predicted

OFF_PATH = 100.0  # [m]; a vehicle farther from its path is taken to be on another one
MEAN_TIME = 1.0  # [s] over which the pose of a docked vehicle is averaged
PROGRESS_STEP = 2.0  # [m] by which the progress may move in a cycle


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
            distance across, never negative, see `distance_left`.
        speed: towards the target [m/s].
        error: pose at `start_time` in the target's frame (longitudinal, lateral, heading).
        standing_error: the same, at rest averaged over the last moments.
        tolerance: (longitudinal, lateral, heading) of the target.
        config: the settings, with the limits of the segment; mpcc: the core of it.
        clock: what time decides in this cycle.
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
    tolerance: tuple[float, float, float]
    config: ControllerConfig
    mpcc: RtiMpcc
    clock: CycleClock

    @property
    def deceleration(self) -> float:
        """With which the vehicle brakes until `begin` [m/s²]; negative where it gains speed."""
        return -copysign(self.acceleration, self.acceleration * float(self.state[V]))

    @property
    def stop_error(self) -> Pose2:
        """The error after braking in comfort from `start_time` on, with the steering held."""
        state, most = tuple(self.state.tolist()), self.config.comfort_acceleration
        braking, seconds = (-copysign(most, state[V]), 0.0, 0.0), abs(state[V]) / most
        x, y, phi, *_ = step_one(state, braking, seconds, self.config.vehicle.wheelbase)
        return Pose2(x, y, phi).relative_to(self.target.pose)

    def inside(self, error: Pose2, share: float = 1.0) -> bool:
        """Whether `error` lies within `share` of the tolerance, and the path is driven: at the start of one
        that comes back, more than half a turn is left."""
        return self.along < pi / self.config.max_curvature and error.within(self.tolerance, share)

    def missed_by(self, plan: Trajectory, clip: tuple[float, float]) -> bool:
        """Whether a plan ends farther from the target than `clip` [m], [rad]."""
        error = self._end_error(plan)
        return hypot(error.x, error.y) > clip[0] or abs(error.phi) > clip[1]

    def reached_by(self, plan: Trajectory, share: float = 1.0) -> bool:
        """Whether a plan ends within `share` of the tolerance."""
        return self._end_error(plan).within(self.tolerance, share)

    def _end_error(self, plan: Trajectory) -> Pose2:
        return Pose2(*plan.states[-1, :POSE].tolist()).relative_to(self.target.pose)


def start_of(s: ControllerState, part: PathPart, config: ControllerConfig) -> Array:
    """The predicted state (6,) when a command given now starts to act, on the part; before the first
    measurement the start of the part."""
    if s.vehicle.monitor.state is None:
        first = part.first
        return np.array([first.x, first.y, first.phi, 0.0, 0.0, part.start])
    start = predicted(s, s.clock.now + s.vehicle.dead_time, config)
    _place_on_route(start, s.start_state, part)
    return start


def context_of(
    s: ControllerState, reached: Array, mpcc: RtiMpcc, profile: ComfortSpeeds, clock: CycleClock
) -> PlanningContext:
    """The state `reached` (6,), in which the command of this cycle begins to act, against path and target."""
    monitor, now, task = s.vehicle.monitor, s.clock.now, s.task
    state, part, config = reached.tolist(), task.segment.part, mpcc.config
    assert task.target is not None
    target = task.target if task.stop is None else stop_on(part, task.stop.at)
    x, y, phi, v, _, theta = state
    here, on_path = Pose2(x, y, phi), Pose2(*pose_at(part.arcs, theta))
    along, distance = distance_left(here, theta, on_path, part.direction, target)
    error, off = here.relative_to(target.pose), hypot(here.x - on_path.x, here.y - on_path.y)
    start = now + s.vehicle.dead_time
    acting = s.sent[-1].acting(start, s.vehicle.actuators)[0] if s.sent else None
    stands = route_start.here(s, config) if s.vehicle.stands and monitor.state is not None else here
    if s.task.hold is not None and s.task.hold.docked is not None:
        stands = s.vehicle.poses.mean(max(s.task.hold.since, now - MEAN_TIME)) or here
    return PlanningContext(
        now=now,
        start_time=start,
        state=reached,
        acceleration=0.0 if acting is None else s.vehicle.disturbance.acting(acting),
        measured_speed=0.0 if monitor.state is None else float(monitor.state[V]),
        doubt=monitor.doubt or (f"{off:.4g} m off the path" if off > OFF_PATH else ""),
        target=target,
        direction=part.direction,
        ends_at_goal=task.end is SegmentEnd.GOAL,
        free=task.end is not SegmentEnd.STOP,
        along=along,
        distance=distance,
        speed=max(part.direction * v, 0.0),
        profile=profile,
        error=error,
        standing_error=error if stands is here else stands.relative_to(target.pose),
        tolerance=task.tolerance,
        config=config,
        mpcc=mpcc,
        clock=clock,
    )


def _place_on_route(reached: Array, last: Array | None, part: PathPart) -> None:
    """Set the progress and the branch of the heading, both nearest to the last ones; before the start of the
    part the progress counts along the path extrapolated straight."""
    x, y, phi, *_ = reached.tolist()
    if last is None:
        theta = part.project(x, y, heading=phi)
        heading = part.pose(theta).phi
    else:
        near, begin, end = max(float(last[THETA]), part.start), part.start, part.end
        low, high = min(max(near - PROGRESS_STEP, begin), end), min(max(near + PROGRESS_STEP, begin), end)
        theta = closest_to(part.arcs, x, y, low, high, nan)
        heading = float(last[PHI])
    if theta <= part.start:
        first = part.first
        theta += min(part.direction * offset(x - first.x, y - first.y, first.phi)[0], 0.0)
    reached[THETA] = theta
    reached[PHI] = lift(phi, heading)


def distance_left(
    here: Pose2, theta: float, on_path: Pose2, direction: int, target: Target
) -> tuple[float, float]:
    """Distance left [m] from a pose at `theta` [m], where the path, driven in this direction, is `on_path`.

    Along the path, negative if the target was passed; and with that across, 0 if it was passed by more than
    `PASSED_DISTANCE`.
    """
    ahead, aside = offset(here.x - on_path.x, here.y - on_path.y, on_path.phi)
    along = target.theta - theta - direction * ahead
    distance = hypot(along, target.across - aside)
    return along, distance if along > 0.0 or distance < PASSED_DISTANCE else 0.0
