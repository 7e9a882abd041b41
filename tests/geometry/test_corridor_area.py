"""The area that a corridor leaves, against what its boundaries say."""

from __future__ import annotations

from dataclasses import replace
from math import pi

import numpy as np
import pytest
import shapely

from geometry import Area, Corridor, CorridorError, Pose2, ReferencePath
from geometry.corridor_area import area_of


def polygon(area: Area) -> shapely.Polygon:
    assert area.boundary is not None
    return shapely.Polygon(area.boundary, area.obstacles)


def test_a_straight_corridor_is_a_box_with_open_ends_and_open_to_the_sides_behind_its_end() -> None:
    path = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(1, 0.0, 20.0)])
    found = polygon(area_of(Corridor.from_offsets(path, left=3.0, right=-2.0), path, beyond=5.0))
    expected = shapely.box(-5.0, -2.0, 20.0, 3.0).union(shapely.box(20.0, -7.0, 25.0, 8.0))
    assert found.symmetric_difference(expected).area < 0.1  # 1 mm along the boundaries


def test_the_parts_of_a_route_are_put_together() -> None:
    segments = [(1, 0.0, 5.0), (1, 0.2, 5.0), (1, -0.2, 10.0), (-1, -0.2, 10.0), (-1, 0.2, 10.0)]
    path = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.5 * pi), segments)
    found = polygon(area_of(Corridor.from_offsets(path, left=3.0, right=-3.0), path, beyond=4.0))
    for part in path.parts:
        at = part.reference(np.linspace(part.start, part.end, 60))
        assert shapely.contains_xy(found, at.x, at.y).all()
        # Just inside its boundaries, and straight on at its ends.
        for side in (2.9, -2.9):
            beside = at.x - side * np.sin(at.phi), at.y + side * np.cos(at.phi)
            assert shapely.contains_xy(found, *beside).all()
        ends = part.reference(np.array([part.start - 3.9, part.end + 3.9]))
        assert shapely.contains_xy(found, ends.x, ends.y).all()


def test_a_polygon_corridor_is_its_polygon_and_an_area_itself() -> None:
    path = ReferencePath.from_segments(Pose2(2.0, 5.0, 0.0), [(1, 0.0, 10.0)])
    outline = [(0.0, 0.0), (20.0, 0.0), (20.0, 10.0), (0.0, 10.0)]
    found = polygon(area_of(Corridor.from_polygon(path, outline), path, beyond=5.0))
    assert found.area == pytest.approx(200.0, abs=0.01)
    area = Area(boundary=outline)
    assert area_of(Corridor.in_area(area), path, beyond=5.0) is area


@pytest.mark.parametrize("direction", [1, -1])
@pytest.mark.parametrize("side", [1, -1])
def test_where_a_bend_folds_a_boundary_away_the_area_is_as_wide_as_to_the_other_side(
    side: int, direction: int
) -> None:
    path = ReferencePath.from_segments(Pose2(3.0, 1.0, 0.4), [(direction, side * 0.3, 4.0)])
    corridor = Corridor.from_offsets(path, left=5.0, right=-5.0)
    assert not all(corridor.lines(0))
    found, part = polygon(area_of(corridor, path, beyond=6.0)), path.parts[0]
    at = part.reference(np.linspace(0.0, 4.0, 30))
    assert shapely.contains_xy(found, at.x, at.y).all()
    outside = -5.1 if side > 0 else 5.1
    for across, free in ((3.2 * side, True), (-4.9 * side, True), (outside, False)):
        beside = at.x - across * np.sin(at.phi), at.y + across * np.cos(at.phi)
        assert (shapely.contains_xy(found, *beside)[1:-1] == free).all()
    ends = part.reference(np.array([-5.9, 9.9]))
    assert shapely.contains_xy(found, ends.x, ends.y).all()


def test_boundaries_that_cut_the_path_are_told() -> None:
    there = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(1, 0.0, 10.0)])
    corridor = Corridor.from_offsets(there, left=3.0, right=-3.0)
    away = ReferencePath.from_segments(Pose2(0.0, 0.0, 1.0), [(1, 0.0, 10.0)])
    with pytest.raises(CorridorError, match="cut the path"):
        area_of(corridor, away, beyond=5.0)


def test_a_part_without_boundaries_is_told() -> None:
    path = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(1, 0.0, 10.0)])
    bare = replace(Corridor.in_area(Area()), area=None)
    with pytest.raises(CorridorError, match="part 0: it has no boundaries"):
        area_of(bare, path, beyond=5.0)
