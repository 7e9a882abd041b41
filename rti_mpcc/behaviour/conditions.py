"""When the vehicle passes from one phase to another: questions about the state and the context of a cycle."""

from __future__ import annotations

from math import hypot

from rti_mpcc.config import ControllerConfig
from rti_mpcc.planning.context import PlanningContext
from rti_mpcc.planning.obstacles import changed
from rti_mpcc.planning.state import ControllerState, Phase

# -- looked for in every cycle --------------------------------------------------------------------------


def will_stop_outside(s: ControllerState, context: PlanningContext, config: ControllerConfig) -> bool:
    """Braking to rest it will stop outside: the target has moved away."""
    return not s.is_stationary and not context.inside(context.stop_error)


def stands_outside(s: ControllerState, context: PlanningContext, config: ControllerConfig) -> bool:
    """Standing, it is outside by far, or for a while: noise may show it just there for a moment."""
    since = s.task.outside_since
    if since is None or (s.task.phase is Phase.SETTLING and not s.is_stationary):
        return False
    settings = config.behaviour
    far = not context.inside(context.error, settings.outside_share)
    return context.now - since >= settings.outside_time or far


def stands_inside(s: ControllerState, context: PlanningContext, config: ControllerConfig) -> bool:
    """It stands inside the tolerance."""
    return s.is_stationary and context.inside(context.standing_error)


def stands_well_inside(s: ControllerState, context: PlanningContext, config: ControllerConfig) -> bool:
    """It stands inside the tolerance, and noise does not show it outside."""
    return s.is_stationary and context.inside(context.standing_error, config.behaviour.settle_share)


def came_to_rest(s: ControllerState, context: PlanningContext, config: ControllerConfig) -> bool:
    """It has come to rest, and is not measured outside."""
    return s.is_stationary and s.task.outside_since is None


def passes_target(s: ControllerState, context: PlanningContext, config: ControllerConfig) -> bool:
    """It has passed its target, or will, however firmly it brakes, by more than an arrival can come back.

    A vehicle at rest without a plan finds that out by its first plan, and replans at once.
    """
    if not (config.arrival and s.task.segment.objective.arrives and context.free):
        return False
    if s.task.phase is Phase.STARTING and s.is_stationary:
        return False
    left = context.along - context.speed**2 / (2.0 * config.firm_deceleration)
    return left < -config.arrival_timing.passed_distance


def target_moved(s: ControllerState, context: PlanningContext, config: ControllerConfig) -> bool:
    """The target has moved, however slowly, from where it was when the vehicle stalled, and is not behind."""
    stall = s.task.stall
    if passes_target(s, context, config):
        return False
    return stall is None or not context.within(
        context.target.pose.relative_to(stall.target.pose), config.behaviour.settle_share
    )


def obstacles_changed(s: ControllerState, context: PlanningContext, config: ControllerConfig) -> bool:
    """What stands around it has changed since it stalled, and it has stood there for a while."""
    stall = s.task.stall
    if stall is None or not s.vehicle.is_stationary(context.now, config.retries.give_up_time):
        return False
    return changed(stall.obstacles, s.area.standing, config.caution.moved)


def stop_ends_inside(s: ControllerState, context: PlanningContext, config: ControllerConfig) -> bool:
    """Braking in comfort from here it would stop inside the tolerance."""
    settings = config.behaviour
    stopping = context.speed <= settings.settle_time * config.comfort_acceleration
    share = settings.due_share if is_due(s, context, config) else settings.settle_share
    share = 1.0 if overdue(s, context, config) else share
    return stopping and context.inside(context.stop_error, share)


def stuck_inside(s: ControllerState, context: PlanningContext, config: ControllerConfig) -> bool:
    """It does not get nearer, and need not: it is inside the tolerance, or before something in the way."""
    enough = not context.free or (s.is_stationary and context.inside(context.error))
    return enough and no_progress(s, context, config)


def no_progress(s: ControllerState, context: PlanningContext, config: ControllerConfig) -> bool:
    """It does not get nearer: its arrival is overdue, or it stands for good, and not for its dwell."""
    if _dwells(s, context, config):
        return False
    return overdue(s, context, config) or _stuck(s, context, config)


def plan_misses(s: ControllerState, context: PlanningContext, config: ControllerConfig) -> bool:
    """Its arrival is due, and the plan itself ends outside the tolerance: there is no mending that from here,
    and another way can be planned."""
    plan = s.plans.driven
    if s.route is None or s.route.fixed or plan is None or not (context.free and is_due(s, context, config)):
        return False
    return not (context.reached_by(plan) or context.inside(context.stop_error))


# -- others ---------------------------------------------------------------------------------------------


def is_due(s: ControllerState, context: PlanningContext, config: ControllerConfig) -> bool:
    """Whether the planned arrival is due: it takes its shortest time from here, and has for a moment."""
    since = None if s.task.arrival is None else s.task.arrival.overdue_since
    return since is not None and context.now - since >= config.behaviour.due_time


def overdue(s: ControllerState, context: PlanningContext, config: ControllerConfig) -> bool:
    """Whether the planned arrival should have been long ago."""
    since = None if s.task.arrival is None else s.task.arrival.overdue_since
    return since is not None and context.now - since >= config.behaviour.overdue_time


def standing_since(s: ControllerState, context: PlanningContext, config: ControllerConfig) -> float | None:
    """Since when the vehicle stands [s], or None."""
    stood, settings = s.vehicle.standing_since, config.behaviour
    speed = max(abs(context.measured_speed), context.own_speed)
    if speed > (settings.standstill_speed if stood is None else settings.moving_speed):
        return None
    return context.now if stood is None else stood


def outside_since(s: ControllerState, context: PlanningContext, config: ControllerConfig) -> float | None:
    """Since when a vehicle that is to stand at its target stands outside the tolerance [s], or None.

    One that is measured outside by far is, whatever the mean of the last moments is.
    """
    task = s.task
    if task.phase is not Phase.HOLDING and not (task.phase is Phase.SETTLING and s.is_stationary):
        return task.outside_since
    near = context.inside(context.error, config.behaviour.outside_share)
    if not context.free or (near and context.inside(context.standing_error)):
        return None
    return context.now if task.outside_since is None else task.outside_since


def may_look_again(s: ControllerState, config: ControllerConfig) -> bool:
    """Whether a vehicle that stands before a contact begins afresh: its plan was iterated for a while."""
    return s.is_stationary and s.now - s.task.driving_since >= config.retries.replan_interval


def replan_due(s: ControllerState, context: PlanningContext, config: ControllerConfig) -> bool:
    """Whether a vehicle that stands without a plan, or cruises without an arrival, should look for one in
    this cycle, or goes on looking."""
    looked_at = s.task.looked_at
    if s.plans.suspended is not None:
        return True
    return looked_at is None or not 0.0 <= context.now - looked_at < config.retries.replan_interval


def may_change_direction(s: ControllerState, context: PlanningContext, config: ControllerConfig) -> bool:
    """Whether the next segment may begin: standing at the end of this one for its dwell, with nothing left in
    the queue; or near it for long, but on a planned way, on which the next one is for the end alone."""
    dwell, settings = max(config.dead_time, s.task.segment.dwell), config.behaviour
    if context.ends_at_goal or not context.free or not s.vehicle.is_stationary(context.now, dwell):
        return False
    if abs(context.measured_speed) > settings.standstill_speed:
        return False
    if context.inside(context.error):
        return True
    if s.on_planned_way:
        return False
    long = s.vehicle.is_stationary(context.now, max(settings.standstill_time, dwell))
    return long and _near(context, config)


def _dwells(s: ControllerState, context: PlanningContext, config: ControllerConfig) -> bool:
    """Whether it waits where the next segment may begin, near enough to the end of this one."""
    there = context.free and not context.ends_at_goal and _near(context, config)
    return there and s.task.segment.dwell > 0.0 and s.is_stationary


def _near(context: PlanningContext, config: ControllerConfig) -> bool:
    """Whether the target, a cusp, is near enough to go on from."""
    return hypot(context.error.x, context.error.y) <= config.behaviour.cusp_reach


def _stuck(s: ControllerState, context: PlanningContext, config: ControllerConfig) -> bool:
    """Whether the vehicle stands for good: an arrival with time to go may begin slowly, or turn about; and
    one that halts for something waits."""
    task, settings = s.task, config.behaviour
    long = settings.standstill_time if task.objective.along_path else settings.turning_time
    if task.arrival is not None and task.arrival.overdue_since is None:
        # It begins as slowly as its comfort has it.
        long = settings.turning_time + settings.moving_speed / config.arrival_acceleration
    standing = s.vehicle.is_stationary(context.now, long)
    return standing and task.halt is None and context.now - task.driving_since > settings.standstill_time
