"""Time: staleness, detections that come late or in any order, and the same one again."""

from __future__ import annotations

from math import nan
from typing import Any

import numpy as np
import pytest

from estimation import Frame, GoalFilterConfig, GoalMeasurement, GoalPoseFilter, GoalStatus, Outcome
from geometry import Pose2
from tests.estimation.detections import (
    GOAL,
    age,
    covariance,
    kept,
    numbers,
    seen,
    shifted,
    stamps,
    told,
    tracking,
)


@pytest.mark.parametrize(
    ("after", "status"),
    [
        (0.0, GoalStatus.TRACKING),
        (0.5, GoalStatus.TRACKING),
        (0.501, GoalStatus.COASTING),
        (2.0, GoalStatus.COASTING),
        (2.001, GoalStatus.LOST),
        (1e6, GoalStatus.LOST),
    ],
)
@pytest.mark.parametrize("tell", [False, True])
def test_the_status_follows_from_the_age(after: float, status: GoalStatus, tell: bool) -> None:
    goal_filter = tracking()
    if tell:
        goal_filter.predict(2.0 + after)
    estimate = goal_filter.estimate(2.0 + after)
    assert estimate.status is status
    assert age(estimate) == pytest.approx(after, rel=1e-9)


def test_rejected_detections_do_not_make_the_estimate_younger() -> None:
    goal_filter = tracking()
    for k, stamp in enumerate(stamps(10.0, 2.1, 3.1)):
        goal_filter.predict(stamp)
        goal_filter.update(seen(shifted(GOAL, along=3.0 + k), stamp))
    assert goal_filter.estimate(3.1).status is GoalStatus.COASTING
    assert age(goal_filter.estimate(3.1)) == pytest.approx(1.1)


def test_the_covariance_of_a_static_goal_grows_by_drift_squared_per_second() -> None:
    config = GoalFilterConfig(position_drift=0.03, heading_drift=0.02)
    goal_filter = tracking(config)
    start = covariance(goal_filter.estimate(2.0))
    for seconds in (0.3, 1.0, 7.0, 1000.0):
        grown = covariance(goal_filter.estimate(2.0 + seconds)) - start
        assert grown == pytest.approx(seconds * np.diag([9e-4, 9e-4, 4e-4]), rel=1e-9, abs=1e-12)


def test_after_lost_one_detection_where_it_was_is_the_goal() -> None:
    goal_filter = tracking(GoalFilterConfig())
    ((judged, estimate),) = told(goal_filter, [seen(GOAL, 5.0)])
    assert (judged.outcome, estimate.status) == (Outcome.ACCEPTED, GoalStatus.TRACKING)


def test_asking_changes_nothing() -> None:
    asked, alone = tracking(), tracking()
    for now in (2.0, 1e9, 2.3, -5.0, nan, 1e300):
        asked.estimate(now)
    for one in (asked, alone):
        one.predict(2.4)
        one.update(seen(shifted(GOAL, aside=0.05), 2.4))
    assert np.array_equal(numbers(asked.estimate(2.5)), numbers(alone.estimate(2.5)))
    assert np.array_equal(numbers(asked.estimate(9.0)), numbers(asked.estimate(9.0)))


def jumping(seed: int, dropouts: float) -> list[GoalMeasurement]:
    """8 s at 10 Hz with single outliers, a ghost for 0.4 s at 3 s, and a new place from 5 s on."""
    random = np.random.default_rng(seed)
    run = []
    for stamp in kept(stamps(10.0, 0.0, 8.0), random, dropouts):
        place = shifted(GOAL, aside=2.0) if 3.0 <= stamp < 3.4 else GOAL
        place = shifted(GOAL, along=-1.5, turn=0.3) if stamp >= 5.0 else place
        if stamp > 1.0 and random.random() < 0.05:
            place = shifted(place, along=1.0)
        run.append(seen(place, stamp, random))
    return run


@pytest.mark.parametrize("moving", [False, True])
@pytest.mark.parametrize("dropouts", [0.0, 0.6])
def test_the_order_of_arrival_does_not_matter(moving: bool, dropouts: float) -> None:
    """Delays of up to 0.9 s, less than `history`; across the gate and a re-acquisition."""
    config = GoalFilterConfig(moving=moving)
    for seed in range(3):
        run = jumping(seed, dropouts)
        in_order, mixed = GoalPoseFilter(config), GoalPoseFilter(config)
        outcomes = [judgement.outcome for judgement, _ in told(in_order, run)]
        assert outcomes.count(Outcome.ACQUIRED) >= 2
        delays = np.random.default_rng(50 + seed).uniform(0.0, 0.9, len(run))
        arrivals = sorted(zip(delays, run, strict=True), key=lambda item: item[0] + item[1].stamp)
        assert [measurement for _, measurement in arrivals] != run
        for delay, measurement in arrivals:
            mixed.predict(measurement.stamp + delay)
            assert mixed.update(measurement).outcome is not Outcome.REFUSED
        one, other = in_order.estimate(9.0), mixed.estimate(9.0)
        assert one.status is other.status
        assert numbers(other) == pytest.approx(numbers(one), rel=1e-12, abs=1e-12)


@pytest.mark.parametrize("back", [0.0, 0.5, 1.0])
def test_a_detection_that_is_told_again_is_refused(back: float) -> None:
    """Also the oldest that is not too old yet, exactly at the end of `history`."""
    goal_filter = GoalPoseFilter(GoalFilterConfig(history=1.0))
    for _ in told(goal_filter, [seen(GOAL, 0.125 * k) for k in range(17)]):
        pass
    before = numbers(goal_filter.estimate(2.0))
    judgement = goal_filter.update(seen(GOAL, 2.0 - back))
    assert (judgement.outcome, judgement.reason) == (Outcome.REFUSED, "told already")
    assert np.array_equal(numbers(goal_filter.estimate(2.0)), before)


def test_a_detection_from_the_vehicle_told_again_with_a_better_vehicle_pose_is_refused() -> None:
    """A controller that looks the vehicle pose up may find another one in the next cycle."""
    goal_filter = GoalPoseFilter()
    goal_filter.predict(1.0)
    given: dict[str, Any] = {"stamp": 1.0, "x": 5.0, "y": 0.1, "phi": 0.2, "frame": Frame.VEHICLE}
    first = goal_filter.update(GoalMeasurement(**given, vehicle=Pose2(1.0, 2.0, 0.3)))
    second = goal_filter.update(GoalMeasurement(**given, vehicle=Pose2(1.01, 2.0, 0.3)))
    assert (first.outcome, second.outcome) == (Outcome.REJECTED, Outcome.REFUSED)
    assert second.reason == "told already"
