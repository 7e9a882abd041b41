"""Each kind of fault on a short course: safe commands, no contact that braking avoids, docked at last."""

from __future__ import annotations

from typing import get_args

import pytest

from rti_mpcc.simulation import load_scenario, simulate
from rti_mpcc.simulation.faults import Kind
from rti_mpcc.types import Status
from tests.lists import acceptance, in_fast_suite
from tests.rti_mpcc.docking_runs import short
from tests.rti_mpcc.fault_runs import braked, check_all, contact_speed, with_fault

# Of the state, the solver and an actuator; the other kinds are driven in acceptance.
USUAL = ("nan_state", "solver_fail", "stuck_steering")


@pytest.mark.parametrize("kind", in_fast_suite(USUAL, get_args(Kind)))
def test_it_docks_when_the_fault_is_over(kind: str) -> None:
    result = simulate(with_fault(short(), kind, 5.0, 1.0))
    check_all(result)
    assert result.ended == "docked"
    assert result.cycles.status[-1] is Status.DOCKED


@pytest.mark.acceptance
@pytest.mark.parametrize(
    ("scenario", "begin", "gap"),
    [
        ("short", 5.0, 0.2),
        acceptance("short", 5.0, 0.45),
        acceptance("docking_full_course", 30.0, 0.1),
    ],
)
def test_what_appears_close_by_is_gone_into_no_deeper_than_it_must(
    scenario: str, begin: float, gap: float
) -> None:
    base = short() if scenario == "short" else load_scenario(scenario)
    result = simulate(with_fault(base, "blocked", begin, 3.0, gap))
    check_all(result)


# -- the yardstick itself --------------------------------------------------------------------------------


@pytest.mark.parametrize(("gap", "in_time"), [(5.0, True), (0.1, False)])
def test_a_contact_is_avoidable_with_room_to_brake(gap: float, in_time: bool) -> None:
    scenario = with_fault(short(), "blocked", 5.0, 3.0, gap)
    assert (contact_speed(braked(scenario)) is None) is in_time
