"""A given path that the vehicle cannot drive as it is: made smooth, or led past what stands, where that is.

It bends more sharply there than the vehicle can, or the body on it comes nearer to something than the hard
minimum. Each such place is cut out with some way before and after it, more and more until what is cut out
can be made smooth (`smoothing`) with the hard minimum kept to all that stands; or, past what stands, until
a way without a change of direction is planned there. Where there is none the path stays as it was given:
the vehicle passes there beside it, or plans another way when it has come to a stop.
"""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass
from math import inf
from typing import cast

import numpy as np
import shapely
from numpy.typing import NDArray

from geometry import Area, PathPart, ReferencePath
from geometry.arrays import Array
from geometry.doors import door
from geometry.settings import replaced
from rti_mpcc.config import ControllerConfig
from rti_mpcc.kernels import make_ready
from rti_mpcc.model.footprint import body_of
from rti_mpcc.route_planner.arcs import poses_after, split
from rti_mpcc.route_planner.drivable import Drivable, Kept, drivable
from rti_mpcc.route_planner.planner import plan_manoeuvre
from rti_mpcc.route_planner.problem import Problem

_SPACING = 0.1  # [m] between the poses at which it is measured how far a way leads beside the path
_ROUNDING = 1e-6
Places = list[tuple[float, float]]
"""Between which progress [m] each of them is."""
_NODES = 10_000  # of a search past what stands: where there is a way in one go it is found soon
_BISECTIONS = 3  # of the clearance, between the hard minimum and the margin
_SHORTEST = 1e-9  # [m]: a shorter piece is none


@dataclass(frozen=True, slots=True, kw_only=True)
class PathChange:
    """A place at which a given path cannot be driven, and what was made of it.

    Attributes:
        part: of the path; start, end: progress along the given path between which it was changed, or, where
            it was left, bends too sharply [m].
        curvature: the largest there as it was given; possible: that can be driven [1/m].
        room: from the body on it to what stands there, the least; needed: the hard minimum [m].
        aside: how far the smooth way leads beside the given one, at most [m]; None: the path was left as it
            is, for no smooth way is clear there.
    """

    part: int
    start: float
    end: float
    curvature: float
    possible: float
    room: float
    needed: float
    aside: float | None

    def __str__(self) -> str:
        made, wrong = "left as it is, no smooth way is clear there", []
        if self.aside is not None:
            made = f"made smooth, at most {self.aside:.2f} m beside it"
        if self.curvature > self.possible:
            wrong.append(f"bends by {self.curvature:.3f} 1/m, the vehicle can drive {self.possible:.3f} 1/m")
        if self.room < self.needed:
            wrong.append(f"leaves {self.room:.2f} m beside the body, at least {self.needed:.2f} m are kept")
        where = f"the path, part {self.part}, theta = {self.start:.2f} to {self.end:.2f} m, "
        return f"{where}{', and '.join(wrong)}: {made}"


@dataclass(frozen=True, slots=True, kw_only=True)
class MendedPath:
    """A path that can be driven, as far as one was found, and what was changed, in order."""

    path: ReferencePath
    changes: tuple[PathChange, ...]


@door()
def mended_path(path: ReferencePath, area: Area, config: ControllerConfig | None = None) -> MendedPath:
    """The path made smooth where it bends more sharply than the vehicle can, or leads it into something.

    One that can be driven is returned itself. Parts, directions, and the poses at both ends of each part stay
    as they are.

    Args:
        area: where the vehicle may be; config: of the vehicle, its limits, and `ControllerConfig.route`.
    """
    config = config or ControllerConfig()
    make_ready()
    pieces: list[Array] = []
    changes: list[PathChange] = []
    for index, part in enumerate(path.parts):
        rows, found = _mended_part(index, part, area, config)
        pieces.append(rows)
        changes += found
    if all(change.aside is None for change in changes):
        return MendedPath(path=path, changes=tuple(changes))
    whole = np.vstack(pieces)
    segments = [(1 if length > 0.0 else -1, curvature, abs(length)) for length, curvature in whole.tolist()]
    return MendedPath(path=ReferencePath.from_segments(path.start, segments), changes=tuple(changes))


def _most(config: ControllerConfig) -> float:
    return config.max_curvature * (1.0 + _ROUNDING)


def _mended_part(
    index: int, part: PathPart, area: Area, config: ControllerConfig
) -> tuple[Array, list[PathChange]]:
    """Signed lengths [m] and curvatures [1/m] of the pieces (n, 2) of a part, mended."""
    rows: list[Array] = []
    changes: list[PathChange] = []
    at, places = part.start, _united(_bends(part, config) + _tight(part, area, config))
    while places:
        change, way = _put_in(index, part, at, places, area, config)
        rows += [_between(part, at, change.start), way]
        changes.append(change)
        at = change.end
        places = [place for place in places if place[1] > at]
    return np.vstack([*rows, _between(part, at, part.end)]), changes


def _united(places: Places) -> Places:
    """Those that overlap or meet are one, in order."""
    found: Places = []
    for begin, end in sorted(places):
        if found and begin <= found[-1][1]:
            found[-1] = found[-1][0], max(found[-1][1], end)
        else:
            found.append((begin, end))
    return found


def _bends(part: PathPart, config: ControllerConfig) -> Places:
    """Where the part bends too sharply."""
    return _runs(np.abs(part.curvatures) > _most(config), part.knots)


def _tight(part: PathPart, area: Area, config: ControllerConfig) -> Places:
    """Where the body on the part comes too near to something."""
    theta = part.places(_SPACING)
    near = _room(part, theta, area, config) < config.clearance.least
    return _runs(near[1:] | near[:-1], theta)


def _room(part: PathPart, theta: Array, area: Area, config: ControllerConfig) -> Array:
    """Distance (n,) [m] from bodies on the part to what stands, as far as it counts."""
    at, needed = part.reference(theta), config.clearance.least
    poses = np.column_stack([at.x, at.y, at.phi])
    apart = area.signed_distances(body_of(config.vehicle), poses, needed + _SPACING)
    found: Array = apart.reshape(len(poses), -1).min(axis=1, initial=inf)
    return found


def _runs(wrong: NDArray[np.bool_], knots: Array) -> Places:
    """From where to where neighbouring pieces (n,) between `knots` (n+1,) [m] are wrong."""
    edged = np.concatenate(([False], wrong, [False]))
    first, last = np.flatnonzero(edged[1:] & ~edged[:-1]), np.flatnonzero(edged[:-1] & ~edged[1:])
    return list(zip(knots[first].tolist(), knots[last].tolist(), strict=True))


def _put_in(
    index: int, part: PathPart, at: float, places: Places, area: Area, config: ControllerConfig
) -> tuple[PathChange, Array]:
    """What becomes of the first of some places, the last change having ended `at` [m]: the change, and its
    pieces (n, 2)."""
    place = places[0]
    reach, way, span = 1.0 / config.max_curvature, None, place
    while way is None and span != (at, part.end):
        span = _span(places, reach, at, part.end)
        way = _smoothed(part, *span, area, config)
        if way is None and _collides(part, span, area, config):
            way = _past(part, *span, area, config)
        reach *= 2.0
    span = place if way is None else span
    given, theta = _between(part, *span), np.arange(*span, _SPACING)
    change = PathChange(
        part=index,
        start=span[0],
        end=span[1],
        curvature=float(np.abs(given[:, 1]).max()),
        possible=config.max_curvature,
        room=float(_room(part, theta, area, config).min()),
        needed=config.clearance.least,
        aside=None if way is None else _aside(part, span, way),
    )
    return change, given if way is None else way


def _collides(part: PathPart, span: tuple[float, float], area: Area, config: ControllerConfig) -> bool:
    least = float(_room(part, np.arange(*span, _SPACING), area, config).min())
    return least < config.clearance.least


def _span(places: Places, reach: float, least: float, most: float) -> tuple[float, float]:
    """From `reach` [m] before the first place to so far behind it, and behind each one that this comes to."""
    first, last = places[0]
    for begin, end in places:
        if begin < last + 2.0 * reach:
            last = end
    return max(first - reach, least), min(last + reach, most)


def _aside(part: PathPart, span: tuple[float, float], way: Array) -> float:
    """How far a way leads beside the part that it takes the place of, at most [m]."""
    given = part.reference(np.linspace(*span, int(np.ceil((span[1] - span[0]) / _SPACING)) + 1))
    begin = part.pose(span[0])
    poses = poses_after(np.array([begin.x, begin.y, begin.phi]), split(way, _SPACING))
    line = shapely.linestrings(np.column_stack([given.x, given.y]))
    return float(shapely.distance(shapely.points(poses[:, :2]), line).max())


def _between(part: PathPart, start: float, end: float) -> Array:
    """Signed lengths [m] and curvatures [1/m] of the pieces (n, 2) of a part from `start` to `end` [m]."""
    begins, ends = np.maximum(part.knots[:-1], start), np.minimum(part.knots[1:], end)
    there = ends - begins > _SHORTEST * min(end - start, 1.0)
    return np.column_stack([part.direction * (ends - begins)[there], part.curvatures[there]])


def _smoothed(part: PathPart, start: float, end: float, area: Area, config: ControllerConfig) -> Array | None:
    """The part itself made smooth from `start` to `end` [m], or None: with the margin beside the body where
    there is room for it, else with as much as there is, by bisection."""
    problem = Problem.of(part.pose(start), part.pose(end), area, config)
    at = part.reference(np.arange(start, end, _SPACING))
    line = np.column_stack([at.x - problem.given[0].x, at.y - problem.given[0].y, at.phi])
    given = _between(part, start, end)

    def with_room(least: float) -> Array | None:
        if min(problem.room) < least:
            return None
        driven = _whole(drivable(problem, given, np.zeros((0, 2)), Kept(clearance=least, line=line)))
        bend = float(np.abs(driven.way[:, 1]).max())
        fits = not driven.stops.any() and driven.clearance >= least and bend <= _most(config)
        return driven.way if fits else None

    least, most = config.clearance.least, config.clearance.on_routes
    found = with_room(least)
    if found is None or most <= least:
        return found
    for _ in range(_BISECTIONS):
        kept = 0.5 * (least + most)
        another = with_room(kept)
        if another is None:
            most = kept
        else:
            found, least = another, kept
    return found


def _past(part: PathPart, start: float, end: float, area: Area, config: ControllerConfig) -> Array | None:
    """A way past what stands, in one go in the direction of the part, from `start` to `end` [m], or None."""
    route = config.route.along_path()
    # What the vehicle has to go through it has to go through, with whatever room there is.
    short = replaced(route, nodes=min(route.nodes, _NODES), reserve=0.0)
    searched = replaced(config, route=short)
    made = plan_manoeuvre(part.pose(start), part.pose(end), area, searched)
    if not made.found or made.path is None or len(made.path.parts) != 1:
        return None
    (way,) = made.path.parts
    return _between(way, way.start, way.end) if way.direction == part.direction else None


def _whole(steps: Generator[None, None, Drivable]) -> Drivable:
    """What the slices come to."""
    while True:
        try:
            next(steps)
        except StopIteration as ended:
            return cast(Drivable, ended.value)
