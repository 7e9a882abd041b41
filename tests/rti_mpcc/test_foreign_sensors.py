"""A foreign vehicle with one faulty sensor: nothing is left, the speed stays usual, the sensor is named."""

from __future__ import annotations

import pytest

from benchmarks.foreign_faults import CASES, judged


@pytest.mark.parametrize("name", [*CASES, "position, speed frozen from 3 s by set-points"])
def test_a_vehicle_with_a_faulty_sensor_keeps_to_its_corridor_and_says_which(name: str) -> None:
    by_speed = name.endswith(" by set-points")  # which must come to nothing where nobody sees them drive
    of = judged(
        "path", name.removesuffix(" by set-points"), *(("setpoints", 1001) if by_speed else ("rates", 3))
    )
    assert of.fine, (of.end, of.ride.top_speed, of.left)
    assert of.named, of.said


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
