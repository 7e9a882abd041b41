"""A given path that the vehicle cannot drive as it is, repaired where a route is found.

The path bends more sharply there than the vehicle can, or the body on it comes nearer to something than the
hard minimum. Each such place is cut out with a length before and after it, more and more until the cut can be
made smooth (`smoothing`) with the hard minimum kept to all that is solid; or, past obstacles, until a route
without a change of direction is planned there. Where there is none the path stays as it was given: the
vehicle passes there beside it, or replans when it has come to a stop.
"""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass, replace
from typing import cast

import numpy as np
import shapely

from geometry import Area, PathPart, ReferencePath
from geometry.arrays import Array, Mask
from geometry.settings import replaced
from geometry.validation import validated
from rti_mpcc.config import ControllerConfig
from rti_mpcc.kernels import make_ready
from rti_mpcc.model.footprint import body_of
from rti_mpcc.route_planner.arcs import NO_LENGTH, poses_after, split_arcs
from rti_mpcc.route_planner.drivable import DrivableRoute, make_drivable
from rti_mpcc.route_planner.planner import plan_manoeuvre
from rti_mpcc.route_planner.problem import RouteProblem

_SPACING = 0.1  # [m] between the poses at which clearances and distances from the path are measured
_ROUNDED = 1.0 + 1e-6  # the largest curvature, times this, can be driven
_NODES = 10_000  # of a search past obstacles: where there is a route in one go it is found soon
_BISECTIONS = 3  # of the clearance, between the hard minimum and the margin

Span = tuple[float, float]
"""Progress [m] of a place on a path, from and to."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PathChange:
    """A place at which a given path cannot be driven, and how it was repaired.

    Attributes:
        part: of the path; start, end: progress along the given path between which it was changed, or, where
            it was left, bends too sharply [m].
        curvature: the largest there as it was given; possible: that can be driven [1/m].
        clearance: least clearance of the body on it; needed: the hard minimum [m].
        aside: largest distance of the smooth route from the given path [m]; None: the path was left as it is,
            for no smooth route is clear there.
    """

    part: int
    start: float
    end: float
    curvature: float
    possible: float
    clearance: float
    needed: float
    aside: float | None

    def __str__(self) -> str:
        made, wrong = "left as it is, no smooth route is clear there", []
        if self.aside is not None:
            made = f"made smooth, at most {self.aside:.2f} m beside it"
        if self.curvature > self.possible:
            wrong.append(f"bends by {self.curvature:.3f} 1/m, the vehicle can drive {self.possible:.3f} 1/m")
        if self.clearance < self.needed:
            wrong.append(
                f"leaves a clearance of {self.clearance:.2f} m, at least {self.needed:.2f} m is required"
            )
        where = f"the path, segment {self.part}, theta = {self.start:.2f} to {self.end:.2f} m, "
        return f"{where}{', and '.join(wrong)}: {made}"


@dataclass(frozen=True, slots=True, kw_only=True)
class RepairedPath:
    """A path that can be driven, as far as one was found, and its changes, in order."""

    path: ReferencePath
    changes: tuple[PathChange, ...]


@validated()
def repaired_path(path: ReferencePath, area: Area, config: ControllerConfig | None = None) -> RepairedPath:
    """The path made smooth where it bends more sharply than the vehicle can, or leads it into something.

    One that can be driven is returned itself. Parts, directions, and the poses at both ends of each part stay
    as they are.

    Args:
        area: where the vehicle may be; config: of the vehicle, its limits, and `ControllerConfig.route`.
    """
    make_ready()
    arcs, changes = [], []
    for index, part in enumerate(path.parts):
        rows, found = _Repair(part, area, config or ControllerConfig()).repaired(index)
        arcs.append(rows)
        changes += found
    if all(change.aside is None for change in changes):
        return RepairedPath(path=path, changes=tuple(changes))
    segments = [(1 if s > 0.0 else -1, curvature, abs(s)) for s, curvature in np.vstack(arcs).tolist()]
    return RepairedPath(path=ReferencePath.from_segments(path.start, segments), changes=tuple(changes))


@dataclass(frozen=True, slots=True)
class _Repair:
    """The repair of one segment of a path; arcs (n, 2) are signed lengths [m] and curvatures [1/m]."""

    part: PathPart
    area: Area
    config: ControllerConfig

    def repaired(self, index: int) -> tuple[Array, list[PathChange]]:
        """Arcs of the segment with this index, and its changes."""
        rows: list[Array] = []
        changes: list[PathChange] = []
        at, places = self.part.start, self._places()
        while places:
            span, route = self._replacement(at, places)
            given = _arcs_between(self.part, *span)
            change = PathChange(
                part=index,
                start=span[0],
                end=span[1],
                curvature=float(np.abs(given[:, 1]).max()),
                possible=self.config.max_curvature,
                clearance=self._clearance(span),
                needed=self.config.clearance.least,
                aside=None if route is None else self._aside(span, route),
            )
            rows += [_arcs_between(self.part, at, span[0]), given if route is None else route]
            changes.append(change)
            at = span[1]
            places = [place for place in places if place[1] > at]
        return np.vstack([*rows, _arcs_between(self.part, at, self.part.end)]), changes

    def _places(self) -> list[Span]:
        """Where the segment bends too sharply or the body on it comes too near to something, in order; places
        that overlap or meet are one."""
        theta = self.part.places(_SPACING)
        near = self._clearances(theta) < self.config.clearance.least
        bends = _runs(np.abs(self.part.curvatures) > self.config.max_curvature * _ROUNDED, self.part.knots)
        found: list[Span] = []
        for start, end in sorted(bends + _runs(near[1:] | near[:-1], theta)):
            if found and start <= found[-1][1]:
                found[-1] = found[-1][0], max(found[-1][1], end)
            else:
                found.append((start, end))
        return found

    def _clearances(self, theta: Array) -> Array:
        """Clearances (n,) [m] of bodies on the segment, as far as they count."""
        at, needed = self.part.reference(theta), self.config.clearance.least
        poses = np.column_stack([at.x, at.y, at.phi])
        return self.area.signed_distances(body_of(self.config.vehicle), poses, needed + _SPACING)

    def _clearance(self, span: Span) -> float:
        return float(self._clearances(np.arange(*span, _SPACING)).min())

    def _replacement(self, at: float, places: list[Span]) -> tuple[Span, Array | None]:
        """The span of the first place and its new arcs, or None, the last change having ended `at` [m]."""
        reach, route, span = 1.0 / self.config.max_curvature, None, places[0]
        while route is None and span != (at, self.part.end):
            # From `reach` before the first place to as far behind it, and behind each one within that.
            first, last = places[0]
            for start, end in places:
                if start < last + 2.0 * reach:
                    last = end
            span = max(first - reach, at), min(last + reach, self.part.end)
            route = self._smoothed(*span)
            if route is None and self._clearance(span) < self.config.clearance.least:
                route = self._detour(*span)
            reach *= 2.0
        return (places[0] if route is None else span), route

    def _aside(self, span: Span, route: Array) -> float:
        """Largest distance [m] of a route from the span that it replaces."""
        given = self.part.reference(np.linspace(*span, int(np.ceil((span[1] - span[0]) / _SPACING)) + 1))
        start = self.part.pose(span[0])
        poses = poses_after(np.array([start.x, start.y, start.phi]), split_arcs(route, _SPACING))
        line = shapely.linestrings(np.column_stack([given.x, given.y]))
        return float(shapely.distance(shapely.points(poses[:, :2]), line).max())

    def _smoothed(self, start: float, end: float) -> Array | None:
        """The segment itself made smooth from `start` to `end` [m], or None: with the margin where there is
        room for it, else with as large a clearance as there is, by bisection."""
        at, clearance = self.part.reference(np.arange(start, end, _SPACING)), self.config.clearance
        problem = RouteProblem.of(self.part.pose(start), self.part.pose(end), self.area, self.config)
        given, origin = _arcs_between(self.part, start, end), problem.given[0]
        line = np.column_stack([at.x - origin.x, at.y - origin.y, at.phi])
        problem = replace(problem, line=line)

        def with_clearance(least: float) -> Array | None:
            if min(problem.end_clearances) < least:
                return None
            driven = _run(make_drivable(problem, given, np.zeros((0, 2)), least))
            bends = np.abs(driven.arcs[:, 1]) > self.config.max_curvature * _ROUNDED
            fits = driven.clearance >= least and not (driven.stops.any() or bends.any())
            return driven.arcs if fits else None

        least, most = clearance.least, clearance.on_routes
        found = with_clearance(least)
        if found is None or most <= least:
            return found
        for _ in range(_BISECTIONS):
            kept = 0.5 * (least + most)
            another = with_clearance(kept)
            if another is None:
                most = kept
            else:
                found, least = another, kept
        return found

    def _detour(self, start: float, end: float) -> Array | None:
        """A route past obstacles, in one go in the direction of the segment, from `start` to `end` [m], or
        None."""
        route = self.config.route.along_path()
        # A gap on a given path is driven through with whatever clearance there is.
        short = replaced(route, nodes=min(route.nodes, _NODES), reserve=0.0)
        config = replaced(self.config, route=short)
        made = plan_manoeuvre(self.part.pose(start), self.part.pose(end), self.area, config)
        if not made.found or len(made.path.parts) != 1:
            return None
        (part,) = made.path.parts
        return _arcs_between(part, part.start, part.end) if part.direction == self.part.direction else None


def _arcs_between(part: PathPart, start: float, end: float) -> Array:
    starts, ends = np.maximum(part.knots[:-1], start), np.minimum(part.knots[1:], end)
    there = ends - starts > NO_LENGTH * min(end - start, 1.0)
    return np.column_stack([part.direction * (ends - starts)[there], part.curvatures[there]])


def _runs(wrong: Mask, knots: Array) -> list[Span]:
    """From where to where neighbouring pieces (n,) between `knots` (n+1,) [m] are wrong."""
    edged = np.concatenate(([False], wrong, [False]))
    first, last = np.flatnonzero(edged[1:] & ~edged[:-1]), np.flatnonzero(edged[:-1] & ~edged[1:])
    return list(zip(knots[first].tolist(), knots[last].tolist(), strict=True))


def _run(steps: Generator[None, None, DrivableRoute]) -> DrivableRoute:
    """The result of all slices."""
    while True:
        try:
            next(steps)
        except StopIteration as ended:
            return cast(DrivableRoute, ended.value)
