"""Finding a plan: one real-time iteration a cycle, more of them while a plan is not yet fit to be driven.

The search for the first plan of a segment takes several cycles if the time of one is too short.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import radians

import numpy as np

from rti_mpcc.clock import TIME_IS_UP
from rti_mpcc.config import ControllerConfig
from rti_mpcc.course import conditions, route_start
from rti_mpcc.course.context import PlanningContext
from rti_mpcc.course.guess import Course, arrival_guess, cruise_guess
from rti_mpcc.course.transitions import plan_found
from rti_mpcc.iteration import DAMPING, DAMPING_SHARE, FIRST_DAMPING, Solution
from rti_mpcc.manoeuvre import SegmentEnd
from rti_mpcc.model.actuators import UNDISTURBED, Disturbance
from rti_mpcc.model.bicycle import Extremes, extremes
from rti_mpcc.model.layout import DELTA, DELTA_DOT, A, V, X, Y
from rti_mpcc.ocp.horizon import stage_lengths, stage_times
from rti_mpcc.ocp.objectives import apart
from rti_mpcc.state import ControllerState, Plans, SuspendedSearch
from rti_mpcc.types import Objective, Trajectory
from rti_mpcc.world.goals import GOAL_MOVED

ITERATIONS = 10  # of one search, at most; of one that misses the goal twice as many
FIRST_ITERATIONS = 3  # from a first guess on, at least; or two, if the second moved the plan < SETTLED
SETTLED = 0.02  # [m] for each second ahead
CHECKED_SPAN = 2.0  # [s] at the start of a plan over which it has to obey the dynamics,
POSITION_DEFECT = 0.05  # [m]: with at most this error
HEADING_DEFECT = radians(2.0)  # [rad]
INPUT_EXCESS = 0.02  # of an input limit, by which a solver's answer may pass it before it is cut
BLOCKED_SLACK = 0.3  # [m] of slack on top of the vehicle's own: a plan with more goes through something

ACCEPTED_MISS = 1.5  # times the goal tolerance: a first plan that misses by less is driven

NO_TIME = "the deadline left no time for an iteration"
BLOCKED = "something blocks the route"


@dataclass(frozen=True, slots=True, kw_only=True)
class SqpResult:
    """The iterations of one cycle.

    Attributes:
        solutions: in order; none if there was no time for any.
        problem: why the last one must not be driven, or "".
        corridor_infeasible: it goes through a static obstacle or boundary, or ends in front of it.
        out_of_time: the time was up before the iterations ended.
    """

    solutions: tuple[Solution, ...]
    problem: str
    corridor_infeasible: bool = False
    out_of_time: bool = False

    @property
    def solved(self) -> Solution | None:
        """The last iterate that was solved."""
        for solution in reversed(self.solutions):
            if solution.solved:
                return solution
        return None

    @property
    def fits(self) -> bool:
        """Whether the last iterate may be driven by its QP, and goes past everything."""
        return not (self.problem or self.corridor_infeasible)

    @property
    def plan(self) -> Trajectory:
        """The last iterate."""
        return self.solutions[-1].trajectory


@dataclass(frozen=True, slots=True, kw_only=True)
class InitialIterate:
    """Where a search begins.

    Attributes:
        last: the solution to resume; guess: or a trajectory to start from.
        least, most: numbers of iterations; fewer than `least` if two plans are `SETTLED`.
        first: for the first plan of an objective, which must not go through anything static.
        reaching: until it ends within the tolerance of its target.
        damping: see `RtiMpcc.prepare`.
    """

    last: Solution | None = None
    guess: Trajectory | None = None
    most: int
    damping: float
    least: int = 1
    first: bool = False
    reaching: bool = False


def from_last(plans: Plans) -> InitialIterate:
    """One iteration a cycle, more while there is a problem. The damping of a first guess fades.

    Where there is no last solution, as for another objective, from the driven plan.
    """
    solution = plans.solution
    if solution is None:
        return InitialIterate(guess=plans.driven, most=ITERATIONS, damping=DAMPING)
    damping = max(DAMPING, DAMPING_SHARE * solution.damping)
    return InitialIterate(last=solution, most=ITERATIONS, damping=damping)


def first_iterate(s: ControllerState, context: PlanningContext) -> InitialIterate:
    """The first plan of the chosen objective, from a guess or from where its search was suspended."""
    started = s.plans.suspended
    last, done = (None, 0) if started is None else (started.solution, started.iterations)
    return InitialIterate(
        last=last,
        guess=_first_guess(s, context) if last is None else None,
        first=True,
        least=max(FIRST_ITERATIONS - done, 1),
        most=max(ITERATIONS - done, 1),
        damping=FIRST_DAMPING,
    )


def converge(s: ControllerState, context: PlanningContext, start: InitialIterate) -> SqpResult:
    """Iterate until the last iterate can be driven, or the time is up."""
    solutions: list[Solution] = []
    problem, corridor_infeasible, out_of_time = NO_TIME, False, False
    while len(solutions) < start.most:
        out_of_time = not context.clock.grants()
        if out_of_time:
            problem = problem or NO_TIME
            break
        found = _iterate(s, context, start)
        solutions.append(found)
        problem = rejection_reason(found, context.config, s.vehicle.disturbance)
        corridor_infeasible = start.first and (
            found.most_slack > BLOCKED_SLACK
            or (s.task.arrival is not None and context.missed_by(found.trajectory))
        )
        out_of_time = found.stopped is not None and found.stopped.status == TIME_IS_UP
        enough = len(solutions) >= start.least or _settled(solutions)
        fits = enough and not problem and not corridor_infeasible
        fits = fits and (not start.reaching or context.reached_by(found.trajectory))
        if fits or not found.solved:
            break
        start = replace(start, last=found, guess=None)
    return SqpResult(
        solutions=tuple(solutions),
        problem=problem,
        corridor_infeasible=corridor_infeasible,
        out_of_time=out_of_time,
    )


def _settled(solutions: Sequence[Solution]) -> bool:
    """Whether the last two plans part by less than `SETTLED`."""
    if len(solutions) < 2:
        return False
    before, now = (solution.trajectory for solution in solutions[-2:])
    apart = np.hypot(*(now.states - before.states)[1:, [X, Y]].T)
    return bool((apart <= SETTLED * (now.times[1:] - now.times[0])).all())


def _iterate(s: ControllerState, context: PlanningContext, start: InitialIterate) -> Solution:
    """One real-time iteration."""
    mpcc, clock = context.mpcc, context.clock
    mpcc.prepare(
        context.start_time,
        target=context.target,
        last=start.last,
        plan=start.guess,
        objective=s.task.objective,
        damping=start.damping,
        disturbance=s.vehicle.disturbance,
        before=context.acceleration,
        first=s.plans.driven is None,
    )
    solution = mpcc.feedback(context.state, context.start_time, ends=clock.ends())
    clock.took(solution.stopped)
    return solution


def suspended(
    s: ControllerState, context: PlanningContext, attempt: SqpResult, done: int = 0
) -> ControllerState:
    """With a search that ran out of time kept for the next cycle. `done`: iterations before those of the
    attempt, where it resumes no suspended search."""
    if not attempt.out_of_time:
        return s.suspending(None)
    before = s.plans.suspended
    search = SuspendedSearch(
        solution=attempt.solved or (before.solution if before else None),
        iterations=(before.iterations if before else done) + sum(each.solved for each in attempt.solutions),
        target=context.target,
        arrival=s.task.arrival,
        since=before.since if before else s.clock.now,
    )
    return s.suspending(search)


def _first_guess(s: ControllerState, context: PlanningContext) -> Trajectory:
    """The trajectory at which the iterations of the chosen objective start."""
    config, arrival, course = context.config, s.task.arrival, Course(context.mpcc.part, context.target)
    horizon = config.cruise_horizon if arrival is None else conditions.duration(context)
    times = stage_times(context.start_time, stage_lengths(horizon, config.cycle, config.stages))
    if s.task.objective.kind is Objective.CONTOURING:
        return cruise_guess(course, context.state, times, context.profile, config)
    return arrival_guess(course, context.state, times, context.distance, context.profile, config)


def reaches(attempt: SqpResult, context: PlanningContext, share: float = 1.0) -> bool:
    """Whether the last iterate goes past everything to within a share of the target's tolerance."""
    return attempt.fits and context.reached_by(attempt.plan, share)


def rejection_reason(
    solution: Solution, config: ControllerConfig, disturbance: Disturbance = UNDISTURBED
) -> str:
    """Why a solution must not be driven, or ""."""
    if not solution.solved:
        return f"the QP was not solved: {solution.status}"
    plan, limits = solution.trajectory, config.limits
    found = extremes(plan.times, plan.states, plan.controls, config.vehicle.wheelbase, CHECKED_SPAN)
    if not found.finite:
        return "the plan is not finite"
    a, rate = disturbance.commanded(plan.controls[0, A]), plan.controls[0, DELTA_DOT]
    most = 1.0 + INPUT_EXCESS
    if abs(a) > most * limits.acceleration or abs(rate) > most * limits.steering_rate:
        return f"the plan begins outside the input limits: a = {a:.3g} m/s², delta_dot = {rate:.3g} rad/s"
    if solution.most_slack > BLOCKED_SLACK + float(solution.slack[0]):
        return f"the plan leaves the corridor by {solution.most_slack:.2f} m"
    if found.drift > POSITION_DEFECT or found.turn > HEADING_DEFECT:
        return f"the plan breaks the dynamics by {found.drift:.2f} m and {np.degrees(found.turn):.1f} deg"
    return _far_ahead(plan, found, config, disturbance)


def _far_ahead(plan: Trajectory, found: Extremes, config: ControllerConfig, disturbance: Disturbance) -> str:
    """Why a plan is implausible far ahead, or ""; from beyond a limit it may come back."""
    limits, most = config.limits, 1.0 + INPUT_EXCESS
    *_, position, heading, speed, angle, a, rate = found
    left, right = map(disturbance.acting_steering, (limits.steering, -limits.steering))
    turned = max(abs(left), abs(right))
    begins, begins_turned = abs(float(plan.states[0, V])), abs(float(plan.states[0, DELTA]))
    if speed > most * max(limits.speed, begins) or angle > most * max(turned, begins_turned):
        return f"the plan leaves the limits: v = {speed:.3g} m/s, delta = {angle:.3g} rad"
    share = disturbance.gain * limits.acceleration + abs(disturbance.acceleration)
    if a > most * share or rate > most * limits.steering_rate:
        return f"the plan leaves the input limits: a = {a:.3g} m/s², delta_dot = {rate:.3g} rad/s"
    if position > POSITION_DEFECT or heading > HEADING_DEFECT:
        return f"a stage of the plan breaks the dynamics by {position:.2f} m, {np.degrees(heading):.1f} deg"
    return ""


# -- the first plan of a segment ------------------------------------------------------------------------


def first_plan(s: ControllerState, context: PlanningContext) -> tuple[ControllerState, SqpResult]:
    """The first plan to the end of the course; a search that ran out of time is resumed.

    From rest, a route past what blocks the segment is asked for first; likewise one in place of a plan that
    may not be driven, or that misses the goal by more than `ACCEPTED_MISS`.
    """
    if s.task.stop is not None and s.vehicle.stands and _may_ask(s, context):
        return _requesting(s.suspending(None), BLOCKED), SqpResult(solutions=(), problem=BLOCKED)
    started = s.plans.suspended
    s = conditions.scheduled(s, context)
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
    if arrives and not (why or reaches(attempt, context, ACCEPTED_MISS)):
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
    assert s.route is not None
    return replace(s, route=replace(s.route, request=why))


def ends_at_goal(s: ControllerState, context: PlanningContext) -> bool | None:
    """Whether a first plan of the segment ends at the goal; None: no time to find out, or it is a cruise."""
    s = conditions.scheduled(s.suspending(None), context)
    if s.task.arrival is None:
        return None
    _, attempt = _reaching(*_from_guess(s, context), context, None)
    return None if attempt.out_of_time else reaches(attempt, context, ACCEPTED_MISS)


def _reaching(
    s: ControllerState, attempt: SqpResult, context: PlanningContext, started: SuspendedSearch | None
) -> tuple[ControllerState, SqpResult]:
    """A first plan that misses the goal is iterated further, as many times again."""
    before = 0 if started is None else started.iterations
    missed = attempt.fits and not reaches(attempt, context)
    if not missed or before + len(attempt.solutions) >= 2 * ITERATIONS:
        return s, attempt
    further = InitialIterate(
        last=attempt.solved, first=True, reaching=True, most=ITERATIONS, damping=FIRST_DAMPING
    )
    more = converge(s, context, further)
    attempt = replace(more, solutions=(*attempt.solutions, *more.solutions))
    return suspended(s.iterated(more.solved), context, attempt, before), attempt


def _from_guess(s: ControllerState, context: PlanningContext) -> tuple[ControllerState, SqpResult]:
    """Iterate from a first guess, or resume the suspended search."""
    attempt = converge(s, context, first_iterate(s, context))
    return suspended(s.iterated(attempt.solved), context, attempt), attempt


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
