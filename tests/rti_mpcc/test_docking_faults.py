"""Each kind of fault on a short course: safe commands, no contact that braking avoids, docked at last."""

from __future__ import annotations

from typing import get_args

import pytest

from rti_mpcc.simulation import load_scenario, simulate
from rti_mpcc.simulation.faults import Kind
from rti_mpcc.simulation.metrics import clearances
from rti_mpcc.types import Status
from tests.rti_mpcc.docking_runs import short
from tests.rti_mpcc.fault_runs import BrakesFully, avoidable, check_all, drive, with_fault


@pytest.mark.parametrize("kind", get_args(Kind))
def test_it_docks_when_the_fault_is_over(kind: str) -> None:
    result, noted = drive(with_fault(short(), kind, 5.0, 1.0))
    check_all(result, noted)
    assert result.ended == "docked"
    assert result.cycles.status[-1] is Status.DOCKED


# -- the yardstick itself --------------------------------------------------------------------------------


def test_full_braking_is_as_hard_as_can_be_and_ends_at_a_standstill() -> None:
    scenario = with_fault(short(), "nan_state", 5.0, 1.0)
    truth = simulate(scenario, controller=BrakesFully(scenario)).truth
    acts = truth.times >= 5.18 - 1e-9
    speed = float(abs(truth.v[acts][0]))
    assert speed > 0.5
    assert abs(truth.v[acts]).max() == pytest.approx(speed)
    assert truth.v.max() <= 1e-9
    # Hard braking to the last cycle: it stands one cycle later at most.
    standing = truth.times[acts][abs(truth.v[acts]) <= 1e-6]
    assert standing[0] - 5.18 <= speed / 5.0 + 0.05 + 0.01
    assert abs(truth.v[-1]) <= 1e-9


@pytest.mark.parametrize("kind", ["weak_brakes", "late_cycles", "lost_cycles"])
def test_full_braking_reverses_under_no_fault(kind: str) -> None:
    scenario = with_fault(short(), kind, 5.0, 2.0)
    truth = simulate(scenario, controller=BrakesFully(scenario)).truth
    assert truth.v.max() <= 1e-6
    assert abs(truth.v[-1]) <= 1e-6


@pytest.mark.parametrize(("gap", "in_time"), [(5.0, True), (0.1, False)])
def test_a_contact_is_avoidable_with_room_to_brake(gap: float, in_time: bool) -> None:
    scenario = with_fault(short(), "blocked", 5.0, 3.0, gap)
    assert avoidable(scenario) is in_time


def test_without_a_fault_at_work_braking_leaves_the_usual_clearance() -> None:
    scenario = with_fault(load_scenario("docking_full_course"), "nan_state", 2.0, 0.1)
    result = simulate(scenario, controller=BrakesFully(scenario))
    assert clearances(result).min() > 1.0
    assert result.ended == "stopped"
