"""Segments of a manoeuvre that a user gives: a dwell at a cusp, limits of their own."""

from __future__ import annotations

from dataclasses import replace
from math import inf
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from geometry import InputError
from rti_mpcc import DockingController, Segment, SegmentEnd, segments_of
from rti_mpcc.recording import Recorder
from rti_mpcc.simulation import RunResult, simulate
from rti_mpcc.types import Status
from tests.rti_mpcc.docking_runs import on_segments

ONE_CUSP = [(1, 0.05, 8.0), (-1, 0.0, 8.0)]
SCENARIO = on_segments(
    ONE_CUSP, goal={"offset": [0.0, 0.2, 0.0]}, simulation={"duration": 90.0, "cycle": 0.1}
)
PATH = SCENARIO.build_path()
CONFIG = SCENARIO.controller_config()


def controller(first: dict[str, Any]) -> DockingController:
    """With changes to the first segment of the path."""
    to_cusp, to_goal = segments_of(PATH, CONFIG)
    segments = (replace(to_cusp, **first), to_goal)
    return DockingController(PATH, SCENARIO.build_corridor(PATH), CONFIG, segments=segments)


def stood_at_cusp(run: RunResult) -> float:
    """How long the truth stands at the cusp [s]."""
    part = np.asarray(run.truth.part)
    change = int(np.argmax(part == 1))
    still = np.abs(run.truth.v) <= 0.02
    begin = change - int(np.argmin(still[:change][::-1]))
    end = change + int(np.argmin(still[change:]))
    return float(run.truth.times[end] - run.truth.times[begin])


def test_a_vehicle_dwells_at_the_cusp_and_docks_so_much_later() -> None:
    plain, dwelling = simulate(SCENARIO), simulate(SCENARIO, controller=controller({"dwell": 4.0}))
    assert dwelling.cycles.status[-1] is Status.DOCKED
    assert 4.0 <= stood_at_cusp(dwelling) <= 5.0
    assert stood_at_cusp(plain) <= 1.5
    later = dwelling.truth.times[-1] - plain.truth.times[-1]
    assert later == pytest.approx(4.0 - stood_at_cusp(plain), abs=1.0)


@pytest.mark.acceptance
def test_a_segment_has_limits_of_its_own() -> None:
    plain, slow = simulate(SCENARIO), simulate(SCENARIO, controller=controller({"speed": 0.5}))
    assert slow.cycles.status[-1] is Status.DOCKED
    first = np.asarray(slow.truth.part) == 0
    assert np.abs(slow.truth.v[first]).max() <= 0.52
    assert np.abs(slow.truth.v[~first]).max() > 0.8
    assert np.abs(plain.truth.v[np.asarray(plain.truth.part) == 0]).max() > 0.8


@pytest.mark.parametrize(
    ("values", "named"),
    [
        ({"dwell": -1.0}, "dwell"),
        ({"dwell": inf}, "dwell"),
        ({"dwell": 4.0, "end": SegmentEnd.GOAL}, "dwell = 4.0: only at a cusp"),
        ({"speed": 0.0}, "speed"),
        ({"steering": -0.1}, "steering"),
        ({"tolerance": (0.1, 0.0, 0.1)}, "tolerance"),
        ({"margin": -0.1}, "margin"),
    ],
)
def test_bad_values_are_told(values: dict[str, Any], named: str) -> None:
    with pytest.raises(InputError, match=named):
        Segment(part=PATH.parts[0], index=0, **values)


def test_what_is_no_manoeuvre_is_told() -> None:
    corridor, (to_cusp, to_goal) = SCENARIO.build_corridor(PATH), segments_of(PATH, CONFIG)
    for segments, told in (
        ((), "at least"),
        ((to_cusp,), "ends at the goal"),
        ((to_goal, to_goal), "ends at the goal"),
        ((replace(to_cusp, index=2), to_goal), "2 parts"),
        ((replace(to_cusp, part=PATH.parts[1]), to_goal), "part 0 of the path"),
        ((replace(to_cusp, part=SCENARIO.build_path().parts[0]), to_goal), "part 0 of the path"),
        ((to_goal,), r"parts \[1\]"),
        ((to_cusp, replace(to_goal, end=SegmentEnd.CUSP), to_cusp, to_goal), r"parts \[0, 1, 0, 1\]"),
        ((replace(to_cusp, end=SegmentEnd.STOP), to_goal), "only the controller makes stops"),
    ):
        with pytest.raises(InputError, match=told):
            DockingController(PATH, corridor, CONFIG, segments=segments)


def test_a_recording_does_not_know_them_and_says_so(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="segments"):
        Recorder(controller({"dwell": 4.0}), tmp_path / "run.jsonl")
