"""The obstacles of a run: static ones, those that come and go, and those that block the route as a fault."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
import shapely

from geometry import Corridor, PathPart, Pose2, ReferencePath
from rti_mpcc.config import Vehicle
from rti_mpcc.model.footprint import body_polygons
from rti_mpcc.simulation.sections.faults import FaultSection
from rti_mpcc.types import Array

THICKNESS = 0.5
"""Of an obstacle that blocks the route, along it [m]."""
ACROSS = 10.0
"""It reaches to the boundaries, at most so far to each side of the path [m]."""
BESIDE = 0.5
"""In an area it reaches so far beyond both sides of a body on the path [m]."""

Obstacles = Sequence[Array]


@dataclass(slots=True, kw_only=True)
class Scenery:
    """Every change of the obstacles of a run.

    Attributes:
        path: the route; in an area the one that is driven now, None before there is one.
        corridor: along it; None in an area.
        vehicle: the body that drives there.
        faults: those that block the route.
        obstacles_at: polygons (k, 2) [m] at a time [s] in place of the corridor's own, or besides those of
            the area; or None.
        changes: (from time [s], obstacles) in order of time: those of the corridor, or besides the area's.
        walls: the outline that each fault put across the route.
    """

    path: ReferencePath | None
    corridor: Corridor | None
    vehicle: Vehicle
    faults: tuple[FaultSection, ...] = ()
    obstacles_at: Callable[[float], Obstacles] | None = None
    changes: list[tuple[float, Obstacles]] = field(default_factory=list)
    walls: dict[FaultSection, Array] = field(default_factory=dict)

    @property
    def changing(self) -> bool:
        """Whether obstacles may come and go."""
        return self.obstacles_at is not None or bool(self.faults)

    def obstacles(self, now: float, pose: Pose2, part: int, near: float) -> Obstacles:
        """The obstacles at `now` [s]; to be asked in every cycle.

        Args:
            pose: of the vehicle; part: index of its active part; near: its last progress on it [m].
        """
        acting = [fault for fault in self.faults if fault.acts(now)]
        for fault in acting:
            if fault not in self.walls:
                self.walls[fault] = self._wall(pose, part, near, fault.amount)
        usual = self._usual() if self.obstacles_at is None else self.obstacles_at(now)
        found = [*usual, *(self.walls[fault] for fault in acting)]
        if not self.changes or not _same(found, self.changes[-1][1]):
            self.changes.append((now, found))
        return found

    def _usual(self) -> Obstacles:
        return () if self.corridor is None else self.corridor.obstacles

    def _wall(self, pose: Pose2, part: int, near: float, gap: float) -> Array:
        """Outline (4, 2) [m] of an obstacle that the body on the route touches after `gap` [m].

        In a corridor it reaches from boundary to boundary across the active part, which goes on straight
        behind its end. In an area it may be beyond cusps, too, but not where the body is now: rather where
        the active part would go on straight; before there is a route it is straight ahead.
        """
        path = self.path or ReferencePath.from_segments(pose, [(1, 0.0, 1.0)])
        active = path.parts[part]
        theta = active.progress(pose, active.project(pose.x, pose.y, near=near))
        if self.corridor is not None:
            left, right = self.corridor.lines(part)
            foot = self._touched(active, theta, gap)
            lines = shapely.MultiLineString([*left, *right])
            return _across(foot, active, _reach(foot, 1.0, lines), _reach(foot, -1.0, lines))
        beside = 0.5 * self.vehicle.width + BESIDE
        body = shapely.Polygon(body_polygons(np.array([[pose.x, pose.y, pose.phi]]), self.vehicle)[0])
        there = next((way for way in path.parts[part:] if theta + gap <= way.end), path.parts[-1])
        outline = _across(self._touched(there, theta, gap), there, beside, beside)
        if shapely.Polygon(outline).intersects(body):
            outline = _across(self._touched(active, theta, gap), active, beside, beside)
        return outline

    def _touched(self, part: PathPart, theta: float, gap: float) -> Pose2:
        """Where on a part the body's end that goes ahead is, when the rear axle is `gap` beyond theta [m]."""
        overhang = self.vehicle.front if part.direction > 0 else self.vehicle.rear
        return part.pose(theta + overhang + gap)


def _across(foot: Pose2, part: PathPart, left: float, right: float) -> Array:
    """Outline (4, 2) of an obstacle across a part, behind `foot`, so far to the left and right of it [m]."""
    far = part.direction * THICKNESS
    ends = ((0.0, -right), (far, -right), (far, left), (0.0, left))
    corners = [foot.compose(Pose2(*at, 0.0)) for at in ends]
    return np.array([[corner.x, corner.y] for corner in corners])


def _reach(foot: Pose2, side: float, boundaries: shapely.MultiLineString) -> float:
    """From the path across it to the nearest boundary [m]; side 1 is the left, -1 the right."""
    tip = foot.compose(Pose2(0.0, side * ACROSS, 0.0))
    met = shapely.LineString([(foot.x, foot.y), (tip.x, tip.y)]).intersection(boundaries)
    return ACROSS if met.is_empty else float(shapely.Point(foot.x, foot.y).distance(met))


def _same(outlines: Obstacles, known: Obstacles) -> bool:
    """Whether these are the same polygons (m, 2) in the same order."""
    return len(outlines) == len(known) and all(map(np.array_equal, outlines, known))
