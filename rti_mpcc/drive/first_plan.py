"""The search for the first plan of a segment; it takes several cycles if the time of one is too short."""

from __future__ import annotations

from dataclasses import replace
from math import inf
from typing import NamedTuple

from rti_mpcc.config import ControllerConfig
from rti_mpcc.course import collision_check, route_start, schedule
from rti_mpcc.course.context import PlanningContext
from rti_mpcc.course.transitions import plan_found
from rti_mpcc.drive import search
from rti_mpcc.drive.search import ITERATIONS, SqpResult
from rti_mpcc.model.layout import V
from rti_mpcc.ocp.targets import apart
from rti_mpcc.state import ControllerState, Phase, SuspendedSearch
from rti_mpcc.world.goals import GOAL_MOVED

BLOCKED = "something blocks the route"
ACCEPTED_MISS = 1.5  # times the goal tolerance: a first plan that misses by less is driven


class Found(NamedTuple):
    """The result of a search: the state to drive it with, and the last attempt."""

    s: ControllerState
    attempt: SqpResult


def first_plan(s: ControllerState, context: PlanningContext) -> Found:
    """The first plan to the end of the course; a search that ran out of time is resumed.

    From rest, a route past what blocks the segment is asked for first; likewise one in place of a plan that
    may not be driven, or that misses the goal by more than `ACCEPTED_MISS`.
    """
    if s.task.stop is not None and s.vehicle.stands and _may_ask(s, context):
        return _requested(s, Found(s, SqpResult(solutions=(), problem=BLOCKED)), BLOCKED)
    started = s.plans.suspended
    s = schedule.scheduled(s, context)
    after, attempt = _from_guess(s, context)
    attempt = _unless_into_a_wall(after, attempt, context)
    found = Found(after if attempt.problem else plan_found(after), attempt)
    if attempt.out_of_time or not context.free or s.route is None or s.route.fixed:
        return found
    arrives = context.ends_at_goal and found.s.task.arrival is not None
    if arrives:
        found = _reaching(found, context, started)
        if found.attempt.out_of_time:
            return found._replace(s=s.suspending(found.s.plans.suspended))
    why = found.attempt.problem
    if arrives and not (why or search.reaches(found.attempt, context, ACCEPTED_MISS)):
        why = "the first plan misses the goal"
    return _requested(s, found, why) if why and _may_ask(s, context) else found


def _may_ask(s: ControllerState, context: PlanningContext) -> bool:
    """Whether another route from here may be asked for: none was a moment ago."""
    if s.route is None or s.route.fixed:
        return False
    return not route_start.was_searched(s, context.config) if s.vehicle.stands else route_start.on_the_move(s)


def _requested(s: ControllerState, found: Found, why: str) -> Found:
    """Ask for another route from here: at rest it is waited for, else what was found is driven meanwhile."""
    s = s.suspending(None) if s.vehicle.stands else found.s
    assert s.route is not None
    return found._replace(s=replace(s, route=replace(s.route, request=why)))


def ends_at_goal(s: ControllerState, context: PlanningContext) -> bool | None:
    """Whether a first plan of the segment ends at the goal; None: no time to find out, or it is a cruise."""
    s = schedule.scheduled(s.suspending(None), context)
    if s.task.arrival is None:
        return None
    found = _reaching(_from_guess(s, context), context, None)
    if found.attempt.out_of_time:
        return None
    return search.reaches(found.attempt, context, ACCEPTED_MISS)


def _reaching(found: Found, context: PlanningContext, started: SuspendedSearch | None) -> Found:
    """A first plan that misses the goal is iterated further, as many times again."""
    s, attempt = found
    before = 0 if started is None else started.iterations
    done = before + len(attempt.solutions)
    missed = attempt.fits and not search.reaches(attempt, context)
    if not (context.free and missed) or done >= 2 * ITERATIONS:
        return found
    start = replace(search.further(attempt), least=1, reaching=True)
    more = search.converge(s, context, start)
    attempt = replace(attempt.then(more), problem=more.problem, out_of_time=more.out_of_time)
    return Found(search.suspended(s.iterated(more.solved), context, attempt, before), attempt)


def _from_guess(s: ControllerState, context: PlanningContext) -> Found:
    """Iterate from a first guess, or resume the suspended search."""
    guess, started = search.first_guess(s, context), s.plans.suspended
    start = search.from_guess(guess) if started is None else search.resumed(started, guess)
    attempt = search.converge(s, context, start)
    return Found(search.suspended(s.iterated(attempt.solved), context, attempt), attempt)


def _unless_into_a_wall(s: ControllerState, attempt: SqpResult, context: PlanningContext) -> SqpResult:
    """From rest a plan that goes through a boundary is not started: it would only stop in front of it."""
    if attempt.problem or not attempt.corridor_infeasible or not s.vehicle.stands:
        return attempt
    distance = collision_check.distance_to_contact(s, attempt.plan, context.config)
    if distance == inf:
        return attempt
    obstacle = collision_check.object_ahead(s, attempt.plan, distance, context.config)
    return replace(
        attempt, problem=f"no plan from here stays clear: contact in {distance:.2f} m with {obstacle}"
    )


def reachability_is_due(s: ControllerState, config: ControllerConfig) -> bool:
    """Whether the last segment of a path is checked before its first: at rest, for a new goal. A goal beside
    the path's end can be out of reach from there."""
    route, task, measured = s.route, s.task, s.vehicle.monitor.state
    begins = task.phase is Phase.STARTING and task.stop is None and len(task.later) > 0
    if route is None or measured is None or not (begins and config.objective.arrives_at_goal):
        return False
    if s.on_planned_route or route.replan_reason or s.goal.rejected:
        return False
    goal, stands = s.goal_pose, abs(float(measured[V])) <= config.rest_speed
    if goal is None or not stands:
        return False
    before = route.goal_checked
    return before is None or apart(goal, before) > config.size * GOAL_MOVED[0]
