from __future__ import annotations

from math import pi

import numpy as np
import pytest

from rti_mpcc.config import Vehicle
from rti_mpcc.model.footprint import body_polygons, cover, disc_centres

VEHICLES = [Vehicle(), Vehicle(front=0.8, rear=3.6), Vehicle(wheelbase=0.5, width=0.6, front=0.8, rear=0.0)]


@pytest.mark.parametrize("vehicle", VEHICLES)
@pytest.mark.parametrize("count", [1, 3, 5, 8])
def test_discs_cover_the_body(vehicle: Vehicle, count: int) -> None:
    random = np.random.default_rng(count)
    discs = cover(vehicle, count)
    along = random.uniform(-vehicle.rear, vehicle.front, 2000)
    across = random.uniform(-0.5, 0.5, 2000) * vehicle.width
    corners = [(-vehicle.rear, 0.5 * vehicle.width), (vehicle.front, -0.5 * vehicle.width)]
    points = np.vstack([np.column_stack([along, across]), corners])
    distance = np.hypot(points[:, 0, None] - discs.offsets, points[:, 1, None]).min(axis=1)
    assert distance.max() <= discs.radius + 1e-12
    # No smaller ones would: the corners lie on a rim.
    assert distance[-1] == pytest.approx(discs.radius)


def test_more_discs_are_smaller_but_never_below_the_half_width() -> None:
    radii = [cover(Vehicle(), count).radius for count in range(1, 12)]
    assert (np.diff(radii) < 0.0).all()
    assert radii[-1] > 0.5 * Vehicle().width
    assert radii[2] - 0.5 * Vehicle().width == pytest.approx(0.24, abs=0.01)  # design.md, 1.4


def test_disc_centres_lie_on_the_turned_axis() -> None:
    discs = cover(Vehicle(), 3)
    states = np.array([[1.0, 2.0, 0.0], [1.0, 2.0, pi / 2.0]])
    centres = disc_centres(states, discs)
    np.testing.assert_allclose(centres[0], np.column_stack([1.0 + discs.offsets, np.full(3, 2.0)]))
    np.testing.assert_allclose(centres[1], np.column_stack([np.full(3, 1.0), 2.0 + discs.offsets]))


def test_body_polygons_are_the_turned_rectangle_counter_clockwise() -> None:
    vehicle = Vehicle(width=2.0, front=3.0, rear=1.0)
    flat, up = body_polygons(np.array([[5.0, 6.0, 0.0], [5.0, 6.0, pi / 2.0]]), vehicle)
    np.testing.assert_allclose(flat, [[4.0, 5.0], [8.0, 5.0], [8.0, 7.0], [4.0, 7.0]])
    np.testing.assert_allclose(up, [[6.0, 5.0], [6.0, 9.0], [4.0, 9.0], [4.0, 5.0]])
    for body in (flat, up):
        x, y = body.T
        assert 0.5 * (x * np.roll(y, -1) - y * np.roll(x, -1)).sum() == pytest.approx(8.0)
