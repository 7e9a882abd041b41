"""A found way made drivable: smooth, where that can be and is clear, and else with stops to turn the wheels.

Each window of the way (`windows`) is made smooth on its own and checked at every centimetre. One that does
not become smooth, or comes too near to something, stays as it was found: there the wheels are turned at rest
wherever the curvature steps.
"""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass
from math import pi

import numpy as np

from geometry.arrays import Array, Mask
from rti_mpcc.route_planner.arcs import poses_after, split, split_counts, turns_of
from rti_mpcc.route_planner.problem import CHECK, Problem
from rti_mpcc.route_planner.smoothing import Smoothing
from rti_mpcc.route_planner.smoothing_terms import SmoothingTerms
from rti_mpcc.route_planner.windows import Window, windows_of

CURVATURE_SHARE = 0.9
"""Share of the vehicle's largest curvature that a smooth route uses: the rest is for control."""
_KNOTS = 0.2  # distance of the curvatures of a smoothed route, in radii of the sharpest bend
_WINDOW = 25.0  # longest piece of a route that is smoothed at a time, in radii of the sharpest bend
_ITERATIONS = 40  # of a smoothing, at most
_POSES = 2048  # that are checked at a time
_NEAR_GOAL = 1e-2  # error at the end [m], [rad] of a window that is as good as smooth, ...
_SETTLED = 0.03  # ... and change of its curvatures in the last iteration, as a share
_FIRMER = 3  # so often a way that is smooth but not clear is made to keep its margin by a larger weight, ...
_TIMES = 10.0  # ... each time so many times as large


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Drivable:
    """A way, and where the vehicle has to stop on it.

    Attributes:
        way: (n, 2) signed lengths [m] and curvatures [1/m] of its pieces.
        stops: (n,) whether the wheels are turned at rest after each.
        room: (n,) least clearance of the body along each [m].
    """

    way: Array
    stops: Mask
    room: Array

    @property
    def clearance(self) -> float:
        """The least one of the body along the way [m]."""
        return float(self.room.min())

    @property
    def stretches(self) -> list[tuple[Array, float]]:
        """The ways (n_i, 2) between two stops, one where the direction changes, too; and the least clearance
        along each [m]."""
        ends = np.flatnonzero(turns_of(self.way) | self.stops[:-1]) + 1
        ways, rooms = np.split(self.way, ends), np.split(self.room, ends)
        return [(way, float(room.min())) for way, room in zip(ways, rooms, strict=True)]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Kept:
    """What a way that is made smooth keeps to.

    Attributes:
        clearance: no less than this [m]: that of the search, for control needs it.
        line: (m, 3) closely spaced poses that it stays near; None: there is none.
    """

    clearance: float
    line: Array | None = None


def drivable(problem: Problem, way: Array, last: Array, kept: Kept) -> Generator[None, None, Drivable]:
    """The way to be driven, slice by slice; it ends where its clearance is less than the hard minimum.

    Args:
        way: (n, 2) as it was found; last: straight piece (1, 2) that it ends with, or none (0, 2).
        kept: what it keeps to where it is made smooth.
    """
    if len(way) == 0:  # the vehicle stands where the last piece begins
        room = yield from _room_along(problem, problem.start, last, last=True)
        return Drivable(way=last, stops=np.zeros(len(last), np.bool_), room=room)
    windows = windows_of(way, _WINDOW / problem.config.max_curvature)
    at, whole = problem.start, []
    reached = at
    for window in windows:
        reached = poses_after(reached, window.way)[-1]
        ends_way = not window.joints[1]
        target = _goal(problem, last, reached) if ends_way else reached
        made = yield from _window(problem, window, at, target, last if ends_way else last[:0], kept)
        whole.append(made)
        if made.clearance < problem.least:
            break
        at = poses_after(at, made.way)[-1]
    return Drivable(
        way=np.vstack([each.way for each in whole]),
        stops=np.concatenate([each.stops for each in whole]),
        room=np.concatenate([each.room for each in whole]),
    )


def _goal(problem: Problem, last: Array, reached: Array) -> Array:
    """Where a way that leads to about `reached` (3,) and goes on with a last piece has to end, (3,)."""
    # The place as it was given, less the last piece; the heading on the branch on which the way ends.
    goal = problem.before_goal(float(last[:, 0].sum()))
    goal[2] += 2.0 * pi * round((reached[2] - goal[2]) / (2.0 * pi))
    return goal


def _window(
    problem: Problem, window: Window, start: Array, target: Array, last: Array, kept: Kept
) -> Generator[None, None, Drivable]:
    """One window from `start` (3,) to its `target` (3,), with the last piece after it, if any."""
    if not window.alone:
        smooth = yield from _smooth(problem, window, start, target, last, kept)
        if smooth is not None:
            return smooth
    way = np.vstack([window.way, last])
    room = yield from _room(problem, start, window.way, last)
    return Drivable(way=way, stops=np.arange(len(way)) < len(way) - 1, room=room)


def _smooth(
    problem: Problem, window: Window, start: Array, target: Array, last: Array, kept: Kept
) -> Generator[None, None, Drivable | None]:
    """The same made smooth, or None where it does not become smooth and clear."""
    smoothing, firmer = _smoothing(problem, window, start, target, last, kept.line), 0
    for _ in range(_ITERATIONS):
        smoothing.iterate()
        yield
        if smoothing.error > _NEAR_GOAL or smoothing.moved > _SETTLED:
            continue
        arcs = smoothing.settled()
        if arcs is None:
            continue
        way = np.vstack([arcs, last])
        room = yield from _room(problem, start, arcs, last)
        if room.min() >= kept.clearance:
            return Drivable(way=way, stops=np.zeros(len(way), bool), room=room)
        if firmer == _FIRMER:
            break
        # It gives way where it must not: what is lacking of the margin costs more.
        firmer += 1
        smoothing.firmer(_TIMES)
        yield
    return None


def _smoothing(
    problem: Problem, window: Window, start: Array, target: Array, last: Array, line: Array | None
) -> Smoothing:
    config, settings, clearance = problem.config, problem.config.route, problem.config.clearance
    radius, way = 1.0 / config.max_curvature, window.way
    terms = SmoothingTerms(
        curvature=CURVATURE_SHARE * config.max_curvature,
        slope=settings.steering_slope,
        wheelbase=config.vehicle.wheelbase,
        margin=max(clearance.on_routes, clearance.least + settings.reserve, CHECK),
        spacing=_KNOTS * radius,
        piece=_KNOTS * radius / 4.0,
        look=_KNOTS * radius / 2.0,
    )
    before, after = window.joints
    goes_on = len(last) > 0 and float(last[0, 0]) * float(way[-1, 0]) > 0.0
    return Smoothing(
        start=start, goal=target, body=problem.body, grid=problem.grid, terms=terms, way=way,
        begin=float(way[0, 1]) if before else None,
        end=float(way[-1, 1]) if after else 0.0 if goes_on else None,
        line=line,
    )  # fmt: skip


def _room(problem: Problem, start: Array, way: Array, last: Array) -> Generator[None, None, Array]:
    """Least clearance (n,) of the body along pieces of a way from `start` (3,) and of the last straight one
    (1, 2), or none (0, 2), at every centimetre [m]."""
    room = yield from _room_along(problem, start, way, last=False)
    if len(last) == 0:
        return room
    begin = poses_after(start, way)[-1]
    room_of_last = yield from _room_along(problem, begin, last, last=True)
    return np.concatenate((room, room_of_last))


def _room_along(problem: Problem, start: Array, way: Array, *, last: bool) -> Generator[None, None, Array]:
    counts, fine = split_counts(way, CHECK), split(way, CHECK)
    at, found = start[None], [problem.clearances(start[None], problem.within, last=last)]
    for first in range(0, len(fine), _POSES):
        poses = poses_after(at[-1], fine[first : first + _POSES])
        found.append(problem.clearances(poses, problem.within, last=last))
        at = poses[-1:]
        yield
    each = np.concatenate(found)
    # A piece begins where the last one ends.
    begins = np.concatenate(([0], np.cumsum(counts)[:-1]))
    room: Array = np.minimum(np.minimum.reduceat(each[1:], begins), each[begins])
    return room
