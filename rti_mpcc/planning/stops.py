"""Stops before what fills the way: when one is needed, and when it is worth looking past it again."""

from __future__ import annotations

from dataclasses import replace
from math import inf

from rti_mpcc.config import Caution, ControllerConfig
from rti_mpcc.model.layout import THETA
from rti_mpcc.planning.context import PlanningContext
from rti_mpcc.planning.schedule import apart
from rti_mpcc.planning.state import ControllerState, Halt, Phase


def halted(halt: Halt | None, distance: float, needed: float, now: float, caution: Caution) -> Halt | None:
    """Whether the vehicle brakes, or stands, for what its plan meets after `distance` [m] (inf: nothing).

    It does so from when that is within what is `needed` to stop [m], until its way was clear of that, and
    `clear_distance` more, for `clear_time`.
    """
    if distance <= needed:
        return Halt()
    if halt is None:
        return None
    if distance <= needed + caution.clear_distance:
        return Halt()
    since = now if halt.clear_since is None else halt.clear_since
    return None if now - since >= caution.clear_time else replace(halt, clear_since=since)


def is_old(s: ControllerState, config: ControllerConfig) -> bool:
    """Whether the plan being driven has to be iterated before the search for another one goes on."""
    accepted = s.plans.accepted_at
    if s.plans.suspended is None or s.task.halt is not None or accepted is None:
        return False
    return s.now - accepted > config.search.plan_age


def unconfirmed(s: ControllerState) -> bool:
    """Whether a stop is made for past which no way was sought yet."""
    return s.task.stop is not None and s.task.stop.obstacles is None


def confirmed(s: ControllerState) -> ControllerState:
    """There is no way past the stop that is made for."""
    assert s.task.stop is not None
    stop = replace(s.task.stop, goal=s.goal.pose, obstacles=s.area.changes, since=s.now)
    return replace(s.suspending(None), task=s.task.with_stop(stop))


def still_filled(s: ControllerState) -> ControllerState:
    """Another plan than the one to the stop was looked for in vain: not again at once."""
    stop = s.task.stop
    return s if stop is None else replace(s, task=s.task.with_stop(replace(stop, since=s.now)))


def found_clear(s: ControllerState) -> ControllerState:
    """The driven plan is clear of what has changed: no way round that, or stop before it, is looked for."""
    begun = s.plans.suspended
    for_arrival = begun is not None and begun.segment.stop == s.task.stop and s.task.phase is Phase.CONTOURING
    plans = replace(s.plans, clear_of=s.area.changes, suspended=begun if for_arrival else None)
    return replace(s, plans=plans)


def in_view(s: ControllerState, context: PlanningContext, config: ControllerConfig) -> float:
    """Progress [m] up to which a cruise that is sought now would count what stands in its way; -inf for an
    arrival, which is planned to its end."""
    if s.plans.driven is None or s.task.arrival is not None:
        return -inf
    horizon, comfort = config.cruise_horizon, config.comfort_acceleration
    lacking = max(config.cruise_speed - context.speed, 0.0)
    still_lacking = max(lacking - comfort * horizon, 0.0)
    way = horizon * config.cruise_speed - 0.5 * (lacking**2 - still_lacking**2) / comfort
    return float(context.state[THETA]) + config.search.seen_share * way


def looked(s: ControllerState, context: PlanningContext, config: ControllerConfig) -> ControllerState:
    """What had come into view was counted: not again before the vehicle has gone on by a body's length."""
    vehicle = config.vehicle
    seen_to = in_view(s, context, config) + vehicle.front + vehicle.rear
    return replace(s, plans=replace(s.plans, seen_to=seen_to))


def way_may_be_free(s: ControllerState, config: ControllerConfig) -> bool:
    """Whether it is worth looking again if something still fills the way."""
    stop, goal = s.task.stop, s.goal.pose
    if stop is None or s.now - stop.since < config.retries.replan_interval:
        return False
    before, most = stop.goal, config.arrival_timing.target_moved
    elsewhere = before is not goal if before is None or goal is None else apart(before, goal) > most
    return elsewhere or stop.obstacles != s.area.changes
