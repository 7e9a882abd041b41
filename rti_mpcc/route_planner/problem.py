"""The problem of a route, in coordinates from the start: numbers are small wherever in the world that is.

The start is at (0, 0); the axes point where those of the world do.
"""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import dataclass, replace
from math import ceil, cos, hypot, sin

import numpy as np

from geometry import Area, Pose2
from geometry.arrays import Array
from geometry.shape_grid import Body, ShapeGrid
from rti_mpcc.config import ControllerConfig
from rti_mpcc.kernels import make_ready
from rti_mpcc.model.footprint import body_of
from rti_mpcc.route_planner.arcs import NO_LENGTH, poses_after
from rti_mpcc.route_planner.costs import ARC, Terms
from rti_mpcc.route_planner.hybrid_astar import Roots

CHECK = 0.01
"""[m] between the poses that are checked in the end."""
BOX = 15.0
"""Distance [m] of the box of an area without a boundary from all that is given."""
_SEARCH_SHARE = 0.85
"""Share of the vehicle's largest curvature that the search uses. It knows no change of the steering, and less
would leave more room to smoothing."""
_OPEN = 0.25
"""Clearance of the body from which on arcs are twice as long, in radii of the sharpest bend."""
_ROUNDING = 5e-4
"""An end with this little less than the least clearance has it [m]: a bay as wide as asked for fits."""
_AROUND = 1.0  # [m] and twice the margin around the body clearances are computed

_SHARES = (0.0, 0.25, -0.25, 0.5, -0.5, 1.0, -1.0)
"""Curvatures that are tried, as shares of the sharpest one of the search."""
_SWING = 1e-3
"""Length [m] by which an end of the body may swing out on a gentle arc, or a tenth of the clearance at the
start."""
_LONGEST = 3.0
"""Longest arc, in lengths of the body."""
_SHORTEST = 0.5
"""Length [m] that an arc has where the margin is kept: a shorter one is within the tolerance of its end."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RouteProblem:
    """Ends, vehicle and surroundings of a route.

    Attributes:
        given: start and goal as they were given, in the world.
        start, goal: (3,) the same from the start on.
        incoming: (2,) signed length [m] and curvature [1/m] of the arc on which the vehicle reaches the
            start, to continue without a stop; zeros: it stands there.
        grid: all that is solid, with the places to keep out of before the last straight arc; last: all that
            is solid, for that arc; low, high: (2,) corners of the box of the area [m].
        body: of the vehicle; config: its settings.
        least: clearance that a route keeps everywhere [m], `Clearance.least` but for rounding at the ends.
        line: (m, 3) closely spaced poses that a smooth route stays near; None: there is none.
    """

    given: tuple[Pose2, Pose2]
    start: Array
    goal: Array
    incoming: Array
    grid: ShapeGrid
    last: ShapeGrid
    low: Array
    high: Array
    body: Body
    config: ControllerConfig
    least: float
    line: Array | None = None

    @classmethod
    def of(
        cls,
        start: Pose2,
        goal: Pose2,
        area: Area,
        config: ControllerConfig,
        incoming: tuple[float, float] = (0.0, 0.0),
        keep_out: Sequence[Array] = (),
    ) -> RouteProblem:
        """Build from poses of the rear axle and an area in the world; `keep_out`: outlines (k, 2) [m] that
        are solid, too, but on the last straight arc into the goal."""
        make_ready()
        around = area.bounded(np.array([(start.x, start.y), (goal.x, goal.y)]), BOX)
        origin = np.array([start.x, start.y])
        assert around.boundary is not None
        last = around.grid.moved(-origin)
        grid = around.with_obstacles(keep_out).grid.moved(-origin) if keep_out else last
        problem = cls(
            given=(start, goal),
            start=np.array([0.0, 0.0, start.phi]),
            goal=np.array([goal.x - start.x, goal.y - start.y, goal.phi]),
            incoming=np.array(incoming),
            grid=grid,
            last=last,
            low=around.boundary.min(axis=0) - origin,
            high=around.boundary.max(axis=0) - origin,
            body=body_of(config.vehicle),
            config=config,
            least=config.clearance.least,
        )
        narrow = [
            each - _ROUNDING for each in problem.end_clearances if abs(each - problem.least) < _ROUNDING
        ]
        return replace(problem, least=min(problem.least, *narrow)) if narrow else problem

    @property
    def distance(self) -> float:
        """Of the goal from the start [m]."""
        return hypot(self.goal[0], self.goal[1])

    @property
    def end_clearances(self) -> tuple[float, float]:
        """Clearances of the body at the start and at the goal [m]."""
        (start,), (goal,) = self.clearances(self.start[None]), self.clearances(self.goal[None], last=True)
        return float(start), float(goal)

    def clearances(self, poses: Array, within: float | None = None, *, last: bool = False) -> Array:
        """Clearances (n,) of the body at poses (n, 3), at most `within` [m].

        `last`: on the last straight arc.
        """
        if within is None:
            kept = self.config.clearance
            within = 2.0 * max(kept.on_routes, kept.least + self.config.route.reserve) + _AROUND
        grid = self.last if last else self.grid
        return np.minimum(grid.signed_distances(self.body, poses, within)[:, 0], within)

    def last_arcs(self, terms: Terms) -> Array:
        """The straight last arcs (n, 2) into the goal that are clear, forward and in reverse."""
        length, direction = self.config.route.final_straight, self.config.route.final_direction
        if length < NO_LENGTH:
            return np.zeros((1, 2))
        marks = np.linspace(0.0, length, ceil(length / terms.check) + 1)
        found = []
        for sign in (1.0, -1.0) if direction == 0 else (float(direction),):
            poses = np.array([self.before_goal(sign * mark) for mark in marks])
            if float(self.clearances(poses, terms.near, last=True).min()) >= terms.margin:
                found.append((sign * length, 0.0))
        return np.array(found).reshape(-1, 2)

    def before_goal(self, length: float) -> Array:
        """The pose (3,) from which a straight arc of that signed length [m] leads into the goal."""
        x, y, phi = self.goal
        return np.array([x - length * cos(phi), y - length * sin(phi), phi])

    def terms(self, clearance: float) -> Terms:
        """Costs and steps of a search between ends of this clearance [m]."""
        config, vehicle = self.config, self.config.vehicle
        settings = config.route
        radius = 1.0 / (_SEARCH_SHARE * config.max_curvature)
        length = vehicle.front + vehicle.rear
        margin = max(min(self.least + settings.reserve, clearance - CHECK), self.least)
        near = max(config.clearance.on_routes, margin) + 1e-6
        return Terms(
            radius=radius,
            wheelbase=vehicle.wheelbase,
            check=ARC * radius / 5.0,
            open=max(_OPEN * radius, near),
            reach=hypot(max(vehicle.front, vehicle.rear), 0.5 * vehicle.width),
            margin=margin,
            near=near,
            back=settings.reverse_cost,
            cusp=settings.cusp_cost,
            steering=settings.steering_cost,
            closeness=settings.closeness_cost,
            fine=1.5 * length,
            tight=config.clearance.on_routes,
        )


def leaving_arcs(problem: RouteProblem, clearance: float, terms: Terms) -> Generator[None, None, Roots]:
    """How a vehicle leaves a start of this clearance [m], nearer to something than the hard minimum.

    It drives one arc, on which the body never comes nearer to anything than it is at the start, until it
    keeps the margin of the search. From there a route is searched for as from any start. The wheels are
    turned at rest before the arc and behind it. Returns the ends of such arcs, or none.
    """
    body, found = problem.config.vehicle, []
    swing = min(_SWING, 0.1 * clearance)
    count = round(_LONGEST * (body.front + body.rear) / CHECK)
    for sign in (1.0, -1.0):
        behind = body.rear if sign > 0.0 else body.front
        # On an arc as gentle as this the end that is left behind swings out by that.
        gentle = min(2.0 * swing / max(behind, CHECK) ** 2, 1.0 / terms.radius)
        for curvature in (*(share / terms.radius for share in _SHARES), gentle, -gentle):
            poses = poses_after(problem.start, np.tile((sign * CHECK, curvature), (count, 1)))
            apart = problem.clearances(poses)
            yield
            last = _last_pose(apart, clearance - swing - 1e-9, terms)
            if last is None:
                continue
            length = (last + 1) * CHECK
            cost = length * (terms.ahead if sign > 0.0 else terms.back)
            least = min(float(apart[: last + 1].min()), clearance)
            found.append((*poses[last], sign * length, curvature, cost, least))
    rows = np.array(found).reshape(-1, 7)
    return Roots(poses=rows[:, :3], arcs=rows[:, 3:5], costs=rows[:, 5], clearances=rows[:, 6])


def _last_pose(apart: Array, least: float, terms: Terms) -> int | None:
    """Index of the last pose of an arc with clearances (n,) [m]; None: one is less than `least` too early.

    There the clearance costs nothing, if the arc leads so far, and it is at least the margin.
    """
    out, nearer = np.flatnonzero(apart >= terms.margin), np.flatnonzero(apart < least)
    if len(out) == 0 or (len(nearer) and nearer[0] < out[0]):
        return None
    first = int(out[0])
    blocked = np.flatnonzero(apart[first:] < terms.margin)
    free = apart[: first + int(blocked[0]) if len(blocked) else len(apart)]
    roomy = np.flatnonzero(free >= terms.near)
    last = int(roomy[0]) if len(roomy) else first
    return min(max(last, round(_SHORTEST / CHECK) - 1), len(free) - 1)
