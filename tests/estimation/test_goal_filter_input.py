"""What the filter is told and what it hands out: unusable and extreme numbers, ±pi, read-only arrays."""

from __future__ import annotations

from math import inf, nan, pi
from typing import Any

import numpy as np
import pytest

from estimation import GoalFilterConfig, GoalMeasurement, GoalPoseFilter, Outcome
from geometry import Pose2
from tests.estimation.detections import (
    GOAL,
    covariance,
    numbers,
    off_by,
    seen,
    shifted,
    stamps,
    told,
    tracking,
)

GOOD: dict[str, Any] = {"stamp": 2.05, "x": GOAL.x, "y": GOAL.y, "phi": GOAL.phi}
UNUSABLE: list[tuple[str, Any, str]] = [
    *((field, value, "not finite") for field in GOOD for value in (nan, inf, -inf)),
    *((field, value, "beyond") for field in GOOD for value in (1.1e10, -1e300)),
    ("covariance", np.full((3, 3), nan), "not finite"),
    ("covariance", np.diag([1.0, inf, 1.0]), "not finite"),
    ("covariance", np.diag([1e13, 1.0, 1.0]), "not finite"),
    ("covariance", np.zeros((3, 3)), "not positive definite"),
    ("covariance", np.diag([1e-3, 0.0, 1e-3]), "not positive definite"),
    ("covariance", np.diag([1e-3, -1e-3, 1e-3]), "not positive definite"),
    ("covariance", -np.eye(3), "not positive definite"),
    ("covariance", 1e-3 * np.array([[1.0, 2.0, 0.0], [2.0, 1.0, 0.0], [0.0, 0.0, 1.0]]), "positive definite"),
    ("covariance", 1e-3 * np.ones((3, 3)), "not positive definite"),
    ("covariance", 1e-3 * np.array([[1.0, 0.5, 0.0], [0.2, 1.0, 0.0], [0.0, 0.0, 1.0]]), "not symmetric"),
]


@pytest.mark.parametrize(("field", "value", "reason"), UNUSABLE)
def test_an_unusable_detection_is_refused_and_changes_nothing(field: str, value: Any, reason: str) -> None:
    goal_filter, untouched = tracking(), tracking()
    judgement = goal_filter.update(GoalMeasurement(**(GOOD | {field: value})))
    assert judgement.outcome is Outcome.REFUSED
    assert reason in judgement.reason
    assert not judgement.accepted
    assert (judgement.pose, judgement.innovation, judgement.nis) == (None, None, None)
    for one in (goal_filter, untouched):
        one.predict(2.1)
        one.update(seen(GOAL, 2.1))
    assert np.array_equal(numbers(goal_filter.estimate(2.2)), numbers(untouched.estimate(2.2)))


@pytest.mark.parametrize("left", [1e-16, -3e-14, 1e-9])
def test_what_rounding_leaves_beside_the_diagonal_does_not_make_a_covariance_asymmetric(left: float) -> None:
    spread = np.diag([1.0, 4.0, 0.1])
    spread[0, 1] = left
    goal_filter = tracking()
    assert goal_filter.update(GoalMeasurement(**GOOD, covariance=spread)).outcome is not Outcome.REFUSED
    estimate = covariance(goal_filter.estimate(2.1))
    assert np.array_equal(estimate, estimate.T)


@pytest.mark.parametrize("std", [1e-6, 1e-3, 1e3, 1e5])
@pytest.mark.parametrize("far", [1e-6, 1e3, 9e5])
@pytest.mark.parametrize("moving", [False, True])
def test_extreme_but_finite_numbers_are_taken_in(std: float, far: float, moving: bool) -> None:
    goal_filter = GoalPoseFilter(GoalFilterConfig(moving=moving))
    goal = Pose2(far, -far, 0.5 * far)
    given = std**2 * np.array([[1.0, 0.9, 0.0], [0.9, 1.0, 0.0], [0.0, 0.0, 1.0]])
    for stamp in stamps(10.0, 0.0, 1.0):
        goal_filter.predict(stamp)
        goal_filter.update(GoalMeasurement(stamp=stamp, x=goal.x, y=goal.y, phi=goal.phi, covariance=given))
    estimate = goal_filter.estimate(1.0)
    assert off_by(estimate, goal) == pytest.approx((0.0, 0.0), abs=1e-6)
    assert np.array_equal(covariance(estimate), covariance(estimate).T)
    assert np.linalg.eigvalsh(covariance(estimate)).min() > 0.0


@pytest.mark.parametrize("heading", [pi, -pi, 3.12, -3.12, 3.0 * pi])
@pytest.mark.parametrize("moving", [False, True])
def test_detections_on_both_sides_of_pi_give_one_continuous_heading(heading: float, moving: bool) -> None:
    random = np.random.default_rng(2)
    goal = Pose2(1.0, 2.0, heading)
    goal_filter = GoalPoseFilter(GoalFilterConfig(moving=moving))
    run = [seen(goal, stamp, random) for stamp in stamps(10.0, 0.0, 10.0)]
    assert {measurement.phi > 0.0 for measurement in run} == {False, True}
    headings = []
    for _, estimate in told(goal_filter, run):
        if estimate.pose:
            headings.append(estimate.pose.phi)
            assert off_by(estimate, goal)[1] < 0.1
    assert np.abs(np.diff(headings)).max() < 0.1
    assert off_by(goal_filter.estimate(10.0), goal)[1] < 0.02


@pytest.mark.parametrize("moving", [False, True])
def test_arrays_that_are_handed_out_are_read_only(moving: bool) -> None:
    goal_filter = tracking(GoalFilterConfig(moving=moving))
    goal_filter.predict(2.1)
    judgement = goal_filter.update(seen(shifted(GOAL, aside=0.01), 2.1))
    estimate = goal_filter.estimate(2.2)
    arrays = [judgement.innovation, estimate.innovation, estimate.covariance, estimate.velocity]
    assert (estimate.velocity is not None) == moving
    for array in arrays:
        if array is not None:
            with pytest.raises(ValueError, match="read-only"):
                array[0] = 1.0
