"""Where the course ends: a segment that is blocked by a static obstacle ends in front of it."""

from __future__ import annotations

from dataclasses import replace
from math import ceil

import numpy as np

from rti_mpcc.config import ControllerConfig
from rti_mpcc.course import collision_check, route_start
from rti_mpcc.course.collision_check import nearest_object
from rti_mpcc.course.context import PlanningContext
from rti_mpcc.course.guess import Course, along_course
from rti_mpcc.course.schedule import TARGET_MOVED
from rti_mpcc.course.transitions import SEEKING, onto_course
from rti_mpcc.model.layout import POSE, THETA
from rti_mpcc.ocp.objectives import Target, apart
from rti_mpcc.state import ControllerState, Phase, PlannedStop
from rti_mpcc.types import Array

NEAR_STOP = 0.2  # [m]; so near to a stop before an obstacle a vehicle stays where it is
SAME_STOP = 0.4  # [m]; a stop that moves by less stays
STOP_TOLERANCE = (0.2, 1.0, 0.5)  # longitudinal [m], lateral [m], heading [rad] at a stop


def on_course(s: ControllerState, context: PlanningContext) -> ControllerState:
    """With the course up to the first static obstacle that blocks it, if obstacles or target have changed."""
    task, target = s.task, s.task.target
    at_stop = task.stop is not None and task.phase in (Phase.SETTLING, Phase.HOLDING)
    if target is None or context.doubt or not (at_stop or task.phase in SEEKING):
        return s
    if s.plans.course is not None:
        changes, pose = s.plans.course
        if changes == s.area.changes and apart(pose, target.pose) <= TARGET_MOVED:
            return s
    s = replace(s, plans=replace(s.plans, course=(s.area.changes, target.pose)))
    stop = _blocked(s, context, target)
    if stop is None:
        return s if task.stop is None else onto_course(s, None, here=False)
    if task.stop is not None and abs(task.stop.at - stop.at) <= SAME_STOP:
        return s
    here = stop.at - float(context.state[THETA]) <= NEAR_STOP * context.config.size
    return onto_course(s, stop, here=here)


def _blocked(s: ControllerState, context: PlanningContext, target: Target) -> PlannedStop | None:
    """The stop in front of the first static obstacle that the body on the course to the target touches."""
    config = context.config
    if not (s.area.replaced or s.area.corridor.obstacles):
        return None
    states, segment = _ahead(s, context.state, target, config), s.task.segment
    first = collision_check.first_blocked(s, states, config)
    if first is None:
        return None
    x, y, phi = states[first, :POSE].tolist()
    begin, there = float(context.state[THETA]), segment.part.project(x, y, heading=phi)
    along, across, heading = STOP_TOLERANCE
    return PlannedStop(
        at=max(there - collision_check.stop_clearance(config), begin),
        tolerance=(config.size * along, config.size * across, heading),
        obstacle=str(nearest_object(states[first, :POSE], s.area, segment.index, config)),
    )


def _ahead(s: ControllerState, state: Array, target: Target, config: ControllerConfig) -> Array:
    """States (n, 6) on the course: on the driven plan, and from its end, or from `state`, to the target."""
    part, driven = s.task.segment.part, state[None]
    if s.task.drives and s.plans.driven is not None:
        *_, driven = collision_check.bodies_along(s.plans.driven, config)
        state = driven[-1].copy()
        x, y, phi = state[:POSE].tolist()
        state[THETA] = part.project(x, y, heading=phi)
    left = target.theta - float(state[THETA])
    if left <= route_start.CHECK_SPACING:
        return driven
    bodies = min(ceil(left / route_start.CHECK_SPACING) + 1, collision_check.MOST_BODIES)
    ahead = along_course(Course(part, target), state, np.linspace(0.0, left, bodies), config)
    return np.concatenate((driven, ahead))
