"""What the speed benchmark makes of its measurements; nothing here is timed."""

from __future__ import annotations

from pkgutil import resolve_name
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from scipy import sparse

from benchmarks import phases
from benchmarks.ledger import KINDS, compared, kind_of, solved_by_osqp, solved_by_piqp
from benchmarks.phases import PHASES, SolverCounts, Watches
from benchmarks.sweeps import POINTS, denser, middle, sparse_corridor, winding, with_points
from benchmarks.workload import later, solving
from benchmarks.yardstick import EQUALITIES, Problem, fixed_set, quiet


def test_the_fixed_set_is_the_one_that_the_targets_were_set_with() -> None:
    problems = fixed_set()
    assert len(problems) == 39
    assert {problem.split[2].shape for problem in problems} == {(EQUALITIES, 707)}
    assert {problem.split[4].shape for problem in problems} == {(1337 - EQUALITIES, 707)}


def test_both_references_solve_a_small_qp() -> None:
    # min x² + y² - 2x with x + y = 0.5, x <= 0.25
    problem = Problem.of(
        sparse.csc_matrix(np.diag([2.0, 2.0])),
        np.array([-2.0, 0.0]),
        sparse.csc_matrix([[1.0, 1.0], [1.0, 0.0]]),
        np.array([0.5, -np.inf]),
        np.array([0.5, 0.25]),
    )
    with quiet():
        assert solved_by_piqp(problem) == pytest.approx([0.25, 0.25], abs=1e-8)
    assert solved_by_osqp(problem) == pytest.approx([0.25, 0.25], abs=1e-8)


def test_rounds_leave_first_cycles_and_those_without_a_qp_apart() -> None:
    cycles = pd.DataFrame(
        {"step_ms": [9.0, 1.0, 2.0, 8.0, 3.0], "iterations": [50, 25, 0, 50, 25]}, index=[0, 1, 2, 0, 1]
    )
    assert later(cycles)["step_ms"].tolist() == [1.0, 2.0, 3.0]
    assert solving(cycles)["step_ms"].tolist() == [1.0, 3.0]


@pytest.mark.parametrize(
    ("time_to_go", "kind"), [(None, "cruise"), (20.0, "arrival"), (4.9, "final approach")]
)
def test_kinds_of_qps(time_to_go: float | None, kind: str) -> None:
    assert kind_of(time_to_go) == kind
    assert kind in KINDS


def test_runs_with_both_settings_are_compared() -> None:
    def run(time: float | None, clearance: float | None) -> dict[str, object]:
        times = {"docked": True, "time_to_tolerance_s": time}
        return {"scenario": "one", **times, "min_clearance_m": clearance}

    row = compared(run(20.2, 0.11), run(20.0, 0.10))
    assert row["time_apart"] == pytest.approx(0.01)
    assert row["clearance_apart_m"] == pytest.approx(0.01)
    assert compared(run(20.2, None), run(None, None))["time_apart"] == float("inf")


def test_a_denser_line_runs_the_same() -> None:
    line = np.array([[0.0, 0.0], [3.0, 0.0], [3.0, 1.0]])
    more = denser(line, 9)
    assert len(more) == 9
    assert all((more == corner).all(axis=1).any() for corner in line)
    assert np.hypot(*np.diff(more, axis=0).T).sum() == pytest.approx(4.0)


@pytest.mark.parametrize("points", POINTS[:3])
def test_boundaries_get_so_many_points(points: int) -> None:
    corridor = with_points(sparse_corridor(winding(30)), points)
    found = sum(len(line) for walls in corridor.walls for line in walls.both)
    assert found == points


def test_every_winding_path_is_the_same_around_its_middle() -> None:
    for length in (30, 100, 300):
        path = winding(length)
        assert path.length == pytest.approx(length)
        pose = middle(path)
        assert (pose.y, pose.phi) == pytest.approx((0.0, 0.0), abs=1e-9)


# -- phases of a cycle ---------------------------------------------------------------------------------------


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
