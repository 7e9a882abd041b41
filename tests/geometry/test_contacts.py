"""Where a body is nearest to what stands, beside shapely; and the half-planes there by differences."""

from __future__ import annotations

from math import inf

import numpy as np
import pytest
import shapely

from geometry import Corridor, Narrowing, Pose2, ReferencePath
from geometry.arrays import Array
from tests.geometry.convex_shapes import BODY, FRONT, REAR, between, check_slopes, placed
from tests.geometry.sides import contacts_of

PATH = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(1, 0.0, 40.0)])
BLOCKS = [
    [(12.0, 1.0), (14.0, 1.0), (14.0, 2.0), (12.0, 2.0)],
    [(25.0, -3.0), (27.0, -3.5), (26.0, -1.0)],
]
LANE = Corridor.from_offsets(PATH, left=4.0, right=-4.0, obstacles=BLOCKS)


def poses(seed: int, count: int = 200) -> Array:
    random = np.random.default_rng(seed)
    places = np.column_stack([random.uniform(3.0, 36.0, count), random.uniform(-3.5, 3.5, count)])
    return np.column_stack([places, random.uniform(-4.0, 4.0, count)])


def things(corridor: Corridor = LANE) -> list[shapely.Geometry]:
    """Left and right boundary and the obstacles."""
    sides = [shapely.MultiLineString(list(side)) for side in corridor.lines(0)]
    return [*sides, shapely.union_all([shapely.Polygon(outline) for outline in corridor.obstacles])]


def test_the_distances_are_those_of_another_library() -> None:
    asked = poses(1)
    found = contacts_of(LANE, 0, BODY, asked, 5.0)
    assert found.apart.shape == (len(asked), 2, 3)
    compared = 0
    for n, pose in enumerate(asked):
        for piece, ring in enumerate((REAR, FRONT)):
            shape = shapely.Polygon(placed(ring, pose))
            for side, thing in enumerate(things()):
                apart = shapely.distance(shape, thing)
                value = found.apart[n, piece, side]
                if apart >= 5.0:
                    assert value == inf
                elif value > 0.0:
                    assert value == pytest.approx(apart, abs=1e-9)
                    compared += 1
                else:  # it overlaps, or is beyond a boundary
                    assert apart == 0.0 or side < 2
    assert compared > 500


def test_the_witness_is_on_the_piece_and_the_half_planes_edge_on_the_wall() -> None:
    asked = poses(2)
    found = contacts_of(LANE, 0, BODY, asked, 5.0, outward=0.02)
    near = np.isfinite(found.apart) & (found.apart > 0.0)
    np.testing.assert_allclose(np.abs(found.normal[near]), 1.0, atol=1e-12)
    for n, piece, side in np.argwhere(near):
        at = found.at[n, piece, side]
        ring = shapely.Polygon((REAR, FRONT)[piece])
        assert ring.distance(shapely.Point(at.real, at.imag)) < 1e-9
        edge = at - found.apart[n, piece, side] * found.normal[n, piece, side]
        place = placed(np.array([[edge.real, edge.imag]]), asked[n])[0]
        assert things()[side].distance(shapely.Point(place)) < 1e-9


def test_the_half_plane_is_the_slope_of_the_distance() -> None:
    check_slopes(lambda asked: contacts_of(LANE, 0, BODY, asked, 5.0), poses(3))


def test_a_piece_that_a_wall_crosses_gets_out_on_the_allowed_side() -> None:
    for y, heading in ((2.5, 0.3), (3.5, 0.0), (4.2, 0.1)):
        pose = np.array([[20.0, y, heading]])
        found = contacts_of(LANE, 0, BODY, pose, 2.0)
        for piece, ring in enumerate((REAR, FRONT)):
            apart = found.apart[0, piece, 0]
            normal = found.normal[0, piece, 0] * np.exp(1j * heading)
            over = placed(ring, pose[0])[:, 1].max() - 4.0
            assert apart == pytest.approx(-over, abs=1e-9)
            if over > 0.0:
                assert normal == pytest.approx(-1j, abs=1e-9)


def test_a_wall_of_another_stretch_of_the_lane_is_not_to_be_passed() -> None:
    """Where the lane turns by 260 deg, its last wall is ahead of its start, seen from behind."""
    path = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(-1, 0.12, 38.0), (-1, 0.0, 18.0)])
    lane = Corridor.from_offsets(path, left=2.5, right=-3.5)
    ahead, across = np.array([[3.0, 0.0, 0.0]]), np.array([[3.5, 0.0, 0.0]])
    wall = shapely.MultiLineString(list(lane.lines(0)[0]))
    distances = [wall.distance(shapely.Polygon(placed(ring, ahead[0]))) for ring in (REAR, FRONT)]
    assert contacts_of(lane, 0, BODY, ahead, 5.0).apart[0, :, 0] == pytest.approx(distances, abs=1e-9)
    assert (contacts_of(lane, 0, BODY, across, 5.0).apart[0, :, 0] < 0.0).all()
    through = np.array([[6.0, -2.0, path.parts[0].last.phi]])
    assert (contacts_of(lane, 0, BODY, through, 5.0).apart[0, :, 0] < 0.0).all()


def test_what_stands_out_of_a_wall_is_left_like_a_solid_block() -> None:
    """Also aslant: by its flanks one by one the way out would be the whole length of the piece."""
    narrowed = Corridor.from_offsets(PATH, left=4.0, right=-4.0, narrowings=[Narrowing(10.0, 11.0, left=2.0)])
    tooth = np.array([[10.0, 2.0], [11.0, 2.0], [11.0, 99.0], [10.0, 99.0]])
    random = np.random.default_rng(7)
    asked = np.column_stack(
        [random.uniform(5.0, 12.0, 300), random.uniform(0.5, 2.0, 300), random.uniform(-0.5, 0.5, 300)]
    )
    found, compared = contacts_of(narrowed, 0, BODY, asked, 2.0), 0
    for n, pose in enumerate(asked):
        for piece, ring in enumerate((REAR, FRONT)):
            at = placed(ring, pose)
            if at[:, 1].max() > 4.0:
                continue
            witness = between(at, tooth)
            if witness[0] < 0.0:
                normal = found.normal[n, piece, 0] * np.exp(1j * pose[2])
                assert found.apart[n, piece, 0] == pytest.approx(witness[0], abs=1e-9)
                assert normal == pytest.approx(witness[1] + 1j * witness[2], abs=1e-9)
                compared += 1
    assert compared > 100
