"""A person who walks in a far-off corner, given as obstacle in each cycle, changes no command."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from geometry import Area, Pose2
from rti_mpcc.types import Array
from tests.rti_mpcc.yards import Drive, Driver, block

OUTLINE = [(-8.0, -8.5), (22.0, -8.5), (22.0, 8.0), (-8.0, 8.0)]
BAY = Area(
    boundary=OUTLINE,
    obstacles=[block(8.0, -8.0, 10.2, -2.8), block(13.6, -8.0, 15.8, -2.8)],
)
"""A bay 3.4 m wide between two parked vehicles, with a wall behind it."""
IN_BAY = Pose2(11.9, -3.9, -0.5 * np.pi)
"""Nose to the wall, 0.92 m before it."""
CORNER = 12.0
"""Height above the road at which the person walks [m]: 4 m behind its wall, 10 m from the vehicle."""

Walk = Callable[[float], float]


def to_and_fro(now: float) -> float:
    """Place along the wall [m], at 1.5 m/s at most."""
    return float(np.sin(1.5 * now))


def stops_between(now: float) -> float:
    """The same at 1 m/s: 2 s in one direction, 3 s of rest, and back."""
    phase = now % 10.0
    return min(phase, 2.0) if phase < 5.0 else 2.0 - min(phase - 5.0, 2.0)


def person(walk: Walk, now: float) -> Array:
    """Outline (4, 2) [m]."""
    x = 20.0 + walk(now)
    return block(x - 0.3, CORNER - 0.3, x + 0.3, CORNER + 0.3)


def ride(walk: Walk | None) -> Drive:
    """Into the bay, with a person who walks or with none."""
    driver = Driver(
        area=BAY,
        goal_at=lambda now: IN_BAY,
        obstacles_at=lambda now: [] if walk is None else [person(walk, now)],
        standing_at=lambda now: [],
    )
    return driver.drive(60.0)


@pytest.mark.parametrize("walk", [to_and_fro, stops_between])
def test_in_an_area(walk: Walk) -> None:
    alone, together = ride(None), ride(walk)
    assert alone.docked
    np.testing.assert_array_equal(together.commanded(), alone.commanded())
