"""When the way in an area is planned, and planned anew, slice by slice beside the control.

A controller that was given an area instead of a path knows no recovery of its own: where it cannot get on, it
asks for another way from where it is. While one is planned the vehicle stands, on a route of no length.
"""

from __future__ import annotations

from dataclasses import replace

from geometry import Area, Pose2, ReferencePath
from rti_mpcc.behaviour import moves
from rti_mpcc.config import ControllerConfig
from rti_mpcc.manoeuvre import Segment, SegmentEnd
from rti_mpcc.model.layout import PHI, X, Y
from rti_mpcc.planning.clock import CycleClock
from rti_mpcc.planning.schedule import apart
from rti_mpcc.planning.state import ControllerState, Phase
from rti_mpcc.route_planner.planner import RoutePlanning

NO_MANOEUVRE = 1.0
"""Length of the straight route that a vehicle stands on while it has no manoeuvre [m]."""


class Rerouter:
    """Plans the ways of one controller.

    Args:
        area: that it may drive in; config: its settings.
    """

    def __init__(self, area: Area, config: ControllerConfig) -> None:
        self._area, self._config = area, config
        self._planning: RoutePlanning | None = None
        self._planned_from: tuple[Pose2, Pose2, int] | None = None

    def routed(self, s: ControllerState, clock: CycleClock) -> ControllerState:
        """The state with another way, if one was asked for and is found by now."""
        if s.task.phase is not Phase.PLANNING:
            why = self._asks(s)
            return s if not why else self._without_way(s, why)
        return self._advanced(s, clock)

    def forget(self) -> None:
        """Keep nothing of a search that is under way."""
        self._planning = self._planned_from = None

    def _asks(self, s: ControllerState) -> str:
        """Why another way is needed, or ""."""
        route, task, settings = s.route, s.task, self._config.route
        assert route is not None
        if route.manoeuvre is None:
            return ""
        goal = s.goal.pose
        if goal is not None and self._elsewhere(goal, route.manoeuvre.goal):
            return "the goal is elsewhere"
        if not s.vehicle.is_stationary(s.now, settings.replan_after):
            return ""
        if task.phase is Phase.STALLED:
            return "no plan from here ends inside the tolerance"
        if task.phase is Phase.HOLDING and task.stop is not None:
            return "something fills the way"
        if task.halt is not None:
            return "something is in the way"
        if task.phase is Phase.STARTING and task.latched:
            return task.latched
        return ""

    def _elsewhere(self, goal: Pose2, planned: Pose2) -> bool:
        position, heading = self._config.route.goal_moved
        off = goal.relative_to(planned)
        return apart(goal, planned) > position or abs(off.phi) > heading

    def _without_way(self, s: ControllerState, why: str) -> ControllerState:
        """The vehicle is to stand until there is another way."""
        self._planning = None
        return moves.without_way(s, *standing_route(_here(s)), why)

    def _advanced(self, s: ControllerState, clock: CycleClock) -> ControllerState:
        """Go on planning; drive what is found."""
        route, goal = s.route, s.goal.pose
        assert route is not None
        if goal is None or s.vehicle.monitor.state is None or not s.is_stationary or s.vehicle.monitor.why:
            return s
        here = _here(s)
        asked = here, goal, s.area.changes
        if self._planned_from is None or self._moved(asked, self._planned_from):
            if not s.vehicle.is_stationary(s.now, self._config.dead_time):
                return s
            self._planned_from = asked
            known = self._area.with_obstacles([each.outline for each in s.area.standing])
            self._planning = RoutePlanning(here, goal, known, self._config)
        planning = self._planning
        if planning is None:
            return s  # what there was to find is known
        for _ in range(self._config.route.slices):
            if planning.manoeuvre is not None or not clock.grants():
                break
            planning.advance()
        found = planning.manoeuvre
        if found is None:
            return s
        self._planning = None
        told = replace(
            route,
            manoeuvre=found,
            seconds=route.seconds + planning.seconds,
            changes=s.area.changes,
            since=s.now,
        )
        if not found.found:
            return replace(s, route=replace(told, why=found.reason))
        self._planned_from = None
        return moves.onto_way(s, found, replace(told, planned=route.planned + 1, why=""))

    def _moved(self, now: tuple[Pose2, Pose2, int], before: tuple[Pose2, Pose2, int]) -> bool:
        """Whether what is planned for has changed by more than it is known."""
        least = self._config.route.unmoved
        start, goal = now[0].relative_to(before[0]), now[1].relative_to(before[1])
        still = start.within((least, least, least)) and goal.within((least, least, least))
        return not still or now[2] != before[2]


def standing_route(here: Pose2) -> tuple[ReferencePath, tuple[Segment, ...]]:
    """A straight route where the vehicle stands: nothing is driven on it."""
    path = ReferencePath.from_segments(start=here, segments=[(1, 0.0, NO_MANOEUVRE)])
    return path, (Segment(part=path.parts[0], index=0, end=SegmentEnd.STOP),)


def _here(s: ControllerState) -> Pose2:
    state = s.vehicle.monitor.state
    if state is None:
        return Pose2(0.0, 0.0, 0.0)
    return Pose2(float(state[X]), float(state[Y]), float(state[PHI]))
