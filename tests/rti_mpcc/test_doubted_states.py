"""Measured states that cannot be true are doubted, at the limits that the settings give."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.encounters import Car, Plant, on_lane
from rti_mpcc import Command, ControllerConfig, DockingController, VehicleState
from rti_mpcc.types import Reason
from rti_mpcc.world.monitor import FROZEN_DISTANCE, FROZEN_SPEED, MODEL_MISMATCH

CONFIG = ControllerConfig()
LIMITS = CONFIG.plausibility


def controller() -> DockingController:
    """A controller in a straight lane."""
    return on_lane(40.0, 3.0, CONFIG)


def after_driving(speed: float, **off: float) -> Command:
    """The command for a state that is `off` the true one, of a vehicle that has driven for half a second."""
    driven, plant = controller(), Plant(car=Car(config=CONFIG), x=0.0, y=0.0, phi=0.0, v=speed)
    for k in range(10):
        command = driven.step(plant.measured, now=CONFIG.cycle * k)
        plant.obey(command, CONFIG.cycle)
    true = plant.measured
    changed = {name: getattr(true, name) + value for name, value in off.items()}
    return driven.step(replace(true, **changed), now=CONFIG.cycle * 10)


def test_a_frozen_state_is_noticed_by_the_speed_that_it_lacks() -> None:
    frozen, standing, speed, distance = controller(), VehicleState(0.0, 0.0, 0.0, 0.0, 0.0), 0.0, 0.0
    for k in range(40):
        command = frozen.step(standing, now=CONFIG.cycle * k)
        if "does not change" in command.diagnostics.reason:
            break
        distance += CONFIG.cycle * (speed + 0.5 * CONFIG.cycle * command.acceleration)
        speed += CONFIG.cycle * command.acceleration
    assert FROZEN_SPEED < speed < FROZEN_SPEED + 0.03
    assert distance < FROZEN_DISTANCE


@pytest.mark.parametrize(("share", "doubted"), [(0.9, False), (1.1, True)])
def test_a_heading_may_be_off_by_what_the_vehicle_can_turn_meanwhile(share: float, doubted: bool) -> None:
    speed = 6.0
    turned = MODEL_MISMATCH * speed * CONFIG.cycle * CONFIG.max_curvature
    command = after_driving(speed, phi=LIMITS.heading + share * turned)
    assert ("heading by" in command.diagnostics.reason) == doubted


@pytest.mark.parametrize("angle", [1.6, -1.6, 10.0])
def test_a_steering_angle_that_no_vehicle_has_is_no_state(angle: float) -> None:
    command = controller().step(VehicleState(0.0, 0.0, 0.0, 0.0, angle), now=0.0)
    assert "not a state that the vehicle can have" in command.diagnostics.reason


def test_steering_that_did_not_follow_is_not_trusted_before_the_vehicle_stood() -> None:
    """For 0.4 s the wheels turn away by themselves, then they follow their commands again."""
    driven, plant = controller(), Plant(car=Car(config=CONFIG), x=0.0, y=0.0, phi=0.0, v=1.5)
    causes, speeds = [], []
    for k in range(60):
        if 10 <= k < 18:
            plant.delta += 0.04
        command = driven.step(plant.measured, now=CONFIG.cycle * k)
        causes.append(command.diagnostics.cause)
        speeds.append(plant.v)
        plant.obey(command, CONFIG.cycle)
    first = next(k for k, cause in enumerate(causes) if cause is Reason.NO_PLAN)
    assert set(causes[first:]) == {Reason.NO_PLAN}
    assert np.all(np.diff(speeds[first + 2 :]) <= 1e-9)
