"""Repeated real-time iterations at frozen states of every built-in scenario solve the nonlinear program."""

from __future__ import annotations

from typing import Any

import pytest

from rti_mpcc.simulation import load_scenario
from tests.rti_mpcc.convergence import examine
from tests.rti_mpcc.frozen import take

RUNS = [
    ("docking_inside", "default", [0.28, 2.18, 5.18, 10.18, 15.18, 18.18]),
    ("docking_behind", "default", [0.28, 2.18, 5.18, 10.18, 12.18, 15.18, 20.18]),
    ("path_following", "default", [0.28, 5.18, 15.18, 26.18, 31.18, 38.18]),
    ("docking_full_course", "default", [0.28, 5.18, 15.18, 26.18, 31.18, 38.18]),
    ("long_approach", "default", [0.28, 5.18, 10.18, 20.18, 30.18, 45.18, 50.18, 58.18]),
    ("docking_inside", "paper", [0.28, 5.18, 10.18, 15.18]),
    ("docking_behind", "paper", [0.28, 5.18, 12.18, 18.18]),
    ("path_following", "paper", [0.28, 5.18, 15.18, 26.18]),
    ("docking_full_course", "paper", [0.28, 5.18, 15.18, 26.18, 31.18, 40.18]),
]
"""Contouring and arrival, both parts, with and without boundaries in reach."""


@pytest.mark.parametrize(("scenario", "preset", "times"), RUNS)
def test_repeated_iterations_solve_the_nonlinear_program(
    scenario: str,
    preset: str,
    times: list[float],
    monkeypatch: pytest.MonkeyPatch,
    figures: dict[str, Any],
) -> None:
    problems = take(load_scenario(scenario), preset, times, monkeypatch)
    assert len(problems) == len(times), "the run ended before the last of the times"
    findings = [examine(problem) for problem in problems]
    for found in findings:
        figures[found.name] = found.figures()
    for found in findings:
        found.check()
