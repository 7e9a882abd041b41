"""Corridors of any route in an area: all that is solid there, and no boundaries along the route."""

from __future__ import annotations

from math import inf

import numpy as np
import pytest
import shapely

from geometry import Area, Corridor, CorridorError
from geometry.arrays import Array
from tests.geometry.convex_shapes import BODY, CAR, placed
from tests.geometry.sides import contacts_of, distances

YARD = [(0.0, 0.0), (30.0, 0.0), (30.0, 12.0), (18.0, 12.0), (18.0, 20.0), (0.0, 20.0)]
BLOCKS = [
    [(6.0, 3.0), (9.0, 3.0), (9.0, 5.0), (6.0, 5.0)],
    [(3.0, 12.0), (5.0, 13.0), (4.0, 17.0), (3.5, 14.0)],
]
POST = [(13.0, 6.0), (13.5, 6.0), (13.5, 6.5), (13.0, 6.5)]
CART = [(20.0, 2.0), (22.0, 2.5), (21.0, 4.0)]
AREA = Area(boundary=YARD, obstacles=BLOCKS)


def poses(seed: int, count: int = 100) -> Array:
    random = np.random.default_rng(seed)
    places = random.uniform((1.0, 1.0), (29.0, 19.0), (count, 2))
    return np.column_stack([places, random.uniform(-4.0, 4.0, count)])


def hall() -> Area:
    """Of a map, turned, with some cells that are occupied."""
    cells = np.zeros((20, 30), dtype=np.bool_)
    cells[5:9, 8:11] = cells[14, 20:25] = True
    return Area.from_grid(cells, 0.5, (-3.1, 2.2, 0.3))


def contacts(corridor: Corridor, asked: Array, part: int = 0) -> Array:
    return contacts_of(corridor, part, BODY, asked, 3.0, 0.02).values


def test_it_has_no_boundaries_along_a_route() -> None:
    corridor = Corridor.in_area(AREA)
    assert corridor.lines(3) == ((), ())
    assert corridor.narrowest() == (inf, 0.0)
    assert not corridor.cut_off(0, (5.0, 5.0), (25.0, 18.0))


def test_distances_are_to_the_area_and_to_each_obstacle_told() -> None:
    corridor, asked = Corridor.in_area(AREA).with_obstacles([POST, CART]), poses(3)
    found = distances(corridor, 0, BODY, asked)
    assert found.shape == (len(asked), 3)
    np.testing.assert_array_equal(found[:, 0], AREA.signed_distances(BODY, asked))
    for n, pose in enumerate(asked):
        car = shapely.Polygon(placed(CAR, pose))
        for k, outline in enumerate((POST, CART)):
            assert max(found[n, 1 + k], 0.0) == pytest.approx(
                car.distance(shapely.Polygon(outline)), abs=1e-9
            )


def test_what_is_told_counts_like_what_belongs_to_the_area() -> None:
    asked = poses(7)
    told = contacts(Corridor.in_area(AREA).with_obstacles([POST, CART]), asked)
    known = contacts(Corridor.in_area(AREA.with_obstacles([POST, CART])), asked)
    np.testing.assert_allclose(told, known, atol=1e-9)
    assert (told[..., 0] < contacts(Corridor.in_area(AREA), asked)[..., 0]).any()


def test_with_other_obstacles_the_area_stays() -> None:
    corridor = Corridor.in_area(AREA).with_obstacles([POST])
    other = corridor.with_obstacles([CART])
    assert other.area is AREA
    assert len(other.obstacles) == 1
    np.testing.assert_array_equal(
        contacts(corridor.with_obstacles([]), poses(9)), contacts(Corridor.in_area(AREA), poses(9))
    )
    with pytest.raises(CorridorError, match=r"^obstacles\[0\] has shape"):
        corridor.with_obstacles([POST[0]])


@pytest.mark.parametrize("away", [0.0, 1e9])
@pytest.mark.parametrize("made", ["drawn", "no boundary", "bounded", "with more", "map"])
def test_built_again_from_its_lines_it_is_the_same_to_the_bit(made: str, away: float) -> None:
    blocks = [np.array(each) + away for each in BLOCKS]
    areas = {
        "drawn": lambda: Area(boundary=np.array(YARD) + away, obstacles=blocks),
        "no boundary": lambda: Area(obstacles=blocks),
        "bounded": lambda: Area(obstacles=blocks).bounded([(away, away)], 15.0),
        "with more": lambda: Area(boundary=np.array(YARD) + away).with_obstacles(blocks),
        "map": lambda: hall(),
    }
    corridor = Corridor.in_area(areas[made]()).with_obstacles([np.array(POST) + away])
    own = corridor.area
    assert own is not None
    built = Area(boundary=own.boundary, obstacles=own.obstacles)
    again = Corridor.in_area(built).with_obstacles(corridor.obstacles)
    asked = poses(10) + np.array([away, away, 0.0]) * (made != "map")
    np.testing.assert_array_equal(contacts(again, asked), contacts(corridor, asked))
    np.testing.assert_array_equal(distances(again, 0, BODY, asked), distances(corridor, 0, BODY, asked))


# -- bad questions -------------------------------------------------------------------------------------------
