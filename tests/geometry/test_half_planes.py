from __future__ import annotations

import pickle
from math import nan, pi

import numpy as np
import pytest
import shapely

from geometry import Corridor, HalfPlanes, InputError, Narrowing, Pose2, ReferencePath

STRAIGHT = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(1, 0.0, 20.0)])
TRIANGLE = [(8.0, 1.0), (10.0, 1.0), (9.0, 2.0)]


def plain() -> Corridor:
    return Corridor.from_offsets(STRAIGHT, left=4.0, right=-3.0)


def stepped() -> Corridor:
    """Left boundary at 4 m, from 10 to 14 m at 1 m."""
    return Corridor.from_offsets(STRAIGHT, left=4.0, right=-3.0, narrowings=[Narrowing(10.0, 14.0, left=1.0)])


def at(corridor: Corridor, *points: tuple[float, float]) -> HalfPlanes:
    return corridor.half_planes(0, np.array(points))


def test_shapes_values_and_read_only() -> None:
    planes = at(plain(), (3.0, 1.0), (5.03, -4.0), (7.0, 6.0))
    assert planes.point.shape == planes.normal.shape == (3, 2, 2)
    np.testing.assert_allclose(planes.point[:, 0], [[3.0, 4.0], [5.03, 4.0], [7.0, 4.0]])
    np.testing.assert_allclose(planes.point[:, 1], [[3.0, -3.0], [5.03, -3.0], [7.0, -3.0]])
    np.testing.assert_allclose(planes.distance, [[3.0, 4.0], [8.0, -1.0], [-2.0, 9.0]])
    # Into the allowed side, also for a point beyond the boundary.
    np.testing.assert_allclose(planes.normal, [[[0.0, -1.0], [0.0, 1.0]]] * 3, atol=1e-12)
    with pytest.raises(ValueError, match="read-only"):
        planes.distance[0, 0] = 1.0


def test_on_the_boundary_the_normal_is_that_of_the_segment() -> None:
    planes = at(plain(), (3.01, 4.0), (3.01, -3.0))
    np.testing.assert_allclose(planes.distance[[0, 1], [0, 1]], 0.0, atol=1e-12)
    np.testing.assert_allclose(planes.normal[[0, 1], [0, 1]], [[0.0, -1.0], [0.0, 1.0]], atol=1e-12)


def test_beyond_open_ends_nothing_is_forbidden() -> None:
    planes = at(plain(), (-3.0, 8.0), (23.0, -7.0), (-2.0, 0.0))
    np.testing.assert_allclose(planes.distance[:, 0], [5.0, np.hypot(3.0, 11.0), np.hypot(2.0, 4.0)])
    np.testing.assert_allclose(planes.distance[:, 1], [np.hypot(3.0, 11.0), 5.0, np.hypot(2.0, 3.0)])
    np.testing.assert_allclose(planes.normal[0, 0], [-0.6, 0.8])


def test_sign_at_corners() -> None:
    # Beside the corner (10, 1), which juts into the corridor, and the corner (10, 4), which recedes.
    planes = at(stepped(), (9.0, 0.0), (10.5, 1.5), (9.5, 3.5), (10.2, 3.3), (9.9, 4.5))
    expected = [np.sqrt(2.0), -0.5, 0.5, -0.2, -0.5]
    np.testing.assert_allclose(planes.distance[:4, 0], expected[:4], atol=1e-9)
    assert planes.distance[4, 0] == pytest.approx(-0.5)
    np.testing.assert_allclose(planes.normal[0, 0], [-np.sqrt(0.5), -np.sqrt(0.5)])
    # Diagonally outside of the receding corner, where the nearest point is the corner.
    outside = at(Corridor.from_polygon(STRAIGHT, [(-2, -2), (22, -2), (22, 2), (-2, 2)]), (23.0, 3.0))
    assert outside.distance[0, 0] == pytest.approx(-np.sqrt(2.0))
    np.testing.assert_allclose(outside.normal[0, 0], [-np.sqrt(0.5), -np.sqrt(0.5)])


def reference_distance(lines: tuple[np.ndarray, ...], points: np.ndarray) -> np.ndarray:
    merged = shapely.union_all([shapely.LineString(line) for line in lines])
    return np.asarray(shapely.distance(merged, shapely.points(points)), dtype=np.float64)


@pytest.mark.parametrize("number", [40, 700, 5000])
def test_against_shapely(docking_behind: Corridor, number: int) -> None:
    # Few points go by the tree, some by the matrix product, very many by the tree again.
    points = np.random.default_rng(5).uniform((-8.0, -24.0), (22.0, 5.0), (number, 2))
    planes = docking_behind.half_planes(0, points)
    for side in (0, 1):
        expected = reference_distance(docking_behind.lines(0)[side], points)
        # Where two pieces are equally near either may be taken, see Boundary._nearest_sample.
        np.testing.assert_allclose(np.abs(planes.distance[:, side]), expected, atol=2e-3)
        assert np.mean(np.abs(np.abs(planes.distance[:, side]) - expected) < 1e-9) > 0.98
        inner = planes.distance[:, side] / np.abs(planes.distance[:, side])
        gap = points - planes.point[:, side]
        np.testing.assert_allclose(
            planes.normal[:, side] * np.abs(planes.distance[:, side, None]), gap * inner[:, None], atol=1e-9
        )
        np.testing.assert_allclose((planes.normal[:, side] * gap).sum(1), planes.distance[:, side], atol=1e-9)
    np.testing.assert_allclose(np.hypot(planes.normal[..., 0], planes.normal[..., 1]), 1.0)


def test_sign_against_a_polygon() -> None:
    angle = np.linspace(0.0, 2.0 * pi, 41)[:-1]
    radius = 10.0 + 3.0 * np.cos(5.0 * angle)
    polygon = np.column_stack([radius * np.cos(angle) + 10.0, radius * np.sin(angle)])
    short = ReferencePath.from_segments(Pose2(7.0, 0.0, 0.0), [(1, 0.0, 5.0)])
    corridor = Corridor.from_polygon(short, polygon)
    points = np.random.default_rng(2).uniform((-5.0, -15.0), (25.0, 15.0), (3000, 2))
    nearer = corridor.half_planes(0, points).distance
    nearer = np.take_along_axis(nearer, np.abs(nearer).argmin(axis=1)[:, None], axis=1)[:, 0]
    inside = shapely.contains_xy(shapely.Polygon(polygon), points)
    clear = np.abs(nearer) > 1e-6
    np.testing.assert_array_equal(nearer[clear] > 0.0, inside[clear])


def test_far_and_near_pieces_of_a_thin_wall() -> None:
    # Two lanes with 20 cm between them: from either lane its own side of the strip is met.
    path = ReferencePath.from_segments(
        Pose2(0.0, 0.0, 0.0), [(1, 0.0, 15.0), (1, 0.5, 2 * pi), (1, 0.0, 15.0)]
    )
    corridor = Corridor.from_offsets(path, left=1.9, right=-1.9)
    x = np.random.default_rng(0).uniform(1.0, 14.0, 400)
    for y, expected in ((1.89, 0.01), (1.0, 0.9), (2.11, 0.01), (2.5, 0.4), (1.95, -0.05)):
        planes = corridor.half_planes(0, np.column_stack([x, np.full(400, y)]))
        np.testing.assert_allclose(planes.distance[:, 0], expected, atol=1e-9)


def test_a_side_without_boundary_is_infinitely_far() -> None:
    # Lanes that touch: nothing but a point is left of the inner side, and here not even that.
    path = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(1, 0.5, 4.0 * pi)])
    corridor = Corridor.from_offsets(path, left=3.0, right=-3.0)
    assert corridor.lines(0)[0] == ()
    planes = at(corridor, (1.0, 0.0), (2.0, 1.0))
    np.testing.assert_array_equal(planes.distance[:, 0], np.inf)
    np.testing.assert_array_equal(planes.normal[:, 0], 0.0)
    np.testing.assert_array_equal(planes.point[:, 0], 0.0)
    again = corridor.half_planes(0, np.array([[1.0, 0.0], [2.0, 1.0]]), planes)
    np.testing.assert_array_equal(again.distance, planes.distance)


def test_obstacles_are_a_third_side() -> None:
    corridor = plain().with_obstacles([TRIANGLE, [(1.0, -1.0), (1.0, -2.0), (2.0, -2.0), (2.0, -1.0)]])
    planes = at(corridor, (9.0, 0.0), (9.0, 1.4), (2.5, -1.5), (0.0, 0.0), (11.0, 0.0))
    assert planes.distance.shape == (5, 3)
    expected = [1.0, -0.6 * np.sqrt(0.5), 0.5, np.sqrt(2.0), np.sqrt(2.0)]
    np.testing.assert_allclose(np.abs(planes.distance[:, 2]), [1.0, 0.4, 0.5, np.sqrt(2.0), np.sqrt(2.0)])
    assert (np.sign(planes.distance[:, 2]) == np.sign(expected)).all()
    np.testing.assert_allclose(planes.normal[0, 2], [0.0, -1.0], atol=1e-12)
    np.testing.assert_allclose(planes.normal[4, 2], [np.sqrt(0.5), -np.sqrt(0.5)])
    np.testing.assert_array_equal(
        planes.distance[:, :2],
        at(plain(), (9.0, 0.0), (9.0, 1.4), (2.5, -1.5), (0.0, 0.0), (11.0, 0.0)).distance,
    )
    assert at(corridor.with_obstacles([]), (1.0, 1.0)).distance.shape == (1, 2)
    assert len(corridor.obstacles) == 2


@pytest.mark.parametrize("sense", [1, -1])
def test_obstacles_may_be_listed_either_way_round_and_closed(sense: int) -> None:
    corridor = plain().with_obstacles([[*TRIANGLE[::sense], TRIANGLE[::sense][0]]])
    assert at(corridor, (9.0, 1.3)).distance[0, 2] == pytest.approx(-0.3)
    assert len(corridor.obstacles[0]) == 3


def test_a_point_keeps_its_feature_until_another_is_5_cm_nearer() -> None:
    # Receding corner at (10, 4): the left boundary above, the transverse edge on the right.
    corridor = stepped()
    planes = corridor.half_planes(0, np.array([[8.0, 2.9]]))
    first = planes.feature[0, 0]
    seen = []
    for x in np.arange(8.0, 9.5, 0.004):
        planes = corridor.half_planes(0, np.array([[x, 3.0]]), planes)
        seen.append((x, planes.feature[0, 0], planes.distance[0, 0]))
    kept = [row for row in seen if row[1] == first]
    left = [row for row in seen if row[1] != first]
    assert max(row[0] for row in kept) == pytest.approx(9.05, abs=0.005)
    np.testing.assert_allclose([row[2] for row in kept], 1.0, atol=1e-9)
    np.testing.assert_allclose([row[2] for row in left], [10.0 - row[0] for row in left], atol=1e-9)
    # On the way back it stays with the edge as long.
    for x in np.arange(9.5, 8.0, -0.004):
        planes = corridor.half_planes(0, np.array([[x, 3.0]]), planes)
        if planes.feature[0, 0] == first:
            break
    assert x == pytest.approx(8.95, abs=0.005)


def test_hysteresis_can_be_set_and_is_off_without_memory() -> None:
    corridor = stepped()
    planes = corridor.half_planes(0, np.array([[8.0, 3.0]]))
    point = np.array([[9.2, 3.0]])
    assert corridor.half_planes(0, point, planes, hysteresis=0.3).feature[0, 0] == planes.feature[0, 0]
    assert corridor.half_planes(0, point, planes, hysteresis=0.0).distance[0, 0] == pytest.approx(0.8)
    assert corridor.half_planes(0, point).distance[0, 0] == pytest.approx(0.8)


def test_memory_follows_along_the_feature_and_over_jumps(docking_behind: Corridor) -> None:
    random = np.random.default_rng(8)
    points = random.uniform((-8.0, -24.0), (22.0, 5.0), (300, 2))
    planes = docking_behind.half_planes(0, points)
    for size in (0.01, 0.1, 1.0, 10.0):
        points = points + random.normal(0.0, size, points.shape)
        planes = docking_behind.half_planes(0, points, planes)
        fresh = docking_behind.half_planes(0, points)
        assert (np.abs(planes.distance) <= np.abs(fresh.distance) + 0.05 + 1e-9).all()
        same = planes.feature == fresh.feature
        np.testing.assert_allclose(planes.distance[same], fresh.distance[same], atol=2e-3)


def test_a_round_obstacle_is_one_feature_without_a_seam() -> None:
    angle = np.linspace(0.0, 2.0 * pi, 61)[:-1]
    circle = np.column_stack([10.0 + np.cos(angle), np.sin(angle)])
    corridor = plain().with_obstacles([circle])
    planes = at(corridor, (12.0, 0.0))
    for turn in np.linspace(0.0, 4.0 * pi, 400):
        point = np.array([[10.0 + 2.0 * np.cos(turn), 2.0 * np.sin(turn)]])
        planes = corridor.half_planes(0, point, planes)
        assert planes.feature[0, 2] == 0
        assert planes.distance[0, 2] == pytest.approx(1.0, abs=2e-3)


def test_memory_of_other_obstacles_is_harmless() -> None:
    points = np.random.default_rng(1).uniform((0.0, -3.0), (20.0, 4.0), (50, 2))
    many = plain().with_obstacles([TRIANGLE, [(1, -1), (3, -1), (2, -2)], [(15, 0), (16, 0), (16, 1)]])
    one = plain().with_obstacles([TRIANGLE])
    before = many.half_planes(0, points)
    fresh, kept = one.half_planes(0, points), one.half_planes(0, points, before)
    assert (np.abs(kept.distance) <= np.abs(fresh.distance) + 0.05 + 1e-9).all()
    none = plain().half_planes(0, points, before)
    assert none.distance.shape == (50, 2)
    assert many.half_planes(0, points, none).distance.shape == (50, 3)


def test_many_samples_and_far_away() -> None:
    segments = [(1, 0.1 if i % 2 else -0.1, 5.0) for i in range(250)]
    path = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), segments)
    corridor = Corridor.from_offsets(path, left=4.0, right=-4.0)
    ref = path.parts[0].reference(np.linspace(600.0, 630.0, 300))
    planes = corridor.half_planes(0, np.column_stack([ref.x, ref.y]))
    np.testing.assert_allclose(planes.distance, 4.0, atol=2e-3)
    assert (at(corridor, (1e5, 1e5)).distance > 1e4).all()


def test_no_points_are_fine() -> None:
    assert plain().half_planes(0, np.zeros((0, 2))).distance.shape == (0, 2)


def test_pickles(docking_behind: Corridor) -> None:
    corridor = docking_behind.with_obstacles([TRIANGLE])
    again: Corridor = pickle.loads(pickle.dumps(corridor))
    points = np.random.default_rng(0).uniform(-10.0, 10.0, (60, 2))
    np.testing.assert_array_equal(
        again.half_planes(0, points).distance, corridor.half_planes(0, points).distance
    )
    body = np.array([[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]], [[9.0, 0.0], [9.5, 5.0], [8.0, 5.0]]])
    np.testing.assert_array_equal(again.collides(0, body), corridor.collides(0, body))


@pytest.mark.parametrize(
    ("part", "points", "message"),
    [
        (1, np.zeros((1, 2)), "part = 1"),
        (-1, np.zeros((1, 2)), "part = -1"),
        (0, np.zeros((1, 3)), "points has shape"),
        (0, np.zeros(2), "points has shape"),
        (0, np.array([[0.0, nan]]), "finite"),
    ],
)
def test_bad_questions_are_refused(part: int, points: np.ndarray, message: str) -> None:
    with pytest.raises(InputError, match=message):
        plain().half_planes(part, points)


def test_memory_of_another_number_of_points_is_refused() -> None:
    planes = at(plain(), (0.0, 0.0))
    with pytest.raises(InputError, match="previous has 1 points"):
        plain().half_planes(0, np.zeros((2, 2)), planes)
