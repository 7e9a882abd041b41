"""The pose made for follows the estimate at a bounded rate; an uncertain goal is waited for."""

from __future__ import annotations

from dataclasses import replace
from math import hypot, pi, radians

import numpy as np
import pytest

from estimation import Frame, GoalEstimate, GoalFilterConfig, GoalMeasurement, GoalStatus
from geometry import Pose2
from rti_mpcc.config import ControllerConfig, GoalTracking
from rti_mpcc.planning import aim
from rti_mpcc.planning.goals import GoalFit
from rti_mpcc.planning.plausibility import StateMonitor
from rti_mpcc.planning.state import ControllerState, GoalState, VehicleEstimate
from rti_mpcc.types import GoalOrigin
from tests.rti_mpcc.states import arrival_at, contexts, put, state

CONFIG = ControllerConfig(cycle=0.05, goal_tracking=GoalTracking(speed=0.5, turn_rate=0.3))
END = Pose2(20.0, 0.0, 0.0)


def seen(
    pose: Pose2 = END,
    status: GoalStatus = GoalStatus.TRACKING,
    stds: tuple[float, float, float] = (0.01, 0.01, 0.005),
) -> GoalEstimate:
    return GoalEstimate(status=status, pose=pose, covariance=np.diag(np.square(stds)), age=3.0)


def lost(*stds: float) -> ControllerState:
    along, across, heading = stds
    return state(estimate=seen(status=GoalStatus.LOST, stds=(along, across, heading)))


def test_while_searching_the_planned_goal_is_made_for() -> None:
    searching = GoalEstimate(status=GoalStatus.SEARCHING)
    planned = Pose2(19.0, 1.0, 0.1)
    assert aim.rate_limited_goal(GoalState(planned=planned), searching, END, 1.0, CONFIG).pose == planned
    assert aim.rate_limited_goal(GoalState(), searching, END, 1.0, CONFIG).pose is None


@pytest.mark.parametrize("planned", [Pose2(19.0, 1.0, 0.1), None])
def test_the_aim_goes_from_the_plan_to_the_estimate_at_the_bounded_rate(planned: Pose2 | None) -> None:
    known = GoalState(planned=planned, pose=planned)
    wanted, before = Pose2(20.4, -0.3, -0.2), planned or END
    steps = 0
    while known.pose != wanted:
        steps += 1
        known = aim.rate_limited_goal(known, seen(wanted), END, 0.05 * steps, CONFIG)
        assert known.pose is not None
        assert hypot(known.pose.x - before.x, known.pose.y - before.y) <= 0.5 * 0.05 + 1e-9
        assert abs(known.pose.phi - before.phi) <= 0.3 * 0.05 + 1e-9
        before = known.pose
    start = planned or END
    by_way = hypot(wanted.x - start.x, wanted.y - start.y) / (0.5 * 0.05)
    by_turn = abs(wanted.phi - start.phi) / (0.3 * 0.05)
    assert steps == pytest.approx(max(by_way, by_turn), abs=1.5)


def unfit(pose: Pose2) -> GoalFit:
    return GoalFit(
        pose=pose, problem="the body there crosses a boundary or obstacle by 0.3 m", beside=END, room=-0.3
    )


def test_an_estimate_that_cannot_be_the_goal_is_not_followed() -> None:
    good, bad, planned = Pose2(19.0, 1.0, 0.0), Pose2(19.0, 2.6, 0.0), Pose2(18.0, 0.5, 0.0)
    known = GoalState(planned=planned, pose=planned)
    known = aim.rate_limited_goal(known, seen(bad), END, 0.0, CONFIG, unfit(bad))
    assert known.pose == planned
    for k in range(1, 200):
        # The good one is known for one cycle only: it is made for all the same.
        pose = good if k == 5 else bad
        known = aim.rate_limited_goal(
            known,
            seen(pose),
            END,
            0.05 * k,
            CONFIG,
            GoalFit(pose=good, beside=END) if k == 5 else unfit(bad),
        )
    assert known.pose == good
    (said,) = aim.remarks(known)
    assert said == (
        "goal detected at (19, 2.6, 0) out of reach, the body there crosses a boundary or obstacle by 0.3 m: "
        "the last one stays"
    )


def test_an_estimate_that_is_forgotten_leaves_the_planned_goal() -> None:
    planned = Pose2(18.0, 0.5, 0.0)
    known = GoalState(planned=planned, pose=END, followed=END)
    after = aim.rate_limited_goal(known, GoalEstimate(status=GoalStatus.SEARCHING), END, 0.0, CONFIG)
    assert (after.pose, after.followed) == (planned, None)


def test_what_there_is_to_say_is_of_the_goal_that_is_made_for() -> None:
    tight, wide = (GoalFit(pose=END, beside=END, remark=said) for said in ("tight", ""))
    assert aim.remarks(GoalState()) == ()
    assert aim.remarks(GoalState(fit=tight, refusal="refused")) == ("refused",)
    kept = GoalState(fit=tight, refusal="refused", origin=GoalOrigin.GIVEN)
    assert aim.remarks(kept) == ("refused: the last one stays", "tight")
    assert aim.remarks(GoalState(fit=tight, estimate_fit=wide, followed=END)) == ()
    assert aim.remarks(GoalState(fit=wide, estimate_fit=tight, followed=END)) == ("tight",)


def test_the_aim_turns_the_short_way_across_pi() -> None:
    known = GoalState(pose=Pose2(0.0, 0.0, pi - 0.005), estimated_at=0.0)
    after = aim.rate_limited_goal(known, seen(Pose2(0.0, 0.0, -pi + 0.005)), END, 0.05, CONFIG)
    assert after.pose is not None
    assert after.pose.phi == pytest.approx(pi + 0.005)


def test_a_gap_or_a_clock_that_runs_back_gives_no_leap() -> None:
    known = GoalState(pose=END, estimated_at=10.0)
    late = aim.rate_limited_goal(known, seen(Pose2(30.0, 0.0, 0.0)), END, 70.0, CONFIG).pose
    assert late is not None
    assert late.x == pytest.approx(20.0 + 0.5 * CONFIG.goal_tracking.longest_step)
    assert aim.rate_limited_goal(known, seen(Pose2(30.0, 0.0, 0.0)), END, 9.0, CONFIG).pose == END


def test_a_detection_is_given_the_pose_at_its_stamp_unless_it_brings_one() -> None:
    vehicle = VehicleEstimate()
    for now in (0.0, 0.1, 0.2):
        here = np.array([10.0 * now, 0.0, 0.0, 10.0, 0.0, 0.0])
        vehicle = aim.noted(replace(vehicle, monitor=StateMonitor(state=here)), now, 1.0)
    doubted = StateMonitor(state=here, why="not a finite state")
    assert aim.noted(replace(vehicle, monitor=doubted), 0.3, 1.0).poses is vehicle.poses
    settings = GoalFilterConfig()
    detection = GoalMeasurement(stamp=0.15, x=1.0, y=0.0, phi=0.0, frame=Frame.VEHICLE)
    placed = aim.placed(detection, vehicle, settings).vehicle
    assert placed is not None
    assert (placed.x, placed.y, placed.phi) == pytest.approx((1.5, 0.0, 0.0))
    own = replace(detection, vehicle=END)
    assert aim.placed(own, vehicle, settings).vehicle == END
    assert aim.placed(replace(detection, stamp=-1.0), vehicle, settings).vehicle is None


def test_a_lost_goal_is_trusted_while_two_sigma_fit_the_tolerance() -> None:
    assert aim.doubt(lost(0.024, 0.024, radians(0.9)), CONFIG) == ""
    assert aim.doubt(lost(0.026, 0.024, radians(0.9)), CONFIG) != ""
    assert aim.doubt(lost(0.024, 0.026, radians(0.9)), CONFIG) != ""
    assert aim.doubt(lost(0.024, 0.024, radians(1.1)), CONFIG) != ""


@pytest.mark.parametrize("status", [GoalStatus.SEARCHING, GoalStatus.TRACKING, GoalStatus.COASTING])
def test_only_a_lost_goal_is_doubted(status: GoalStatus) -> None:
    assert aim.doubt(state(estimate=seen(status=status, stds=(1.0, 1.0, 1.0))), CONFIG) == ""
    assert aim.doubt(state(), CONFIG) == ""


def test_doubt_is_about_the_time_of_arrival() -> None:
    s = put(lost(0.022, 0.022, 0.01), arrival=arrival_at(10.0))
    drift = CONFIG.goal_tracking.filter.position_drift
    enough = ((0.025**2 - 0.022**2) / drift**2) * 0.99
    assert aim.doubt(put(s, time=10.0 - enough), CONFIG) == ""
    assert aim.doubt(put(s, time=10.0 - 1.1 * enough), CONFIG) != ""


def test_doubt_is_about_the_goals_own_axes() -> None:
    """A goal that heads along y is known well along its heading if y is."""
    wide = ControllerConfig(goal_tolerance=(0.01, 0.1, 0.1))
    pose = Pose2(0.0, 0.0, 0.5 * pi)
    well = seen(pose, GoalStatus.LOST, (0.04, 0.004, 0.01))
    badly = seen(pose, GoalStatus.LOST, (0.004, 0.04, 0.01))
    assert aim.doubt(state(estimate=well), wide) == ""
    assert aim.doubt(state(estimate=badly), wide) != ""


def test_it_waits_at_the_standoff_and_once_it_waits_until_there_is_no_doubt() -> None:
    s = lost(0.1, 0.1, 0.1)
    standoff, brake = CONFIG.goal_tracking.standoff, 1.0 / (2.0 * CONFIG.comfort_acceleration)
    assert aim.must_wait(s, contexts(distance=standoff + brake + 0.1, speed=1.0), CONFIG) == ""
    near = contexts(distance=standoff + brake - 0.1, speed=1.0)
    assert "goal not seen for 3.0 s" in aim.must_wait(s, near, CONFIG)
    waiting = put(s, waiting=True)
    assert aim.must_wait(waiting, contexts(distance=standoff + brake + 0.1, speed=1.0), CONFIG) != ""
    assert aim.must_wait(put(waiting, estimate=seen()), near, CONFIG) == ""


def test_it_does_not_wait_before_a_cusp_or_a_stop_of_its_own() -> None:
    s = lost(0.1, 0.1, 0.1)
    assert aim.must_wait(s, contexts(distance=0.5, speed=0.1, ends_at_goal=False), CONFIG) == ""
    assert aim.must_wait(s, contexts(distance=0.5, speed=0.1, free=False), CONFIG) == ""


def test_a_goal_that_has_to_be_seen_is_one() -> None:
    required = ControllerConfig(goal_tracking=GoalTracking(required=True))
    searching = GoalState(estimate=GoalEstimate(status=GoalStatus.SEARCHING))
    assert aim.never_seen(GoalState(), required)
    assert aim.never_seen(searching, required)
    assert not aim.never_seen(searching, CONFIG)
    assert not aim.never_seen(lost(0.1, 0.1, 0.1).goal, required)
