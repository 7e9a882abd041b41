"""When the vehicle contours and when it arrives, and the time planned for that: functions state -> state."""

from __future__ import annotations

from dataclasses import replace
from math import hypot, sqrt

import numpy as np

from geometry import Pose2
from rti_mpcc.config import ControllerConfig
from rti_mpcc.model.layout import DELTA, DELTA_DOT, THETA, A, V
from rti_mpcc.ocp.objectives import HorizonObjective
from rti_mpcc.planning.arrival import LEAST_TIME, arrival_time, time_along, within_reach
from rti_mpcc.planning.context import PlanningContext
from rti_mpcc.planning.speed_profile import FLAT
from rti_mpcc.planning.standstill import moving_speed
from rti_mpcc.planning.state import Arrival, ControllerState, Phase
from rti_mpcc.types import Trajectory

LATE_REACH = 2.0  # [m] from its target: nearer, an arrival keeps its time
HURRY_FROM = 0.03  # of its time: a plan that lacks more in comfort gets more
HURRY = 0.2  # of its time that a plan lacks, for a second more each second
SLACK = 0.9  # of its time: a plan that needs less in comfort, and has more than its route takes, gets less
CATCHING_UP = 0.5  # [s] each second, at most
TARGET_MOVED = 0.1  # [m]; a target that has moved by more is a new arrival
KEPT_SHARE = 0.5  # of what the route takes: with less an arrival has too little time, or the vehicle is slow
DUE_SHARE = 0.8  # of the tolerance, for a braked stop that ends an arrival that is due

SOON = 1.0  # [s] within which a plan that drives on does so


def scheduled(s: ControllerState, context: PlanningContext, config: ControllerConfig) -> ControllerState:
    """Choose between contouring and a planned arrival.

    A suspended search is resumed unless the target has moved; if its arrival has become far too short, it
    gets the time that it takes.
    """
    started, pose = s.plans.suspended, context.target.pose
    if started is not None and apart(started.target.pose, pose) <= TARGET_MOVED:
        arrival = started.arrival
        if arrival is not None:
            at, duration = arrival.at, _duration(context, config)
            if at - context.start_time < KEPT_SHARE * duration:
                at = context.start_time + duration
            arrival = replace(arrival, at=at, timed_for=pose, overdue_since=None)
        return replace(s, task=replace(s.task, arrival=arrival))
    s = s.suspending(None)
    if not arrives(s, context, config):
        return replace(s, task=replace(s.task, arrival=None))
    arrival = Arrival(at=context.start_time + _duration(context, config), timed_for=pose)
    return replace(s, task=replace(s.task, arrival=arrival))


def rescheduled(s: ControllerState, context: PlanningContext, config: ControllerConfig) -> ControllerState:
    """Let the time to the arrival fall to its least value; a target that has moved is a new arrival.

    After a halt or lost cycles, or held up, it gets the time that its route takes; else `_followed`.
    """
    arrival = s.task.arrival
    if s.task.phase is not Phase.ARRIVING:
        return s
    assert arrival is not None
    begin, pose = context.start_time, context.target.pose
    moved = apart(arrival.timed_for, pose) > TARGET_MOVED
    lost = bool(s.queue) and begin - s.queue[-1].begins > config.longest_cycle
    lost = lost or _held_up(s, context, config)
    if moved or lost or s.task.yielding is not None:
        due = begin + _duration(context, config)
        at = due if moved else min(max(due, arrival.at), begin + longest_arrival(context, config))
        later = replace(arrival, at=at, timed_for=pose if moved else arrival.timed_for, overdue_since=None)
    elif arrival.at >= begin + LEAST_TIME:
        at = _followed(arrival.at, s.plans.driven, context, config)
        if at > arrival.at:
            at = min(at, max(arrival.at, begin + longest_arrival(context, config)))
        if at == arrival.at and arrival.overdue_since is None:
            return s
        later = replace(arrival, at=at, overdue_since=None)
    else:
        since = context.now if arrival.overdue_since is None else arrival.overdue_since
        later = replace(arrival, at=begin + LEAST_TIME, overdue_since=since)
    return replace(s, task=replace(s.task, arrival=later))


def calmed(s: ControllerState, context: PlanningContext, config: ControllerConfig) -> ControllerState:
    """The arrival of a brisk ride with the time of a smooth one, once: its first plan misses the target."""
    arrival = s.task.arrival
    if arrival is None or arrival.calm or config.ride != "brisk":
        return s
    at = max(arrival.at, context.start_time + _duration(context, config, calm=True))
    return replace(s, task=replace(s.task, arrival=replace(arrival, at=at, calm=True)))


def successor_due(s: ControllerState, context: PlanningContext) -> HorizonObjective | None:
    """The objective that takes over from here on, by the way left along the path, or None."""
    left = context.target.stop - float(context.state[THETA])
    return s.task.objective.successor(left) if context.free else None


def too_late(s: ControllerState, context: PlanningContext, config: ControllerConfig) -> bool:
    """Whether a contouring vehicle must brake now for a target that it has no arrival for yet."""
    needed = context.speed**2 / (2.0 * config.comfort_acceleration)
    contouring = s.task.phase is Phase.CONTOURING and s.task.objective.along_path
    return contouring and context.distance <= needed


def _held_up(s: ControllerState, context: PlanningContext, config: ControllerConfig) -> bool:
    """Whether a vehicle far from its target stands although its plan drives: it is held from outside."""
    stood, plan = s.vehicle.standing_since, s.plans.driven
    if stood is None or stood <= s.task.driving_since or plan is None:
        return False
    soon = int(np.searchsorted(plan.times, context.start_time + SOON))
    drives = abs(float(plan.states[min(soon, len(plan.states) - 1), V])) > moving_speed(config)
    return drives and context.distance > LATE_REACH


def longest_arrival(context: PlanningContext, config: ControllerConfig) -> float:
    """Time [s] that an arrival may take: twice that from rest, at the lowest pace of the segment."""
    distance, lowest = context.distance, float(context.profile.speed.min())
    return 2.0 * (arrival_time(distance, 0.0, config) + distance / lowest)


def apart(one: Pose2, other: Pose2) -> float:
    """Distance [m]."""
    return hypot(one.x - other.x, one.y - other.y)


def arrives(s: ControllerState, context: PlanningContext, config: ControllerConfig) -> bool:
    """Whether one planned arrival is to bring the vehicle to its target from here."""
    if not (config.arrival and s.task.segment.objective.arrives):
        return False
    theta = float(context.state[THETA])
    return within_reach(context.distance, context.speed, config, context.profile, theta)


def _duration(context: PlanningContext, config: ControllerConfig, *, calm: bool = False) -> float:
    """What the arrival takes from here [s]; calm: that of a smooth ride."""
    distance = context.distance
    highest = context.profile.ahead(float(context.state[THETA]), distance)
    return arrival_time(distance, context.speed, config, highest, calm=calm)


def _followed(
    at: float, plan: Trajectory | None, context: PlanningContext, config: ControllerConfig
) -> float:
    """The time of an arrival [s] that was planned for `at`, after a cycle of the driven plan: only its rate,
    `_change`, has steps. A slow vehicle, or one near its target, keeps the time, which becomes overdue."""
    distance = context.distance
    if plan is None or distance <= LATE_REACH:
        return at
    highest = float(context.profile.at(context.state[THETA]))
    usual = min(distance / arrival_time(distance, context.speed, config), highest)
    if context.speed < KEPT_SHARE * usual:
        return at
    change = _change(at - context.start_time, plan, context, config)
    return at + config.cycle * min(max(change, -CATCHING_UP), 1.0)


def _change(left: float, plan: Trajectory, context: PlanningContext, config: ControllerConfig) -> float:
    """Rate of change of the time of an arrival that has `left` [s] to go, (T5).

    With tau of `pressed`, later if tau > 1; sooner if tau < `SLACK` and more time is left than the route
    takes by that share. A brisk ride has the time of `own_time` and a ramp of (T6), and more if its plan
    misses the target, but no more than a smooth one.
    """
    factor = pressed(plan, config)
    if factor > 1.0 + HURRY_FROM:
        return (factor - 1.0) / HURRY
    if config.ride == "brisk":
        share = DUE_SHARE
        if not context.reached_by(plan, share) and left < _duration(context, config, calm=True):
            return 1.0
        ramp = config.arrival_acceleration / config.comfort.jerk
        late = ramp - (left - own_time(plan, context.speed, config))
        if late > 0.0:
            return late / HURRY
        return late if context.reached_by(plan, SLACK * share) else 0.0
    if factor < SLACK and SLACK * left > _duration(context, config):
        return (factor / SLACK - 1.0) / HURRY
    return 0.0


def own_time(plan: Trajectory, speed: float, config: ControllerConfig) -> float:
    """Least time [s] in comfort of the way that a plan leads, by its own bends: (T6) without its ramps."""
    comfort, states, lengths = config.comfort, plan.states, np.diff(plan.times)
    ways = np.maximum(0.5 * np.abs(states[1:, V] + states[:-1, V]) * lengths, FLAT)
    curvature = np.abs(np.tan(states[1:, DELTA])) / config.vehicle.wheelbase
    across = np.sqrt(comfort.lateral_acceleration / np.maximum(curvature, FLAT))
    turning = comfort.steering_rate * ways / np.maximum(np.abs(np.diff(states[:, DELTA])), FLAT)
    highest = np.minimum(np.minimum(across, turning), config.limits.speed)
    return time_along(ways, speed, config.arrival_acceleration, highest)


def pressed(plan: Trajectory, config: ControllerConfig) -> float:
    """Factor tau on the time of a plan that keeps comfort: accelerations go with 1/tau², rates 1/tau."""
    comfort, controls, states = config.comfort, np.abs(plan.controls), plan.states
    lateral = np.abs(states[:, V] ** 2 * np.tan(states[:, DELTA])).max() / config.vehicle.wheelbase
    along = float(controls[:, A].max()) / comfort.acceleration
    across = float(lateral) / comfort.lateral_acceleration
    return max(sqrt(along), sqrt(across), float(controls[:, DELTA_DOT].max()) / comfort.steering_rate)
