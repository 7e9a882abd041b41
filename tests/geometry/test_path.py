from __future__ import annotations

from math import inf, nan, pi
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from geometry import PathError, Pose2, ReferencePath

TWO_LEGS = [(1, 0.1, 6.0), (-1, -0.15, 5.0)]


def rows_of(path: ReferencePath, spacing: float) -> tuple[np.ndarray, list[int]]:
    """Poses (n, 3) without doubled cusps and the directions of the intervals."""
    poses, intervals = [], []
    for i, at in enumerate(path.sample(spacing)):
        rows = np.column_stack([at.x, at.y, at.phi])
        poses.append(rows if i == 0 else rows[1:])
        intervals += [path.parts[i].direction] * (len(rows) - 1)
    return np.concatenate(poses), intervals


def assert_same(path: ReferencePath, other: ReferencePath, tolerance: float) -> None:
    assert path.length == pytest.approx(other.length, abs=tolerance)
    assert path.cusps == pytest.approx(other.cusps, abs=tolerance)
    for part, twin in zip(path.parts, other.parts, strict=True):
        assert part.direction == twin.direction
        theta = np.linspace(max(part.start, twin.start), min(part.end, twin.end), 101)
        at, to = part.reference(theta), twin.reference(theta)
        np.testing.assert_allclose([at.x, at.y, at.phi], [to.x, to.y, to.phi], atol=tolerance)


def test_a_route_is_cut_at_its_cusps(full_course: ReferencePath) -> None:
    assert [part.direction for part in full_course.parts] == [1, -1]
    assert full_course.cusps == (30.0,)
    assert full_course.length == pytest.approx(60.0)
    assert full_course.max_curvature == pytest.approx(0.2)
    last, first = full_course.parts[0].last, full_course.parts[1].first
    assert (last.x, last.y, last.phi) == (first.x, first.y, first.phi)
    assert full_course.start == full_course.parts[0].first
    assert full_course.end == full_course.parts[1].last


@pytest.mark.parametrize("direction", [1, -1])
def test_biarcs_through_poses_of_one_arc_are_that_arc(direction: int) -> None:
    path = ReferencePath.from_segments(Pose2(3.0, 1.0, 2.0), [(direction, 0.2, 9.0)])
    poses, _ = rows_of(path, 1.5)
    again = ReferencePath.from_poses(poses, direction)
    assert_same(again, path, 1e-9)
    np.testing.assert_allclose(again.parts[0].curvatures, 0.2, atol=1e-9)


def test_biarcs_take_every_pose_and_join_smoothly() -> None:
    x = np.linspace(0.0, 8.0, 17)
    poses = np.column_stack([x, np.sin(x), np.arctan(np.cos(x))])
    part = ReferencePath.from_poses(poses, 1).parts[0]
    knots = part.reference(part.knots[::2])
    np.testing.assert_allclose(np.column_stack([knots.x, knots.y, knots.phi]), poses, atol=1e-9)
    inside = part.reference(np.linspace(0.0, part.end, 500))
    assert np.abs(inside.y - np.sin(inside.x)).max() < 2e-3
    finer = np.linspace(0.0, 8.0, 65)
    part = ReferencePath.from_poses(
        np.column_stack([finer, np.sin(finer), np.arctan(np.cos(finer))]), 1
    ).parts[0]
    inside = part.reference(np.linspace(0.0, part.end, 500))
    # Third order at least.
    assert np.abs(inside.y - np.sin(inside.x)).max() < 2e-3 / 4**3


def directions_by(convention: str, intervals: list[int], poses: np.ndarray) -> tuple[np.ndarray, list[int]]:
    cusp = intervals.index(-1)
    match convention:
        case "intervals":
            return poses, intervals
        case "way from the row":
            return poses, [*intervals, intervals[-1]]
        case "way to the row":
            return poses, [intervals[0], *intervals]
        case "cusp listed twice":
            return np.insert(poses, cusp, poses[cusp], axis=0), [1] * (cusp + 1) + [-1] * (len(poses) - cusp)
    raise AssertionError(convention)


@pytest.mark.parametrize(
    "convention", ["intervals", "way from the row", "way to the row", "cusp listed twice"]
)
def test_all_conventions_for_a_cusp(convention: str) -> None:
    path = ReferencePath.from_segments(Pose2(1.0, 0.0, 0.5), TWO_LEGS)
    poses, directions = directions_by(convention, rows_of(path, 0.5)[1], rows_of(path, 0.5)[0])
    assert_same(ReferencePath.from_poses(poses, directions), path, 1e-9)
    points = ReferencePath.from_waypoints(poses[:, :2], directions)
    assert [part.direction for part in points.parts] == [1, -1]
    assert_same(points, path, 0.02)


def test_waypoints_make_a_smooth_path() -> None:
    angle = np.linspace(0.0, 2.0, 15)
    points = 10.0 * np.column_stack([np.cos(angle), np.sin(angle)])
    path = ReferencePath.from_waypoints(points)
    assert path.length == pytest.approx(20.0, abs=1e-3)
    assert path.max_curvature == pytest.approx(0.1, abs=0.01)
    at = path.sample(0.1)[0]
    np.testing.assert_allclose(np.hypot(at.x, at.y), 10.0, atol=1e-3)
    assert np.diff(path.parts[0].knots).max() <= 0.25
    backwards = ReferencePath.from_waypoints(points, -1)
    assert backwards.start.phi == pytest.approx(path.start.phi - pi, abs=1e-9) or backwards.start.phi == (
        pytest.approx(path.start.phi + pi, abs=1e-9)
    )


def test_few_waypoints_around_a_corner_are_straight_before_and_after_it() -> None:
    path = ReferencePath.from_waypoints([(0.0, 0.0), (5.0, 0.0), (10.0, 0.0), (10.0, 5.0), (10.0, 10.0)])
    assert (path.start.phi, path.end.phi) == pytest.approx((0.0, 0.5 * pi))
    at = path.sample(0.1)[0]
    before, after = at.x < 5.0, at.y > 5.0
    assert before.sum() > 40
    assert after.sum() > 40
    np.testing.assert_allclose(at.y[before], 0.0, atol=1e-9)
    np.testing.assert_allclose(at.x[after], 10.0, atol=1e-9)


@pytest.mark.parametrize("convention", ["way from the row", "way to the row", "cusp listed twice"])
def test_csv(convention: str, tmp_path: Path) -> None:
    path = ReferencePath.from_segments(Pose2(1.0, 0.0, 0.5), TWO_LEGS)
    poses, directions = directions_by(convention, rows_of(path, 0.5)[1], rows_of(path, 0.5)[0])
    lines = [
        f"{d},{x!r}, {y!r},{phi!r},note" for (x, y, phi), d in zip(poses.tolist(), directions, strict=True)
    ]
    file = tmp_path / "path.csv"
    file.write_text("direction, x,y,heading,remark\n" + "\n".join(lines) + "\n\n")
    assert_same(ReferencePath.from_csv(file), path, 1e-9)


GOOD = "x,y,heading,direction\n0,0,0,1\n1,0,0,1\n2,0,0,1\n"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "column x is missing"),
        ("x,y,heading\n0,0,0\n1,0,0\n", "column direction is missing"),
        (GOOD.replace("1,0,0,1", "1,abc,0,1"), "row 3, column y: 'abc'"),
        (GOOD.replace("2,0,0,1", "2,0,nan,1"), "row 4, column heading: 'nan'"),
        (GOOD.replace("2,0,0,1", "2,0"), "row 4, column heading: ''"),
        (GOOD.replace("2,0,0,1", "2,0,0,2"), "row 4, column direction: 2 must be 1 or -1"),
        ("x,y,heading,direction\n0,0,0,1\n", "at least 2"),
        ("x,y,heading,direction\n", "at least 2"),
        (GOOD.replace("2,0,0,1", "1,0,0,1"), "row 2 repeats"),
        (GOOD.replace("2,0,0,1", "2,0,3,1"), "row 2: its heading is 90 deg or more"),
    ],
)
def test_bad_csv_is_refused_with_its_name(text: str, message: str, tmp_path: Path) -> None:
    file = tmp_path / "bad.csv"
    file.write_text(text)
    with pytest.raises(PathError, match=message) as caught:
        ReferencePath.from_csv(file)
    assert "bad.csv" in str(caught.value)


def test_files_that_cannot_be_read_are_refused(tmp_path: Path) -> None:
    with pytest.raises(PathError, match=r"missing.csv: cannot be read"):
        ReferencePath.from_csv(tmp_path / "missing.csv")
    with pytest.raises(PathError, match="cannot be read"):
        ReferencePath.from_csv(tmp_path)
    (tmp_path / "binary.csv").write_bytes(b"\xff\xfe\x00\x81")
    with pytest.raises(PathError, match="cannot be read"):
        ReferencePath.from_csv(tmp_path / "binary.csv")


STRAIGHT = [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (2.0, 0.0, 0.0)]
ORIGIN = Pose2(0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("build", "given", "message"),
    [
        ("segments", (ORIGIN, []), "segments is empty"),
        ("segments", (ORIGIN, [(1, 0.1, 5.0), (0, 0.0, 1.0)]), r"segments\[1\]: direction = 0"),
        ("segments", (ORIGIN, [(1, nan, 1.0)]), "curvature = nan"),
        ("segments", (ORIGIN, [(1, 0.0, 0.0)]), "length = 0.0"),
        ("segments", (ORIGIN, [(1, 0.0, inf)]), "length = inf"),
        ("poses", ([], 1), "shape|at least 2"),
        ("poses", (STRAIGHT[:1], 1), "at least 2"),
        ("poses", ([(0.0, 0.0), (1.0, 0.0)], 1), "shape"),
        ("poses", ([("a", 0.0, 0.0), (1.0, 0.0, 0.0)], 1), "an array of numbers"),
        ("poses", ([STRAIGHT[0], (1.0, nan, 0.0)], 1), r"poses\[1\]"),
        ("poses", ([*STRAIGHT, STRAIGHT[-1]], 1), "row 3 repeats the point of row 2"),
        ("poses", (STRAIGHT, 0), "direction = 0"),
        ("poses", (STRAIGHT, [1, 1, 3]), r"directions\[2\]: direction = 3"),
        ("poses", (STRAIGHT, [1, 1, 1, 1]), "directions has shape"),
        ("poses", (STRAIGHT, -1), "row 0: its heading"),
        ("poses", ([*STRAIGHT[:2], (2.0, 0.0, 1.6)], 1), "row 2: its heading"),
        ("poses", ([*STRAIGHT, (2.0, 0.0, 0.5), (1.0, -1.0, 0.5)], [1, 1, 1, -1, -1]), "same heading"),
        ("waypoints", ([(0.0, 0.0), (0.0, 0.0)], 1), "row 1 repeats"),
        ("waypoints", ([(0.0, 0.0), (nan, 0.0)], 1), r"points\[1\]"),
        ("waypoints", ([(0.0, 0.0), (1.0, 0.0), (2.0, 0.0)], [1, -1]), "does not turn back"),
    ],
)
def test_bad_arguments_are_refused(build: str, given: tuple[Any, Any], message: str) -> None:
    with pytest.raises(PathError, match=message):
        getattr(ReferencePath, f"from_{build}")(*given)
