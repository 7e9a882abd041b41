"""What the filter takes for the goal: acquisition, the gate, jumps, drop-outs, and its use of covariances."""

from __future__ import annotations

from math import cos, pi, sin

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import chi2

from estimation import GoalFilterConfig, GoalMeasurement, GoalPoseFilter, GoalStatus, Judgement, Outcome
from tests.estimation.detections import (
    GOAL,
    age,
    kept,
    numbers,
    off_by,
    pose,
    seen,
    shifted,
    stamps,
    told,
    tracking,
)
from tests.lists import some_of

RATES = (1.0, 2.0, 5.0, 10.0, 20.0, 50.0)
BURST_LENGTH = 1.0  # [s]
JUMPS = [(rate, dropouts, moving) for rate in RATES for dropouts in (0.0, 0.6) for moving in (False, True)]
"""Rate of the detector [1/s], share of its drop-outs, filter for a goal that moves."""


def before_a_jump(rate: float) -> float:
    """Enough time to see the goal well, also with drop-outs [s]."""
    return 20.0 if rate < 5.0 else 4.0


def seeds(rate: float) -> range:
    """Slow detectors are cheap."""
    return range(20 if rate < 5.0 else 5 if rate < 20.0 else 3)


def test_the_goal_is_searched_for_until_two_detections_agree() -> None:
    goal_filter = GoalPoseFilter()
    assert goal_filter.estimate(0.0).status is GoalStatus.SEARCHING
    (first, before), (second, after) = told(goal_filter, [seen(GOAL, 0.0), seen(GOAL, 0.1)])
    assert (first.outcome, second.outcome) == (Outcome.REJECTED, Outcome.ACQUIRED)
    assert "1 of 2" in first.reason
    assert (before.status, before.pose, before.covariance, before.age) == (GoalStatus.SEARCHING, *[None] * 3)
    assert (after.status, age(after)) == (GoalStatus.TRACKING, 0.0)
    assert off_by(after, GOAL) == pytest.approx((0.0, 0.0), abs=1e-12)


def test_among_outliers_two_that_agree_by_chance_are_not_the_goal() -> None:
    """They have to be half of what was seen meanwhile; two in a row always are."""
    goal_filter = GoalPoseFilter()
    run = [GOAL, *(shifted(GOAL, along=3.0 * k) for k in (1, 2, 3)), GOAL, GOAL]
    outcomes = [
        judgement.outcome
        for judgement, _ in told(goal_filter, [seen(place, 0.1 * k) for k, place in enumerate(run)])
    ]
    assert outcomes == [*[Outcome.REJECTED] * 5, Outcome.ACQUIRED]


def test_reset_forgets_everything() -> None:
    goal_filter = tracking()
    goal_filter.reset()
    assert goal_filter.estimate(2.0).status is GoalStatus.SEARCHING
    # The clock too: earlier stamps are welcome again.
    (_, (judgement, estimate)) = told(goal_filter, [seen(GOAL, -50.0), seen(GOAL, -49.9)])
    assert judgement.outcome is Outcome.ACQUIRED
    assert age(estimate) == 0.0


@pytest.mark.parametrize("moving", [False, pytest.param(True, marks=pytest.mark.acceptance)])
def test_single_outliers_are_ignored(moving: bool) -> None:
    for seed in range(3):
        random = np.random.default_rng(seed)
        clean, soiled = (GoalPoseFilter(GoalFilterConfig(moving=moving)) for _ in range(2))
        outliers = 0
        for stamp in stamps(20.0, 0.0, 20.0):
            for goal_filter in (clean, soiled):
                goal_filter.predict(stamp)
            measurement = seen(GOAL, stamp, random)
            if stamp > 1.0 and random.random() < 0.02:
                outliers += 1
                direction = random.uniform(0.0, 2.0 * pi)
                outlier = shifted(GOAL, along=cos(direction), aside=sin(direction))
                assert soiled.update(seen(outlier, stamp, random)).outcome is Outcome.REJECTED
            else:
                clean.update(measurement)
                soiled.update(measurement)
            if stamp > 1.0:
                before, after = (numbers(one.estimate(stamp))[:15] for one in (clean, soiled))
                assert after == pytest.approx(before, abs=1e-9)
        assert outliers >= 2


@pytest.mark.parametrize(("rate", "dropouts", "moving"), some_of(JUMPS, 3))
def test_a_jump_for_a_second_is_ignored(rate: float, dropouts: float, moving: bool) -> None:
    """Unless the goal was last seen so long ago that it is LOST before the jump is over.

    Then two detections that agree are all there is. At 5 Hz with 60 % drop-outs that is 2 % of the cases.
    """
    tried, begin = 0, before_a_jump(rate)
    for seed in seeds(rate):
        random = np.random.default_rng(seed)
        times = kept(stamps(rate, 0.0, begin + 2.5), random, dropouts)
        if not any(begin - 1.5 <= stamp < begin for stamp in times):
            continue
        tried += 1
        clean, jumped = (GoalPoseFilter(GoalFilterConfig(moving=moving)) for _ in range(2))
        for stamp in times:
            measurement = seen(GOAL, stamp, random)
            for goal_filter in (clean, jumped):
                goal_filter.predict(stamp)
            if begin <= stamp < begin + BURST_LENGTH:
                jumped.update(seen(shifted(GOAL, aside=2.0), stamp, random))
            else:
                clean.update(measurement)
                jumped.update(measurement)
            moved = off_by(jumped.estimate(stamp), pose(clean.estimate(stamp)))[0] if stamp >= begin else 0.0
            # Afterwards the two may have lost the goal, and begun afresh, at different times.
            assert moved < (0.001 if stamp < begin + BURST_LENGTH or not dropouts else 0.1)
    assert tried >= 2


@pytest.mark.parametrize(("rate", "dropouts", "moving"), some_of(JUMPS, 3))
def test_a_jump_for_good_is_followed(rate: float, dropouts: float, moving: bool) -> None:
    """Within 2.5 s of the first detection there, if there is one more between 1.8 and 2.5 s after it.

    It waits for 1.8 s, so that a burst of false detections for a second is over by then.
    """
    tried, begin = 0, before_a_jump(rate)
    goal = shifted(GOAL, along=1.2, aside=-1.6)
    for seed in seeds(rate):
        random = np.random.default_rng(300 + seed)
        times = kept(stamps(rate, 0.0, begin + 4.0), random, dropouts)
        there = [stamp for stamp in times if stamp >= begin]
        if not any(1.8 <= stamp - there[0] <= 2.5 for stamp in there):
            continue
        tried += 1
        goal_filter = GoalPoseFilter(GoalFilterConfig(moving=moving))
        run = [seen(GOAL if stamp < begin else goal, stamp, random) for stamp in times]
        judged = [step for step in told(goal_filter, run) if step[0].stamp >= begin]
        ((found, estimate),) = [step for step in judged if step[0].outcome is Outcome.ACQUIRED]
        assert found.stamp - there[0] <= 2.5
        if not dropouts and rate >= 2.0:
            assert 1.2 <= found.stamp - there[0] <= 2.3
        assert off_by(estimate, goal)[0] < 0.25
    assert tried >= 2


@pytest.mark.parametrize("rate", [2.0, 5.0, 10.0, 14.0, 20.0, 50.0])
def test_a_ghost_that_is_seen_in_turn_with_the_goal_never_takes_over(rate: float) -> None:
    goal_filter, ghost = tracking(), shifted(GOAL, aside=2.0)
    for k, stamp in enumerate(stamps(rate, 2.1, 6.1)):
        goal_filter.predict(stamp)
        goal_filter.update(seen(ghost if k % 2 else GOAL, stamp))
        assert off_by(goal_filter.estimate(stamp), GOAL)[0] < 1e-9


Array = NDArray[np.float64]
COVARIANCE = np.diag([0.05**2, 0.03**2, 0.02**2])


def judged(offset: Array, share: float) -> Judgement:
    """What becomes of a detection `offset` (3,) standard deviations from a known goal; `share`: the gate."""
    known = GoalPoseFilter(GoalFilterConfig(gate=share))
    for k in range(10):
        known.update(GoalMeasurement(stamp=0.1 * k, x=1.0, y=2.0, phi=0.3, covariance=COVARIANCE))
    x, y, phi = np.array([1.0, 2.0, 0.3]) + offset * np.sqrt(np.diag(COVARIANCE))
    return known.update(GoalMeasurement(stamp=1.0, x=x, y=y, phi=phi, covariance=COVARIANCE))


@pytest.mark.parametrize("share", [0.9, 0.99, 0.999])
@pytest.mark.parametrize("direction", [(1.0, 0.0, 0.0), (0.0, 0.6, 0.8), (0.6, -0.5, 0.6)])
def test_a_detection_passes_the_gate_up_to_the_quantile(
    share: float, direction: tuple[float, float, float]
) -> None:
    unit, quantile = np.array(direction), float(chi2.ppf(share, 3))
    nis = judged(unit, share).nis
    assert nis is not None
    far = np.sqrt(quantile / nis)
    inside, outside = judged(0.99 * far * unit, share), judged(1.01 * far * unit, share)
    assert (inside.outcome, outside.outcome) == (Outcome.ACCEPTED, Outcome.REJECTED)
    assert inside.nis == pytest.approx(0.99**2 * quantile)
