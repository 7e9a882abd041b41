"""The paper's dynamic weights and objectives, and what the methods that it compares make of a path."""

from __future__ import annotations

import ast
from math import exp
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import rti_mpcc
from geometry import Pose2, ReferencePath
from rti_mpcc import ControllerConfig, InputError
from rti_mpcc.config import Weights
from rti_mpcc.errors import ConfigError
from rti_mpcc.manoeuvre import SegmentEnd, segments_of
from rti_mpcc.model.layout import THETA_DOT, V
from rti_mpcc.ocp.bounds import stage_bounds
from rti_mpcc.ocp.frenet import frenet_errors
from rti_mpcc.ocp.objectives import CONTOURING, Target, TargetKind
from rti_mpcc.paper import METHODS, ComparedObjective, PaperObjective, SpeedProfile, with_method
from rti_mpcc.paper.objective import (
    CartesianPose,
    DynamicContouring,
    cartesian_weights,
    dynamic_weights,
    sigma,
)
from rti_mpcc.paper.terms import PaperWeights
from rti_mpcc.qp.pattern import BOUNDED
from rti_mpcc.recording.contents import to_data
from rti_mpcc.types import Array

LENGTHS = np.full(70, 0.1)
PATH = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(1, 0.05, 12.0), (-1, 0.0, 12.0)])
THETAS = np.linspace(0.0, 30.0, 71)
SPEED = int(np.flatnonzero(BOUNDED == V)[0])
PRINTED = PaperObjective()


def target(theta: float = 30.0, end: float = 30.0, kind: TargetKind = TargetKind.POSE) -> Target:
    return Target(pose=Pose2(0.0, 0.0, 0.0), theta=theta, theta_end=end, kind=kind)


END = target(kind=TargetKind.PATH_END)


def contour(goal: Target, theta: Array, paper: PaperObjective = PRINTED, **changes: Any) -> PaperWeights:
    return dynamic_weights(Weights(**changes), paper, goal, theta, LENGTHS, 5.0)


def spread(begin: float, end: float) -> Array:
    return np.linspace(begin, end, 71)


# -- weights -------------------------------------------------------------------------------------------------


def test_sigma_at_its_limits_and_at_beta() -> None:
    weights = Weights(transition_reach=10.0, transition_slope=1.0)
    assert [sigma(at, weights) for at in (10.0, -1e6, 1e6)] == pytest.approx([0.5, 1.0, 0.0])
    assert sigma(8.0, weights) == pytest.approx(1.0 / (1.0 + exp(-2.0)))
    steep = Weights(transition_reach=10.0, transition_slope=3.0)
    assert sigma(11.0, steep) == pytest.approx(1.0 / (1.0 + exp(3.0)))


def test_a_path_end_raises_the_contouring_weight_eq_7() -> None:
    theta = spread(5.0, 30.0)
    got, near = contour(END, theta), 1.0 / (1.0 + np.exp(30.0 - theta - 10.0))
    np.testing.assert_allclose(got.contouring, near * 100.0 + (1.0 - near) * 1.0)
    np.testing.assert_allclose(got.lag, 1e3)
    np.testing.assert_allclose(got.progress_reward, 100.0)
    assert not got.goal.any()


def test_a_goal_beside_the_path_takes_over_by_the_vehicles_own_progress_eq_9_10() -> None:
    theta = spread(15.0, 27.0)
    got, near = contour(target(theta=28.0), theta), 1.0 / (1.0 + np.exp(28.0 - theta - 10.0))
    np.testing.assert_allclose(got.contouring, 1.0 - near)
    np.testing.assert_allclose(got.progress_reward, (1.0 - near[:-1]) * 100.0)
    np.testing.assert_allclose(got.goal, near[0] * 1e4)


@pytest.mark.parametrize("theta", [25.0, 32.0])
def test_behind_the_stop_point_the_path_does_not_count_eq_11(theta: float) -> None:
    at, stop = spread(20.0, 35.0), min(theta, 30.0)
    got = contour(target(theta=theta), at, heading=2.0)
    for weight in (got.lag, got.contouring, got.heading):
        assert not weight[at >= stop].any()
        assert (weight[at < stop] > 0.0).all()


def test_terms_of_the_published_code_are_off_unless_asked_for() -> None:
    theta, plain = spread(5.0, 30.0), contour(END, spread(5.0, 30.0))
    for none in (plain.lateral_acceleration, plain.heading, plain.bound_distance, plain.bound_speed):
        assert not none.any()
    paper = PaperObjective(
        lateral_acceleration=100.0,
        heading_at_end=10.0,
        bound_distance=1e3,
        bound_speed=20.0,
        terminal_lag=1e3,
        terminal_heading=500.0,
    )
    near, got = 1.0 / (1.0 + np.exp(30.0 - theta - 10.0)), contour(END, theta, paper)
    np.testing.assert_allclose(got.lateral_acceleration, 100.0)
    np.testing.assert_allclose(got.heading[:-1], 10.0 * near[:-1])
    np.testing.assert_allclose(got.bound_distance, 1e3 * (1.0 - near))
    np.testing.assert_allclose(got.bound_speed, 20.0)
    assert got.lag[-1] == pytest.approx(plain.lag[-1] + 1e3)
    assert got.heading[-1] == pytest.approx(10.0 * near[-1] + 500.0)


@pytest.mark.parametrize("goal", [END, target(theta=27.0), target(theta=34.0)])
def test_weights_know_how_they_change_with_progress(goal: Target) -> None:
    paper = PaperObjective(heading_at_end=10.0, bound_distance=1e3, stage_length=1.0)
    theta, h = spread(12.0, 29.0) + 1e-4, 1e-6  # no stage at the stop point, where terms end
    got, above, below = (contour(goal, theta + off, paper, heading=1.0) for off in (0.0, h, -h))
    last = slice(0, 70)  # what the last stage counts on top does not change
    for name in ("contouring", "heading", "bound_distance", "progress_reward"):
        slope = (getattr(above, name) - getattr(below, name)) / (2.0 * h)
        np.testing.assert_allclose(getattr(got.by_progress, name)[last], slope[last], rtol=1e-4, atol=1e-6)


def test_the_cartesian_objective_knows_the_goal_and_the_effort_only() -> None:
    got = cartesian_weights(Weights(), LENGTHS, PaperObjective(lateral_acceleration=100.0))
    for none in (got.lag, got.contouring, got.heading, got.bound_distance, got.progress_reward):
        assert not none.any()
    np.testing.assert_allclose(got.goal, 1e4)
    np.testing.assert_allclose(got.acceleration, 1e3)
    np.testing.assert_allclose(got.lateral_acceleration, 100.0)
    assert (got.virtual_speed > 0.0).all()
    assert not got.goal_clipped


# -- bounds and slopes ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("direction", [1, -1])
@pytest.mark.parametrize(("behind", "final"), [(0.0, 1.0), (0.5, 1.0), (8.0, 2.0), (18.0, 3.0)])
def test_the_speed_profile_falls_to_a_share_of_the_speed_that_stops_behind_the_end(
    behind: float, final: float, direction: int
) -> None:
    profile = SpeedProfile(final=1.0, deceleration=1.0, behind=0.5)
    config = ControllerConfig.paper(objective=PaperObjective(speed_profile=profile, progress_reverses=True))
    goal = target(theta=30.0 + behind)
    got = stage_bounds(config, direction, goal.farthest)
    DynamicContouring().bound(got, goal, THETAS, direction, config)
    speed = got.states[:, int(direction > 0), SPEED] * direction
    expected = np.sqrt(final**2 + 2.0 * (30.0 - THETAS[1:]))
    np.testing.assert_allclose(speed, np.minimum(10.0, expected))
    np.testing.assert_allclose(got.controls[:, 1, THETA_DOT], speed)
    np.testing.assert_allclose(got.controls[:, 0, THETA_DOT], -speed)


def test_the_published_code_takes_the_path_to_be_straight_at_each_progress() -> None:
    part, config = PATH.parts[0], ControllerConfig.paper()
    theta = np.array([3.0, 6.0])
    at = DynamicContouring().reference(part, theta, config)
    states = np.random.default_rng(4).uniform(-1.0, 1.0, (2, 6))
    errors = frenet_errors(states, at, 1)
    np.testing.assert_array_equal(errors.values, frenet_errors(states, part.reference(theta), 1).values)
    np.testing.assert_array_equal(errors.slopes[:, :, 5], [[-1.0, 0.0, 0.0]] * 2)


# -- methods -------------------------------------------------------------------------------------------------


def test_a_method_is_an_objective_and_comes_back_from_a_file() -> None:
    plain, paper = ControllerConfig(), ControllerConfig.paper()
    assert with_method(plain, "dynamic") == plain
    assert with_method(paper, "dynamic") == paper
    assert with_method(plain, "switched").objective == ComparedObjective(method="switched")
    separated = with_method(paper, "separated")
    assert separated == paper.changed(objective={"method": "separated"})
    for config in (plain, paper, separated, with_method(plain, "switched")):
        assert ControllerConfig(**to_data(config)) == config
    unknown: Any = {"kind": "Best"}
    with pytest.raises(ConfigError, match="kind = 'Best': must be one of DockingObjective, "):
        ControllerConfig(objective=unknown)


@pytest.mark.parametrize("weight", [1, 50, 100])
def test_constant_weights_are_the_same_everywhere(weight: int) -> None:
    config = with_method(ControllerConfig(), f"constant_{weight}")
    assert config.weights.contouring == config.weights.contouring_at_end == weight
    assert config.objective == PRINTED
    paper = with_method(ControllerConfig.paper(), f"constant_{weight}").objective
    assert paper == ControllerConfig.paper().objective.changed(heading_at_end=0.0)


def test_an_unknown_method_is_refused_with_those_there_are() -> None:
    with pytest.raises(InputError, match=rf"'best': must be one of {', '.join(METHODS)}"):
        with_method(ControllerConfig(), "best")


def test_what_the_methods_make_of_a_path() -> None:
    plain = ControllerConfig()
    segments = segments_of(PATH, plain)
    assert [segment.end for segment in segments] == [SegmentEnd.CUSP, SegmentEnd.GOAL]
    assert {segment.objective for segment in segments} == {CONTOURING}
    *_, stop, last = segments_of(PATH, with_method(plain, "separated"))
    assert (stop.end, stop.objective, last.objective) == (SegmentEnd.CUSP, CONTOURING, CartesianPose())
    assert stop.target is not None
    assert stop.target(PATH.parts[1], None).stop == pytest.approx(PATH.parts[1].end)
    assert stop.target(PATH.parts[1], PATH.parts[1].pose(22.0)).stop == pytest.approx(15.0)
    for config in (plain, ControllerConfig.paper()):
        first, last = segments_of(PATH, with_method(config, "switched"))
        reach = config.weights.transition_reach
        assert first.objective is CONTOURING
        assert not last.objective.arrives
        assert last.objective.successor(1.01 * reach) is None
        assert last.objective.successor(0.99 * reach) == CartesianPose()


def test_what_drives_a_vehicle_does_not_import_the_paper() -> None:
    root = Path(rti_mpcc.__file__).parent
    asking = {
        file.relative_to(root).parts[0].removesuffix(".py")
        for file in root.rglob("*.py")
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8")))
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("rti_mpcc.paper")
    }
    assert asking == {"paper", "cli", "simulation"}
