from __future__ import annotations

from pkgutil import resolve_name
from types import SimpleNamespace

import pytest

from benchmarks import phases
from benchmarks.phases import PHASES, SolverCounts, Watches


@pytest.mark.parametrize("name", [name for names in PHASES.values() for name in names])
def test_every_function_of_the_phases_is_where_the_table_says(name: str) -> None:
    assert callable(resolve_name(name))


def test_times_are_exclusive_and_add_up(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = SimpleNamespace(now=0.0)
    monkeypatch.setattr(phases, "perf_counter", lambda: clock.now)

    def passes(seconds: float) -> None:
        clock.now += seconds

    watches = Watches()
    inner = watches.around("projection", lambda: passes(2.0))

    def outside() -> None:
        passes(1.0)
        inner()
        inner()

    watches.around("measurement", outside)()
    read = watches.read()
    assert (read["measurement"], read["projection"]) == (1.0, 4.0)
    assert sum(watches.read().values()) == 0.0


def test_an_osqp_that_was_not_seen_at_work_is_an_error() -> None:
    with pytest.raises(LookupError, match="not seen"):
        SolverCounts().check()
