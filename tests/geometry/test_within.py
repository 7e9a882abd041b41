"""Half-planes that are looked up only where a boundary may be near."""

from __future__ import annotations

from math import inf, nan, pi

import numpy as np
import pytest
from numpy.typing import NDArray

from geometry import Corridor, HalfPlanes, InputError, Narrowing, Pose2, ReferencePath
from geometry.walls import BEHIND

STRAIGHT = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(1, 0.0, 40.0)])
BOX = [(-5.0, -6.0), (45.0, -6.0), (45.0, 7.0), (-5.0, 7.0)]
BLOCK = [(20.0, -1.0), (21.0, -1.0), (21.0, 1.0), (20.0, 1.0)]


def winding(seed: int) -> Corridor:
    """Boundaries with steps and folds beside arcs of random curvature, and a cusp."""
    random = np.random.default_rng(seed)
    ways = [1] * 4 + [-1] * 3
    segments = [(way, float(random.uniform(-0.25, 0.25)), float(random.uniform(3.0, 9.0))) for way in ways]
    path = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), segments)
    narrowings = [Narrowing(at, at + 2.0, left=2.0) for at in (5.0, 14.0)]
    return Corridor.from_offsets(path, left=4.0, right=-3.5, narrowings=narrowings)


def corridors() -> list[Corridor]:
    return [
        *(winding(seed) for seed in range(4)),
        Corridor.from_offsets(STRAIGHT, left=5.0, right=-5.0, obstacles=[BLOCK, [(30, 2), (31, 2), (30, 3)]]),
        Corridor.from_polygon(STRAIGHT, BOX, obstacles=[BLOCK]),
    ]


POLYGON = 5


def was_looked_up(planes: HalfPlanes) -> NDArray[np.bool_]:
    """Whether the distances (n, s) are exact ones."""
    found: NDArray[np.bool_] = np.abs(planes.normal).sum(axis=-1) > 0.5
    return found


def walk(seed: int, steps: int = 25, number: int = 150) -> list[np.ndarray]:
    """Points on the move, a few of them slow and a few fast."""
    random = np.random.default_rng(seed)
    points = random.uniform((-5.0, -8.0), (45.0, 8.0), (number, 2))
    speed = random.choice([0.0, 0.02, 0.2, 0.8], (number, 1))
    heading = random.uniform(0.0, 2.0 * pi, number)
    way = speed * np.column_stack([np.cos(heading), np.sin(heading)])
    return [points + i * way + random.normal(0.0, 0.01, points.shape) for i in range(steps)]


@pytest.mark.parametrize("within", [0.5, 2.7])
@pytest.mark.parametrize("case", range(6))
def test_what_is_near_is_the_same(case: int, within: float) -> None:
    corridor = corridors()[case]
    planes, skipped = None, 0
    for points in walk(case):
        planes = corridor.half_planes(0, points, planes, hysteresis=0.0, within=within)
        exact = corridor.half_planes(0, points)
        looked_up = was_looked_up(planes)
        # Outside of a polygon, which is not where a vehicle is, either half keeps the side it was seen on.
        sides = exact.distance if case < POLYGON else np.abs(exact.distance)
        assert looked_up[sides <= within].all()
        # Where two pieces are equally near either may be taken, see Boundary.nearest_sample.
        same = np.abs(planes.distance - exact.distance)[looked_up] < 1e-9
        np.testing.assert_allclose(planes.distance[looked_up], exact.distance[looked_up], atol=2e-3)
        assert same.mean() > 0.99
        agrees = looked_up & (planes.sample == exact.sample)
        np.testing.assert_allclose(planes.normal[agrees], exact.normal[agrees], atol=1e-9)
        far = ~looked_up
        assert (planes.distance[far] > within).all()
        assert (planes.distance[far] <= sides[far] + 2e-3).all()
        assert (planes.feature[far] == -1).all()
        assert (planes.sample[far] == -1).all()
        skipped += int(far.sum())
    assert skipped > 300


def test_a_feature_that_is_near_is_kept_as_without_a_limit() -> None:
    corridor = Corridor.from_offsets(
        STRAIGHT, left=4.0, right=-3.0, narrowings=[Narrowing(10.0, 14.0, left=1.0)]
    )
    some = every = None
    for x in np.concatenate([np.arange(8.0, 9.5, 0.004), np.arange(9.5, 8.0, -0.004)]):
        point = np.array([[x, 3.0]])
        some = corridor.half_planes(0, point, some, within=2.7)
        every = corridor.half_planes(0, point, every)
        assert some.feature[0, 0] == every.feature[0, 0]
        assert some.distance[0, 0] == every.distance[0, 0]


def test_what_is_far_stays_what_it_was_until_it_may_be_near() -> None:
    corridor = Corridor.from_offsets(STRAIGHT, left=5.0, right=-5.0)
    planes = corridor.half_planes(0, np.array([[10.0, 0.0]]))
    asked = []
    for y in np.arange(0.1, 4.0, 0.1):
        planes = corridor.half_planes(0, np.array([[10.0, y]]), planes, within=2.7)
        asked.append((y, was_looked_up(planes)[0].tolist(), planes.distance[0].tolist()))
    # The left boundary is 5 - y away. The right one moves away, but may have come nearer for all one knows.
    first = next(row for row in asked if row[1][0])
    assert first[0] == pytest.approx(2.3)
    np.testing.assert_allclose([row[2][0] for row in asked], [5.0 - row[0] for row in asked], atol=1e-9)
    assert sum(row[1][1] for row in asked) == 1


def test_without_memory_all_is_looked_up() -> None:
    corridor = corridors()[4]
    points = walk(0)[0]
    fresh, limited = corridor.half_planes(0, points), corridor.half_planes(0, points, within=1.0)
    for field in ("point", "normal", "distance", "feature", "sample"):
        np.testing.assert_array_equal(getattr(fresh, field), getattr(limited, field))


def test_what_was_seen_of_other_boundaries_does_not_count() -> None:
    """An obstacle that appears, another part of the route, and memory without what was seen."""
    corridor = winding(1)
    points = walk(1)[0]
    blocked, moved = (corridor.with_obstacles([np.add(BLOCK, (x, 0.0))]) for x in (0.0, 0.5))
    for before, now, parts in (
        (corridor, blocked, (0, 0)),
        (blocked, moved, (0, 0)),
        (blocked, corridor, (0, 0)),
        (corridor, corridor, (0, 1)),
    ):
        memory = before.half_planes(parts[0], points)
        planes = now.half_planes(parts[1], points, memory, hysteresis=0.0, within=0.5)
        np.testing.assert_array_equal(planes.distance, now.half_planes(parts[1], points).distance)
    memory = corridor.half_planes(0, points)
    bare = HalfPlanes(
        **{name: getattr(memory, name) for name in ("point", "normal", "distance", "feature", "sample")}
    )
    assert was_looked_up(corridor.half_planes(0, points, bare, within=0.5)).all()


def test_on_the_forbidden_side_and_behind_it_all_is_looked_up() -> None:
    corridor = Corridor.from_offsets(STRAIGHT, left=3.0, right=-3.0)
    points = np.array([[10.0, 4.0], [10.0, 3.0 + BEHIND + 4.0], [10.0, 0.0]])
    planes = corridor.half_planes(0, points, corridor.half_planes(0, points), within=0.1)
    np.testing.assert_allclose(planes.distance[:, 0], [-1.0, BEHIND + 4.0, 3.0])
    np.testing.assert_array_equal(was_looked_up(planes)[:, 0], [True, True, False])


def test_round_an_open_end_what_is_beyond_the_wall_is_seen_in_time() -> None:
    corridor = Corridor.from_offsets(STRAIGHT, left=3.0, right=-3.0)
    way = [(x, 1.0) for x in np.arange(36.0, 45.0, 0.2)] + [(45.0, y) for y in np.arange(1.0, 4.5, 0.2)]
    way += [(x, 4.5) for x in np.arange(45.0, 30.0, -0.2)]
    planes = None
    for point in way:
        planes = corridor.half_planes(0, np.array([point]), planes, hysteresis=0.0, within=0.2)
    assert planes is not None
    assert planes.distance[0, 0] == pytest.approx(-1.5)


def test_nothing_to_hit_is_infinitely_far() -> None:
    path = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(1, 0.5, 4.0 * pi)])
    corridor = Corridor.from_offsets(path, left=3.0, right=-3.0)
    points = np.array([[1.0, 0.0], [2.0, 1.0]])
    planes = corridor.half_planes(0, points)
    again = corridor.half_planes(0, points + 0.1, planes, within=1e6)
    np.testing.assert_array_equal(again.distance[:, 0], inf)
    assert was_looked_up(again)[:, 1].all()


@pytest.mark.parametrize("within", [-0.1, nan])
def test_a_bad_limit_is_refused(within: float) -> None:
    with pytest.raises(InputError, match="within = "):
        corridors()[4].half_planes(0, np.zeros((1, 2)), within=within)


@pytest.mark.parametrize(
    ("one", "other", "apart"),
    [
        ((10.0, 0.0), (10.0, 4.9), False),
        ((10.0, 0.0), (10.0, 5.1), True),
        ((10.0, 0.0), (10.0, -30.0), True),
        ((40.0, 0.0), (45.0, 9.0), False),  # behind the end
        ((0.0, 0.0), (-5.0, -9.0), False),
        ((10.0, 20.0), (30.0, 20.0), False),
    ],
)
def test_what_is_beyond_an_open_boundary_is_cut_off(
    one: tuple[float, float], other: tuple[float, float], apart: bool
) -> None:
    corridor = corridors()[POLYGON - 1]
    assert corridor.cut_off(0, one, other) == apart
    assert corridor.cut_off(0, other, one) == apart


def test_a_boundary_without_ends_cuts_nothing_off_and_obstacles_do_not() -> None:
    assert not corridors()[POLYGON].cut_off(0, (10.0, 0.0), (10.0, 30.0))
    assert not corridors()[POLYGON - 1].cut_off(0, (15.0, 0.0), (25.0, 0.0))
    with pytest.raises(InputError, match="part = 1"):
        corridors()[POLYGON].cut_off(1, (0.0, 0.0), (1.0, 0.0))


@pytest.mark.parametrize("seed", range(4))
def test_nothing_between_path_and_boundary_is_cut_off(seed: int) -> None:
    """The nearest point of the path sees it."""
    random = np.random.default_rng(seed)
    ways = [(1, float(random.uniform(-0.25, 0.25)), float(random.uniform(3.0, 9.0))) for _ in range(5)]
    path = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), ways)
    corridor = Corridor.from_offsets(path, left=4.0, right=-3.5)
    for _ in range(100):
        pose = path.parts[0].pose(random.uniform(0.0, path.length))
        at = pose.compose(Pose2(0.0, random.uniform(-3.4, 3.9), 0.0))
        nearest = path.parts[0].pose(path.parts[0].project(at.x, at.y))
        assert not corridor.cut_off(0, (nearest.x, nearest.y), (at.x, at.y))
