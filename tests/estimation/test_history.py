from __future__ import annotations

from math import inf, nan, pi

import pytest

from estimation import PoseHistory
from estimation.vehicle_filter import GAP
from geometry import Pose2, wrap

AT = Pose2(1.0, 2.0, 0.5)


def noted(*poses: tuple[float, Pose2], length: float = 10.0) -> PoseHistory:
    history = PoseHistory()
    for stamp, pose in poses:
        history = history.noted(stamp, pose, length=length)
    return history


@pytest.mark.parametrize(("before", "after"), [(3.1, -3.1), (-3.1, 3.1), (3.1, 2.0 * pi - 3.1), (9.4, -3.0)])
def test_the_heading_takes_the_short_way_across_pi(before: float, after: float) -> None:
    history = noted((0.0, Pose2(0.0, 0.0, before)), (0.4, Pose2(0.0, 0.0, after)))
    turn = wrap(after - before)
    assert abs(turn) < 0.2
    for share in (0.25, 0.5, 0.75):
        found = history.at(0.4 * share)
        assert found is not None
        assert wrap(found.phi - before - share * turn) == pytest.approx(0.0, abs=1e-12)


def test_a_gap_is_not_interpolated_over() -> None:
    history = noted((0.0, AT), (GAP + 0.01, Pose2(5.0, 5.0, 0.5)))
    assert history.at(0.2) is None
    assert history.at(0.0) == AT
    assert history.at(GAP + 0.05, ahead=0.1) is None
    assert noted((0.0, AT), (GAP, AT)).at(0.2) == AT


def test_ahead_of_the_latest_pose_the_motion_is_carried_on() -> None:
    history = noted((0.0, Pose2(0.0, 0.0, 3.1)), (0.1, Pose2(0.2, -0.1, -3.1)))
    carried = history.at(0.15, ahead=0.05)
    assert carried is not None
    assert (carried.x, carried.y) == pytest.approx((0.3, -0.15))
    assert wrap(carried.phi - 3.1) == pytest.approx(1.5 * (2.0 * pi - 6.2))
    assert history.at(0.15, ahead=0.04) is None
    assert history.at(0.101) is None


@pytest.mark.parametrize("stamp", [nan, inf, -inf])
def test_what_is_not_a_time_is_neither_noted_nor_known(stamp: float) -> None:
    history = noted((1.0, AT), (1.1, AT))
    assert history.noted(stamp, AT, length=1.0) is history
    assert history.at(stamp, ahead=1.0) is None


def test_a_stamp_noted_again_takes_the_newer_pose() -> None:
    history = noted((1.0, AT), (1.1, AT), (1.1, Pose2(3.0, 3.0, 3.0)))
    assert history.stamps == (1.0, 1.1)
    assert history.at(1.1) == Pose2(3.0, 3.0, 3.0)


def test_a_clock_that_runs_back_begins_anew() -> None:
    history = noted((5.0, AT), (5.1, AT), (4.0, Pose2(0.0, 0.0, 0.0)))
    assert history.stamps == (4.0,)
    assert history.at(5.0) is None
    assert history.at(4.0) == Pose2(0.0, 0.0, 0.0)


def test_it_covers_its_length_and_does_not_grow() -> None:
    history = PoseHistory()
    for k in range(200):
        history = history.noted(0.05 * k, Pose2(0.1 * k, 0.0, 0.0), length=1.0)
        assert len(history.stamps) == len(history.poses) <= 22
    last = history.stamps[-1]
    oldest = history.at(last - 1.0)
    assert oldest is not None
    assert oldest.x == pytest.approx(0.1 * 199 - 2.0)
    assert history.at(last - 1.1) is None
