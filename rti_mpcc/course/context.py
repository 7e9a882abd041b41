"""What a cycle plans in: where its command begins to act, against what the segment is to end in.

The `Workspace` makes it, and keeps what is made once for the active segment: its core, the clearance along
it, its speed profile, its target. A core is made anew for each segment. All else is a cache.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import product
from math import copysign, hypot, pi

import numpy as np

from geometry import Corridor, PathPart, Pose2, lift
from geometry.part import pose_at
from geometry.pose import offset
from rti_mpcc.clock import CycleClock
from rti_mpcc.config import ControllerConfig
from rti_mpcc.controller import RtiMpcc
from rti_mpcc.course import route_start
from rti_mpcc.course.speed_profile import ComfortSpeeds, speed_profile_of
from rti_mpcc.manoeuvre import WHOLE_TOLERANCE, Segment, SegmentEnd
from rti_mpcc.model.bicycle import step_one
from rti_mpcc.model.footprint import clearances
from rti_mpcc.model.layout import PHI, POSE, THETA, V
from rti_mpcc.ocp.bounds import PASSED_DISTANCE
from rti_mpcc.ocp.objectives import GOAL_CLIP, Target, ended_at, goal_on, path_end, stop_on
from rti_mpcc.ocp.side_clearance import side_clearance_along, with_obstacles
from rti_mpcc.state import ControllerState
from rti_mpcc.types import Array, Trajectory
from rti_mpcc.world.surroundings import warn_if_narrow
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
        settling: see `VehicleEstimate.settling` [s].
        before: what the commands make of acceleration [m/s²] and steering rate [rad/s] by then.
        acceleration: that plans continue from [m/s²], see `Actuator.continued`.
        measured_speed: estimate at `now` [m/s].
        doubt: why nothing can be planned from this state, or "".
        target: of the segment, or a stop on it; profile: the segment's speed limits.
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
    settling: float
    before: tuple[float, float]
    acceleration: float
    measured_speed: float
    doubt: str
    target: Target
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
        if 0.0 < abs(state[V]) < 2.0 * self.settling * most:
            most = abs(state[V]) / (2.0 * self.settling)
        braking, seconds = (-copysign(most, state[V]), 0.0, 0.0), abs(state[V]) / most
        x, y, phi, *_ = step_one(state, braking, seconds, self.config.vehicle.wheelbase)
        return Pose2(x, y, phi).relative_to(self.target.pose)

    def inside(self, error: Pose2, share: float = 1.0) -> bool:
        """Whether `error` lies within `share` of the tolerance, and the path is driven: at the start of one
        that comes back, more than half a turn is left."""
        return self.along < pi / self.config.max_curvature and error.within(self.tolerance, share)

    def missed_by(self, plan: Trajectory) -> bool:
        """Whether a plan ends farther from the target than one cycle pulls it, `GOAL_CLIP`."""
        (x, y, phi), target = plan.states[-1, :POSE].tolist(), self.target.pose
        position, heading = GOAL_CLIP
        return hypot(x - target.x, y - target.y) > position or abs(phi - target.phi) > heading

    def reached_by(self, plan: Trajectory, share: float = 1.0) -> bool:
        """Whether a plan ends within `share` of the tolerance."""
        end = Pose2(*plan.states[-1, :POSE].tolist())
        return end.relative_to(self.target.pose).within(self.tolerance, share)


def start_of(s: ControllerState, part: PathPart, config: ControllerConfig) -> Array:
    """The predicted state (6,) when a command of now starts to act; unmeasured: the start of the part.

    Progress and branch of the heading are those nearest to the last ones. Before the start of the part the
    progress counts along the path extrapolated straight.
    """
    first = part.first
    if s.vehicle.monitor.state is None:
        return np.array([first.x, first.y, first.phi, 0.0, 0.0, part.start])
    start = predicted(s, s.clock.now + s.vehicle.dead_time, config)
    (x, y, phi, *_), last = start.tolist(), s.start_state
    if last is None:
        theta = part.project(x, y, heading=phi)
        heading = part.pose(theta).phi
    else:
        near = max(float(last[THETA]), part.start)
        theta = part.project(x, y, near=near, reach=PROGRESS_STEP)
        heading = float(last[PHI])
    if theta <= part.start:
        theta += min(part.direction * offset(x - first.x, y - first.y, first.phi)[0], 0.0)
    start[THETA], start[PHI] = theta, lift(phi, heading)
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
    before, acceleration = (0.0, 0.0), 0.0
    if s.sent:
        last, drive = s.sent[-1], s.vehicle.actuators.drive
        before = last.acting(start, s.vehicle.actuators)
        planned = before[0]
        if drive.lag > 0.0:
            planned = drive.continued(last.acceleration, last.before[0], planned, config.cycle)
        acceleration = s.vehicle.disturbance.acting(planned)
    stands = route_start.here(s, config) if s.vehicle.stands and monitor.state is not None else here
    if s.task.hold is not None and s.task.hold.docked is not None:
        stands = s.vehicle.poses.mean(max(s.task.hold.since, now - MEAN_TIME)) or here
    return PlanningContext(
        now=now,
        start_time=start,
        state=reached,
        settling=s.vehicle.settling,
        before=before,
        acceleration=acceleration,
        measured_speed=0.0 if monitor.state is None else float(monitor.state[V]),
        doubt=monitor.doubt or (f"{off:.4g} m off the path" if off > OFF_PATH else ""),
        target=target,
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


def distance_left(
    here: Pose2, theta: float, on_path: Pose2, direction: int, target: Target
) -> tuple[float, float]:
    """Distance left [m] from a pose at `theta` [m], where the path, driven in this direction, is `on_path`.

    Along the path, negative if the target was passed; and with that across, 0 beyond `PASSED_DISTANCE`.
    """
    ahead, aside = offset(here.x - on_path.x, here.y - on_path.y, on_path.phi)
    along = target.theta - theta - direction * ahead
    distance = hypot(along, target.across - aside)
    return along, distance if along > 0.0 or distance < PASSED_DISTANCE else 0.0


# -- the active segment ---------------------------------------------------------------------------------

CUSP_SHIFT = 0.7  # of the tolerance at a cusp: so far beside it may the pose be (docs/decisions/13-cusps.md)

_STEPS = sorted(product((0.0, -0.5, 0.5, -1.0, 1.0), repeat=3), key=np.linalg.norm)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Active:
    """A segment and its core, the corridor that this knows, and the pace and the cusp by it."""

    segment: Segment
    mpcc: RtiMpcc
    corridor: Corridor
    profile: ComfortSpeeds
    cusp: Pose2 | None


class Workspace:
    """Makes what each cycle plans in, and keeps what is the same as in the last one."""

    def __init__(self, s: ControllerState, config: ControllerConfig) -> None:
        self._settings = config
        self._onto(s)

    def _onto(self, s: ControllerState) -> None:
        self._path, corridor, config = s.path, s.area.corridor, self._settings
        self._side_clearances = tuple(
            side_clearance_along(part, corridor, k, config) for k, part in enumerate(s.path.parts)
        )
        if corridor.area is None:
            for k, side_clearance in enumerate(self._side_clearances):
                warn_if_narrow(side_clearance, k, config)
        self._active = self._started(s.task.segment, corridor)

    def _started(self, segment: Segment, corridor: Corridor) -> _Active:
        config = segment.limited(self._settings)
        core = RtiMpcc(segment.part, corridor, config, index=segment.index)
        return self._beside(segment, core, corridor)

    def _beside(self, segment: Segment, core: RtiMpcc, corridor: Corridor) -> _Active:
        """With the room along the segment, beside the obstacles that are known now, and the pace by it."""
        index, config = segment.index, core.config
        beside = self._side_clearances[index]
        core.set_obstacles(corridor)
        core.side_clearance = with_obstacles(beside, core.part, corridor, index, config)
        profile = speed_profile_of(core.part, config, core.side_clearance)
        turns = segment.end is SegmentEnd.CUSP and segment.target is None and config.arrival
        cusp = cusp_pose(core.part.last, corridor, segment, config) if turns else None
        return _Active(segment=segment, mpcc=core, corridor=corridor, profile=profile, cusp=cusp)

    def core(self, s: ControllerState) -> RtiMpcc:
        """The core of the active segment, with the known obstacles."""
        if s.path is not self._path:
            self._onto(s)
        active, corridor = self._active, s.area.corridor
        if s.task.segment is not active.segment:
            self._active = self._started(s.task.segment, corridor)
        elif corridor is not active.corridor:
            self._active = self._beside(active.segment, active.mpcc, corridor)
        return self._active.mpcc

    def context(
        self, s: ControllerState, clock: CycleClock, start: Array | None = None
    ) -> tuple[ControllerState, PlanningContext]:
        """The state with the present target of its segment, and what a cycle plans in, from `start` (6,);
        None: from where its command starts to act."""
        mpcc, active = self.core(s), self._active
        target = _target(s, mpcc.part, active.cusp)
        if target != s.task.target:
            s = replace(s, task=replace(s.task, target=target))
        if start is None:
            start = start_of(s, mpcc.part, mpcc.config)
        return s, context_of(s, start, mpcc, active.profile, clock)


def _target(s: ControllerState, part: PathPart, cusp: Pose2 | None) -> Target:
    """The target of the active segment; `cusp`: where it is to change its direction, or None."""
    segment, goal = s.task.segment, s.goal.pose
    if segment.target is not None:
        return segment.target(part, goal)
    if segment.end is SegmentEnd.GOAL and goal is not None:
        return goal_on(part, goal, s.task.target)
    if cusp is None:
        return path_end(part)
    then = s.task.later[0]
    # Turning the wheels while driving costs heading at the end; a short segment mends little of it.
    share = min(min(segment.length, then.length) / WHOLE_TOLERANCE, 1.0) ** 2
    return ended_at(part, cusp, then.wheels, share)


def cusp_pose(cusp: Pose2, corridor: Corridor, segment: Segment, config: ControllerConfig) -> Pose2:
    """The pose at which a segment ends in a change of direction: nearest to `cusp`, with the margin kept on
    this part and on the next, or as much of it as there is within `CUSP_SHIFT` of the tolerance."""
    margin, index = config.clearance.wanted, segment.index
    if _side_clearance([cusp], corridor, index, config)[0] == margin:
        return cusp
    shifts = CUSP_SHIFT * np.multiply(segment.tolerance, _STEPS)
    poses = [cusp.compose(Pose2(*shift)) for shift in shifts.tolist()]
    side_clearance = _side_clearance(poses, corridor, index, config)
    return poses[int(np.argmax(side_clearance))]  # the first of equals is the nearest


def _side_clearance(poses: list[Pose2], corridor: Corridor, index: int, config: ControllerConfig) -> Array:
    """Clearance (n,) of the body [m] on the part and on the next one, as far as the margin counts it."""
    at, margin = np.array([(pose.x, pose.y, pose.phi) for pose in poses]), config.clearance.wanted
    both = [clearances(at, corridor, part, config.vehicle, margin) for part in (index, index + 1)]
    side_clearance: Array = np.minimum(np.concatenate(both, axis=1).min(axis=1), margin)
    return side_clearance
