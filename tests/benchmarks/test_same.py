"""The comparison with another commit, to the bit."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchmarks.same import CannotCompare, Side, difference, main
from benchmarks.same_drive import Watched, drive, moving
from benchmarks.same_list import BUILT_IN, RUNS
from benchmarks.tables import ROOT
from rti_mpcc.simulation import builtin_names, driver_of, load_scenario
from rti_mpcc.types import Command, Status, VehicleState

with_git = pytest.mark.skipif(not (ROOT / ".git").exists(), reason="not in a clone")
Digests = dict[str, Any]


@pytest.fixture(scope="module")
def command() -> Command:
    """The first command of a ride."""
    scenario = load_scenario("docking_behind")
    return driver_of(scenario).step(VehicleState(*(0.0, 0.0, 0.5 * np.pi, 0.0, 0.0)), now=0.0)


def digests(
    command: Command, change: Callable[[Command], Command] = lambda command: command, **renamed: str
) -> Digests:
    """The digests of ten cycles of one command, which is changed in cycle 6."""

    class Repeating:
        cycle = -1

        def step(self, *_: object, **__: object) -> Command:
            self.cycle += 1
            return change(command) if self.cycle == 6 else command

    watched = Watched(Repeating(), renamed, scripted=False)
    for cycle in range(10):
        watched.step(None, now=0.05 * cycle)
    return watched.digests()


def with_plan(command: Command) -> Command:
    """The command with a plan whose last control is the next number up."""
    controls = command.trajectory.controls.copy()
    controls[-1, 0] = np.nextafter(controls[-1, 0], np.inf)
    return replace(command, trajectory=replace(command.trajectory, controls=controls))


def test_nothing_differs_between_equal_runs(command: Command) -> None:
    assert difference(digests(command), digests(command)) == ""


@pytest.mark.parametrize(
    ("change", "part"),
    [
        (lambda it: replace(it, acceleration=np.nextafter(it.acceleration, 9.0)), "commands"),
        (lambda it: replace(it, docked=True), "meanings"),
        (lambda it: replace(it, status=Status.BLOCKED), "meanings"),
        (with_plan, "plans"),
    ],
)
def test_a_changed_bit_is_reported_with_its_cycle(
    command: Command, change: Callable[[Command], Command], part: str
) -> None:
    found = difference(digests(command), digests(command, change))
    assert found == f"differs in {part}, first in cycle 6 (t = 0.30 s)"


def test_a_longer_run_differs_where_the_other_one_ended(command: Command) -> None:
    full = digests(command)
    short = full | {"commands": "", "cycles": full["cycles"][:-8], "times": full["times"][:-2]}
    said = "differs in commands, first in cycle 8 (t = 0.40 s), 10 cycles -> 8"
    assert difference(full, short) == said


def test_a_renamed_status_is_the_same_by_the_table_only(command: Command) -> None:
    base = digests(command)
    renamed = digests(replace(command, status=Status.STALLED))
    assert difference(base, renamed) != ""
    assert (
        difference(base, digests(replace(command, status=Status.STALLED), STALLED=command.status.name)) == ""
    )


def test_a_run_that_raises_is_never_the_same() -> None:
    run = {"name": "x", "scenario": "no_such_scenario", "changes": {}}
    found = drive(run, {})
    assert found["raised"].startswith("ScenarioError")
    assert "HEAD raised ScenarioError" in difference({}, found)
    assert difference(found, found) != ""


def test_a_mover_is_there_in_its_time_only() -> None:
    mover = {"at": (1.0, 2.0), "size": (2.0, 4.0), "velocity": (0.5, 0.0), "since": 2.0, "until": 6.0}
    at = moving([mover])
    assert at(1.9) == at(6.0) == []
    np.testing.assert_allclose(at(4.0), [[(1.0, 0.0), (3.0, 0.0), (3.0, 4.0), (1.0, 4.0)]])


def test_the_list_has_every_kind_of_run() -> None:
    runs = RUNS.values()
    assert set(BUILT_IN) == set(builtin_names()) <= set(RUNS)
    assert {run.preset for run in runs} == {"default", "paper", "paper_printed"}
    assert {run.method for run in runs} == {"dynamic", "separated", "switched"}
    counts = {kind: sum(name.startswith(kind) for name in RUNS) for kind in ("course", "scene", "undocking")}
    assert counts == {"course": 240, "scene": 40, "undocking": 6}
    for kind in ("faults", "simulation.state_noise", "controller.deadline"):
        assert any(kind in run.changes for run in runs)
    assert all(run.scripted for run in runs if "controller.deadline" in run.changes)
    assert any(run.movers for run in runs)


def test_a_side_drives_its_own_tree_only(tmp_path: Path) -> None:
    (tmp_path / "driver.py").write_text(
        "import rti_mpcc\nprint(rti_mpcc.__name__)\nraise SystemExit('broken')"
    )
    (tmp_path / "rti_mpcc.py").write_text("__name__ = 'of this tree'")
    side = Side(name="BASE", python=sys.executable, tree=tmp_path, renamed={})
    lines = side.run(tmp_path / "driver.py", given="")
    assert next(lines) == "of this tree\n"
    with pytest.raises(CannotCompare, match="BASE: broken"):
        next(lines)


def test_names_are_listed(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "argv", ["same", "--list", "--only", "undocking"])
    assert main() == 0
    assert capsys.readouterr().out.split() == [f"undocking-random-{i:02d}" for i in range(6)]


@with_git
@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["no-such-commit"], "no-such-commit: no commit of this repository"),
        (["HEAD", "--only", "no-such-run"], "no run has this in its name"),
        ([], "BASE is missing"),
    ],
)
def test_what_cannot_be_compared_is_said(
    arguments: list[str],
    said: str,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(sys, "argv", ["same", *arguments])
    assert main() == 2
    assert said in capsys.readouterr().err
