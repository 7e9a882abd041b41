"""Where the course ends, and the search for a first plan to there.

A segment that is blocked by a static obstacle ends in front of it, and the vehicle replans. A search takes
several cycles if the time of one is too short.
"""

from __future__ import annotations

from dataclasses import replace
from math import ceil, inf
from typing import NamedTuple

import numpy as np

from rti_mpcc.behaviour.transitions import SEEKING, onto_course, plan_found
from rti_mpcc.config import ControllerConfig
from rti_mpcc.manoeuvre import Manoeuvre
from rti_mpcc.model.layout import POSE, THETA, V
from rti_mpcc.ocp.targets import Target
from rti_mpcc.planning import route_start, schedule, search
from rti_mpcc.planning.context import PlanningContext
from rti_mpcc.planning.guess import along_course
from rti_mpcc.planning.schedule import TARGET_MOVED, apart
from rti_mpcc.planning.search import ITERATIONS, SqpResult
from rti_mpcc.planning.standstill import rest_speed
from rti_mpcc.planning.state import ControllerState, Phase, PlannedStop, SuspendedSearch
from rti_mpcc.planning.timing import estimated_docking_time
from rti_mpcc.planning.workspace import Workspace
from rti_mpcc.safety import collision_check
from rti_mpcc.safety.collision_check import nearest_object
from rti_mpcc.types import Array

NEAR_STOP = 0.2  # [m]; so near to a stop before an obstacle a vehicle stays where it is
SAME_STOP = 0.4  # [m]; a stop that moves by less stays
STOP_TOLERANCE = (0.2, 1.0, 0.5)  # longitudinal [m], lateral [m], heading [rad] at a stop
BLOCKED = "something blocks the route"
ACCEPTED_MISS = 1.5  # times the goal tolerance: a first plan that misses by less is driven
_INSTEAD = 1.2  # a planned route replaces the path if it takes at most this many times as long
OUT_OF_REACH = "the goal is out of reach from the path's last change of direction"


class Found(NamedTuple):
    """The result of a search: the state to drive it with, and the last attempt."""

    s: ControllerState
    attempt: SqpResult


# -- where the course ends ------------------------------------------------------------------------------


def on_course(s: ControllerState, context: PlanningContext, config: ControllerConfig) -> ControllerState:
    """With the course up to the first static obstacle that blocks it, if obstacles or target have changed."""
    task, target = s.task, s.task.target
    at_stop = task.stop is not None and task.phase in (Phase.SETTLING, Phase.HOLDING)
    if target is None or context.doubt or not (at_stop or task.phase in SEEKING):
        return s
    if s.plans.course is not None:
        changes, pose = s.plans.course
        if changes == s.area.changes and apart(pose, target.pose) <= TARGET_MOVED:
            return s
    s = replace(s, plans=replace(s.plans, course=(s.area.changes, target.pose)))
    stop = _blocked(s, context, target, config)
    if stop is None:
        return s if task.stop is None else onto_course(s, None, here=False)
    if task.stop is not None and abs(task.stop.at - stop.at) <= SAME_STOP:
        return s
    here = stop.at - float(context.state[THETA]) <= NEAR_STOP * config.size
    return onto_course(s, stop, here=here)


def _blocked(
    s: ControllerState, context: PlanningContext, target: Target, config: ControllerConfig
) -> PlannedStop | None:
    """The stop in front of the first static obstacle that the body on the course to the target touches."""
    if not (s.area.replaced or s.area.corridor.obstacles):
        return None
    states, segment = _ahead(s, context.state, target, config), s.task.segment
    first = collision_check.first_blocked(s, states, config)
    if first is None:
        return None
    x, y, phi = states[first, :POSE].tolist()
    begin, there = float(context.state[THETA]), segment.part.project(x, y, heading=phi)
    along, across, heading = STOP_TOLERANCE
    return PlannedStop(
        at=max(there - collision_check.stop_clearance(config), begin),
        tolerance=(config.size * along, config.size * across, heading),
        obstacle=str(nearest_object(states[first, :POSE], s.area, segment.index, config)),
    )


def _ahead(s: ControllerState, state: Array, target: Target, config: ControllerConfig) -> Array:
    """States (n, 6) on the course: on the driven plan, and from its end, or from `state`, to the target."""
    part, driven = s.task.segment.part, state[None]
    if s.task.drives and s.plans.driven is not None:
        _, driven = collision_check.bodies_along(s.plans.driven, config)
        state = driven[-1].copy()
        x, y, phi = state[:POSE].tolist()
        state[THETA] = part.project(x, y, heading=phi)
    left = target.theta - float(state[THETA])
    if left <= route_start.CHECK_SPACING:
        return driven
    bodies = min(ceil(left / route_start.CHECK_SPACING) + 1, collision_check.MOST_BODIES)
    ahead = along_course(part, target, state, np.linspace(0.0, left, bodies), config)
    return np.concatenate((driven, ahead))


# -- first plans ----------------------------------------------------------------------------------------


def first_plan(s: ControllerState, context: PlanningContext, w: Workspace) -> Found:
    """The first plan to the end of the course; a search that ran out of time is resumed.

    From rest, a route past what blocks the segment is asked for first; likewise one in place of a plan that
    may not be driven, or that misses the goal by more than `ACCEPTED_MISS`.
    """
    if s.task.stop is not None and s.is_stationary and _may_ask(s, w):
        return _requested(s, Found(s, SqpResult(solutions=(), problem=BLOCKED)), BLOCKED)
    started = s.plans.suspended
    s = schedule.scheduled(s, context, w.config)
    after, attempt = _from_guess(s, context, w)
    attempt = _unless_into_a_wall(after, attempt, w)
    found = Found(after if attempt.problem else plan_found(after), attempt)
    if attempt.out_of_time or not context.free or s.route is None or s.route.fixed:
        return found
    arrives = context.ends_at_goal and found.s.task.arrival is not None
    if arrives:
        found = _reaching(found, context, started, w)
        if found.attempt.out_of_time:
            return found._replace(s=s.suspending(found.s.plans.suspended))
    why = found.attempt.problem
    if arrives and not (why or search.reaches(found.attempt, context, ACCEPTED_MISS)):
        why = "the first plan misses the goal"
    return _requested(s, found, why) if why and _may_ask(s, w) else found


def _may_ask(s: ControllerState, w: Workspace) -> bool:
    """Whether another route from here may be asked for: none was a moment ago."""
    if s.route is None or s.route.fixed:
        return False
    return not route_start.was_searched(s, w.config) if s.is_stationary else route_start.on_the_move(s)


def _requested(s: ControllerState, found: Found, why: str) -> Found:
    """Ask for another route from here: at rest it is waited for, else what was found is driven meanwhile."""
    s = s.suspending(None) if s.is_stationary else found.s
    assert s.route is not None
    return found._replace(s=replace(s, route=replace(s.route, request=why)))


def ends_at_goal(s: ControllerState, context: PlanningContext, w: Workspace) -> bool | None:
    """Whether a first plan of the segment ends at the goal; None: no time to find out, or it is a cruise."""
    s = schedule.scheduled(s.suspending(None), context, w.config)
    if s.task.arrival is None:
        return None
    found = _reaching(_from_guess(s, context, w), context, None, w)
    if found.attempt.out_of_time:
        return None
    return search.reaches(found.attempt, context, ACCEPTED_MISS)


def _reaching(found: Found, context: PlanningContext, started: SuspendedSearch | None, w: Workspace) -> Found:
    """A first plan that misses the goal is iterated further, as many times again."""
    s, attempt = found
    before = 0 if started is None else started.iterations
    done = before + len(attempt.solutions)
    missed = attempt.fits and not search.reaches(attempt, context)
    if not (context.free and missed) or done >= 2 * ITERATIONS:
        return found
    start = replace(search.further(attempt), least=1, reaching=True)
    more = search.converge(w.mpcc, s, context, start, w.clock)
    attempt = replace(attempt.then(more), problem=more.problem, out_of_time=more.out_of_time)
    return Found(search.suspended(s.iterated(more.solved), context, attempt, before), attempt)


def _from_guess(s: ControllerState, context: PlanningContext, w: Workspace) -> Found:
    """Iterate from a first guess, or resume the suspended search."""
    guess, started = search.first_guess(w.mpcc, s, context), s.plans.suspended
    start = search.from_guess(guess) if started is None else search.resumed(started, guess)
    attempt = search.converge(w.mpcc, s, context, start, w.clock)
    return Found(search.suspended(s.iterated(attempt.solved), context, attempt), attempt)


def _unless_into_a_wall(s: ControllerState, attempt: SqpResult, w: Workspace) -> SqpResult:
    """From rest a plan that goes through a boundary is not started: it would only stop in front of it."""
    if attempt.problem or not attempt.corridor_infeasible or not s.is_stationary:
        return attempt
    distance = collision_check.distance_to_contact(s, attempt.plan, w.config)
    if distance == inf:
        return attempt
    obstacle = collision_check.object_ahead(s, attempt.plan, distance, w.config)
    return replace(
        attempt, problem=f"no plan from here stays clear: contact in {distance:.2f} m with {obstacle}"
    )


def reachability_is_due(s: ControllerState, config: ControllerConfig) -> bool:
    """Whether the last segment of a path is checked before its first: at rest, for a new goal. A goal beside
    the path's end can be out of reach from there."""
    route, goal, task, measured = s.route, s.goal_pose, s.task, s.vehicle.monitor.state
    if route is None or goal is None or measured is None:
        return False
    if s.on_planned_route or route.replan_reason or s.goal.rejected:
        return False
    stands = abs(float(measured[V])) <= rest_speed(config)
    begins = task.phase is Phase.STARTING and task.stop is None and len(task.segments) > 1
    if not (stands and begins and config.objective.arrives_at_goal):
        return False
    before = route.goal_checked
    return before is None or apart(goal, before) > config.size * route_start.GOAL_MOVED[0]


def takes_too_long(s: ControllerState, found: Manoeuvre, config: ControllerConfig) -> bool:
    """Whether a route for a goal out of reach takes too long to replace the path."""
    if s.route is None or s.route.replan_reason != OUT_OF_REACH:
        return False
    given = estimated_docking_time(s.path, config, s.goal_pose)
    return estimated_docking_time(found.path, config, found.goal) > _INSTEAD * given
