"""A corridor built anew from the arrays that define it is the same to the last bit."""

from __future__ import annotations

from collections.abc import Callable
from math import pi

import numpy as np
import pytest

from geometry import Corridor, Narrowing, Pose2, ReferencePath
from tests.geometry.sides import sides_of

BOX = [(-4.0, -20.0), (25.0, -20.0), (25.0, 12.0), (-4.0, 12.0)]
OBSTACLES = [
    [(2.0, 3.0), (3.0, 3.5), (2.0, 4.0)],
    [(4.0, -4.0), (4.0, -5.0), (6.0, -5.0), (6.0, -4.0), (4.0, -4.0)],
    [(7.1, 1.0), (8.0, 1.0), (8.0, 2.0), (7.1, 2.0), (7.3, 1.5)],
]
NARROWINGS = [Narrowing(22.0, 23.0, left=1.3), Narrowing(27.5, 28.4, right=-1.0)]

REVERSING = [(-1, -0.2, 10.0), (-1, 0.2, 10.0), (-1, 0.0, 5.0), (-1, 0.2, 5.0)]
ROUTE = ReferencePath.from_segments(Pose2(0.0, 0.0, pi / 2), [(1, 0.05, 8.0), *REVERSING])
ONE_WAY = ReferencePath.from_segments(Pose2(0.1, 0.2, 0.3), [(1, 0.0, 7.0), (1, 0.03, 5.0)])

CORRIDORS: dict[str, Callable[[], Corridor]] = {
    "offsets": lambda: Corridor.from_offsets(ROUTE, left=5.0, right=-5.0),
    "narrowings": lambda: Corridor.from_offsets(ROUTE, left=5.0, right=-5.0, narrowings=NARROWINGS),
    "obstacles": lambda: Corridor.from_offsets(ROUTE, left=4.0, right=-3.0, obstacles=OBSTACLES),
    "other obstacles": lambda: Corridor.from_offsets(ROUTE, left=4.0, right=-3.0).with_obstacles(OBSTACLES),
    "polygon": lambda: Corridor.from_polygon(ONE_WAY, BOX),
    "polygon and obstacles": lambda: Corridor.from_polygon(ONE_WAY, BOX, obstacles=OBSTACLES),
}


@pytest.fixture(params=CORRIDORS)
def corridor(request: pytest.FixtureRequest) -> Corridor:
    return CORRIDORS[request.param]()


def test_boundaries_and_obstacles_are_the_same(corridor: Corridor) -> None:
    lines, again = corridor.to_lines(), Corridor.from_lines(corridor.to_lines()).to_lines()
    for one, other in zip(lines.parts, again.parts, strict=True):
        assert (len(one.left), one.joined, one.narrowest) == (len(other.left), other.joined, other.narrowest)
        assert all(map(np.array_equal, (*one.left, *one.right), (*other.left, *other.right)))
    assert len(lines.obstacles) == len(again.obstacles)
    assert all(map(np.array_equal, lines.obstacles, again.obstacles))


def test_half_planes_and_clearances_are_the_same(corridor: Corridor) -> None:
    again = Corridor.from_lines(corridor.to_lines())
    points = np.random.default_rng(1).uniform((-6.0, -22.0), (27.0, 14.0), (300, 2))
    bodies = points[:, None, :] + np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 0.5]])
    for part in range(len(corridor.walls)):
        before, after = (sides_of(each, part, points) for each in (corridor, again))
        np.testing.assert_array_equal(before.distance, after.distance)
        np.testing.assert_array_equal(before.normal, after.normal)
        np.testing.assert_array_equal(corridor.clearance(part, bodies), again.clearance(part, bodies))
