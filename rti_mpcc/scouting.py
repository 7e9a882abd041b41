"""The search for the first plan of an objective, over several cycles if the time of one is too short.

Each function returns the state with which its result would be driven, and the result.
"""

from __future__ import annotations

from dataclasses import replace
from math import inf
from typing import NamedTuple

from rti_mpcc.behaviour import moves
from rti_mpcc.behaviour.moves import NEAR_STOP
from rti_mpcc.config import ControllerConfig
from rti_mpcc.manoeuvre import Manoeuvre
from rti_mpcc.model.layout import THETA, V
from rti_mpcc.planning import schedule, search, stops, ways
from rti_mpcc.planning.context import PlanningContext
from rti_mpcc.planning.schedule import apart
from rti_mpcc.planning.search import ITERATIONS, InitialIterate, SqpResult
from rti_mpcc.planning.standstill import rest_speed
from rti_mpcc.planning.state import ControllerState, Phase, SuspendedSearch
from rti_mpcc.planning.stops import SEEN_SHARE
from rti_mpcc.planning.timing import expected_docking_time
from rti_mpcc.planning.workspace import Workspace
from rti_mpcc.safety import contact
from rti_mpcc.types import Trajectory

ACCEPTED_MISS = 1.5  # times the goal tolerance: a first plan that misses by less is driven
_INSTEAD = 1.2  # a planned route replaces the path if it takes at most this many times as long
OUT_OF_REACH = "the goal is out of reach from the path's last change of direction"


class Found(NamedTuple):
    """The result of a search: the state to drive it with, the last attempt, and its context."""

    s: ControllerState
    attempt: SqpResult
    context: PlanningContext


def first_plan(s: ControllerState, context: PlanningContext, w: Workspace) -> Found:
    """The first plan, in this order; a search that ran out of time is resumed.

    1. To the target, from a guess along the path; for a stop nothing else.
    2. If that is not clear, or misses the goal by more than `ACCEPTED_MISS`, it asks for another route.
    3. If there is none, a stop in front of what blocks the route.
    """
    begun = s.plans.suspended
    found, filled = _onward(s, context, w)
    if found.attempt.out_of_time or (begun is not None and begun.segment.stop is not None):
        return found
    found, filled = _another_way(s, context, found, filled, w)
    if found.attempt.out_of_time or filled is None:
        return found
    return _stop_before(found, filled, context, w)


def ends_at_goal(s: ControllerState, context: PlanningContext, w: Workspace) -> bool | None:
    """Whether a first plan of the segment ends at the goal; None: no time to find out, or it is a cruise."""
    s = schedule.scheduled(s.suspending(None), context, w.config)
    if s.task.arrival is None:
        return None
    s, attempt, _ = _from_guess(s, context, w)
    found = _reaching(Found(s, attempt, context), None, w)
    if found.attempt.out_of_time:
        return None
    return search.reaches(found.attempt, context, ACCEPTED_MISS)


def iterated(
    s: ControllerState, context: PlanningContext, start: InitialIterate, w: Workspace
) -> tuple[ControllerState, SqpResult]:
    """Iterate, and keep the last iterate that was solved to go on from."""
    attempt = search.converge(w.mpcc, s, context, start, w.clock)
    return s.iterated(attempt.solved), attempt


def sought(s: ControllerState, context: PlanningContext, w: Workspace, distance: float) -> ControllerState:
    """With another end to plan for than that of the driven plan, which is clear over `distance` [m].

    A route past what blocks the plan comes first. If there was no time for that, it is a stop, which is found
    soon, and the route past is searched meanwhile.
    """
    begun, filled, left, config, driven = s.plans.suspended, inf, inf, w.config, s.plans.driven
    if begun is not None and begun.segment.stop is None and driven is not None and distance < inf:
        trial = replace(s, task=replace(s.task, arrival=begun.arrival))
        guess = search.first_guess(w.mpcc, trial, context)
        on_guess = contact.distance_to_contact(s, guess, config)
        plan, way = (guess, on_guess) if on_guess < inf else (driven, distance)
        filled = contact.progress_of_contact(s, plan, way, config)
        left = _left_before(filled, context, w)
    if NEAR_STOP * config.size < left < inf:
        s = moves.stop_before(s, context, left, None, config.size, str(contact.met_at(s, filled, config)))
    elif begun is not None and begun.segment.stop != s.task.stop:
        s = moves.seeking(s, begun.segment)
    elif begun is None and s.task.stop and (distance < inf or stops.way_may_be_free(s)):
        s = moves.seeking(s, s.task.whole)
    return moves.released(s) if stops.way_may_be_free(s) else s


def _onward(s: ControllerState, context: PlanningContext, w: Workspace) -> tuple[Found, float | None]:
    """From a first guess along the path; with the progress [m] at which something blocks it, or None."""
    s = schedule.scheduled(s, context, w.config)
    filled = _met_on_planned_way(s, context, w)
    if filled is not None:
        nothing = SqpResult(solutions=(), problem="something blocks the route", corridor_infeasible=True)
        return Found(s.suspending(None), nothing, context), filled
    s, attempt, guess = _from_guess(s, context, w)
    if not attempt.out_of_time and context.free and s.area.corridor.obstacles:
        plan = attempt.plan if attempt.fits else guess
        distance = contact.distance_to_contact(s, plan, w.config)
        if distance < inf and attempt.fits:
            # It has not converged that far ahead.
            s, more = iterated(s, context, search.further(attempt, w.config), w)
            attempt = attempt if more.out_of_time else attempt.then(more)
            plan = attempt.plan if attempt.fits else guess
            distance = contact.distance_to_contact(s, plan, w.config)
            cruises = attempt.fits and s.task.arrival is None
            if cruises and distance > SEEN_SHARE * contact.length(attempt.plan):
                distance = inf  # the far part of a cruise has not seen enough
        if distance < inf and not _stands_at_a_wall(s, plan, distance, w):
            # The guess along the path tells where that is: the plan may turn aside in front of it.
            on_guess = contact.distance_to_contact(s, guess, w.config)
            met = (guess, on_guess) if on_guess < inf else (plan, distance)
            filled = contact.progress_of_contact(s, *met, w.config)
    if filled is None:
        attempt = _unless_into_a_wall(s, attempt, w)
        s = s if attempt.problem else moves.plan_found(s)
    return Found(s, attempt, context), filled


def _met_on_planned_way(s: ControllerState, context: PlanningContext, w: Workspace) -> float | None:
    """Progress [m] at which something new blocks a planned route, so that it replans; None: nowhere."""
    if not s.on_planned_way or not context.free or not s.area.corridor.obstacles:
        return None
    guess = search.first_guess(w.mpcc, s, context)
    distance = contact.distance_to_obstacle(s, guess, w.config)
    if distance == inf:
        return None
    return contact.progress_of_contact(s, guess, distance, w.config)


def _another_way(
    s: ControllerState, context: PlanningContext, found: Found, filled: float | None, w: Workspace
) -> tuple[Found, float | None]:
    """Ask for another route from here, where what was found is not clear or misses the goal."""
    if s.route is None or s.route.fixed or not context.free:
        return found, filled
    arrives = context.ends_at_goal and found.s.task.arrival is not None
    if arrives:
        found = _reaching(found, s.plans.suspended, w)
        if found.attempt.out_of_time:
            return found._replace(s=s.suspending(found.s.plans.suspended), context=context), filled
    why = found.attempt.problem or ("something blocks the route" if filled is not None else "")
    if arrives and not (why or search.reaches(found.attempt, context, ACCEPTED_MISS)):
        why = "the first plan misses the goal"
    if not why or (ways.was_asked(s, w.config) if s.is_stationary else not ways.on_the_move(s)):
        return found, filled
    wanted = replace(s.route, wanted=why)
    if not s.is_stationary:  # it is planned while what was found is driven
        return found._replace(s=replace(found.s, route=wanted)), filled
    asking = replace(s.suspending(None), route=wanted)
    return Found(asking, found.attempt, context), None


def _stop_before(found: Found, filled: float, context: PlanningContext, w: Workspace) -> Found:
    """A stop before what still blocks the route."""
    left, met = _left_before(filled, context, w), contact.met_at(found.s, filled, w.config)
    s = moves.stop_before(found.s, context, left, found.s.area.changes, w.config.size, str(met))
    if s.task.phase is Phase.HOLDING:
        return Found(s, found.attempt, w.context(s))
    return _onward(s, w.context(s), w)[0]


def _reaching(found: Found, begun: SuspendedSearch | None, w: Workspace) -> Found:
    """A first plan that misses the goal is iterated further, one of a brisk ride with more time then."""
    found = _iterated_on(found, begun, w)
    attempt, calm = found.attempt, schedule.calmed(found.s, found.context, w.config)
    near = search.reaches(attempt, found.context, ACCEPTED_MISS)
    if calm is found.s or near or not attempt.fits or attempt.out_of_time:
        return found
    return _iterated_on(found._replace(s=calm), begun, w)


def _iterated_on(found: Found, begun: SuspendedSearch | None, w: Workspace) -> Found:
    """A first plan that misses the goal is iterated further, up to a number of rounds."""
    s, attempt, context = found
    before = 0 if begun is None else begun.iterations
    done = before + len(attempt.solutions)
    missed = attempt.fits and not search.reaches(attempt, context)
    rounds = 3 if s.task.arrival is not None and s.task.arrival.calm else 2
    if not (context.free and missed) or done >= rounds * ITERATIONS:
        return found
    s, more = iterated(s, context, replace(search.further(attempt, w.config), least=1, reaching=True), w)
    attempt = replace(attempt.then(more), problem=more.problem, out_of_time=more.out_of_time)
    return Found(search.suspended(s, context, attempt, before), attempt, context)


def _from_guess(
    s: ControllerState, context: PlanningContext, w: Workspace
) -> tuple[ControllerState, SqpResult, Trajectory]:
    """Iterate from a first guess, which is returned, too, or resume the suspended search."""
    guess, begun = search.first_guess(w.mpcc, s, context), s.plans.suspended
    start = search.from_guess(guess, w.config) if begun is None else search.resumed(begun, guess, w.config)
    s, attempt = iterated(s, context, start, w)
    return search.suspended(s, context, attempt), attempt, guess


def _left_before(meets: float, context: PlanningContext, w: Workspace) -> float:
    """Distance [m] to a stop in front of a contact at the progress `meets` [m]."""
    return meets - float(context.state[THETA]) - contact.stop_clearance(w.config)


def _unless_into_a_wall(s: ControllerState, attempt: SqpResult, w: Workspace) -> SqpResult:
    """From rest a plan that goes through a boundary is not started: it would only stop in front of it."""
    if attempt.problem or not attempt.corridor_infeasible or not s.is_stationary:
        return attempt
    distance = contact.distance_to_contact(s, attempt.plan, w.config)
    if distance == inf:
        return attempt
    met = contact.met_on(s, attempt.plan, distance, w.config)
    return replace(attempt, problem=f"no plan from here stays clear: contact in {distance:.2f} m with {met}")


def _stands_at_a_wall(s: ControllerState, plan: Trajectory, distance: float, w: Workspace) -> bool:
    """Whether it would stop right here, `distance` [m] in front of a boundary: nothing to wait for."""
    if distance - contact.stop_clearance(w.config) > NEAR_STOP * w.config.size:
        return False
    return contact.distance_to_obstacle(s, plan, w.config) > distance


def reachability_is_due(s: ControllerState, config: ControllerConfig) -> bool:
    """Whether the last segment of a path is checked before its first: at rest, for a new goal. A goal beside
    the path's end can be out of reach from there."""
    route, goal, task, measured = s.route, s.goal_pose, s.task, s.vehicle.monitor.state
    if route is None or goal is None or measured is None:
        return False
    if s.on_planned_way or route.why or s.goal.rejected:
        return False
    stands = abs(float(measured[V])) <= rest_speed(config)
    begins = task.phase is Phase.STARTING and task.stop is None and len(task.segments) > 1
    if not (stands and begins and config.objective.arrives_at_goal):
        return False
    before = route.rehearsed
    return before is None or apart(goal, before) > config.size * ways.GOAL_MOVED[0]


def takes_too_long(s: ControllerState, found: Manoeuvre, config: ControllerConfig) -> bool:
    """Whether a route for a goal out of reach takes too long to replace the path."""
    if s.route is None or s.route.why != OUT_OF_REACH:
        return False
    given = expected_docking_time(s.path, config, s.goal_pose)
    return expected_docking_time(found.path, config, found.goal) > _INSTEAD * given
