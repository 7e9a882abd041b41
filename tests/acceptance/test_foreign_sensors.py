"""Foreign vehicles with one faulty sensor each, 20 draws on a path in reverse, into a bay, and in a mission.

python -m pytest tests/acceptance/test_foreign_sensors.py
"""

from __future__ import annotations

import pytest

from benchmarks.foreign import Interface
from benchmarks.foreign_faults import CASES, KINDS, judged

DRAWS = range(1000, 1020)


@pytest.mark.parametrize("interface", ["rates", "setpoints"])
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", CASES)
def test_nothing_is_left_and_the_sensor_is_named(name: str, kind: str, interface: Interface) -> None:
    for seed in DRAWS:
        found = judged(kind, name, interface, seed)
        where = (seed, found.end, found.ride.top_speed, found.left, found.said, found.after)
        assert found.fine, where
        assert found.named, where
