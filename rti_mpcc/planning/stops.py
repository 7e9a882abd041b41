"""Stops in front of what blocks the route: when one is needed, and when a route past it is searched again."""

from __future__ import annotations

from dataclasses import replace
from math import inf

from rti_mpcc.config import ControllerConfig
from rti_mpcc.model.layout import THETA
from rti_mpcc.planning.context import PlanningContext
from rti_mpcc.planning.obstacles import CLEAR_TIME
from rti_mpcc.planning.schedule import TARGET_MOVED, apart
from rti_mpcc.planning.state import ControllerState, Halt, Phase

CLEAR_DISTANCE = 0.5  # [m] that have to be clear beyond what a stop needs, to drive on
REPLAN_INTERVAL = 0.5  # [s] between two looks whether the route is clear again, or whether there is a plan
SEEN_SHARE = 0.5  # of a cruise's plan up to which an obstacle counts: it ends in mid-way
PLAN_AGE = 0.2  # [s]; an older plan is iterated before a search (docs/decisions/06-sliced-solves.md)


def halted(halt: Halt | None, distance: float, needed: float, now: float) -> Halt | None:
    """The halt for a contact of the plan after `distance` [m] (inf: none): from when a stop `needed` [m] so
    much, until the plan was clear for that, and `CLEAR_DISTANCE` more, for `CLEAR_TIME`."""
    if distance <= needed:
        return Halt()
    if halt is None:
        return None
    if distance <= needed + CLEAR_DISTANCE:
        return Halt()
    since = now if halt.clear_since is None else halt.clear_since
    return None if now - since >= CLEAR_TIME else replace(halt, clear_since=since)


def is_old(s: ControllerState) -> bool:
    """Whether the plan being driven has to be iterated before the search for another one goes on."""
    accepted = s.plans.accepted_at
    if s.plans.suspended is None or s.task.halt is not None or accepted is None:
        return False
    return s.now - accepted > PLAN_AGE


def unconfirmed(s: ControllerState) -> bool:
    """Whether no route past the stop was searched yet."""
    return s.task.stop is not None and s.task.stop.obstacles is None


def confirmed(s: ControllerState) -> ControllerState:
    """There is no route past the stop."""
    assert s.task.stop is not None
    stop = replace(s.task.stop, goal=s.goal.pose, obstacles=s.area.changes, since=s.now)
    return replace(s.suspending(None), task=s.task.with_stop(stop))


def still_filled(s: ControllerState) -> ControllerState:
    """No other plan than the one to the stop was found: not again at once."""
    stop = s.task.stop
    return s if stop is None else replace(s, task=s.task.with_stop(replace(stop, since=s.now)))


def found_clear(s: ControllerState) -> ControllerState:
    """The driven plan is clear of what has changed: neither a route past it nor a stop is searched."""
    begun = s.plans.suspended
    for_arrival = begun is not None and begun.segment.stop == s.task.stop and s.task.phase is Phase.CONTOURING
    plans = replace(s.plans, clear_of=s.area.changes, suspended=begun if for_arrival else None)
    return replace(s, plans=plans)


def in_view(s: ControllerState, context: PlanningContext, config: ControllerConfig) -> float:
    """Progress [m] up to which static obstacles count for a cruise from now on; -inf for an arrival, which is
    planned to its end."""
    if s.plans.driven is None or s.task.arrival is not None:
        return -inf
    horizon, comfort = config.cruise_horizon, config.comfort_acceleration
    lacking = max(config.cruise_speed - context.speed, 0.0)
    still_lacking = max(lacking - comfort * horizon, 0.0)
    way = horizon * config.cruise_speed - 0.5 * (lacking**2 - still_lacking**2) / comfort
    return float(context.state[THETA]) + SEEN_SHARE * way


def looked(s: ControllerState, context: PlanningContext, config: ControllerConfig) -> ControllerState:
    """What came into view was counted: not again before the vehicle has driven a body's length."""
    vehicle = config.vehicle
    seen_to = in_view(s, context, config) + vehicle.front + vehicle.rear
    return replace(s, plans=replace(s.plans, seen_to=seen_to))


def way_may_be_free(s: ControllerState) -> bool:
    """Whether it is worth checking again if the route is still blocked."""
    stop, goal = s.task.stop, s.goal.pose
    if stop is None or s.now - stop.since < REPLAN_INTERVAL:
        return False
    before = stop.goal
    elsewhere = before is not goal if before is None or goal is None else apart(before, goal) > TARGET_MOVED
    return elsewhere or stop.obstacles != s.area.changes
