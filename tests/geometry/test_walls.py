"""What walls keep of the lines that they are built from, and what is measured against them."""

from __future__ import annotations

import pickle

import numpy as np
import shapely

from geometry import Corridor, CorridorLines, PartLines, Pose2, ReferencePath
from geometry.arrays import Array

LONG = ReferencePath.from_segments(
    Pose2(0.0, 0.0, 0.0), [(1, 0.1 if i % 2 else -0.1, 10.0) for i in range(40)]
)


def kept(line: Array) -> Array:
    """What a corridor keeps of a boundary."""
    part = PartLines(left=(line,), right=(), joined=False, narrowest=(5.0, 0.0))
    corridor = Corridor.from_lines(CorridorLines(parts=(part,), obstacles=()))
    return corridor.lines(0)[0][0]


def test_a_line_of_far_too_many_points_is_kept_as_one_of_few() -> None:
    """A point a tenth of a millimetre, as a scan gives them, is not kept: only where the line bends."""
    corners = np.array([(0.0, 0.0), (3.0, 0.0), (4.0, 2.0), (4.0, 3.0)])
    at = np.linspace(0.0, 3.0, 30_001)
    crowded = np.column_stack([np.interp(at, range(4), corners[:, i]) for i in (0, 1)])
    np.testing.assert_allclose(kept(crowded), corners, atol=1e-12)
    for turn in np.linspace(0.0, 6.0, 13):  # it still bends where a circle of small radius does
        angle = turn + np.linspace(0.0, 4.0, 5000)
        circle = 0.3 * np.column_stack([np.cos(angle), np.sin(angle)])
        thinned = kept(circle)
        assert len(thinned) < 300
        lines = shapely.LineString(thinned), shapely.LineString(circle)
        assert shapely.hausdorff_distance(*lines) < 2e-5


def test_bodies_far_and_near_against_all_lines() -> None:
    corridor = Corridor.from_offsets(LONG, left=5.0, right=-5.0)
    every = shapely.MultiLineString([line for side in corridor.lines(0) for line in side])
    random = np.random.default_rng(4)
    at = LONG.parts[0].reference(random.uniform(0.0, 400.0, 200))
    middle = np.column_stack([at.x, at.y]) + random.uniform(-12.0, 12.0, (200, 2))
    bodies = middle[:, None] + np.array([[-1.0, -1.0], [3.0, -1.0], [3.0, 1.0], [-1.0, 1.0]])
    for some in (bodies, bodies[:1], bodies[:0], bodies + 300.0):
        exact = shapely.distance(shapely.polygons(some), every)
        clearance = corridor.clearance(0, some)
        free = clearance > 0.0
        np.testing.assert_allclose(clearance[free], exact[free], atol=1e-12)
        for margin in (0.0, 0.7):
            touching = corridor.collides(0, some, margin)
            assert touching[exact <= margin].all()
            assert not touching[free & (exact > margin)].any()


def test_walls_that_were_measured_against_can_still_be_pickled() -> None:
    corridor = Corridor.from_offsets(LONG, left=5.0, right=-5.0)
    body = np.array([[(0.0, -1.0), (3.0, -1.0), (3.0, 1.0), (0.0, 1.0)]])
    again = pickle.loads(pickle.dumps(corridor))
    before = corridor.clearance(0, body)
    np.testing.assert_array_equal(again.clearance(0, body), before)
    np.testing.assert_array_equal(pickle.loads(pickle.dumps(corridor)).clearance(0, body), before)
