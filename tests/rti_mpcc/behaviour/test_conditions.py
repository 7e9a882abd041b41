"""When the vehicle stands, and when it may go on from where it stands."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rti_mpcc.behaviour import conditions
from rti_mpcc.config import ControllerConfig
from rti_mpcc.planning.sensing import CUSP_TOLERANCE
from tests.rti_mpcc.states import arriving, contexts, decided, state

CONFIG = ControllerConfig(dead_time=0.2)


# -- standing --------------------------------------------------------------------------------------------


def test_standing_is_counted_from_its_first_cycle_and_ends_with_motion() -> None:
    s = decided(arriving(), contexts.standing(12.0, now=3.0), CONFIG)
    assert s.vehicle.standing_since == 3.0
    s = decided(s, contexts.standing(12.0, now=3.5), CONFIG)
    assert s.vehicle.standing_since == 3.0
    assert s.stands
    assert s.vehicle.stands(4.0, 1.0)
    assert not s.vehicle.stands(3.9, 1.0)
    moving = decided(s, contexts(now=4.0), CONFIG)
    assert moving.vehicle.standing_since is None
    assert not moving.stands


def test_a_vehicle_about_to_move_does_not_stand() -> None:
    """Measured at rest, but the queued commands will have it moving."""
    about_to = np.array([12.0, 0.0, 0.0, 0.1, 0.0, 12.0])
    assert conditions.standing_since(arriving(), contexts.standing(12.0, state=about_to)) is None


def test_noise_on_the_speed_is_no_motion() -> None:
    s = arriving(standing_since=8.0)
    noisy = contexts.standing(19.96, measured_speed=0.035)
    assert conditions.standing_since(s, noisy) == 8.0
    assert conditions.standing_since(arriving(), noisy) is None
    cusp = contexts.standing(20.0, last_part=False, measured_speed=0.035)
    assert not conditions.may_change_direction(s, cusp, 0.2)
    assert conditions.may_change_direction(s, replace(cusp, measured_speed=0.0), 0.2)


# -- parts -----------------------------------------------------------------------------------------------


def test_the_direction_changes_at_the_cusp_after_the_dead_time_at_rest() -> None:
    at_cusp = contexts.standing(19.95, last_part=False, tolerance=CUSP_TOLERANCE)
    assert conditions.may_change_direction(state(standing_since=9.75), at_cusp, 0.2)
    assert not conditions.may_change_direction(state(standing_since=9.85), at_cusp, 0.2)
    assert not conditions.may_change_direction(state(), at_cusp, 0.2)
    last = replace(at_cusp, last_part=True)
    assert not conditions.may_change_direction(state(standing_since=5.0), last, 0.2)
    held = replace(at_cusp, free=False)
    assert not conditions.may_change_direction(state(standing_since=5.0), held, 0.2)


def test_a_vehicle_that_stands_near_the_cusp_for_a_second_may_go_on() -> None:
    near = contexts.standing(19.6, last_part=False, tolerance=CUSP_TOLERANCE)
    assert not conditions.may_change_direction(state(standing_since=9.5), near, 0.2)
    assert conditions.may_change_direction(state(standing_since=9.0), near, 0.2)
    far = contexts.standing(19.4, last_part=False, tolerance=CUSP_TOLERANCE)
    assert not conditions.may_change_direction(state(standing_since=5.0), far, 0.2)
