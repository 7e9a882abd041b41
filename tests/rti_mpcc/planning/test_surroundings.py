"""What is around the vehicle when it leaves the path that it was given."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from math import pi

import numpy as np
import pytest
import shapely

from geometry import Area, Corridor, CorridorError, Pose2, ReferencePath
from rti_mpcc.config import ControllerConfig
from rti_mpcc.planning.surroundings import GOAL_REACH, Surroundings, area_along
from rti_mpcc.types import Array
from tests.rti_mpcc.encounters import body_at, square

CONFIG = ControllerConfig()
PATH = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(1, 0.0, 20.0)])
LANE = Corridor.from_offsets(PATH, left=4.0, right=-4.0)
HALL = Area(boundary=[(-9.0, -6.0), (30.0, -6.0), (30.0, 6.0), (-9.0, 6.0)])
BOX = square(8.0, 3.0, 0.5)


def polygon(area: Area) -> shapely.Polygon:
    assert area.boundary is not None
    return shapely.Polygon(area.boundary, area.obstacles)


def with_a_walker() -> Surroundings:
    """Along the path, with a box that stands and something that crosses the path at 1 m/s."""
    around = Surroundings.of(LANE, PATH, CONFIG)
    for k in range(20):
        around = around.updated([BOX, square(15.0, -3.0 + 0.1 * k, 0.4)], 0.1 * k)
    assert (len(around.standing), len(around.moving)) == (1, 1)
    return around


def same(found: Sequence[Array], given: Sequence[Array]) -> bool:
    """Whether they are the same polygons, whatever corner each begins with."""
    pairs = zip(found, given, strict=True)
    return all(shapely.Polygon(one).normalize() == shapely.Polygon(other).normalize() for one, other in pairs)


def test_without_its_path_it_is_in_an_area_with_the_same_obstacles() -> None:
    around = with_a_walker()
    after = around.without_path(HALL)
    assert after.corridor.area is not None
    assert after.known.area is not None
    np.testing.assert_array_equal(after.corridor.area.boundary, HALL.boundary)
    assert same(after.corridor.obstacles, [each.outline for each in around.standing])
    assert same(after.known.obstacles, [each.outline for each in around.obstacles])
    assert after.obstacles is around.obstacles
    assert (after.given_at, after.changes) == (around.given_at, around.changes)


def test_its_boundaries_do_not_act_any_more() -> None:
    beside = np.array([[[5.0, 4.5], [6.0, 4.5], [6.0, 5.5], [5.0, 5.5]]])
    around = Surroundings.of(LANE, PATH, CONFIG)
    assert around.corridor.collides(0, beside).all()
    assert not around.without_path(HALL).corridor.collides(0, beside).any()


def test_where_nothing_moves_all_that_is_known_stands() -> None:
    around = Surroundings.of(LANE, PATH, CONFIG).updated([BOX], 1.0).without_path(HALL)
    assert around.known is around.corridor
    assert len(around.corridor.obstacles) == 1


def test_obstacles_are_known_again_in_the_area() -> None:
    """Told once more the same they have not changed; one that goes has."""
    after = Surroundings.of(LANE, PATH, CONFIG).updated([BOX], 1.0).without_path(HALL)
    again = after.updated([BOX], 1.1)
    assert (again.changes, len(again.corridor.obstacles)) == (after.changes, 1)
    gone = again.updated([], 1.2)
    assert (gone.changes, len(gone.corridor.obstacles)) == (after.changes + 1, 0)
    assert gone.corridor.area is not None


def test_in_an_area_already_it_is_in_the_same_one() -> None:
    around = Surroundings.in_area(HALL)
    assert around.without_path(HALL) is around


# -- the area along a path -----------------------------------------------------------------------------------


def test_the_area_along_a_path_is_its_corridor_and_what_is_beyond_its_ends() -> None:
    vehicle = CONFIG.vehicle
    beyond = GOAL_REACH + 2.0 * (vehicle.front + vehicle.rear)
    found = polygon(area_along(PATH, LANE, CONFIG))
    lane = found.intersection(shapely.box(0.0, -99.0, 20.0, 99.0))
    assert lane.symmetric_difference(shapely.box(0.0, -4.0, 20.0, 4.0)).area < 0.1
    before = found.intersection(shapely.box(-99.0, -99.0, 0.0, 99.0))
    assert before.symmetric_difference(shapely.box(-beyond, -4.0, 0.0, 4.0)).area < 0.1
    assert found.bounds[2] == pytest.approx(20.0 + beyond, abs=0.01)


def test_a_vehicle_has_room_at_any_goal_that_is_taken() -> None:
    """As far from the path's end as a goal may be, turned however; and before it, to turn about."""
    found = polygon(area_along(PATH, LANE, CONFIG))
    reach = GOAL_REACH
    for direction, turned in product(np.linspace(-0.5 * pi, 0.5 * pi, 9), np.linspace(0.0, 2.0 * pi, 9)):
        x, y = 20.0 + reach * np.cos(direction), reach * np.sin(direction)
        if direction in (-0.5 * pi, 0.5 * pi):
            x += CONFIG.vehicle.front + CONFIG.vehicle.rear  # all of the body behind the end
        assert found.covers(body_at(float(x), float(y), float(turned), CONFIG.vehicle))


def test_obstacles_in_the_corridor_are_no_part_of_the_area() -> None:
    """They come on top of it, as they are known by then."""
    filled = LANE.with_obstacles([BOX])
    assert polygon(area_along(PATH, filled, CONFIG)).covers(shapely.Polygon(BOX))


def test_boundaries_that_cut_the_path_are_told() -> None:
    across = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.7), [(1, 0.0, 20.0)])
    with pytest.raises(CorridorError, match="cut the path"):
        area_along(across, LANE, CONFIG)
