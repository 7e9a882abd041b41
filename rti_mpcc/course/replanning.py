"""When the vehicle replans, slice by slice beside the control.

A vehicle that is blocked asks for another route in the known area: the given one, or all parts of the
corridor along its path, with their open ends. In an area it stands meanwhile on a route of no length; on a
given path it stays on that. One that still drives, to a stop or along a plan that misses its goal, asks for a
route from where it will be soon, to join it without a stop; if that comes too late, from where it will stand.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import tan

import numpy as np

from geometry import Area, Pose2
from geometry.area import with_checked
from rti_mpcc.clock import CycleClock
from rti_mpcc.config import ControllerConfig
from rti_mpcc.course import route_start
from rti_mpcc.course.conditions import SETTLE_SHARE
from rti_mpcc.course.context import OFF_PATH
from rti_mpcc.course.docking_time import estimated_docking_time
from rti_mpcc.course.route_start import OUT_OF_REACH
from rti_mpcc.course.transitions import onto_route, without_route
from rti_mpcc.manoeuvre import Manoeuvre
from rti_mpcc.model.layout import DELTA, PHI, V, X, Y
from rti_mpcc.ocp.horizon import states_at
from rti_mpcc.ocp.objectives import apart
from rti_mpcc.route_planner.planner import RoutePlanning
from rti_mpcc.route_planner.problem import RouteProblem
from rti_mpcc.state import ControllerState, Phase, RouteState
from rti_mpcc.world import goal_setpoint
from rti_mpcc.world.goals import GOAL_MOVED
from rti_mpcc.world.obstacles import MOVED, obstacles_changed
from rti_mpcc.world.surroundings import Surroundings

_REPLAN_AFTER = 1.0  # [s] at rest after which a blocked vehicle asks for another route
_UNMOVED = (0.03, 0.03, 0.03)
"""Planning goes on while vehicle and goal moved by less: longitudinal [m], lateral [m], heading [rad]."""
_PATIENCE = 1.0  # [s] that a search lasts at least although obstacles change; after each lost one twice that
_JOIN_AFTER = 1.0  # [s] ahead of the vehicle, where a route that is joined without a stop starts
_SLICES = 3  # of planning in one cycle, at most
_SLICES_AT_REST = 9  # of a vehicle that stands and waits for its route
INSTEAD = 1.2  # a planned route replaces the path if it takes at most this many times as long


@dataclass(frozen=True, slots=True, kw_only=True)
class ReplanRequest:
    """A request for a route.

    Attributes:
        start, goal: poses; area: with the known obstacles.
        at: when the vehicle will be at the start, and drive [s]; None: it will stand there.
        after: time from the request until then [s].
        incoming: direction, +1 or -1, and curvature [1/m] there; 0, 0 at rest.
        stopping: distance of a stop in comfort from there [m].
    """

    start: Pose2
    goal: Pose2
    area: Surroundings
    at: float | None = None
    after: float = 0.0
    incoming: tuple[float, float] = (0.0, 0.0)
    stopping: float = 0.0

    def matches(self, other: ReplanRequest, most: tuple[float, float, float]) -> bool:
        """Whether a route for this request begins and ends where one for the other does, to within `most`."""
        near = other.start.relative_to(self.start).within(most)
        both = (self.at is None) == (other.at is None)
        return near and both and self.is_for(other.goal, most)

    def is_joined_by(self, found: Manoeuvre) -> bool:
        """Whether a vehicle that drives there can join the route, and brake in comfort on it."""
        if not found.found:
            return False
        first = found.segments[0].part
        return first.direction == self.incoming[0] and first.end - first.start >= self.stopping

    def is_for(self, goal: Pose2, most: tuple[float, float, float]) -> bool:
        """Whether the goal is the same to within `most`."""
        return goal.relative_to(self.goal).within(most)

    def has_changed(self, area: Surroundings, most: float) -> bool:
        """Whether static obstacles are elsewhere by more than `most` [m] than they were for this request."""
        if self.area.changes == area.changes:
            return False
        return obstacles_changed(self.area.tracked.standing, area.tracked.standing, most)


class Replanner:
    """Plans the routes of one controller in its area."""

    def __init__(self, area: Area, config: ControllerConfig) -> None:
        self._area, self._config = area, config
        self._request: ReplanRequest | None = None
        self._planning: RoutePlanning | None = None
        self._outdated = self._near = False  # the area has changed since the search began, and near it
        self._since, self._patience = 0.0, _PATIENCE  # [s] when it began, and how long it lasts at least

    def __getstate__(self) -> dict[str, object]:
        """All but the search, which a copy starts again."""
        fresh = {"_request": None, "_planning": None, "_outdated": False, "_near": False}
        return {**self.__dict__, **fresh}

    def forget(self) -> None:
        """Drop the search."""
        self._request = self._planning = None
        self._outdated = self._near = False

    def in_another(self, s: ControllerState, area: Area) -> ControllerState:
        """The state in another area; what differs by `MOVED` at most is no change.

        A search continues if nothing has changed near the straight line from its start to its goal, or else
        for a while, see `planned_on`. So a map that flickers elsewhere ends no search.
        """
        least, before = MOVED, self._area
        changes = area.solid_beside(before, least) + before.solid_beside(area, least)
        if not changes:
            return s
        self._area = area
        request, found = self._request, None if self._planning is None else self._planning.manoeuvre
        if found is not None and not found.found:
            self.forget()
        elif request is not None:
            between = route_start.are_between(request.start, request.goal, changes, self._config)
            self._outdated, self._near = True, self._near or between
        return replace(s, area=s.area.in_another(area))

    def routed(self, s: ControllerState) -> ControllerState:
        """The state with another route, if one is needed and found, or without any, if one is needed."""
        route = s.route
        assert route is not None
        if s.task.phase is Phase.WAITING or route.fixed:
            return s
        if s.task.phase is Phase.PLANNING:
            here = route_start.here(s, self._config)
            if apart(here, s.path.start) > OFF_PATH:
                # It is first measured there, or was relocated: nothing would be driven so far off a route.
                s = without_route(s, here, route.replan_reason)
        elif (why := self._replan_reason(s)) and s.on_planned_route:
            s = without_route(s, route_start.here(s, self._config), why)
        else:
            wanted = route.request if why or s.task.drives else ""
            if (why, wanted) != (route.replan_reason, route.request):
                s = replace(s, route=replace(route, replan_reason=why, request=wanted))
        return s if self._planning is None else self._with_result(s)

    def area_known(self, s: ControllerState) -> Area:
        """The area with all known static obstacles."""
        return with_checked(self._area, [each.checked for each in s.area.tracked.standing])

    def leaving(self, s: ControllerState, why: str) -> ControllerState:
        """The state of a vehicle that leaves its route and replans in all of the area."""
        self.forget()
        s = replace(s, area=s.area.without_path(self._area))
        return without_route(s, route_start.here(s, self._config), why)

    def following(self, s: ControllerState, manoeuvre: Manoeuvre) -> ControllerState:
        """The state of a vehicle that leaves its route for a manoeuvre, which is not replaced."""
        s = self.leaving(s, "")
        assert s.route is not None
        route = replace(s.route, manoeuvre=manoeuvre, routes=s.route.routes + 1, fixed=True)
        return onto_route(s, manoeuvre, route)

    def planned_on(self, s: ControllerState, clock: CycleClock) -> ControllerState:
        """Plan with the time that this cycle has left.

        A search that what has changed makes doubtful is finished if that takes no longer than its patience,
        which doubles with each one that did not: a flicker cannot keep all of them from their ends. A route
        has to be clear of what is known when it is found.
        """
        request, route = self._needed(s), s.route
        if request is None or route is None:
            return s
        last, patient = self._request, s.clock.now - self._since < self._patience
        if last is None or not last.matches(request, _UNMOVED):
            self._patience = _PATIENCE
            self._begin(request, s, route)
        elif not patient and (self._near or last.has_changed(s.area, self._config.clearance.wanted + MOVED)):
            self._patience *= 2.0
            self._begin(request, s, route)
        planning = self._planning
        assert planning is not None
        before = planning.seconds
        wanted = route.request != "" and s.task.phase is Phase.STARTING and s.vehicle.stands
        waits = wanted or s.task.phase in (Phase.PLANNING, Phase.STALLED)
        slices: float = _SLICES_AT_REST if waits else _SLICES
        while slices > 0 and planning.manoeuvre is None:
            if not clock.grants(planning.longest):
                planning.waited()
                break
            slices -= planning.advance()
        if planning.seconds == before:
            return s
        return replace(s, route=replace(route, seconds=route.seconds + planning.seconds - before))

    def _begin(self, request: ReplanRequest, s: ControllerState, route: RouteState) -> None:
        self.forget()
        self._request, self._since = request, s.clock.now
        # A vehicle that has driven and asks is not well inside: it has to get there.
        there = SETTLE_SHARE if route.routes > 0 else 1.0
        config, known = s.goal.terms.on(self._config), self.area_known(s)
        keep_out = [np.array(each) for each in s.goal.terms.keep_out if s.goal.detected is None]
        start, goal = request.start, request.goal
        problem = RouteProblem.of(start, goal, known, config, request.incoming, keep_out)
        self._planning = RoutePlanning(problem, there)

    def _replan_reason(self, s: ControllerState) -> str:
        """Why another route is needed, or ""."""
        route, task = s.route, s.task
        assert route is not None
        if s.goal.rejected:
            return ""
        if route.request and task.phase is Phase.STARTING and s.vehicle.stands:
            return route.request
        if s.on_planned_route and route.manoeuvre is not None and self._has_moved(s, route.manoeuvre.goal):
            return "the goal has moved"
        blocked = task.phase is Phase.HOLDING and task.stop is not None
        waits = blocked or s.vehicle.is_stationary(s.clock.now, _REPLAN_AFTER)
        if not waits or route_start.was_searched(s, self._config):
            return ""
        if blocked:
            return "something blocks the route"
        if task.phase is Phase.STALLED:
            return "no plan from here ends inside the tolerance"
        if task.yielding is not None:
            return "an obstacle is on the route"
        if task.phase is Phase.STARTING and task.stop_reason:
            return task.stop_reason
        return ""

    def _has_moved(self, s: ControllerState, planned: Pose2) -> bool:
        """Whether the goal is another one than `planned`, and not one that is waited for until it stands."""
        goal, (position, heading) = s.goal_pose, GOAL_MOVED
        if goal is None or goal_setpoint.waits_for_dock(s.goal, self._config):
            return False
        off = goal.relative_to(planned)
        return apart(goal, planned) > self._config.size * position or abs(off.phi) > heading

    def _needed(self, s: ControllerState) -> ReplanRequest | None:
        monitor, route = s.vehicle.monitor, s.route
        if route is None or route.fixed or s.goal.rejected or s.task.phase is Phase.WAITING:
            return None
        # A search continues while the vehicle stands, and its route is driven if it is asked for again.
        started = self._planning is not None and s.task.phase is not Phase.HOLDING
        stuck = (route.replan_reason or (started and s.vehicle.stands)) and not s.on_planned_route
        waits = s.task.phase is Phase.PLANNING or stuck
        if not waits and not (s.task.drives and (s.task.stop is not None or route.request)):
            return None
        goal = s.goal_pose
        if goal is None or monitor.state is None or monitor.doubt:
            return None
        if waits:
            if not s.vehicle.is_stationary(s.clock.now, s.vehicle.dead_time):
                return None
            return ReplanRequest(start=route_start.here(s, self._config), goal=goal, area=s.area)
        return self._ahead(s, goal)

    def _ahead(self, s: ControllerState, goal: Pose2) -> ReplanRequest | None:
        """From where the vehicle will be soon, or will stand."""
        last, config, stop = self._request, self._config, s.task.stop
        margin = config.clearance.wanted
        if last is not None and last.is_for(goal, _UNMOVED) and not last.has_changed(s.area, margin):
            if last.at is not None and s.clock.now <= last.at:
                return last
            # The route came too late: once more with twice the time, if the vehicle drives by then.
            request = None if last.at is None else _driving(s, goal, 2.0 * last.after, config)
        else:
            request = _driving(s, goal, _JOIN_AFTER, config) if route_start.on_the_move(s) else None
        if request is not None:
            return request
        if stop is None:
            return None
        part = s.task.segment.part
        return ReplanRequest(start=part.pose(min(stop.at, part.end)), goal=goal, area=s.area)

    def _with_result(self, s: ControllerState) -> ControllerState:
        """With the route that was found for where the vehicle is, or the reason why there is none."""
        found = None if self._planning is None else self._planning.manoeuvre
        last, route, config = self._request, s.route, self._config
        if found is None or route is None or last is None:
            return s
        if self._outdated or last.has_changed(s.area, config.clearance.wanted):
            if not (found.found and route_start.is_clear(found, self.area_known(s), config)):
                self.forget()
                return s
            self._outdated = self._near = False
        request = self._needed(s)
        if request is None or not last.matches(request, route_start.near_enough(config)):
            return s
        planning = s.task.phase is Phase.PLANNING
        updated = replace(route, manoeuvre=found, changes=s.area.changes)
        if request.at is not None:
            # Once its own time has come.
            there = s.clock.now + s.vehicle.dead_time >= request.at - 0.5 * config.cycle
            if not (there and request.is_joined_by(found)):
                return s
        elif not (planning or route.replan_reason):
            return s  # it is still on its way to where that would begin
        elif not found.found:
            since = route.since if planning else s.clock.now
            why = found.reason if planning else ""
            return replace(s, route=replace(updated, replan_reason=why, request="", since=since))
        elif _takes_too_long(s, found, config):
            self.forget()
            return replace(s, route=replace(route, replan_reason="", request=""))
        self.forget()
        s = replace(s, area=s.area.without_path(self._area))
        updated = replace(updated, routes=route.routes + 1, replan_reason="", request="", since=s.clock.now)
        return onto_route(s, found, updated)


def _driving(s: ControllerState, goal: Pose2, after: float, config: ControllerConfig) -> ReplanRequest | None:
    """From where the driven plan will be in `after` [s]; None: it stands there."""
    plan, at = s.plans.driven, s.clock.now + after
    if plan is None or at >= plan.times[-1]:
        return None
    state = states_at(plan, np.array([at]), config.vehicle.wheelbase)[0]
    speed = abs(float(state[V]))
    if speed <= config.moving_speed:
        return None
    start = Pose2(float(state[X]), float(state[Y]), float(state[PHI]))
    direction = 1.0 if state[V] > 0.0 else -1.0
    curvature = tan(float(state[DELTA])) / config.vehicle.wheelbase
    return ReplanRequest(
        start=start,
        goal=goal,
        area=s.area,
        at=at,
        after=after,
        incoming=(direction, curvature),
        stopping=speed**2 / (2.0 * config.comfort_acceleration),
    )


def _takes_too_long(s: ControllerState, found: Manoeuvre, config: ControllerConfig) -> bool:
    """Whether a route for a goal out of reach takes too long to replace the path."""
    if s.route is None or s.route.replan_reason != OUT_OF_REACH:
        return False
    given = estimated_docking_time(s.path, config, s.goal_pose)
    return estimated_docking_time(found.path, config, found.goal) > INSTEAD * given
