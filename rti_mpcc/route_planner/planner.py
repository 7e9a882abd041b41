"""From any pose to any other: a manoeuvre that the vehicle can drive, past all that stands in an area.

1. Hybrid A* from the start and, against time, from the goal, in turn: who begins where it is tight is soon
   out of it, and nobody has to know which end that is (`searches`, `hybrid_astar`).
2. The way found is made cheaper by Reeds-Shepp curves between places on it (`shortening`).
3. It is made drivable without standing still to steer (`smoothing`), and checked at every centimetre
   (`drivable`).
4. Where that fails the way stays as it was found, and the wheels are turned at rest between its pieces.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Generator, Sequence
from dataclasses import replace
from time import perf_counter

from geometry import Area, Pose2
from geometry.angles import degrees_hint
from geometry.arrays import Array
from geometry.doors import door
from rti_mpcc.config import ControllerConfig
from rti_mpcc.kernels import make_ready
from rti_mpcc.manoeuvre import Manoeuvre, PlanOutcome
from rti_mpcc.route_planner.arcs import joined
from rti_mpcc.route_planner.costs import Terms
from rti_mpcc.route_planner.drivable import Kept, drivable
from rti_mpcc.route_planner.leaving import Begins, arcs_out
from rti_mpcc.route_planner.problem import Problem
from rti_mpcc.route_planner.results import failed, found, is_there, standing
from rti_mpcc.route_planner.searches import Ends, Searches
from rti_mpcc.route_planner.shortening import shortened

_log = logging.getLogger(__name__)


@door()
def plan_manoeuvre(
    start: Pose2, goal: Pose2, area: Area, config: ControllerConfig | None = None
) -> Manoeuvre:
    """A manoeuvre from a start to a goal in an area, or why there is none; the same for the same input.

    From a start within the goal tolerance there is nothing to drive: the manoeuvre is a straight metre that
    ends in the goal, on the end of which the vehicle stands.

    Args:
        start, goal: poses of the rear axle; area: without a boundary it reaches 15 m beyond all that is
            given.
        config: of the vehicle, its limits, and `ControllerConfig.route`.
    """
    for hint in (degrees_hint("start.phi", start.phi), degrees_hint("goal.phi", goal.phi)):
        if hint:
            _log.warning("%s", hint)
    planning = RoutePlanning(start, goal, area, config or ControllerConfig())
    while planning.manoeuvre is None:
        planning.advance()
    return planning.manoeuvre


FIRST = 0.01
"""What a slice may take before any has been timed [s]."""
_PLACES = 40  # on a route that are tried to be joined directly
_FORGOTTEN = 0.9  # share of the longest slice that is counted on after a cycle without one


class RoutePlanning:
    """A manoeuvre in the making, slice by slice.

    Attributes:
        manoeuvre: what came of it; None: it goes on.
        seconds: that its slices took; longest: what the next one may take [s], as the longest one did.

    Args:
        start, goal, area, config: as `plan_manoeuvre`; came: signed length [m] and curvature [1/m] of the arc
            on which a vehicle comes to the start that goes on without a stop, where that can be.
        there: share of the goal tolerance within which the start is in the goal, and nothing to drive.
        keep_out: outlines (k, 2) that are solid, too, but on the last straight piece into the goal.
    """

    def __init__(
        self,
        start: Pose2,
        goal: Pose2,
        area: Area,
        config: ControllerConfig,
        came: tuple[float, float] = (0.0, 0.0),
        there: float = 1.0,
        keep_out: Sequence[Array] = (),
    ) -> None:
        make_ready()
        self.manoeuvre: Manoeuvre | None = None
        self.seconds, self.longest = 0.0, FIRST
        problem = Problem.of(start, goal, area, config, came, keep_out)
        self._steps = _planned(problem, there, lambda: self.seconds)

    def waited(self) -> None:
        """There was no time for a slice as long as the longest: one that was held up must not end it all."""
        self.longest *= _FORGOTTEN

    def advance(self) -> None:
        """One slice: some milliseconds at most."""
        if self.manoeuvre is not None:
            return
        begun = perf_counter()
        try:
            next(self._steps)
        except StopIteration as ended:
            self.manoeuvre = ended.value
        took = perf_counter() - begun
        self.seconds, self.longest = self.seconds + took, max(self.longest, took)
        if self.manoeuvre is not None:
            self.manoeuvre = replace(self.manoeuvre, seconds=self.seconds)


def _planned(problem: Problem, there: float, spent: Callable[[], float]) -> Generator[None, None, Manoeuvre]:
    """Plan; yields between slices, and returns the `Manoeuvre`."""
    least, room = problem.least, problem.room
    refused = _refused(problem, room)
    if refused is not None:
        return refused
    if is_there(problem, there):
        return standing(problem, min(room))
    yield
    near = room[0] < least
    terms = problem.terms(room[1] if near else min(room))
    begins = (yield from arcs_out(problem, room[0], terms)) if near else Begins.at_start(problem)
    if len(begins.poses) == 0:
        return _too_near(problem, PlanOutcome.START_IN_COLLISION, room[0], ", and no arc leads away from it")
    lasts = problem.lasts(terms)
    if len(lasts) == 0:
        reason = f"there is no straight way of {problem.config.route.final_straight} m into the goal"
        return failed(problem, PlanOutcome.NO_WAY, reason)
    ends = yield from Ends.of(problem, lasts, terms)
    searches = Searches(problem, begins, ends, terms, spent)
    while (next_way := (yield from searches.next_way())) is not None:
        at, way, last = next_way
        yield
        left = begins.problem_from(problem, at)
        way = yield from _shortened(left, begins.pieces[at], searches.terms, way)
        driven = yield from drivable(left, way, last, Kept(clearance=searches.terms.margin))
        if driven.clearance >= least:
            return found(problem, begins.whole(driven, at), searches.nodes)
        searches.reject(driven.clearance)
    return failed(problem, *searches.failure, searches.nodes, searches.nearest)


def _refused(problem: Problem, room: tuple[float, float]) -> Manoeuvre | None:
    """Why nothing is searched for, from the clearances at the start and at the goal [m], or None.

    A vehicle that stands nearer to something than the hard minimum may leave, see `leaving`; one that drives
    there may not.
    """
    farthest, stands = problem.config.route.farthest, not problem.came.any()
    least = problem.least
    if room[0] < (0.0 if stands else least):
        return _too_near(problem, PlanOutcome.START_IN_COLLISION, room[0])
    if room[1] < least:
        return _too_near(problem, PlanOutcome.GOAL_IN_COLLISION, room[1])
    if problem.distance > farthest:
        reason = f"the goal is {problem.distance:.0f} m away, ways are planned up to {farthest:g} m"
        return failed(problem, PlanOutcome.GOAL_TOO_FAR, reason)
    return None


def _too_near(problem: Problem, outcome: PlanOutcome, room: float, more: str = "") -> Manoeuvre:
    at_start = outcome is PlanOutcome.START_IN_COLLISION
    pose, what = (problem.given[0], "start") if at_start else (problem.given[1], "goal")
    said = f"overlaps something by {-room:.3f} m" if room < 0.0 else f"leaves {room:.3f} m"
    reason = (
        f"the body at the {what} ({pose.x:.2f}, {pose.y:.2f}, {pose.phi:.2f}) {said}, "
        f"at least {problem.config.clearance.least} m are kept{more}"
    )
    return failed(problem, outcome, reason)


def _shortened(problem: Problem, came: Array, terms: Terms, way: Array) -> Generator[None, None, Array]:
    body, solid = problem.body.shape, problem.grid.solid
    return (yield from shortened(problem.start, joined(way), body, solid, terms, places=_PLACES, came=came))
