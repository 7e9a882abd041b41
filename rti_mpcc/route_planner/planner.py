"""From any pose to any other: a manoeuvre that the vehicle can drive, past all that stands in an area.

1. Hybrid A* from the start and, against time, from the goal, in turn: who begins where it is tight is soon
   out of it, and nobody has to know which end that is (`hybrid_astar`).
2. The way found is made cheaper by Reeds-Shepp curves between places on it (`shortening`).
3. It is made drivable without standing still to steer (`smoothing`), and checked at every centimetre.
4. Where that fails the way stays as it was found, and the wheels are turned at rest between its pieces.
"""

from __future__ import annotations

from collections.abc import Callable, Generator
from dataclasses import dataclass, replace
from math import inf, sqrt
from time import perf_counter

import numpy as np

from geometry import Area, Pose2
from geometry.arrays import Array
from rti_mpcc.config import ControllerConfig
from rti_mpcc.kernels import make_ready
from rti_mpcc.manoeuvre import Manoeuvre, PlanOutcome
from rti_mpcc.route_planner.cost_to_go import CostToGo, axle_clearances, cost_to_go, disc_of
from rti_mpcc.route_planner.drivable import drivable
from rti_mpcc.route_planner.hybrid_astar import EXHAUSTED, SEARCHING, HybridAStar, Terms
from rti_mpcc.route_planner.problem import Problem
from rti_mpcc.route_planner.results import failed, found, is_there, standing
from rti_mpcc.route_planner.shortening import joined, shortened

_SLICE = 8  # nodes of each tree between two questions whether there is time
_CLOSER = 1.0 / 3.0  # as far apart are the poses that are looked at once a way was nearer to something


def plan_manoeuvre(
    start: Pose2, goal: Pose2, area: Area, config: ControllerConfig | None = None
) -> Manoeuvre:
    """A manoeuvre from a start to a goal in an area, or why there is none; the same for the same input.

    From a start within the goal tolerance there is nothing to drive: the manoeuvre is a straight metre that
    ends in the goal, on the end of which the vehicle stands.

    Args:
        start, goal: poses of the rear axle; area: without a boundary it reaches `RoutePlanner.box` beyond all
            that is given.
        config: of the vehicle, its limits, and `ControllerConfig.route`.
    """
    planning = RoutePlanning(start, goal, area, config or ControllerConfig())
    while planning.manoeuvre is None:
        planning.advance()
    return planning.manoeuvre


class RoutePlanning:
    """A manoeuvre in the making, slice by slice.

    Attributes:
        manoeuvre: what came of it; None: it goes on.
        seconds: that its slices took.
    """

    def __init__(self, start: Pose2, goal: Pose2, area: Area, config: ControllerConfig) -> None:
        make_ready()
        self.manoeuvre: Manoeuvre | None = None
        self.seconds = 0.0
        self._steps = _planned(Problem.of(start, goal, area, config), lambda: self.seconds)

    def advance(self) -> None:
        """One slice: some milliseconds at most."""
        if self.manoeuvre is not None:
            return
        begun = perf_counter()
        try:
            next(self._steps)
        except StopIteration as ended:
            self.manoeuvre = ended.value
        self.seconds += perf_counter() - begun
        if self.manoeuvre is not None:
            self.manoeuvre = replace(self.manoeuvre, seconds=self.seconds)


def _planned(problem: Problem, spent: Callable[[], float]) -> Generator[None, None, Manoeuvre]:
    """Plan; yields between slices, and returns the `Manoeuvre`."""
    settings = problem.config.route
    ends = np.array([problem.start, problem.goal])
    room = [float(each) for each in problem.clearances(ends, problem.within)]
    outcomes = PlanOutcome.START_IN_COLLISION, PlanOutcome.GOAL_IN_COLLISION
    for place, outcome, pose in zip(room, outcomes, problem.given, strict=True):
        if place < settings.hard_minimum:
            said = f"overlaps something by {-place:.3f} m" if place < 0.0 else f"leaves {place:.3f} m"
            what = "start" if outcome is PlanOutcome.START_IN_COLLISION else "goal"
            reason = (
                f"the body at the {what} ({pose.x:.2f}, {pose.y:.2f}, {pose.phi:.2f}) {said}, "
                f"at least {settings.hard_minimum} m are kept"
            )
            return failed(problem, outcome, reason)
    if is_there(problem):
        return standing(problem, min(room))
    if problem.distance > settings.farthest:
        reason = f"the goal is {problem.distance:.0f} m away, ways are planned up to {settings.farthest:g} m"
        return failed(problem, PlanOutcome.GOAL_TOO_FAR, reason)
    yield
    terms = problem.terms(min(room))
    lasts = problem.lasts(terms)
    if not len(lasts):
        reason = f"there is no straight way of {settings.final_straight} m into the goal"
        return failed(problem, PlanOutcome.NO_WAY, reason)
    known = yield from _Estimates.of(problem, lasts, terms)
    yield
    nodes, nearest, reason = 0, inf, ""
    levels = len(settings.finer)
    for level, finer in enumerate(settings.finer):
        # A lattice as fine as it has to be. A coarse one may be searched in vain all over the place while the
        # way out of where it is tight needs a finer one: each gets half of what is left to the next.
        last = level + 1 == levels
        most = settings.nodes - nodes if last else settings.nodes // 2 ** (levels - level)
        search = _search(problem, terms._replace(finer=finer), known)
        yield
        while search.state == SEARCHING and most - search.expanded >= 2 and spent() < settings.seconds:
            search.advance(min(_SLICE, (most - search.expanded) // 2))
            yield
        nodes, nearest = nodes + search.expanded, min(nearest, search.nearest)
        if search.cost < inf:
            way, last_piece = search.way()
            yield
            way = yield from _shortened(problem, terms, way)
            driven = yield from drivable(problem, way, last_piece)
            if driven.clearance >= settings.hard_minimum:
                return found(problem, driven, nodes)
            # It was nearer to something between the poses that the search looked at.
            reason = (
                f"the way found leaves {driven.clearance:.3f} m, at least {settings.hard_minimum} m are kept"
            )
            terms = terms._replace(check=_CLOSER * terms.check)
        elif search.state != EXHAUSTED and (last or spent() >= settings.seconds):
            reason = f"{nodes} poses were looked at in {spent():.1f} s, {_nearest(nearest)}"
            return failed(problem, PlanOutcome.BUDGET_SPENT, reason, nodes, nearest)
    reason = reason or f"all of {nodes} poses that can be reached were looked at, {_nearest(nearest)}"
    return failed(problem, PlanOutcome.NO_WAY, reason, nodes, nearest)


def _shortened(problem: Problem, terms: Terms, way: Array) -> Generator[None, None, Array]:
    body, solid, places = problem.body.shape, problem.grid.solid, problem.config.route.places
    return (yield from shortened(problem.start, joined(way), body, solid, terms, places=places))


def _nearest(distance: float) -> str:
    return f"the nearest is {distance:.2f} m from the goal"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Estimates:
    """What the searches of a problem share: the poses that they end at, and estimates of the cost to them.

    Attributes:
        start: (3,); goals: (n, 3); lasts: (n, 2) straight pieces from each goal on, see `_last_straights`.
        grids: costs to the first goal and to the start.
    """

    start: Array
    goals: Array
    lasts: Array
    grids: tuple[CostToGo, CostToGo]

    @classmethod
    def of(cls, problem: Problem, lasts: Array, terms: Terms) -> Generator[None, None, _Estimates]:
        config, settings = problem.config, problem.config.route
        start, low, high = problem.start, problem.low, problem.high
        cell = max(settings.arc * terms.radius, sqrt(float(np.prod(high - low)) / settings.cells))
        radius = disc_of(config.vehicle)
        reach = radius + settings.margin + cell
        apart = yield from axle_clearances(problem.grid, low, high, cell, reach)
        goals = np.array([problem.before_goal(length) for length in lasts[:, 0]])
        to_goal = yield from cost_to_go(apart, low, cell, radius, (goals[0, 0], goals[0, 1]), settings)
        to_start = yield from cost_to_go(apart, low, cell, radius, (start[0], start[1]), settings)
        return cls(start=start, goals=goals, lasts=lasts, grids=(to_goal, to_start))


def _search(problem: Problem, terms: Terms, known: _Estimates) -> HybridAStar:
    return HybridAStar(
        problem.body.shape,
        problem.grid.solid,
        terms,
        known.start,
        known.goals,
        known.lasts,
        known.grids,
    )
