"""Two versions timed in turn."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from benchmarks.compare_speed import files_of, main, percentiles, rows
from benchmarks.tables import ROOT

with_git = pytest.mark.skipif(not (ROOT / ".git").exists(), reason="not in a clone")


def test_a_ratio_is_of_drives_that_follow_one_another() -> None:
    there = np.array([[2.0, 3.0, 4.0], [4.0, 6.0, 8.0], [2.0, 3.0, 4.0]])
    found = rows(there * [[0.5], [1.0], [2.0]], there, "abc")
    assert found[2] == ["ratio", "1.000", "1.000", "1.000"]
    assert found[3][1:] == ["0.500 to 2.000"] * 3
    assert found[1] == ["abc [ms]", "2.00", "3.00", "4.00"]


def test_it_is_the_tree_that_is_driven(tmp_path: Path) -> None:
    """A package of the same name that tells other times."""
    (tmp_path / "rti_mpcc").mkdir()
    (tmp_path / "rti_mpcc" / "__init__.py").write_text("")
    (tmp_path / "rti_mpcc" / "simulation.py").write_text(
        "from types import SimpleNamespace as N\nimport numpy\nload_scenario = len\n"
        "simulate = lambda length: N(cycles=N(step_ms=numpy.array([99.0, length, length])))\n"
    )
    np.testing.assert_array_equal(percentiles(tmp_path, ["four"]), [4.0, 4.0, 4.0])


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
