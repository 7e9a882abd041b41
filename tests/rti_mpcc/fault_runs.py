"""Runs with faults, what was told and commanded in them, and what is promised of every one."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from rti_mpcc.simulation import RunResult, Scenario, changed, docking_controller, simulate
from rti_mpcc.simulation.faults import Disturbances
from rti_mpcc.simulation.metrics import body_clearances
from rti_mpcc.simulation.plant import SAME_TIME, PlantState, advance, issue
from rti_mpcc.types import Command, Source, Status, VehicleState
from tests.rti_mpcc.docking_runs import docking_figures, statuses

ROUNDING = 1e-9
STANDS = 0.02
"""Slower than this [m/s] is standing."""
HARDER, DEEPER = 0.1, 0.05
"""What braking at once touches too may be touched so much faster [m/s], and so much deeper [m]."""
MAY_STAND = (Status.STALLED, Status.BLOCKED, Status.FAILED, Status.GOAL_LOST, Status.SEARCHING)
"""What a vehicle may say that stands elsewhere than at its goal."""


def with_fault(
    scenario: Scenario, kind: str, begin: float, seconds: float, size: float | None = None
) -> Scenario:
    """The scenario with one fault, from `begin` on for so many seconds."""
    return changed(scenario, {"faults": [{"kind": kind, "from": begin, "to": begin + seconds, "size": size}]})


class BrakesFully:
    """A `DockingController` until the first fault; from then on full braking to a standstill, steering held.

    It knows from its own commands what the vehicle does, whatever is measured.
    """

    def __init__(self, scenario: Scenario) -> None:
        self.controller = docking_controller(scenario)
        self._faults = Disturbances(faults=scenario.faults)
        self._begin = min(fault.begin for fault in scenario.faults)
        self._parameters = scenario.plant_parameters()
        self._cycle = scenario.simulation.cycle
        self._vehicle = PlantState(x=0.0, y=0.0, phi=0.0)
        self._last: Command | None = None

    def step(self, state: VehicleState, *, now: float, **told: Any) -> Command:
        delay = self._faults.total("late_cycles", now)
        self._vehicle = advance(self._vehicle, self._parameters, now)
        if self._last is None or now + SAME_TIME < self._begin:
            self._last = self.controller.step(state, now=now, **told)
            command = self._last
        else:
            command = replace(
                self._last,
                acceleration=self._braking(now + self._parameters.dead_time + delay),
                steering_rate=0.0,
                status=Status.FAILED,
                source=Source.BRAKING,
            )
        self._vehicle = issue(
            self._vehicle,
            self._parameters,
            acceleration=command.acceleration,
            steering_rate=command.steering_rate,
            delay=delay,
        )
        return command

    def _braking(self, acts: float) -> float:
        """What brings the vehicle to rest soonest [m/s²], of a command that `acts` from that time on [s]."""
        speed, most = advance(self._vehicle, self._parameters, acts).v, self._parameters.acceleration_limit
        return float(np.clip(-speed / self._cycle, -most, most))


def braked(scenario: Scenario) -> RunResult:
    """The run of a vehicle that brakes fully from the first fault on, under the same faults.

    A clock that is wrong keeps no vehicle from braking; so it is right there.
    """
    others = [fault for fault in scenario.faults if fault.kind != "clock_back"]
    controller = BrakesFully(scenario)
    faults = [fault.model_dump(by_alias=True) for fault in others]
    return simulate(changed(scenario, {"faults": faults}), controller=controller)


def contact_speed(result: RunResult) -> float | None:
    """Speed [m/s] at which the body first touches something; None if it never does."""
    touching = body_clearances(result) < 0.0
    return float(abs(result.truth.v[np.argmax(touching)])) if touching.any() else None


def fault_figures(result: RunResult) -> dict[str, Any]:
    """What is recorded of a run with faults."""
    last = result.cycles.reason[-1] if len(result.cycles) else ""
    ended = {"ended": result.ended, "statuses": statuses(result), "last_reason": last}
    return {**docking_figures(result), **ended}


# -- what is promised ------------------------------------------------------------------------------------


def check_commands(result: RunResult) -> None:
    """Every command is finite and within the limits of the inputs."""
    cycles, limits = result.cycles, result.scenario.limits
    assert np.isfinite([cycles.acceleration, cycles.steering_rate, cycles.speed, cycles.steering]).all()
    assert np.abs(cycles.acceleration).max() <= limits.acceleration + ROUNDING
    assert np.abs(cycles.steering_rate).max() <= limits.steering_rate + ROUNDING


def check_contact(result: RunResult) -> None:
    """Nothing is touched that braking at once would not have touched, and nothing harder than by that."""
    touched = contact_speed(result)
    if touched is None:
        return
    yardstick = braked(result.scenario)
    least = contact_speed(yardstick)
    assert least is not None, f"touches at {touched:.2f} m/s what braking at once avoids"
    assert touched <= least + HARDER, f"touches at {touched:.2f} m/s, braking at once at {least:.2f} m/s"
    deep, needed = -float(body_clearances(result).min()), -float(body_clearances(yardstick).min())
    assert deep <= needed + DEEPER, f"goes {deep:.2f} m deep, braking at once {needed:.2f} m"


def check_end(result: RunResult) -> None:
    """It is docked at the end, or it stands and says why."""
    status, reason = result.cycles.status[-1], result.cycles.reason[-1]
    if result.ended == "docked":
        return
    assert abs(result.truth.v[-1]) <= STANDS, f"drives at the end: {status.value}, {reason}"
    assert status in MAY_STAND, status
    assert reason


def check_all(result: RunResult) -> None:
    """All that is promised of every run."""
    check_commands(result)
    check_contact(result)
    check_end(result)
