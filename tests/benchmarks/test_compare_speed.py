"""Two versions timed in turn."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from benchmarks.compare_speed import files_of, main, rows, times
from benchmarks.tables import ROOT

with_git = pytest.mark.skipif(not (ROOT / ".git").exists(), reason="not in a clone")


def test_of_each_cycle_the_least_time_of_all_rounds_counts() -> None:
    """Whatever delays single cycles of single rounds, in one tree or in the other, changes no ratio."""
    there = np.linspace(2.0, 4.0, 101)
    disturbed = [np.where(np.arange(101) % 3 == i, 50.0, there) for i in range(3)]
    found = rows([0.5 * there, 0.5 * there + 7.0, 0.5 * there], disturbed, "abc")
    assert found[2] == ["ratio", "0.500", "0.500", "0.500"]
    assert found[0][1:] == ["1.50", "1.95", "1.99"]
    assert found[1] == ["abc [ms]", "3.00", "3.90", "3.98"]


def test_rounds_that_differ_in_length_are_compared_as_far_as_both_go() -> None:
    found = rows([np.full(9, 2.0), np.full(4, 1.0)], [np.full(7, 1.0)] * 2, "abc")
    assert found[2] == ["ratio", "1.000", "1.000", "1.000"]


def test_it_is_the_tree_that_is_driven(tmp_path: Path) -> None:
    """A package of the same name that tells other times."""
    (tmp_path / "rti_mpcc").mkdir()
    (tmp_path / "rti_mpcc" / "__init__.py").write_text("")
    (tmp_path / "rti_mpcc" / "simulation.py").write_text(
        "from types import SimpleNamespace as N\nimport numpy\nload_scenario = len\n"
        "simulate = lambda length: N(cycles=N(step_ms=numpy.array([99.0, length, length])))\n"
    )
    np.testing.assert_array_equal(times(tmp_path, ["four"]), [4.0, 4.0])


@with_git
def test_a_commit_that_is_not_there_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "argv", ["compare_speed", "no-such-commit"])
    with pytest.raises(SystemExit, match="no-such-commit"):
        main()


@with_git
def test_files_are_gone_afterwards() -> None:
    with files_of("HEAD") as tree:
        assert (tree / "rti_mpcc" / "docking.py").is_file()
    assert not tree.exists()
