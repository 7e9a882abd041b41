"""Why a vehicle that stands has no plan that ends inside its tolerance: the deepest cause that is known."""

from __future__ import annotations

import numpy as np

from geometry import Pose2
from rti_mpcc.config import ControllerConfig
from rti_mpcc.model.footprint import clearances
from rti_mpcc.model.layout import PHI, THETA, X, Y
from rti_mpcc.ocp.room import Room
from rti_mpcc.planning.context import PlanningContext
from rti_mpcc.planning.state import ControllerState
from rti_mpcc.safety.naming import met_by
from rti_mpcc.types import GoalOrigin


def of_stall(
    s: ControllerState, context: PlanningContext, config: ControllerConfig, room: Room | None
) -> str:
    """Why no plan ends inside the tolerance, or "" where that is not known.

    In this order: the body is too near to something where it stands, or where it is to stand; the way between
    is too narrow; no other way was found.

    Args:
        room: beside the body along the segment, or None where that does not count.
    """
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
    apart = clearances(state[None], s.area.known, part, config.vehicle, config.caution.hard_minimum)[0]
    apart[0] += config.caution.contact_tolerance  # of boundaries, which count later
    if apart.min() >= config.caution.hard_minimum:
        return ""
    apart[0] -= config.caution.contact_tolerance
    room, met = float(apart.min()), met_by(state, s.area, part, config)
    if room < 0.0:
        return f"the body {where} overlaps {met} by {-room:.3f} m"
    return f"the body {where} is {room:.3f} m from {met}, at least {config.caution.hard_minimum:g} m are kept"


def _narrow(s: ControllerState, context: PlanningContext, config: ControllerConfig, room: Room) -> str:
    """Where the way that is left is narrower than the margin, or ""."""
    theta = float(context.state[THETA])
    ahead = (room.theta >= theta) & (room.theta <= context.target.theta)
    if not ahead.any():
        return ""
    least = int(np.flatnonzero(ahead)[np.argmin(room.walls[ahead])])
    left, at = float(room.walls[least]), float(room.theta[least])
    if left >= config.footprint.margin:
        return ""
    pose = s.task.segment.part.pose(at)
    return (
        f"the boundaries leave {left:.3f} m on either side of the body at ({pose.x:.2f}, {pose.y:.2f}), "
        f"{at - theta:.2f} m ahead, less than the margin of {config.footprint.margin:g} m"
    )
