from __future__ import annotations

from math import cos, sin

import numpy as np
import pytest

from geometry import Pose2, ReferencePath


def test_segments_are_exact_arcs() -> None:
    path = ReferencePath.from_segments(Pose2(1.0, 2.0, 0.3), [(1, 0.25, 6.0)])
    theta = np.linspace(0.0, 6.0, 13)
    at = path.parts[0].reference(theta)
    np.testing.assert_allclose(at.phi, 0.3 + 0.25 * theta)
    np.testing.assert_allclose(at.x, 1.0 + 4.0 * (np.sin(at.phi) - sin(0.3)))
    np.testing.assert_allclose(at.y, 2.0 - 4.0 * (np.cos(at.phi) - cos(0.3)))
    np.testing.assert_allclose(at.slope, 0.25)


def test_slope_is_the_derivative_of_the_heading(reversing: ReferencePath) -> None:
    part = reversing.parts[0]
    theta = np.linspace(0.01, 29.97, 300)
    step = 1e-6
    derivative = (part.reference(theta + step).phi - part.reference(theta - step).phi) / (2.0 * step)
    np.testing.assert_allclose(part.reference(theta).slope, derivative, atol=1e-6)
    np.testing.assert_allclose(part.curvature(theta), part.direction * derivative, atol=1e-6)


def test_behind_both_ends_it_goes_straight_on(reversing: ReferencePath) -> None:
    part = reversing.parts[0]
    at = part.reference([-3.0, 34.0])
    first, last = part.first, part.last
    assert (at.x[0], at.y[0]) == pytest.approx(
        (first.x + 3.0 * cos(first.phi), first.y + 3.0 * sin(first.phi))
    )
    assert (at.x[1], at.y[1]) == pytest.approx((last.x - 4.0 * cos(last.phi), last.y - 4.0 * sin(last.phi)))
    np.testing.assert_allclose(at.phi, [first.phi, last.phi])
    np.testing.assert_array_equal(at.slope, 0.0)
    np.testing.assert_array_equal(part.curvature([-1e-9, 30.1]), 0.0)


def test_the_end_belongs_to_the_last_piece_and_a_knot_to_the_next(reversing: ReferencePath) -> None:
    np.testing.assert_allclose(
        reversing.parts[0].curvature([0.0, 10.0, 20.0, 25.0, 30.0]), [-0.2, 0.2, 0, 0.2, 0.2]
    )


def test_pose_agrees_with_reference_and_arrays_cannot_be_written(reversing: ReferencePath) -> None:
    part = reversing.parts[0]
    at, pose = part.reference([17.3]), part.pose(17.3)
    assert (pose.x, pose.y, pose.phi) == (at.x[0], at.y[0], at.phi[0])
    with pytest.raises(ValueError, match="read-only"):
        part.knots[0] = 1.0
