"""[path] and [corridor]: a given route and the space along it; [area]: the free space to plan a route in."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from geometry import Area, Corridor, Narrowing, Pose2, ReferencePath
from geometry.outline import checked_shape, outline_at
from rti_mpcc.simulation.sections.base import (
    FileName,
    KeyProblem,
    ListOf,
    Outline,
    Pair,
    Polygon,
    Positive,
    Section,
    Triple,
    refusal,
)
from rti_mpcc.types import Obstacle


class SegmentSection(Section):
    """One piece of constant curvature [1/m] and length [m]; direction -1 is reverse."""

    direction: Literal[1, -1]
    curvature: float
    length: Positive


class PathSection(Section):
    """Either `start` (x, y [m], heading [rad] of the vehicle) and `segments`, or a CSV `file`."""

    start: Triple | None = None
    segments: Annotated[ListOf[SegmentSection], Field(min_length=1)] | None = None
    file: FileName | None = None

    def _problems(self) -> Iterator[KeyProblem]:
        missing = [key for key in ("start", "segments") if getattr(self, key) is None]
        if self.file is not None and len(missing) < 2:
            yield KeyProblem("file", self.file, "either file, or start and segments, not both")
        elif self.file is None and missing:
            for key in missing:
                yield KeyProblem(key, None, "required where path.file is not given")
        else:
            yield from refusal("" if self.file is None else "file", self.file, self.build, PathSection)

    def build(self) -> ReferencePath:
        """The route. Raises PathError."""
        if self.file is not None:
            return ReferencePath.from_csv(self.file)
        assert self.start is not None
        assert self.segments is not None
        segments = [(piece.direction, piece.curvature, piece.length) for piece in self.segments]
        return ReferencePath.from_segments(start=Pose2(*self.start), segments=segments)


class NarrowingSection(Section):
    """Other offsets [m] of one or both boundaries between two arc lengths [m] of the whole route."""

    start: float = Field(alias="from", ge=0.0)
    end: float = Field(alias="to")
    left: float | None = None
    right: float | None = None

    def _problems(self) -> Iterator[KeyProblem]:
        if self.left is None and self.right is None:
            yield KeyProblem("", None, "needs left, right or both")


class CorridorSection(Section):
    """Either offsets `left` and `right` [m] of the path (positive to the left) or a `polygon`; obstacles."""

    left: float | None = None
    right: float | None = None
    narrowings: ListOf[NarrowingSection] = ()
    polygon: Polygon | None = None
    obstacles: ListOf[Outline] = ()

    def _problems(self) -> Iterator[KeyProblem]:
        for key, value in (("left", self.left), ("right", self.right)):
            if self.polygon is None and value is None:
                yield KeyProblem(key, None, "required where corridor.polygon is not given")
            if self.polygon is not None and value is not None:
                yield KeyProblem(key, value, "either polygon, or left and right, not both")
        if self.polygon is not None and self.narrowings:
            tables = f"{len(self.narrowings)} tables"
            yield KeyProblem("narrowings", tables, "only with left and right, not with polygon")

    def build(self, path: ReferencePath) -> Corridor:
        """The drivable area along `path`. Raises CorridorError."""
        if self.polygon is not None:
            return Corridor.from_polygon(path, self.polygon, obstacles=self.obstacles)
        assert self.left is not None
        assert self.right is not None
        narrowings = [Narrowing(each.start, each.end, each.left, each.right) for each in self.narrowings]
        return Corridor.from_offsets(
            path, left=self.left, right=self.right, narrowings=narrowings, obstacles=self.obstacles
        )


class MovingSection(Section):
    """An obstacle that moves: `polygon` [m] where it is at `from` [s], `velocity` [m/s], until `to` [s]."""

    polygon: Outline
    velocity: Pair
    turn_rate: float = 0.0
    start: float = Field(0.0, alias="from", ge=0.0)
    end: float | None = Field(None, alias="to")
    name: str = ""

    def _problems(self) -> Iterator[KeyProblem]:
        if self.end is not None and self.end <= self.start:
            yield KeyProblem("to", self.end, f"must be above from = {self.start}")
        yield from refusal("", None, lambda: self.at(self.start), MovingSection)

    def at(self, now: float) -> Obstacle | None:
        """The obstacle at `now` [s]; None: it is not there. Raises InputError."""
        if now < self.start or (self.end is not None and now > self.end):
            return None
        corners, seconds = np.array(self.polygon), now - self.start
        middle = checked_shape(corners, "polygon").centroid
        turning = Pose2(middle.x, middle.y, self.turn_rate * seconds)
        turned = outline_at(corners - (middle.x, middle.y), turning)
        return Obstacle(turned + seconds * np.array(self.velocity), self.velocity, self.turn_rate, self.name)


class AreaSection(Section):
    """Where the vehicle may be: either `boundary` and `obstacles` [m], or an occupancy grid, the YAML `map`.

    Without a boundary a scenario has a box, `route_planner.problem.BOX` beyond all that is given.
    """

    boundary: Polygon | None = None
    obstacles: ListOf[Outline] = ()
    map: FileName | None = None

    def _problems(self) -> Iterator[KeyProblem]:
        if self.map is not None and (self.boundary or self.obstacles):
            yield KeyProblem("map", self.map, "either map, or boundary and obstacles, not both")
        else:
            yield from refusal("" if self.map is None else "map", self.map, self.build, AreaSection)

    def build(self) -> Area:
        """The area. Raises AreaError."""
        if self.map is not None:
            return Area.from_map(self.map)
        return Area(boundary=self.boundary, obstacles=self.obstacles)
