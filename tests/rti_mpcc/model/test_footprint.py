from __future__ import annotations

from math import pi

import numpy as np
import pytest

from rti_mpcc.config import Footprint, Vehicle
from rti_mpcc.model.footprint import Discs, Reach, body_polygons, cover, disc_centres
from rti_mpcc.types import Array
from tests.rti_mpcc.differences import slopes

VEHICLES = [Vehicle(), Vehicle(front=0.8, rear=3.6), Vehicle(wheelbase=0.5, width=0.6, front=0.8, rear=0.0)]


@pytest.mark.parametrize("vehicle", VEHICLES)
@pytest.mark.parametrize("count", [1, 3, 5, 8])
def test_discs_cover_the_body(vehicle: Vehicle, count: int) -> None:
    random = np.random.default_rng(count)
    discs = cover(vehicle, Footprint(discs=count))
    along = random.uniform(-vehicle.rear, vehicle.front, 2000)
    across = random.uniform(-0.5, 0.5, 2000) * vehicle.width
    corners = [(-vehicle.rear, 0.5 * vehicle.width), (vehicle.front, -0.5 * vehicle.width)]
    points = np.vstack([np.column_stack([along, across]), corners])
    distance = np.hypot(points[:, 0, None] - discs.offsets, points[:, 1, None]).min(axis=1)
    assert distance.max() <= discs.radius + 1e-12
    # No smaller ones would: the corners lie on a rim.
    assert distance[-1] == pytest.approx(discs.radius)


def test_more_discs_are_smaller_but_never_below_the_half_width() -> None:
    radii = [cover(Vehicle(), Footprint(discs=count)).radius for count in range(1, 12)]
    assert (np.diff(radii) < 0.0).all()
    assert radii[-1] > 0.5 * Vehicle().width
    assert radii[2] - 0.5 * Vehicle().width == pytest.approx(0.24, abs=0.01)  # design.md, 1.4


def test_disc_centres_lie_on_the_turned_axis() -> None:
    discs = cover(Vehicle(), Footprint(discs=3))
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


# -- how far a piece of the body reaches towards a wall, Eq. (H6) --------------------------------------------

ALL_COVERS = pytest.mark.parametrize(
    "discs", [cover(vehicle, Footprint(discs=count)) for vehicle in VEHICLES for count in (1, 3, 5, 8)]
)


def reach_at(angles: Array, discs: Discs) -> Reach:
    """Towards walls whose normals are `angles` (n,) [rad] from the body's axis."""
    return discs.reach(np.cos(angles), np.sin(angles))


def furthest_corner(angles: Array, discs: Discs) -> Array:
    """How far (n,) the rectangle's corners reach against these normals [m]."""
    signs = np.array([[1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]])
    corners = signs * [discs.half_length, discs.half_width]
    normals = np.stack([np.cos(angles), np.sin(angles)])
    return np.asarray((-corners @ normals).max(axis=0))


@ALL_COVERS
def test_the_reach_is_between_that_of_the_rectangle_and_the_radius(discs: Discs) -> None:
    angles = np.random.default_rng(3).uniform(-pi, pi, 5000)
    reach, needed = reach_at(angles, discs).value, furthest_corner(angles, discs)
    assert (reach >= needed - 1e-12).all()
    assert (reach <= discs.radius).all()
    # Ahead it is hardly more than the rectangle's own.
    ahead = np.abs(np.cos(angles)) >= discs.half_length / discs.radius
    assert ahead.any()
    assert (reach - needed)[ahead].max() <= discs.rounding * discs.half_width + 1e-12


@ALL_COVERS
def test_the_reach_is_the_radius_beside_and_the_half_length_ahead(discs: Discs) -> None:
    corner = np.arccos(discs.half_length / discs.radius)
    beside = np.linspace(corner + 1e-9, pi - corner - 1e-9, 50)
    np.testing.assert_array_equal(reach_at(np.append(beside, -beside), discs).value, discs.radius)
    np.testing.assert_array_equal(reach_at(np.append(beside, -beside), discs).slope, 0.0)
    exactly = np.minimum(discs.half_length + discs.rounding * discs.half_width, discs.radius)
    np.testing.assert_allclose(reach_at(np.array([0.0, pi]), discs).value, exactly, rtol=1e-12)


@ALL_COVERS
def test_the_reach_is_continuous(discs: Discs) -> None:
    angles = np.linspace(-pi, pi, 200001)
    steps = np.abs(np.diff(reach_at(angles, discs).value))
    # No point of the rectangle is farther from its centre than the radius.
    assert steps.max() <= discs.radius * (angles[1] - angles[0])


@ALL_COVERS
def test_the_reachs_slope_is_that_of_its_value_as_the_body_turns(discs: Discs) -> None:
    angles = np.random.default_rng(4).uniform(-pi, pi, 500)

    def value(turned: Array) -> Array:  # a body that turns by dphi sees the normal turn by -dphi
        return reach_at(angles - turned[0], discs).value

    # One kink in a quarter, where the disc takes over.
    wide = np.hypot(np.sin(angles), discs.rounding)
    piece = discs.half_length * np.abs(np.cos(angles)) + discs.half_width * wide
    smooth = np.abs(piece - discs.radius) > 1e-5
    assert smooth.mean() > 0.9
    difference = slopes(value, np.zeros(1))[:, 0]
    np.testing.assert_allclose(reach_at(angles, discs).slope[smooth], difference[smooth], atol=1e-7)


@ALL_COVERS
def test_the_reach_is_the_same_left_and_right_front_and_rear(discs: Discs) -> None:
    angles = np.random.default_rng(5).uniform(-pi, pi, 500)
    along, across = np.cos(angles), np.sin(angles)
    reach = discs.reach(along, across)
    for mirrored in (discs.reach(along, -across), discs.reach(-along, across)):
        np.testing.assert_array_equal(mirrored.value, reach.value)
        np.testing.assert_array_equal(mirrored.slope, -reach.slope)
    np.testing.assert_array_equal(discs.reach(-along, -across).slope, reach.slope)
