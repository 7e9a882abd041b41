"""Each kind of fault on a short course: safe commands, no contact that braking avoids, docked at last."""

from __future__ import annotations

from typing import Any, get_args

import pytest

from rti_mpcc.simulation import docking_controller, load_scenario, simulate
from rti_mpcc.simulation.closed_loop import Controller
from rti_mpcc.simulation.metrics import clearances
from rti_mpcc.simulation.sections.faults import Kind
from rti_mpcc.types import Command, Status, VehicleState
from tests.rti_mpcc.docking_runs import short
from tests.rti_mpcc.fault_runs import (
    BrakesFully,
    braked,
    check_all,
    check_contact,
    contact_speed,
    drive,
    with_fault,
)

# Of the state, the solver and an actuator; the other kinds are driven in acceptance.
USUAL = ("nan_state", "solver_fail", "stuck_steering")


@pytest.mark.parametrize(
    "kind",
    [kind if kind in USUAL else pytest.param(kind, marks=pytest.mark.acceptance) for kind in get_args(Kind)],
)
def test_it_docks_when_the_fault_is_over(kind: str) -> None:
    result, noted = drive(with_fault(short(), kind, 5.0, 1.0))
    check_all(result, noted)
    assert result.ended == "docked"
    assert result.cycles.status[-1] is Status.DOCKED


CLOSE = with_fault(short(), "blocked", 5.0, 3.0, 0.35)
"""What appears so near is touched whatever is done, at 0.7 m/s at the least."""


@pytest.mark.acceptance
def test_what_cannot_be_avoided_is_touched_at_the_least_speed() -> None:
    result, noted = drive(CLOSE)
    check_all(result, noted)
    touched = contact_speed(result)
    assert touched is not None
    assert touched == pytest.approx(0.71, abs=0.05)


@pytest.mark.acceptance
@pytest.mark.parametrize(
    ("scenario", "begin", "gap"),
    [
        ("short", 5.0, 0.2),
        pytest.param("short", 5.0, 0.45, marks=pytest.mark.acceptance),
        pytest.param("docking_full_course", 30.0, 0.1, marks=pytest.mark.acceptance),
    ],
)
def test_what_appears_close_by_is_gone_into_no_deeper_than_it_must(
    scenario: str, begin: float, gap: float
) -> None:
    base = short() if scenario == "short" else load_scenario(scenario)
    result, noted = drive(with_fault(base, "blocked", begin, 3.0, gap))
    check_all(result, noted)


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
    assert (contact_speed(braked(scenario)) is None) is in_time


class Blind:
    """A controller that is told of no obstacles."""

    def __init__(self, controller: Controller) -> None:
        self.controller = controller

    def step(self, state: VehicleState, *, obstacles: Any = None, **told: Any) -> Command:
        return self.controller.step(state, **told)


@pytest.mark.acceptance
def test_a_contact_that_cannot_be_avoided_may_not_be_harder_than_it_must() -> None:
    blind = simulate(CLOSE, controller=Blind(docking_controller(CLOSE)))
    with pytest.raises(AssertionError, match=r"touches at 1\.1\d m/s, braking at once at 0\.72 m/s"):
        check_contact(blind)


def test_without_a_fault_at_work_braking_leaves_the_usual_clearance() -> None:
    scenario = with_fault(load_scenario("docking_full_course"), "nan_state", 2.0, 0.1)
    result = simulate(scenario, controller=BrakesFully(scenario))
    assert clearances(result).min() > 1.0
    assert result.ended == "stopped"
