"""When the vehicle stands, and when it may go on from where it stands."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from geometry import Pose2
from rti_mpcc.behaviour import conditions
from rti_mpcc.config import ControllerConfig
from rti_mpcc.manoeuvre import Segment
from rti_mpcc.planning.state import Halt, Phase
from tests.rti_mpcc.states import (
    BACK,
    PATH,
    SEGMENTS,
    arrival_at,
    arriving,
    begun_for,
    contexts,
    contouring,
    decided,
    put,
    state,
)

CONFIG = ControllerConfig(dead_time=0.2)
CUSP_TOLERANCE = CONFIG.behaviour.cusp_tolerance
INTERVAL = CONFIG.retries.replan_interval


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
    assert conditions.standing_since(arriving(), contexts.standing(12.0, state=about_to), CONFIG) is None


def test_noise_on_the_speed_is_no_motion() -> None:
    s = arriving(standing_since=8.0)
    noisy = contexts.standing(19.96, measured_speed=0.035)
    assert conditions.standing_since(s, noisy, CONFIG) == 8.0
    assert conditions.standing_since(arriving(), noisy, CONFIG) is None
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


@pytest.mark.parametrize(
    ("changes", "error", "over"),
    [
        ({}, 0.4, True),
        ({}, 0.6, False),
        ({"standing_since": 9.9}, 0.4, False),
        ({"standing_since": None}, 0.4, False),
        ({"phase": Phase.STALLED, "standing_since": 9.0}, 6.0, True),
        ({"standing_since": 9.0}, 6.0, False),
        ({"standing_since": 4.9}, 6.0, True),
    ],
)
def test_a_way_back_is_over_at_its_end_or_where_there_is_no_getting_on(
    changes: dict[str, Any], error: float, over: bool
) -> None:
    usual: dict[str, Any] = {"segments": (BACK, *SEGMENTS), "restarts": 3, "standing_since": 9.0}
    here = contexts.standing(12.0, error=Pose2(-error, 0.0, 0.0), ends_at_goal=False)
    assert conditions.has_pulled_out(arriving(**{**usual, **changes}), here, CONFIG) == over


def test_a_vehicle_stands_at_the_end_of_a_segment_as_long_as_it_is_to_dwell() -> None:
    here = contexts.standing(20.0, ends_at_goal=False, tolerance=CUSP_TOLERANCE)
    waiting = (Segment(part=PATH.parts[0], index=0, dwell=4.0), *SEGMENTS)
    for stood, over in ((3.9, False), (4.0, True)):
        s = arriving(segments=waiting, standing_since=here.now - stood)
        assert conditions.may_change_direction(s, here, CONFIG) == over


# -- blocked ---------------------------------------------------------------------------------------------


def test_a_blocked_vehicle_looks_again_now_and_then() -> None:
    looked = state(looked_at=10.0)
    assert conditions.replan_due(state(), contexts.standing(now=10.0), CONFIG)
    early = contexts.standing(now=10.0 + 0.9 * INTERVAL)
    assert not conditions.replan_due(looked, early, CONFIG)
    assert conditions.replan_due(looked, contexts.standing(now=10.0 + INTERVAL), CONFIG)
    assert conditions.replan_due(looked, contexts.standing(now=3.0), CONFIG)  # a clock that was set back
    assert conditions.replan_due(put(looked, suspended=begun_for(None)), early, CONFIG)  # it goes on looking


def test_a_plan_that_is_blocked_is_iterated_for_a_while_before_another_is_looked_for() -> None:
    standing = state(standing_since=5.0, driving_since=10.0 - INTERVAL)
    assert conditions.may_look_again(standing, CONFIG)
    assert not conditions.may_look_again(put(standing, driving_since=10.0 - 0.9 * INTERVAL), CONFIG)
    assert not conditions.may_look_again(put(standing, standing_since=None), CONFIG)


def test_a_vehicle_that_halts_for_something_waits_and_is_not_stuck() -> None:
    standing = contouring(standing_since=5.0)
    here = contexts.standing(12.0)
    assert conditions.no_progress(standing, here, CONFIG)
    assert not conditions.no_progress(put(standing, halt=Halt()), here, CONFIG)


def test_beside_the_cusp_it_waits_for_its_dwell_and_does_not_try_again() -> None:
    """0.2 m off: near enough to go on from, but outside the tolerance."""
    here = contexts.standing(19.8, ends_at_goal=False, tolerance=CUSP_TOLERANCE)
    assert not here.inside(here.error)
    dwelling = (Segment(part=PATH.parts[0], index=0, dwell=4.0), *SEGMENTS)
    overdue = arrival_at(12.0, overdue_since=here.now - 2.0 * CONFIG.behaviour.overdue_time)
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
    overdue = arrival_at(10.0, overdue_since=here.now - 2.0 * CONFIG.behaviour.overdue_time)
    s = arriving(arrival=overdue, standing_since=since)
    assert conditions.no_progress(s, here, CONFIG)
    assert conditions.stuck_inside(s, here, CONFIG) == stands
