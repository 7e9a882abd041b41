"""A foreign vehicle with one faulty sensor: nothing is left, the speed stays usual, the sensor is named."""

from __future__ import annotations

import pytest

from benchmarks.foreign import Interface
from benchmarks.foreign_faults import CASES, judged

RIDES = [*((name, "rates", 3) for name in CASES), ("position, speed frozen from 3 s", "setpoints", 1001)]


@pytest.mark.parametrize(("name", "interface", "seed"), RIDES)
def test_a_faulty_sensor_drives_nobody_out_and_is_named(name: str, interface: Interface, seed: int) -> None:
    found = judged("path", name, interface, seed)
    assert found.fine, (found.end, found.ride.top_speed, found.left)
    assert found.named, found.said


def test_a_healthy_vehicle_says_nothing_of_its_sensors() -> None:
    for noisy in (False, True):
        found = judged("path", "healthy", "rates", 3, noisy=noisy)
        assert found.end == "docked"
        reasons = {command.diagnostics.reason for command in found.ride.commands}
        assert not any("sensor" in reason or "the pose" in reason for reason in reasons), reasons


def test_a_vehicle_that_was_stopped_or_set_elsewhere_goes_on_at_once() -> None:
    for name in ("kerb", "stopped for 0.3 s", "stopped for 3 s", "world reset"):
        found = judged("path", name, "rates", 4)
        assert found.end == "docked"
        assert found.ride.docked_at is not None
        assert found.usual.docked_at is not None
        assert found.ride.docked_at < found.usual.docked_at + 8.0, name
