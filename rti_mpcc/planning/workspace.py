"""What a cycle works with on the active leg: its core, what is around it, and what time decides.

A core is made anew for each leg, with nothing kept of the last one's solutions. All else here is a cache: the
same state always gives the same workspace.
"""

from __future__ import annotations

from dataclasses import dataclass

from geometry import Corridor, PathPart, Pose2, ReferencePath
from rti_mpcc.config import ControllerConfig, Method
from rti_mpcc.controller import RtiMpcc
from rti_mpcc.ocp.room import room_along, with_obstacles
from rti_mpcc.ocp.targets import Target, ended_at, goal_on, path_end, stop_on
from rti_mpcc.planning import sensing
from rti_mpcc.planning.clock import CycleClock
from rti_mpcc.planning.context import PlanningContext
from rti_mpcc.planning.cusp import cusp_pose
from rti_mpcc.planning.legs import staging_stop
from rti_mpcc.planning.pace import Pace, pace_of
from rti_mpcc.planning.state import ControllerState, Leg
from rti_mpcc.planning.surroundings import tell_if_narrow
from rti_mpcc.types import Array


@dataclass(frozen=True, slots=True, kw_only=True)
class Workspace:
    """What the functions of a cycle share.

    Attributes:
        config: settings; mpcc: the core of the leg; pace: of the leg.
        last_part: whether the leg is the route's last part.
        to_staging: whether it is to end at a staging pose on that, before the last leg to the goal pose.
        start: state (6,) where the command of this cycle begins to act.
        clock: what time decides in this cycle.
    """

    config: ControllerConfig
    mpcc: RtiMpcc
    pace: Pace
    last_part: bool
    to_staging: bool
    start: Array
    clock: CycleClock

    def context(self, s: ControllerState) -> PlanningContext:
        """The start against what the vehicle is to end in: a stop before something, or the leg's target."""
        part, task = self.mpcc.part, s.task
        assert task.target is not None
        target = task.target if task.stop is None else stop_on(part, task.stop.at)
        return sensing.context_of(
            s,
            self.start,
            part,
            self.pace,
            target,
            self.config,
            last_part=self.last_part and not self.to_staging,
        )


class Workspaces:
    """Makes the workspace of each cycle, and keeps what is the same as in the last one.

    Args:
        path: the route; corridor: its boundaries and obstacles; config: settings.
    """

    def __init__(self, path: ReferencePath, corridor: Corridor, config: ControllerConfig) -> None:
        self._path, self._config = path, config
        self._rooms = tuple(room_along(part, corridor, k, config) for k, part in enumerate(path.parts))
        for k, room in enumerate(self._rooms):
            tell_if_narrow(room, k, config)
        self._cusp_of: tuple[int, int, Pose2] | None = None
        self._begin(Leg(), corridor)

    def _begin(self, leg: Leg, corridor: Corridor) -> None:
        self._leg = leg
        self._mpcc = RtiMpcc(self._part(leg), corridor, self._config, index=leg.part)
        self._look_round(corridor)

    def _look_round(self, corridor: Corridor) -> None:
        """The room along the leg, beside the obstacles that are known now, and the pace by it."""
        core, leg, config = self._mpcc, self._leg, self._config
        if leg.pull_out is not None:
            room = room_along(core.part, corridor, leg.part, config)
        else:
            room = with_obstacles(self._rooms[leg.part], core.part, corridor, leg.part, config)
        core.set_obstacles(corridor)
        core.set_room(room if config.corridor_rows else None)
        self._corridor, self._pace = corridor, pace_of(core.part, config, core.room)

    def core(self, s: ControllerState) -> RtiMpcc:
        """The core of the active leg, told of the obstacles that are known now."""
        if s.task.leg != self._leg:
            self._begin(s.task.leg, s.area.corridor)
        elif s.area.corridor is not self._corridor:
            self._look_round(s.area.corridor)
        return self._mpcc

    def of(self, s: ControllerState, clock: CycleClock) -> Workspace:
        """The workspace of a cycle in which the state is `s`."""
        mpcc = self.core(s)
        return Workspace(
            config=self._config,
            mpcc=mpcc,
            pace=self._pace,
            last_part=self._on_last_part(s),
            to_staging=self._to_staging(s),
            start=sensing.start_of(s, mpcc.part, self._config),
            clock=clock,
        )

    def target(self, s: ControllerState) -> Target:
        """What the active leg is to end in: the goal, a staging pose, a cusp, or the end of a way back."""
        part, leg = self.core(s).part, s.task.leg
        if self._to_staging(s):
            return stop_on(part, staging_stop(part, s.goal.pose, self._config))
        if self._on_last_part(s):
            goal = s.goal.pose
            return path_end(part) if goal is None else goal_on(part, goal, s.task.target)
        if leg.pull_out is None and self._config.arrival:
            return ended_at(part, self._cusp(s, part))
        return path_end(part)

    def _part(self, leg: Leg) -> PathPart:
        part = self._path.parts[leg.part]
        return part if leg.pull_out is None else part.driven_back(leg.pull_out.begin, leg.pull_out.end)

    def _cusp(self, s: ControllerState, part: PathPart) -> Pose2:
        """Where the direction is to change, clear of what is known now."""
        index, changes = s.task.leg.part, s.area.changes
        if self._cusp_of is None or self._cusp_of[:2] != (index, changes):
            pose = cusp_pose(part.last, s.area.corridor, index, self._config)
            self._cusp_of = index, changes, pose
        return self._cusp_of[2]

    def _on_last_part(self, s: ControllerState) -> bool:
        return s.task.leg.part == len(self._path.parts) - 1 and s.task.leg.pull_out is None

    def _to_staging(self, s: ControllerState) -> bool:
        """Whether the vehicle is to stop on the path before the last leg, to the goal pose, begins."""
        separated = self._config.method is Method.SEPARATED
        return separated and self._on_last_part(s) and not s.task.cartesian
