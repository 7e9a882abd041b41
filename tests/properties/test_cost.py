"""The cost divides by weights, comfort values and stage lengths: what holds where these are 0 or tiny."""

from __future__ import annotations

from math import isfinite

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from geometry import Pose2
from rti_mpcc.baselines import cartesian_weights
from rti_mpcc.config import Weights
from rti_mpcc.ocp.objectives import arrival_weights, contouring_weights, sigma
from rti_mpcc.ocp.targets import Target, TargetKind
from tests.properties.magnitudes import examples, from_zero, positive, signed

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


@given(weight, weight, weight, weight, st.sampled_from(TargetKind), st.booleans(), from_zero(1e-6, 30.0))
@example(0.0, 0.0, 0.0, 0.0, TargetKind.PATH_END, False, 10.0)
@example(0.0, 0.0, 0.0, 1e3, TargetKind.POSE, True, 0.0)
@example(0.0, 0.0, 1e4, 1e3, TargetKind.POSE, True, 2000.0)
@examples
def test_any_weight_may_be_0_and_the_cost_is_still_brought_to_size(
    lag: float, terminal: float, goal: float, effort: float, kind: TargetKind, allocate: bool, stop: float
) -> None:
    weights = Weights(lag=lag, terminal_lag=terminal, goal=(goal, goal, goal), acceleration=effort)
    for found in (
        contouring_weights(
            weights,
            target_at(stop, kind),
            THETA,
            LENGTHS,
            cruise_speed=5.0,
            clip_goal=True,
            allocate=allocate,
        ),
        arrival_weights(weights, target_at(stop, kind), THETA, LENGTHS),
        cartesian_weights(weights, LENGTHS),
    ):
        assert isfinite(found.scale)
        assert found.scale > 0.0
        # Scaled, the largest weight on a state is about 1, so that the solver's tolerance means something.
        largest = max(float(each.max()) for each in (found.lag, found.acceleration, found.goal))
        assert found.scale * largest <= 10.0
