"""A route made drivable: smooth, where that can be and is clear, and else with stops to turn the wheels.

Each window of the route is made smooth on its own and checked at every centimetre. One that does not become
smooth, or comes too near to something, stays as it was found: there the wheels are turned at rest wherever
the curvature steps.
"""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass
from math import pi

import numpy as np

from geometry.arrays import Array, Mask
from rti_mpcc.route_planner.arcs import find_cusps, poses_after, split_arcs, split_counts, windows_of
from rti_mpcc.route_planner.problem import CHECK, RouteProblem
from rti_mpcc.route_planner.smoothing import Smoothing

_WINDOW = 25.0  # longest window of a route, in radii of the sharpest bend
_ITERATIONS = 40  # of a smoothing, at most
_POSES = 512  # that are checked at a time
_NEAR_GOAL = 1e-2  # error at the end [m], [rad] of a window that is as good as smooth, ...
_SETTLED = 0.03  # ... and change of its curvatures in the last iteration, as a share
_RAISES = 3  # times that the weight of the margin is raised where a smooth route is not clear, ...
_TIMES = 10.0  # ... each time by this factor


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DrivableRoute:
    """A route, and the stops on it.

    Attributes:
        arcs: (n, 2) signed lengths [m] and curvatures [1/m].
        stops: (n,) whether the wheels are turned at rest after each.
        clearances: (n,) least clearance of the body along each [m].
    """

    arcs: Array
    stops: Mask
    clearances: Array

    @property
    def clearance(self) -> float:
        """Least clearance of the body along the route [m]."""
        return float(self.clearances.min())

    @property
    def segments(self) -> list[tuple[Array, float]]:
        """Arcs (n_i, 2) between two stops, of which a cusp is one, and the least clearance along them [m]."""
        ends = np.flatnonzero(find_cusps(self.arcs) | self.stops[:-1]) + 1
        each = zip(np.split(self.arcs, ends), np.split(self.clearances, ends), strict=True)
        return [(arcs, float(clearances.min())) for arcs, clearances in each]

    @classmethod
    def chain(cls, routes: list[DrivableRoute]) -> DrivableRoute:
        """Routes that follow one another, as one."""
        return cls(
            arcs=np.vstack([each.arcs for each in routes]),
            stops=np.concatenate([each.stops for each in routes]),
            clearances=np.concatenate([each.clearances for each in routes]),
        )


def make_drivable(
    problem: RouteProblem, route: Array, last: Array, least: float
) -> Generator[None, None, DrivableRoute]:
    """The route to be driven, slice by slice; it ends where its clearance is less than the hard minimum.

    Args:
        route: (n, 2) as it was found; last: straight arc (1, 2) that it ends with, or none (0, 2).
        least: clearance that it keeps where it is made smooth [m]: that of the search, for control needs it.
    """
    if len(route) == 0:  # the vehicle stands where the last arc starts
        clearances = yield from _clearances_along(problem, problem.start, last, last=True)
        return DrivableRoute(arcs=last, stops=np.zeros(len(last), np.bool_), clearances=clearances)
    at = reached = problem.start
    found: list[DrivableRoute] = []
    windows = windows_of(route, _WINDOW / problem.config.max_curvature)
    for k, arcs in enumerate(windows):
        joints = k > 0, k < len(windows) - 1
        target = reached = poses_after(reached, arcs)[-1]
        after = last[:0]
        if not joints[1]:
            # The place as it was given, less the last arc; the heading on the branch on which the route ends.
            target, after = problem.before_goal(float(last[:, 0].sum())), last
            target[2] += 2.0 * pi * round((reached[2] - target[2]) / (2.0 * pi))
        made = None
        if len(arcs) > 1 or not all(joints):  # the middle of a long arc is smooth as it is
            smoothing = Smoothing(problem, arcs, at, target, _end_curvatures(arcs, joints, after))
            yield
            made = yield from _smooth(problem, smoothing, at, after, least)
        if made is None:
            stops = np.arange(len(arcs) + len(after)) < len(arcs) + len(after) - 1
            made = yield from _checked(problem, at, arcs, after, stops)
        found.append(made)
        if made.clearance < problem.least:
            break
        at = poses_after(at, made.arcs)[-1]
    return DrivableRoute.chain(found)


def _end_curvatures(arcs: Array, joints: tuple[bool, bool], last: Array) -> tuple[float | None, float | None]:
    """Curvatures [1/m] that a window keeps at its ends: where another one joins, and before the last arc."""
    straight = 0.0 if len(last) > 0 and float(last[0, 0]) * float(arcs[-1, 0]) > 0.0 else None
    return float(arcs[0, 1]) if joints[0] else None, float(arcs[-1, 1]) if joints[1] else straight


def _smooth(
    problem: RouteProblem, smoothing: Smoothing, start: Array, last: Array, least: float
) -> Generator[None, None, DrivableRoute | None]:
    """A window made smooth from `start` (3,), with the last arc after it, if any; None where it does not
    become smooth and clear."""
    raises = 0
    for _ in range(_ITERATIONS):
        smoothing.iterate()
        yield
        if smoothing.error > _NEAR_GOAL or smoothing.moved > _SETTLED:
            continue
        smooth = smoothing.settled()
        if smooth is None:
            continue
        made = yield from _checked(problem, start, smooth, last, np.zeros(len(smooth) + len(last), np.bool_))
        if made.clearance >= least:
            return made
        if raises == _RAISES:
            break
        raises += 1
        smoothing.raise_margin_weight(_TIMES)
        yield
    return None


def _checked(
    problem: RouteProblem, start: Array, arcs: Array, last: Array, stops: Mask
) -> Generator[None, None, DrivableRoute]:
    """Arcs from `start` (3,) and the last straight one (1, 2), or none (0, 2), with their clearances."""
    clearances = yield from _clearances_along(problem, start, arcs, last=False)
    if len(last) > 0:
        end = poses_after(start, arcs)[-1]
        on_last = yield from _clearances_along(problem, end, last, last=True)
        clearances = np.concatenate((clearances, on_last))
    return DrivableRoute(arcs=np.vstack([arcs, last]), stops=stops, clearances=clearances)


def _clearances_along(
    problem: RouteProblem, start: Array, arcs: Array, *, last: bool
) -> Generator[None, None, Array]:
    """Least clearance (n,) of the body along each arc, at every centimetre [m]."""
    counts, fine = split_counts(arcs, CHECK), split_arcs(arcs, CHECK)
    at, found = start[None], [problem.clearances(start[None], last=last)]
    for first in range(0, len(fine), _POSES):
        poses = poses_after(at[-1], fine[first : first + _POSES])
        found.append(problem.clearances(poses, last=last))
        at = poses[-1:]
        yield
    each = np.concatenate(found)
    # An arc starts where the one before it ends.
    starts = np.concatenate(([0], np.cumsum(counts)[:-1]))
    clearances: Array = np.minimum(np.minimum.reduceat(each[1:], starts), each[starts])
    return clearances
