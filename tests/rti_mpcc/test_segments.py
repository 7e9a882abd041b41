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
from rti_mpcc.config import Behaviour, ControllerConfig
from rti_mpcc.manoeuvre import PlannedStop
from rti_mpcc.paper import with_method
from rti_mpcc.planning import search
from rti_mpcc.planning.search import SqpResult
from rti_mpcc.recording import Recorder
from rti_mpcc.simulation import RunResult, scenario_from_dict, simulate
from rti_mpcc.types import Status

SCENARIO = scenario_from_dict(
    {
        "name": "one_cusp",
        "path": {
            "start": [0.0, 0.0, 0.0],
            "segments": [
                {"direction": 1, "curvature": 0.05, "length": 12.0},
                {"direction": -1, "curvature": 0.0, "length": 12.0},
            ],
        },
        "corridor": {"left": 3.0, "right": -3.0},
        "goal": {"offset": [0.0, 0.2, 0.0]},
        "simulation": {"dead_time": 0.18, "cycle": 0.05, "duration": 90.0},
    }
)
PATH = SCENARIO.build_path()
CONFIG = SCENARIO.controller_config()
GIVE_UP_TIME = CONFIG.retries.give_up_time


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


@pytest.mark.acceptance
def test_by_default_the_segments_are_those_of_the_path() -> None:
    plain = simulate(SCENARIO)
    given = simulate(SCENARIO, controller=controller({}))
    np.testing.assert_array_equal(plain.truth.poses, given.truth.poses)
    assert given.cycles.status[-1] is Status.DOCKED


def test_a_vehicle_dwells_at_the_cusp_and_docks_so_much_later() -> None:
    plain, dwelling = simulate(SCENARIO), simulate(SCENARIO, controller=controller({"dwell": 4.0}))
    assert dwelling.cycles.status[-1] is Status.DOCKED
    assert 4.0 <= stood_at_cusp(dwelling) <= 5.0
    assert stood_at_cusp(plain) <= 1.5
    later = dwelling.truth.times[-1] - plain.truth.times[-1]
    assert later == pytest.approx(4.0 - stood_at_cusp(plain), abs=1.0)


@pytest.mark.acceptance
def test_after_a_long_dwell_a_first_search_without_time_is_no_failure(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A vehicle that has stood for longer than it waits for a first plan has not looked for one yet."""
    converge = search.converge
    in_vain: list[float] = []

    def without_time(mpcc: Any, s: Any, *rest: Any) -> SqpResult:
        if s.task.segment.index == 0 or len(in_vain) >= 5:
            return converge(mpcc, s, *rest)
        in_vain.append(s.now)
        return SqpResult(solutions=(), problem=search.NO_TIME, corridor_infeasible=False, out_of_time=True)

    monkeypatch.setattr(search, "converge", without_time)
    run = simulate(SCENARIO, controller=controller({"dwell": GIVE_UP_TIME + 1.0}))
    assert len(in_vain) == 5
    assert stood_at_cusp(run) > GIVE_UP_TIME
    assert Status.FAILED not in run.cycles.status
    assert run.cycles.status[-1] is Status.DOCKED


@pytest.mark.acceptance
def test_a_segment_has_limits_of_its_own() -> None:
    plain, slow = simulate(SCENARIO), simulate(SCENARIO, controller=controller({"speed": 0.5}))
    assert slow.cycles.status[-1] is Status.DOCKED
    first = np.asarray(slow.truth.part) == 0
    assert np.abs(slow.truth.v[first]).max() <= 0.52
    assert np.abs(slow.truth.v[~first]).max() > 0.8
    assert np.abs(plain.truth.v[np.asarray(plain.truth.part) == 0]).max() > 0.8


def test_a_separated_docking_is_one_segment_more() -> None:
    ends = [segment.end for segment in segments_of(PATH, with_method(CONFIG, "separated"))]
    assert ends == [SegmentEnd.CUSP, SegmentEnd.CUSP, SegmentEnd.GOAL]
    assert [segment.end for segment in segments_of(PATH, CONFIG)] == [SegmentEnd.CUSP, SegmentEnd.GOAL]


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


def test_a_planned_segment_keeps_what_was_planned_and_no_less_than_may_be_driven() -> None:
    segment, least = segments_of(PATH, CONFIG)[0], CONFIG.planned_minimum
    assert segment.limited(CONFIG) is CONFIG
    assert replace(segment, margin=0.3).limited(CONFIG) is CONFIG
    for planned, kept in ((0.08, 0.08), (0.051, least), (0.0, least)):
        assert replace(segment, margin=planned).limited(CONFIG).clearance.wanted == kept


def test_the_tolerance_at_a_cusp_is_a_setting() -> None:
    tight = Behaviour(cusp_tolerance=(0.05, 0.04, 0.03))
    for method in ("dynamic", "separated", "switched"):
        *before, goal = segments_of(PATH, with_method(ControllerConfig(behaviour=tight), method))
        assert {segment.tolerance for segment in before} == {tight.cusp_tolerance}
        assert goal.tolerance == ControllerConfig().goal_tolerance


def test_what_is_no_manoeuvre_is_told() -> None:
    corridor, (to_cusp, to_goal) = SCENARIO.build_corridor(PATH), segments_of(PATH, CONFIG)
    before = PlannedStop(at=1.0, goal=None, obstacles=0, since=0.0)
    for segments, told in (
        ((), "at least"),
        ((to_cusp,), "ends at the goal"),
        ((to_goal, to_goal), "ends at the goal"),
        ((replace(to_cusp, index=2), to_goal), "2 parts"),
        ((replace(to_cusp, part=PATH.parts[1]), to_goal), "part 0 of the path"),
        ((replace(to_cusp, part=SCENARIO.build_path().parts[0]), to_goal), "part 0 of the path"),
        ((to_goal,), r"parts \[1\]"),
        ((to_cusp, replace(to_goal, end=SegmentEnd.CUSP), to_cusp, to_goal), r"parts \[0, 1, 0, 1\]"),
        ((replace(to_cusp, end=SegmentEnd.STOP), to_goal), "made by the controller"),
        ((replace(to_cusp, stop=before), to_goal), "made by the controller"),
        ((to_cusp, replace(to_goal, piece_of=to_goal)), "made by the controller"),
        ((to_cusp.stopped(before, (0.1, 0.1, 0.1)), to_goal), "made by the controller"),
    ):
        with pytest.raises(InputError, match=told):
            DockingController(PATH, corridor, CONFIG, segments=segments)


def test_a_recording_does_not_know_them_and_says_so(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="segments"):
        Recorder(controller({"dwell": 4.0}), tmp_path / "run.jsonl")
