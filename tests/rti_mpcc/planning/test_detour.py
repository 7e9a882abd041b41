from __future__ import annotations

from math import pi

import numpy as np
import pytest

from geometry import PathPart, Pose2, ReferencePath
from rti_mpcc.config import ControllerConfig
from rti_mpcc.planning.detour import Detour, detours
from rti_mpcc.types import Array
from tests.rti_mpcc.differences import slopes
from tests.rti_mpcc.docking_runs import box

CONFIG = ControllerConfig()
CLEAR, SWING = CONFIG.guesses.detour_clearance, CONFIG.guesses.longest_swing
ROOM = 0.5 * CONFIG.vehicle.width
START = Pose2(3.0, -1.0, 2.0)


def part(direction: int, curvature: float = 0.0) -> PathPart:
    return ReferencePath.from_segments(START, [(direction, curvature, 40.0)]).parts[0]


def standing(part: PathPart, theta: float, right: float, left: float) -> Array:
    """An obstacle 1.5 m long."""
    return box(part, theta, right, left, 1.5)


@pytest.mark.parametrize("offset", [2.0, -3.0])
def test_it_is_all_beside_the_path_there_and_on_it_elsewhere_with_the_slope_of_its_offset(
    offset: float,
) -> None:
    detour = Detour(begin=2.0, first=8.0, last=9.5, end=12.0, offset=offset)
    there, flat = detour.beside(np.linspace(8.0, 9.5, 7))
    np.testing.assert_allclose(there, offset, rtol=1e-12)
    np.testing.assert_allclose(flat, 0.0, atol=1e-12)
    away, level = detour.beside(np.array([-5.0, 0.0, 2.0, 12.0, 30.0]))
    np.testing.assert_allclose(np.concatenate((away, level)), 0.0, atol=1e-12)
    for theta in (3.0, 5.5, 7.9, 9.7, 10.0, 11.5):
        by = slopes(lambda at: detour.beside(at)[0], np.array([theta]))
        np.testing.assert_allclose(by[0], detour.beside(np.array([theta]))[1], atol=1e-7)


@pytest.mark.parametrize("direction", [1, -1])
@pytest.mark.parametrize("curvature", [0.0, 0.1])
def test_the_body_clears_the_obstacle_on_either_side_and_the_shorter_way_comes_first(
    direction: int, curvature: float
) -> None:
    route = part(direction, curvature)
    found = detours(route, 2.0, 30.0, [standing(route, 14.0, -0.3, 1.1)], CONFIG)
    np.testing.assert_allclose(
        [detour.offset for detour in found], [-0.3 - ROOM - CLEAR, 1.1 + ROOM + CLEAR], atol=1e-6
    )
    for detour in found:
        assert detour.first == pytest.approx(13.25, abs=0.01)
        assert detour.last == pytest.approx(14.75, abs=0.01)
        assert detour.begin == pytest.approx(detour.first - SWING)
        assert detour.end == pytest.approx(detour.last + SWING)


@pytest.mark.parametrize("direction", [1, -1])
def test_the_mirrored_obstacle_has_the_mirrored_ways(direction: int) -> None:
    route = part(direction)
    one = detours(route, 2.0, 30.0, [standing(route, 14.0, -0.3, 1.1)], CONFIG)
    other = detours(route, 2.0, 30.0, [standing(route, 14.0, -1.1, 0.3)], CONFIG)
    np.testing.assert_allclose([each.offset for each in one], [-each.offset for each in other], atol=1e-9)


def test_it_begins_where_the_vehicle_is_and_ends_where_it_is_to_stand() -> None:
    route = part(1)
    for detour in detours(route, 9.0, 18.0, [standing(route, 14.0, -0.3, 1.1)], CONFIG):
        assert (detour.begin, detour.end) == (9.0, 18.0)


def test_right_before_the_obstacle_it_still_has_a_finite_slope() -> None:
    route = part(1)
    for detour in detours(route, 13.2, 14.8, [standing(route, 14.0, -0.3, 1.1)], CONFIG):
        assert np.abs(detour.beside(np.linspace(10.0, 20.0, 300))[1]).max() < pi * abs(detour.offset)


@pytest.mark.parametrize(
    ("theta", "right", "left"), [(14.0, 1.1, 2.0), (14.0, -2.0, -1.1), (0.5, -0.5, 0.5), (38.0, -0.5, 0.5)]
)
def test_there_is_none_round_what_is_beside_the_way_or_behind_or_beyond_the_end(
    theta: float, right: float, left: float
) -> None:
    route = part(1)
    assert detours(route, 2.0, 30.0, [standing(route, theta, right, left)], CONFIG) == ()
    assert detours(route, 2.0, 30.0, [], CONFIG) == ()


def test_it_goes_round_the_first_obstacle_that_is_met() -> None:
    route = part(1)
    far, near = standing(route, 24.0, -0.5, 0.5), standing(route, 14.0, -0.5, 0.5)
    (first, _) = detours(route, 2.0, 30.0, [far, near], CONFIG)
    assert first.first == pytest.approx(13.25)
