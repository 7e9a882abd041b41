"""Ends of an undocking: which there are, and which come first."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest
import shapely

from benchmarks.encounters import body_at
from geometry import Area, Pose2
from rti_mpcc.mission.undock import undock_ends
from rti_mpcc.types import Array
from tests.rti_mpcc.yards import BRISK, START, YARD, block

HALF = 0.5 * BRISK.vehicle.width
ENDS = 8
WALLS = [(-20.0, -8.0), (20.0, -8.0), (20.0, 8.0), (-20.0, 8.0)]


def clear(end: Pose2, area: Area) -> float:
    """Room of the body at an end [m], by shapely."""
    body = body_at(end.x, end.y, end.phi, BRISK.vehicle)
    return min((body.distance(shapely.Polygon(each)) for each in area.obstacles), default=np.inf)


@pytest.mark.parametrize("distance", [5.0, -5.0])
@pytest.mark.parametrize("here", [START, Pose2(4.0, -1.0, pi), Pose2(6.0, 0.5, -2.0)], ids=repr)
def test_where_all_is_clear_it_is_straight_on(distance: float, here: Pose2) -> None:
    area = Area(boundary=[(-30.0, -30.0), (40.0, -30.0), (40.0, 30.0), (-30.0, 30.0)])
    ends = undock_ends(here, distance, area, BRISK)
    assert len(ends) == ENDS
    assert ends[0].relative_to(here).within((5.0 + 1e-9, 1e-9, 1e-9))
    assert (ends[0].relative_to(here).x > 0.0) == (distance > 0.0)
    for end in ends:
        assert end.relative_to(here).x * distance > 0.0


@pytest.mark.parametrize("distance", [5.0, -5.0])
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_past_what_fills_one_side_it_bends_to_the_other(distance: float, side: float) -> None:
    x = 7.5 if distance > 0.0 else -6.0
    low, high = sorted((-0.7 * side, 7.0 * side))
    area = Area(boundary=WALLS, obstacles=[*YARD.obstacles, block(x - 0.5, low, x + 0.5, high)])
    ends = undock_ends(START, distance, area, BRISK)
    assert ends
    assert ends[0].y * side < -0.2
    assert all(clear(end, area) >= BRISK.clearance.least - 0.02 for end in ends)


@pytest.mark.parametrize("distance", [5.0, -5.0])
def test_where_all_is_filled_there_is_none(distance: float) -> None:
    walls: list[Array] = [
        block(-9.0, HALF + 0.1, 9.0, 7.0),
        block(-9.0, -7.0, 9.0, -HALF - 0.1),
        block(5.0, -7.0, 9.0, 7.0),
        block(-9.0, -7.0, -3.0, 7.0),
    ]
    area = Area(boundary=WALLS, obstacles=walls)
    assert undock_ends(START, distance, area, BRISK) == ()


@pytest.mark.parametrize("phi", [0.0, 0.3, 1.1, -2.0])
def test_in_a_narrow_lane_it_is_straight_on(phi: float) -> None:
    """With less room than planned ways keep, which does not become less."""
    here, gap = Pose2(3.0, -2.0, phi), 0.5 * BRISK.clearance.on_routes
    lane = []
    for side in (1.0, -1.0):
        corners = [(-9.0, HALF + gap), (9.0, HALF + gap), (9.0, HALF + gap + 3.0), (-9.0, HALF + gap + 3.0)]
        placed = [here.compose(Pose2(x, side * y, 0.0)) for x, y in corners]
        lane.append(np.array([(corner.x, corner.y) for corner in placed]))
    area = Area(boundary=[(-40.0, -40.0), (40.0, -40.0), (40.0, 40.0), (-40.0, 40.0)], obstacles=lane)
    for distance in (4.0, -4.0):
        ends = undock_ends(here, distance, area, BRISK)
        assert ends[0].relative_to(here).within((4.0 + 1e-9, 1e-6, 1e-6))
