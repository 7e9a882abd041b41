"""A drive that lags is braked in time with any cycle, however much of its lag is inverted."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.foreign import Car, drive
from rti_mpcc import ActuatorModel, ControllerConfig, Corridor, DockingController, Pose2, ReferencePath
from tests.lists import some_of


@pytest.mark.parametrize(
    ("cycle", "lag"), some_of([(0.01, 0.05), (0.01, 0.5), (0.02, 0.1), (0.02, 0.3), (0.05, 0.5)])
)
@pytest.mark.parametrize("kind", some_of(["delivery_robot", "car"]))
def test_a_lag_of_any_length_is_braked_for_in_time(cycle: float, lag: float, kind: str) -> None:
    actuators = ActuatorModel(drive_lag=lag)
    config = ControllerConfig.for_vehicle(kind, ride="brisk", cycle=cycle, deadline=None, actuators=actuators)
    path = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(-1, 0.0, 2.75 * config.vehicle.wheelbase)])
    controller = DockingController(path, Corridor.from_offsets(path, left=5.0, right=-5.0), config)
    car = Car.driven_by(config, drive_lag=lag)
    ride = drive(controller.step, car, path.start, cycle=cycle, seconds=15.0, after_docked=1.0)
    assert ride.docked_at is not None
    assert ride.inside(path.end, config.goal_tolerance)
    assert ride.truth[:, 1].min() > path.end.x - 0.05
    assert np.abs(ride.acceleration).max() <= 1.25 * config.comfort_acceleration
