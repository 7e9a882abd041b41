"""Curvature profiles, the smoothing of routes, and the windows of long ones."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from geometry import Area, Pose2
from rti_mpcc import ControllerConfig
from rti_mpcc.route_planner.arcs import find_cusps, length_of, merge_arcs, poses_after, split_arcs, windows_of
from rti_mpcc.route_planner.curvature_profile import CurvatureProfile, slopes_of, traced
from rti_mpcc.route_planner.problem import RouteProblem
from rti_mpcc.route_planner.smoothing import CURVATURE_SHARE, Smoothing
from rti_mpcc.types import Array

CONFIG = ControllerConfig()
START = np.array([1.0, -2.0, 0.3])
ROUTE = np.array([(3.0, 0.2), (2.0, 0.0), (-1.5, -0.15), (-0.5, 0.1), (2.5, 0.05)])
LONGEST = 10.0


def test_segments_end_at_cusps_and_keep_their_turns() -> None:
    profile = CurvatureProfile.of(ROUTE, 0.8, 0.2)
    assert find_cusps(ROUTE).tolist() == [False, True, False, True]
    assert profile.direction.tolist() == [1.0, -1.0, 1.0]
    assert profile.length.tolist() == [5.0, 2.0, 2.5]
    at = traced(profile, START)
    arcs = profile.route(at)
    assert length_of(arcs) == pytest.approx(9.5)
    assert np.abs(arcs[:, 0]).max() <= 0.2 + 1e-9
    assert at.poses == pytest.approx(poses_after(START, arcs))


@pytest.mark.parametrize(("arc", "most"), [(0.2, 3e-4), (0.02, 3e-6)])
def test_slopes_of_poses_are_their_central_differences(arc: float, most: float) -> None:
    profile, step = CurvatureProfile.of(ROUTE, 0.8, arc), 1e-6
    at = traced(profile, START)
    rows = np.array([0, 7, profile.arcs[1] - 1, profile.arcs[1], len(at.poses) - 1])
    slopes = slopes_of(profile, at, rows)
    for variable in range(profile.variables):
        change = np.zeros(profile.variables)
        change[variable] = step
        ahead, behind = (traced(profile.changed(sign * change), START).poses[rows] for sign in (1.0, -1.0))
        assert slopes[:, :, variable] == pytest.approx((ahead - behind) / (2.0 * step), abs=most)


@pytest.mark.parametrize("ends", [(None, None), (0.0, 0.0), (0.05, None), (None, -0.1)])
def test_smoothing_keeps_its_ends_and_limits(ends: tuple[float | None, float | None]) -> None:
    arcs = np.array([(4.0, 0.0), (3.0, 0.2), (5.0, 0.0), (4.0, -0.2), (3.0, 0.0)])
    area = Area(obstacles=[[(50.0, 0.0), (51.0, 0.0), (51.0, 1.0)]])
    problem = RouteProblem.of(Pose2(*START), Pose2(*poses_after(START, arcs)[-1]), area, CONFIG)
    smoothing = Smoothing(problem, arcs, problem.start, problem.goal, ends)
    for _ in range(30):
        smoothing.iterate()
    smooth = smoothing.settled()
    assert smooth is not None
    assert poses_after(problem.start, smooth)[-1] == pytest.approx(problem.goal, abs=1e-8)
    assert np.abs(smooth[:, 1]).max() <= 1.03 * CURVATURE_SHARE * CONFIG.max_curvature
    slope, wheelbase = CONFIG.route.steering_slope, CONFIG.vehicle.wheelbase
    assert np.abs(np.diff(np.arctan(wheelbase * smooth[:, 1])) / smooth[1:, 0]).max() <= 1.1 * slope
    # The middle of the first arc, and of the last one, is half an arc away from the end.
    allowed = 0.5 * smooth[0, 0] * 1.2 * slope / wheelbase
    for bend, arc in zip(ends, smooth[[0, -1]], strict=True):
        assert bend is None or abs(arc[1] - bend) <= allowed


def test_a_route_that_is_split_and_merged_is_the_same() -> None:
    fine = split_arcs(ROUTE, 0.01)
    assert np.abs(fine[:, 0]).max() <= 0.01 + 1e-12
    assert merge_arcs(fine) == pytest.approx(ROUTE)
    assert poses_after(START, fine)[-1] == pytest.approx(poses_after(START, ROUTE)[-1])
    assert merge_arcs(np.array([(1e-12, 0.1), (1.0, 0.0)])).tolist() == [[1.0, 0.0]]


def test_an_excess_of_curvature_is_moved_to_both_sides() -> None:
    given = CurvatureProfile.of(np.array([(5.0, 0.0), (0.5, 2.0), (5.0, 0.0)]), 0.5, 0.1)
    bounded = given.bounded(0.2)
    assert np.abs(given.knots).max() > 0.5
    assert np.abs(bounded.knots).max() <= 0.2 + 1e-12
    turned = [traced(each, np.zeros(3)).poses[-1, 2] for each in (given, bounded)]
    assert turned[1] == pytest.approx(turned[0], rel=1e-6)
    assert given.bounded(3.0).knots == pytest.approx(given.knots)
    assert np.abs(given.bounded(0.01).knots).max() <= 0.01  # there is no room to turn by as much


def random_route(seed: int, count: int, longest: float) -> Array:
    """Arcs (count, 2), up to `longest` [m], none like the one before it."""
    rng = np.random.default_rng(seed)
    lengths = rng.uniform(0.1, longest, count) * rng.choice((-1.0, 1.0, 1.0), count)
    return np.column_stack([lengths, rng.uniform(-0.2, 0.2, count)])


@pytest.mark.parametrize(
    ("seed", "count", "longest"), [(1, 40, 1.0), (2, 30, 8.0), (3, 12, 60.0), (4, 1, 99.0), (5, 6, 1.0)]
)
def test_windows_make_up_the_route_and_are_short(seed: int, count: int, longest: float) -> None:
    route = random_route(seed, count, longest)
    windows = windows_of(route, LONGEST)
    assert merge_arcs(np.concatenate(windows)) == pytest.approx(route)
    assert all(length_of(each) <= LONGEST + 1e-9 or len(each) == 1 for each in windows)
    for one, two in pairwise(windows):
        assert one[-1, 1] == two[0, 1]
        assert one[-1, 0] * two[0, 0] > 0.0


def test_the_middle_of_a_long_arc_is_a_window_of_its_own() -> None:
    first, middle, last = windows_of(np.array([(2.0, 0.1), (100.0, 0.0), (-3.0, -0.1)]), LONGEST)
    assert middle.tolist() == [[95.0, 0.0]]
    assert first.tolist() == [[2.0, 0.1], [2.5, 0.0]]
    assert last.tolist() == [[2.5, 0.0], [-3.0, -0.1]]
