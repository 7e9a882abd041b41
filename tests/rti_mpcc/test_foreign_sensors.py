"""A foreign vehicle with one faulty sensor: nothing is left, the speed stays usual, the sensor is named."""

from __future__ import annotations

import pytest

from benchmarks.foreign import Interface
from benchmarks.foreign_faults import CASES, free_space, healthy_ride, judged
from rti_mpcc import Status

IN_KIND = (
    *("speed without sign", "speed x 0.7", "speed 0.3 s late", "all frozen", "steering + 0.1 rad"),
    *("steering of wrong sign", "steering limp", "pose 0.3 s late", "pose jumping 0.5 m"),
    *("pose drifting 0.1 m/s ahead", "pose of the middle", "kerb", "stopped for 0.3 s", "stopped for 3 s"),
    *("world reset", "time stands still from 3 s"),
)
"""The others differ in size or time only; tests/acceptance drives them all."""
RIDES = [*((name, "rates", 3) for name in IN_KIND), ("position, speed frozen from 3 s", "setpoints", 1001)]


@pytest.mark.parametrize(("name", "interface", "seed"), RIDES)
def test_a_faulty_sensor_drives_nobody_out_and_is_named(name: str, interface: Interface, seed: int) -> None:
    found = judged("path", name, interface, seed)
    assert found.fine, (found.end, found.ride.top_speed, found.left)
    assert found.named, found.said
    if CASES[name].events:  # no fault of a sensor: it resumes at once
        assert found.end == "docked"
        assert found.ride.docked_at is not None
        assert found.usual.docked_at is not None
        assert found.ride.docked_at < found.usual.docked_at + 8.0


@pytest.mark.parametrize("noisy", [False, True])
def test_a_healthy_vehicle_says_nothing_of_its_sensors(noisy: bool) -> None:
    ride = healthy_ride("path", "rates", 3, noisy)
    assert ride.commands[-1].status is Status.DOCKED
    assert not ride.leaves(free_space("path"))
    reasons = {command.diagnostics.reason for command in ride.commands}
    assert not any("sensor" in reason or "the pose" in reason for reason in reasons), reasons
