"""What is in the way of the vehicle, of a plan, or of a stop: the exact checks, by the state of a cycle."""

from __future__ import annotations

from math import inf

import numpy as np

from rti_mpcc.config import ControllerConfig
from rti_mpcc.model.footprint import body_of
from rti_mpcc.model.layout import V
from rti_mpcc.ocp.horizon import stage_lengths, stage_times
from rti_mpcc.planning import stops
from rti_mpcc.planning.context import PlanningContext
from rti_mpcc.planning.plausibility import by_commands
from rti_mpcc.planning.state import ControllerState
from rti_mpcc.safety import contact, fallback
from rti_mpcc.safety.contact import Overlap
from rti_mpcc.safety.naming import Met, met_by
from rti_mpcc.safety.stopping import stopping_along, stopping_motion
from rti_mpcc.types import Trajectory

BRAKING_OFFSET = (0.2, 0.1)  # [m], [rad]; a plan that passes farther from the vehicle is not braked along
LEAST_DECELERATION = 1e-3  # [m/s²] of a motion that is checked


def overlap(s: ControllerState, context: PlanningContext, config: ControllerConfig) -> Overlap | None:
    """What the body overlaps, where it is believed to be now or until the command begins to act."""
    believed, part = s.vehicle.monitor.state, s.task.segment.index
    if believed is None:
        return None
    half = s.now + 0.5 * config.dead_time
    middle = by_commands(believed, s.queue, s.now, half, config, s.vehicle.disturbance)
    states = np.array((believed, middle, context.state))
    return contact.overlap(states, s.area, part, config)


def distance_to_contact(
    s: ControllerState,
    plan: Trajectory,
    config: ControllerConfig,
    reach: float = inf,
    least: float = 0.0,
) -> float:
    """Distance along a plan to where it is nearer than `least` to what stands [m], or inf."""
    return contact.distance_to_contact(
        plan, s.area.corridor, s.task.segment.index, config, reach, least=least
    )


def met_at(s: ControllerState, theta: float, config: ControllerConfig) -> Met:
    """What a body on the path meets at this progress [m]."""
    pose = s.task.segment.part.pose(theta)
    return met_by(np.array([pose.x, pose.y, pose.phi]), s.area, s.task.segment.index, config)


def comes_into_view(s: ControllerState, context: PlanningContext, config: ControllerConfig) -> bool:
    """Whether an obstacle on the path has come as near to a cruise as it counts.

    A cruise that did not know it would come to rest wherever that is farthest along the path.
    """
    if not s.area.corridor.obstacles:
        return False
    at = stops.in_view(s, context, config)
    if at <= s.plans.seen_to:
        return False
    reference = s.task.segment.part.reference(np.array([at]))
    pose = np.column_stack([reference.x, reference.y, reference.phi])
    part, least = s.task.segment.index, config.clearance.least
    apart = s.area.corridor.signed_distances(part, body_of(config.vehicle), pose, least)
    return bool((apart[0, 1:] <= least).any())


def distance_to_moving(
    s: ControllerState, plan: Trajectory, config: ControllerConfig, reach: float = inf, later: float = 0.0
) -> float:
    """Distance along a plan, begun `later` [s], to what may be met of what moves [m], or inf."""
    ahead = s.now - s.area.given_at + later
    return contact.distance_to_moving(plan, s.area.moving, ahead, config, reach)


def clear_distance_on(
    s: ControllerState,
    plan: Trajectory,
    config: ControllerConfig,
    reach: float = inf,
    later: float = 0.0,
) -> float:
    """Distance along a plan to where it is not clear of what stands or moves [m], or inf."""
    least = config.clearance.least
    return min(
        distance_to_moving(s, plan, config, reach, later),
        distance_to_contact(s, plan, config, reach, least),
    )


def braking(
    context: PlanningContext, deceleration: float, config: ControllerConfig, along: Trajectory | None = None
) -> Trajectory:
    """The motion of a vehicle that brakes at `deceleration` [m/s²], along a plan where it is near it."""
    lengths = stage_lengths(config.cruise_horizon, config.cycle, config.stages)
    times = stage_times(context.begin, lengths)
    motion = None
    if along is not None:
        near = BRAKING_OFFSET
        motion = stopping_along(along, context.state, times, deceleration, near)
    return motion or stopping_motion(context.state, times, deceleration, config.vehicle.wheelbase)


def slowing(context: PlanningContext, plan: Trajectory, config: ControllerConfig) -> Trajectory:
    """The motion that stands after all of the way that is looked at for a stop, along a plan."""
    speed = float(context.state[V])
    need = contact.stopping_distance(speed, config)
    deceleration = max(speed**2 / (2.0 * need), LEAST_DECELERATION)
    return braking(context, deceleration, config, plan)


def braking_in_time(
    s: ControllerState,
    context: PlanningContext,
    wanted: float,
    config: ControllerConfig,
    along: Trajectory | None = None,
) -> tuple[Trajectory, float]:
    """The gentlest braking to stand before what is met, and its deceleration [m/s²], `wanted` at least.

    `along`: a plan to brake along, where that is as gentle as with the steering held.
    """
    speed, found = float(context.state[V]), []
    for plan in (None,) if along is None else (along, None):
        motion = braking(context, wanted, config, plan)
        distance = clear_distance_on(s, motion, config)
        needed = wanted if distance == inf else max(wanted, fallback.before_contact(speed, distance, config))
        found.append((motion, needed, plan))
    motion, needed, plan = min(found, key=lambda each: each[1])
    return (motion if needed == wanted else braking(context, needed, config, plan)), needed
