"""Where another way would begin, and whether one from there was sought a moment ago."""

from __future__ import annotations

import numpy as np

from geometry import Area, PathPart, Pose2
from geometry.shape_grid import Body, ShapeGrid
from rti_mpcc.config import ControllerConfig
from rti_mpcc.manoeuvre import Manoeuvre
from rti_mpcc.model.footprint import body_of
from rti_mpcc.model.layout import PHI, X, Y
from rti_mpcc.ocp.room import REACTION_TIME
from rti_mpcc.planning.state import ControllerState
from rti_mpcc.types import Array


def here(s: ControllerState, config: ControllerConfig) -> Pose2:
    """Where the vehicle is; of one that stands the mean of the last moments, for noise must not begin a
    search anew."""
    state, since = s.vehicle.monitor.state, s.vehicle.standing_since
    if state is None:
        return Pose2(0.0, 0.0, 0.0)
    now = Pose2(float(state[X]), float(state[Y]), float(state[PHI]))
    if since is None or s.vehicle.monitor.why:
        return now
    moments = s.now - config.goal_tracking.filter.history
    return s.vehicle.poses.mean(max(since, moments)) or now


def was_asked(s: ControllerState, config: ControllerConfig) -> bool:
    """Whether a way was planned from right here a moment ago: the same again would come of it."""
    route, settings = s.route, config.route
    if route is None or route.manoeuvre is None or s.now - route.since >= settings.again_after:
        return False
    near = here(s, config).relative_to(route.manoeuvre.start).within(settings.near)
    return near and route.changes == s.area.changes


def on_the_move(s: ControllerState) -> bool:
    """Whether another way may be begun without a stop: none was, since the obstacles have changed."""
    route = s.route
    return route is not None and (route.manoeuvre is None or route.changes != s.area.changes)


def beside_way(s: ControllerState, shapes: list[Array], config: ControllerConfig) -> list[Array]:
    """Those of convex shapes (m_i, 2) that are near the body on what is left of the route [m]."""
    if not shapes:
        return []
    within = config.clearance.least + REACTION_TIME * config.limits.speed
    grid = ShapeGrid.of_shapes(shapes, np.arange(len(shapes)), len(shapes))
    parts = s.path.parts[s.task.segment.index :]
    near = np.zeros(len(shapes), dtype=np.bool_)
    for part in parts:
        near |= (grid.signed_distances(body_of(config.vehicle), _poses(part, config), within) < within).any(
            axis=0
        )
    return [shapes[k] for k in np.flatnonzero(near)]


def are_between(start: Pose2, goal: Pose2, shapes: list[Array], config: ControllerConfig) -> bool:
    """Whether any of convex shapes (m_i, 2) [m] is within a body's length of the straight line between two
    poses."""
    line = Body.of([(0.0, 0.0), (goal.x - start.x, goal.y - start.y)])
    grid = ShapeGrid.of_shapes(shapes, np.zeros(len(shapes)), 1)
    within = config.vehicle.front + config.vehicle.rear
    return bool(grid.signed_distances(line, np.array([(start.x, start.y, 0.0)]), within)[0, 0] < within)


def is_clear(manoeuvre: Manoeuvre, area: Area, config: ControllerConfig) -> bool:
    """Whether the body keeps the clearance on a manoeuvre that it was planned with, or the hard minimum, to
    within what is measured."""
    poses = np.concatenate([_poses(segment.part, config) for segment in manoeuvre.segments])
    least = min(config.clearance.least, manoeuvre.clearance) - config.caution.contact_tolerance
    return bool(
        (area.signed_distances(body_of(config.vehicle), poses, config.clearance.on_routes) >= least).all()
    )


def _poses(part: PathPart, config: ControllerConfig) -> Array:
    """Poses (n, 3) on a part at which the body is checked."""
    count = int((part.end - part.start) / config.caution.check_spacing) + 2
    at = part.reference(np.linspace(part.start, part.end, count))
    return np.column_stack([at.x, at.y, at.phi])
