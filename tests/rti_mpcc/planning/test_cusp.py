"""Where the direction changes: the body keeps clear of what the next part has there."""

from __future__ import annotations

from unittest.mock import patch

import numpy as np
import pytest

from geometry import Corridor, Narrowing, Pose2, ReferencePath
from rti_mpcc.config import ControllerConfig
from rti_mpcc.manoeuvre import Segment
from rti_mpcc.model.footprint import body_polygons
from rti_mpcc.planning import workspace
from rti_mpcc.planning.cusp import cusp_pose
from rti_mpcc.simulation import scenario_from_dict, simulate, summary

CONFIG = ControllerConfig()
CUSP_TOLERANCE = CONFIG.behaviour.cusp_tolerance
SHIFT = CONFIG.behaviour.cusp_shift
BENT = [(-1, 0.0, 8.0), (1, 0.08, 14.0)]
MARGIN = CONFIG.clearance.wanted


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


def test_with_room_on_both_parts_it_is_the_cusp() -> None:
    path = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), BENT)
    cusp = path.parts[0].last
    assert cusp_pose(cusp, corridor(path), Segment(part=path.parts[0], index=0), CONFIG) is cusp


def beside_cusp(pose: Pose2) -> tuple[float, float, float]:
    error = pose.relative_to(Pose2(-8.0, 0.0, 0.0))
    return (error.x, error.y, error.phi)


@pytest.mark.parametrize("side", [1, -1])
def test_beside_a_narrowing_of_the_next_part_it_keeps_the_margin(side: int) -> None:
    pose, room = chosen(side, 1.02)
    assert room >= MARGIN
    assert (np.abs(beside_cusp(pose)) <= SHIFT * np.array(CUSP_TOLERANCE) + 1e-12).all()
    assert beside_cusp(pose) != (0.0, 0.0, 0.0)


def test_it_stays_within_the_tolerance_of_the_segment() -> None:
    tolerance = (0.02, 0.01, 0.005)
    pose, room = chosen(1, 1.02, tolerance)
    assert (np.abs(beside_cusp(pose)) <= SHIFT * np.array(tolerance) + 1e-12).all()
    assert beside_cusp(pose) != (0.0, 0.0, 0.0)
    assert room < chosen(1, 1.02)[1]


def test_it_is_mirrored_with_the_course() -> None:
    left, right = chosen(1, 1.02)[0], chosen(-1, 1.02)[0]
    assert (left.x, abs(left.y), abs(left.phi)) == pytest.approx((right.x, abs(right.y), abs(right.phi)))


def test_where_no_pose_has_the_margin_it_is_the_one_with_the_most_room() -> None:
    _, room = chosen(1, 0.9)
    path = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), BENT)
    walls = corridor(path, Narrowing(start=9.0, end=10.0, left=0.9, right=None))
    body = body_polygons(np.array([[-8.0, 0.0, 0.0]]), CONFIG.vehicle)
    assert float(walls.clearance(1, body)[0]) + 0.05 < room < MARGIN


@pytest.mark.acceptance
def test_a_vehicle_changes_direction_clear_of_the_next_part() -> None:
    segments = [{"direction": d, "curvature": k, "length": s} for d, k, s in BENT]
    scenario = scenario_from_dict(
        {
            "name": "narrowed_behind_the_cusp",
            "path": {"start": [0.0, 0.0, 0.0], "segments": segments},
            "corridor": {"left": 4.0, "right": -4.0, "narrowings": [{"from": 9.0, "to": 10.0, "left": 0.96}]},
            "simulation": {"dead_time": 0.18, "cycle": 0.05, "duration": 15.0},
        }
    )
    figures = summary(simulate(scenario))
    assert figures["direction_changes"] == 1  # it is on its way, clear of the narrowing
    assert figures["min_clearance_m"] > 0.05
    with patch.object(workspace, "cusp_pose", lambda cusp, *_: cusp):
        assert summary(simulate(scenario))["min_clearance_m"] < 0.02
