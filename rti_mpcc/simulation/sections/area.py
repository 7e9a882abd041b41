"""[area]: the free space in which the vehicle plans its own way."""

from __future__ import annotations

from collections.abc import Iterator

from pydantic import field_validator

from geometry import Area
from geometry.outline import checked_shape
from rti_mpcc.errors import InputError
from rti_mpcc.simulation.sections.base import (
    KeyProblem,
    ListOf,
    Obstacle,
    Polygon,
    Section,
    beside_the_file,
    polygon_problems,
)


class AreaSection(Section):
    """Where the vehicle may be: either `boundary` and `obstacles` [m], or an occupancy grid, the YAML `map`.

    Without a boundary a scenario has a box, `route_planner.problem.BOX` beyond all that is given.
    """

    boundary: Polygon | None = None
    obstacles: ListOf[Obstacle] = ()
    map: str | None = None

    _beside = field_validator("map")(beside_the_file)

    def _problems(self) -> Iterator[KeyProblem]:
        if self.map is not None and (self.boundary or self.obstacles):
            yield KeyProblem("map", self.map, "either map, or boundary and obstacles, not both")
            return
        wrong = [] if self.boundary is None else list(polygon_problems("boundary", self.boundary))
        for index, obstacle in enumerate(self.obstacles):
            wrong += polygon_problems(f"obstacles[{index}]", obstacle, checked_shape)
        yield from wrong
        try:
            if not wrong:
                self.build()
        except InputError as error:
            yield KeyProblem("" if self.map is None else "map", self.map, str(error))

    def build(self) -> Area:
        """The area. Raises AreaError."""
        if self.map is not None:
            return Area.from_map(self.map)
        return Area(boundary=self.boundary, obstacles=self.obstacles)
