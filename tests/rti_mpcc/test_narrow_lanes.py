"""Lanes and slots hardly wider than the body: slower the tighter, and docked wherever it fits."""

from __future__ import annotations

import logging
from functools import cache
from math import acos, sin

import numpy as np
import pytest

from benchmarks.encounters import Car, Drive, drive, on_lane
from geometry import Corridor, Pose2, ReferencePath
from rti_mpcc import ControllerConfig, DockingController, Vehicle

WIDE = 3.0
BEND = 1.0 / 33.0
"""On it the front of the default vehicle reaches 0.21 m farther out than its rear axle."""
LENGTH, LONG = 20.0, 40.0


@cache
def driven(half: float, curvature: float, direction: int, length: float = LENGTH) -> Drive:
    path = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(direction, curvature, length)])
    config = ControllerConfig(dead_time=0.18)
    return drive(on_lane(path, half, config), Car(config=config), path.start, 120.0)


def peaks(found: Drive) -> tuple[float, float]:
    """Highest speed [m/s] and acceleration [m/s²]."""
    return float(np.abs(found.states[:, 3]).max()), max(abs(each.acceleration) for each in found.commands)


@pytest.mark.acceptance
@pytest.mark.parametrize(
    ("half", "curvature", "direction"),
    [
        (1.3, BEND, 1),
        *((half, 0.0, d) for half in (1.5, 1.25, 1.15, 1.1) for d in (1, -1)),
        *((half, BEND, d) for half in (2.0, 1.5, 1.35) for d in (1, -1)),
        *((half, -BEND, d) for half in (1.4, 1.3) for d in (1, -1)),
    ],
)
def test_no_lane_is_driven_faster_than_a_wide_one(half: float, curvature: float, direction: int) -> None:
    found = driven(half, curvature, direction)
    speed, acceleration = peaks(found)
    most_speed, most_acceleration = peaks(driven(WIDE, curvature, direction))
    assert found.docked
    assert speed <= 1.02 * most_speed
    assert acceleration <= 1.05 * most_acceleration


def test_the_qps_of_a_long_ride_in_a_narrow_lane_are_solved() -> None:
    """It leaves 6.6 cm to either side, so the ride takes a minute and a half."""
    found = driven(1.1, 0.0, 1, LONG)
    assert found.docked
    assert not any(each.diagnostics.failed for each in found.commands)
    assert any(each.diagnostics.interior_point for each in found.commands)
    assert peaks(found)[1] <= ControllerConfig().comfort_acceleration


@pytest.mark.parametrize(
    ("half", "told"),
    [
        (1.2, None),
        (1.12, "leave 0.086 m beside the body on the path at theta = "),
        (1.06, "no plan is driven that leaves less than 0.05 m"),
    ],
)
def test_a_lane_that_leaves_less_than_the_margin_is_told_when_it_is_built(
    half: float, told: str | None, caplog: pytest.LogCaptureFixture
) -> None:
    with caplog.at_level(logging.WARNING):
        on_lane(LENGTH, half)
    messages = [record.getMessage() for record in caplog.records]
    assert len(messages) == (told is not None)
    if told is not None:
        assert told in messages[0]


# -- parallel slots ------------------------------------------------------------------------------------------

CAR = Vehicle(wheelbase=2.7, width=1.8, front=3.6, rear=0.85)
BEHIND = 5.2
"""Radius of the two arcs that lead into a slot, backwards [m]."""


def parked(slot: float, lane: float, kerb: float) -> tuple[Drive, Pose2]:
    """Reverse from a lane, `lane` [m] beside the slot, between two cars that leave `slot` [m], at a kerb."""
    turn, half = acos(1.0 - lane / (2.0 * BEHIND)), 0.5 * CAR.width
    start = Pose2(2.0 * BEHIND * sin(turn) + 3.0, lane, 0.0)
    arcs = [(-1, -1.0 / BEHIND, BEHIND * turn), (-1, 1.0 / BEHIND, BEHIND * turn)]
    path = ReferencePath.from_segments(start, [(-1, 0.0, 3.0), *arcs])
    spare = 0.5 * (slot - CAR.front - CAR.rear)
    ends = ((-CAR.rear - spare - 4.5, -CAR.rear - spare), (CAR.front + spare, CAR.front + spare + 4.5))
    cars = [np.array([[a, -half], [b, -half], [b, half], [a, half]]) for a, b in ends]
    side = -half - kerb
    street = [[-8.0, side], [18.0, side], [18.0, lane + 4.0], [-8.0, lane + 4.0]]
    config = ControllerConfig(vehicle=CAR, dead_time=0.18)
    corridor = Corridor.from_polygon(path, street, obstacles=cars)
    controller = DockingController(path, corridor, config)
    found = drive(controller, Car(config=config), start, 60.0, obstacles_at=lambda now: cars)
    return found, path.end


@pytest.mark.acceptance
@pytest.mark.parametrize(
    ("slot", "lane", "kerb"),
    [
        (5.9, 2.3, 0.3),
        *(
            (slot, *place)
            for slot in (5.6, 5.75, 6.05, 6.2)
            for place in ((2.3, 0.3), (2.5, 0.3), (2.3, 0.5))
        ),
    ],
)
def test_slots_hardly_longer_than_the_car_are_parked_in(slot: float, lane: float, kerb: float) -> None:
    found, goal = parked(slot, lane, kerb)
    error = Pose2(*found.states[-1, :3].tolist()).relative_to(goal)
    assert found.docked
    assert found.clearance > 0.0
    assert max(abs(error.x), abs(error.y)) < 0.05
