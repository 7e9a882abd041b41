"""What is made once for the active segment: its core, the clearance along it, its speed profile, its target.

A core is made anew for each segment. All else is a cache: the same state gives the same context.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np

from geometry import Corridor, PathPart, Pose2
from rti_mpcc.clock import CycleClock
from rti_mpcc.config import ControllerConfig
from rti_mpcc.controller import RtiMpcc
from rti_mpcc.course.context import PlanningContext, context_of, start_of
from rti_mpcc.course.speed_profile import ComfortSpeeds, speed_profile_of
from rti_mpcc.manoeuvre import WHOLE_TOLERANCE, Segment, SegmentEnd
from rti_mpcc.model.footprint import clearances
from rti_mpcc.ocp.side_clearance import side_clearance_along, with_obstacles
from rti_mpcc.ocp.targets import Target, ended_at, goal_on, path_end
from rti_mpcc.state import ControllerState
from rti_mpcc.types import Array
from rti_mpcc.world.surroundings import warn_if_narrow

CUSP_SHIFT = 0.7  # of the tolerance at a cusp: so far beside it may the pose be (docs/decisions/13-cusps.md)

_STEPS = sorted(product((0.0, -0.5, 0.5, -1.0, 1.0), repeat=3), key=np.linalg.norm)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Active:
    """A segment and its core, the corridor that this knows, and the pace by it."""

    segment: Segment
    mpcc: RtiMpcc
    corridor: Corridor
    profile: ComfortSpeeds


class Workspace:
    """Makes what each cycle plans in, and keeps what is the same as in the last one."""

    def __init__(self, s: ControllerState, config: ControllerConfig) -> None:
        self._settings = config
        self._onto(s)

    def _onto(self, s: ControllerState) -> None:
        """Onto the path of the state."""
        self._path, corridor, config = s.path, s.area.corridor, self._settings
        self._side_clearances = tuple(
            side_clearance_along(part, corridor, k, config) for k, part in enumerate(s.path.parts)
        )
        if corridor.area is None:
            for k, side_clearance in enumerate(self._side_clearances):
                warn_if_narrow(side_clearance, k, config)
        self._cusp_of: tuple[Segment, int, Pose2] | None = None
        self._active = self._started(s.task.segment, corridor)

    def _started(self, segment: Segment, corridor: Corridor) -> _Active:
        config = segment.limited(self._settings)
        core = RtiMpcc(segment.part, corridor, config, index=segment.index)
        return self._beside(segment, core, corridor)

    def _beside(self, segment: Segment, core: RtiMpcc, corridor: Corridor) -> _Active:
        """With the room along the segment, beside the obstacles that are known now, and the pace by it."""
        index, config = segment.index, core.config
        if core.part is self._path.parts[index]:
            side_clearance = with_obstacles(self._side_clearances[index], core.part, corridor, index, config)
        else:
            side_clearance = side_clearance_along(core.part, corridor, index, config)
        core.set_obstacles(corridor)
        core.side_clearance = side_clearance
        profile = speed_profile_of(core.part, config, core.side_clearance)
        return _Active(segment=segment, mpcc=core, corridor=corridor, profile=profile)

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

    def context(self, s: ControllerState, clock: CycleClock, start: Array | None = None) -> PlanningContext:
        """What a cycle plans in, from `start` (6,); None: from where its command starts to act."""
        mpcc = self.core(s)
        if start is None:
            start = start_of(s, mpcc.part, mpcc.config)
        return context_of(s, start, mpcc, self._active.profile, clock)

    def target(self, s: ControllerState) -> Target:
        """The target of the active segment."""
        part, end, goal = self.core(s).part, s.task.segment.end, s.goal.pose
        config = self._active.mpcc.config
        if s.task.segment.target is not None:
            return s.task.segment.target(part, goal)
        if end is SegmentEnd.GOAL and goal is not None:
            return goal_on(part, goal, s.task.target)
        if end is SegmentEnd.CUSP and config.arrival:
            then = s.task.later[0]
            # Turning the wheels while driving costs heading at the end; a short segment mends little of it.
            shorter = min(s.task.segment.length, then.length)
            share = min(shorter / WHOLE_TOLERANCE, 1.0) ** 2
            return ended_at(part, self._cusp(s, part), then.wheels, share)
        return path_end(part)

    def _cusp(self, s: ControllerState, part: PathPart) -> Pose2:
        segment, changes = s.task.segment, s.area.changes
        if self._cusp_of is None or self._cusp_of[0] is not segment or self._cusp_of[1] != changes:
            pose = cusp_pose(part.last, s.area.corridor, segment, self._active.mpcc.config)
            self._cusp_of = segment, changes, pose
        return self._cusp_of[2]


def cusp_pose(cusp: Pose2, corridor: Corridor, segment: Segment, config: ControllerConfig) -> Pose2:
    """The pose at which a segment ends in a change of direction: nearest to `cusp`, with the margin kept on
    this part and on the next, or as much of it as there is within `CUSP_SHIFT` of the tolerance."""
    margin, index = config.clearance.wanted, segment.index
    if _side_clearance([cusp], corridor, index, config)[0] == margin:
        return cusp
    poses = [
        cusp.compose(Pose2(*(CUSP_SHIFT * np.multiply(segment.tolerance, step)).tolist())) for step in _STEPS
    ]
    side_clearance = _side_clearance(poses, corridor, index, config)
    return poses[int(np.argmax(side_clearance))]  # the first of equals is the nearest


def _side_clearance(poses: list[Pose2], corridor: Corridor, index: int, config: ControllerConfig) -> Array:
    """Clearance (n,) of the body [m] on the part and on the next one, as far as the margin counts it."""
    at, margin = np.array([(pose.x, pose.y, pose.phi) for pose in poses]), config.clearance.wanted
    both = [clearances(at, corridor, part, config.vehicle, margin) for part in (index, index + 1)]
    side_clearance: Array = np.minimum(np.concatenate(both, axis=1).min(axis=1), margin)
    return side_clearance
