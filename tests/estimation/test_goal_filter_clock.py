"""The clock: stamps from elsewhere, clocks that are set back, leap ahead or are no clocks at all."""

from __future__ import annotations

from math import inf, nan

import numpy as np
import pytest

from estimation import GoalFilterConfig, GoalStatus, Outcome
from tests.estimation.detections import GOAL, age, numbers, off_by, seen, shifted, stamps, told, tracking

NOT_A_TIME = (nan, inf, -inf, 1e11, -1e300)


@pytest.mark.parametrize(
    ("stamp", "reason"),
    [(1.19, "older than `history`"), (-1e9, "older than `history`"), (2.26, "ahead"), (1e9, "ahead")],
)
def test_a_detection_from_the_future_or_the_distant_past_is_refused(stamp: float, reason: str) -> None:
    goal_filter = tracking()
    goal_filter.predict(2.2)
    before = numbers(goal_filter.estimate(2.2))
    judgement = goal_filter.update(seen(shifted(GOAL, aside=0.01), stamp))
    assert judgement.outcome is Outcome.REFUSED
    assert reason in judgement.reason
    assert np.array_equal(numbers(goal_filter.estimate(2.2)), before)


@pytest.mark.parametrize("now", NOT_A_TIME)
def test_what_is_not_a_time_is_ignored(now: float) -> None:
    goal_filter = tracking()
    before = numbers(goal_filter.estimate(2.0))
    goal_filter.predict(now)
    assert np.array_equal(numbers(goal_filter.estimate(now)), before)
    assert goal_filter.update(seen(shifted(GOAL, aside=0.01), 2.04)).outcome is Outcome.ACCEPTED


def test_a_clock_that_steps_back_a_little_is_waited_for() -> None:
    goal_filter = tracking()
    goal_filter.predict(1.4)
    assert np.array_equal(numbers(goal_filter.estimate(1.4)), numbers(goal_filter.estimate(2.0)))
    ages = []
    for stamp in stamps(10.0, 1.45, 3.0):
        goal_filter.predict(stamp)
        assert goal_filter.update(seen(GOAL, stamp)).outcome is Outcome.ACCEPTED
        estimate = goal_filter.estimate(stamp)
        assert estimate.status is GoalStatus.TRACKING
        ages.append(age(estimate))
    assert min(ages) >= 0.0
    assert off_by(goal_filter.estimate(3.0), GOAL)[0] < 1e-9


@pytest.mark.parametrize("now", [0.9, -3.0, -1e9])
@pytest.mark.parametrize("moving", [False, True])
def test_a_clock_that_is_set_back_keeps_the_estimate(now: float, moving: bool) -> None:
    goal_filter = tracking(GoalFilterConfig(moving=moving))
    goal_filter.predict(2.2)
    before = goal_filter.estimate(2.2)
    goal_filter.predict(now)
    after = goal_filter.estimate(now)
    assert after.status is GoalStatus.TRACKING
    assert numbers(after) == pytest.approx(numbers(before), abs=1e-6)
    # It goes on with the new stamps, and ends on the new clock.
    for stamp in stamps(10.0, now + 0.1, now + 2.1):
        goal_filter.predict(stamp)
        assert goal_filter.update(seen(GOAL, stamp)).outcome is Outcome.ACCEPTED
        estimate = goal_filter.estimate(stamp)
        assert estimate.status is GoalStatus.TRACKING
        assert age(estimate) == 0.0
    last = now + 2.0
    found = [goal_filter.estimate(last + later).status for later in (0.4, 0.6, 2.1)]
    assert found == [GoalStatus.TRACKING, GoalStatus.COASTING, GoalStatus.LOST]


@pytest.mark.parametrize("moving", [False, True])
def test_a_clock_that_leaps_ahead_loses_the_goal_until_it_is_seen_again(moving: bool) -> None:
    goal_filter = tracking(GoalFilterConfig(moving=moving))
    goal_filter.predict(1e9)
    estimate = goal_filter.estimate(1e9)
    assert estimate.status is GoalStatus.LOST
    assert age(estimate) == pytest.approx(1e9, rel=1e-6)
    # Whether the clock stays there or was wrong for a moment.
    for begin in (1e9, 2.5):
        goal = shifted(GOAL, aside=0.02)
        *_, (_, estimate) = told(goal_filter, [seen(goal, begin + 0.1 * k) for k in range(5)])
        assert estimate.status is GoalStatus.TRACKING
        assert off_by(estimate, goal)[0] < 0.01
