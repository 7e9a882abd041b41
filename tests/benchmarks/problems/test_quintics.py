"""Quintics: what they have at both ends, and their derivatives against differences."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.problems.passages import driven, quintics
from geometry import wrap
from rti_mpcc.types import Array

BEGINS = np.array([[0.0, 0.0, 3.0, 0.1], [5.0, -2.0, -0.4, -0.2], [1.0, 1.0, 0.0, 0.0]])
SPEEDS = np.array([[1.0, 1.0], [0.8, 1.3], [1.2, 1.1]])


def ends(direction: int) -> Array:
    """So far on, in the direction of travel, and turned by less than a quarter."""
    phi = BEGINS[:, 2]
    turned = np.array([0.4, -0.3, 0.0])
    far, aside = direction * np.array([8.0, 6.0, 10.0]), np.array([2.0, -1.0, 0.0])
    x = BEGINS[:, 0] + far * np.cos(phi) - aside * np.sin(phi)
    y = BEGINS[:, 1] + far * np.sin(phi) + aside * np.cos(phi)
    return np.column_stack([x, y, phi + turned, [-0.05, 0.1, 0.0]])


@pytest.mark.parametrize("direction", [1, -1])
def test_both_ends_are_met_with_heading_and_curvature(direction: int) -> None:
    wanted = ends(direction)
    curves = quintics(direction, BEGINS, wanted, SPEEDS)
    motion, _ = driven(direction, curves, np.linspace(0.0, 1.0, 101), BEGINS[:, 2])
    for at, rows in ((0, BEGINS), (-1, wanted)):
        difference = motion[:, at] - rows
        difference[:, 2] = wrap(difference[:, 2])
        assert np.abs(difference).max() < 1e-9
    # The heading begins on the branch that is asked for.
    assert np.abs(motion[:, 0, 2] - BEGINS[:, 2]).max() < 1e-9


@pytest.mark.parametrize("direction", [1, -1])
def test_curvature_and_its_slope_are_those_of_the_poses(direction: int) -> None:
    curves = quintics(direction, BEGINS, ends(direction), SPEEDS)
    motion, slope = driven(direction, curves, np.linspace(0.0, 1.0, 2001), BEGINS[:, 2])
    step = np.diff(motion[..., :2], axis=1)
    way = np.hypot(step[..., 0], step[..., 1])
    middle = 0.5 * (motion[:, 1:] + motion[:, :-1])
    turned = direction * np.diff(motion[..., 2], axis=1) / way
    assert np.abs(turned - middle[..., 3]).max() < 1e-5
    difference = np.diff(motion[..., 3], axis=1) / way
    assert np.abs(difference - 0.5 * (slope[:, 1:] + slope[:, :-1])).max() < 1e-4
    # It drives where its heading points, or straight away from there in reverse.
    along = step[..., 0] * np.cos(middle[..., 2]) + step[..., 1] * np.sin(middle[..., 2])
    assert along * direction == pytest.approx(way, rel=1e-5)
