"""A row tells what became of a case, and nothing that differs from run to run."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from rti_mpcc.simulation import changed, load_scenario
from rti_mpcc.simulation.batch import Case, DrivenCase, drive
from rti_mpcc.simulation.campaign import CaseOutcome, Drawn, outcome_of, row_of
from rti_mpcc.simulation.metrics import TIMED
from rti_mpcc.types import Source, Status
from tests.rti_mpcc.simulation.conftest import with_columns

DRAWN: Drawn = {"course": {"number": 7}, "disturbances": {}}


def driven(deadline: float | None = None) -> DrivenCase:
    changes = {"simulation.duration": 0.5, "controller.deadline": deadline}
    return drive(Case(scenario=changed(load_scenario("docking_inside"), changes), seed=4))


@pytest.fixture(scope="module")
def outcome() -> DrivenCase:
    return driven()


def test_a_row_has_the_figures_of_the_run_and_is_the_same_each_time(outcome: DrivenCase) -> None:
    row = row_of(7, outcome, DRAWN)
    assert row.table() == row_of(7, driven(), DRAWN).table()
    table = row.table()
    assert list(table) == ["index", "scenario", "outcome", "detail", "course", "disturbances", "figures"]
    assert (table["index"], table["outcome"], table["course"]) == (7, "unfinished", {"number": 7})
    figures = {name: value for name, value in outcome.figures.items() if name not in TIMED}
    assert {name: table["figures"][name] for name in figures} == figures
    assert not set(TIMED) & set(table["figures"])
    assert sum(table["figures"]["cycles_by_status"].values()) == len(outcome.result.cycles.times)


@pytest.mark.parametrize(
    ("docked", "ended", "last", "expected"),
    [
        (True, "docked", Status.DOCKED, CaseOutcome.DOCKED),
        (True, "duration", Status.SETTLING, CaseOutcome.UNCONFIRMED),
        (True, "docked", Status.ARRIVING, CaseOutcome.UNCONFIRMED),
        (False, "stopped", Status.STALLED, CaseOutcome.STALLED),
        (False, "stopped", Status.FAILED, CaseOutcome.FAILED),
        (False, "duration", Status.FAILED, CaseOutcome.UNFINISHED),
    ],
)
def test_how_a_case_ended(
    outcome: DrivenCase, docked: bool, ended: str, last: Status, expected: CaseOutcome
) -> None:
    result = outcome.result
    cycles = with_columns(result.cycles, status=[*result.cycles.status[:-1], last])
    assert outcome_of(replace(result, ended=ended, cycles=cycles), docked=docked) is expected


def test_what_did_not_dock_has_the_last_reason(outcome: DrivenCase) -> None:
    reasons = ("early", "late", *[""] * (len(outcome.result.cycles.times) - 2))
    result = replace(outcome.result, cycles=with_columns(outcome.result.cycles, reason=reasons))
    assert row_of(0, replace(outcome, result=result), DRAWN).detail == "late"


def test_refused_solutions_that_were_driven_are_counted(outcome: DrivenCase) -> None:
    cycles = outcome.result.cycles
    count = len(cycles.times)
    failed = np.zeros(count, dtype=np.bool_)
    failed[:3] = True
    source = (Source.SOLUTION, Source.BRAKING, Source.SOLUTION, *[Source.SOLUTION] * (count - 3))
    result = replace(outcome.result, cycles=with_columns(cycles, failed=failed, source=source))
    figures = row_of(0, replace(outcome, result=result), DRAWN).figures
    assert figures is not None
    assert figures["failures_driven"] == 2
