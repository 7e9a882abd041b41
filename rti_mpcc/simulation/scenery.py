"""The obstacles of a run: static ones, those that come and go, and those that block the route as a fault."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from math import inf

import numpy as np
import shapely

from geometry import Corridor, PathPart, Pose2, ReferencePath
from geometry.outline import outline_at
from rti_mpcc.config import Vehicle
from rti_mpcc.mission.state import StepRecord
from rti_mpcc.model.footprint import body_polygons
from rti_mpcc.simulation.faults import FaultSection
from rti_mpcc.simulation.sections.ground import MovingSection
from rti_mpcc.types import Array, Obstacle

THICKNESS = 0.5  # of an obstacle that blocks the route, along it [m]
ACROSS = 10.0  # its largest reach to each side of the path, if no boundary is nearer [m]
BESIDE = 0.5  # its reach in an area beyond both sides of a body on the path [m]
_TOUCHING = 1e-3  # bodies that are nearer to one another are in contact [m]

Outlines = Sequence[Array | Obstacle]
Change = tuple[float, tuple[Array, ...]]  # from time [s], all outlines (k, 2) [m]


@dataclass(slots=True, kw_only=True)
class Scenery:
    """Every change of the obstacles of a run: of the corridor's, or beside those of the area."""

    corridor: Corridor | None  # along the given path, None in an area
    vehicle: Vehicle
    faults: tuple[FaultSection, ...] = ()  # those that block the route
    moving: tuple[MovingSection, ...] = ()
    obstacles_at: Callable[[float], Outlines] | None = None  # see `simulate`
    changes: list[Change] = field(default_factory=list)
    walls: dict[FaultSection, Array] = field(default_factory=dict)  # of each fault across the route

    @property
    def changing(self) -> bool:
        """Whether obstacles may come and go."""
        return self.obstacles_at is not None or bool(self.faults or self.moving)

    def obstacles(
        self, now: float, pose: Pose2, path: ReferencePath | None, part: int, near: float
    ) -> Outlines:
        """The obstacles at `now` [s]; to be asked in every cycle.

        `pose` of the vehicle; its `path`, None before the first route; index of the active `part`, and the
        last progress `near` on it [m].
        """
        acting = [fault for fault in self.faults if fault.acts(now)]
        for fault in acting:
            if fault not in self.walls:
                route = path or ReferencePath.from_segments(pose, [(1, 0.0, 1.0)])
                self.walls[fault] = self._wall(pose, route, part, near, fault.amount)
        own = () if self.corridor is None else self.corridor.obstacles
        usual = own if self.obstacles_at is None else self.obstacles_at(now)
        moving = filter(None, (each.at(now) for each in self.moving))
        found = [*usual, *moving, *(self.walls[fault] for fault in acting)]
        known = self.changes[-1][1] if self.changes else None
        if known is None or len(found) != len(known) or not all(map(np.array_equal, found, known)):
            self.changes.append((now, tuple(map(np.asarray, found))))
        return found

    def _wall(self, pose: Pose2, path: ReferencePath, part: int, near: float, gap: float) -> Array:
        """Outline (4, 2) [m] of an obstacle that the body on the route touches after `gap` [m].

        In a corridor it reaches from boundary to boundary across the active part, which is prolonged
        straight. In an area it may lie beyond cusps. If it would meet the body there, it lies across the
        prolonged active part. Without a route it lies straight ahead.
        """
        active = path.parts[part]
        theta = active.progress(pose, active.project(pose.x, pose.y, near=near))
        if self.corridor is not None:
            left, right = self.corridor.lines(part)
            foot = self._touched(active, theta, gap)
            lines = shapely.MultiLineString([*left, *right])
            return _across(foot, active, _reach(foot, 1.0, lines), _reach(foot, -1.0, lines))
        beside = 0.5 * self.vehicle.width + BESIDE
        there = next((way for way in path.parts[part:] if theta + gap <= way.end), path.parts[-1])
        outline = _across(self._touched(there, theta, gap), there, beside, beside)
        if shapely.Polygon(outline).intersects(_body(pose, self.vehicle)):
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


def with_body(
    changes: Sequence[Change],
    log: Sequence[StepRecord],
    goal: Pose2,
    body: Sequence[tuple[float, float]] | None,
) -> tuple[Change, ...]:
    """The obstacles of each time, with the docked object until the vehicle drives on straight to touch it."""
    if body is None:
        return tuple(changes)
    outline = outline_at(body, goal)
    touched = next((record.begin for record in log if record.kind == "straight" and record.dock), inf)
    whole = [(at, (*some, outline)) for at, some in changes if at < touched]
    touching = [(touched, some) for at, some in changes if at <= touched < inf]
    return (*whole, *touching[-1:], *((at, some) for at, some in changes if at > touched))


def touches(pose: Pose2, vehicle: Vehicle, body: Array | None) -> bool:
    """Whether the vehicle is in contact with the docked object, an outline (k, 2) [m] in the world."""
    return body is not None and _body(pose, vehicle).distance(shapely.Polygon(body)) <= _TOUCHING


def _body(pose: Pose2, vehicle: Vehicle) -> shapely.Polygon:
    return shapely.Polygon(body_polygons(np.array([[pose.x, pose.y, pose.phi]]), vehicle)[0])
