"""When the vehicle contours and when it arrives, and the time planned for that: functions state -> state."""

from __future__ import annotations

from dataclasses import replace
from math import inf

import numpy as np

from rti_mpcc.course.arrival import paced_time, within_reach
from rti_mpcc.course.context import PlanningContext
from rti_mpcc.manoeuvre import SegmentEnd
from rti_mpcc.model.layout import THETA, V
from rti_mpcc.ocp.objectives import ArrivalAtRest, HorizonObjective, apart
from rti_mpcc.ocp.stage_cost import LEAST_TIME
from rti_mpcc.state import Arrival, ControllerState, Phase

LATE_REACH = 2.0  # [m] from its target: nearer, an arrival that is held up keeps its latest end
LATEST = 1.5  # times what the route takes in comfort: an arrival takes no longer
DUE = 0.2  # [s] beyond the shortest time to go: so near its end an arrival is due
TARGET_MOVED = 0.1  # [m]; a target that has moved by more is a new arrival
SOON = 1.0  # [s] within which a plan that drives on does so


def scheduled(s: ControllerState, context: PlanningContext) -> ControllerState:
    """Choose between contouring and a planned arrival. A suspended search is resumed unless the target has
    moved."""
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
