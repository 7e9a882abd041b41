"""Where another way would begin, and whether one from there was sought a moment ago."""

from __future__ import annotations

from geometry import Pose2
from rti_mpcc.config import ControllerConfig
from rti_mpcc.model.layout import PHI, X, Y
from rti_mpcc.planning.state import ControllerState


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
