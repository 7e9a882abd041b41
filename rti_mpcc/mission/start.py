"""Start of each step: from the present state, the order for the controller; where an undocking can end."""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from math import cos, sin
from typing import NamedTuple, assert_never

import numpy as np
import shapely

from geometry import Area, Pose2
from rti_mpcc.config import ControllerConfig
from rti_mpcc.course import route_start
from rti_mpcc.mission.straight import SPACING, straight_order
from rti_mpcc.mission_state import DockState, MissionState, StepRecord
from rti_mpcc.model.footprint import body_of, body_polygons
from rti_mpcc.orders import GoTo, Order, Resume, Stand
from rti_mpcc.route_planner.arcs import merge_arcs, poses_after, split_arcs
from rti_mpcc.route_planner.smoothing import CURVATURE_SHARE
from rti_mpcc.state import ControllerState, Phase
from rti_mpcc.steps import Dock, DockKind, DriveTo, Straight, Undock, Wait
from rti_mpcc.types import Array
from rti_mpcc.world.goals import GoalTerms, Outline

_OUT_TOLERANCE = (0.2, 0.2, 0.1)  # at the end of an undocking: longitudinal [m], lateral [m], heading [rad]
# Ends of an undocking, and the routes to them, in the order in which they are tried:
_STRAIGHTS = (0.75, 0.5, 0.25, 0.0)  # shares of a route before its bend, other than all of it
_BENDS = (0.5, -0.5, 1.0, -1.0)  # as shares of the sharpest bend of routes, to the left or the right
_UNDONE = (0.0, 0.5, 0.35)  # shares of a bend that go back to the other side
_SIDES = (0.4, -0.4, 0.7, -0.7, 1.0, -1.0)  # how far off straight ahead an end may be [rad]


class Started(NamedTuple):
    """The start of a step.

    Attributes:
        mission_state: afterwards; order: for the controller, None: it continues.
        goal: pose that the step is to end in, or None; dock: that this is known by, or None.
        problem: why it cannot be started, or "".
    """

    mission_state: MissionState
    order: Order | None = None
    goal: Pose2 | None = None
    dock: Pose2 | None = None
    problem: str = ""


def start_step(
    mission_state: MissionState, s: ControllerState, config: ControllerConfig, area: Area | None
) -> Started:
    """Start the step that is due; one that has to start at rest once the vehicle stands.

    If it does not come to rest in the step's time, or patience, the step cannot be started.

    Args:
        area: all that is solid, as far as it is known; None: the controller plans no routes.
    """
    pending = mission_state.pending[0]
    from_rest = isinstance(pending.step, Straight | Undock)
    if from_rest and (s.vehicle.monitor.state is None or not s.is_stationary):
        since = s.clock.now if mission_state.stopping_since is None else mission_state.stopping_since
        mission_state = replace(mission_state, stopping_since=since)
        if s.clock.now - since < min(pending.step.timeout, pending.step.patience):
            return Started(mission_state, None if s.task.phase is Phase.WAITING else Stand())
        started = Started(mission_state, Stand(), problem="the vehicle does not come to rest")
    else:
        started = _started(mission_state, s, config, area)
    record = StepRecord(
        kind=pending.step.word, place=pending.place, attempt=pending.attempt, begin=s.clock.now,
        goal=started.goal, dock=started.dock,
    )  # fmt: skip
    mission_state = replace(
        started.mission_state,
        started=s.clock.now,
        stopping_since=None,
        docked_since=None,
        trouble=None,
        reason="",
        log=(*mission_state.log, record),
    )
    return started._replace(mission_state=mission_state)


def _started(
    mission_state: MissionState, s: ControllerState, config: ControllerConfig, area: Area | None
) -> Started:
    step, dock_state = mission_state.pending[0].step, mission_state.dock_state
    match step:
        case Dock():
            return _start_docking(step, mission_state, s, config, area)
        case Wait():
            return Started(mission_state, Stand())
        case Straight():
            axis = dock_state.pose if dock_state is not None and dock_state.reached else None
            order, problem = straight_order(step, axis, route_start.here(s, config), area, config)
            if order is None:
                return Started(mission_state, Stand(), problem=problem)
            if dock_state is not None and dock_state.reached:
                mission_state = replace(mission_state, dock_state=replace(dock_state, joined=True))
            return Started(mission_state, order, order.manoeuvre.goal, axis)
        case Undock():
            here = route_start.here(s, config)
            ends = () if area is None else undock_ends(here, step.distance, area, config)
            if not ends:
                return Started(mission_state, Stand(), problem="no end of a route out of here is clear")
            return Started(replace(mission_state, undock_candidates=ends), order_to_undock(ends[0]), ends[0])
        case DriveTo():
            terms = GoalTerms(tolerance=step.tolerance, detected=False)
            return Started(mission_state.at(None), GoTo(goal=step.pose, terms=terms), step.pose)
    assert_never(step)


def order_to_undock(end: Pose2) -> GoTo:
    """The order to drive to the end of an undocking."""
    return GoTo(goal=end, terms=GoalTerms(tolerance=_OUT_TOLERANCE, detected=False))


def _start_docking(
    step: Dock, mission_state: MissionState, s: ControllerState, config: ControllerConfig, area: Area | None
) -> Started:
    own = (
        step.pose is None and mission_state.own_goal == s.goal.planned
    )  # that of its path, or given on the way
    if own or area is None:
        goal = s.goal_pose or (None if s.on_planned_route else s.path.end)
        order = Resume() if s.task.phase is Phase.WAITING else None
        return Started(mission_state.at(None), order, goal, goal)
    goal = (
        step.pose
        or mission_state.unused_goal
        or mission_state.own_goal
        or (None if s.route is None else s.route.end)
    )
    if goal is None:
        return Started(mission_state, Stand(), problem="no goal was given")
    mission_state = mission_state.at(
        DockState(dock=step, place=mission_state.pending[0].place, pose=goal, body_at=goal)
    )
    terms = GoalTerms(
        tolerance=step.tolerance,
        detected=None if step.kind is None else step.kind is not DockKind.KNOWN,
        approach=None if step.approach is None else (step.approach.length, step.approach.direction),
        uncertainty=step.uncertainty,
        keep_out=_keep_out(step, route_start.here(s, config), config),
    )
    return Started(mission_state, GoTo(goal=goal, terms=terms), goal, goal)


def _keep_out(step: Dock, here: Pose2, config: ControllerConfig) -> tuple[Outline, ...]:
    """Where the body of the dock may be; none where the vehicle stands there already."""
    body = body_polygons(np.array([[here.x, here.y, here.phi]]), config.vehicle)[0]
    near = shapely.Polygon(body).buffer(config.clearance.on_routes)
    return tuple(each for each in step.keep_out() if not near.intersects(shapely.Polygon(each)))


def undock_ends(here: Pose2, distance: float, area: Area, config: ControllerConfig) -> tuple[Pose2, ...]:
    """Ends of an undocking, the best first.

    First come those to which the vehicle can drive straight on, round a bend, or round one that goes back to
    the other side, while the body keeps the margin of planned routes, or the clearance at the start if that
    is less. Then those, and others ahead to either side, whose end alone is clear: a route with changes of
    direction may lead there. Of those that keep as much the straighter ones come first.

    Args:
        here: where the vehicle stands; distance: along the route [m], negative in reverse; area: all that is
            solid.
    """
    clearance, body = config.clearance, body_of(config.vehicle)

    def clearances(poses: Array) -> Array:
        return np.minimum(
            area.grid.signed_distances(body, poses, clearance.on_routes)[:, 0], clearance.on_routes
        )

    def best_first(found: list[tuple[float, Pose2]]) -> list[Pose2]:
        clear = [each for each in found if each[0] >= clearance.least]
        return [end for _, end in sorted(clear, key=lambda each: -each[0])]

    start, direct = np.array([here.x, here.y, here.phi]), []
    ends = [
        here.compose(Pose2(distance * cos(side), distance * sin(side), turn * side))
        for side, turn in product(_SIDES, (0.0, 1.0))
    ]
    for route in _routes(distance, CURVATURE_SHARE * config.max_curvature):
        poses = poses_after(start, split_arcs(route, SPACING))
        kept, end = clearances(poses), Pose2(*poses[-1].tolist())
        # In a dock the clearance may be small: it must not become less.
        if (kept >= min(clearance.on_routes, float(kept[0]))).all():
            direct.append((float(kept.min()), end))
        else:
            ends.append(end)
    kept = clearances(np.array([[end.x, end.y, end.phi] for end in ends]))
    found = [*best_first(direct), *best_first(list(zip(kept.tolist(), ends, strict=True)))]
    return tuple(found[:8])


def _routes(distance: float, sharpest: float) -> list[Array]:
    """Routes (m, 2) of signed lengths [m] and curvatures [1/m], the straightest first."""
    routes = [np.array([(distance, 0.0)])]
    for share, bend, undone in product(_STRAIGHTS, _BENDS, _UNDONE):
        straight, bent, curvature = share * distance, (1.0 - share) * distance, bend * sharpest
        arcs = (straight, 0.0), ((1.0 - undone) * bent, curvature), (undone * bent, -curvature)
        route = merge_arcs(np.array(arcs))
        routes += [route] if len(route) > 0 else []
    return routes
