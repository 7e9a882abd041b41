"""When the vehicle passes from one phase to another, and when it contours and when it arrives.

The first line of the docstring of a condition is the text of its event.
"""

from __future__ import annotations

from dataclasses import replace
from math import hypot, inf

import numpy as np

from geometry import Pose2
from rti_mpcc.course.arrival import paced_time, within_reach
from rti_mpcc.course.context import PlanningContext
from rti_mpcc.manoeuvre import SegmentEnd
from rti_mpcc.model.layout import THETA, V
from rti_mpcc.ocp.bounds import PASSED_DISTANCE
from rti_mpcc.ocp.objectives import ArrivalAtRest, HorizonObjective, apart
from rti_mpcc.ocp.stage_cost import LEAST_TIME
from rti_mpcc.state import Arrival, ControllerState, Hold, Phase
from rti_mpcc.world import goal_setpoint, standstill

STANDSTILL_TIME = 1.0  # [s] at rest, after which waiting brings the vehicle no nearer
TURNING_TIME = 5.0  # [s], the same where it may change its direction of motion on its route
OVERDUE_TIME = 4.0  # [s] beyond LEAST_TIME: the arrival comes no nearer, even if noise hides a standstill
OUTSIDE_TIME = 0.3  # [s] just outside the tolerance, after which a vehicle that holds is outside,
OUTSIDE_SHARE = 2.0  # or beyond this times the tolerance
MOVED_SHARE = 1.0 / 3.0  # of the tolerance, by which a docked vehicle or its dock has moved if it is outside
SETTLE_SHARE = 0.5  # of the tolerance: inside, a braked stop ends the arrival; a stalled vehicle sees no move
DUE_SHARE = 0.8  # of the tolerance, for a braked stop that ends an arrival that is due
SETTLE_TIME = 0.75  # [s] that a braked stop which ends the arrival takes, at most
DUE_TIME = 0.3  # [s] with the shortest time to go, after which an arrival is due
CUSP_REACH = 0.5  # [m] from a cusp, within which a vehicle that stands may go on
REPLAN_INTERVAL = 0.5  # [s] between two searches for a plan, at least
STANDOFF_TOLERANCE = 0.3  # a vehicle that stands so much farther off than the standoff waits there [m]
GIVE_UP_TIME = 5.0  # [s] at rest without a first plan: the vehicle says that it failed, looks less often

# -- asked in every cycle -------------------------------------------------------------------------------


def will_stop_outside(s: ControllerState, context: PlanningContext) -> bool:
    """It will stop outside the tolerance: the target has moved away."""
    return not s.vehicle.stands and not context.inside(context.stop_error)


def stands_outside(s: ControllerState, context: PlanningContext) -> bool:
    """It stands outside the tolerance, by far or for a while: noise may show it there for a moment."""
    since = s.task.outside_since
    if since is None or (s.task.phase is Phase.SETTLING and not s.vehicle.stands):
        return False
    hold, error = s.task.hold, context.error
    if hold is not None and hold.docked is None:
        return context.now - since >= OUTSIDE_TIME
    noise = 0.0 if hold is None else standstill.NOISE * s.vehicle.motion.noise[0]
    far = not context.inside(error, OUTSIDE_SHARE) and hypot(error.x, error.y) >= noise
    return context.now - since >= OUTSIDE_TIME or far


def stands_inside(s: ControllerState, context: PlanningContext) -> bool:
    """It stands inside the tolerance."""
    return s.vehicle.stands and context.inside(context.standing_error)


def stands_well_inside(s: ControllerState, context: PlanningContext) -> bool:
    """It stands well inside the tolerance: noise does not show it outside."""
    return s.vehicle.stands and context.inside(context.standing_error, SETTLE_SHARE)


def came_to_rest(s: ControllerState, context: PlanningContext) -> bool:
    """It has come to rest and is not measured outside the tolerance."""
    return s.vehicle.stands and s.task.outside_since is None


def passes_target(s: ControllerState, context: PlanningContext) -> bool:
    """It has passed its target, or will although it brakes, by more than an arrival can come back."""
    if not (context.config.arrival and s.task.segment.objective.arrives) or s.task.end is SegmentEnd.STOP:
        return False
    if s.task.phase is Phase.STARTING and s.vehicle.stands:
        return False  # it replans at once
    left = context.along - context.speed**2 / (2.0 * context.config.firm_deceleration)
    return left < -PASSED_DISTANCE


def target_moved(s: ControllerState, context: PlanningContext) -> bool:
    """The target has moved since the vehicle stalled, and is not behind it."""
    stalled_at = s.task.stalled_at
    assert stalled_at is not None
    if passes_target(s, context):
        return False
    return not context.target.pose.relative_to(stalled_at[0]).within(context.tolerance, SETTLE_SHARE)


def surroundings_changed(s: ControllerState, context: PlanningContext) -> bool:
    """The static obstacles have changed since it stalled, and it has stood there for a while."""
    stalled_at = s.task.stalled_at
    assert stalled_at is not None
    return stalled_at[1] != s.area.changes and s.vehicle.is_stationary(context.now, GIVE_UP_TIME)


def stop_ends_inside(s: ControllerState, context: PlanningContext) -> bool:
    """Braking in comfort from here, it stops inside the tolerance."""
    if context.speed > SETTLE_TIME * context.config.comfort_acceleration:
        return False
    due = _due_for(s, context)
    share = DUE_SHARE if due >= DUE_TIME else SETTLE_SHARE
    share = 1.0 if due >= (DUE_TIME if s.vehicle.stands else OVERDUE_TIME) else share
    return context.inside(context.stop_error, share)


def stuck_inside(s: ControllerState, context: PlanningContext) -> bool:
    """It gets no nearer, and is inside the tolerance, or at a stop in front of something."""
    enough = s.task.end is SegmentEnd.STOP or (s.vehicle.stands and context.inside(context.error))
    return enough and no_progress(s, context)


def no_progress(s: ControllerState, context: PlanningContext) -> bool:
    """It gets no nearer: its arrival is overdue, or it stands for long, and not for its dwell."""
    there = s.task.end is SegmentEnd.CUSP and _near(context)
    if there and s.task.segment.dwell > 0.0 and s.vehicle.stands:
        return False  # it waits for its dwell, near enough to the end of this segment
    return _due_for(s, context) >= OVERDUE_TIME or _stuck(s, context)


def plan_misses(s: ControllerState, context: PlanningContext) -> bool:
    """Its arrival is due, and its plan ends outside the tolerance."""
    plan = s.plans.driven
    if s.route is None or s.route.fixed or plan is None or s.task.end is SegmentEnd.STOP:
        return False
    due = _due_for(s, context) >= DUE_TIME
    return due and not (context.reached_by(plan) or context.inside(context.stop_error))


# -- others ---------------------------------------------------------------------------------------------


def _due_for(s: ControllerState, context: PlanningContext) -> float:
    """For how long the planned arrival has had its shortest time to go [s]; -inf: it has not."""
    since = None if s.task.arrival is None else s.task.arrival.overdue_since
    return -inf if since is None else context.now - since


def standing_since(s: ControllerState, context: PlanningContext) -> float | None:
    """Since when the vehicle stands [s], or None.

    By its poses, too, if its speed has just changed otherwise than expected, as in a sensor's dead band.
    """
    config = context.config
    speeds = context.measured_speed, float(context.state[V])
    motion, stood = s.vehicle.motion, s.vehicle.standing_since
    docks = s.task.end is SegmentEnd.GOAL and s.task.phase in (Phase.SETTLING, Phase.HOLDING)
    least = standstill.dock_speed(context.tolerance, config) if docks else config.rest_speed
    since = standstill.update_standing(stood, speeds, context.now, least)
    if since is None or stood is not None or motion.unexplained() <= config.moving_speed:
        return since
    by_poses = motion.speed_beyond_noise(standstill.FEWEST * config.cycle)
    return standstill.update_standing(None, (by_poses,), context.now, least)


def outside_since(s: ControllerState, context: PlanningContext) -> float | None:
    """Since when a vehicle that settles or holds stands outside the tolerance [s], or None."""
    task = s.task
    if task.hold is not None:
        away = _is_away(task.hold, context)
    elif task.phase is Phase.SETTLING and not s.vehicle.stands:
        return task.outside_since
    else:
        near = context.inside(context.error, OUTSIDE_SHARE) and context.inside(context.standing_error)
        away = task.end is not SegmentEnd.STOP and not near
    since = context.now if task.outside_since is None else task.outside_since
    return since if away else None


def _is_away(hold: Hold, context: PlanningContext) -> bool:
    """Whether a vehicle that is held is outside the tolerance.

    Once docked, it or the dock must have moved: noise is no motion.
    Before, a drive that lags may `swing`, but not where the goal has moved away from where it is held.
    """
    error, mean = context.error, context.standing_error
    if hold.docked is None:
        length, across, turned = context.tolerance
        held = abs(hold.anchor.relative_to(context.target.pose).x) <= standstill.DOCK_SHARE * length
        return not held or abs(error.x) > swing(context) or abs(error.y) > across or abs(error.phi) > turned
    before = hold.docked
    since = Pose2(mean.x - before.x, mean.y - before.y, mean.phi - before.phi)
    moved = not context.inside(mean) and not since.within(context.tolerance, MOVED_SHARE)
    return moved or not context.inside(error, OUTSIDE_SHARE)


def swing(context: PlanningContext) -> float:
    """By how much a vehicle that is held may swing along its axis [m]."""
    return max(OUTSIDE_SHARE * context.tolerance[0], context.config.clearance.least)


def replan_due(s: ControllerState, context: PlanningContext) -> bool:
    """Whether a vehicle without a plan, or a cruise without an arrival, looks for one in this cycle."""
    last_attempt = s.task.last_attempt
    if s.plans.suspended is not None:
        return True
    return last_attempt is None or not 0.0 <= context.now - last_attempt < REPLAN_INTERVAL


def may_change_direction(s: ControllerState, context: PlanningContext) -> bool:
    """Whether the next segment may start: at rest at the end of this one for its dwell, or long near it."""
    dwell = max(s.vehicle.dead_time, s.task.segment.dwell)
    if s.task.end is not SegmentEnd.CUSP or not s.vehicle.is_stationary(context.now, dwell):
        return False
    if abs(context.measured_speed) > context.config.rest_speed:
        return False
    if context.inside(context.error):
        return True
    if s.on_planned_route:
        return False
    long = s.vehicle.is_stationary(context.now, max(STANDSTILL_TIME, dwell))
    return long and _near(context)


def _near(context: PlanningContext) -> bool:
    """Whether the target, a cusp, is near enough to go on from."""
    return hypot(context.error.x, context.error.y) <= CUSP_REACH * context.config.size


def _stuck(s: ControllerState, context: PlanningContext) -> bool:
    """Whether the vehicle stands for good: an arrival may start slowly, and a halting vehicle waits."""
    task = s.task
    long = STANDSTILL_TIME if task.objective.along_path else TURNING_TIME
    if task.arrival is not None and task.arrival.overdue_since is None:
        # It begins as slowly as its comfort has it.
        long = TURNING_TIME + context.config.moving_speed / context.config.arrival_acceleration
    standing = s.vehicle.is_stationary(context.now, long)
    return standing and task.yielding is None and context.now - task.driving_since > STANDSTILL_TIME


def must_wait(s: ControllerState, context: PlanningContext) -> str:
    """Why the vehicle must stop now before a goal that is not known well enough, or ""."""
    config = context.config
    if s.vehicle.stands and goal_setpoint.waits_for_dock(s.goal, config):
        return goal_setpoint.doubt(s, s.arrives_at, config)
    if s.task.end is not SegmentEnd.GOAL:
        return ""
    brake = context.speed**2 / (2.0 * config.comfort_acceleration)
    tracking = config.goal_tracking
    if not s.goal.waiting and context.distance > tracking.standoff + max(brake, STANDOFF_TOLERANCE):
        return ""
    return goal_setpoint.doubt(s, s.arrives_at, config)


# -- when it arrives, and the time planned for that: functions state -> state ---------------------------

LATE_REACH = 2.0  # [m] from its target: nearer, an arrival that is held up keeps its latest end
LATEST = 1.5  # times what the route takes in comfort: an arrival takes no longer
DUE = 0.2  # [s] beyond the shortest time to go: so near its end an arrival is due
TARGET_MOVED = 0.1  # [m]; a target that has moved by more is a new arrival
SOON = 1.0  # [s] within which a plan that drives on does so


def scheduled(s: ControllerState, context: PlanningContext) -> ControllerState:
    """Contouring or a planned arrival; that of a suspended search as long as the target has not moved."""
    started = s.plans.suspended
    if started is not None and apart(started.target.pose, context.target.pose) <= TARGET_MOVED:
        return replace(s, task=replace(s.task, arrival=started.arrival))
    s = s.suspending(None)
    arrival = _arrival(context) if arrives(s, context) else None
    return replace(s, task=replace(s.task, arrival=arrival))


def rescheduled(s: ControllerState, context: PlanningContext) -> ControllerState:
    """Find out whether the arrival is due; a target that has moved, a halt and lost cycles renew its latest
    end, and so does a vehicle that is held up."""
    arrival, pose, ends = s.task.arrival, context.target.pose, s.arrives_at
    if s.task.phase is not Phase.ARRIVING or arrival is None or ends is None:
        return s
    moved = apart(arrival.timed_for, pose) > TARGET_MOVED
    lost = bool(s.queue) and context.start_time - s.queue[-1].begins > context.config.longest_cycle
    if moved or lost or s.task.yielding is not None or _held_up(s, context):
        later = _arrival(context, arrival.objective.latest)
    else:
        due = ends - context.start_time <= LEAST_TIME + DUE
        since = (context.now if arrival.overdue_since is None else arrival.overdue_since) if due else None
        if since == arrival.overdue_since:
            return s
        later = replace(arrival, overdue_since=since)
    return replace(s, task=replace(s.task, arrival=later))


def successor_due(s: ControllerState, context: PlanningContext) -> HorizonObjective | None:
    """The objective that takes over from here on, by the way left along the path, or None."""
    left = context.target.stop - float(context.state[THETA])
    return None if s.task.end is SegmentEnd.STOP else s.task.objective.successor(left)


def too_late(s: ControllerState, context: PlanningContext) -> bool:
    """Whether a contouring vehicle must brake now for a target that it has no arrival for yet."""
    needed = context.speed**2 / (2.0 * context.config.comfort_acceleration)
    contouring = s.task.phase is Phase.CONTOURING and s.task.objective.along_path
    return contouring and context.distance <= needed


def _held_up(s: ControllerState, context: PlanningContext) -> bool:
    """Whether a vehicle far from its target stands although its plan drives: it is held from outside."""
    stood, plan = s.vehicle.standing_since, s.plans.driven
    if stood is None or stood <= s.task.driving_since or plan is None:
        return False
    soon = int(np.searchsorted(plan.times, context.start_time + SOON))
    drives = abs(float(plan.states[min(soon, len(plan.states) - 1), V])) > context.config.moving_speed
    return drives and context.distance > LATE_REACH


def arrives(s: ControllerState, context: PlanningContext) -> bool:
    """Whether one planned arrival is to bring the vehicle to its target from here."""
    if not (context.config.arrival and s.task.segment.objective.arrives):
        return False
    theta = float(context.state[THETA])
    return within_reach(context.distance, context.speed, context.config, context.profile, theta)


def duration(context: PlanningContext) -> float:
    """What the arrival is expected to take from here [s]."""
    theta = float(context.state[THETA])
    return paced_time(context.distance, context.speed, context.config, context.profile, theta)


def _arrival(context: PlanningContext, latest: float = -inf) -> Arrival:
    """At the target, from here; it may end as late as `latest` [s] in any case."""
    latest = max(context.start_time + LATEST * duration(context), latest)
    return Arrival(objective=ArrivalAtRest(latest=latest), timed_for=context.target.pose)
