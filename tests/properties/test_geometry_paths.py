"""Paths near what their formulas divide by: lengths and curvatures of 0, headings across a chord."""

from __future__ import annotations

from math import cos, hypot, inf, nextafter, pi, sin

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from geometry import Pose2, ReferencePath, lift, reeds_shepp, wrap
from geometry.reeds_shepp import PIECES, WORDS
from tests.kernels import called

words = called(reeds_shepp.words)
FEW = settings(derandomize=True, deadline=None, max_examples=60)

Segment = tuple[int, float, float]

LENGTHS = st.one_of(st.sampled_from([1e-17, 1e-12, 1e-9, 1e-6, 0.01]), st.floats(0.01, 20.0))
"""Of a piece [m]: differences of lengths leave pieces that are nothing but rounding."""
CURVATURES = st.one_of(
    st.sampled_from([0.0, 1e-310, -1e-308, 1e-17, -1e-12, 1e-9]), st.floats(-0.5, 0.5), st.floats(-20.0, 20.0)
)
SEGMENTS = st.lists(st.tuples(st.sampled_from([1, -1]), CURVATURES, LENGTHS), min_size=1, max_size=5)
SMALL = st.one_of(
    st.sampled_from([0.0, 1e-300, -1e-17, 1e-12, -1e-9, 1e-6]), st.floats(-1e-3, 1e-3), st.floats(-5.0, 5.0)
)


# -- angles --------------------------------------------------------------------------------------------------


@FEW
@given(angle=st.floats(-1e6, 1e6))
@example(angle=0.0)
@example(angle=pi)
@example(angle=-pi)
@example(angle=nextafter(pi, inf))
@example(angle=nextafter(-pi, -inf))
@example(angle=5.0 * pi)
def test_a_wrapped_angle_is_the_same_angle_within_half_a_turn(angle: float) -> None:
    wrapped = wrap(angle)
    assert abs(wrapped) <= pi + 1e-9
    assert (cos(wrapped), sin(wrapped)) == pytest.approx((cos(angle), sin(angle)), abs=1e-9)
    assert wrap(np.array([angle]))[0] == pytest.approx(wrapped, abs=1e-12)


@FEW
@given(angle=st.floats(-1e4, 1e4), near=st.floats(-1e4, 1e4))
@example(angle=0.0, near=0.0)
@example(angle=pi, near=0.0)
@example(angle=0.0, near=pi)
def test_a_lifted_angle_is_within_half_a_turn_of_its_neighbour(angle: float, near: float) -> None:
    lifted = lift(angle, near)
    assert abs(lifted - near) <= pi + 1e-9
    assert wrap(lifted - angle) == pytest.approx(0.0, abs=1e-9)


# -- chains of arcs ------------------------------------------------------------------------------------------


@FEW
@given(segments=SEGMENTS, shares=st.tuples(st.floats(-0.1, 1.1), st.floats(-0.1, 1.1)))
@example(segments=[(1, 0.0, 1e-17)], shares=(0.0, 1.0))
@example(segments=[(1, 0.0, 10.0), (-1, 0.3, 1e-17), (1, 0.0, 5.0)], shares=(0.5, 1.0))
def test_a_chord_is_no_longer_than_its_path_and_the_heading_turns_no_faster_than_it_bends(
    segments: list[Segment], shares: tuple[float, float]
) -> None:
    path = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), segments)
    for part in path.parts:
        first, last = (part.start + share * (part.end - part.start) for share in shares)
        at = part.reference([first, last])
        assert np.isfinite([at.x, at.y, at.phi, at.slope]).all()
        driven = abs(last - first)
        assert hypot(at.x[1] - at.x[0], at.y[1] - at.y[0]) <= driven + 1e-12
        assert abs(at.phi[1] - at.phi[0]) <= driven * path.max_curvature + 1e-12


@FEW
@given(segments=SEGMENTS, x=st.floats(-5.0, 15.0), y=st.floats(-10.0, 10.0))
@example(segments=[(1, 0.0, 10.0)], x=3.0, y=1.0)
@example(segments=[(1, 1e-310, 10.0)], x=3.0, y=1.0)
@example(segments=[(1, 0.5, 10.0)], x=0.0, y=2.0)  # the centre of the arc
@example(segments=[(1, 0.0, 1e-17)], x=0.0, y=0.0)
@example(segments=[(1, 0.0, 10.0), (-1, 0.0, 1e-17), (1, 0.0, 5.0)], x=10.0, y=0.0)
def test_nothing_of_a_part_is_nearer_than_where_a_point_projects_to(
    segments: list[Segment], x: float, y: float
) -> None:
    for part in ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), segments).parts:
        theta = part.project(x, y)
        assert part.start <= theta <= part.end
        found, all_of_it = part.pose(theta), part.reference(np.linspace(part.start, part.end, 301))
        nearest = float(np.hypot(all_of_it.x - x, all_of_it.y - y).min())
        assert hypot(found.x - x, found.y - y) <= nearest + 1e-9


# -- through poses and points --------------------------------------------------------------------------------

RIGHT_ANGLE = 0.5 * pi
BESIDE = st.one_of(
    st.floats(-1.5, 1.5),
    st.sampled_from([0.0, RIGHT_ANGLE - 1e-6, 1e-6 - RIGHT_ANGLE, RIGHT_ANGLE - 1e-8, 1e-8 - RIGHT_ANGLE]),
)
"""A heading beside the chord [rad]."""


@FEW
@given(
    distance=st.floats(-5.0, 3.0).map(lambda n: 10.0**n), first=BESIDE, last=BESIDE, turn=st.floats(-pi, pi)
)
@example(distance=1.0, first=0.0, last=0.0, turn=0.0)
@example(distance=1.0, first=RIGHT_ANGLE - 1e-8, last=RIGHT_ANGLE - 1e-8, turn=0.3)
@example(distance=1.0, first=RIGHT_ANGLE - 2e-9, last=RIGHT_ANGLE - 2e-9, turn=1.1)
@example(distance=1.0, first=1e-8 - RIGHT_ANGLE, last=1e-8 - RIGHT_ANGLE, turn=0.138671875)
@example(distance=1e-6, first=1e-8 - RIGHT_ANGLE, last=RIGHT_ANGLE - 1e-8, turn=-2.0)
def test_two_arcs_lead_from_pose_to_pose_and_are_no_longer_than_a_half_circle(
    distance: float, first: float, last: float, turn: float
) -> None:
    start = Pose2(0.0, 0.0, turn + first)
    goal = Pose2(distance * cos(turn), distance * sin(turn), turn + last)
    path = ReferencePath.from_poses([start, goal], 1)
    assert hypot(path.end.x - goal.x, path.end.y - goal.y) <= 1e-7 * distance + 1e-12
    assert path.end.phi == pytest.approx(goal.phi, abs=1e-6)
    assert distance * (1.0 - 1e-9) <= path.length <= 0.5 * pi * distance * (1.0 + 1e-6)
    assert path.max_curvature <= 1e3 / distance


# -- Reeds and Shepp -----------------------------------------------------------------------------------------


def cheapest(
    x: float, y: float, phi: float, radius: float
) -> tuple[float, tuple[float, float, float], np.ndarray[tuple[int], np.dtype[np.float64]]]:
    """The length of the shortest way [m], where it leads, and its pieces."""
    lengths, turns = np.zeros((WORDS, PIECES)), np.zeros((WORDS, PIECES))
    count = words(x / radius, y / radius, phi, lengths, turns)
    costs = radius * np.abs(lengths[:count]).sum(axis=1)
    best = int(np.argmin(costs))
    pieces = zip(radius * lengths[best], turns[best] / radius, strict=True)
    driven = [(1 if length > 0.0 else -1, bend, abs(length)) for length, bend in pieces if length != 0.0]
    end = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), driven).end if driven else Pose2(0.0, 0.0, 0.0)
    return float(costs[best]), (end.x, end.y, end.phi), radius * lengths[best]


@FEW
@given(x=SMALL, y=SMALL, phi=SMALL, radius=st.floats(-2.0, 2.0).map(lambda n: 10.0**n))
@example(x=0.0, y=0.0, phi=0.0, radius=1.0)
@example(x=0.0, y=0.0, phi=pi, radius=1.0)
@example(x=4.0, y=0.0, phi=0.0, radius=1.0)
@example(x=0.0, y=2.0, phi=pi, radius=1.0)
@example(x=0.0, y=1e-12, phi=0.0, radius=5.0)
def test_the_shortest_way_leads_to_its_goal_and_is_no_shorter_than_the_distance_and_the_turn(
    x: float, y: float, phi: float, radius: float
) -> None:
    cost, (at_x, at_y, at_phi), lengths = cheapest(x, y, phi, radius)
    assert cost == pytest.approx(float(np.abs(lengths).sum()))
    # Pieces of less than 1e-10 radii are none.
    assert hypot(at_x - x, at_y - y) <= 1e-8 * (radius + hypot(x, y))
    assert wrap(at_phi - phi) == pytest.approx(0.0, abs=1e-8)
    assert cost >= hypot(x, y) - 1e-8 * radius
    assert cost >= radius * (abs(wrap(phi)) - 1e-8)
