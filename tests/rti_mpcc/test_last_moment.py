"""Seen at the last moment: people close by, overlaps within the dead time, escapes towards other contacts.

The plant and the judge are those of `encounters`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from benchmarks.encounters import Car, Drive, Outlines, drive, on_lane, square
from geometry import Pose2
from rti_mpcc import ControllerConfig, Source, Status
from rti_mpcc.types import Array
from tests.rti_mpcc.yards import block

FRONT, REAR = ControllerConfig().vehicle.front, ControllerConfig().vehicle.rear


def driven(
    seconds: float,
    obstacles_at: Callable[[float], Outlines],
    *,
    x: float = 0.0,
    v: float = 0.0,
    **changes: Any,
) -> Drive:
    config = ControllerConfig(dead_time=0.18, **changes)
    controller, start = on_lane(40.0, 3.0, config), Pose2(x, 0.0, 0.0)
    return drive(controller, Car(config=config), start, seconds, obstacles_at=obstacles_at, v=v)


def across(near: float, length: float = 0.5) -> Array:
    """A wall across the lane, `near` [m] ahead of x = 0."""
    return block(near, -2.9, near + length, 2.9)


def test_a_wall_close_ahead_is_braked_for_harder_than_in_comfort() -> None:
    """It appears 2 m ahead. In comfort a stop takes 5 m, at the limits 0.4 m after 0.36 m of dead time."""
    wall = across(FRONT + 4.0)
    found = driven(5.0, lambda now: [wall] if now >= 1.0 else [], v=2.0)
    assert found.clearance > 0.0
    assert abs(found.states[-1, 3]) < 0.02


def test_a_wall_that_the_dead_time_leads_into_is_overlapped_at_once() -> None:
    wall = across(FRONT + 2.045 + 0.2)  # at 2 m/s the dead time takes 0.37 m
    found = driven(1.1, lambda now: [wall] if now >= 1.0 else [], v=2.0)
    told = found.commands[20]
    assert told.status is Status.BLOCKED
    assert told.diagnostics.reason.startswith("the body overlaps obstacles[0]")
    assert told.acceleration == pytest.approx(-ControllerConfig().limits.acceleration)


def test_a_vehicle_at_rest_waits_for_somebody_who_walks_across_close_ahead() -> None:
    found = driven(6.0, lambda now: [square(FRONT + 0.8, now - 2.6, 0.6)])
    passed = found.times < 2.6 + 1.4  # then he is beside the body
    assert np.abs(found.states[passed, 3]).max() < 0.02
    assert len(found.resumptions) == 1


def test_a_vehicle_that_stops_for_somebody_who_comes_head_on_does_not_resume() -> None:
    found = driven(9.0, lambda now: [square(30.0 - now, 0.0, 0.6)], v=2.0)
    assert any(command.status is Status.BLOCKED for command in found.commands)
    assert found.resumptions == []
    assert found.clearance > 3.0


@pytest.mark.parametrize(("gap", "escapes"), [(1.5, True), (0.17, False)])
def test_out_of_one_contact_it_does_not_creep_near_another(gap: float, escapes: bool) -> None:
    """A wall is 0.15 m in the front, another one stands `gap` behind the rear."""
    walls = [across(10.0 + FRONT - 0.15), across(10.0 - REAR - gap - 0.5)]
    found = driven(0.5, lambda now: walls, x=10.0, escape_speed=0.2)
    assert (Source.ESCAPE in {command.source for command in found.commands}) == escapes
