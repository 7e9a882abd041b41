"""Stretches of a way: where they lead, how that changes, and what smoothing makes of them."""

from __future__ import annotations

import numpy as np
import pytest

from geometry import Area
from geometry.shape_grid import Body
from rti_mpcc.route_planner.arcs import joined, length_of, poses_after, split, turns_of
from rti_mpcc.route_planner.smoothing import Smoothing
from rti_mpcc.route_planner.smoothing_terms import SmoothingTerms
from rti_mpcc.route_planner.stretches import Stretches
from rti_mpcc.types import Array

START = np.array([1.0, -2.0, 0.3])
WAY = np.array([(3.0, 0.2), (2.0, 0.0), (-1.5, -0.15), (-0.5, 0.1), (2.5, 0.05)])
TERMS = SmoothingTerms(curvature=0.25, slope=0.6, wheelbase=2.8, margin=0.2, spacing=0.8, piece=0.2, look=0.4)
BODY = Body.of([(-0.8, -0.9), (3.6, -0.9), (3.6, 0.9), (-0.8, 0.9)])


def test_stretches_end_where_the_direction_changes_and_keep_their_turns() -> None:
    stretches = Stretches.of(WAY, 0.8, 0.2)
    assert turns_of(WAY).tolist() == [False, True, False, True]
    assert stretches.direction.tolist() == [1.0, -1.0, 1.0]
    assert stretches.length.tolist() == [5.0, 2.0, 2.5]
    assert length_of(stretches.way()) == pytest.approx(9.5)
    assert np.abs(stretches.way()[:, 0]).max() <= 0.2 + 1e-9
    assert stretches.traced(START).poses == pytest.approx(poses_after(START, stretches.way()))


@pytest.mark.parametrize(("arc", "most"), [(0.2, 3e-4), (0.02, 3e-6)])
def test_poses_change_with_curvatures_and_lengths_as_differences_say(arc: float, most: float) -> None:
    stretches, step = Stretches.of(WAY, 0.8, arc), 1e-6
    at = stretches.traced(START)
    rows = np.array([0, 7, stretches.pieces[1] - 1, stretches.pieces[1], len(at.poses) - 1])
    slopes = stretches.slopes(at, rows)
    for variable in range(stretches.variables):
        change = np.zeros(stretches.variables)
        change[variable] = step
        ahead, behind = (stretches.changed(sign * change).traced(START).poses[rows] for sign in (1.0, -1.0))
        assert slopes[:, :, variable] == pytest.approx((ahead - behind) / (2.0 * step), abs=most)


def smoothed(begin: float | None, end: float | None) -> tuple[Array, Array]:
    """The arcs that smoothing of a part of the way comes to, and where that has to end."""
    way = np.array([(4.0, 0.0), (3.0, 0.2), (5.0, 0.0), (4.0, -0.2), (3.0, 0.0)])
    goal = poses_after(START, way)[-1]
    grid = Area(obstacles=[[(50.0, 0.0), (51.0, 0.0), (51.0, 1.0)]]).grid
    smoothing = Smoothing(
        start=START, goal=goal, body=BODY, grid=grid, terms=TERMS, way=way, begin=begin, end=end
    )
    for _ in range(30):
        smoothing.iterate()
    arcs = smoothing.settled()
    assert arcs is not None
    return arcs, goal


@pytest.mark.parametrize(("begin", "end"), [(None, None), (0.0, 0.0), (0.05, None), (None, -0.1)])
def test_smoothing_keeps_its_ends(begin: float | None, end: float | None) -> None:
    arcs, goal = smoothed(begin, end)
    assert poses_after(START, arcs)[-1] == pytest.approx(goal, abs=1e-8)
    assert np.abs(arcs[:, 1]).max() <= 1.03 * TERMS.curvature
    steering = np.arctan(TERMS.wheelbase * arcs[:, 1])
    assert np.abs(np.diff(steering) / arcs[1:, 0]).max() <= 1.1 * TERMS.slope
    # The middle of the first arc, and of the last one, is a half of it away from the end.
    allowed = 0.5 * arcs[0, 0] * 1.2 * TERMS.slope / TERMS.wheelbase
    for bend, arc in ((begin, arcs[0]), (end, arcs[-1])):
        assert bend is None or abs(arc[1] - bend) <= allowed


def test_a_way_that_is_split_and_joined_is_the_same() -> None:
    fine = split(WAY, 0.01)
    assert np.abs(fine[:, 0]).max() <= 0.01 + 1e-12
    assert joined(fine) == pytest.approx(WAY)
    assert poses_after(START, fine)[-1] == pytest.approx(poses_after(START, WAY)[-1])
    assert joined(np.array([(1e-12, 0.1), (1.0, 0.0)])).tolist() == [[1.0, 0.0]]


def test_what_is_bent_too_much_turns_by_as_much_over_more_way() -> None:
    way = np.array([(5.0, 0.0), (0.5, 2.0), (5.0, 0.0)])
    given = Stretches.of(way, 0.5, 0.1)
    bounded = given.bounded(0.2)
    assert np.abs(given.knots).max() > 0.5
    assert np.abs(bounded.knots).max() <= 0.2 + 1e-12
    turned = [each.traced(np.zeros(3)).poses[-1, 2] for each in (given, bounded)]
    assert turned[1] == pytest.approx(turned[0], rel=1e-6)
    assert given.bounded(3.0).knots == pytest.approx(given.knots)
    # There is no room to turn by that much.
    assert np.abs(given.bounded(0.01).knots).max() <= 0.01
