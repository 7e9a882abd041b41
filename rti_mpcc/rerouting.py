"""When the way in an area is planned, and planned anew, slice by slice beside the control.

A controller that was given an area instead of a path knows no recovery of its own: where it cannot get on, it
asks for another way from where it is. While one is planned the vehicle stands, on a route of no length, or
makes for a stop from which it is planned.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from geometry import Area, Pose2, ReferencePath
from rti_mpcc.behaviour import moves
from rti_mpcc.config import ControllerConfig
from rti_mpcc.manoeuvre import Manoeuvre, PlanOutcome, Segment, SegmentEnd
from rti_mpcc.model.layout import PHI, X, Y
from rti_mpcc.planning.clock import CycleClock
from rti_mpcc.planning.schedule import apart
from rti_mpcc.planning.state import ControllerState, Phase
from rti_mpcc.route_planner.planner import RoutePlanning

NO_MANOEUVRE = 1.0
"""Length of the straight route that a vehicle stands on while it has no manoeuvre [m]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _Asked:
    """What a way is planned for: from where, to what goal, and after how many obstacle changes."""

    start: Pose2
    goal: Pose2
    changes: int

    def answers(self, other: _Asked, most: tuple[float, float, float]) -> bool:
        """Whether a way that was planned for this serves the other as well."""
        near = other.start.relative_to(self.start).within(most) and other.goal.relative_to(self.goal).within(
            most
        )
        return near and self.changes == other.changes


class Rerouter:
    """Plans the ways of one controller.

    Args:
        area: that it may drive in; config: its settings.
    """

    def __init__(self, area: Area, config: ControllerConfig) -> None:
        self._area, self._config = area, config
        self._asked: _Asked | None = None
        self._planning: RoutePlanning | None = None

    def forget(self) -> None:
        """Keep nothing of a search that is under way."""
        self._asked = self._planning = None

    def routed(self, s: ControllerState) -> ControllerState:
        """The state with another way, where one is needed and found, or without any, where one is needed."""
        if s.task.phase is not Phase.PLANNING:
            why = self._asks(s)
            if not why:
                return s
            s = moves.without_way(s, *standing_route(self._here(s)), why)
        elif apart(self._here(s), s.path.start) > self._config.plausibility.off_path:
            # It is first heard of there, or was set down: nothing would be driven so far off a route.
            s = moves.without_way(s, *standing_route(self._here(s)), s.route.why if s.route else "")
        return self._answered(s)

    def planned_on(self, s: ControllerState, clock: CycleClock) -> ControllerState:
        """Go on planning, with what time this cycle has left."""
        asked = self._needed(s)
        if asked is None:
            return s
        if self._asked is None or not self._asked.answers(asked, self._config.route.unmoved):
            known = self._area.with_obstacles([each.outline for each in s.area.standing])
            self._asked = asked
            self._planning = RoutePlanning(asked.start, asked.goal, known, self._config)
        planning = self._planning
        assert planning is not None
        before = planning.seconds
        slices = self._config.route.slices if s.is_stationary else 1
        for _ in range(slices):
            if planning.manoeuvre is not None or not clock.grants():
                break
            planning.advance()
        if planning.seconds == before:
            return s
        assert s.route is not None
        return replace(s, route=replace(s.route, seconds=s.route.seconds + planning.seconds - before))

    def _asks(self, s: ControllerState) -> str:
        """Why another way is needed, or ""."""
        route, task, settings = s.route, s.task, self._config.route
        assert route is not None
        goal, planned = s.goal.pose, route.manoeuvre
        if goal is not None and planned is not None and self._elsewhere(goal, planned.goal):
            return "the goal is elsewhere"
        if task.phase is Phase.HOLDING and task.stop is not None:
            return "something fills the way"
        if not s.vehicle.is_stationary(s.now, settings.replan_after) or self._was_asked(s):
            return ""
        if task.phase is Phase.STALLED:
            return "no plan from here ends inside the tolerance"
        if task.halt is not None:
            return "something is in the way"
        if task.phase is Phase.STARTING and task.latched:
            return task.latched
        return ""

    def _here(self, s: ControllerState) -> Pose2:
        """Where the vehicle is; of one that stands the mean of the last moments, for noise must not begin a
        search anew."""
        state, since = s.vehicle.monitor.state, s.vehicle.standing_since
        if state is None:
            return Pose2(0.0, 0.0, 0.0)
        here = Pose2(float(state[X]), float(state[Y]), float(state[PHI]))
        if since is None or s.vehicle.monitor.why:
            return here
        moments = s.now - self._config.goal_tracking.filter.history
        return s.vehicle.poses.mean(max(since, moments)) or here

    def _was_asked(self, s: ControllerState) -> bool:
        """Whether the way was planned from right here a moment ago: the same again would come of it."""
        route = s.route
        if route is None or route.manoeuvre is None or s.now - route.since >= self._config.route.again_after:
            return False
        here = self._here(s).relative_to(route.manoeuvre.start)
        return here.within(self._config.route.near) and route.changes == s.area.changes

    def _elsewhere(self, goal: Pose2, planned: Pose2) -> bool:
        position, heading = self._config.route.goal_moved
        off = goal.relative_to(planned)
        return apart(goal, planned) > position or abs(off.phi) > heading

    def _needed(self, s: ControllerState) -> _Asked | None:
        """What is to be planned for now; None: nothing.

        A vehicle that makes for a stop before something that fills its way will need another one from there.
        """
        goal, monitor = s.goal.pose, s.vehicle.monitor
        if goal is None or monitor.state is None or monitor.why:
            return None
        if s.task.phase is Phase.PLANNING:
            if not s.vehicle.is_stationary(s.now, self._config.dead_time):
                return None
            return _Asked(start=self._here(s), goal=goal, changes=s.area.changes)
        if s.task.stop is None:
            return None
        part = s.task.segment.part
        return _Asked(start=part.pose(min(s.task.stop.at, part.end)), goal=goal, changes=s.area.changes)

    def _answered(self, s: ControllerState) -> ControllerState:
        """Drive a way that was found for where the vehicle stands; say why there is none."""
        asked, route, settings = self._needed(s), s.route, self._config.route
        if asked is None or route is None:
            return s
        found = None if self._planning is None else self._planning.manoeuvre
        if asked.start.relative_to(asked.goal).within(self._config.goal_tolerance):
            found = _there(asked, self._config)
        elif found is None or self._asked is None or not self._asked.answers(asked, settings.near):
            return s
        told = replace(route, manoeuvre=found, changes=s.area.changes)
        if not found.found:
            return replace(s, route=replace(told, why=found.reason))
        self.forget()
        return moves.onto_way(s, found, replace(told, planned=route.planned + 1, why="", since=s.now))


def standing_route(here: Pose2) -> tuple[ReferencePath, tuple[Segment, ...]]:
    """A straight route where the vehicle stands: nothing is driven on it."""
    path = ReferencePath.from_segments(start=here, segments=[(1, 0.0, NO_MANOEUVRE)])
    return path, (Segment(part=path.parts[0], index=0, end=SegmentEnd.STOP),)


def _there(asked: _Asked, config: ControllerConfig) -> Manoeuvre:
    """The manoeuvre of a vehicle that stands in its goal: a straight one up to it, with nothing to drive."""
    begin = asked.goal.compose(Pose2(-NO_MANOEUVRE, 0.0, 0.0))
    (part,) = ReferencePath.from_segments(start=begin, segments=[(1, 0.0, NO_MANOEUVRE)]).parts
    segment = Segment(part=part, index=0, end=SegmentEnd.GOAL, tolerance=config.goal_tolerance)
    return Manoeuvre(
        start=asked.start, goal=asked.goal, outcome=PlanOutcome.FOUND, segments=(segment,), nearest=0.0
    )
