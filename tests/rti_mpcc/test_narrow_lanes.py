"""The tighter the lane, the slower: never faster than in a wide one, and docked wherever the body fits."""

from __future__ import annotations

import logging
from functools import cache
from itertools import pairwise

import numpy as np
import pytest

from geometry import Corridor, Pose2, ReferencePath
from rti_mpcc import ControllerConfig, DockingController
from tests.rti_mpcc.encounters import Car, Drive, drive

WIDE = 3.0
BEND = 1.0 / 33.0
"""On it the front of the default vehicle reaches 0.21 m farther out than its rear axle."""
LENGTH = 20.0
long = pytest.mark.acceptance


@cache
def driven(half: float, curvature: float, direction: int) -> Drive:
    path = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(direction, curvature, LENGTH)])
    config = ControllerConfig(dead_time=0.18)
    controller = DockingController(path, Corridor.from_offsets(path, left=half, right=-half), config)
    return drive(controller, Car(config=config), path.start, 120.0)


def peaks(found: Drive) -> tuple[float, float]:
    """Highest speed [m/s] and acceleration [m/s²]."""
    return float(np.abs(found.states[:, 3]).max()), max(abs(each.acceleration) for each in found.commands)


@pytest.mark.parametrize(
    ("half", "curvature", "direction"),
    [
        (1.1, 0.0, 1),
        (1.3, BEND, 1),
        *(pytest.param(half, 0.0, d, marks=long) for half in (1.5, 1.25, 1.15, 1.1) for d in (1, -1)),
        *(pytest.param(half, BEND, d, marks=long) for half in (2.0, 1.5, 1.35, 1.3) for d in (1, -1)),
        *(pytest.param(half, -BEND, d, marks=long) for half in (1.4, 1.3) for d in (1, -1)),
    ],
)
def test_no_lane_is_driven_faster_than_a_wide_one(half: float, curvature: float, direction: int) -> None:
    found = driven(half, curvature, direction)
    speed, acceleration = peaks(found)
    most_speed, most_acceleration = peaks(driven(WIDE, curvature, direction))
    assert found.docked
    assert speed <= 1.02 * most_speed
    assert acceleration <= 1.05 * most_acceleration


@pytest.mark.acceptance
@pytest.mark.parametrize("direction", [1, -1])
def test_the_speed_falls_with_the_room(direction: int) -> None:
    speeds = [peaks(driven(half, 0.0, direction))[0] for half in (1.5, 1.25, 1.15, 1.1)]
    assert all(tight <= 1.01 * wide for wide, tight in pairwise(speeds))
    assert speeds[-1] < 0.6 * speeds[0]


@pytest.mark.parametrize(
    ("half", "told"),
    [
        (1.2, None),
        (1.12, "leave 0.085 m beside the body on the path at theta = "),
        (1.06, "no plan is driven that leaves less than 0.05 m"),
    ],
)
def test_a_lane_that_leaves_less_than_the_margin_is_told_when_it_is_built(
    half: float, told: str | None, caplog: pytest.LogCaptureFixture
) -> None:
    path = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(1, 0.0, LENGTH)])
    with caplog.at_level(logging.WARNING):
        DockingController(path, Corridor.from_offsets(path, left=half, right=-half))
    messages = [record.getMessage() for record in caplog.records]
    assert len(messages) == (told is not None)
    if told is not None:
        assert told in messages[0]
