"""What tables of several files are made of: numbers and outlines with their ranges, an area, a vehicle.

Scenarios (`scenario`) and files of docks (`docks_file`) have them; it imports neither.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Annotated

from pydantic import Field, ValidationInfo, field_validator

from geometry import Area
from geometry.outline import Shape, checked_polygon, checked_shape
from rti_mpcc.config import Vehicle
from rti_mpcc.errors import InputError
from rti_mpcc.simulation.section import Section
from rti_mpcc.simulation.toml_file import Problem

# TOML has lists only; strictness stays on for what is in them.
Pair = Annotated[tuple[float, float], Field(strict=False)]
Triple = Annotated[tuple[float, float, float], Field(strict=False)]
Polygon = Annotated[tuple[Pair, ...], Field(strict=False, min_length=3)]
Obstacle = Annotated[tuple[Pair, ...], Field(strict=False, min_length=1)]
"""A polygon, a line, or a point."""
Positive = Annotated[float, Field(gt=0.0)]
Length = Annotated[float, Field(gt=0.0, le=100.0)]
Tolerance = Annotated[tuple[Positive, Positive, Positive], Field(strict=False)]


def beside_the_file(file: str | None, info: ValidationInfo) -> str | None:
    """A relative file lies relative to the one that names it."""
    folder = (info.context or {}).get("folder")
    return file if file is None or folder is None else str(Path(folder) / file)


class AreaSection(Section):
    """Where the vehicle may be: either `boundary` and `obstacles` [m], or an occupancy grid, the YAML `map`.

    Without a boundary a scenario has a box around all that is given, see `route_planner.problem.BOX`.
    """

    boundary: Polygon | None = None
    obstacles: Annotated[tuple[Obstacle, ...], Field(strict=False)] = ()
    map: str | None = None

    _beside = field_validator("map")(beside_the_file)

    def build(self) -> Area:
        """The area. Raises AreaError."""
        if self.map is not None:
            return Area.from_map(self.map)
        return Area(boundary=self.boundary, obstacles=self.obstacles)


class VehicleSection(Section):
    """The body and wheelbase [m], see `Vehicle`; front and rear are measured from the rear axle."""

    wheelbase: Length = Vehicle().wheelbase
    width: Length = Vehicle().width
    front: Length = Vehicle().front
    rear: float = Field(default=Vehicle().rear, ge=0.0, le=100.0)
    outline: Polygon | None = None

    def build(self) -> Vehicle:
        """The vehicle. Raises ConfigError."""
        return Vehicle(**self.model_dump(exclude_unset=True))


def area_problems(section: AreaSection) -> Iterator[Problem]:
    """A map beside polygons, and each polygon that is none by itself, so that the message can name it."""
    if section.map is not None and (section.boundary or section.obstacles):
        allowed = "either map, or boundary and obstacles, not both"
        yield Problem(key="area.map", value=section.map, allowed=allowed)
    if section.boundary is not None:
        yield from polygon_problems("area.boundary", section.boundary)
    for index, obstacle in enumerate(section.obstacles):
        yield from polygon_problems(f"area.obstacles[{index}]", obstacle, checked_shape)


def map_problem(section: AreaSection, error: InputError) -> Problem:
    """Of an area that `area_problems` lets pass and that cannot be built: its map."""
    return Problem("area" if section.map is None else "area.map", section.map, str(error))


def polygon_problems(
    key: str, polygon: Polygon, check: Callable[[Polygon, str], Shape] = checked_polygon
) -> Iterator[Problem]:
    """That an outline crosses itself, or has no area where it needs one."""
    try:
        check(polygon, "it")
    except InputError as error:
        allowed = f"must be a polygon whose outline does not cross itself, {str(error).rstrip('.')}"
        yield Problem(key=key, value=[list(corner) for corner in polygon], allowed=allowed)
