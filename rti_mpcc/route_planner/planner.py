"""From any pose to any other: a manoeuvre that the vehicle can drive, past all that is solid in an area.

1. Hybrid A* from the start and, against time, from the goal, in turn: from a tight end it is soon out, and
   nobody has to know which end that is (`hybrid_astar`).
2. The route is made cheaper by Reeds-Shepp curves between places on it (`shortening`).
3. It is made drivable without standing still to steer (`smoothing`), and checked at every centimetre
   (`drivable`).
4. Where that fails the route stays as it was found, and the wheels are turned at rest between its arcs.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Generator
from dataclasses import replace
from math import atan, inf, sqrt
from time import perf_counter

import numpy as np

from geometry import Area, Pose2, ReferencePath
from geometry.arrays import Array
from geometry.pose import degrees_hint
from geometry.validation import validated
from rti_mpcc.config import ControllerConfig
from rti_mpcc.manoeuvre import CUSP_TOLERANCE, WHOLE_TOLERANCE, Manoeuvre, PlanOutcome, Segment, SegmentEnd
from rti_mpcc.route_planner.cost_to_go import CostToGo, axle_clearances, cost_to_go
from rti_mpcc.route_planner.costs import ARC, Terms
from rti_mpcc.route_planner.drivable import DrivableRoute, make_drivable
from rti_mpcc.route_planner.hybrid_astar import (
    EXHAUSTED,
    FROM_GOAL,
    FROM_START,
    SEARCHING,
    HybridAStar,
    Roots,
)
from rti_mpcc.route_planner.problem import RouteProblem, leaving_arcs
from rti_mpcc.route_planner.shortening import shorten

_log = logging.getLogger(__name__)

FIRST = 0.01
"""Time of a slice before any has been timed [s]."""
_FORGOTTEN = 0.9  # share of the longest slice that is expected after a cycle without one
_SAME = 1e-6  # [m], [rad] poses that are nearer to one another are the same, whatever the tolerance
_CELLS = 200_000  # of the grid of estimates, at most
_SLICE = 8  # nodes of each tree that are expanded in a slice,
_HALF = 0.5  # of which is that of one tree
_CLOSER = 1.0 / 3.0  # distance of the poses to check, by this factor after a route that was not clear
_LEAST_TOLERANCE = 0.5  # share of the tolerance at the end of the shortest segment
_OF_LENGTH = 0.5  # of a segment, that its end may be missed along it by at most
_STANDING = 1.0  # [m] length of the straight segment at the end of which a vehicle stands that is in its goal


@validated()
def plan_manoeuvre(
    start: Pose2, goal: Pose2, area: Area, config: ControllerConfig | None = None
) -> Manoeuvre:
    """A manoeuvre from a start to a goal in an area, or why there is none; the same for the same input.

    From a start within the goal tolerance there is nothing to drive: the manoeuvre is a straight metre that
    ends in the goal, on the end of which the vehicle stands.

    Args:
        start, goal: poses of the rear axle.
        area: without a boundary it reaches 15 m beyond all that is given.
        config: of the vehicle, its limits, and `ControllerConfig.route`.
    """
    for hint in (degrees_hint("start.phi", start.phi), degrees_hint("goal.phi", goal.phi)):
        if hint:
            _log.warning("%s", hint)
    planning = RoutePlanning(RouteProblem.of(start, goal, area, config or ControllerConfig()))
    while planning.manoeuvre is None:
        planning.advance()
    return planning.manoeuvre


class RoutePlanning:
    """A manoeuvre in the making, slice by slice.

    Attributes:
        manoeuvre: the result; None: it is not finished.
        seconds: time of its slices; longest: expected time of the next one [s].

    Args:
        there: share of the goal tolerance within which the start is in the goal, and nothing to drive.
    """

    def __init__(self, problem: RouteProblem, there: float = 1.0) -> None:
        self.manoeuvre: Manoeuvre | None = None
        self.seconds, self.longest = 0.0, FIRST
        self._steps = _planned(problem, there, lambda: self.seconds)

    def waited(self) -> None:
        """There was no time for a slice as long as the longest: one delayed slice must not end it all."""
        self.longest *= _FORGOTTEN

    def advance(self) -> float:
        """One slice, some milliseconds at most, or half of one; returns how much of it."""
        if self.manoeuvre is not None:
            return 0.0
        started, share = perf_counter(), None
        try:
            share = next(self._steps)
        except StopIteration as ended:
            self.manoeuvre = ended.value
        took = perf_counter() - started
        self.seconds, self.longest = self.seconds + took, max(self.longest, took)
        if self.manoeuvre is not None:
            self.manoeuvre = replace(self.manoeuvre, seconds=self.seconds)
        return 1.0 if share is None else share


def _planned(
    problem: RouteProblem, there: float, spent: Callable[[], float]
) -> Generator[float | None, None, Manoeuvre]:
    """Plan; yields after each slice, or after a share of one that share, and returns the `Manoeuvre`."""
    settings, (at_start, at_goal) = problem.config.route, problem.end_clearances
    refused = _refused(problem, at_start, at_goal)
    if refused is not None:
        return refused
    start, goal = problem.given
    along, across, heading = (max(there * most, _SAME) for most in problem.config.goal_tolerance)
    if start.relative_to(goal).within((along, across, heading)):
        return _nothing_to_drive(problem, min(at_start, at_goal))
    yield None
    if at_start >= problem.least:
        terms = problem.terms(min(at_start, at_goal))
        starts = Roots(poses=problem.start[None], arcs=problem.incoming[None], costs=np.zeros(1))
    else:
        terms = problem.terms(at_goal)
        starts = yield from leaving_arcs(problem, at_start, terms)
        if len(starts.poses) == 0:
            return _too_near(
                problem, PlanOutcome.START_IN_COLLISION, at_start, ", and no arc leads away from it"
            )
    lasts = problem.last_arcs(terms)
    if len(lasts) == 0:
        reason = f"no straight route of {settings.final_straight} m into the goal is clear"
        return _no_manoeuvre(problem, PlanOutcome.NO_ROUTE, reason)
    poses = np.array([problem.before_goal(length) for length in lasts[:, 0]])
    goals = Roots(poses=poses, arcs=lasts, costs=np.zeros(len(lasts)))
    grids = yield from _estimates(problem, poses[0], terms)
    return (yield from _searched(problem, (starts, goals), grids, terms, spent))


def _searched(
    problem: RouteProblem,
    ends: tuple[Roots, Roots],
    grids: tuple[CostToGo, CostToGo],
    terms: Terms,
    spent: Callable[[], float],
) -> Generator[float | None, None, Manoeuvre]:
    """The searches, one after the other until there is a route, each in a lattice of its own.

    A coarse lattice may be searched in vain while a tight end needs a finer one. And the estimate knows no
    body: one of a large weight leads into gaps that it does not fit through, in which a finer lattice has
    only more cells. So each search gets half of the nodes that it leaves to the next.
    """
    settings, (starts, goals), body = problem.config.route, ends, problem.body
    nodes, nearest, rejected = 0, inf, ""
    for left, (finer, weight) in zip(range(len(settings.searches))[::-1], settings.searches, strict=True):
        most = settings.nodes // 2 ** (left + 1) if left else settings.nodes - nodes
        searched = terms._replace(finer=finer, weight=weight)
        search = HybridAStar(body, problem.grid, searched, starts, goals, grids)
        yield None
        while search.state == SEARCHING and most - search.expanded >= 2 and spent() < settings.seconds:
            budget = min(_SLICE, (most - search.expanded) // 2)
            search.advance(FROM_GOAL, budget)
            yield _HALF
            search.advance(FROM_START, budget)
            yield _HALF
        nodes, nearest = nodes + search.expanded, min(nearest, search.nearest)
        if search.cost < inf:
            at, route, last = search.route()
            yield None
            rest = replace(problem, start=starts.poses[at])
            route = yield from shorten(rest.start, route, starts.arcs[at], body, problem.grid, terms)
            driven = yield from make_drivable(rest, route, last, terms.margin)
            if driven.clearance >= problem.least:
                if starts.clearances is not None:
                    some = slice(at, at + 1)
                    arc = DrivableRoute(
                        arcs=starts.arcs[some], stops=np.array([True]), clearances=starts.clearances[some]
                    )
                    driven = DrivableRoute.chain([arc, driven])
                return _manoeuvre_of(problem, driven, nodes)
            rejected = (
                f"the route leaves a clearance of {driven.clearance:.3f} m, "
                f"at least {problem.config.clearance.least} m is required"
            )
            terms = terms._replace(check=_CLOSER * terms.check)
        elif search.state != EXHAUSTED and (not left or spent() >= settings.seconds):
            reason = f"{nodes} nodes expanded in {spent():.1f} s, the nearest {nearest:.2f} m from the goal"
            return _no_manoeuvre(problem, PlanOutcome.BUDGET_SPENT, reason, nodes, nearest)
    reason = f"all {nodes} reachable nodes expanded, the nearest {nearest:.2f} m from the goal"
    return _no_manoeuvre(problem, PlanOutcome.NO_ROUTE, rejected or reason, nodes, nearest)


def _estimates(
    problem: RouteProblem, goal: Array, terms: Terms
) -> Generator[None, None, tuple[CostToGo, CostToGo]]:
    """Costs to the goal (3,) and to the start, slice by slice."""
    low, high = problem.low, problem.high
    cell = max(ARC * terms.radius, sqrt(float(np.prod(high - low)) / _CELLS))
    vehicle = problem.config.vehicle  # its largest disc around the rear axle, if the body is a rectangle
    radius = 0.0 if vehicle.outline is not None else min(0.5 * vehicle.width, vehicle.rear, vehicle.front)
    clear = yield from axle_clearances(
        problem.grid, low, high, cell, radius + problem.config.clearance.on_routes + cell
    )
    to_goal = yield from cost_to_go(clear, low, cell, radius, goal, problem.config)
    to_start = yield from cost_to_go(clear, low, cell, radius, problem.start, problem.config)
    return to_goal, to_start


def _refused(problem: RouteProblem, at_start: float, at_goal: float) -> Manoeuvre | None:
    """Why nothing is searched for, from the clearances at the start and at the goal [m], or None.

    A vehicle that stands nearer to something than the hard minimum may leave; one that drives there may not.
    """
    settings = problem.config.route
    if at_start < (problem.least if problem.incoming.any() else 0.0):
        return _too_near(problem, PlanOutcome.START_IN_COLLISION, at_start)
    if at_goal < problem.least:
        return _too_near(problem, PlanOutcome.GOAL_IN_COLLISION, at_goal)
    if problem.distance > settings.farthest:
        reason = f"the goal is {problem.distance:.0f} m away, at most {settings.farthest:g} m is allowed"
        return _no_manoeuvre(problem, PlanOutcome.GOAL_TOO_FAR, reason)
    return None


def _too_near(problem: RouteProblem, outcome: PlanOutcome, clearance: float, more: str = "") -> Manoeuvre:
    at_goal = outcome is PlanOutcome.GOAL_IN_COLLISION
    name, pose = "goal" if at_goal else "start", problem.given[at_goal]
    found = f"has a clearance of {clearance:.3f} m"
    if clearance < 0.0:
        found = f"overlaps an obstacle by {-clearance:.3f} m"
    reason = (
        f"the body at the {name} ({pose.x:.2f}, {pose.y:.2f}, {pose.phi:.2f}) {found}, "
        f"at least {problem.config.clearance.least} m is required{more}"
    )
    return _no_manoeuvre(problem, outcome, reason)


def _no_manoeuvre(
    problem: RouteProblem, outcome: PlanOutcome, reason: str, nodes: int = 0, nearest: float = inf
) -> Manoeuvre:
    """No manoeuvre, and why; after so many nodes, the nearest one so far from the goal [m]."""
    start, goal = problem.given
    nearest = min(nearest, problem.distance)
    return Manoeuvre(start=start, goal=goal, outcome=outcome, reason=reason, nodes=nodes, nearest=nearest)


def _nothing_to_drive(problem: RouteProblem, clearance: float) -> Manoeuvre:
    """The manoeuvre of a vehicle that stands in its goal: a straight segment that ends there."""
    start, goal = problem.given
    before = goal.compose(Pose2(-_STANDING, 0.0, 0.0))
    (part,) = ReferencePath.from_segments(start=before, segments=[(1, 0.0, _STANDING)]).parts
    segment = Segment(part=part, index=0, end=SegmentEnd.GOAL, tolerance=problem.config.goal_tolerance)
    return Manoeuvre(
        start=start, goal=goal, outcome=PlanOutcome.FOUND, segments=(segment,), clearance=clearance,
        nearest=0.0,
    )  # fmt: skip


def _manoeuvre_of(problem: RouteProblem, route: DrivableRoute, nodes: int) -> Manoeuvre:
    """The manoeuvre of a route."""
    # From the start, and then put in place: so no coordinate is rounded more than once.
    (start, goal), config = problem.given, problem.config
    pose, theta = Pose2(0.0, 0.0, start.phi), 0.0
    segments: list[Segment] = []
    found = route.segments
    for index, (arcs, clearance) in enumerate(found):
        pieces = [(1 if length > 0.0 else -1, curvature, abs(length)) for length, curvature in arcs.tolist()]
        (part,) = ReferencePath.from_segments(start=pose, segments=pieces).parts
        pose = part.last
        part = replace(part, knots=part.knots + theta, x=part.x + start.x, y=part.y + start.y)
        theta = part.end
        last = index == len(found) - 1
        segments.append(
            Segment(
                part=part,
                index=index,
                end=SegmentEnd.GOAL if last else SegmentEnd.CUSP,
                tolerance=config.goal_tolerance if last else _tolerance(part.end - part.start, config),
                wheels=atan(config.vehicle.wheelbase * float(part.curvatures[0])),
                margin=clearance,
            )
        )
    return Manoeuvre(
        start=start, goal=goal, outcome=PlanOutcome.FOUND, segments=tuple(segments),
        clearance=route.clearance, nearest=0.0, nodes=nodes,
    )  # fmt: skip


def _tolerance(length: float, config: ControllerConfig) -> tuple[float, float, float]:
    """At the end of a segment [m], [m], [rad]: a short one must not be over where it starts."""
    share = min(max(length / (config.size * WHOLE_TOLERANCE), _LEAST_TOLERANCE), 1.0)
    along, across, heading = CUSP_TOLERANCE
    along = min(config.size * share * along, _OF_LENGTH * length)
    return along, config.size * share * across, share * heading
