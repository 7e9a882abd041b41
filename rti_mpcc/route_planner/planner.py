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
from math import atan, ceil, hypot, inf, sqrt
from time import perf_counter

import numpy as np

from geometry import Area, Pose2, ReferencePath
from geometry.arrays import Array
from rti_mpcc.config import ControllerConfig
from rti_mpcc.kernels import make_ready
from rti_mpcc.manoeuvre import Manoeuvre, PlanOutcome, Segment, SegmentEnd
from rti_mpcc.model.footprint import body_of
from rti_mpcc.route_planner.cost_to_go import CostToGo, axle_clearances, cost_to_go, disc_of
from rti_mpcc.route_planner.hybrid_astar import EXHAUSTED, SEARCHING, HybridAStar, Terms, poses_after
from rti_mpcc.route_planner.shortening import joined, shortened, split
from rti_mpcc.route_planner.smoothing import Smoothing, SmoothingTerms

_SLICE = 16  # nodes between two questions whether there is time
_CHECK = 0.01  # [m] between the poses that are checked in the end
_NEAR_GOAL, _SETTLED = (
    1e-2,
    0.03,
)  # error at the goal [m], [rad], change of a curvature as a share, of a smooth way
_CLOSER = 1.0 / 3.0  # as far apart are the poses that are looked at once a way was nearer to something
_STANDING = 1.0
"""Length of the straight way that a vehicle stands at the end of which is in its goal already [m]."""
_SAME = 1e-6  # [m], [rad] poses that are nearer to one another are the same, whatever the tolerance
_FIRMER = 3  # so often a way that is smooth but not clear is made to keep its margin by a larger weight


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
        self._steps = _planned(_Problem.of(start, goal, area, config), lambda: self.seconds)

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


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Problem:
    """What is planned for."""

    start: Pose2
    goal: Pose2
    area: Area
    config: ControllerConfig

    @classmethod
    def of(cls, start: Pose2, goal: Pose2, area: Area, config: ControllerConfig) -> _Problem:
        around = area.bounded(np.array([(start.x, start.y), (goal.x, goal.y)]), config.route.box)
        return cls(start=start, goal=goal, area=around, config=config)

    @property
    def is_there(self) -> bool:
        """Whether the start is within the goal tolerance of the goal."""
        along, across, heading = (max(most, _SAME) for most in self.config.goal_tolerance)
        return self.start.relative_to(self.goal).within((along, across, heading))

    def room(self, pose: Pose2, within: float) -> float:
        """Clearance of the body at a pose, up to `within` [m]."""
        at = np.array([[pose.x, pose.y, pose.phi]])
        return min(float(self.area.signed_distances(body_of(self.config.vehicle), at, within)[0]), within)

    def failed(self, outcome: PlanOutcome, reason: str, nodes: int = 0, nearest: float = inf) -> Manoeuvre:
        apart = hypot(self.goal.x - self.start.x, self.goal.y - self.start.y)
        return Manoeuvre(
            start=self.start, goal=self.goal, outcome=outcome, reason=reason, nodes=nodes,
            nearest=min(nearest, apart),
        )  # fmt: skip

    def terms(self, room: float) -> Terms:
        config, vehicle = self.config, self.config.vehicle
        settings = config.route
        radius = 1.0 / (settings.search_share * config.max_curvature)
        length = vehicle.front + vehicle.rear
        least = min(settings.hard_minimum + settings.reserve, room - _CHECK)
        return Terms(
            radius=radius,
            wheelbase=vehicle.wheelbase,
            arc=settings.arc * radius,
            check=settings.arc * radius / 5.0,
            cell=1.2 * settings.arc * radius,
            open=settings.open * radius,
            reach=hypot(max(vehicle.front, vehicle.rear), 0.5 * vehicle.width),
            margin=max(least, settings.hard_minimum),
            near=max(settings.margin, least) + 1e-6,
            ahead=1.0,
            back=settings.reverse_cost,
            cusp=settings.cusp_cost,
            steering=settings.steering_cost,
            closeness=settings.closeness_cost,
            weight=settings.weight,
            finer=1.0,
            fine=1.5 * length,
            tight=settings.margin,
            more=0.5,
        )


def _planned(problem: _Problem, spent: Callable[[], float]) -> Generator[None, None, Manoeuvre]:
    """Plan; yields between slices, and returns the `Manoeuvre`."""
    settings = problem.config.route
    enough = 2.0 * settings.margin + 1.0
    room = problem.room(problem.start, enough), problem.room(problem.goal, enough)
    for place, outcome, pose in (
        (room[0], PlanOutcome.START_IN_COLLISION, problem.start),
        (room[1], PlanOutcome.GOAL_IN_COLLISION, problem.goal),
    ):
        if place < settings.hard_minimum:
            said = f"overlaps something by {-place:.3f} m" if place < 0.0 else f"leaves {place:.3f} m"
            what = "start" if outcome is PlanOutcome.START_IN_COLLISION else "goal"
            reason = (
                f"the body at the {what} ({pose.x:.2f}, {pose.y:.2f}, {pose.phi:.2f}) {said}, "
                f"at least {settings.hard_minimum} m are kept"
            )
            return problem.failed(outcome, reason)
    if problem.is_there:
        return _standing(problem, min(room))
    yield
    terms = problem.terms(min(room))
    if not len(_last_straights(problem, terms)):
        reason = f"there is no straight way of {settings.final_straight} m into the goal"
        return problem.failed(PlanOutcome.NO_WAY, reason)
    known = yield from _Estimates.of(problem, terms)
    yield
    nodes, nearest, reason = 0, inf, ""
    levels = len(settings.finer)
    for level, finer in enumerate(settings.finer):
        # A lattice as fine as it has to be. A coarse one may be searched in vain all over the place while the
        # way out of where it is tight needs a finer one: each gets half of what is left to the next.
        search = _search(problem, terms._replace(finer=finer), known, settings.nodes - nodes)
        yield
        last = level + 1 == levels
        most = settings.nodes - nodes if last else settings.nodes // 2 ** (levels - level)
        while search.state == SEARCHING and search.expanded < most and spent() < settings.seconds:
            search.advance(min(_SLICE, most - search.expanded))
            yield
        nodes, nearest = nodes + search.expanded, min(nearest, search.nearest)
        if search.cost < inf:
            found, clear = yield from _drivable(problem, terms, *search.way())
            if found:
                return _found(problem, found, clear, nodes)
            # It was nearer to something between the poses that the search looked at.
            reason = f"the way found leaves {clear:.3f} m, at least {settings.hard_minimum} m are kept"
            terms = terms._replace(check=_CLOSER * terms.check)
        elif search.state != EXHAUSTED and (last or spent() >= settings.seconds):
            reason = f"{nodes} poses were looked at in {spent():.1f} s, {_nearest(nearest)}"
            return problem.failed(PlanOutcome.BUDGET_SPENT, reason, nodes, nearest)
    reason = reason or f"all of {nodes} poses that can be reached were looked at, {_nearest(nearest)}"
    return problem.failed(PlanOutcome.NO_WAY, reason, nodes, nearest)


def _nearest(distance: float) -> str:
    return f"the nearest is {distance:.2f} m from the goal"


def _drivable(
    problem: _Problem, terms: Terms, way: Array, last: Array
) -> Generator[None, None, tuple[list[Array], float]]:
    """The stretches of a found way, cheaper and, if it can be, smooth, and their clearance [m]; none where
    that is less than the hard minimum. `last`: straight piece (1, 2) that it ends with, or none (0, 2)."""
    config, settings = problem.config, problem.config.route
    at = np.array([problem.start.x, problem.start.y, problem.start.phi])
    body, solid = body_of(config.vehicle), problem.area.grid
    yield
    way = yield from shortened(at, joined(way), body.shape, solid.solid, terms, places=settings.places)
    yield
    smoothing, firmer = _smoothing(problem, way, last), 0
    for _ in range(settings.smoothing_iterations):
        smoothing.iterate()
        yield
        if smoothing.error > _NEAR_GOAL or smoothing.moved > _SETTLED:
            continue
        arcs = smoothing.settled()
        if arcs is None:
            continue
        arcs = np.vstack([arcs, last])
        clear = _clearance(problem, arcs)
        if clear >= settings.hard_minimum:
            return _stretches(arcs), clear
        if firmer == _FIRMER:
            break
        # It gives way where it must not: what is lacking of the margin costs more.
        firmer += 1
        smoothing.firmer(10.0)
        yield
    way = np.vstack([way, last])
    clear = _clearance(problem, way)
    return [piece[None] for piece in way] if clear >= settings.hard_minimum else [], clear


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
    def of(cls, problem: _Problem, terms: Terms) -> Generator[None, None, _Estimates]:
        config, settings = problem.config, problem.config.route
        boundary, lasts = problem.area.boundary, _last_straights(problem, terms)
        assert boundary is not None
        low, high = boundary.min(axis=0), boundary.max(axis=0)
        cell = max(settings.arc * terms.radius, sqrt(float(np.prod(high - low)) / settings.cells))
        radius = disc_of(config.vehicle)
        reach = radius + settings.margin + cell
        apart = yield from axle_clearances(problem.area.grid, low, high, cell, reach)
        start, goal = (np.array([pose.x, pose.y, pose.phi]) for pose in (problem.start, problem.goal))
        goals = goal - lasts[:, :1] * np.array([np.cos(goal[2]), np.sin(goal[2]), 0.0])
        to_goal = cost_to_go(apart, low, cell, radius, (goals[0, 0], goals[0, 1]), settings)
        yield
        to_start = cost_to_go(apart, low, cell, radius, (start[0], start[1]), settings)
        return cls(start=start, goals=goals, lasts=lasts, grids=(to_goal, to_start))


def _search(problem: _Problem, terms: Terms, known: _Estimates, nodes: int) -> HybridAStar:
    body, solid = body_of(problem.config.vehicle), problem.area.grid
    return HybridAStar(
        body.shape, solid.solid, terms, known.start, known.goals, known.lasts, known.grids, nodes
    )


def _last_straights(problem: _Problem, terms: Terms) -> Array:
    """The last straight pieces (n, 2) into the goal, forward and in reverse, as far as they are clear."""
    length, goal = problem.config.route.final_straight, problem.goal
    if length == 0.0:
        return np.zeros((1, 2))
    found = []
    for sign in (1.0, -1.0):
        marks = np.linspace(0.0, length, ceil(length / terms.check) + 1)
        poses = np.column_stack(
            [
                goal.x - sign * marks * np.cos(goal.phi),
                goal.y - sign * marks * np.sin(goal.phi),
                np.full(len(marks), goal.phi),
            ]
        )
        apart = problem.area.signed_distances(body_of(problem.config.vehicle), poses, terms.near)
        if float(apart.min()) >= terms.margin:
            found.append((sign * length, 0.0))
    return np.array(found).reshape(-1, 2)


def _smoothing(problem: _Problem, way: Array, last: Array) -> Smoothing:
    """Of a way that a straight piece comes after, or none."""
    config, settings = problem.config, problem.config.route
    start = problem.start
    radius = 1.0 / config.max_curvature
    terms = SmoothingTerms(
        curvature=settings.curvature_share * config.max_curvature,
        slope=settings.steering_slope,
        wheelbase=config.vehicle.wheelbase,
        margin=settings.margin,
        spacing=settings.knots * radius,
        piece=settings.knots * radius / 4.0,
        look=settings.knots * radius / 2.0,
    )
    at = np.array([start.x, start.y, start.phi])
    end = poses_after(at, way)[-1]
    # The heading on the branch on which the way ends; the place as it was given, less the last piece.
    turns = round((end[2] - problem.goal.phi) / (2.0 * np.pi))
    phi, back = problem.goal.phi + 2.0 * np.pi * turns, float(last[:, 0].sum())
    goal = np.array([problem.goal.x - back * np.cos(phi), problem.goal.y - back * np.sin(phi), phi])
    goes_on = len(last) > 0 and float(last[0, 0]) * float(way[-1, 0]) > 0.0
    return Smoothing(
        start=at, goal=goal, body=body_of(config.vehicle), grid=problem.area.grid, terms=terms,
        way=way, straight_end=goes_on,
    )  # fmt: skip


def _clearance(problem: _Problem, way: Array) -> float:
    """Least clearance of the body along a way, at every centimetre [m]."""
    start = problem.start
    fine = split(way, _CHECK)
    poses = np.vstack(
        [[start.x, start.y, start.phi], poses_after(np.array([start.x, start.y, start.phi]), fine)]
    )
    within = 2.0 * problem.config.route.margin + 1.0
    return min(
        float(problem.area.signed_distances(body_of(problem.config.vehicle), poses, within).min()), within
    )


def _stretches(way: Array) -> list[Array]:
    """A way (n, 2) cut where the direction changes."""
    return np.split(way, np.flatnonzero(way[1:, 0] * way[:-1, 0] < 0.0) + 1)


def _tolerance(length: float, config: ControllerConfig) -> tuple[float, float, float]:
    """At the end of a stretch [m], [m], [rad]: a short one must not be over where it begins."""
    behaviour, settings = config.behaviour, config.route
    share = min(max(length / settings.whole_tolerance, settings.least_tolerance), 1.0)
    along, across, heading = behaviour.cusp_tolerance
    return share * along, share * across, share * heading


def _standing(problem: _Problem, clearance: float) -> Manoeuvre:
    """The manoeuvre of a vehicle that stands in its goal: a straight way up to it, with nothing to drive."""
    begin = problem.goal.compose(Pose2(-_STANDING, 0.0, 0.0))
    (part,) = ReferencePath.from_segments(start=begin, segments=[(1, 0.0, _STANDING)]).parts
    segment = Segment(part=part, index=0, end=SegmentEnd.GOAL, tolerance=problem.config.goal_tolerance)
    return Manoeuvre(
        start=problem.start, goal=problem.goal, outcome=PlanOutcome.FOUND, segments=(segment,),
        clearance=clearance, nearest=0.0,
    )  # fmt: skip


def _found(problem: _Problem, stretches: list[Array], clearance: float, nodes: int) -> Manoeuvre:
    """The manoeuvre of ways (n, 2) of one direction each, at the ends of which the wheels may be turned."""
    # From the origin, and then put in place: so no coordinate is rounded more than once.
    place = np.array([problem.start.x, problem.start.y])
    config, pose, theta = problem.config, Pose2(0.0, 0.0, problem.start.phi), 0.0
    segments: list[Segment] = []
    for index, way in enumerate(stretches):
        pieces = [(1 if length > 0.0 else -1, curvature, abs(length)) for length, curvature in way.tolist()]
        (part,) = ReferencePath.from_segments(start=pose, segments=pieces).parts
        pose = part.last
        part = replace(part, knots=part.knots + theta, x=part.x + place[0], y=part.y + place[1])
        last = index == len(stretches) - 1
        segments.append(
            Segment(
                part=part,
                index=index,
                end=SegmentEnd.GOAL if last else SegmentEnd.CUSP,
                tolerance=config.goal_tolerance if last else _tolerance(part.end - part.start, config),
                wheels=atan(config.vehicle.wheelbase * float(part.curvatures[0])),
            )
        )
        theta = part.end
    return Manoeuvre(
        start=problem.start,
        goal=problem.goal,
        outcome=PlanOutcome.FOUND,
        segments=tuple(segments),
        clearance=clearance,
        nearest=0.0,
        nodes=nodes,
    )
