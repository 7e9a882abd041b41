"""The name and place of what a body meets, for the reasons of a command."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import shapely

from geometry import Area
from geometry.outline import shape_of
from rti_mpcc.config import ControllerConfig
from rti_mpcc.model.footprint import body_polygons
from rti_mpcc.model.layout import V
from rti_mpcc.planning.surroundings import Obstacle, Surroundings
from rti_mpcc.types import Array

NEAR = 1.0  # [m]; what is farther from a body is not met by it
MOST_NAMED = 100  # obstacles of an area; with more it is a map, and the number of a rectangle says nothing


class Met(NamedTuple):
    """What a body meets, and where (x, y) [m]."""

    what: str
    where: tuple[float, float]

    def __str__(self) -> str:
        x, y = self.where
        return f"{self.what} at ({x:.2f}, {y:.2f})"


class _Near(NamedTuple):
    """Something near a body: how far it is in effect [m], its name and its shape."""

    apart: float
    what: str
    shape: shapely.Geometry


def met_by(
    state: Array,
    surroundings: Surroundings,
    part: int,
    config: ControllerConfig,
    ahead: float = 0.0,
    within: float = NEAR,
) -> Met:
    """What a body overlaps, or else what is nearest to it.

    Args:
        state: (>= 3,) x, y, phi of the body, and v if it has six entries.
        ahead: time from when the obstacles were given [s], over which they may move.
        within: farthest distance of what is named [m].
    """
    body = shapely.Polygon(body_polygons(state[None], config.vehicle)[0])
    speed = abs(float(state[V])) if len(state) > V else 0.0
    stop = config.dead_time + config.cycle + speed / config.limits.acceleration
    near = [_obstacle(each, body, ahead, stop) for each in surroundings.obstacles]
    for name, lines in zip(("left", "right"), surroundings.known.lines(part), strict=True):
        shapes = map(shapely.LineString, lines)
        near += [_Near(body.distance(line), f"the {name} boundary", line) for line in shapes]
    if surroundings.known.area is not None:
        near += _solid_near(body, surroundings.known.area)
    nearest = min(near, key=lambda each: each.apart, default=None)
    if nearest is None or nearest.apart > within:
        return Met("what lies beyond a boundary", (body.centroid.x, body.centroid.y))
    overlap = body.intersection(nearest.shape)
    if not overlap.is_empty:
        return Met(nearest.what, (overlap.centroid.x, overlap.centroid.y))
    (x, y), _ = shapely.shortest_line(nearest.shape, body).coords
    return Met(nearest.what, (x, y))


def _obstacle(obstacle: Obstacle, body: shapely.Polygon, ahead: float, stop: float) -> _Near:
    """An obstacle; one that moves is met as far before it as it gets while the vehicle stops, Eq. (S1)."""
    shape, name = obstacle.shape, f"obstacles[{obstacle.index}]"
    if not obstacle.moves:
        return _Near(body.distance(shape), name, shape)
    moved = shapely.transform(shape, lambda corners: corners + ahead * obstacle.velocity)
    covered = shapely.convex_hull(shapely.union_all([shape, moved]))
    return _Near(body.distance(covered) - stop * obstacle.speed, name, covered)


def _solid_near(body: shapely.Polygon, area: Area) -> Iterator[_Near]:
    """The convex pieces of an area's obstacles near a body."""
    middle, around = body.centroid, shapely.get_coordinates(body)
    reach = NEAR + float(np.hypot(*(around - (middle.x, middle.y)).T).max())
    circles, starts = area.grid.circles, area.grid.starts
    apart = np.hypot(circles[:, 0] - middle.x, circles[:, 1] - middle.y) - circles[:, 2]
    for k in np.flatnonzero(apart <= reach).tolist():
        corners = area.grid.corners[starts[k] : starts[k + 1]]
        piece = shape_of(corners)
        if (far := body.distance(piece)) <= NEAR:
            yield _Near(far, _name_in(area, corners), piece)


def _name_in(area: Area, corners: Array) -> str:
    """The name of what a convex piece with these corners (m, 2) belongs to: they are corners of that."""
    if len(area.obstacles) <= MOST_NAMED:
        for k, ring in enumerate(area.obstacles):
            if (corners[:, None] == ring).all(axis=2).any(axis=1).all():
                return f"area.obstacles[{k}]"
    inside = shape_of(corners).centroid
    beyond = area.boundary is not None and not shapely.Polygon(area.boundary).intersects(inside)
    return "the area's boundary" if beyond else "an obstacle of the area"
