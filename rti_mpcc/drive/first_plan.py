"""The search for the first plan of a segment; it takes several cycles if the time of one is too short."""

from __future__ import annotations

from dataclasses import replace

from rti_mpcc.config import ControllerConfig
from rti_mpcc.course import route_start, schedule
from rti_mpcc.course.context import PlanningContext
from rti_mpcc.course.transitions import plan_found
from rti_mpcc.drive import search
from rti_mpcc.drive.search import ITERATIONS, SqpResult
from rti_mpcc.manoeuvre import SegmentEnd
from rti_mpcc.model.layout import V
from rti_mpcc.ocp.objectives import apart
from rti_mpcc.state import ControllerState, SuspendedSearch
from rti_mpcc.world.goals import GOAL_MOVED

BLOCKED = "something blocks the route"
ACCEPTED_MISS = 1.5  # times the goal tolerance: a first plan that misses by less is driven


Found = tuple[ControllerState, SqpResult]
"""The result of a search: the state to drive it with, and the last attempt."""


def first_plan(s: ControllerState, context: PlanningContext) -> Found:
    """The first plan to the end of the course; a search that ran out of time is resumed.

    From rest, a route past what blocks the segment is asked for first; likewise one in place of a plan that
    may not be driven, or that misses the goal by more than `ACCEPTED_MISS`.
    """
    if s.task.stop is not None and s.vehicle.stands and _may_ask(s, context):
        return _requesting(s.suspending(None), BLOCKED), SqpResult(solutions=(), problem=BLOCKED)
    started = s.plans.suspended
    s = schedule.scheduled(s, context)
    after, attempt = _from_guess(s, context)
    after = after if attempt.problem else plan_found(after)
    if attempt.out_of_time or s.task.end is SegmentEnd.STOP or s.route is None or s.route.fixed:
        return after, attempt
    arrives = s.task.end is SegmentEnd.GOAL and after.task.arrival is not None
    if arrives:
        after, attempt = _reaching(after, attempt, context, started)
        if attempt.out_of_time:
            return s.suspending(after.plans.suspended), attempt
    why = attempt.problem
    if arrives and not (why or search.reaches(attempt, context, ACCEPTED_MISS)):
        why = "the first plan misses the goal"
    if why and _may_ask(s, context):  # at rest it is waited for, else what was found is driven meanwhile
        after = _requesting(s.suspending(None) if s.vehicle.stands else after, why)
    return after, attempt


def _may_ask(s: ControllerState, context: PlanningContext) -> bool:
    """Whether another route from here may be asked for: none was a moment ago."""
    if s.route is None or s.route.fixed:
        return False
    return not route_start.was_searched(s, context.config) if s.vehicle.stands else route_start.on_the_move(s)


def _requesting(s: ControllerState, why: str) -> ControllerState:
    """Asking for another route from here."""
    assert s.route is not None
    return replace(s, route=replace(s.route, request=why))


def ends_at_goal(s: ControllerState, context: PlanningContext) -> bool | None:
    """Whether a first plan of the segment ends at the goal; None: no time to find out, or it is a cruise."""
    s = schedule.scheduled(s.suspending(None), context)
    if s.task.arrival is None:
        return None
    _, attempt = _reaching(*_from_guess(s, context), context, None)
    return None if attempt.out_of_time else search.reaches(attempt, context, ACCEPTED_MISS)


def _reaching(
    s: ControllerState, attempt: SqpResult, context: PlanningContext, started: SuspendedSearch | None
) -> Found:
    """A first plan that misses the goal is iterated further, as many times again."""
    before = 0 if started is None else started.iterations
    done = before + len(attempt.solutions)
    missed = attempt.fits and not search.reaches(attempt, context)
    if not missed or done >= 2 * ITERATIONS:
        return s, attempt
    more = search.converge(s, context, search.further(attempt))
    attempt = replace(more, solutions=(*attempt.solutions, *more.solutions))
    return search.suspended(s.iterated(more.solved), context, attempt, before), attempt


def _from_guess(s: ControllerState, context: PlanningContext) -> Found:
    """Iterate from a first guess, or resume the suspended search."""
    attempt = search.converge(s, context, search.first_iterate(s, context))
    return search.suspended(s.iterated(attempt.solved), context, attempt), attempt


def reachability_is_due(s: ControllerState, config: ControllerConfig) -> bool:
    """Whether the last segment of a path is checked before its first: at rest, for a new goal. A goal beside
    the path's end can be out of reach from there."""
    route, task, measured = s.route, s.task, s.vehicle.monitor.state
    begins = task.stop is None and len(task.later) > 0
    if route is None or measured is None or not (begins and config.objective.arrives_at_goal):
        return False
    if s.on_planned_route or route.replan_reason or s.goal.rejected:
        return False
    goal, stands = s.goal_pose, abs(float(measured[V])) <= config.rest_speed
    if goal is None or not stands:
        return False
    before = route.goal_checked
    return before is None or apart(goal, before) > config.size * GOAL_MOVED[0]
