"""When the vehicle stands, and when it may go on from where it stands."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from geometry import Pose2
from rti_mpcc.behaviour import conditions
from rti_mpcc.behaviour.conditions import DUE_TIME, OUTSIDE_SHARE, OVERDUE_TIME, SETTLE_SHARE
from rti_mpcc.config import ControllerConfig
from rti_mpcc.manoeuvre import CUSP_TOLERANCE, Segment
from rti_mpcc.model.layout import PHI, X, Y
from rti_mpcc.planning.schedule import DUE_SHARE
from rti_mpcc.planning.state import ControllerState, Halt, Phase, RouteState
from rti_mpcc.planning.stops import REPLAN_INTERVAL
from rti_mpcc.types import Trajectory
from tests.rti_mpcc.states import (
    PATH,
    SEGMENTS,
    arrival_at,
    arriving,
    begun_for,
    contexts,
    contouring,
    decided,
    put,
    some_plan,
    state,
)

CONFIG = ControllerConfig(dead_time=0.2)
CUSP_TOLERANCE = CUSP_TOLERANCE
INTERVAL = REPLAN_INTERVAL


# -- standing --------------------------------------------------------------------------------------------


def test_standing_is_counted_from_its_first_cycle_and_ends_with_motion() -> None:
    s = decided(arriving(), contexts.standing(12.0, now=3.0), CONFIG)
    assert s.vehicle.standing_since == 3.0
    s = decided(s, contexts.standing(12.0, now=3.5), CONFIG)
    assert s.vehicle.standing_since == 3.0
    assert s.is_stationary
    assert s.vehicle.is_stationary(4.0, 1.0)
    assert not s.vehicle.is_stationary(3.9, 1.0)
    moving = decided(s, contexts(now=4.0), CONFIG)
    assert moving.vehicle.standing_since is None
    assert not moving.is_stationary


def test_a_vehicle_about_to_move_does_not_stand() -> None:
    """Measured at rest, but the queued commands will have it moving."""
    about_to = np.array([12.0, 0.0, 0.0, 0.1, 0.0, 12.0])
    assert conditions.standing_since(arriving(), contexts.standing(12.0, state=about_to)) is None


def test_noise_on_the_speed_is_no_motion() -> None:
    s = arriving(standing_since=8.0)
    noisy = contexts.standing(19.96, measured_speed=0.035)
    assert conditions.standing_since(s, noisy) == 8.0
    assert conditions.standing_since(arriving(), noisy) is None
    cusp = contexts.standing(20.0, ends_at_goal=False, measured_speed=0.035)
    assert not conditions.may_change_direction(s, cusp, CONFIG)
    assert conditions.may_change_direction(s, replace(cusp, measured_speed=0.0), CONFIG)


# -- parts -----------------------------------------------------------------------------------------------


def test_the_direction_changes_at_the_cusp_after_the_dead_time_at_rest() -> None:
    at_cusp = contexts.standing(19.95, ends_at_goal=False, tolerance=CUSP_TOLERANCE)
    assert conditions.may_change_direction(state(standing_since=9.75), at_cusp, CONFIG)
    assert not conditions.may_change_direction(state(standing_since=9.85), at_cusp, CONFIG)
    assert not conditions.may_change_direction(state(), at_cusp, CONFIG)
    last = replace(at_cusp, ends_at_goal=True)
    assert not conditions.may_change_direction(state(standing_since=5.0), last, CONFIG)
    held = replace(at_cusp, free=False)
    assert not conditions.may_change_direction(state(standing_since=5.0), held, CONFIG)


def test_a_vehicle_that_stands_near_the_cusp_for_a_second_may_go_on() -> None:
    near = contexts.standing(19.6, ends_at_goal=False, tolerance=CUSP_TOLERANCE)
    assert not conditions.may_change_direction(state(standing_since=9.5), near, CONFIG)
    assert conditions.may_change_direction(state(standing_since=9.0), near, CONFIG)
    far = contexts.standing(19.4, ends_at_goal=False, tolerance=CUSP_TOLERANCE)
    assert not conditions.may_change_direction(state(standing_since=5.0), far, CONFIG)


def test_a_vehicle_stands_at_the_end_of_a_segment_as_long_as_it_is_to_dwell() -> None:
    here = contexts.standing(20.0, ends_at_goal=False, tolerance=CUSP_TOLERANCE)
    waiting = (Segment(part=PATH.parts[0], index=0, dwell=4.0), *SEGMENTS)
    for stood, over in ((3.9, False), (4.0, True)):
        s = arriving(segments=waiting, standing_since=here.now - stood)
        assert conditions.may_change_direction(s, here, CONFIG) == over


# -- blocked ---------------------------------------------------------------------------------------------


def test_a_blocked_vehicle_looks_again_now_and_then() -> None:
    looked = state(looked_at=10.0)
    assert conditions.replan_due(state(), contexts.standing(now=10.0))
    early = contexts.standing(now=10.0 + 0.9 * INTERVAL)
    assert not conditions.replan_due(looked, early)
    assert conditions.replan_due(looked, contexts.standing(now=10.0 + INTERVAL))
    assert conditions.replan_due(looked, contexts.standing(now=3.0))  # a clock that was set back
    assert conditions.replan_due(put(looked, suspended=begun_for(None)), early)  # it goes on looking


def test_a_vehicle_that_halts_for_something_waits_and_is_not_stuck() -> None:
    standing = contouring(standing_since=5.0)
    here = contexts.standing(12.0)
    assert conditions.no_progress(standing, here, CONFIG)
    assert not conditions.no_progress(put(standing, halt=Halt()), here, CONFIG)


def test_beside_the_cusp_it_waits_for_its_dwell_and_does_not_stall() -> None:
    """0.2 m off: near enough to go on from, but outside the tolerance."""
    here = contexts.standing(19.8, ends_at_goal=False, tolerance=CUSP_TOLERANCE)
    assert not here.inside(here.error)
    dwelling = (Segment(part=PATH.parts[0], index=0, dwell=4.0), *SEGMENTS)
    overdue = arrival_at(12.0, overdue_since=here.now - 2.0 * OVERDUE_TIME)
    for segments, waits in ((dwelling, True), (SEGMENTS, False)):
        for arrival in (None, overdue):
            s = arriving(segments=segments, standing_since=here.now - 3.0, arrival=arrival)
            assert conditions.no_progress(s, here, CONFIG) != waits
    rolling = arriving(segments=dwelling, arrival=overdue)
    assert conditions.no_progress(rolling, here, CONFIG)
    far = contexts.standing(19.4, ends_at_goal=False, tolerance=CUSP_TOLERANCE)
    assert conditions.no_progress(put(rolling, standing_since=here.now - 3.0), far, CONFIG)


@pytest.mark.parametrize(("since", "stands"), [(9.0, True), (None, False)])
def test_an_overdue_vehicle_that_drives_through_its_tolerance_is_not_there(
    since: float | None, stands: bool
) -> None:
    here = contexts.standing(19.99, speed=0.5, stop_error=Pose2(0.6, 0.0, 0.0))
    assert here.inside(here.error)
    overdue = arrival_at(10.0, overdue_since=here.now - 2.0 * OVERDUE_TIME)
    s = arriving(arrival=overdue, standing_since=since)
    assert conditions.no_progress(s, here, CONFIG)
    assert conditions.stuck_inside(s, here, CONFIG) == stands


# -- a plan that ends beside its target -------------------------------------------------------------------

DUE = DUE_TIME


def ending(pose: Pose2) -> Trajectory:
    """A plan that ends there."""
    plan = some_plan()
    states = plan.states.copy()
    states[-1, [X, Y, PHI]] = pose.x, pose.y, pose.phi
    return replace(plan, states=states)


def missing(**values: Any) -> ControllerState:
    """On a way that can be planned anew, due at the goal for a while, with a plan that ends short of it."""
    due = arrival_at(11.2, overdue_since=10.0 - DUE)
    usual: dict[str, Any] = {"route": RouteState(), "arrival": due, "driven": ending(Pose2(19.8, 0.0, 0.0))}
    return arriving(**{**usual, **values})


SHORT = contexts(error=Pose2(-0.5, 0.0, 0.0), stop_error=Pose2(-0.2, 0.0, 0.0), distance=0.5)
"""It would stop outside the tolerance, too."""


def test_a_plan_that_is_due_and_ends_outside_the_tolerance_misses() -> None:
    assert conditions.plan_misses(missing(), SHORT, CONFIG)
    assert conditions.plan_misses(missing(), contexts.standing(19.8), CONFIG)


@pytest.mark.parametrize(
    "values",
    [
        {"route": None},
        {"driven": None},
        {"arrival": None},
        {"arrival": arrival_at(11.2)},
        {"arrival": arrival_at(11.2, overdue_since=10.0 - 0.9 * DUE)},
    ],
    ids=["no other way", "no plan", "no arrival", "time to go", "just due"],
)
def test_it_misses_only_once_it_is_due_for_a_while_and_where_another_way_can_be_planned(
    values: dict[str, Any],
) -> None:
    assert not conditions.plan_misses(missing(**values), SHORT, CONFIG)


def test_before_something_in_the_way_no_plan_misses() -> None:
    assert not conditions.plan_misses(missing(), replace(SHORT, free=False), CONFIG)


def test_a_vehicle_that_would_stop_inside_does_not_miss_whatever_its_plan_says() -> None:
    for inside, misses in ((0.04, False), (0.06, True)):
        stopping = replace(SHORT, stop_error=Pose2(inside, 0.0, 0.0))
        assert conditions.plan_misses(missing(), stopping, CONFIG) == misses


@pytest.mark.parametrize(
    ("error", "misses"),
    [
        (Pose2(0.04, -0.04, 0.03), False),
        (Pose2(0.0, 0.0, 2.0 * np.pi), False),
        (Pose2(0.06, 0.0, 0.0), True),
        (Pose2(0.0, -0.06, 0.0), True),
        (Pose2(0.0, 0.0, 0.04), True),
    ],
)
def test_where_a_plan_ends_counts_in_the_frame_of_its_target(error: Pose2, misses: bool) -> None:
    goal = Pose2(20.0, 1.0, 0.7)
    context = replace(SHORT, target=replace(SHORT.target, pose=goal))
    s = missing(driven=ending(goal.compose(error)))
    assert conditions.plan_misses(s, context, CONFIG) == misses


def test_an_arrival_is_due_once_it_has_its_shortest_time_to_go_for_a_moment() -> None:
    for since, due in ((None, False), (10.0 - 0.9 * DUE, False), (10.0 - DUE, True)):
        s = arriving(arrival=arrival_at(11.2, overdue_since=since))
        assert conditions.is_due(s, SHORT) == due
    assert not conditions.is_due(contouring(), SHORT)
    assert OVERDUE_TIME > DUE


def test_the_longer_an_arrival_is_due_the_more_of_the_tolerance_ends_it() -> None:
    """Half of it on the way, most of it when it is due, all of it when it is long overdue."""
    shares = SETTLE_SHARE, DUE_SHARE, 1.0
    assert shares[0] < shares[1] < 1.0
    for since, share in zip((None, 10.0 - DUE, 10.0 - OVERDUE_TIME), shares, strict=True):
        s = arriving(arrival=arrival_at(11.2, overdue_since=since))
        for off, ends in ((0.95 * share, True), (1.05 * share, False)):
            stopping = contexts(speed=0.1, stop_error=Pose2(off * SHORT.tolerance[0], 0.0, 0.0))
            assert conditions.stop_ends_inside(s, stopping, CONFIG) == ends


# -- well inside -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_well_inside_is_within_a_share_of_each_tolerance(axis: int, sign: float) -> None:
    s, here = state(standing_since=9.0), contexts.standing()
    for share, well in ((0.9, True), (1.1, False)):
        off = [0.0, 0.0, 0.0]
        off[axis] = sign * share * SETTLE_SHARE * here.tolerance[axis]
        beside = replace(here, standing_error=Pose2(*off))
        assert conditions.stands_well_inside(s, beside, CONFIG) == well
        assert conditions.stands_inside(s, beside, CONFIG)


def test_a_vehicle_that_rolls_through_its_target_does_not_stand_there() -> None:
    assert conditions.stands_well_inside(state(standing_since=9.0), contexts.standing(), CONFIG)
    assert not conditions.stands_well_inside(state(), contexts.standing(), CONFIG)


def test_outside_is_where_the_mean_is_or_far_from_the_target_in_one_cycle() -> None:
    held, across = put(arriving(standing_since=5.0), phase=Phase.HOLDING), CONFIG.goal_tolerance[1]
    for now, mean, outside in ((0.0, 0.0, False), (1.5, 0.5, False), (0.5, 1.5, True), (2.5, 0.2, True)):
        error, standing = (Pose2(0.0, share * across, 0.0) for share in (now, mean))
        here = contexts.standing(error=error, standing_error=standing)
        assert (conditions.outside_since(held, here) is not None) is outside
    assert OUTSIDE_SHARE == 2.0
