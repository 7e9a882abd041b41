"""On slopes, with wheels that stand beside what is measured: docked by the truth, or told why not.

The plant is that of `encounters`, not the package's own; of slope and offset the controller knows nothing.
"""

from __future__ import annotations

from functools import cache
from math import hypot, radians

import numpy as np
import pytest

from benchmarks.encounters import Car, Drive, drive, on_lane
from geometry import Pose2, ReferencePath
from rti_mpcc import ControllerConfig, Limits, Status
from tests.lists import acceptance

CONFIG = ControllerConfig(dead_time=0.18)
OFFSET = radians(2.0)
NOISE = (0.01, 0.01, 0.002, 0.015, 0.002)
SLOWER = 1.15
"""So many times the undisturbed time it may take."""

SEGMENTS = {
    "forward": [(1, 0.0, 3.0), (1, 0.12, 5.0), (1, -0.1, 4.0), (1, 0.0, 2.0)],
    "reverse": [(-1, 0.0, 3.0), (-1, 0.12, 5.0), (-1, -0.1, 4.0), (-1, 0.0, 2.0)],
    "tight": [(-1, 0.2, 4.0), (-1, -0.1, 6.0), (-1, 0.23, 8.0)],
    "cusp": [(1, 0.0, 4.0), (1, 0.1, 4.0), (-1, -0.1, 4.0), (-1, 0.1, 4.0)],
}
COURSES = {name: ReferencePath.from_segments(Pose2(0.0, 0.0, 0.4), rows) for name, rows in SEGMENTS.items()}


def driven(
    course: str,
    *,
    slope: float = 0.0,
    offset: float = 0.0,
    seconds: float = 60.0,
    config: ControllerConfig = CONFIG,
    noise: int | None = None,
    until_docked: bool = True,
    lag: float = 0.0,
    turn: float = 1.0,
) -> Drive:
    path = COURSES[course]
    return drive(
        on_lane(path, 5.0, config),
        Car(config=config, slope=slope, offset=offset, lag=lag, turn=turn),
        path.start,
        seconds,
        noise=None if noise is None else np.random.default_rng(noise),
        stds=NOISE,
        until_docked=until_docked,
    )


@cache
def undisturbed(course: str) -> float:
    """Time to the dock [s]."""
    return float(driven(course).times[-1])


def check_docked(result: Drive, course: str) -> None:
    """By the truth inside the tolerance and at rest, in time, with commands within the limits."""
    assert result.docked, result.commands[-1].diagnostics.reason
    error = Pose2(*result.states[-1, :3]).relative_to(COURSES[course].end)
    along, across, heading = CONFIG.goal_tolerance
    assert abs(error.x) <= along, error
    assert abs(error.y) <= across, error
    assert abs(error.phi) <= heading, error
    assert abs(result.states[-1, 3]) <= 0.02
    assert result.times[-1] <= SLOWER * undisturbed(course)
    assert all(abs(command.acceleration) <= CONFIG.limits.acceleration for command in result.commands)


@pytest.mark.parametrize(
    ("course", "slope", "offset"),
    [
        acceptance("cusp", 0.3, 0.0),
        acceptance("cusp", -0.5, OFFSET),
        ("forward", -0.3, -OFFSET),
        acceptance("reverse", 0.5, OFFSET),
    ],
)
def test_docks_in_time(course: str, slope: float, offset: float) -> None:
    result = driven(course, slope=slope, offset=offset)
    check_docked(result, course)
    told = result.commands[-1].diagnostics
    assert told.disturbance == pytest.approx(slope, abs=0.03)
    assert told.steering_offset == pytest.approx(offset, abs=0.005)


@pytest.mark.acceptance
@pytest.mark.parametrize(("slope", "offset"), [(0.3, 0.0), (-0.5, OFFSET), (0.5, -OFFSET)])
def test_docks_with_actuators_that_lag(slope: float, offset: float) -> None:
    seconds = SLOWER * undisturbed("cusp") + 5.0
    result = driven("cusp", slope=slope, offset=offset, lag=0.2, seconds=seconds, until_docked=False)
    assert all(command.docked for command in result.commands[-100:])
    assert np.abs(result.states[-60:, 3]).max() < 0.02
    error = Pose2(*result.states[-1, :3]).relative_to(COURSES["cusp"].end)
    assert max(abs(error.x), abs(error.y)) <= 0.05


def test_a_vehicle_that_turns_too_widely_plans_with_that() -> None:
    """It makes room for the last bend, which it takes at full steering: that took 34 s, with a second try."""
    result = driven("tight", turn=0.94)
    check_docked(result, "tight")
    assert {np.sign(round(v, 2)) for v in result.states[:, 3]} <= {-1.0, 0.0}  # in one go


@pytest.mark.acceptance
def test_a_docked_vehicle_is_held_on_a_slope() -> None:
    result = driven("forward", slope=-0.3, noise=2, seconds=undisturbed("forward") + 15.0, until_docked=False)
    held = np.array([command.docked for command in result.commands])
    assert held[-200:].all()
    at = result.states[-200:]
    assert hypot(*np.ptp(at[:, :2], axis=0)) < 0.03  # a noisy speed of 15 mm/s makes 11 mm in 10 s
    assert np.abs(at[:, 3]).max() < 0.02


WEAK = ControllerConfig(dead_time=0.18, limits=Limits(acceleration=0.5))


@pytest.mark.parametrize("slope", [-0.6, 0.6])
def test_a_drive_that_is_too_weak_says_so(slope: float) -> None:
    result = driven("forward", slope=slope, seconds=6.0, config=WEAK)
    for command in result.commands[20:]:
        assert command.status is Status.FAILED
        assert "the drive is too weak for the slope: to hold the vehicle takes" in command.diagnostics.reason
        assert "the limit is 0.50 m/s²" in command.diagnostics.reason
        assert command.acceleration * slope <= 0.0
        assert abs(command.acceleration) <= WEAK.limits.acceleration
    assert result.commands[-1].diagnostics.disturbance == pytest.approx(slope, abs=0.05)
