"""When the vehicle passes from one phase to another: questions about the state and the context of a cycle."""

from __future__ import annotations

from math import hypot

from rti_mpcc.config import ControllerConfig
from rti_mpcc.planning.context import PlanningContext
from rti_mpcc.planning.state import ControllerState, Phase
from rti_mpcc.planning.stops import LOOK_AGAIN

STANDSTILL_SPEED = 0.02
"""Below this speed the vehicle stands [m/s]."""
MOVING_SPEED = 0.04
"""A vehicle that stands is taken to stand until it is measured faster than this [m/s]: noise is no motion."""
DOUBT_TIME = 0.3
"""So long a vehicle that holds has to be measured just outside the tolerance to be outside [s]."""
STANDSTILL_TIME = 1.0
"""A vehicle that has stood so long [s] will not get nearer by waiting."""
TURNING_TIME = 5.0
"""The same where it may change its direction of motion on its way."""
OVERDUE = 4.0
"""An arrival that is still driven so long [s] after its time to go reached the floor will not get nearer."""
SETTLE_SHARE = 0.5
"""Share of the goal tolerance inside which a braked stop ends the arrival."""
SETTLE_TIME = 0.75
"""A braked stop that ends the arrival takes no longer than this [s]; until then the plan is driven."""
PATIENCE = 5.0
"""A vehicle that stands so long without a first plan [s] says that it failed, and looks less often."""
RESTARTS = 3
"""So often a vehicle that stopped outside the tolerance tries again."""
CUSP_REACH = 0.5
"""A vehicle that stands within this distance of a cusp may pass it [m]."""


# -- looked for in every cycle --------------------------------------------------------------------------


def will_stop_outside(s: ControllerState, context: PlanningContext, config: ControllerConfig) -> bool:
    """Braking to rest it will stop outside: the target has moved away."""
    return not s.stands and not context.inside(context.stop_error)


def stands_outside(s: ControllerState, context: PlanningContext, config: ControllerConfig) -> bool:
    """Standing, it is outside by far, or for a while: noise may show it just there for a moment."""
    since = s.task.outside_since
    if since is None or (s.task.phase is Phase.SETTLING and not s.stands):
        return False
    return context.now - since >= DOUBT_TIME or not context.inside(context.error, 2.0)


def stands_inside(s: ControllerState, context: PlanningContext, config: ControllerConfig) -> bool:
    """It stands inside the tolerance."""
    return s.stands and context.inside(context.error)


def came_to_rest(s: ControllerState, context: PlanningContext, config: ControllerConfig) -> bool:
    """It has come to rest, and is not measured outside."""
    return s.stands and s.task.outside_since is None


def target_moved(s: ControllerState, context: PlanningContext, config: ControllerConfig) -> bool:
    """The target has moved, however slowly, from where it was when the vehicle stalled."""
    stalled_at = s.task.stalled_at
    return stalled_at is None or not context.inside(
        context.target.pose.relative_to(stalled_at.pose), SETTLE_SHARE
    )


def stop_ends_inside(s: ControllerState, context: PlanningContext, config: ControllerConfig) -> bool:
    """Braking in comfort from here it would stop inside the tolerance."""
    stopping = context.speed <= SETTLE_TIME * config.comfort_acceleration
    return stopping and context.inside(context.stop_error, 1.0 if overdue(s, context) else SETTLE_SHARE)


def stuck_inside(s: ControllerState, context: PlanningContext, config: ControllerConfig) -> bool:
    """It does not get nearer, and need not: it is inside the tolerance, or before something in the way."""
    return no_progress(s, context, config) and (not context.free or context.inside(context.error))


def no_tries_left(s: ControllerState, context: PlanningContext, config: ControllerConfig) -> bool:
    """It does not get nearer, and has tried often enough."""
    # Without a planned arrival another try is the same again: only an arrival backs off and comes back.
    return s.task.restarts >= (RESTARTS if config.arrival else 0) and no_progress(s, context, config)


def no_progress(s: ControllerState, context: PlanningContext, config: ControllerConfig) -> bool:
    """It does not get nearer: its arrival is overdue, or it stands for good."""
    return overdue(s, context) or _stuck(s, context)


# -- others ---------------------------------------------------------------------------------------------


def overdue(s: ControllerState, context: PlanningContext) -> bool:
    """Whether the planned arrival should have been long ago."""
    since = None if s.task.arrival is None else s.task.arrival.overdue_since
    return since is not None and context.now - since >= OVERDUE


def standing_since(s: ControllerState, context: PlanningContext) -> float | None:
    """Since when the vehicle stands [s], or None."""
    stood = s.vehicle.standing_since
    speed = max(abs(context.measured_speed), context.own_speed)
    if speed > (STANDSTILL_SPEED if stood is None else MOVING_SPEED):
        return None
    return context.now if stood is None else stood


def outside_since(s: ControllerState, context: PlanningContext) -> float | None:
    """Since when a vehicle that is to stand at its target stands outside the tolerance [s], or None."""
    task = s.task
    if task.phase is not Phase.HOLDING and not (task.phase is Phase.SETTLING and s.stands):
        return task.outside_since
    if not context.free or context.inside(context.error):
        return None
    return context.now if task.outside_since is None else task.outside_since


def may_look_again(s: ControllerState) -> bool:
    """Whether a vehicle that stands before a contact begins afresh: its plan was iterated for a while."""
    return s.stands and s.now - s.task.driving_since >= LOOK_AGAIN


def replan_due(s: ControllerState, context: PlanningContext) -> bool:
    """Whether a vehicle that stands without a plan should look for one in this cycle, or goes on looking."""
    looked_at = s.task.looked_at
    if s.plans.suspended is not None:
        return True
    return looked_at is None or not 0.0 <= context.now - looked_at < LOOK_AGAIN


def may_change_direction(s: ControllerState, context: PlanningContext, dead_time: float) -> bool:
    """Whether the next segment may begin: standing at the end of this one for its dwell, with nothing left in
    the queue."""
    dwell = max(dead_time, s.task.segment.dwell)
    if context.ends_at_goal or not context.free or not s.vehicle.stands(context.now, dwell):
        return False
    if abs(context.measured_speed) > STANDSTILL_SPEED:
        return False
    if context.inside(context.error):
        return True
    return _near(context) and s.vehicle.stands(context.now, max(STANDSTILL_TIME, dwell))


def has_pulled_out(s: ControllerState, context: PlanningContext, dead_time: float) -> bool:
    """Whether a way back is over: at its end, or where there is no getting on."""
    if not s.vehicle.stands(context.now, dead_time):
        return False
    there = context.free and (_near(context) or s.task.phase is Phase.STALLED)
    return there or s.vehicle.stands(context.now, PATIENCE)


def _near(context: PlanningContext) -> bool:
    """Whether the target, a cusp or the end of a way back, is near enough to go on from."""
    return hypot(context.error.x, context.error.y) <= CUSP_REACH


def _stuck(s: ControllerState, context: PlanningContext) -> bool:
    """Whether the vehicle stands for good: an arrival with time to go may begin slowly, or turn about; and
    one that halts for something waits."""
    task = s.task
    standing = s.vehicle.stands(context.now, TURNING_TIME if task.final else STANDSTILL_TIME)
    on_its_way = task.arrival is not None and task.arrival.overdue_since is None
    waits = on_its_way or task.halt is not None
    return standing and not waits and context.now - task.driving_since > STANDSTILL_TIME
