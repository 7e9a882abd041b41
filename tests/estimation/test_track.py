"""One filter for a goal that stands, moves, or has moved, and for detections against a planned goal."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest

from estimation import GoalFilterConfig, GoalMeasurement, GoalPoseFilter, GoalPrior, Outcome
from geometry import Pose2
from tests.estimation.detections import GOAL, STD, off_by, seen, shifted, stamps, told


def noisy(place: Pose2, stamp: float, random: np.random.Generator, share: float) -> GoalMeasurement:
    """A detection of `share` of the usual noise."""
    off = random.normal(0.0, STD) * share
    return GoalMeasurement(
        stamp=stamp,
        x=place.x + off[0],
        y=place.y + off[1],
        phi=place.phi + off[2],
        covariance=np.diag((share * STD) ** 2),
    )


def test_a_goal_that_stands_neither_moves_nor_has_moved() -> None:
    """3000 detections."""
    for seed in range(5):
        random = np.random.default_rng(seed)
        run = [seen(GOAL, stamp, random) for stamp in stamps(10.0, 0.0, 60.0)]
        judged = list(told(GoalPoseFilter(), run))[10:]
        assert not any(judgement.outcome is Outcome.ACQUIRED for judgement, _ in judged)
        assert not any(estimate.moves or estimate.elsewhere for _, estimate in judged)


@pytest.mark.parametrize("share", [0.3, 0.5, 0.7])
def test_a_small_shift_is_followed_soon_though_it_passes_the_gate(share: float) -> None:
    """By two standard deviations of a detection, after 5 s of a goal that stands."""
    left = []
    for seed in range(9):
        random = np.random.default_rng(seed)
        goal = shifted(GOAL, along=1.2 * share * STD[0], aside=1.6 * share * STD[1], turn=0.02 * share)
        run = [noisy(GOAL if t < 5.0 else goal, t, random, share) for t in stamps(10.0, 0.0, 6.5)]
        *_, (_, estimate) = told(GoalPoseFilter(), run)
        left.append(off_by(estimate, goal)[0] / (2.0 * share * STD[0]))
        assert not estimate.moves
    assert np.median(left) < 0.35


@pytest.mark.parametrize("moving", [False, True])
@pytest.mark.parametrize("speed", [0.05, 0.1, 0.3])
def test_a_goal_that_moves_steadily_is_followed_and_said(speed: float, moving: bool) -> None:
    """From 3 s to 9 s, seen from near."""
    random = np.random.default_rng(1)
    goal_filter, said = GoalPoseFilter(GoalFilterConfig(moving=moving)), []
    for stamp in stamps(10.0, 0.0, 14.0):
        goal = shifted(GOAL, along=speed * min(max(stamp - 3.0, 0.0), 6.0))
        ((_, estimate),) = told(goal_filter, [noisy(goal, stamp, random, 0.1)])
        if estimate.moves:
            said.append(stamp)
        if 6.0 < stamp < 9.0:
            assert off_by(estimate, goal)[0] < 0.03
            assert estimate.velocity is not None
            assert estimate.velocity[0] == pytest.approx(speed, abs=0.03)
    assert 3.5 < said[0] < 6.0
    assert 8.8 < said[-1] < 11.5
    assert off_by(goal_filter.estimate(13.9), goal)[0] < 0.005


def test_where_the_last_detections_agree_is_said_before_it_is_followed() -> None:
    goal_filter, goal = GoalPoseFilter(), shifted(GOAL, along=1.0)
    run = [seen(GOAL if stamp < 3.0 else goal, stamp) for stamp in stamps(10.0, 0.0, 5.5)]
    said = [(one.stamp, estimate) for one, estimate in told(goal_filter, run)]
    assert not any(estimate.elsewhere for stamp, estimate in said if stamp < 3.95)
    elsewhere = next(estimate for stamp, estimate in said if stamp > 4.05)
    assert elsewhere.elsewhere is not None
    assert elsewhere.elsewhere.relative_to(goal).within((0.01, 0.01, 0.01))
    assert off_by(elsewhere, GOAL)[0] < 0.01
    assert off_by(said[-1][1], goal)[0] < 0.01


PRIOR = GoalPrior(
    pose=GOAL, position=1.0, heading=0.3, expected_position=1.0, expected_heading=0.3
)  # of a dock that says how wrong its pose may be


@pytest.mark.parametrize(
    ("off", "said"),
    [
        (Pose2(0.0, 0.0, pi), "turned by 180 deg"),
        (Pose2(0.1, 0.2, -3.0), "turned by 172 deg"),
        (Pose2(1.5, 0.0, 0.0), "1.50 m and 0 deg from the planned goal"),
        (Pose2(0.0, 0.0, 0.6), "0.00 m and 34 deg from the planned goal"),
    ],
)
def test_detections_that_the_planned_goal_excludes_are_rejected_from_the_first_one_on(
    off: Pose2, said: str
) -> None:
    goal_filter, place = GoalPoseFilter(), GOAL.compose(off)
    goal_filter.expect(PRIOR)
    for judgement, estimate in told(goal_filter, [seen(place, t) for t in stamps(10.0, 0.0, 5.0)]):
        assert judgement.outcome is Outcome.REJECTED
        assert said in judgement.reason
        assert estimate.pose is None


@pytest.mark.parametrize(("along", "most"), [(0.0, 0.15), (0.5, 0.6), (0.95, 1.9)])
def test_the_farther_from_the_planned_goal_the_longer_first_detections_have_to_agree(
    along: float, most: float
) -> None:
    goal_filter = GoalPoseFilter()
    goal_filter.expect(PRIOR)
    run = [seen(shifted(GOAL, along=along), stamp) for stamp in stamps(10.0, 0.0, 3.0)]
    first = next(one.stamp for one, _ in told(goal_filter, run) if one.outcome is Outcome.ACQUIRED)
    assert 0.6 * most < first <= most


@pytest.mark.parametrize("share", [0.3, 0.5, 0.9])
def test_detections_that_are_turned_now_and_then_neither_count_nor_hinder(share: float) -> None:
    random, goal_filter = np.random.default_rng(3), GoalPoseFilter()
    goal_filter.expect(GoalPrior(pose=shifted(GOAL, along=0.3, turn=0.2)))
    for stamp in stamps(10.0, 0.0, 10.0):
        place = GOAL.compose(Pose2(0.0, 0.0, pi)) if random.random() < share else GOAL
        ((judgement, estimate),) = told(goal_filter, [seen(place, stamp, random)])
        assert (place is GOAL) or judgement.outcome is Outcome.REJECTED
    assert off_by(estimate, GOAL)[0] < 0.1
