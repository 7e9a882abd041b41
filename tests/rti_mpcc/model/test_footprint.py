from __future__ import annotations

from math import pi

import numpy as np
import pytest
import shapely

from rti_mpcc.config import Vehicle
from rti_mpcc.model.footprint import body_of, body_polygons

VEHICLES = [Vehicle(), Vehicle(front=0.8, rear=3.6), Vehicle(wheelbase=0.5, width=0.6, front=0.8, rear=0.0)]


@pytest.mark.parametrize("vehicle", VEHICLES)
@pytest.mark.parametrize("count", [1, 2, 5])
def test_the_pieces_make_up_the_body(vehicle: Vehicle, count: int) -> None:
    body = body_of(vehicle, count)
    pieces = [shapely.Polygon(ring) for ring in np.split(body.corners, body.starts[1:-1])]
    assert len(pieces) == count
    whole = shapely.Polygon(body_polygons(np.zeros((1, 3)), vehicle)[0])
    assert shapely.union_all(pieces).symmetric_difference(whole).area < 1e-12
    assert all(piece.exterior.is_ccw for piece in pieces)
    assert [piece.area for piece in pieces] == pytest.approx([whole.area / count] * count)
    low, high = whole.bounds[:2], whole.bounds[2:]
    np.testing.assert_allclose(body.middle - body.half, low, atol=1e-12)
    np.testing.assert_allclose(body.middle + body.half, high, atol=1e-12)


def test_body_polygons_are_the_turned_rectangle_counter_clockwise() -> None:
    vehicle = Vehicle(width=2.0, front=3.0, rear=1.0)
    flat, up = body_polygons(np.array([[5.0, 6.0, 0.0], [5.0, 6.0, pi / 2.0]]), vehicle)
    np.testing.assert_allclose(flat, [[4.0, 5.0], [8.0, 5.0], [8.0, 7.0], [4.0, 7.0]])
    np.testing.assert_allclose(up, [[6.0, 5.0], [6.0, 9.0], [4.0, 9.0], [4.0, 5.0]])
    for body in (flat, up):
        x, y = body.T
        assert 0.5 * (x * np.roll(y, -1) - y * np.roll(x, -1)).sum() == pytest.approx(8.0)


def test_what_trails_behind_the_axle_is_the_end_of_each_piece() -> None:
    vehicle = Vehicle()
    body, cut = body_of(vehicle, 2), 0.5 * (vehicle.front - vehicle.rear)
    np.testing.assert_allclose(body.trailing(1), [vehicle.rear, 0.0])
    np.testing.assert_allclose(body.trailing(-1), [cut, vehicle.front])
