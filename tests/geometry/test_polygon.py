from __future__ import annotations

import numpy as np
import pytest

from geometry import Corridor, Pose2, ReferencePath
from geometry.outline import outline_at
from geometry.shape_grid import Body
from tests.geometry.sides import distances, sides_of

STRAIGHT = ReferencePath.from_segments(Pose2(2.0, 0.0, 0.0), [(1, 0.0, 16.0)])
BOX = [(0.0, -3.0), (20.0, -3.0), (20.0, 2.0), (0.0, 2.0)]


def test_a_box_is_split_where_the_tangents_meet_its_caps() -> None:
    corridor = Corridor.from_polygon(STRAIGHT, BOX)
    (left,), (right,) = corridor.lines(0)
    np.testing.assert_allclose(left, [(20.0, 0.0), (20.0, 2.0), (0.0, 2.0), (0.0, 0.0)])
    np.testing.assert_allclose(right, [(0.0, 0.0), (0.0, -3.0), (20.0, -3.0), (20.0, 0.0)])
    planes = sides_of(corridor, 0, np.array([[10.0, 0.5], [19.0, -1.0], [19.0, 1.5]]))
    np.testing.assert_allclose(planes.distance, [[1.5, 3.5], [np.sqrt(2.0), 1.0], [0.5, np.hypot(1.0, 1.5)]])
    np.testing.assert_allclose(corridor.narrowest(), (5.0, 0.0))


def test_narrowest_is_found_beside_corners_of_the_outline() -> None:
    outline = [
        *[(0, -2), (9.13, -2), (9.135, -1.2), (9.14, -2), (20, -2)],
        *[(20, 2), (9.14, 2), (9.135, 1.1), (9.13, 2), (0, 2)],
    ]
    width, theta = Corridor.from_polygon(STRAIGHT, outline).narrowest()
    np.testing.assert_allclose((width, theta), (2.3, 7.135))


def test_outline_is_closed_to_bodies() -> None:
    corridor = Corridor.from_polygon(STRAIGHT, BOX)
    body = Body.of([(-1.0, -1.0), (3.0, -1.0), (3.0, 1.0), (-1.0, 1.0)])
    places = np.array([(2.0, 0.0), (0.5, 0.0), (17.5, 0.0), (8.0, 1.5), (-8.0, 0.0), (30.0, 0.0)])
    apart = distances(corridor, 0, body, np.column_stack([places, np.zeros(6)]))[:, 0]
    np.testing.assert_allclose(apart[:4], [1.0, -0.5, -0.5, -0.5], atol=1e-9)
    np.testing.assert_allclose(
        corridor.walls[0].grid.beyond(places), [0.0, 0.0, 0.0, 0.0, 8.0, 10.0], atol=1e-9
    )


@pytest.mark.parametrize("frame", [Pose2(3.0, -2.0, 0.7), Pose2(-40.0, 12.0, -3.0), Pose2(0.0, 0.0, 9.0)])
def test_placed_corners_are_where_the_frame_composed_with_them_is(frame: Pose2) -> None:
    corners = [(0.0, 0.0), (2.0, 0.5), (-1.0, 3.0)]
    found = [frame.compose(Pose2(x, y, 0.0)) for x, y in corners]
    np.testing.assert_allclose(
        outline_at(corners, frame), [(at.x, at.y) for at in found], rtol=0.0, atol=1e-13
    )
