"""The end of an arrival as a variable of the QP: its derivatives, and where it comes to."""

from __future__ import annotations

from math import inf, pi, sqrt

import numpy as np
import pytest

from geometry import Corridor, Pose2, ReferencePath
from rti_mpcc.config import ControllerConfig, Ride
from rti_mpcc.controller import RtiMpcc
from rti_mpcc.course.guess import Course, arrival_guess
from rti_mpcc.course.speed_profile import speed_profile_of
from rti_mpcc.model.bicycle import linearised_step, rollout
from rti_mpcc.model.layout import A, V
from rti_mpcc.ocp.horizon import PlanStages, stage_lengths, stage_times
from rti_mpcc.ocp.objectives import ArrivalAtRest, StageWeights, arrival_weights, path_end
from rti_mpcc.ocp.stage_cost import LEAST_TIME, EndTime, end_time
from rti_mpcc.types import Array

CONFIG = ControllerConfig()
WHEELBASE = CONFIG.vehicle.wheelbase
N, FIRST = 30, 0.05
STATE = np.array([0.4, -0.2, 0.7, 1.2, 0.2, 0.0])
CONTROLS = np.random.default_rng(3).uniform([-0.6, -0.7, 0.0], [0.6, 0.7, 2.0], (N, 3))
PATH = ReferencePath.from_segments(Pose2(0.0, 0.0, pi / 2), [(1, 0.0, 10.0)])


def weighted(lengths: Array) -> StageWeights:
    weights = CONFIG.weights
    return arrival_weights(weights, path_end(PATH.parts[0]), lengths, (80.0, 60.0, 40.0), 900.0, 0.36)


def found(seconds: float, latest: float = inf) -> tuple[EndTime, Array]:
    lengths = stage_lengths(seconds, FIRST, N)
    states = rollout(STATE, CONTROLS, lengths, WHEELBASE)
    reached = linearised_step(states, CONTROLS, lengths, WHEELBASE).state
    stages = PlanStages(states, CONTROLS, lengths)
    return end_time(stages, reached, weighted(lengths), CONFIG.comfort, WHEELBASE, latest), states


def test_a_stage_is_left_later_where_it_is_longer() -> None:
    """F_T by differences: each stage from its own begin, all but the first stretched alike."""
    got, states = found(7.0)
    lengths, h = stage_lengths(7.0, FIRST, N), 1e-5
    for k in range(N):
        share = 0.0 if k == 0 else lengths[k] / lengths[1:].sum()
        ends = [
            rollout(states[k], CONTROLS[k : k + 1], lengths[k : k + 1] + side * h * share, WHEELBASE)[1]
            for side in (-1.0, 1.0)
        ]
        np.testing.assert_allclose(got.stretches[k], ((ends[1] - ends[0]) / (2.0 * h))[:5], atol=2e-5)


def test_effort_over_a_longer_time_costs_in_proportion_to_it() -> None:
    """dJ/dT with controls kept: what the later stages cost, over the time that they take, and the price."""
    got, _ = found(7.0)
    lengths = stage_lengths(7.0, FIRST, N)
    price = weighted(lengths).time
    assert price == pytest.approx(CONFIG.weights.acceleration * 0.36**2 / 0.1)
    rest = lengths[1:].sum()
    effort = (got.gradient - price) * rest
    least = (9000.0 * CONTROLS[1:, A] ** 2 * lengths[1:]).sum()
    assert effort > least  # what goes beyond comfort comes on top
    assert got.curvature == pytest.approx(2.0 * effort / rest**2)


def test_one_step_changes_the_time_by_a_tenth_and_to_no_less_than_the_least_nor_the_latest() -> None:
    far, late, close = found(8.0)[0], found(8.0, latest=8.2)[0], found(LEAST_TIME)[0]
    assert (far.least, far.most) == pytest.approx((-0.8, 0.8))
    assert (late.least, late.most) == pytest.approx((-0.8, 0.2))
    assert close.least == pytest.approx(0.0, abs=1e-12)
    beyond = found(8.0, latest=6.0)[0]
    assert beyond.least == beyond.most == pytest.approx(-0.8)  # as fast as it may come back


def arrived(ride: Ride, distance: float, speed: float, share: float) -> tuple[float, Array]:
    """Time [s] and accelerations of the plan over a straight that repeated iterations come to; `share`: of
    the expected time, to begin with."""
    config = ControllerConfig(ride=ride)
    path = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(1, 0.0, distance)])
    part, corridor = path.parts[0], Corridor.from_offsets(path, left=4.0, right=-4.0)
    mpcc, state = RtiMpcc(part, corridor, config), np.array([0.0, 0.0, 0.0, speed, 0.0, 0.0])
    seconds = share * in_closed_form(config, distance, speed)
    times = stage_times(0.0, stage_lengths(seconds, config.cycle, config.stages))
    profile = speed_profile_of(part, config)
    guess = arrival_guess(Course(part, path_end(part)), state, times, distance, profile, config)
    for k in range(20):
        plan = guess if k == 0 else None
        mpcc.prepare(0.0, plan=plan, objective=ArrivalAtRest(), damping=1e-4, before=0.0)
        solution = mpcc.feedback(state, 0.0)
        assert solution.solved
    plan = solution.trajectory
    assert abs(plan.states[-1, V]) < 0.01
    assert plan.states[-1, 0] == pytest.approx(distance, abs=0.02)
    return float(plan.times[-1]), plan.controls[:, A]


def in_closed_form(config: ControllerConfig, distance: float, speed: float) -> float:
    """Time with ramps at the comfort jerk: of the cubic that ends at the planned acceleration, or of full
    comfort up and down."""
    if config.ride == "smooth":
        a = config.arrival_acceleration
        return (sqrt(speed**2 + 6.0 * a * distance) - speed) / a + 0.5 * a / config.comfort.jerk
    a = config.comfort_acceleration
    return (2.0 * sqrt(a * distance + 0.5 * speed**2) - speed) / a + a / config.comfort.jerk


@pytest.mark.parametrize("share", [0.75, 1.0, 1.4])
@pytest.mark.parametrize(("distance", "speed"), [(3.0, 0.0), (10.0, 0.0), (10.0, 1.0), (25.0, 0.0)])
@pytest.mark.parametrize("ride", ["smooth", "brisk"])
def test_a_straight_takes_the_time_in_closed_form_whatever_it_begins_with(
    ride: Ride, distance: float, speed: float, share: float
) -> None:
    expected = in_closed_form(ControllerConfig(ride=ride), distance, speed)
    time, accelerations = arrived(ride, distance, speed, share)
    assert time == pytest.approx(expected, rel=0.03)
    assert np.abs(accelerations).max() <= 1.02 * CONFIG.comfort_acceleration
