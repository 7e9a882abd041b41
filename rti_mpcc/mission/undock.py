"""Undock: drive out of where the vehicle stands, and where that can end."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import product
from math import cos, sin

import numpy as np

from geometry import Area, Pose2
from rti_mpcc.config import ControllerConfig
from rti_mpcc.mission.state import MissionState
from rti_mpcc.mission.step import (
    DrivingStep,
    MissionCycle,
    Next,
    Started,
    StepOutcome,
    StepStart,
    check_distance,
)
from rti_mpcc.mission.straight import SPACING
from rti_mpcc.model.footprint import body_of
from rti_mpcc.orders import GoTo, Stand
from rti_mpcc.route_planner.arcs import merge_arcs, poses_after, split_arcs
from rti_mpcc.route_planner.smoothing import CURVATURE_SHARE
from rti_mpcc.types import Array, MissionResult, Reason
from rti_mpcc.world.goals import GoalTerms

_OUT_TOLERANCE = (0.2, 0.2, 0.1)  # at the end of an undocking: longitudinal [m], lateral [m], heading [rad]
# Ends of an undocking, and the routes to them, in the order in which they are tried:
_STRAIGHTS = (0.75, 0.5, 0.25, 0.0)  # shares of a route before its bend, other than all of it
_BENDS = (0.5, -0.5, 1.0, -1.0)  # as shares of the sharpest bend of routes, to the left or the right
_UNDONE = (0.0, 0.5, 0.35)  # shares of a bend that go back to the other side
_SIDES = (0.4, -0.4, 0.7, -0.7, 1.0, -1.0)  # how far off straight ahead an end may be [rad]


@dataclass(frozen=True, slots=True)
class Undock(DrivingStep):
    """Drive out of where the vehicle stands, straight on or along the best bend that is clear.

    Attributes:
        distance: along the route, at most LONGEST [m], negative in reverse.
    """

    word = "undock"
    from_rest = True
    distance: float

    def _check(self) -> None:
        check_distance(self.distance, self)

    def start(self, at: StepStart) -> Started:
        """Drive to the best end; the others are tried after it."""
        ends = () if at.area is None else undock_ends(at.here, self.distance, at.area, at.config)
        if not ends:
            return Started(at.mission_state, Stand(), problem="no end of a route out of here is clear")
        return Started(replace(at.mission_state, data=ends), _order_to(ends[0]), ends[0])

    def judged(self, mission_state: MissionState, cycle: MissionCycle) -> StepOutcome:
        """As of any drive; an end without a route is given up at once while there are others."""
        outcome, command = DrivingStep.judged(self, mission_state, cycle), cycle.command
        if outcome.result is MissionResult.SUCCEEDED or len(mission_state.data or ()) < 2:
            return outcome
        if command.diagnostics.cause is Reason.NO_ROUTE:
            return StepOutcome(outcome.mission_state, MissionResult.NOT_REACHED, command.diagnostics.reason)
        return outcome

    def succeeded(self, mission_state: MissionState, direction: int) -> Next:
        """The vehicle has left the dock."""
        return Next(mission_state.at(None))

    def another_try(self, outcome: StepOutcome) -> Next | None:
        """The next end, if there is one."""
        ends: tuple[Pose2, ...] = outcome.mission_state.data or ()
        log = outcome.mission_state.log
        if len(ends) < 2 or outcome.result not in (MissionResult.NOT_REACHED, MissionResult.BLOCKED):
            return None
        log = (*log[:-1], replace(log[-1], goal=ends[1]))
        return Next(replace(outcome.mission_state, data=ends[1:], trouble=None, log=log), _order_to(ends[1]))


def _order_to(end: Pose2) -> GoTo:
    return GoTo(goal=end, terms=GoalTerms(tolerance=_OUT_TOLERANCE, detected=False))


def undock_ends(here: Pose2, distance: float, area: Area, config: ControllerConfig) -> tuple[Pose2, ...]:
    """Ends of an undocking, the best first.

    First come those to which the vehicle can drive straight on, round a bend, or round one that goes back to
    the other side, while the body keeps the margin of planned routes, or the clearance at the start if that
    is less. Then those, and others ahead to either side, whose end alone is clear: a route with changes of
    direction may lead there. Of those that keep as much the straighter ones come first.

    Args:
        here: of the vehicle; distance: along the route [m], negative in reverse; area: all that is solid.
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
