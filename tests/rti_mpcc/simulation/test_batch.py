"""Runs spread over processes are the runs that they are one by one."""

from __future__ import annotations

import os

import numpy as np
import pytest

from rti_mpcc import InputError
from rti_mpcc.simulation import changed, load_scenario
from rti_mpcc.simulation.batch import THREADS, Case, DrivenCase, drive_all

SHORT = changed(load_scenario("docking_behind"), {"simulation.duration": 1.0})
CASES = [
    Case(scenario=changed(SHORT, {"simulation.state_noise": [0.01, 0.01, 0.0, 0.0, 0.0]}), seed=seed)
    for seed in (3, 1, 2)
]


def poses(outcomes: list[DrivenCase]) -> list[list[list[float]]]:
    return [outcome.result.truth.poses.tolist() for outcome in outcomes]


@pytest.mark.acceptance
def test_what_comes_out_does_not_depend_on_who_drives_it() -> None:
    told: list[tuple[int, int]] = []
    before = {name: os.environ.get(name) for name in THREADS}
    alone = drive_all(CASES, jobs=1, progress=lambda *counts: told.append(counts))
    together = drive_all(CASES, jobs=2, progress=lambda *counts: told.append(counts))
    assert poses(alone) == poses(together)
    assert [outcome.case for outcome in together] == CASES
    assert [outcome.figures["seed"] for outcome in together] == [3, 1, 2]
    assert told == [(1, 3), (2, 3), (3, 3)] * 2
    assert {name: os.environ.get(name) for name in THREADS} == before
    assert not np.array_equal(poses(alone)[0], poses(alone)[1])


def test_what_cannot_be_driven_is_refused() -> None:
    with pytest.raises(InputError, match="method = 'best': must be one of"):
        drive_all([Case(scenario=SHORT, method="best")], jobs=1)
    with pytest.raises(InputError, match="jobs = 0: must be >= 1"):
        drive_all(CASES, jobs=0)
