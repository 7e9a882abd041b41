"""Why a vehicle stops, for the reasons of its commands: the first cause that is known."""

from __future__ import annotations

from dataclasses import replace
from math import inf

import numpy as np

from geometry import Pose2
from rti_mpcc.config import ControllerConfig
from rti_mpcc.config.mpc import CONTACT_TOLERANCE
from rti_mpcc.model.footprint import clearances
from rti_mpcc.model.layout import PHI, THETA, V, X, Y
from rti_mpcc.ocp.room import Room
from rti_mpcc.planning.context import PlanningContext
from rti_mpcc.planning.state import ControllerState, PlannedStop
from rti_mpcc.safety import contact
from rti_mpcc.safety.naming import met_by
from rti_mpcc.types import GoalOrigin, Reason, Trajectory, Verdict


def of_stall(
    s: ControllerState, context: PlanningContext, config: ControllerConfig, room: Room | None
) -> str:
    """Why no plan ends inside the tolerance, or ""; `room`: beside the body along the segment, or None."""
    here = Pose2(*context.state[[X, Y, PHI]].tolist())
    setpoint = s.goal_setpoint
    at_end = setpoint is None or setpoint.source is GoalOrigin.PATH_END
    what = ("the path's end" if at_end else "the goal") if context.ends_at_goal else "the end of this segment"
    why = _too_near(here, "here", s, config) or _too_near(context.target.pose, f"at {what}", s, config)
    if why:
        return why
    if room is not None and (narrow := _narrow(s, context, config, room)):
        return narrow
    manoeuvre = None if s.route is None else s.route.manoeuvre
    return "" if manoeuvre is None or manoeuvre.found else manoeuvre.reason


def _too_near(pose: Pose2, where: str, s: ControllerState, config: ControllerConfig) -> str:
    """What is too near to the body at a pose, or ""."""
    state, part = np.array([pose.x, pose.y, pose.phi]), s.task.segment.index
    apart = clearances(state[None], s.area.known, part, config.vehicle, config.clearance.least)[0]
    apart[0] += CONTACT_TOLERANCE  # of boundaries, which count later
    if apart.min() >= config.clearance.least:
        return ""
    apart[0] -= CONTACT_TOLERANCE
    room, met = float(apart.min()), met_by(state, s.area, part, config)
    if room < 0.0:
        return f"the body {where} overlaps {met} by {-room:.3f} m"
    return f"the body {where} is {room:.3f} m from {met} (at least {config.clearance.least:g} m)"


def _narrow(s: ControllerState, context: PlanningContext, config: ControllerConfig, room: Room) -> str:
    """Where the rest of the segment is narrower than the margin, or ""."""
    theta = float(context.state[THETA])
    ahead = (room.theta >= theta) & (room.theta <= context.target.theta)
    if not ahead.any():
        return ""
    least = int(np.flatnonzero(ahead)[np.argmin(room.walls[ahead])])
    left, at = float(room.walls[least]), float(room.theta[least])
    if left >= config.clearance.wanted:
        return ""
    pose = s.task.segment.part.pose(at)
    return (
        f"the boundaries leave {left:.3f} m on either side of the body at ({pose.x:.2f}, {pose.y:.2f}), "
        f"{at - theta:.2f} m ahead, less than the margin of {config.clearance.wanted:g} m"
    )


# -- what is in the way -----------------------------------------------------------------------------------


def before_stop(stop: PlannedStop, context: PlanningContext, config: ControllerConfig) -> str:
    """What blocks the route behind a stop, and how far ahead that is."""
    ahead = stop.at + contact.stop_clearance(config) - float(context.state[THETA])
    return f"{stop.met}, {max(ahead, 0.0):.2f} m ahead"


def meeting(
    s: ControllerState, plan: Trajectory, distance: float, late: str, config: ControllerConfig
) -> ControllerState:
    """With the contact of a halting vehicle's plan after `distance` [m]; `late`: why there was no time for
    another plan, or ""."""
    assert s.task.halt is not None
    met = f"{distance:.2f} m with {contact.met_on(s, plan, distance, config)}"
    needed = contact.stopping_distance(float(plan.states[0, V]), config) + contact.CLEAR_DISTANCE
    halt = replace(s.task.halt, met=met, no_time=late if distance > needed else "")
    return replace(s, task=replace(s.task, halt=halt))


def held(s: ControllerState, distance: float) -> Verdict:
    """Why a vehicle halts whose plan is clear over `distance` [m]."""
    halt = s.task.halt
    assert halt is not None
    if halt.no_time:
        why = f"{halt.no_time}; contact in {halt.met} along the last plan"
        return Verdict(Reason.OUT_OF_TIME, why)
    if distance < inf:
        return Verdict(Reason.CONTACT_AHEAD, halt.met)
    return Verdict(Reason.WAITS_UNTIL_CLEAR, halt.met and f" (last: contact in {halt.met})")
