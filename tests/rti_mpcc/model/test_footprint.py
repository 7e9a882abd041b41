from __future__ import annotations

from math import pi

import numpy as np
import pytest
import shapely

from geometry import Corridor, Narrowing, Pose2, ReferencePath
from geometry.shape_grid import ShapeGrid
from rti_mpcc.config import Vehicle
from rti_mpcc.model.footprint import body_of, body_polygons, clearances

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


PILLAR = [(20.0, -0.1), (20.2, -0.1), (20.2, 0.1), (20.0, 0.1)]
LANE = Corridor.from_offsets(
    ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(1, 0.0, 30.0)]),
    left=3.0,
    right=-2.0,
    narrowings=[Narrowing(10.0, 10.5, left=1.2)],
    obstacles=[PILLAR],
)


@pytest.mark.parametrize(
    ("pose", "expected"),
    [
        ((4.0, 0.0, 0.0), 1.0),
        ((9.0, 0.0, 0.0), 0.2),
        ((14.0, -1.3, 0.0), -0.3),
        ((4.0, 0.5, pi / 2), -0.5),
        # The corner of the narrowing is 0.3 m inside of the body, which has no corner beyond.
        ((9.3, 0.5, 0.0), -0.3),
        # All of it beyond the boundary.
        ((20.0, 4.5, 0.0), -1.5),
        # Touching both sides of the narrowing's lane across it.
        ((4.0, 0.0, pi / 2), 0.0),
        # Behind the end, where there is no boundary: the corner of the body to the end of the wall.
        ((32.0, 2.5, 0.0), 1.0),
    ],
)
def test_clearances_to_boundaries_and_obstacles(pose: tuple[float, float, float], expected: float) -> None:
    vehicle, states = Vehicle(width=2.0, front=3.0, rear=1.0), np.array([pose])
    ((walls, pillar),) = clearances(states, LANE, 0, vehicle)
    apart = shapely.Polygon(body_polygons(states, vehicle)[0]).distance(shapely.Polygon(PILLAR))
    assert (walls, pillar) == pytest.approx((expected, apart), abs=1e-9)


FORKS = ((-0.4, -0.6), (1.0, -0.6), (1.0, -0.3), (2.2, -0.3), (2.2, 0.3), (1.0, 0.3), (1.0, 0.6), (-0.4, 0.6))
TWO_FORKS = (
    *((-0.4, -0.6), (2.2, -0.6), (2.2, -0.3), (1.0, -0.3)),
    *((1.0, 0.3), (2.2, 0.3), (2.2, 0.6), (-0.4, 0.6)),
)
STAR = tuple(
    (0.5 + r * np.cos(a), r * np.sin(a)) for r, a in zip([1.0, 0.5] * 5, np.arange(10) * pi / 5, strict=True)
)
OUTLINES = {"forks": FORKS, "two forks": TWO_FORKS, "pentagon": STAR[::2], "star": STAR}


@pytest.mark.parametrize("name", OUTLINES)
def test_an_outline_is_made_of_few_convex_pieces(name: str) -> None:
    vehicle = Vehicle(outline=OUTLINES[name])
    body, whole = body_of(vehicle), shapely.Polygon(OUTLINES[name])
    pieces = [shapely.Polygon(ring) for ring in np.split(body.corners, body.starts[1:-1])]
    assert len(pieces) == body.pieces <= {"forks": 2, "two forks": 3, "pentagon": 1, "star": 6}[name]
    for piece in pieces:
        assert piece.exterior.is_ccw
        assert piece.convex_hull.area == pytest.approx(piece.area, rel=1e-9)
    assert shapely.union_all(pieces).symmetric_difference(whole).area < 1e-9
    assert sum(piece.area for piece in pieces) == pytest.approx(whole.area)
    assert (vehicle.width, vehicle.front, vehicle.rear) == pytest.approx(
        (2.0 * np.abs(whole.exterior.xy[1]).max(), whole.bounds[2], -whole.bounds[0])
    )


@pytest.mark.parametrize("name", OUTLINES)
def test_distances_to_an_outline_are_those_that_shapely_finds(name: str) -> None:
    vehicle, random = Vehicle(outline=OUTLINES[name]), np.random.default_rng(4)
    corners = random.uniform(-4.0, 4.0, (40, 1, 2)) + random.uniform(-0.5, 0.5, (40, 3, 2))
    shapes = [each for each in map(shapely.Polygon, corners) if each.is_valid]
    rings = [shapely.get_coordinates(shapely.orient_polygons(each))[:-1] for each in shapes]
    grid = ShapeGrid.of_shapes(rings)
    poses = np.column_stack([random.uniform(-6.0, 6.0, (200, 2)), random.uniform(-pi, pi, 200)])
    found = grid.signed_distances(body_of(vehicle), poses)[:, 0]
    bodies = shapely.polygons(body_polygons(poses, vehicle))
    expected = shapely.distance(bodies, shapely.union_all(shapes))
    assert np.maximum(found, 0.0) == pytest.approx(expected, abs=1e-9)
    assert (expected == 0.0).any()
    assert (expected > 0.0).any()
