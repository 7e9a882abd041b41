"""The baselines: segments, objectives and weights beside a core that knows none of them."""

from __future__ import annotations

import ast
from math import inf
from pathlib import Path

import numpy as np
import pytest

import rti_mpcc
from geometry import Pose2, ReferencePath
from rti_mpcc import ControllerConfig, InputError
from rti_mpcc.baselines import METHODS, CartesianPose, cartesian_weights, segments_of, with_method
from rti_mpcc.config import Method, Weights
from rti_mpcc.manoeuvre import SegmentEnd
from rti_mpcc.ocp.objectives import CONTOURING, Contouring

LENGTHS = np.full(70, 0.1)
PATH = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(1, 0.05, 12.0), (-1, 0.0, 12.0)])


def test_a_method_is_a_setting() -> None:
    config = ControllerConfig.paper()
    assert with_method(config, "dynamic") == config
    assert with_method(config, "separated") == config.model_copy(update={"method": Method.SEPARATED})
    assert with_method(config, "switched").method is Method.SWITCHED


@pytest.mark.parametrize("weight", [1, 50, 100])
def test_constant_weights_are_the_same_everywhere(weight: int) -> None:
    config = with_method(ControllerConfig(), f"constant_{weight}")
    assert config.weights.contouring == config.weights.contouring_at_end == weight
    assert (config.arrival, config.method) == (False, Method.DYNAMIC)
    assert config.weights.lag == ControllerConfig().weights.lag


def test_an_unknown_method_is_refused_with_those_there_are() -> None:
    with pytest.raises(InputError, match=rf"'best': must be one of {', '.join(METHODS)}"):
        with_method(ControllerConfig(), "best")


def test_dynamic_drives_the_parts_of_the_path() -> None:
    segments = segments_of(PATH, ControllerConfig())
    assert [segment.end for segment in segments] == [SegmentEnd.CUSP, SegmentEnd.GOAL]
    assert {(segment.objective, segment.final) for segment in segments} == {(CONTOURING, None)}


def test_separated_has_a_segment_more_and_from_its_begin_the_pose_alone() -> None:
    *before, last = segments_of(PATH, ControllerConfig(method=Method.SEPARATED))
    assert [segment.end for segment in before] == [SegmentEnd.CUSP, SegmentEnd.STAGING_POSE]
    assert [segment.final for segment in before] == [None, None]
    assert (last.end, last.begins_final) == (SegmentEnd.GOAL, True)
    assert last.final is not None
    assert (last.final.objective, last.final.within) == (CartesianPose(), inf)


def test_switched_contours_to_the_paths_end_until_the_pose_alone_counts() -> None:
    config = ControllerConfig(method=Method.SWITCHED)
    first, last = segments_of(PATH, config)
    assert (first.objective, first.final) == (CONTOURING, None)
    assert (last.objective, last.begins_final) == (Contouring(to_goal=False), False)
    assert last.final is not None
    assert (last.final.objective, last.final.within) == (CartesianPose(), config.weights.transition_reach)


def test_nothing_that_drives_asks_for_the_method() -> None:
    root = Path(rti_mpcc.__file__).parent
    asking = {
        file.relative_to(root).parts[0].removesuffix(".py")
        for file in root.rglob("*.py")
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8")))
        if isinstance(node, ast.Attribute) and node.attr == "method"
    }
    assert not asking & {"controller", "ocp", "qp", "model", "behaviour", "safety", "driving", "scouting"}
    assert not asking & {"manoeuvre", "docking", "iteration"}
    assert "baselines" in asking


def test_the_cartesian_objective_knows_the_goal_and_the_effort_only() -> None:
    got = cartesian_weights(Weights(lateral_acceleration=100.0), LENGTHS)
    for none in (
        got.lag,
        got.contouring,
        got.heading,
        got.bound_distance,
        got.bound_speed,
        got.progress_reward,
    ):
        assert not none.any()
    np.testing.assert_allclose(got.goal, 1e4)
    np.testing.assert_allclose(got.acceleration, 1e3)
    np.testing.assert_allclose(got.lateral_acceleration, 100.0)
    assert (got.virtual_speed > 0.0).all()
    assert not got.goal_clipped


def test_a_pose_that_weighs_nothing_still_scales_the_qp() -> None:
    assert cartesian_weights(Weights(goal=(0.0, 0.0, 0.0)), LENGTHS).scale == pytest.approx(1e-3)
