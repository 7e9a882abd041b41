"""Settings: checked copies, units and likely names in errors, vehicles that are whole."""

from __future__ import annotations

import logging
from typing import Any

import pytest

from benchmarks.encounters import on_lane
from geometry import Area, Pose2, ReferencePath
from rti_mpcc import ConfigError, ControllerConfig, Limits, Vehicle
from tests.lists import some_of
from tests.rti_mpcc.yards import Driver, block

CONFIG: Any = ControllerConfig
VEHICLE: Any = Vehicle
LIMITS: Any = Limits
"""For calls that mypy would refuse."""
KINDS = ("rc_car", "delivery_robot", "forklift", "car", "van", "bus")


def test_a_changed_copy_is_checked() -> None:
    config = ControllerConfig(limits=Limits(speed=3.0), cycle=0.1)
    changed = config.changed(cycle=0.02, comfort={"jerk": 2.0}, limits={"acceleration": 2.0})
    assert (changed.cycle, changed.comfort.jerk, changed.limits) == (
        0.02,
        2.0,
        Limits(speed=3.0, acceleration=2.0),
    )
    assert (config.cycle, config.limits) == (0.1, Limits(speed=3.0))
    assert changed.changed() == changed
    assert config.changed(limits=Limits(speed=2.0)).limits == Limits(speed=2.0)


@pytest.mark.parametrize("copied", [lambda c, **v: c.changed(**v), lambda c, **v: c.model_copy(update=v)])
@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"cycle": 77}, r"ControllerConfig\.cycle = 77: .* 0\.2 \[s\]"),
        ({"limits": {"speed": -1.0}}, r"Limits\.speed = -1\.0: .* 0 \[m/s\]"),
        ({"limits": {"sped": 1.0}}, "did you mean 'speed'"),
        ({"limits": None}, r"ControllerConfig\.limits"),
        ({"limits": {1: 2}}, "1 is not a setting"),
    ],
)
def test_a_wrong_change_is_refused(copied: Any, changes: dict[str, Any], said: str) -> None:
    with pytest.raises(ConfigError, match=said):
        copied(ControllerConfig(), **changes)


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: CONFIG(cycel=0.1), "cycel is not a setting; did you mean 'cycle'?"),
        (lambda: CONFIG(wheelbase=1.0), "did you mean 'vehicle.wheelbase'?"),
        (lambda: VEHICLE(wheel_base=1.0), "did you mean 'wheelbase'?"),
        (lambda: LIMITS(speed="3"), "Limits.speed = '3': must be a number, not text"),
        (lambda: LIMITS(speed=True), "Limits.speed = True: must be a number"),
        (lambda: CONFIG(goal_tolerance=(0.1, 0.1, "1")), "must be a number, not text"),
        (lambda: LIMITS(steering=2.0), "[rad]"),
        (lambda: CONFIG(comfort_jerk=-1.0), "[m/s³]"),
        (lambda: CONFIG(comfort_acceleration=9.0), "above limits.acceleration = 5.0 m/s²"),
        (lambda: CONFIG(comfort_steering_rate=1.2), "above limits.steering_rate = 1.0 rad/s"),
        (lambda: ControllerConfig.for_vehicle("forklit"), "did you mean 'forklift'?"),
    ],
)  # fmt: skip
def test_errors_have_the_unit_and_the_likely_name(make: Any, said: str) -> None:
    with pytest.raises(ConfigError) as raised:
        make()
    assert said in str(raised.value)


def test_a_wheelbase_alone_scales_the_body_and_says_so(caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.WARNING):
        small = Vehicle(wheelbase=0.5 * Vehicle().wheelbase)
    assert (small.width, small.front, small.rear) == pytest.approx((1.0345, 1.83875, 0.40135))
    assert "width = 1.03 m, front = 1.84 m, rear = 0.401 m" in caplog.text
    caplog.clear()
    Vehicle(wheelbase=1.1, width=0.8, front=1.3, rear=0.2)
    Vehicle()
    Vehicle(wheelbase=1.0, outline=((1.2, 0.4), (-0.2, 0.4), (-0.2, -0.4), (1.2, -0.4)))
    assert caplog.text == ""
    assert small.changed(wheelbase=Vehicle().wheelbase) == Vehicle()


@pytest.mark.parametrize("kind", some_of(KINDS))
def test_vehicles_of_six_kinds_dock(kind: str) -> None:
    config = ControllerConfig.for_vehicle(kind)
    radius = 1.0 / config.max_curvature
    bend, straight = 0.5 * config.max_curvature, 3.0 * config.vehicle.wheelbase
    path = ReferencePath.from_segments(
        Pose2(0.0, 0.0, 0.0), [(1, 0.0, straight), (1, bend, radius), (1, 0.0, straight)]
    )
    side = config.vehicle.width + 1.0
    open_yard, controller = Area(boundary=block(-99.0, -99.0, 99.0, 99.0)), on_lane(path, side, config)
    driver = Driver(area=open_yard, controller=controller, config=config, goal_at=lambda now: path.end)
    drive = driver.drive(120.0)
    assert drive.docked
    assert drive.error(path.end).within(config.goal_tolerance)
