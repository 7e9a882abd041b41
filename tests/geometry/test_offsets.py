from __future__ import annotations

from math import pi

import numpy as np
import pytest
import shapely

from geometry import Corridor, Narrowing, Pose2, ReferencePath
from tests.geometry.sides import sides_of

SEGMENTS = {
    "reversing": (
        Pose2(0.0, 0.0, pi / 2),
        [(-1, -0.2, 10.0), (-1, 0.2, 10.0), (-1, 0.0, 5.0), (-1, 0.2, 5.0)],
    ),
    "quarter": (Pose2(0.0, 0.0, 0.0), [(1, 0.0, 10.0), (1, 0.5, pi), (1, 0.0, 10.0)]),
    "hairpin": (Pose2(0.0, 0.0, 0.0), [(1, 0.0, 15.0), (1, -0.5, 2.0 * pi), (1, 0.0, 15.0)]),
    "loop": (Pose2(0.0, 0.0, 0.0), [(1, 0.0, 20.0), (1, 0.1, 15.0 * pi), (1, 0.0, 20.0)]),
    "bend": (Pose2(0.0, 0.0, 0.0), [(1, 0.0, 8.0), (1, 0.5, 0.04), (1, 0.0, 8.0)]),
}


def route(name: str) -> ReferencePath:
    start, segments = SEGMENTS[name]
    return ReferencePath.from_segments(start, segments)


def path_line(path: ReferencePath, part: int = 0, spacing: float = 0.05) -> shapely.LineString:
    at = path.sample(spacing)[part]
    return shapely.LineString(np.column_stack([at.x, at.y]))


@pytest.mark.parametrize("name", sorted(SEGMENTS))
@pytest.mark.parametrize("half_width", [1.5, 2.0, 3.0, 5.0, 6.0])
def test_no_boundary_is_nearer_to_the_path_than_its_offset(name: str, half_width: float) -> None:
    path = route(name)
    corridor = Corridor.from_offsets(path, left=half_width, right=-half_width)
    line = path_line(path)
    for lines in corridor.lines(0):
        for points in lines:
            assert shapely.distance(line, shapely.points(points)).min() >= half_width - 5e-3
            assert len(points) < 2 or shapely.LineString(points).is_simple


@pytest.mark.parametrize("name", sorted(SEGMENTS))
@pytest.mark.parametrize("half_width", [1.5, 1.9, 2.1, 3.0])
def test_boundaries_enclose_what_the_offset_sweeps(name: str, half_width: float) -> None:
    # Reference: the outline of the path widened with flat ends. It has the caps besides.
    path = route(name)
    outline = shapely.boundary(path_line(path).buffer(half_width, cap_style="flat", quad_segs=50))
    caps = [
        shapely.LineString([(a.x, a.y), (b.x, b.y)])
        for pose in (path.start, path.end)
        for a, b in [[pose.compose(Pose2(0.0, side, 0.0)) for side in (half_width, -half_width)]]
    ]
    corridor = Corridor.from_offsets(path, left=half_width, right=-half_width)
    lines = shapely.union_all(
        [shapely.LineString(points) for side in corridor.lines(0) for points in side if len(points) > 1]
        + caps
    )
    for one, other in ((outline, lines), (lines, outline)):
        points = shapely.points(shapely.get_coordinates(shapely.segmentize(one, 0.1)))
        shapely.prepare(other)
        assert shapely.distance(other, points).max() < 0.02


def test_a_fold_is_joined_at_its_crossing() -> None:
    # A quarter turn of radius 2 m with 3 m to the inside: a right angle 3 m from both legs.
    (left,), _ = Corridor.from_offsets(route("quarter"), left=3.0, right=-3.0).lines(0)
    corner = np.hypot(left[:, 0] - 9.0, left[:, 1] - 3.0)
    assert corner.min() == pytest.approx(0.0, abs=1e-9)
    np.testing.assert_allclose(np.minimum(np.abs(left[:, 0] - 9.0), np.abs(left[:, 1] - 3.0)), 0.0, atol=1e-9)


def test_lanes_that_touch_have_no_wall_between_them() -> None:
    corridor = Corridor.from_offsets(route("hairpin"), left=2.0, right=-2.0)
    _, right = corridor.lines(0)
    points = np.concatenate([*right, np.zeros((0, 2))])
    assert len(points) <= 1 or np.hypot(points[:, 0] - 15.0, points[:, 1] + 2.0).max() < 0.1
    # With a strip of 20 cm between them there are two.
    corridor = Corridor.from_offsets(route("hairpin"), left=1.9, right=-1.9)
    assert len(corridor.lines(0)[1]) == 1
    planes = sides_of(corridor, 0, np.array([[5.0, -1.0], [5.0, -2.0], [5.0, -3.0]]))
    np.testing.assert_allclose(planes.distance[:, 1], [0.9, -0.1, 0.9], atol=1e-9)


def test_narrowing_may_begin_or_end_with_the_route_and_span_a_cusp(full_course: ReferencePath) -> None:
    narrowings = [
        Narrowing(0.0, 3.0, left=2.0),
        Narrowing(28.0, 33.0, right=-1.5),
        Narrowing(57.0, 60.0, left=1.2),
    ]
    corridor = Corridor.from_offsets(full_course, left=5.0, right=-5.0, narrowings=narrowings)
    assert [walls.narrowest for walls in corridor.walls] == [(6.5, 28.0), (6.2, 57.0)]
    assert corridor.narrowest() == (6.2, 57.0)
    for part, theta, lateral, side in (
        (0, 1.0, 2.0, 0),
        (0, 29.0, -1.5, 1),
        (1, 31.0, -1.5, 1),
        (1, 59.0, 1.2, 0),
    ):
        pose = full_course.parts[part].pose(theta)
        planes = sides_of(corridor, part, np.array([[pose.x, pose.y]]))
        assert planes.distance[0, side] == pytest.approx(abs(lateral), abs=1e-3)


def test_of_overlapping_narrowings_the_tightest_holds() -> None:
    path = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(1, 0.0, 10.0)])
    narrowings = [Narrowing(2.0, 6.0, left=1.0), Narrowing(4.0, 8.0, left=2.0, right=-1.0)]
    corridor = Corridor.from_offsets(path, left=5.0, right=-5.0, narrowings=narrowings)
    points = np.array([[3.0, 0.0], [5.0, 0.0], [7.0, 0.0]])
    distance = sides_of(corridor, 0, points).distance
    np.testing.assert_allclose(distance, [[1.0, np.hypot(1.0, 1.0)], [1.0, 1.0], [np.hypot(1.0, 1.0), 1.0]])
    assert corridor.narrowest() == (2.0, 4.0)


def test_a_step_inside_a_fold_leaves_no_gap() -> None:
    path = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(1, 0.0, 10.0), (1, 0.2, 6.0), (1, 0.0, 10.0)])
    corridor = Corridor.from_offsets(path, left=6.0, right=-6.0, narrowings=[Narrowing(12.0, 26.0, left=1.5)])
    left, _ = corridor.lines(0)
    assert len(left) == 1
    assert sides_of(corridor, 0, np.array([[9.0, 7.0], [5.0, 6.5]])).distance[:, 0].max() < 0.0


def test_a_mirrored_route_has_mirrored_boundaries() -> None:
    start, segments = SEGMENTS["reversing"]
    narrowings = [Narrowing(22.0, 23.0, left=1.3), Narrowing(27.5, 28.4, right=-1.0)]
    corridor = Corridor.from_offsets(
        ReferencePath.from_segments(start, segments), left=5.0, right=-4.0, narrowings=narrowings
    )
    points = np.random.default_rng(3).uniform((-8.0, -22.0), (20.0, 4.0), (300, 2))
    planes = sides_of(corridor, 0, points)

    mirrored = Corridor.from_offsets(
        ReferencePath.from_segments(Pose2(0.0, 0.0, -pi / 2), [(d, -k, s) for d, k, s in segments]),
        left=4.0,
        right=-5.0,
        narrowings=[Narrowing(22.0, 23.0, right=-1.3), Narrowing(27.5, 28.4, left=1.0)],
    )
    other = sides_of(mirrored, 0, points * [1.0, -1.0])
    free = (planes.distance > 0.0) & (other.distance[:, ::-1] > 0.0)
    assert free.mean() > 0.3
    # Curved walls are simplified to within a millimetre, each in its own sense.
    np.testing.assert_allclose(other.distance[:, ::-1][free], planes.distance[free], atol=3e-3)
