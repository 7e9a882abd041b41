"""The obstacles of a run: those that stand there, come and go, and fill the way as a fault."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
import shapely

from geometry import Corridor, PathPart, Pose2, ReferencePath
from rti_mpcc.config import Vehicle
from rti_mpcc.model.footprint import body_polygons
from rti_mpcc.simulation.faults import FaultSection
from rti_mpcc.types import Array

THICKNESS = 0.5
"""Of what fills the way, along it [m]."""
ACROSS = 10.0
"""It reaches to the boundaries, at most so far to each side of the path [m]."""
BESIDE = 0.5
"""In an area it reaches so far beyond both sides of a body on the path [m]."""

Boundaries = tuple[tuple[Array, ...], tuple[Array, ...]]
Obstacles = Sequence[Array]


@dataclass(slots=True, kw_only=True)
class Scenery:
    """Every change of the obstacles of a run.

    Attributes:
        path: the route; in an area the one that is driven now, None before there is one.
        corridor: along it; None in an area.
        vehicle: the body that drives there.
        faults: those that fill the way.
        obstacles_at: polygons (k, 2) [m] at a time [s] in place of the corridor's own, or besides those of
            the area; or None.
        changes: (from time [s], obstacles) in order of time: those of the corridor, or besides the area's.
        walls: the outline that each fault put across the way.
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
        """What there is at `now` [s]; to be asked in every cycle.

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
        """Outline (4, 2) [m] of what fills the way; before there is one, the way straight ahead."""
        if self.corridor is None:
            path = self.path or ReferencePath.from_segments(pose, [(1, 0.0, 1.0)])
            return wall_on(path, pose, self.vehicle, part=part, near=near, gap=gap)
        assert self.path is not None
        way, lines = self.path.parts[part], self.corridor.lines(part)
        return wall_ahead(way, lines, pose, self.vehicle, near=near, gap=gap)


def wall_ahead(
    part: PathPart, boundaries: Boundaries, pose: Pose2, vehicle: Vehicle, *, near: float, gap: float
) -> Array:
    """Outline (4, 2) [m] of an obstacle across the way of a vehicle; behind the part's end straight on.

    Args:
        part: the active part of the route; boundaries: left and right ones of it.
        pose: of the vehicle; near: its last progress along the route [m].
        gap: along the route, from the end of the body that goes ahead to the obstacle [m].
    """
    foot = _touched(part, vehicle, _progress(part, pose, near), gap)
    return _wall(foot, part, _reach(foot, 1.0, boundaries), _reach(foot, -1.0, boundaries))


def wall_on(
    path: ReferencePath, pose: Pose2, vehicle: Vehicle, *, part: int, near: float, gap: float
) -> Array:
    """Outline (4, 2) [m] of an obstacle across the way of a vehicle in an area, by BESIDE wider than it.

    It stands where the body comes to it after `gap` more of the route [m], over cusps, too; but not where the
    body is now: rather where the active part would go on straight.

    Args:
        part: index of the active part.
        pose: of the vehicle; near: its last progress along the route [m].
    """
    now, *later = path.parts[part:]
    theta = _progress(now, pose, near)
    there = next((way for way in (now, *later) if theta + gap <= way.end), path.parts[-1])
    beside = 0.5 * vehicle.width + BESIDE
    for way in (there, now):
        outline = _wall(_touched(way, vehicle, theta, gap), way, beside, beside)
        body = body_polygons(np.array([[pose.x, pose.y, pose.phi]]), vehicle)[0]
        if not shapely.Polygon(outline).intersects(shapely.Polygon(body)):
            break
    return outline


def _progress(part: PathPart, pose: Pose2, near: float) -> float:
    """Theta [m], behind the part's end straight on."""
    return part.progress(pose, part.project(pose.x, pose.y, near=near))


def _touched(part: PathPart, vehicle: Vehicle, theta: float, gap: float) -> Pose2:
    """Where on a part the body's end that goes ahead is, when the rear axle is `gap` beyond theta [m]."""
    overhang = vehicle.front if part.direction > 0 else vehicle.rear
    return part.pose(theta + overhang + gap)


def _wall(foot: Pose2, part: PathPart, left: float, right: float) -> Array:
    """Outline (4, 2) of what stands across a part, behind `foot`, so far to the left and right of it [m]."""
    far = part.direction * THICKNESS
    ends = ((0.0, -right), (far, -right), (far, left), (0.0, left))
    corners = [foot.compose(Pose2(*at, 0.0)) for at in ends]
    return np.array([[corner.x, corner.y] for corner in corners])


def _reach(foot: Pose2, side: float, boundaries: Boundaries) -> float:
    """From the path across it to the nearest boundary [m]; side 1 is the left, -1 the right."""
    tip = foot.compose(Pose2(0.0, side * ACROSS, 0.0))
    ray = shapely.LineString([(foot.x, foot.y), (tip.x, tip.y)])
    left, right = boundaries
    met = ray.intersection(shapely.MultiLineString([*left, *right]))
    return ACROSS if met.is_empty else float(shapely.Point(foot.x, foot.y).distance(met))


def _same(outlines: Obstacles, known: Obstacles) -> bool:
    """Whether these are the same polygons (m, 2) in the same order."""
    return len(outlines) == len(known) and all(map(np.array_equal, outlines, known))
