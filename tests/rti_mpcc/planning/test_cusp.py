"""Where the direction changes: the body keeps clear of what the next part has there."""

from __future__ import annotations

import numpy as np
import pytest

from geometry import Corridor, Narrowing, Pose2, ReferencePath
from rti_mpcc.config import ControllerConfig
from rti_mpcc.manoeuvre import Segment
from rti_mpcc.model.footprint import body_polygons
from rti_mpcc.planning.cusp import cusp_pose

CONFIG = ControllerConfig()
CUSP_TOLERANCE = CONFIG.behaviour.cusp_tolerance
SHIFT = CONFIG.behaviour.cusp_shift
BENT = [(-1, 0.0, 8.0), (1, 0.08, 14.0)]
MARGIN = CONFIG.footprint.margin


def corridor(path: ReferencePath, *narrowings: Narrowing) -> Corridor:
    return Corridor.from_offsets(path, left=4.0, right=-4.0, narrowings=narrowings)


def chosen(
    side: int, bound: float, tolerance: tuple[float, float, float] = CUSP_TOLERANCE
) -> tuple[Pose2, float]:
    """The pose at the cusp, and the room of the body there [m], with the next part narrowed at its begin."""
    path = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(d, side * k, s) for d, k, s in BENT])
    left, right = (bound, None) if side > 0 else (None, -bound)
    walls = corridor(path, Narrowing(start=9.0, end=10.0, left=left, right=right))
    segment = Segment(part=path.parts[0], index=0, tolerance=tolerance)
    pose = cusp_pose(path.parts[0].last, walls, segment, CONFIG)
    body = body_polygons(np.array([[pose.x, pose.y, pose.phi]]), CONFIG.vehicle)
    return pose, min(float(walls.clearance(index, body)[0]) for index in (0, 1))


def beside_cusp(pose: Pose2) -> tuple[float, float, float]:
    error = pose.relative_to(Pose2(-8.0, 0.0, 0.0))
    return (error.x, error.y, error.phi)


@pytest.mark.parametrize("side", [1, -1])
def test_beside_a_narrowing_of_the_next_part_it_keeps_the_margin(side: int) -> None:
    pose, room = chosen(side, 1.02)
    assert room >= MARGIN
    assert (np.abs(beside_cusp(pose)) <= SHIFT * np.array(CUSP_TOLERANCE) + 1e-12).all()
    assert beside_cusp(pose) != (0.0, 0.0, 0.0)
