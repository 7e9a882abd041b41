"""Straight moves: which errors can be mended on them, and what is ordered."""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from math import atan, cos, hypot, pi, sin, tan

import numpy as np
import pytest

from geometry import Area, Pose2
from rti_mpcc.config import ControllerConfig
from rti_mpcc.manoeuvre import SegmentEnd
from rti_mpcc.mission import Straight
from rti_mpcc.mission.straight import is_correctable, straight_order
from rti_mpcc.types import Array
from tests.lists import acceptance
from tests.rti_mpcc.yards import BRISK, START, YARD

WHEELBASE = BRISK.vehicle.wheelbase
MANY = 2001


def driven(error: Pose2, way: float, wheels: Array) -> Array:
    """Lateral error and heading (n, 2) at the end of moves with wheel angles (n, k), each for a k-th of it.

    A bicycle at unit speed, integrated in small steps: its heading turns by v tan(delta) / L, in reverse too.
    """
    count = wheels.shape[1]
    along = np.sign(way) * abs(way) / count
    phi = error.phi + along * np.cumsum(np.tan(wheels) / WHEELBASE, axis=1)
    before = np.column_stack([np.full(len(wheels), error.phi), phi[:, :-1]])
    return np.column_stack([error.y + along * np.sin(0.5 * (before + phi)).sum(axis=1), phi[:, -1]])


def bang_bang(error: Pose2, way: float, curvature: float) -> tuple[Array, Array]:
    """The same (n, 2), by increasing heading, with the wheels at one bound and then at the other: to the left
    first, and to the right first."""
    count, delta = 400, atan(curvature * WHEELBASE)
    first = np.arange(count) < np.arange(count + 1)[:, None]
    both = [driven(error, way, np.where(first, sign * delta, -sign * delta)) for sign in (1.0, -1.0)]
    left, right = (ends[np.argsort(ends[:, 1])] for ends in both)
    return left, right


@pytest.mark.parametrize("way", [1.2, -1.2, 0.5, -2.5])
def test_bang_bang_reaches_the_bound_of_m1_and_nothing_passes_it(way: float) -> None:
    curvature, error, rng = tan(0.05) / WHEELBASE, Pose2(0.0, 0.013, -0.004), np.random.default_rng(1)
    most = 0.25 * curvature * way**2

    def share(ends: Array) -> Array:
        """Of the lateral bound, at the heading of each end."""
        y, phi = ends.T
        swing = most - 0.25 * (phi - error.phi) ** 2 / curvature
        off = np.abs(y - (error.y + 0.5 * way * (error.phi + phi)))
        return np.asarray((off - swing) / most)

    for ends in bang_bang(error, way, curvature):
        assert np.abs(share(ends)).max() < 0.01
    delta = atan(curvature * WHEELBASE)
    for pieces in (2, 5, 20):
        wheels = np.repeat(rng.uniform(-delta, delta, (2000, pieces)), 400 // pieces, axis=1)
        assert share(driven(error, way, wheels)).max() < 0.01


@pytest.mark.parametrize("way", [-1.2, *map(acceptance, (1.2, 3.0))])
def test_an_error_can_be_mended_where_a_bicycle_can_drive_into_the_tolerance(way: float) -> None:
    """Against a brute force: between the two ways with the sharpest turns all ends can be reached."""
    curvature, (lateral, heading) = tan(0.05) / WHEELBASE, (0.004, 0.004)
    found, reached = [], []
    for y, phi in product(np.linspace(-0.05, 0.05, 15), np.linspace(-0.04, 0.04, 15)):
        error = Pose2(0.0, float(y), float(phi))
        left, right = bang_bang(error, way, curvature)
        headings = np.linspace(max(-heading, left[0, 1]), min(heading, left[-1, 1]), MANY)
        sides = [np.interp(headings, ends[:, 1], ends[:, 0]) for ends in (left, right)]
        some = (np.minimum(*sides) <= lateral) & (np.maximum(*sides) >= -lateral)
        reached.append(headings[0] <= headings[-1] and bool(some.any()))
        found.append(is_correctable(error, way, curvature, (lateral, heading)))
    assert np.sum(np.array(found) != np.array(reached)) <= 2  # at the very edge
    assert 5 < sum(found) < 200


def test_a_heading_error_beyond_what_can_be_turned_is_not_mended() -> None:
    assert not is_correctable(Pose2(0.0, 0.0, 0.2), 1.0, 0.01, (10.0, 0.1))
    assert is_correctable(Pose2(0.0, 0.0, 0.2), 1.0, 0.11, (10.0, 0.1))


# -- what is ordered -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("direction", [1, -1])
@pytest.mark.parametrize("phi", [0.0, pi, -2.5])
def test_it_is_driven_along_the_axis_of_the_dock_and_ends_so_far_from_it(direction: int, phi: float) -> None:
    axis = Pose2(1.0, -2.0, phi)
    here = axis.compose(Pose2(0.03, -0.01, 0.004))
    step = Straight(1.2 * direction, speed=0.3, steering=0.04, tolerance=(0.02, 0.01))
    order, problem = straight_order(step, axis, here, YARD, BRISK)
    assert problem == ""
    assert order is not None
    (segment,) = order.manoeuvre.segments
    assert order.manoeuvre.goal.relative_to(axis).within((1.2 + 1e-9, 1e-9, 1e-9))
    assert hypot(order.manoeuvre.goal.x - axis.x, order.manoeuvre.goal.y - axis.y) == pytest.approx(1.2)
    assert segment.part.direction == direction
    assert segment.part.end - segment.part.start == pytest.approx(1.2 - 0.03 * direction)
    assert (segment.end, segment.speed, segment.steering, segment.wheels) == (SegmentEnd.GOAL, 0.3, 0.04, 0.0)
    assert segment.tolerance == (0.03, 0.02, 0.01)
    assert order.terms.tolerance == segment.tolerance
    assert order.terms.detected is False
    assert order.manoeuvre.start == here


def test_without_a_dock_it_is_driven_along_the_heading_of_the_vehicle() -> None:
    here = Pose2(1.0, 2.0, 0.7)
    order, _ = straight_order(Straight(-2.0), None, here, None, BRISK)
    assert order is not None
    end = order.manoeuvre.goal
    assert end.relative_to(here).within((2.0 + 1e-9, 1e-9, 1e-9))
    assert (end.x, end.y) == pytest.approx((1.0 - 2.0 * cos(0.7), 2.0 - 2.0 * sin(0.7)))
    assert order.manoeuvre.segments[0].margin is None
    assert order.manoeuvre.segments[0].tolerance == (0.03, *BRISK.goal_tolerance[1:])


@pytest.mark.parametrize(("distance", "x"), [(1.0, 1.0), (1.0, 1.5), (-1.0, -1.2)])
def test_beyond_its_end_and_with_too_large_errors_it_is_not_started(distance: float, x: float) -> None:
    order, problem = straight_order(Straight(distance), START, Pose2(x, 0.0, 0.0), YARD, BRISK)
    assert (order, problem) == (None, f"the vehicle stands at {x:.3f} m of the move, beyond its end")
    here, step = Pose2(0.0, 0.05, 0.02), Straight(1.0, tolerance=(0.01, 0.005))
    order, problem = straight_order(step, START, here, YARD, BRISK)
    said = "the errors are too large to be corrected over 1.00 m: lateral 0.050 m, heading 1.15 deg"
    assert (order, problem) == (None, said)
    order, problem = straight_order(replace(step, tolerance=None), START, here, YARD, BRISK)
    assert (order is None, problem) == (False, "")


def test_the_steering_counts_no_further_than_the_vehicle_steers() -> None:
    config = ControllerConfig(limits=BRISK.limits.model_copy(update={"steering": 0.02}))
    here, step = Pose2(0.0, 0.0, 0.02), Straight(-1.0, steering=0.5, tolerance=(0.001, 0.001))
    assert straight_order(step, START, here, YARD, BRISK)[0] is not None
    assert straight_order(step, START, here, YARD, config)[0] is None


def test_it_may_be_driven_as_near_to_walls_as_it_is_straight_ahead() -> None:
    half = 0.5 * BRISK.vehicle.width
    lane = Area(boundary=[(-8.0, -half - 0.07), (12.0, -half - 0.07), (12.0, 5.0), (-8.0, 5.0)])
    order, _ = straight_order(Straight(2.0), START, START, lane, BRISK)
    assert order is not None
    assert order.manoeuvre.segments[0].margin == pytest.approx(0.07, abs=0.01)
    blocked = lane.with_obstacles([np.array([(5.0, -1.0), (6.0, -1.0), (6.0, 1.0)])])
    order, _ = straight_order(Straight(2.0), START, START, blocked, BRISK)
    assert order is not None
    assert order.manoeuvre.segments[0].margin == 0.0
