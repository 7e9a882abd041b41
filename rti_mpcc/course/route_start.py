"""Where another route would start, and whether one from there was searched a moment ago."""

from __future__ import annotations

import numpy as np

from geometry import Area, PathPart, Pose2
from geometry.shape_grid import Body, ShapeGrid
from rti_mpcc.config import ControllerConfig
from rti_mpcc.config.mpc import CONTACT_TOLERANCE
from rti_mpcc.manoeuvre import Manoeuvre
from rti_mpcc.model.footprint import body_of
from rti_mpcc.model.layout import PHI, X, Y
from rti_mpcc.state import ControllerState
from rti_mpcc.types import Array

AGAIN_AFTER = 8.0
"""The same route is not planned again before this time [s], while the vehicle stays where it began."""
NEAR = (0.1, 0.05, 0.035)
"""A planned route is driven from within this of its start: longitudinal [m], lateral [m], heading [rad]."""
OUT_OF_REACH = "the goal is out of reach from the path's last change of direction"
CHECK_SPACING = 0.2  # [m] between two bodies of a motion that are checked


def here(s: ControllerState, config: ControllerConfig) -> Pose2:
    """The vehicle's pose, averaged at rest: noise must not restart a search."""
    state, since = s.vehicle.monitor.state, s.vehicle.standing_since
    if state is None:
        return Pose2(0.0, 0.0, 0.0)
    now = Pose2(float(state[X]), float(state[Y]), float(state[PHI]))
    if since is None or s.vehicle.monitor.doubt:
        return now
    moments = s.clock.now - config.goal_tracking.filter.history
    return s.vehicle.poses.mean(max(since, moments)) or now


def near_enough(config: ControllerConfig) -> tuple[float, float, float]:
    """`NEAR`, for the size of the vehicle."""
    along, across, heading = NEAR
    return config.size * along, config.size * across, heading


def was_searched(s: ControllerState, config: ControllerConfig) -> bool:
    """Whether a route was planned from right here a moment ago, with the same result."""
    route = s.route
    if route is None or route.manoeuvre is None or s.clock.now - route.since >= AGAIN_AFTER:
        return False
    near = here(s, config).relative_to(route.manoeuvre.start).within(near_enough(config))
    return near and route.changes == s.area.changes


def on_the_move(s: ControllerState) -> bool:
    """Whether another route may be joined without a stop: none was since the obstacles changed."""
    route = s.route
    return route is not None and (route.manoeuvre is None or route.changes != s.area.changes)


def are_between(start: Pose2, goal: Pose2, shapes: list[Array], config: ControllerConfig) -> bool:
    """Whether any of convex shapes (m_i, 2) [m] is within a body's length of the line between two poses."""
    line = Body.of([(0.0, 0.0), (goal.x - start.x, goal.y - start.y)])
    grid = ShapeGrid.of_shapes(shapes)
    within = config.vehicle.front + config.vehicle.rear
    return bool(grid.signed_distances(line, np.array([(start.x, start.y, 0.0)]), within)[0, 0] < within)


def is_clear(manoeuvre: Manoeuvre, area: Area, config: ControllerConfig) -> bool:
    """Whether the body keeps the clearance that the manoeuvre was planned with, or the hard minimum."""
    poses = np.concatenate([_poses(segment.part) for segment in manoeuvre.segments])
    least = min(config.clearance.least, manoeuvre.clearance) - CONTACT_TOLERANCE
    apart = area.signed_distances(body_of(config.vehicle), poses, config.clearance.on_routes)
    return bool((apart >= least).all())


def _poses(part: PathPart) -> Array:
    """Poses (n, 3) on a part at which the body is checked."""
    count = int((part.end - part.start) / CHECK_SPACING) + 2
    at = part.reference(np.linspace(part.start, part.end, count))
    return np.column_stack([at.x, at.y, at.phi])
