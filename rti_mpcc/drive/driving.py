"""What is driven in a cycle: what its phase asks for, or the next step of the fallback."""

from __future__ import annotations

from dataclasses import replace
from math import inf

from rti_mpcc.config.mpc import CONTACT_TOLERANCE
from rti_mpcc.course import collision_check, conditions
from rti_mpcc.course.collision_check import CLEAR_DISTANCE, Overlap
from rti_mpcc.course.conditions import GIVE_UP_TIME, replan_due, standing_since
from rti_mpcc.course.context import PlanningContext
from rti_mpcc.course.transitions import Event, plan_accepted, transition_by_condition, transition_on
from rti_mpcc.drive import escape, fallback, holding, limiter, search
from rti_mpcc.drive.command import ControlDecision, meeting, what_blocks, why_stalled, why_yielding
from rti_mpcc.drive.fallback import ControlInput
from rti_mpcc.drive.search import SqpResult, first_plan
from rti_mpcc.iteration import Solution
from rti_mpcc.manoeuvre import SegmentEnd
from rti_mpcc.model.layout import DELTA_DOT, A, V
from rti_mpcc.state import ControllerState, Hold, Phase, Yielding
from rti_mpcc.types import Reason, Source, Trajectory, Verdict
from rti_mpcc.world import goal_setpoint
from rti_mpcc.world.obstacles import CLEAR_TIME
from rti_mpcc.world.surroundings import GOAL_REACH

PLAN_AGE = 0.2  # [s]; an older plan is iterated before a search (docs/decisions/06-sliced-solves.md)
IN_REACH = 1.1  # times firm; more than that would stop no vehicle in reach of a passed goal
WHEELS_OFF = 0.1  # [rad] from the angle that a segment names: beyond it the wheels are turned first,
WHEELS_REACH = 0.5  # [m] from its start, at most


Driven = tuple[ControllerState, ControlDecision]
"""The state after a decision, and the decision."""


def driven(s: ControllerState, context: PlanningContext) -> Driven:
    """What is driven in this cycle: a plan that came too late is not."""
    after, decision = _decided(s, context)
    if context.clock.late() and decision.control.source is Source.SOLUTION:
        late = Reason.LATE.message
        last = _continue_plan(after, s, context, late, decision.attempt)
        after, decision = last or _stop(after, context, Verdict(Reason.LATE), attempt=decision.attempt)
    return after, decision


def _decided(s: ControllerState, context: PlanningContext) -> Driven:
    """What safety asks for comes before what the phase asks for."""
    since = standing_since(s, context)
    if since != s.vehicle.standing_since:
        s = replace(s, vehicle=replace(s.vehicle, standing_since=since))
    overlap = collision_check.overlap_now(s, context)
    if overlap is not None:
        return _in_contact(s, context, overlap)
    if context.doubt:
        return _doubt(s, context)
    beyond = limiter.exceeded(s.vehicle.disturbance, context.config)
    if beyond:
        return _give_up(s, context, beyond)
    if s.goal.rejected and s.task.phase is not Phase.WAITING:
        s = transition_on(s, Event.GOAL_LOST) if s.vehicle.stands else s
        rejected = Verdict(Reason.GOAL_REJECTED, _none_accepted(s))
        return _stop(s, context, rejected, along=s.plans.driven)
    s = transition_by_condition(_watching(s, context), context)
    s = conditions.rescheduled(s, context)
    stays = s.task.phase in (Phase.HOLDING, Phase.WAITING)
    waiting = conditions.must_wait(s, context) if s.vehicle.stands and not stays else ""
    if waiting:
        return _stop(transition_on(s, Event.GOAL_LOST), context, Verdict(Reason.GOAL_UNCERTAIN, waiting))
    return _BY_PHASE[s.task.phase](s, context)


def _none_accepted(s: ControllerState) -> str:
    """What to do where a goal was asked for and none was accepted."""
    has_end = not s.on_planned_route or (s.route is not None and s.route.end is not None)
    or_the_end = ", or call `clear_goal` to drive to the path's end" if has_end else ""
    return f"no goal was accepted: give another one{or_the_end}"


# -- what the phases ask for --------------------------------------------------------------------------


def _start(s: ControllerState, context: PlanningContext) -> Driven:
    """Search a first plan."""
    stands, stop_reason = s.vehicle.stands, s.task.stop_reason
    if stands and not replan_due(s, context):
        return _stop(s, context, Verdict(Reason.RETRIES_SOON, stop_reason))
    turning = _turning_wheels(s, context)
    if turning is not None:
        return turning
    if stands and s.route is not None and s.route.request:
        return _wait_for_route(s, context)
    s, attempt = first_plan(s, context)
    if stands and s.route is not None and s.route.request:
        return _wait_for_route(s, context)
    if not attempt.problem:
        return _accept(s, context, attempt, s.plans.solution)
    if not stands and (attempt.out_of_time or not stop_reason):
        last = _continue_plan(s, s, context, attempt.problem, attempt)
        if last is not None:
            return last
    task, search = s.task, s.plans.suspended
    resumes = search is not None and s.clock.now - search.since < GIVE_UP_TIME
    if not (stop_reason or resumes) and s.vehicle.is_stationary(s.clock.now, GIVE_UP_TIME):
        stop_reason = attempt.problem
        task = replace(task, stop_reason=stop_reason)
    if stop_reason and stands:
        task = replace(task, last_attempt=s.clock.now)
    verdict = Verdict(Reason.SEARCHES_PLAN, attempt.problem)
    firm = context.config.firm_deceleration
    return _stop(replace(s, task=task), context, verdict, firm, attempt)


def _turning_wheels(s: ControllerState, context: PlanningContext) -> Driven | None:
    """The wheels are turned at rest near the start of a segment that names their angle, or None."""
    angle, (*_, delta, theta) = s.task.segment.wheels, context.state.tolist()
    near = theta - s.task.segment.part.start <= WHEELS_REACH * context.config.size
    if angle is None or not (s.vehicle.stands and near and abs(angle - delta) > WHEELS_OFF):
        return None
    control = fallback.turn_wheels(context.state, angle, context.config)
    motion = fallback.braking(context, context.config.comfort_acceleration)
    return s, ControlDecision(control, Verdict(Reason.TURNS_WHEELS, f"{angle:.2f}"), motion)


def _drive(s: ControllerState, context: PlanningContext) -> Driven:
    """Continue with the plan, unless another one is needed and found."""
    if _needs_another_plan(s, context):
        s, decision = _change_over(s, context)
        if decision is not None:
            return s, decision
    successor = conditions.successor_due(s, context)
    if successor is not None:
        s = replace(s, task=replace(s.task, successor=successor), plans=replace(s.plans, solution=None))
    return _iterate(s, context)


def _settle(s: ControllerState, context: PlanningContext) -> Driven:
    return _stop(s, context, Verdict(Reason.SETTLES), fallback.settling_deceleration(context))


def _stay(s: ControllerState, context: PlanningContext) -> Driven:
    """Brake along the last plan and stand until a route is planned; behind a passed goal, in its reach."""
    if not conditions.passes_target(s, context):
        why = why_stalled(s, context)
        stalled = Verdict(Reason.STALLED, why and f": {why}")
        return _stop(s, context, stalled, along=s.plans.driven)
    in_reach, firm = GOAL_REACH + context.along, context.config.firm_deceleration
    needed = fallback.braking_over(in_reach, context.speed, inf, context.config)
    # Where it cannot stop in reach there is nothing to brake hard for.
    wanted = context.config.comfort_acceleration if needed > IN_REACH * firm else min(needed, firm)
    behind = context.speed**2 / (2.0 * wanted) - context.along
    return _stop(s, context, Verdict(Reason.GOAL_BEHIND, f"{behind:.2f}"), wanted, along=s.plans.driven)


def _wait_for_route(s: ControllerState, context: PlanningContext) -> Driven:
    """Stand, or brake to a standstill, while a route is planned, or if there is none."""
    route = s.route
    assert route is not None
    why, last = route.request or route.replan_reason, route.manoeuvre
    if s.goal_pose is None:
        return _stop(s, context, Verdict(Reason.PLANS_ROUTE, "there is no goal yet"))
    none = last is not None and not last.found and why == last.reason
    return _stop(s, context, Verdict(Reason.NO_ROUTE if none else Reason.PLANS_ROUTE, why))


def _wait(s: ControllerState, context: PlanningContext) -> Driven:
    """Brake to a standstill along the last plan, in comfort or as hard as possible, and stay there."""
    s, verdict = holding.hold_here(s, context), Verdict(Reason.COMMANDED_TO_STAND)
    if s.task.hold is not None:
        return _held(s, s.task.hold, context, verdict)
    wanted = context.config.limits.acceleration if s.task.at_once else context.config.comfort_acceleration
    return _stop(s, context, verdict, wanted, along=s.plans.driven)


def _hold(s: ControllerState, context: PlanningContext) -> Driven:
    if s.task.end is SegmentEnd.GOAL:
        return _hold_at_goal(s, context)
    if s.task.end is SegmentEnd.CUSP:
        return _stop(s, context, Verdict(Reason.STANDS_AT_CUSP))
    blocked = "" if s.task.stop is None else what_blocks(s.task.stop, context)
    return _stop(s, context, Verdict(Reason.STANDS_BEFORE_OBSTACLE, blocked))


def _hold_at_goal(s: ControllerState, context: PlanningContext) -> Driven:
    """Stay at the dock; docked once the vehicle is found to stay there."""
    s = holding.start_hold(s, context)
    hold = s.task.hold
    assert hold is not None
    leaps = s.vehicle.monitor.sensors.leap != 0.0  # a sensor says that it drives: not docked, but held
    verdict = _at_goal(s, context) if hold.docked and not leaps else Verdict(Reason.SETTLES)
    return _held(s, hold, context, verdict)


def _held(s: ControllerState, hold: Hold, context: PlanningContext, verdict: Verdict) -> Driven:
    """Stay at the anchor of the hold."""
    if abs(float(context.state[V])) > holding.FASTEST:  # it was pushed, say
        return _stop(s, context, verdict)
    motion = fallback.braking(context, context.config.comfort_acceleration)
    control, hold = holding.control(hold, s, context)
    return holding.balanced(s, hold, context.config), ControlDecision(control, verdict, motion)


def _at_goal(s: ControllerState, context: PlanningContext) -> Verdict:
    """Whether the goal that the vehicle stands at is the given one, and was detected."""
    goal = s.goal
    if goal_setpoint.never_seen(goal, context.config):
        return Verdict(Reason.NOT_DETECTED)
    here = context.target.pose.compose(context.standing_error)
    if goal_setpoint.is_elsewhere(goal, here, context.config):
        return Verdict(Reason.GOAL_REJECTED, goal_setpoint.NOT_THE_ONE)
    moved = goal_setpoint.dock_has_moved(goal, context.config)
    if moved:
        return Verdict(Reason.GOAL_UNCERTAIN, moved)
    return Verdict(Reason.DOCKED)


_BY_PHASE = {
    Phase.STARTING: _start,
    Phase.CONTOURING: _drive,
    Phase.ARRIVING: _drive,
    Phase.SETTLING: _settle,
    Phase.HOLDING: _hold,
    Phase.STALLED: _stay,
    Phase.PLANNING: _wait_for_route,
    Phase.WAITING: _wait,
}


# -- plans ----------------------------------------------------------------------------------------------


def _change_over(
    s: ControllerState, context: PlanningContext
) -> tuple[ControllerState, ControlDecision | None]:
    """Change from the present plan to the first one of another objective; None: not yet.

    One that goes through something, or misses its target, is searched again after `REPLAN_INTERVAL`.
    """
    found, attempt = first_plan(s, context)
    too_late = conditions.too_late(s, context)
    if attempt.corridor_infeasible and not (attempt.out_of_time or too_late):
        return replace(s, route=found.route, task=replace(s.task, last_attempt=s.clock.now)), None
    if not attempt.problem:
        return _accept(found, context, attempt, found.plans.solution)
    after = s.suspending(found.plans.suspended)
    if too_late:
        firm = context.config.firm_deceleration
        return _stop(after, context, Verdict(Reason.NO_PLAN, attempt.problem), firm, attempt)
    return after, None


def _iterate(s: ControllerState, context: PlanningContext) -> Driven:
    """One real-time iteration, and the fallback if it gives no plan."""
    attempt = search.converge(s, context, search.from_last(s.plans))
    if not attempt.problem:
        return _accept(s, context, attempt, attempt.solved)
    s = s.iterated(attempt.solved)
    last = _continue_plan(s, s, context, attempt.problem, attempt)
    if last is None and attempt.out_of_time and s.task.yielding is not None:  # it brakes already
        return _stop(s, context, why_yielding(s, inf), attempt=attempt, along=s.plans.driven)
    return last or _give_up(s, context, attempt.problem, attempt)


def _needs_another_plan(s: ControllerState, context: PlanningContext) -> bool:
    """Whether the arrival should start, or the driven plan misses the target. An old plan is iterated first,
    unless the vehicle halts."""
    plan, accepted = s.plans.driven, s.plans.accepted_at
    searching = s.plans.suspended is not None and s.task.yielding is None
    if searching and accepted is not None and s.clock.now - accepted > PLAN_AGE:
        return False
    arrives = s.task.arrival is not None and s.task.end is not SegmentEnd.STOP
    # The target has jumped, or the iterations got stuck.
    elsewhere = arrives and plan is not None and context.missed_by(plan)
    due = s.task.phase is Phase.CONTOURING and conditions.arrives(s, context)
    return (elsewhere or due) and replan_due(s, context)


# -- the steps of the fallback --------------------------------------------------------------------------


def _accept(
    s: ControllerState, context: PlanningContext, attempt: SqpResult, solution: Solution | None
) -> Driven:
    """Drive the plan of this cycle, unless it must not be. The next cycle resumes `solution`."""
    plan = attempt.plan
    s, decision = _follow_plan(s, context, plan, attempt)
    if decision.control.source is Source.SOLUTION:
        return plan_accepted(s, plan, solution), decision
    return replace(s, plans=replace(s.plans, solution=solution)), decision


def _continue_plan(
    s: ControllerState,
    before: ControllerState,
    context: PlanningContext,
    problem: str,
    attempt: SqpResult | None = None,
    *,
    whole: bool = False,
) -> Driven | None:
    """Continue the last accepted plan of `before`, see `_follow_plan`; or None."""
    plan = fallback.shifted_plan(before.plans.driven, before.plans.accepted_at, context)
    if plan is None:
        return None
    return _follow_plan(s, context, plan, attempt, problem=problem, whole=whole)


def _doubt(s: ControllerState, context: PlanningContext) -> Driven:
    """Continue the last plan for a moment, by the estimate; then brake."""
    monitor = s.vehicle.monitor
    short = context.now - monitor.since <= context.config.plausibility.blind
    if s.task.drives and not s.task.stop_reason and short and not monitor.steering_fault:
        last = _continue_plan(s, s, context, context.doubt, whole=True)
        if last is not None:
            after, decision = last
            return after, replace(decision, verdict=Verdict(Reason.STATE_DOUBTED, str(decision.verdict)))
    return _give_up(s, context, context.doubt)


def _give_up(
    s: ControllerState, context: PlanningContext, problem: str, attempt: SqpResult | None = None
) -> Driven:
    """Brake to a standstill, and plan anew."""
    firm = context.config.firm_deceleration
    after = transition_on(s, Event.PLAN_LOST)
    after = s if after is s else replace(after, task=replace(after.task, stop_reason=problem))
    return _stop(after, context, Verdict(Reason.NO_PLAN, problem), firm, attempt)


def _follow_plan(
    s: ControllerState,
    context: PlanningContext,
    plan: Trajectory,
    attempt: SqpResult | None,
    *,
    problem: str = "",
    whole: bool = False,
) -> Driven:
    """Drive a plan that is clear as far as a stop needs, to a goal that is certain.

    `problem`: why the plan is not of this cycle, "" if it is. `whole`: it has to be clear to its end, as
    where the vehicle is not where it is measured.
    """
    config = context.config
    need = inf if whole else collision_check.stopping_distance(float(context.state[V]), config)
    later = 0.0 if s.task.yielding is None else CLEAR_TIME
    distance = collision_check.clear_distance(s, plan, config, need + CLEAR_DISTANCE * config.size, later)
    if s.area.tracked.moving:
        slowing = fallback.slowing(context, plan)
        distance = min(distance, collision_check.distance_to_moving(s, slowing, config, later=later))
    s = _yielding(s, distance, need)
    if s.task.yielding is not None:
        if distance < inf:
            s = meeting(s, plan, distance, context.config)
        return _stop(s, context, why_yielding(s, distance), attempt=attempt, along=s.plans.driven)
    waiting = conditions.must_wait(s, context)
    if waiting:
        uncertain = Verdict(Reason.GOAL_UNCERTAIN, waiting)
        return _stop(s, context, uncertain, attempt=attempt, along=plan)
    verdict, source = Verdict(Reason.DRIVES), Source.SOLUTION
    if problem:
        verdict, source = Verdict(Reason.DRIVES_ON, problem), Source.SHIFTED_PLAN
    elif s.task.stop is not None:
        verdict = Verdict(Reason.DRIVES_TO_STOP, what_blocks(s.task.stop, context))
    elif unseen := goal_setpoint.remark(s.goal):
        verdict = Verdict(Reason.DRIVES_UNSEEN, unseen)
    return s, ControlDecision(_first_control(plan, source), verdict, plan, attempt)


def _first_control(plan: Trajectory, source: Source) -> ControlInput:
    return ControlInput(float(plan.controls[0, A]), float(plan.controls[0, DELTA_DOT]), source)


# -- what is in the way -----------------------------------------------------------------------------------


def _in_contact(s: ControllerState, context: PlanningContext, overlap: Overlap) -> Driven:
    """Brake and stand; or creep out, where the settings allow it and no order forbids it."""
    s = transition_on(s, Event.OVERLAP)
    s = replace(s, task=replace(s.task, yielding=Yielding()))
    motion, part = None, s.task.segment.index
    if s.task.phase is not Phase.WAITING:
        motion = escape.escape_motion(context.state, context.start_time, s.area, part, context.config)
    if motion is not None:
        verdict = Verdict(Reason.CREEPS_OUT, str(overlap))
        return s, ControlDecision(_first_control(motion, Source.ESCAPE), verdict, motion)
    # Noise of a centimetre beside an obstacle is no reason to brake as hard as can be.
    shallow = overlap.depth <= CONTACT_TOLERANCE
    wanted = context.config.comfort_acceleration if shallow else context.config.limits.acceleration
    return _stop(s, context, Verdict(Reason.OVERLAP, str(overlap)), wanted)


def _watching(s: ControllerState, context: PlanningContext) -> ControllerState:
    """Halt if the driven plan is not clear of what has changed or moves."""
    plan, area = s.plans.driven, s.area
    changed = s.plans.clear_of != area.changes
    if plan is None or s.vehicle.stands or not (changed or area.tracked.moving):
        return s
    slowing = fallback.slowing(context, plan)
    distance = collision_check.distance_to_moving(s, slowing, context.config)
    if changed:
        # A static obstacle behind the plan's end is no reason to stop.
        end = fallback.distance_to_end(plan, context.state)
        distance = min(distance, collision_check.distance_to_contact(s, slowing, context.config, end))
    if distance == inf:
        return s
    return meeting(_yielding(s, distance, inf), slowing, distance, context.config)


def _yielding(s: ControllerState, distance: float, need: float) -> ControllerState:
    """With a halt for a contact after `distance` [m] (inf: none): from when a stop needs `need` [m] so much,
    until the plan was clear for that, and `CLEAR_DISTANCE` more, for `CLEAR_TIME`."""
    yielding = s.task.yielding
    if distance < inf and distance <= need + (0.0 if yielding is None else CLEAR_DISTANCE):
        yielding = Yielding()
    elif yielding is None:
        return s
    elif yielding.clear_since is None:
        yielding = replace(yielding, clear_since=s.clock.now)
    elif s.clock.now - yielding.clear_since < CLEAR_TIME:
        return s
    else:
        yielding = None
    since = s.clock.now if yielding is None else s.task.driving_since
    return replace(s, task=replace(s.task, yielding=yielding, driving_since=since))


def _stop(
    s: ControllerState,
    context: PlanningContext,
    verdict: Verdict,
    deceleration: float | None = None,
    attempt: SqpResult | None = None,
    along: Trajectory | None = None,
) -> Driven:
    """Brake at `deceleration` [m/s²], by default in comfort, harder before a contact, and stand.

    `along`: a plan to brake along, where that is as gentle as with the steering held.
    """
    config, state = context.config, context.state
    wanted = config.comfort_acceleration if deceleration is None else deceleration
    if s.vehicle.stands:
        motion = fallback.braking(context, wanted)
        control = fallback.hold(state, config, context.acceleration)
    else:
        motion, needed = fallback.braking_in_time(s, context, wanted, along)
        rate, before = float(motion.controls[0, DELTA_DOT]), context.deceleration
        control = fallback.brake(state, needed, config, rate, before, context.settling)
    return s, ControlDecision(control, verdict, motion, attempt)
