from __future__ import annotations

from math import exp

import numpy as np
import pytest

from geometry import Pose2
from rti_mpcc.config import Weights
from rti_mpcc.ocp.objectives import (
    StageWeights,
    arrival_weights,
    contouring_weights,
    sigma,
)
from rti_mpcc.ocp.targets import Target, TargetKind
from rti_mpcc.types import Array

LENGTHS = np.full(70, 0.1)


def target(theta: float = 30.0, end: float = 30.0, kind: TargetKind = TargetKind.POSE) -> Target:
    return Target(pose=Pose2(0.0, 0.0, 0.0), theta=theta, theta_end=end, kind=kind)


def contour(weights: Weights, goal: Target, theta: Array, lengths: Array = LENGTHS) -> StageWeights:
    return contouring_weights(weights, goal, theta, lengths, cruise_speed=5.0, clip_goal=False)


def spread(begin: float, end: float) -> Array:
    return np.linspace(begin, end, 71)


def test_sigma_at_its_limits_and_at_beta() -> None:
    weights = Weights(transition_reach=10.0, transition_slope=1.0)
    assert sigma(10.0, weights) == pytest.approx(0.5)
    assert sigma(-1e6, weights) == 1.0
    assert sigma(1e6, weights) == 0.0
    assert sigma(8.0, weights) == pytest.approx(1.0 / (1.0 + exp(-2.0)))
    assert sigma(11.0, Weights(transition_reach=10.0, transition_slope=3.0)) == pytest.approx(
        1.0 / (1.0 + exp(3.0))
    )
    assert (np.diff(sigma(np.linspace(0.0, 30.0, 100), weights)) < 0.0).all()


def test_a_path_end_raises_the_contouring_weight_eq_7() -> None:
    weights, theta = Weights(lag=1e3, contouring=1.0, contouring_at_end=100.0), spread(5.0, 30.0)
    got = contour(weights, target(kind=TargetKind.PATH_END), theta)
    near = 1.0 / (1.0 + np.exp(30.0 - theta - 10.0))
    np.testing.assert_allclose(got.contouring, near * 100.0 + (1.0 - near) * 1.0)
    np.testing.assert_allclose(got.lag, 1e3)
    np.testing.assert_allclose(got.progress_reward, weights.progress_reward)
    assert (got.goal == 0.0).all()


def test_a_goal_pose_takes_over_from_the_path_eq_9_and_10() -> None:
    weights, theta = Weights(lag=1e3, contouring=1.0, goal=(1e4, 1e4, 1e4)), spread(15.0, 27.0)
    got = contour(weights, target(theta=28.0), theta)
    near = 1.0 / (1.0 + np.exp(28.0 - theta - 10.0))
    np.testing.assert_allclose(got.contouring, (1.0 - near) * 1.0)
    np.testing.assert_allclose(got.progress_reward, (1.0 - near[:-1]) * weights.progress_reward)
    # Eq. 10: blended by the vehicle's own progress, not the last stage's.
    np.testing.assert_allclose(got.goal, near[0] * 1e4)
    np.testing.assert_allclose(got.lag, 1e3)


def test_behind_the_path_end_the_frenet_costs_are_off_eq_11() -> None:
    theta = spread(20.0, 34.0)
    got = contour(Weights(heading=2.0), target(theta=32.0, end=30.0), theta)
    past = theta >= 30.0
    assert past.any()
    assert (got.lag[past] == 0.0).all()
    assert (got.contouring[past] == 0.0).all()
    assert (got.heading[past] == 0.0).all()
    assert (got.lag[~past] > 0.0).all()
    # The path counts to min(theta_e, theta_g), and so does the distance that weights follow.
    near = 1.0 / (1.0 + np.exp(30.0 - 20.0 - 10.0))
    assert got.goal[0] == pytest.approx(near * 1e4)


def test_the_goal_beside_the_path_ends_the_frenet_costs_at_its_projection() -> None:
    theta = spread(20.0, 30.0)
    got = contour(Weights(), target(theta=25.0, end=30.0), theta)
    np.testing.assert_array_equal(got.lag > 0.0, theta < 25.0)


def test_terms_of_the_published_code_switch_on_one_by_one() -> None:
    theta, end = spread(20.0, 30.0), target(kind=TargetKind.PATH_END)
    plain = contour(Weights(), end, theta)
    assert not plain.lateral_acceleration.any()
    assert not plain.heading.any()
    assert not plain.bound_distance.any()
    assert not plain.bound_speed.any()
    assert contour(Weights(lateral_acceleration=100.0), end, theta).lateral_acceleration[5] == 100.0
    near = 1.0 / (1.0 + np.exp(30.0 - theta - 10.0))
    np.testing.assert_allclose(contour(Weights(heading_at_end=10.0), end, theta).heading, 10.0 * near)
    walls = contour(Weights(bound_distance=1e3, bound_speed=20.0), end, theta)
    np.testing.assert_allclose(walls.bound_distance, 1e3 * (1.0 - near))
    np.testing.assert_allclose(walls.bound_speed, 20.0)
    last = contour(Weights(terminal_lag=1e3, terminal_heading=500.0), end, theta)
    assert last.lag[-1] == pytest.approx(plain.lag[-1] + 1e3)
    assert last.heading[-1] == pytest.approx(500.0)
    np.testing.assert_allclose(last.lag[:-1], plain.lag[:-1])


@pytest.mark.parametrize(
    "goal",
    [
        target(kind=TargetKind.PATH_END),
        target(theta=27.0),
        target(theta=34.0),
    ],
)
def test_weights_know_how_they_change_with_progress(goal: Target) -> None:
    weights = Weights(heading=1.0, heading_at_end=10.0, bound_distance=1e3, stage_length=1.0)
    theta, h = spread(12.0, 29.0) + 1e-4, 1e-6  # no stage at the stop point, where terms end
    got = contour(weights, goal, theta).by_progress
    assert got is not None
    above, below = contour(weights, goal, theta + h), contour(weights, goal, theta - h)
    last = slice(0, 70)  # what the last stage counts on top does not change
    for name in ("contouring", "heading", "bound_distance", "progress_reward"):
        slope = (getattr(above, name) - getattr(below, name)) / (2.0 * h)
        np.testing.assert_allclose(getattr(got, name)[last], slope[last], rtol=1e-4, atol=1e-6)
    assert (
        contouring_weights(
            weights, goal, theta, LENGTHS, cruise_speed=5.0, clip_goal=False, allocate=False
        ).by_progress
        is None
    )


def test_stages_count_by_their_length() -> None:
    lengths = np.linspace(0.05, 0.7, 70)
    got = contour(Weights(stage_length=0.1), target(kind=TargetKind.PATH_END), spread(0.0, 5.0), lengths)
    np.testing.assert_allclose(got.acceleration, 1e3 * lengths / 0.1)
    np.testing.assert_allclose(got.lag[:-1], 1e3 * lengths / 0.1)
    assert got.lag[-1] == pytest.approx(1e3 * 7.0)


def test_an_open_progress_weight_has_its_best_at_the_cruise_speed() -> None:
    """d/ds (r s² - gamma s) = 0 at s = cruise speed; a weight of 0 is Table I's."""
    theta, end = spread(0.0, 5.0), target(theta=100.0, end=100.0)
    got = contour(Weights(virtual_speed=None), end, theta)
    np.testing.assert_allclose(got.progress_reward / (2.0 * got.virtual_speed), 5.0)
    assert not contour(Weights(virtual_speed=0.0), end, theta).virtual_speed.any()


def test_an_arrival_holds_pose_and_speed_at_its_end_and_leaves_the_path() -> None:
    weights = Weights()
    got = arrival_weights(weights, target(theta=32.0, end=30.0), spread(0.0, 30.0), np.full(70, 0.3))
    np.testing.assert_allclose(got.goal, weights.arrival_pose)
    assert got.goal_speed == weights.arrival_speed
    assert got.goal_clipped
    for unused in (got.lag, got.contouring, got.heading, got.progress_reward, got.virtual_speed):
        assert not unused.any()
    assert (got.acceleration > 0.0).all()
    assert (got.steering_rate > 0.0).all()


def test_an_arrival_can_keep_to_the_path_far_from_the_goal() -> None:
    theta = spread(0.0, 30.0)
    got = arrival_weights(Weights(arrival_contouring=1.0), target(), theta, LENGTHS)
    assert got.contouring[0] == pytest.approx(1.0, abs=1e-6)
    assert got.contouring[-1] == 0.0
    assert (np.diff(got.contouring) <= 0.0).all()
    assert (got.lag[got.contouring > 0.0] > 0.0).all()


@pytest.mark.parametrize("arriving", [True, False])
def test_the_slack_weight_exceeds_the_largest_pull(arriving: bool) -> None:
    """Exactness of the penalty: the clipped goal's gradient and the progress reward together."""
    weights, theta = Weights(), spread(29.0, 30.0)
    if arriving:
        got = arrival_weights(weights, target(), theta, LENGTHS)
    else:
        got = contouring_weights(weights, target(), theta, LENGTHS, cruise_speed=5.0, clip_goal=True)
    pull = 2.0 * got.goal[0] * 0.5
    assert got.slack > pull
    assert got.scale * max(got.lag.max(), got.goal.max()) == pytest.approx(1.0, rel=0.5)
