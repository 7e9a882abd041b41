"""A row tells what a case was and what became of it, and nothing that differs from run to run."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import fields, replace
from typing import Any

import numpy as np
import pytest

from benchmarks.problems.scene_scenario import scenario_of
from benchmarks.problems.scenes import drawn_scene
from rti_mpcc.errors import InputError
from rti_mpcc.simulation import RunResult, Scenario, changed, load_scenario, scenario_from_dict, simulate
from rti_mpcc.simulation.batch import Case, Outcome, drive
from rti_mpcc.simulation.campaign import CaseOutcome
from rti_mpcc.simulation.campaign.row import (
    course_figures,
    disturbance_figures,
    failures_driven,
    outcome_of,
    row_of,
    scene_figures,
)
from rti_mpcc.simulation.metrics import TIMED
from rti_mpcc.types import Source, Status

COURSE: dict[str, Any] = {
    "name": "bent",
    "path": {
        "start": [0, 0, 0],
        "segments": [
            {"direction": 1, "curvature": 0.05, "length": 10},
            {"direction": -1, "curvature": -0.1, "length": 8},
            {"direction": -1, "curvature": 0.0, "length": 4.5},
        ],
    },
    "corridor": {
        "left": 4,
        "right": -3,
        "narrowings": [{"from": 2.0, "to": 4.0, "right": -1.5}, {"from": 6.0, "to": 7.0, "left": 1.8}],
        "obstacles": [[[5, -2], [6, -2], [6, -3]]],
    },
    "goal": {"offset": [-2.0, 0.5, 0.1]},
    "simulation": {"dead_time": 0.18, "duration": 0.5},
}


@pytest.fixture(scope="module")
def course() -> Scenario:
    return scenario_from_dict(COURSE)


@pytest.fixture(scope="module")
def outcome(course: Scenario) -> Outcome:
    return drive(Case(scenario=course, seed=4))


def test_a_course_is_told_in_figures(course: Scenario) -> None:
    found = course_figures(course)
    assert {field.name: getattr(found, field.name) for field in fields(found)} == {
        "direction": -1,
        "pieces": 3,
        "cusps": 1,
        "length_m": 22.5,
        "curvature": 0.1,
        "room_m": 0.4655,
        "narrowings": 2,
        "obstacles": 1,
        "goal_behind_m": 2.0,
        "goal_beside_m": 0.5,
        "goal_turned_rad": 0.1,
    }


def test_a_scene_is_told_in_figures() -> None:
    scene = drawn_scene(1, 2)
    found = scene_figures(scenario_of(scene))
    assert course_figures(scenario_of(scene)) == found
    assert (found.kind, found.obstacles, found.bounded) == ("yard", len(scene.obstacles), 1)
    assert found.wheelbase_m == scene.vehicle.wheelbase
    assert found.radius_m == pytest.approx(0.9 / scene.curvature, abs=1e-5)
    assert found.apart_m == pytest.approx(
        np.hypot(scene.goal.x - scene.start.x, scene.goal.y - scene.start.y), abs=1e-5
    )
    assert 0.0 <= found.turned_rad <= np.pi
    assert min(found.room_at_start_m, found.room_at_goal_m) >= scene.clearance
    assert found.comfort_acceleration == scene.comfort_acceleration


def test_what_is_timed_is_kept_apart(course: Scenario, outcome: Outcome) -> None:
    along = row_of(7, outcome)
    assert "timed" not in json.loads(along.line())
    assert along.timed is not None
    assert (along.timed["planning_s"], along.timed["cycle_ms"]) == (None, outcome.figures["cycle_ms"])
    assert along.lines() == (
        along.line(),
        json.dumps({"index": 7, **along.timed}, separators=(",", ":")) + "\n",
    )
    scene = changed(scenario_of(drawn_scene(1, 0)), {"simulation.duration": 1.0})
    driven = drive(Case(scenario=scene, seed=4))
    row = row_of(0, driven)
    assert row.figures is not None
    assert set(row.figures["planning"]) == {"replans", "length_m", "cusps"}
    assert row.figures["planning"]["length_m"] > 0.0
    timed = json.loads(row.lines().timed or "")
    assert timed["planning_s"] == driven.figures["planning"]["seconds"] > 0.0
    assert timed["cycle_ms"] == driven.figures["cycle_ms"]
    assert (timed["deadline_misses"], timed["misses"]) == (0, {})
    assert max(timed["slowest_ms"].values()) == timed["cycle_ms"]["max"]
    assert set(timed["slowest_ms"]) <= set(row.figures["cycles_by_status"])
    hurried = drive(Case(scenario=changed(course, {"controller.deadline": 0.0015}), seed=4))
    found = row_of(7, hurried).timed
    assert found is not None
    assert found["planning_s"] is None
    assert sum(found["misses"].values()) == found["deadline_misses"]
    assert found["deadline_misses"] == np.count_nonzero(hurried.result.cycles.deadline_missed)


def test_a_scenario_that_is_no_course_is_refused() -> None:
    with pytest.raises(InputError, match=r"path_following: needs path\.segments"):
        course_figures(load_scenario("path_following"))


def test_nothing_disturbs_a_course_of_its_own(course: Scenario) -> None:
    found = disturbance_figures(course)
    assert (found.position_std_m, found.heading_std_rad, found.dropout, found.outlier, found.delay_s) == (
        0,
    ) * 5
    assert (found.initial_offset, found.state_noise) == ((0.0,) * 3, (0.0,) * 5)
    assert (found.wheelbase_error, found.steering_offset_rad, found.acceleration_gain) == (0.0, 0.0, 1.0)
    assert found.dead_time_s == 0.18


def test_disturbances_are_told_in_figures(course: Scenario) -> None:
    measurement = {"position_std": 0.04, "heading_std": 0.03, "delay": 0.07, "dropout": 0.3, "outlier": 0.01}
    changes = {
        "goal.measurement": measurement | {"initial_offset": [0.1, 0.2, 0.05]},
        "simulation.state_noise": [0.01, 0.02, 0.03, 0.04, 0.05],
        "simulation.wheelbase_error": 0.02,
        "simulation.steering_offset": -0.01,
        "simulation.acceleration_gain": 0.9,
        "simulation.dead_time": 0.2,
    }
    found = disturbance_figures(changed(course, changes))
    assert [getattr(found, field.name) for field in fields(found)] == [
        *(0.04, 0.03, 0.3, 0.01, 0.07, (0.1, 0.2, 0.05), (0.01, 0.02, 0.03, 0.04, 0.05)),
        *(0.02, -0.01, 0.9, 0.2),
    ]


def test_a_row_has_the_figures_of_the_run_but_no_times(outcome: Outcome) -> None:
    row = row_of(7, outcome)
    assert row.figures is not None
    assert (row.index, row.scenario, row.outcome) == (7, "bent", CaseOutcome.UNFINISHED)
    assert not set(TIMED) & set(row.figures)
    assert {key: row.figures[key] for key in outcome.figures if key not in TIMED} == {
        key: value for key, value in outcome.figures.items() if key not in TIMED
    }
    assert sum(row.figures["cycles_by_status"].values()) == len(outcome.result.cycles.times)
    assert row.figures["failures_driven"] == 0
    assert row.figures["seed"] == 4


def test_a_row_is_a_line_the_same_every_time(course: Scenario, outcome: Outcome) -> None:
    line = row_of(7, outcome).line()
    assert line == row_of(7, drive(Case(scenario=course, seed=4))).line()
    assert line.count("\n") == 1
    table = json.loads(line)
    assert list(table) == ["index", "scenario", "outcome", "detail", "course", "disturbances", "figures"]
    assert table["outcome"] == "unfinished"
    assert table["course"]["length_m"] == 22.5
    assert table["disturbances"]["state_noise"] == [0.0] * 5
    assert table["figures"]["min_clearance_m"] == outcome.figures["min_clearance_m"]


@pytest.mark.parametrize(
    ("docked", "ended", "last", "expected"),
    [
        (True, "docked", Status.DOCKED, CaseOutcome.DOCKED),
        (True, "duration", Status.SETTLING, CaseOutcome.UNCONFIRMED),
        (True, "docked", Status.ARRIVING, CaseOutcome.UNCONFIRMED),
        (False, "stopped", Status.STALLED, CaseOutcome.STALLED),
        (False, "stopped", Status.FAILED, CaseOutcome.FAILED),
        (False, "duration", Status.FAILED, CaseOutcome.UNFINISHED),
        (False, "duration", Status.SEARCHING, CaseOutcome.UNFINISHED),
    ],
)
def test_how_a_case_ended(
    outcome: Outcome, docked: bool, ended: str, last: Status, expected: CaseOutcome
) -> None:
    result = outcome.result
    cycles = replace(result.cycles, status=(*result.cycles.status[:-1], last))
    assert outcome_of(replace(result, ended=ended, cycles=cycles), docked=docked) is expected


def test_what_did_not_dock_has_the_last_reason(outcome: Outcome) -> None:
    reasons = ("early", "late", *[""] * (len(outcome.result.cycles.times) - 2))
    result = replace(outcome.result, cycles=replace(outcome.result.cycles, reason=reasons))
    assert row_of(0, replace(outcome, result=result)).detail == "late"
    words = (*result.cycles.status[:-1], Status.DOCKED)
    said = replace(result, cycles=replace(result.cycles, status=words))
    docked = replace(outcome, result=said, figures=outcome.figures | {"docked": True})
    assert (row_of(0, docked).outcome, row_of(0, docked).detail) == (CaseOutcome.DOCKED, "")


def test_refused_solutions_that_were_driven_are_counted(outcome: Outcome) -> None:
    cycles = outcome.result.cycles
    count = len(cycles.times)
    failed = np.zeros(count, dtype=np.bool_)
    failed[:3] = True
    source = (Source.SOLUTION, Source.BRAKING, Source.SOLUTION, *[Source.SOLUTION] * (count - 3))
    assert failures_driven(replace(cycles, failed=failed, source=source)) == 2


def test_figures_that_are_no_numbers_make_no_row(outcome: Outcome) -> None:
    row = row_of(0, replace(outcome, figures=outcome.figures | {"distance_m": float("nan")}))
    with pytest.raises(ValueError, match="not JSON compliant"):
        row.line()


def test_a_stop_is_told_by_the_controllers_own_word(scripted: Callable[..., Any], course: Scenario) -> None:
    standing = changed(course, {"simulation.duration": 10.0})
    stands = scripted(script=lambda now, state: (0.0, 0.0), status=lambda now: Status.STALLED)
    result: RunResult = simulate(standing, controller=stands)
    assert outcome_of(result, docked=False) is CaseOutcome.STALLED
