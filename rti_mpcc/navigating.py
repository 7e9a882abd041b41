"""Navigator: where on the route the vehicle is, what its part is to end in, and what is in the way."""

from __future__ import annotations

from math import inf

import numpy as np

from geometry import Corridor, HalfPlanes, Pose2, ReferencePath
from rti_mpcc.config import ControllerConfig, Method
from rti_mpcc.controller import RtiMpcc
from rti_mpcc.ocp.room import room_along, with_obstacles
from rti_mpcc.planning import legs, route, sensing, stops
from rti_mpcc.planning.cusp import cusp_pose
from rti_mpcc.planning.memory import ControllerMemory, PlanningContext, PullOut, renewed
from rti_mpcc.planning.pace import pace_of
from rti_mpcc.planning.plausibility import by_commands
from rti_mpcc.planning.surroundings import Surroundings, tell_if_narrow
from rti_mpcc.safety import contact
from rti_mpcc.safety.contact import Overlap
from rti_mpcc.types import Trajectory


class Navigator:
    """Knows the route, what is around, and what was done in the last cycle.

    Args:
        path: the route; corridor: its boundaries and obstacles; config: settings.

    Raises:
        CorridorError: the corridor is narrower than the body.
    """

    def __init__(self, path: ReferencePath, corridor: Corridor, config: ControllerConfig) -> None:
        self.path = path
        self.config = config
        self._surroundings = Surroundings.of(corridor, path, config)
        self._rooms = tuple(room_along(part, corridor, k, config) for k, part in enumerate(path.parts))
        for k, room in enumerate(self._rooms):
            tell_if_narrow(room, k, config)
        self._memory = ControllerMemory()
        self._cusp_of: tuple[int, int, Pose2] | None = None
        self._begin_leg()

    def _begin_leg(self) -> None:
        """The core for the active part, or for the way back along it."""
        index, back = self._memory.part, self._memory.pull_out
        part = self.path.parts[index]
        if back is not None:
            part = part.driven_back(back.begin, back.end)
        self._mpcc = RtiMpcc(part, self._surroundings.corridor, self.config, index=index)
        self._look_round()

    def _look_round(self) -> None:
        """The room along the active part, beside the obstacles that are known now, and the pace by it."""
        core, corridor, config = self._mpcc, self._surroundings.corridor, self.config
        if self._memory.pull_out is not None:
            room = room_along(core.part, corridor, core.index, config)
        else:
            room = with_obstacles(self._rooms[core.index], core.part, corridor, core.index, config)
        core.set_obstacles(corridor)
        core.set_room(room if config.corridor_rows else None)
        self._pace = pace_of(core.part, config, core.room)

    def _next_leg(self, situation: PlanningContext) -> ControllerMemory | None:
        """The memory with which another part begins now, or a way back; None: this one goes on."""
        memory = self._memory
        if legs.has_pulled_out(memory, situation, self.config.dead_time):
            return legs.coming_again(memory, situation)
        if memory.pull_out is None and legs.may_change_direction(memory, situation, self.config.dead_time):
            return legs.next_leg(memory, staged=self._to_staging)
        way = self._way_back(situation)
        if way is not None and route.is_stationary(memory, situation, self.config.dead_time):
            return legs.pulling_out(memory, situation, way)
        return None

    def _way_back(self, situation: PlanningContext) -> PullOut | None:
        return legs.way_back(self._memory, situation, self._mpcc.part, self.config)

    def _aim(self) -> None:
        """Give the core what the active part is to end in: a stop, its own end, or the goal."""
        if self._way_may_be_free() and not route.drives(self._memory):
            self._memory = renewed(legs.released(self._memory), looks_past=True)
        if self._memory.stop is not None:
            self._mpcc.set_stop(self._memory.stop.at)
        elif self._to_staging:
            self._mpcc.set_stop(legs.staging_stop(self._mpcc.part, self._memory.goal, self.config))
        elif self._on_last_part:
            self._mpcc.set_goal(self._memory.goal)
        elif self._memory.pull_out is None and self.config.arrival:
            self._mpcc.set_end(self._cusp())
        else:
            self._mpcc.set_goal(None)

    def _cusp(self) -> Pose2:
        """Where the direction is to change, clear of what is known now."""
        index, changes = self._memory.part, self._surroundings.changes
        if self._cusp_of is None or self._cusp_of[:2] != (index, changes):
            pose = cusp_pose(self._mpcc.part.last, self._surroundings.corridor, index, self.config)
            self._cusp_of = index, changes, pose
        return self._cusp_of[2]

    def _way_may_be_free(self) -> bool:
        return stops.way_may_be_free(self._memory, self._memory.now, self._surroundings.changes)

    @property
    def _on_last_part(self) -> bool:
        return self._memory.part == len(self.path.parts) - 1 and self._memory.pull_out is None

    @property
    def _to_staging(self) -> bool:
        """Whether the vehicle is to stop on the path before the last leg, to the goal pose, begins."""
        separated = self.config.method is Method.SEPARATED
        return separated and self._on_last_part and not self._memory.cartesian

    def _assess(self) -> PlanningContext:
        return sensing.situation_of(
            self._memory,
            self._mpcc.part,
            self._pace,
            self._mpcc.target,
            self.config,
            last_part=self._on_last_part and not self._to_staging,
        )

    def _way_to_contact(
        self, plan: Trajectory, reach: float, planes: HalfPlanes | None = None, least: float = 0.0
    ) -> float:
        """Way along a plan to where it is nearer than `least` to what stands [m], or inf.

        Far ahead stages are long: a plan that is sought has to touch nothing, one that is driven to be clear.

        `planes`: of its solution, if it is one's.
        """
        corridor, part, config = self._surroundings.corridor, self._memory.part, self.config
        if contact.surely_clear(plan, planes, corridor, part, config, reach, least=least):
            return inf
        free = planes is not None
        return contact.way_to_contact(plan, corridor, part, config, reach, least=least, begins_free=free)

    def _overlap(self, situation: PlanningContext) -> Overlap | None:
        """What the body overlaps, where it is believed to be now or until the command begins to act."""
        memory, around, config = self._memory, self._surroundings, self.config
        believed = memory.monitor.state
        if believed is None:
            return None
        half = memory.now + 0.5 * config.dead_time
        middle = by_commands(believed, memory.queue, memory.now, half, config, memory.disturbance)
        states = np.stack((believed, middle, situation.state))
        planes = None if memory.solution is None else memory.solution.planes
        if not around.moving and contact.bodies_surely_clear(
            states, planes, around.corridor, memory.part, config
        ):
            return None
        return contact.overlap(states, around, memory.part, config)
