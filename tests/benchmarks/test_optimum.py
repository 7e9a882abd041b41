"""The programs of the off-line optimum, on motions whose best is known, and past an obstacle."""

from __future__ import annotations

from math import sqrt
from typing import Any

import numpy as np
import pytest

from benchmarks.optimum import CLEARANCE, STAGES, TOUCH, Docking, Motion, in_short, ratios
from rti_mpcc.simulation import Scenario
from tests.rti_mpcc.docking_runs import on_segments

WAY = 12.0


def straight(**corridor: Any) -> Scenario:
    wide = {"left": 4.0, "right": -4.0, **corridor}
    return on_segments([(-1, 0.0, WAY)], (1.0, 2.0, 0.6), corridor=wide)


def even(time: float) -> Motion:
    """Backwards along the path, evenly: it does not even begin at rest."""
    s = np.linspace(0.0, WAY, STAGES + 1)
    poses = np.column_stack([1.0 - s * np.cos(0.6), 2.0 - s * np.sin(0.6), np.full_like(s, 0.6)])
    states = np.column_stack([poses, np.full_like(s, -WAY / time), np.zeros_like(s)])
    return Motion(time=time, states=states, controls=np.zeros((STAGES, 2)))


def test_the_least_energy_over_a_straight_way_is_that_of_a_cubic() -> None:
    time = 15.0
    found = Docking.of(straight(), even(time)).solved("energy", even(time), {})
    assert found is not None
    energy = time / STAGES * float(np.sum(found.controls[:, 0] ** 2))
    assert energy == pytest.approx(12.0 * WAY**2 / time**3, rel=2e-3)
    assert np.abs(found.states[:, 4]).max() < 1e-4


def test_the_least_ride_over_a_straight_way_is_full_acceleration_with_ramps() -> None:
    docking = Docking.of(straight(), even(15.0))
    found = docking.solved("ride", even(15.0), {})
    assert found is not None
    ramp = docking.config.comfort.acceleration / docking.config.comfort.jerk
    expected = ramp + sqrt(ramp**2 + 4.0 * WAY / docking.config.comfort.acceleration)
    assert found.time == pytest.approx(expected, rel=0.02)
    assert np.abs(found.controls[:, 0]).max() <= docking.config.comfort.acceleration + 1e-6


def test_the_least_time_takes_no_more_energy_than_it_may() -> None:
    most = {"acceleration": 0.4, "steering_rate": 0.1, "lateral_acceleration": 0.1}
    found = Docking.of(straight(), even(15.0)).solved("time", even(15.0), most)
    assert found is not None
    # 12 D² / T³ = 0.4
    assert found.time == pytest.approx((12.0 * WAY**2 / 0.4) ** (1.0 / 3.0), rel=5e-3)


@pytest.mark.acceptance
def test_the_body_keeps_clear_of_what_stands_there() -> None:
    c, s = np.cos(0.6), np.sin(0.6)

    def placed(along: float, across: float) -> list[float]:
        return [1.0 - along * c - across * s, 2.0 - along * s + across * c]

    box = [placed(5.0, 0.9), placed(7.0, 0.9), placed(7.0, 3.0), placed(5.0, 3.0)]
    docking = Docking.of(straight(obstacles=[box]), even(20.0))
    begin = even(20.0)
    assert docking.clearance(begin) < 0.0
    found = docking.solved("energy", begin, {})
    assert found is not None
    assert docking.clearance(found) >= CLEARANCE - TOUCH
    assert np.abs(found.states[:, 4]).max() > 0.01


def test_ratios_are_of_what_was_found() -> None:
    ride = {"time": 20.0, "energy": {"acceleration": 0.5}}
    run = {"scenario": "one", "rides": {"smooth": ride, "brisk": {**ride, "time": 17.0}}}
    least = {"least_time": 19.0, "least_energy": None, "least_ride": 16.0}
    found = ratios({**run, **least})
    assert found == {
        "smooth": pytest.approx(20.0 / 19.0),
        "energy": None,
        "brisk": pytest.approx(17.0 / 16.0),
    }
    lost = {"scenario": "two", "why": "it did not dock"}
    assert set(ratios(lost).values()) == {None}
    said = in_short([{**run, **least}, lost])
    assert "median 1.053, p95 1.053 (1 of 2)" in said
