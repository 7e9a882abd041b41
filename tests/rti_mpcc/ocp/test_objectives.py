from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from geometry import Pose2
from rti_mpcc.config import Weights
from rti_mpcc.ocp.objectives import StageWeights, Target, TargetKind, arrival_weights, contouring_weights

LENGTHS = np.full(70, 0.1)
EFFORT, COMFORT = Weights().acceleration, Weights().arrival_comfort
TARGET = Target(pose=Pose2(0.0, 0.0, 0.0), theta=30.0, theta_end=30.0, kind=TargetKind.POSE)


def test_a_cruise_has_table_i_far_from_the_end() -> None:
    got = contouring_weights(Weights(heading=2.0), LENGTHS, 5.0, EFFORT)
    np.testing.assert_allclose(got.lag, 1e3)
    np.testing.assert_allclose(got.contouring, 1.0)
    np.testing.assert_allclose(got.heading, 2.0)
    np.testing.assert_allclose(got.progress_reward, 100.0)
    assert not got.goal.any()


def test_stages_count_by_their_length() -> None:
    lengths = np.linspace(0.05, 0.7, 70)
    got = contouring_weights(Weights(), lengths, 5.0, EFFORT)
    np.testing.assert_allclose(got.acceleration, 1e3 * lengths / 0.1)
    np.testing.assert_allclose(got.lag[:-1], 1e3 * lengths / 0.1)
    assert got.lag[-1] == pytest.approx(1e3 * 7.0)


def test_an_open_progress_weight_has_its_best_at_the_cruise_speed() -> None:
    """d/ds (r s² - gamma s) = 0 at s = cruise speed; a weight of 0 is Table I's."""
    got = contouring_weights(Weights(virtual_speed=None), LENGTHS, 5.0, EFFORT)
    np.testing.assert_allclose(got.progress_reward / (2.0 * got.virtual_speed), 5.0)
    assert not contouring_weights(Weights(virtual_speed=0.0), LENGTHS, 5.0, EFFORT).virtual_speed.any()


def test_an_arrival_holds_pose_and_speed_at_its_end_and_leaves_the_path() -> None:
    weights = Weights()
    got = arrival_weights(weights, TARGET, np.full(70, 0.3), COMFORT, EFFORT)
    np.testing.assert_allclose(got.goal, weights.arrival_pose * np.array([1.0, 1.0, 10.0]))
    assert got.goal_speed == weights.arrival_speed
    assert got.goal_clipped
    for unused in (got.lag, got.contouring, got.heading, got.progress_reward, got.virtual_speed):
        assert not unused.any()
    assert (got.acceleration > 0.0).all()
    assert (got.steering_rate > 0.0).all()


def test_the_wheels_count_where_the_target_has_an_angle_only() -> None:
    for wheels, share, counts in ((0.3, 1.0, 1.0), (0.0, 0.5, 0.5), (None, 1.0, 0.0)):
        got = arrival_weights(
            Weights(), replace(TARGET, wheels=wheels, wheels_share=share), LENGTHS, COMFORT, EFFORT
        )
        assert got.goal_wheels == counts * Weights().arrival_wheels


@pytest.mark.parametrize(
    "got",
    [
        arrival_weights(Weights(), TARGET, LENGTHS, COMFORT, EFFORT),
        contouring_weights(Weights(), LENGTHS, 5.0, EFFORT),
    ],
)
def test_the_slack_weight_exceeds_the_largest_pull(got: StageWeights) -> None:
    """Exactness of the penalty: the clipped goal's gradient and the progress reward together."""
    assert got.slack > 2.0 * got.goal[0] * 0.5
    assert got.scale * max(got.lag.max(), got.goal[:2].max()) == pytest.approx(1.0, rel=0.5)
