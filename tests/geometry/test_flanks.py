"""Where a body is nearest to what is solid on each of its flanks, beside shapely, and shape by shape."""

from __future__ import annotations

from math import atan2, cos, inf, pi, sin

import numpy as np
import pytest
import shapely

from geometry.arrays import Array
from geometry.contacts import (
    ACROSS,
    AT_Y,
    END_LEFT,
    END_RIGHT,
    FLANKS,
    LEFT,
    RIGHT,
    no_contacts,
    solid_contacts,
)
from geometry.shape_grid import Body, ShapeGrid
from tests.geometry.convex_shapes import BODY, FRONT, REAR, between, check_slopes, drawn, placed
from tests.geometry.sides import Contacts

PIECES = (REAR, FRONT)
WITHIN = 5.0
OPPOSITE = [RIGHT, LEFT, END_RIGHT, END_LEFT]


def block(left: float, bottom: float, right: float, top: float) -> Array:
    return np.array([[left, bottom], [right, bottom], [right, top], [left, top]])


def shapes_of(seed: int) -> list[Array]:
    """Convex ones, some of which overlap."""
    random = np.random.default_rng(seed)
    return [drawn(random, int(random.integers(3, 8)), random.uniform(0.3, 2.0), 8.0) for _ in range(25)]


def poses(seed: int, count: int = 120) -> Array:
    random = np.random.default_rng(1000 + seed)
    return np.column_stack([random.uniform(-12.0, 12.0, (count, 2)), random.uniform(-4.0, 4.0, count)])


def flanks(
    asked: Array, *lots: list[Array], within: float = WITHIN, outward: float = 0.0, body: Body = BODY
) -> Contacts:
    """Of poses (n, 3), with some lots of shapes."""
    found = no_contacts(len(asked), body.pieces, FLANKS)
    for shapes in lots:
        solid_contacts(body, asked, ShapeGrid.of_shapes(shapes), within, outward, found)
    return Contacts(found)


def flank_towards(angle: float, across: float) -> int:
    """On which flank a shape is that is seen in this direction of the body [rad] from a point of it, which is
    so far to the left [m]."""
    if pi / 4 <= abs(angle) <= 3 * pi / 4:
        return LEFT if angle > 0.0 else RIGHT
    return END_LEFT if across > 0.0 else END_RIGHT


def one_by_one(pose: Array, piece: Array, shapes: list[Array]) -> Array:
    """The least distances (FLANKS,) of a piece to convex shapes, where they are apart by shapely alone."""
    least, at = np.full(FLANKS, inf), placed(piece, pose)
    body = shapely.Polygon(at)
    for shape in shapes:
        (on_body, on_shape) = shapely.get_coordinates(shapely.shortest_line(body, shapely.Polygon(shape)))
        apart, away = float(np.hypot(*(on_shape - on_body))), on_shape - on_body
        if apart == 0.0:
            found = between(at, shape)
            apart, away, on_body = float(found[0]), -found[1:3], found[3:5]
        x, y = on_body - pose[:2]
        across = cos(pose[2]) * y - sin(pose[2]) * x
        side = flank_towards(float(np.angle(np.exp(1j * (atan2(away[1], away[0]) - pose[2])))), across)
        least[side] = min(least[side], apart)
    return np.where(least < WITHIN, least, inf)


@pytest.mark.parametrize("seed", range(4))
def test_each_piece_and_side_holds_the_nearest_shape_of_that_side(seed: int) -> None:
    shapes, asked = shapes_of(seed), poses(seed)
    found = flanks(asked, shapes)
    assert found.apart.shape == (len(asked), 2, FLANKS)
    for n, pose in enumerate(asked):
        for k, piece in enumerate(PIECES):
            np.testing.assert_allclose(found.apart[n, k], one_by_one(pose, piece, shapes), atol=1e-9)
    assert np.isfinite(found.apart).sum() > 300
    assert (found.apart < 0.0).sum() > 10


def test_the_witness_is_on_the_piece_and_the_half_planes_edge_on_the_shape() -> None:
    shapes, asked = shapes_of(8), poses(8)
    found, compared = flanks(asked, shapes, outward=0.02), 0
    outlines = shapely.union_all([shapely.Polygon(shape) for shape in shapes])
    for n, k, side in np.argwhere(np.isfinite(found.apart) & (found.apart > 0.0)):
        normal, at = found.normal[n, k, side], found.at[n, k, side]
        assert abs(normal) == pytest.approx(1.0)
        assert flank_towards(float(np.angle(-normal)), float(at.imag)) == side
        assert shapely.Polygon(PIECES[k]).distance(shapely.Point(at.real, at.imag)) < 1e-9
        edge = at - found.apart[n, k, side] * normal
        there = placed(np.array([[edge.real, edge.imag]]), asked[n])[0]
        assert outlines.distance(shapely.Point(there)) < 1e-9
        compared += 1
    assert compared > 200


def test_a_body_between_two_shapes_is_held_on_either_side() -> None:
    slot = [block(-5.0, 1.2, 8.0, 4.0), block(-5.0, -4.0, 8.0, -1.3)]
    found = flanks(np.zeros((1, 3)), slot)
    np.testing.assert_allclose(found.apart[0, :, [LEFT, RIGHT]], [[0.2, 0.2], [0.3, 0.3]])
    np.testing.assert_allclose(found.normal[0, :, LEFT], -1j, atol=1e-12)
    np.testing.assert_allclose(found.normal[0, :, RIGHT], 1j, atol=1e-12)
    assert (found.apart[0, :, [END_LEFT, END_RIGHT]] == inf).all()


@pytest.mark.parametrize("beside", [0.05, -0.4])
def test_what_is_ahead_on_either_side_of_the_middle_counts_twice(beside: float) -> None:
    """Two cars that it is to drive in between of, or before which it has to stop: the nearer one does not
    hide the other, also where either is met straight from ahead."""
    cars = [block(4.2, 1.0 + beside, 8.0, 3.0), block(4.7, -3.0, 8.0, -1.0 - beside)]
    found = flanks(np.zeros((1, 3)), cars).apart[0, 1]
    assert found[END_LEFT] == pytest.approx(np.hypot(0.5, max(beside, 0.0)))
    assert found[END_RIGHT] == pytest.approx(np.hypot(1.0, max(beside, 0.0)))


def test_the_half_plane_is_the_slope_of_the_distance() -> None:
    check_slopes(lambda asked: flanks(asked, shapes_of(3)), poses(3, 200))


def test_mirrored_it_is_the_same_on_the_other_side() -> None:
    asked, shapes = poses(4), shapes_of(4)
    flipped = [np.ascontiguousarray((shape * [1.0, -1.0])[::-1]) for shape in shapes]
    one, other = flanks(asked, shapes, outward=0.02), flanks(asked * [1.0, -1.0, -1.0], flipped, outward=0.02)
    sign = np.ones(5)
    sign[[ACROSS, AT_Y]] = -1.0
    np.testing.assert_allclose(other.values, one.values[:, :, OPPOSITE] * sign, atol=1e-9)
