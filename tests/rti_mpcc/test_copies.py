"""Controllers and missions can be pickled and copied during a ride: the copy drives on, and docks."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable
from typing import Any

import pytest

from rti_mpcc import Command, VehicleState
from rti_mpcc.simulation import Scenario, changed, driver_of, load_scenario, simulate, summary
from tests.lists import acceptance
from tests.rti_mpcc.docking_runs import short as brief
from tests.rti_mpcc.short_missions import short


class Copying:
    """Drives on with a copy of the controller every 40 cycles."""

    def __init__(self, driver: Any, copied: Callable[[Any], Any]) -> None:
        self.controller, self.copied, self.cycles = driver, copied, 0

    def step(self, state: VehicleState, **given: Any) -> Command:
        self.cycles += 1
        if self.cycles % 40 == 0:
            # In place, for the simulation watches the first one.
            vars(self.controller).update(vars(self.copied(self.controller)))
        command: Command = self.controller.step(state, **given)
        return command


def pickled(driver: Any) -> Any:
    return pickle.loads(pickle.dumps(driver))


@pytest.mark.parametrize(
    ("name", "copied"),
    [
        ("short", pickled),
        acceptance("docking_inside", pickled),
        acceptance("bay_perpendicular", copy.deepcopy),
        acceptance("docking_noisy", pickled),
        acceptance("docking_full_course", copy.deepcopy),
    ],
)
def test_a_ride_of_copies_is_as_good(name: str, copied: Callable[[Any], Any]) -> None:
    scenario = brief() if name == "short" else load_scenario(name)
    usual, ride = (
        summary(simulate(scenario)),
        summary(simulate(scenario, controller=Copying(driver_of(scenario), copied))),
    )
    assert ride["docked"]
    assert ride["time_to_dock_s"] == pytest.approx(usual["time_to_dock_s"], rel=0.02)
    assert ride["solver"]["failures"] == 0
    for name, value in usual["energy_to_dock"].items():
        assert ride["energy_to_dock"][name] == pytest.approx(value, rel=0.05), name


def test_a_mission_of_copies_succeeds() -> None:
    scenario: Scenario = short()
    result = simulate(scenario, controller=Copying(driver_of(scenario), pickled))
    assert result.mission_result is not None
    assert result.mission_result.value == "SUCCEEDED"


def test_a_copy_takes_nothing_from_the_original() -> None:
    """The original commands to the bit what a controller does that was never copied."""
    scenario = changed(load_scenario("docking_inside"), {"simulation.duration": 3.0})

    def aside(driver: Any) -> Any:
        other = pickled(driver)
        for k in range(3):
            other.step(VehicleState(50.0, 50.0, 0.0, 0.0, 0.0), now=100.0 + k)
        return driver

    ride, usual = simulate(scenario, controller=Copying(driver_of(scenario), aside)), simulate(scenario)
    assert ride.cycles.acceleration.tolist() == usual.cycles.acceleration.tolist()
    assert ride.cycles.steering_rate.tolist() == usual.cycles.steering_rate.tolist()
