"""The obstacles of a run: those that stand there, come and go, and fill the way as a fault."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
import shapely

from geometry import Corridor, PathPart, Pose2, ReferencePath
from rti_mpcc.config import Vehicle
from rti_mpcc.planning.surroundings import same_outlines
from rti_mpcc.simulation.faults import FaultSection
from rti_mpcc.types import Array

THICKNESS = 0.5
"""Of what fills the way, along it [m]."""
ACROSS = 10.0
"""It reaches to the boundaries, at most so far to each side of the path [m]."""

Boundaries = tuple[tuple[Array, ...], tuple[Array, ...]]
Obstacles = Sequence[Array]


@dataclass(slots=True, kw_only=True)
class Scenery:
    """The corridor of a run, and every change of its obstacles.

    Attributes:
        path: the route; corridor: that the run begins with; vehicle: the body that drives there.
        faults: those that fill the way.
        obstacles_at: polygons (k, 2) [m] at a time [s] in place of the corridor's own, or None.
        corridors: (from time [s], corridor) in order of time.
        walls: the outline that each fault put across the way; last: the obstacles that were found last.
    """

    path: ReferencePath
    corridor: Corridor
    vehicle: Vehicle
    faults: tuple[FaultSection, ...] = ()
    obstacles_at: Callable[[float], Obstacles] | None = None
    corridors: list[tuple[float, Corridor]] = field(default_factory=list)
    walls: dict[FaultSection, Array] = field(default_factory=dict)
    last: Obstacles = ()

    @property
    def changing(self) -> bool:
        """Whether obstacles may come and go."""
        return self.obstacles_at is not None or bool(self.faults)

    def obstacles(self, now: float, pose: Pose2, part: int, near: float) -> Obstacles:
        """What there is at `now` [s]; to be asked in every cycle.

        Args:
            pose: of the vehicle; part: index of its active part; near: its last progress on it [m].
        """
        acting = [fault for fault in self.faults if fault.acts(now)]
        for fault in acting:
            if fault not in self.walls:
                way, lines = self.path.parts[part], self.corridor.lines(part)
                self.walls[fault] = wall_ahead(way, lines, pose, self.vehicle, near=near, gap=fault.amount)
        usual = self.corridor.obstacles if self.obstacles_at is None else self.obstacles_at(now)
        found = [*usual, *(self.walls[fault] for fault in acting)]
        if not self.corridors or not same_outlines(found, self.last):
            self.corridors.append((now, self.corridor.with_obstacles(found)))
            self.last = found
        return found


def wall_ahead(
    part: PathPart, boundaries: Boundaries, pose: Pose2, vehicle: Vehicle, *, near: float, gap: float
) -> Array:
    """Outline (4, 2) [m] of an obstacle across the way of a vehicle; behind the part's end straight on.

    Args:
        part: the active part of the route; boundaries: left and right ones of it.
        pose: of the vehicle; near: its last progress along the route [m].
        gap: along the route, from the end of the body that goes ahead to the obstacle [m].
    """
    theta = part.project(pose.x, pose.y, near=near)
    if theta >= part.end:
        theta += max(0.0, part.direction * pose.relative_to(part.last).x)
    overhang = vehicle.front if part.direction > 0 else vehicle.rear
    foot = part.pose(theta + overhang + gap)
    left, right = _reach(foot, 1.0, boundaries), -_reach(foot, -1.0, boundaries)
    far = part.direction * THICKNESS
    corners = [foot.compose(Pose2(*at, 0.0)) for at in ((0.0, right), (far, right), (far, left), (0.0, left))]
    return np.array([[corner.x, corner.y] for corner in corners])


def _reach(foot: Pose2, side: float, boundaries: Boundaries) -> float:
    """From the path across it to the nearest boundary [m]; side 1 is the left, -1 the right."""
    tip = foot.compose(Pose2(0.0, side * ACROSS, 0.0))
    ray = shapely.LineString([(foot.x, foot.y), (tip.x, tip.y)])
    left, right = boundaries
    met = ray.intersection(shapely.MultiLineString([*left, *right]))
    return ACROSS if met.is_empty else float(shapely.Point(foot.x, foot.y).distance(met))
