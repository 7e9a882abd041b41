from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from geometry import Pose2
from rti_mpcc.config import ControllerConfig, Limits
from rti_mpcc.ocp.objectives import Target, TargetKind
from rti_mpcc.planning.memory import Situation
from rti_mpcc.safety import ladder
from rti_mpcc.types import Array, Source

CONFIG = ControllerConfig()


def state(v: float = 1.0, delta: float = 0.0) -> Array:
    return np.array([0.0, 0.0, 0.0, v, delta, 0.0])


def before_the_goal(left: float, speed: float, direction: int = 1) -> Situation:
    """`left` [m] before the goal at `speed` [m/s] in the direction of the part."""
    values: dict[str, Any] = {"now": 0.0, "begin": 0.0, "last_part": True, "free": True}
    return Situation(
        state=state(direction * speed),
        measured_speed=direction * speed,
        target=Target(pose=Pose2(0.0, 0.0, 0.0), theta=9.0, theta_end=9.0, kind=TargetKind.POSE),
        direction=direction,
        way=left,
        speed=speed,
        error=Pose2(-direction * left, 0.0, 0.0),
        stop_error=Pose2(0.0, 0.0, 0.0),
        tolerance=(0.05, 0.05, 0.035),
        **values,
    )


def test_a_plan_is_followed_as_it_is_inside_the_limits() -> None:
    drive = ladder.follow(np.array([0.3, -0.2, 1.0]), state(1.0), Source.SOLUTION, CONFIG)
    assert (drive.acceleration, drive.steering_rate, drive.source) == (0.3, -0.2, Source.SOLUTION)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_plan_outside_the_limits_is_cut(sign: float) -> None:
    drive = ladder.follow(sign * np.array([5.05, 1.01, 1.0]), state(1.0), Source.SHIFTED_PLAN, CONFIG)
    assert (drive.acceleration, drive.steering_rate) == (sign * 5.0, sign * 1.0)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_steering_does_not_pass_its_stop(sign: float) -> None:
    stop = CONFIG.limits.steering
    drive = ladder.follow(
        np.array([0.0, sign, 0.0]), state(1.0, sign * (stop - 0.01)), Source.SOLUTION, CONFIG
    )
    assert drive.steering_rate * CONFIG.cycle == pytest.approx(sign * 0.01)
    beyond = ladder.follow(
        np.array([0.0, sign, 0.0]), state(1.0, sign * (stop + 0.1)), Source.SOLUTION, CONFIG
    )
    assert beyond.steering_rate == 0.0


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_braking_is_against_the_motion(sign: float) -> None:
    drive = ladder.brake(state(sign * 2.0, 0.3), 1.6, CONFIG)
    assert drive.acceleration == pytest.approx(-sign * 1.6)
    assert (drive.steering_rate, drive.source) == (0.0, Source.BRAKING)


def test_braking_keeps_to_the_limit() -> None:
    weak = ControllerConfig(limits=Limits(acceleration=0.7))
    assert ladder.brake(state(2.0), 1.6, weak).acceleration == pytest.approx(-0.7)
    assert ladder.braking(weak) == pytest.approx(0.7)
    assert ladder.braking(CONFIG) == pytest.approx(4.0 * CONFIG.comfort_acceleration)


@pytest.mark.parametrize("cycle", [0.005, 0.05, 0.2])
@pytest.mark.parametrize("speed", [0.5, -0.03])
def test_braking_ends_at_rest_without_turning_round(speed: float, cycle: float) -> None:
    config = ControllerConfig(cycle=cycle)
    v = speed
    for _ in range(round(4.0 / cycle)):
        v += cycle * ladder.brake(state(v), 0.4, config).acceleration
        assert v * speed >= -1e-12
    assert abs(v) <= 1e-3


def test_the_steering_goes_on_while_braking_up_to_its_stop_and_not_at_rest() -> None:
    assert ladder.brake(state(1.0, 0.1), 1.6, CONFIG, 0.5).steering_rate == 0.5
    near = ladder.brake(state(1.0, 0.59), 1.6, CONFIG, 0.5).steering_rate
    assert near == pytest.approx(0.01 / CONFIG.cycle)
    assert ladder.brake(state(1.0, -0.59), 1.6, CONFIG, -0.5).steering_rate == pytest.approx(-near)
    assert ladder.brake(state(1.0, 0.62), 1.6, CONFIG, 0.5).steering_rate == 0.0
    assert ladder.brake(state(0.05, 0.1), 1.6, CONFIG, 0.5).steering_rate == 0.0


def test_holding_lets_the_last_of_the_speed_fade_and_never_steers() -> None:
    drive = ladder.hold(state(0.01, 0.3), CONFIG)
    assert drive.acceleration == pytest.approx(-0.01 / ladder.HOLDING_TIME)
    assert (drive.steering_rate, drive.source) == (0.0, Source.STANDSTILL)
    assert ladder.hold(state(0.0), CONFIG).acceleration == 0.0
    assert ladder.hold(state(9.0), CONFIG).acceleration == -CONFIG.limits.acceleration


def test_before_a_contact_it_brakes_as_hard_as_the_way_needs() -> None:
    assert ladder.before_contact(1.0, 10.0, CONFIG) == ladder.braking(CONFIG)
    way = 1.0 + ladder.SPARE
    assert ladder.before_contact(2.5, way, CONFIG) == pytest.approx(2.5**2 / 2.0)
    assert ladder.before_contact(8.0, way, CONFIG) == CONFIG.limits.acceleration
    assert ladder.before_contact(1.0, 0.0, CONFIG) == CONFIG.limits.acceleration


@pytest.mark.parametrize("direction", [1, -1])
def test_landing_comes_to_rest_at_the_goal_within_a_factor_of_the_comfort(direction: int) -> None:
    comfort = CONFIG.comfort_acceleration
    exact = ladder.landing(before_the_goal(0.1, 0.3, direction), CONFIG)
    assert exact == pytest.approx(0.3**2 / 0.2)
    assert ladder.landing(before_the_goal(0.01, 0.3, direction), CONFIG) == 2.0 * comfort
    assert ladder.landing(before_the_goal(1.0, 0.1, direction), CONFIG) == 0.5 * comfort
    assert ladder.landing(before_the_goal(-0.02, 0.1, direction), CONFIG) == 2.0 * comfort
