"""What is planned for, in coordinates from the start on: numbers are small wherever in the world that is.

The start is at (0, 0); the axes point where those of the world do.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import cos, hypot, sin

import numpy as np

from geometry import Area, Pose2
from geometry.arrays import Array
from geometry.shape_grid import Body, ShapeGrid
from rti_mpcc.config import ControllerConfig
from rti_mpcc.model.footprint import body_of
from rti_mpcc.route_planner.costs import NO_LENGTH, Terms

CHECK = 0.01
"""[m] between the poses that are checked in the end."""
BOX = 15.0
"""Without a boundary the area reaches so far beyond all that is given [m]."""
SEARCH_SHARE = 0.85
"""Share of the vehicle's largest curvature that the search uses. It knows no change of the steering, and less
would leave more room to smoothing."""
ARC = 0.16
"""Length of the arcs of the search, in radii of the sharpest bend."""
OPEN = 0.25
"""Clearance of the body from which on arcs are twice as long, in radii of the sharpest bend."""
_ROUNDING = 5e-4
"""An end with this little less than the least clearance has it [m]: a bay as wide as asked for fits."""
_AROUND = 1.0  # [m] and twice the margin around the body clearances are told


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Problem:
    """What is planned for.

    Attributes:
        given: start and goal as they were asked for, in the world.
        start, goal: (3,) the same from the start on.
        came: (2,) signed length [m] and curvature [1/m] of the arc on which the vehicle comes to the start,
            to go on without a stop; zeros: it stands there.
        grid: all that is solid, with what is kept out of before the last straight piece; last: all that is
            solid, for that piece; low, high: (2,) corners of the box around where the vehicle may be [m].
        body: of the vehicle; config: its settings.
        least: clearance that a route keeps everywhere [m], `Clearance.least` but for rounding at the ends.
    """

    given: tuple[Pose2, Pose2]
    start: Array
    goal: Array
    came: Array
    grid: ShapeGrid
    last: ShapeGrid
    low: Array
    high: Array
    body: Body
    config: ControllerConfig
    least: float

    @classmethod
    def of(
        cls,
        start: Pose2,
        goal: Pose2,
        area: Area,
        config: ControllerConfig,
        came: tuple[float, float] = (0.0, 0.0),
        keep_out: Sequence[Array] = (),
    ) -> Problem:
        """Build from poses and an area in the world; `keep_out`: see `RoutePlanning`."""
        around = area.bounded(np.array([(start.x, start.y), (goal.x, goal.y)]), BOX)
        origin = np.array([start.x, start.y])
        assert around.boundary is not None
        last = _moved(around.grid, -origin)
        grid = _moved(around.with_obstacles(keep_out).grid, -origin) if keep_out else last
        problem = cls(
            given=(start, goal),
            start=np.array([0.0, 0.0, start.phi]),
            goal=np.array([goal.x - start.x, goal.y - start.y, goal.phi]),
            came=np.array(came),
            grid=grid,
            last=last,
            low=around.boundary.min(axis=0) - origin,
            high=around.boundary.max(axis=0) - origin,
            body=body_of(config.vehicle),
            config=config,
            least=config.clearance.least,
        )
        narrow = [room - _ROUNDING for room in problem.room if abs(room - problem.least) < _ROUNDING]
        return replace(problem, least=min(problem.least, *narrow)) if narrow else problem

    @property
    def distance(self) -> float:
        """Of the goal from the start [m]."""
        return hypot(self.goal[0], self.goal[1])

    @property
    def within(self) -> float:
        """So far clearances are told [m]."""
        clearance = self.config.clearance
        return 2.0 * max(clearance.on_routes, clearance.least + self.config.route.reserve) + _AROUND

    @property
    def room(self) -> tuple[float, float]:
        """Clearances of the body at the start and at the goal [m]."""
        (start,) = self.clearances(self.start[None], self.within)
        (goal,) = self.clearances(self.goal[None], self.within, last=True)
        return float(start), float(goal)

    def clearances(self, poses: Array, within: float, *, last: bool = False) -> Array:
        """Clearances (n,) of the body at poses (n, 3), `within` where nothing is nearer [m].

        `last`: on the last straight piece.
        """
        grid = self.last if last else self.grid
        return np.minimum(grid.signed_distances(self.body, poses, within)[:, 0], within)

    def lasts(self, terms: Terms) -> Array:
        """The last straight pieces (n, 2) into the goal, forward and in reverse, as far as they are clear."""
        length, direction = self.config.route.final_straight, self.config.route.final_direction
        if length < NO_LENGTH:
            return np.zeros((1, 2))
        marks = np.linspace(0.0, length, int(np.ceil(length / terms.check)) + 1)
        found = []
        for sign in (1.0, -1.0) if direction == 0 else (float(direction),):
            poses = np.array([self.before_goal(sign * mark) for mark in marks])
            if float(self.clearances(poses, terms.near, last=True).min()) >= terms.margin:
                found.append((sign * length, 0.0))
        return np.array(found).reshape(-1, 2)

    def before_goal(self, length: float) -> Array:
        """The pose (3,) from which a straight piece of that signed length [m] leads into the goal."""
        x, y, phi = self.goal
        return np.array([x - length * cos(phi), y - length * sin(phi), phi])

    def terms(self, room: float) -> Terms:
        """What a way costs, and how it is searched, where the ends have so much room [m]."""
        config, vehicle = self.config, self.config.vehicle
        settings, clearance = config.route, config.clearance
        radius = 1.0 / (SEARCH_SHARE * config.max_curvature)
        length = vehicle.front + vehicle.rear
        margin = max(min(self.least + settings.reserve, room - CHECK), self.least)
        near = max(clearance.on_routes, margin) + 1e-6
        return Terms(
            radius=radius,
            wheelbase=vehicle.wheelbase,
            arc=ARC * radius,
            check=ARC * radius / 5.0,
            cell=1.2 * ARC * radius,
            open=max(OPEN * radius, near),
            reach=hypot(max(vehicle.front, vehicle.rear), 0.5 * vehicle.width),
            margin=margin,
            near=near,
            ahead=1.0,
            back=settings.reverse_cost,
            cusp=settings.cusp_cost,
            steering=settings.steering_cost,
            closeness=settings.closeness_cost,
            weight=1.0,
            finer=1.0,
            fine=1.5 * length,
            tight=clearance.on_routes,
            more=0.5,
        )


def _moved(grid: ShapeGrid, by: Array) -> ShapeGrid:
    """The same shapes elsewhere, by (2,) [m]: in the same cells."""
    circles = grid.circles + np.array([by[0], by[1], 0.0])
    corners, origin = grid.corners + by, grid.origin + by
    for each in (circles, corners, origin):
        each.setflags(write=False)
    return replace(grid, corners=corners, circles=circles, origin=origin)
