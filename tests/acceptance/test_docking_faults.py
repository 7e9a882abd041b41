"""Everything that may go wrong, at four places of the full course, for 0.3, 1 and 3 s."""

from __future__ import annotations

from typing import Any, get_args

import pytest

from rti_mpcc.simulation import load_scenario, simulate
from rti_mpcc.simulation.faults import Kind
from tests.rti_mpcc.fault_runs import check_all, fault_figures, with_fault

ONSETS = {"forward": 6.0, "before the cusp": 16.0, "bend in reverse": 30.0, "narrowing": 40.0}
"""When a fault begins [s], by where the vehicle is then."""
SECONDS = (0.3, 1.0, 3.0)
SIZES = {
    "state_jump": (0.2, 0.5, -0.5),
    "late_cycles": (0.1, 0.2, 0.3),
    "clock_back": (0.1, 3.0, 30.0),
    "goal_jump": (0.2, 0.5, -1.0),
    "blocked": (10.0, 5.0, 2.0),
    "weak_brakes": (0.7, 0.4, 0.2),
}
"""One for each of SECONDS."""
CASES = [
    (kind, seconds, size)
    for kind in get_args(Kind)
    for seconds, size in zip(SECONDS, SIZES.get(kind, (None, None, None)), strict=True)
]


@pytest.mark.parametrize(("kind", "seconds", "size"), CASES)
@pytest.mark.parametrize("place", ONSETS)
def test_a_fault_ends_docked_or_standing_with_a_reason(
    kind: str, seconds: float, size: float | None, place: str, figures: dict[str, Any]
) -> None:
    scenario = with_fault(load_scenario("docking_full_course"), kind, ONSETS[place], seconds, size)
    result = simulate(scenario)
    figures.update(fault_figures(result))
    check_all(result)
    assert result.ended == "docked", f"{result.cycles.status[-1].value}: {result.cycles.reason[-1]}"
    # A goal that has jumped may be out of reach onward, and once more when it jumps back; what is blocked, or
    # keeps the vehicle standing for long, may let it replan; whatever is over soon does not.
    replans = result.replans
    assert replans <= 2 if kind == "goal_jump" else replans <= (kind == "blocked" or seconds >= SECONDS[-1])
