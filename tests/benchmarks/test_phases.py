from __future__ import annotations

from types import SimpleNamespace

import pytest

from benchmarks import phases
from benchmarks.phases import FEEDBACK, PHASES, SolverCounts, Watches, found


@pytest.mark.parametrize("name", sorted({FEEDBACK, *(name for _, names in PHASES for name in names)}))
def test_every_function_of_the_phases_is_where_the_table_says(name: str) -> None:
    assert callable(found(name)[2])


@pytest.mark.parametrize(
    "name", ["rti_mpcc.no_such:f", "rti_mpcc.controller:no_such", "rti_mpcc.controller:RtiMpcc.no_such"]
)
def test_a_function_that_is_gone_is_named(name: str) -> None:
    with pytest.raises(LookupError, match="not there any more"):
        found(name)


def test_what_is_no_function_is_refused() -> None:
    with pytest.raises(LookupError, match="not a function"):
        found("rti_mpcc.controller:THETA")


def test_times_are_exclusive_and_add_up(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = SimpleNamespace(now=0.0)
    monkeypatch.setattr(phases, "perf_counter", lambda: clock.now)

    def passes(seconds: float) -> None:
        clock.now += seconds

    watches = Watches()
    inner = watches.around(1, lambda: passes(2.0))

    def outside() -> None:
        passes(1.0)
        inner()
        inner()

    watches.around(0, outside)()
    assert watches.read()[:2] == [1.0, 4.0]
    assert sum(watches.read()) == 0.0


def test_an_osqp_that_was_not_seen_at_work_is_an_error() -> None:
    with pytest.raises(LookupError, match="not seen"):
        SolverCounts().check()
