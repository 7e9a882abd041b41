from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from geometry import Pose2
from rti_mpcc.config import ControllerConfig, Limits
from rti_mpcc.model.bicycle import rollout
from rti_mpcc.ocp.targets import Target, TargetKind
from rti_mpcc.planning.context import PlanningContext
from rti_mpcc.planning.pace import Pace
from rti_mpcc.safety import fallback
from rti_mpcc.safety.fallback import HOLDING_TIME, SETTLING_FACTOR, STOP_DISTANCE
from rti_mpcc.types import Array, Source, Trajectory

CONFIG = ControllerConfig()


def state(v: float = 1.0, delta: float = 0.0) -> Array:
    return np.array([0.0, 0.0, 0.0, v, delta, 0.0])


def before_the_goal(
    left: float, speed: float, direction: int = 1, deceleration: float = 0.0
) -> PlanningContext:
    """`left` [m] before the goal at `speed` [m/s] in the direction of the part, braking already."""
    values: dict[str, Any] = {"now": 0.0, "begin": 0.0, "doubt": "", "ends_at_goal": True, "free": True}
    return PlanningContext(
        state=state(direction * speed),
        acceleration=-direction * deceleration,
        measured_speed=direction * speed,
        target=Target(pose=Pose2(0.0, 0.0, 0.0), theta=9.0, theta_end=9.0, kind=TargetKind.POSE),
        direction=direction,
        along=left,
        distance=left,
        speed=speed,
        pace=Pace(theta=np.array([0.0, 9.0]), speed=np.array([10.0, 10.0])),
        error=Pose2(-direction * left, 0.0, 0.0),
        standing_error=Pose2(-direction * left, 0.0, 0.0),
        stop_error=Pose2(0.0, 0.0, 0.0),
        tolerance=(0.05, 0.05, 0.035),
        half_turn=13.0,
        **values,
    )


def test_a_plan_is_followed_as_it_is() -> None:
    control = fallback.follow(np.array([0.3, -0.2, 1.0]), Source.SOLUTION)
    assert (control.acceleration, control.steering_rate, control.source) == (0.3, -0.2, Source.SOLUTION)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_braking_is_against_the_motion(sign: float) -> None:
    control = fallback.brake(state(sign * 2.0, 0.3), 1.6, CONFIG)
    assert control.acceleration == pytest.approx(-sign * 1.6)
    assert (control.steering_rate, control.source) == (0.0, Source.BRAKING)


def test_braking_keeps_to_the_limit() -> None:
    weak = ControllerConfig(limits=Limits(acceleration=0.7))
    assert fallback.brake(state(2.0), 1.6, weak).acceleration == pytest.approx(-0.7)
    assert weak.firm_deceleration == pytest.approx(0.7)
    assert CONFIG.firm_deceleration == pytest.approx(4.0 * CONFIG.comfort_acceleration)


@pytest.mark.parametrize("cycle", [0.005, 0.05, 0.2])
@pytest.mark.parametrize("speed", [0.5, -0.03])
def test_braking_ends_at_rest_without_turning_round(speed: float, cycle: float) -> None:
    config = ControllerConfig(cycle=cycle)
    v = speed
    for _ in range(round(4.0 / cycle)):
        v += cycle * fallback.brake(state(v), 0.4, config).acceleration
        assert v * speed >= -1e-12
    assert abs(v) <= 1e-3


@pytest.mark.parametrize("speed", [0.5, -0.5])
def test_hard_braking_is_hard_to_the_last_cycle(speed: float) -> None:
    """Softness costs way: what is braked for may be near."""
    hard = fallback.brake(state(speed), 5.0, CONFIG)
    assert hard.acceleration == pytest.approx(-np.sign(speed) * 5.0)
    last = fallback.brake(state(0.1 * speed), 5.0, CONFIG)
    assert last.acceleration * CONFIG.cycle == pytest.approx(-0.1 * speed)


def test_the_steering_goes_on_while_braking_and_not_at_rest() -> None:
    assert fallback.brake(state(1.0, 0.1), 1.6, CONFIG, 0.5).steering_rate == 0.5
    assert fallback.brake(state(0.05, 0.1), 1.6, CONFIG, 0.5).steering_rate == 0.0


def plan(begin: float = 0.0, speed: float = 1.0) -> Trajectory:
    """Straight on, speeding up at 0.1 m/s²."""
    times = begin + np.linspace(0.0, 5.0, 11)
    controls = np.tile([0.1, 0.0, speed], (10, 1))
    return Trajectory(
        times=times, states=rollout(state(speed), controls, np.diff(times), 2.875), controls=controls
    )


def test_the_last_plan_is_driven_on_from_where_the_vehicle_is() -> None:
    context = replace(before_the_goal(9.0, 1.05), now=0.5, begin=0.5)
    context.state[:] = [0.6, 0.1, 0.0, 1.0, 0.02, 0.6]
    on = fallback.shifted_plan(plan(), 0.0, context, CONFIG)
    assert on is not None
    assert on.states[0].tolist() == context.state.tolist()
    assert on.controls[0, 0] == pytest.approx(0.1)
    assert on.states[5, 3] == pytest.approx(1.0 + 0.1 * 2.5)
    assert on.states[5, 1] > 0.1  # the steering it has is driven, not the plan's


@pytest.mark.parametrize(
    ("accepted_at", "x", "y", "phi"),
    [(-0.6, 0.5, 0.0, 0.0), (0.6, 0.5, 0.0, 0.0), (0.0, 0.5, 0.6, 0.0), (0.0, 0.5, 0.0, 0.3)],
)
def test_a_plan_that_is_old_or_far_off_is_not_driven_on(
    accepted_at: float, x: float, y: float, phi: float
) -> None:
    context = replace(before_the_goal(9.0, 1.05), now=0.5, begin=0.5)
    context.state[:3] = [x, y, phi]
    assert fallback.shifted_plan(plan(), accepted_at, context, CONFIG) is None
    assert fallback.shifted_plan(None, 0.0, context, CONFIG) is None


def test_holding_lets_the_last_of_the_speed_fade_and_never_steers() -> None:
    control = fallback.hold(state(0.01, 0.3), CONFIG)
    assert control.acceleration == pytest.approx(-0.01 / HOLDING_TIME)
    assert (control.steering_rate, control.source) == (0.0, Source.STANDSTILL)
    assert fallback.hold(state(0.0), CONFIG).acceleration == 0.0
    assert fallback.hold(state(9.0), CONFIG).acceleration == -CONFIG.limits.acceleration


def test_before_a_contact_it_brakes_as_hard_as_the_way_needs() -> None:
    assert fallback.before_contact(1.0, 10.0, CONFIG) == CONFIG.comfort_acceleration
    distance = 1.0 + STOP_DISTANCE
    assert fallback.before_contact(2.5, distance, CONFIG) == pytest.approx(2.5**2 / 2.0)
    assert fallback.before_contact(8.0, distance, CONFIG) == CONFIG.limits.acceleration
    assert fallback.before_contact(1.0, 0.0, CONFIG) == CONFIG.limits.acceleration


@pytest.mark.parametrize("direction", [1, -1])
@pytest.mark.parametrize(("left", "speed", "before"), [(0.1, 0.25, 0.3), (0.15, 0.3, 0.2), (0.06, 0.2, 0.36)])
def test_settling_goes_on_braking_without_a_step_to_rest_at_the_goal(
    left: float, speed: float, before: float, direction: int
) -> None:
    cycle, steps = CONFIG.cycle, [before]
    while speed > 1e-4 and len(steps) < 200:
        context = before_the_goal(left, speed, direction, steps[-1])
        wanted = fallback.settling_deceleration(context, CONFIG)
        braked = fallback.brake(context.state, wanted, CONFIG, before=context.deceleration)
        assert braked.acceleration * direction <= 0.0
        steps.append(-direction * braked.acceleration)
        left -= cycle * (speed - 0.5 * cycle * steps[-1])
        speed -= cycle * steps[-1]
    assert abs(left) < 0.008
    assert np.abs(np.diff(steps)).max() <= 1.25 * CONFIG.comfort.jerk * cycle


def test_settling_stays_within_a_factor_of_the_comfort() -> None:
    comfort = CONFIG.comfort_acceleration
    most = SETTLING_FACTOR * comfort
    past = before_the_goal(-0.02, 0.1, deceleration=most)
    assert fallback.settling_deceleration(past, CONFIG) == pytest.approx(most)
    assert fallback.settling_deceleration(before_the_goal(1.0, 0.1), CONFIG) == 0.5 * comfort


def test_an_even_change_of_deceleration_stops_where_it_is_to() -> None:
    """Against the closed form: v and s of a deceleration b - j t."""
    v, b, s = 0.4, 0.2, 0.25
    root = np.sqrt(4.0 * v**2 / 9.0 - 2.0 / 3.0 * b * s)
    duration = 2.0 * s / (2.0 / 3.0 * v + root)
    j = 2.0 * (b * duration - v) / duration**2
    assert v - b * duration + 0.5 * j * duration**2 == pytest.approx(0.0, abs=1e-12)
    assert v * duration - 0.5 * b * duration**2 + j * duration**3 / 6.0 == pytest.approx(s)
    assert fallback._eased(v, s, b, 0.05) == pytest.approx(b - 0.05 * j)
    # Braking too hard already it is let go, as far as the speed lets it.
    assert fallback._eased(0.2, 0.5, 0.4, 0.05) == pytest.approx(0.4 - 0.05 * 0.4**2 / (2.0 * 0.2))


def test_comfort_begins_to_brake_without_a_step_and_need_does_not() -> None:
    step = CONFIG.comfort.jerk * CONFIG.cycle
    assert fallback.brake(state(1.0), 0.4, CONFIG, before=-0.2).acceleration == pytest.approx(-step)
    assert fallback.brake(state(1.0), 0.4, CONFIG, before=0.1).acceleration == pytest.approx(-0.1 - step)
    assert fallback.brake(state(1.0), 1.6, CONFIG, before=0.1).acceleration == pytest.approx(-1.6)


def test_at_the_begin_of_a_standstill_the_brakes_are_let_go_evenly() -> None:
    step = CONFIG.comfort.jerk * CONFIG.cycle
    assert fallback.hold(state(0.02), CONFIG, -0.15).acceleration == pytest.approx(-0.15 + step)
    # Let go evenly they would more than stop it, or it is noise: only the speed counts.
    for speed, before in ((0.001, -0.15), (0.02, 0.1)):
        assert fallback.hold(state(speed), CONFIG, before) == fallback.hold(state(speed), CONFIG)
