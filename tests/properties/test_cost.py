"""The cost divides by weights, comfort values and stage lengths: what holds where these are 0 or tiny."""

from __future__ import annotations

from dataclasses import replace
from math import exp, isfinite

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from geometry import Pose2
from rti_mpcc.config import Comfort, ControllerConfig, Weights
from rti_mpcc.model.layout import CONTROLS, STATES, A, V, X, Y
from rti_mpcc.ocp.bounds import Change, stage_bounds
from rti_mpcc.ocp.horizon import PlanStages
from rti_mpcc.ocp.objectives import (
    FIRM_TIME,
    GOAL_CLIP,
    STAGE_LENGTH,
    StageWeights,
    Target,
    TargetKind,
    arrival_weights,
    contouring_weights,
)
from rti_mpcc.ocp.stage_cost import COMFORT_CLIP, add_goal, quadratic_cost
from rti_mpcc.paper import PaperObjective, SpeedProfile
from rti_mpcc.paper.objective import DynamicContouring, cartesian_weights, dynamic_weights, sigma
from tests.properties.magnitudes import examples, few_examples, from_zero, positive, signed

N, WHEELBASE = 10, 2.875
LENGTHS = np.full(N, 0.1)
THETA = np.linspace(0.0, 5.0, N + 1)
weight = from_zero(1e-6, 1e6)


def target_at(theta: float, kind: TargetKind = TargetKind.POSE) -> Target:
    return Target(pose=Pose2(theta, 0.0, 0.0), theta=theta, theta_end=20.0, kind=kind)


@given(signed(1e-12, 1e6), signed(1e-12, 1e3), positive(1e-3, 1e3), from_zero(1e-3, 1e6))
@example(0.0, 0.0, 1.0, 0.0)
@example(1e6, 1e-12, 1e3, 0.0)
@example(-1e6, 1e-12, 1e3, 0.0)
@examples
def test_the_share_of_the_goal_is_between_0_and_1_and_falls_with_the_distance(
    distance: float, farther: float, slope: float, reach: float
) -> None:
    weights = Weights(transition_slope=slope, transition_reach=reach)
    here, there = (float(sigma(each, weights)) for each in (distance, distance + abs(farther)))
    assert 0.0 <= there <= here <= 1.0
    assert float(sigma(reach, weights)) == pytest.approx(0.5)


@given(weight, weight, weight, weight, st.sampled_from(TargetKind), from_zero(1e-6, 30.0))
@example(0.0, 0.0, 0.0, 0.0, TargetKind.PATH_END, 10.0)
@example(0.0, 0.0, 0.0, 1e3, TargetKind.POSE, 0.0)
@example(0.0, 0.0, 1e4, 1e3, TargetKind.POSE, 2000.0)
@examples
def test_any_weight_may_be_0_and_the_cost_is_still_brought_to_size(
    lag: float, terminal: float, goal: float, effort: float, kind: TargetKind, stop: float
) -> None:
    weights = Weights(lag=lag, goal=(goal, goal, goal), acceleration=effort)
    paper = PaperObjective(terminal_lag=terminal)
    for found in (
        contouring_weights(weights, LENGTHS, 5.0, effort),
        dynamic_weights(weights, paper, target_at(stop, kind), THETA, LENGTHS, 5.0),
        arrival_weights(weights, target_at(stop, kind), LENGTHS, weights.arrival_comfort, effort),
        cartesian_weights(weights, LENGTHS),
    ):
        assert isfinite(found.scale)
        assert found.scale > 0.0
        # Scaled, the largest weight on a state is about 1, so that the solver's tolerance means something.
        largest = max(float(each.max()) for each in (found.lag, found.acceleration, found.goal))
        assert found.scale * largest <= 10.0


@given(positive(1e-6, 300.0))
@example(1e-6)
@example(FIRM_TIME)
@examples
def test_the_effort_of_an_arrival_counts_less_the_nearer_it_is_and_never_more_than_in_full(
    duration: float,
) -> None:
    weights = Weights()
    near, far = (
        arrival_weights(
            weights, target_at(10.0), np.full(N, each / N), weights.arrival_comfort, weights.acceleration
        )
        for each in (duration, 2.0 * duration)
    )
    full = weights.acceleration * duration / N / STAGE_LENGTH
    assert (near.acceleration > 0.0).all()
    assert (near.acceleration <= full * (1.0 + 1e-9)).all()
    assert (near.acceleration <= far.acceleration).all()


def no_weights() -> StageWeights:
    """No weight on anything."""
    weights = Weights(lag=0.0, contouring=0.0, acceleration=0.0, steering_rate=0.0, progress_reward=0.0)
    found = arrival_weights(weights, target_at(10.0), LENGTHS, (0.0, 0.0, 0.0), 0.0)
    return replace(found, goal=np.zeros(3), goal_speed=0.0)


def slope_of_comfort(acceleration: float, comfort: float) -> tuple[float, float]:
    """Gradient and Hessian of what goes beyond a comfort acceleration [m/s²], of weight 1."""
    weights = no_weights()
    weights = replace(weights, comfort=weights.comfort._replace(acceleration=np.ones(N)))
    states, controls = np.zeros((N + 1, STATES)), np.zeros((N, CONTROLS))
    controls[:, A] = acceleration
    cost = quadratic_cost(states, controls, weights, None, Comfort(comfort, 1.0, 1.0, 1.0), WHEELBASE)
    return float(cost.control_gradient[0, A]), float(cost.control_hessian[0, A])


@given(signed(1e-12, 1e3), positive(1e-6, 1e3))
@example(0.0, 0.4)
@example(1e3, 1e-6)
@example(0.4, 0.4)
@examples
def test_what_goes_beyond_comfort_costs_linearly_at_most_and_pulls_back(
    acceleration: float, comfort: float
) -> None:
    gradient, hessian = slope_of_comfort(acceleration, comfort)
    assert gradient * acceleration >= 0.0
    assert abs(gradient) <= 2.0 * COMFORT_CLIP * (1.0 + 1e-9)
    assert 0.0 <= hessian <= 2.0 * (1.0 + 1e-9)


@given(from_zero(1e-6, 10.0), st.floats(1.0, 3.0))
@example(0.0, 2.0)
@examples
def test_the_more_an_acceleration_goes_beyond_comfort_the_stronger_the_pull(
    value: float, more: float
) -> None:
    here, there = (slope_of_comfort(each, 0.4)[0] for each in (value, more * value))
    # Where the penalty sets in it is a quarter of a percent of its rounding, or nothing.
    assert there >= here - 1e-4
    if value >= 0.4 + 0.02 * 6.0:
        assert here == pytest.approx(2.0 * min(value - 0.4, 0.1), rel=exp(-5.0))


@given(signed(1e-15, 1e6), signed(1e-15, 1e6))
@example(0.0, 0.0)
@example(1e6, 0.0)
@examples
def test_the_pull_of_a_goal_is_bounded_however_far_it_is_and_none_where_the_plan_ends_there(
    x: float, y: float
) -> None:
    weights = replace(no_weights(), goal=np.ones(3), goal_clipped=True)
    states, controls = np.zeros((N + 1, STATES)), np.zeros((N, CONTROLS))
    cost = quadratic_cost(states, controls, weights, None, Comfort(0.4, 1.0, 0.5, 1.0), WHEELBASE)
    add_goal(cost, weights, states[-1], np.array([x, y, 0.0]))
    pull = -cost.state_gradient[-1, [X, Y]]
    assert np.hypot(*pull) == pytest.approx(2.0 * min(float(np.hypot(x, y)), GOAL_CLIP[0]))
    assert pull @ (x, y) >= 0.0


@given(
    signed(1e-9, 30.0), signed(1e-9, 10.0), positive(1e-3, 1e3), from_zero(1e-3, 15.0), positive(1e-3, 100.0)
)
@example(0.0, 0.0, 1.0, 0.0, 5.0)
@example(10.0, 5.0, 1e-3, 0.0, 5.0)
@few_examples
def test_bounds_leave_a_control_and_a_speed_whatever_came_before(
    speed: float, before: float, jerk: float, left: float, deceleration: float
) -> None:
    profile = SpeedProfile(final=1e-3, deceleration=deceleration)
    config = ControllerConfig(comfort_jerk=jerk, objective=PaperObjective(speed_profile=profile))
    states, target = np.zeros((N + 1, STATES)), target_at(5.0 + left)
    states[:, V] = speed
    change = Change(before, PlanStages(states, np.zeros((N, CONTROLS)), LENGTHS), target.theta)
    bounds = stage_bounds(config, 1, target.farthest, np.full(N, np.inf), change=change)
    DynamicContouring().bound(bounds, target, THETA, 1, config)
    assert (bounds.states[:, 0] <= bounds.states[:, 1]).all()
    assert (bounds.controls[:, 0] <= bounds.controls[:, 1]).all()
    assert (bounds.controls[:, 1, A] <= config.limits.acceleration).all()
    highest = np.sqrt(1e-6 + 2.0 * deceleration * (target.stop - THETA[1:]))
    np.testing.assert_allclose(bounds.states[:, 1, 0], np.minimum(highest, config.limits.speed))
