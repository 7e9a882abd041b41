"""The signed distance of two convex shapes, beside shapely's."""

from __future__ import annotations

import numpy as np
import pytest
import shapely

from geometry import convex
from geometry.arrays import Array
from geometry.convex import NORMAL_X, NORMAL_Y, ON_A_X, ON_A_Y, ON_B_X, ON_B_Y, VALUE
from tests.geometry.convex_shapes import as_geometry, between, counter_clockwise, drawn, exact, placed
from tests.kernels import called

swept = called(convex.swept)
SQUARE = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
NORMAL, ON_A, ON_B = [NORMAL_X, NORMAL_Y], [ON_A_X, ON_A_Y], [ON_B_X, ON_B_Y]


def pairs(count: int, seed: int) -> list[tuple[Array, Array]]:
    """Shapes of one to nine corners, A with an area; a third of them overlap."""
    random = np.random.default_rng(seed)
    found = []
    for _ in range(count):
        size = 10.0 ** random.uniform(-1.0, 1.0, 2)
        a = drawn(random, int(random.integers(3, 10)), size[0], 1.0)
        found.append((a, drawn(random, int(random.integers(1, 10)), size[1], 2.5)))
    return found


def check(a: Array, b: Array) -> None:
    found, value = between(a, b), exact(a, b)
    assert found[VALUE] == pytest.approx(value, abs=1e-9)
    assert np.hypot(*found[NORMAL]) == pytest.approx(1.0, abs=1e-9)
    # Moved apart by the distance along the normal they just touch.
    assert found[NORMAL] @ (found[ON_A] - found[ON_B]) == pytest.approx(value, abs=1e-9)
    touching = between(a - value * found[NORMAL], b)
    assert touching[VALUE] == pytest.approx(0.0, abs=1e-9)
    if value > 0.0:
        for shape, at in ((a, found[ON_A]), (b, found[ON_B])):
            assert as_geometry(shape).distance(as_geometry(at[None])) < 1e-9


def test_the_distance_is_that_of_another_library() -> None:
    values = []
    for a, b in pairs(2000, seed=1):
        check(a, b)
        values.append(exact(a, b))
    assert 0.2 < np.mean(np.array(values) < 0.0) < 0.8


def test_the_gradient_is_the_slope_of_the_distance() -> None:
    """Equation (S2), but where two pairs of features are about equally near, or the features change."""
    random, step, checked = np.random.default_rng(4), 1e-6, 0
    for a, b in pairs(1000, seed=4):
        at = np.array([*random.normal(size=2), random.uniform(-3.0, 3.0)])
        found = between(placed(a, at), b)
        arm, normal = found[ON_A] - at[:2], found[NORMAL]
        gradient = np.array([*normal, arm[0] * normal[1] - arm[1] * normal[0]])
        slopes, bends = np.empty(3), np.empty(3)
        for i in range(3):
            ahead, behind = (between(placed(a, at + h * np.eye(3)[i]), b) for h in (step, -step))
            slopes[i] = (ahead[VALUE] - behind[VALUE]) / (2.0 * step)
            bends[i] = abs(ahead[VALUE] + behind[VALUE] - 2.0 * found[VALUE]) / step
        if bends.max() < 1e-3:  # at a tie the slopes of both sides differ
            np.testing.assert_allclose(gradient, slopes, atol=2e-4)
            checked += 1
    assert checked > 900


@pytest.mark.parametrize(
    ("other", "value", "normal"),
    [
        ([[3.0, 0.5]], 2.0, (-1.0, 0.0)),
        ([[4.0, 5.0]], 5.0, (-0.6, -0.8)),
        ([[0.9, 0.2]], -0.1, (-1.0, 0.0)),
        ([[-5.0, 3.0], [5.0, 3.0]], 2.0, (0.0, -1.0)),
        ([[-5.0, 0.5], [5.0, 0.5]], -0.5, (0.0, -1.0)),
        ([[0.5, -5.0], [0.5, 5.0]], -0.5, (-1.0, 0.0)),
        ([[0.2, -9.0], [9.0, -9.0], [9.0, 9.0], [0.2, 9.0]], -0.8, (-1.0, 0.0)),
    ],
)
def test_a_square_against_what_is_known(
    other: list[list[float]], value: float, normal: tuple[float, float]
) -> None:
    found = between(SQUARE, np.array(other))
    assert found[VALUE] == pytest.approx(value, abs=1e-15)
    np.testing.assert_allclose(found[NORMAL], normal, atol=1e-15)


def test_what_a_polygon_covers_on_its_way_is_the_hull_of_both_ends() -> None:
    random = np.random.default_rng(5)
    ways = [*random.uniform(-3.0, 3.0, (60, 2)), np.zeros(2), np.array([2.0, 0.0]), np.array([0.0, -1.0])]
    for way in ways:
        shape = counter_clockwise(drawn(random, int(random.integers(3, 7)), 1.0, 2.0))
        found = np.empty((len(shape) + 2, 2))
        count = swept(shape, float(way[0]), float(way[1]), found)
        both = shapely.MultiPoint(np.concatenate((shape, shape + way)))
        covered = shapely.Polygon(found[:count])
        assert covered.is_valid
        assert shapely.hausdorff_distance(covered, both.convex_hull) < 1e-12
        assert covered.exterior.is_ccw
    square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    found = np.empty((6, 2))
    assert swept(square, 2.0, 0.0, found) <= 6
