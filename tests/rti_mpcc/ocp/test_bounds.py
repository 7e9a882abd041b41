from __future__ import annotations

from math import inf

import numpy as np
import pytest
from numpy.typing import ArrayLike

from geometry import Pose2
from rti_mpcc.config import ControllerConfig, Limits
from rti_mpcc.model.actuators import Disturbance
from rti_mpcc.model.layout import CONTROLS, DELTA, DELTA_DOT, STATES, THETA, THETA_DOT, A, V
from rti_mpcc.ocp.bounds import TURNING_SHARE, Change, StageBounds, stage_bounds
from rti_mpcc.ocp.horizon import PlanStages
from rti_mpcc.ocp.objectives import Target, TargetKind
from rti_mpcc.qp.pattern import BOUNDED
from rti_mpcc.types import Array

SPEED, STEERING, PROGRESS = (int(np.flatnonzero(quantity == BOUNDED)[0]) for quantity in (V, DELTA, THETA))
LIMITS = Limits(speed=4.0, acceleration=2.0, steering=0.5, steering_rate=0.7)
END = 30.0


def bounds(
    direction: int = 1, *, theta: float = 30.0, kind: TargetKind = TargetKind.POSE, **changes: object
) -> StageBounds:
    turns = bool(changes.pop("turns", False))
    config = ControllerConfig.model_validate({"limits": LIMITS, **changes})
    target = Target(pose=Pose2(0.0, 0.0, 0.0), theta=theta, theta_end=30.0, kind=kind)
    return stage_bounds(config, 0 if turns else direction, target.farthest)


def test_limits_are_those_of_the_vehicle() -> None:
    got = bounds()
    assert got.states.shape == (70, 2, 3)
    assert got.controls.shape == (70, 2, 3)
    np.testing.assert_allclose(got.states[:, 1, SPEED], 4.0)
    np.testing.assert_allclose(got.states[:, :, STEERING], [[-0.5, 0.5]] * 70)
    np.testing.assert_allclose(got.controls[:, :, A], [[-2.0, 2.0]] * 70)
    np.testing.assert_allclose(got.controls[:, :, DELTA_DOT], [[-0.7, 0.7]] * 70)
    assert (got.controls[:, 1, THETA_DOT] >= 4.0).all()
    assert (got.controls[:, 0, THETA_DOT] <= 0.0).all()


def test_each_part_has_one_direction_of_motion() -> None:
    forward, reverse = bounds(1), bounds(-1)
    assert (forward.states[:, 0, SPEED] == 0.0).all()
    assert (reverse.states[:, 1, SPEED] == 0.0).all()
    assert (reverse.states[:, 0, SPEED] == -4.0).all()


def test_each_stage_has_the_speed_that_its_own_room_allows() -> None:
    most = np.linspace(1.0, 8.0, 70)
    got = stage_bounds(ControllerConfig(limits=LIMITS), 1, END, most)
    np.testing.assert_array_equal(got.states[:, 1, SPEED], np.minimum(most, 4.0))


@pytest.mark.parametrize("direction", [1, -1])
def test_one_that_turns_may_drive_both_ways_as_fast_as_the_vehicle_can(direction: int) -> None:
    got, usual = bounds(direction, turns=True), bounds(direction)
    np.testing.assert_array_equal(got.states[:, :, SPEED], [[-4.0, 4.0]] * 70)
    np.testing.assert_array_equal(
        got.states[:, :, [STEERING, PROGRESS]], usual.states[:, :, [STEERING, PROGRESS]]
    )
    np.testing.assert_array_equal(got.controls, usual.controls)


@pytest.mark.parametrize("theta", [20.0, 35.0])
def test_progress_ends_just_behind_the_stop_point(theta: float) -> None:
    limit = bounds(theta=theta).states[:, 1, PROGRESS]
    assert (limit > min(theta, 30.0)).all()
    assert (limit < min(theta, 30.0) + 0.2).all()
    assert np.isneginf(bounds(theta=theta).states[:, 0, PROGRESS]).all()


def test_bounds_are_of_what_acts() -> None:
    config = ControllerConfig(limits=LIMITS)
    got = stage_bounds(config, 1, END, disturbance=Disturbance(acceleration=-0.3, steering=0.04))
    np.testing.assert_allclose(got.controls[:, :, A], [[-2.3, 1.7]] * 70)
    np.testing.assert_allclose(got.states[:, :, STEERING], [[-0.46, 0.54]] * 70)
    np.testing.assert_allclose(got.controls[:, :, DELTA_DOT], [[-0.7, 0.7]] * 70)


LENGTHS = np.append(0.05, np.full(69, 0.1))
STRAIGHT = np.zeros((len(LENGTHS), CONTROLS))


def stages(speeds: ArrayLike, planned: Array = STRAIGHT) -> PlanStages:
    states = np.zeros((len(LENGTHS) + 1, STATES))
    states[:-1, V] = speeds
    return PlanStages(states, planned, LENGTHS)


def changing(before: float, speed: float, *, rests: bool = False) -> StageBounds:
    config = ControllerConfig(limits=LIMITS, comfort_jerk=2.0)
    change = Change(before, stages(speed), END if rests else inf)
    return stage_bounds(config, 1, END, change=change)


def test_the_acceleration_leaves_the_one_before_at_the_comfort_jerk() -> None:
    got = changing(0.3, 1.0)
    allowed = 2.0 * (np.cumsum(LENGTHS) - LENGTHS + LENGTHS[0])
    np.testing.assert_allclose(got.controls[:, 1, A], np.minimum(0.3 + allowed, 2.0))
    np.testing.assert_allclose(got.controls[:, 0, A], np.maximum(0.3 - allowed, -2.0))


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_who_comes_to_rest_soon_may_let_the_brakes_go(sign: float) -> None:
    """From 0.4 m/s² at 2 m/s³ it takes 0.04 m/s to let them go evenly; twice that is enough to be bound."""
    soon, later = changing(-sign * 0.4, sign * 0.07), changing(-sign * 0.4, sign * 0.09)
    side = 1 if sign > 0.0 else 0
    assert soon.controls[0, side, A] == 0.0
    assert later.controls[0, side, A] == pytest.approx(-sign * 0.3)
    # Harder than evenly it does not brake either way.
    assert soon.controls[0, 1 - side, A] == later.controls[0, 1 - side, A] == pytest.approx(-sign * 0.5)


def test_beyond_the_limits_only_they_count() -> None:
    np.testing.assert_allclose(changing(-3.0, 10.0).controls[0, :, A], [-2.0, 2.0])


def test_a_plan_that_ends_at_rest_lets_the_brakes_go_at_the_comfort_jerk() -> None:
    got, free = changing(0.0, 1.0, rests=True), changing(0.0, 1.0)
    left = 2.0 * np.cumsum(LENGTHS[::-1])[::-1]
    np.testing.assert_allclose(got.controls[:, 0, A], np.maximum(free.controls[:, 0, A], -left))
    np.testing.assert_allclose(got.controls[:, 1, A], np.minimum(free.controls[:, 1, A], left))


def test_the_wheels_turn_within_comfort_next_to_rest_and_where_nothing_presses() -> None:
    config = ControllerConfig(limits=LIMITS, comfort_steering_rate=0.3)
    speeds = np.where(np.arange(len(LENGTHS)) < 10, -0.05, -0.5)
    unpressed = Change(0.0, stages(speeds), pressed=False)
    got = stage_bounds(config, -1, END, change=unpressed._replace(pressed=True))
    np.testing.assert_allclose(got.controls[:10, :, DELTA_DOT], [[-0.3, 0.3]] * 10)
    np.testing.assert_allclose(got.controls[10:, :, DELTA_DOT], [[-0.7, 0.7]] * (len(LENGTHS) - 10))
    calm = stage_bounds(config, -1, END, change=unpressed)
    np.testing.assert_allclose(calm.controls[:, :, DELTA_DOT], [[-0.3, 0.3]] * len(LENGTHS))
    paper = ControllerConfig.paper(limits=LIMITS, comfort_steering_rate=0.3)
    free = stage_bounds(paper, -1, END, change=unpressed)
    np.testing.assert_allclose(free.controls[:, :, DELTA_DOT], [[-0.7, 0.7]] * len(LENGTHS))


def test_a_steering_rate_beyond_comfort_may_go_on_a_little_less_in_the_next_plan() -> None:
    config = ControllerConfig(limits=LIMITS, comfort_steering_rate=0.3)
    turning = np.linspace(-0.9, 0.6, len(LENGTHS))
    planned = STRAIGHT.copy()
    planned[:, DELTA_DOT] = turning
    change = Change(0.0, stages(0.5, planned), pressed=False)
    got = stage_bounds(config, 1, END, change=change).controls[:, :, DELTA_DOT]
    most = np.clip(TURNING_SHARE * np.abs(turning), 0.3, LIMITS.steering_rate)
    np.testing.assert_allclose(got, np.stack([-most, most], axis=1))
