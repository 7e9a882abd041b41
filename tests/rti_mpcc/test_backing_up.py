"""A goal that cannot be come to onward is passed and backed up into, in closed loop."""

from __future__ import annotations

from itertools import groupby
from typing import Any

import pytest

from geometry import Pose2
from rti_mpcc.config import ControllerConfig
from rti_mpcc.planning import schedule, search
from rti_mpcc.planning.state import Candidate
from rti_mpcc.simulation import (
    RunResult,
    Scenario,
    changed,
    docking_controller,
    scenario_from_dict,
    simulate,
    summary,
)
from rti_mpcc.types import Reason, Status
from tests.rti_mpcc.docking_runs import Clocked, drive, granting, short

CONFIG = ControllerConfig()
TIME = 32.0
"""What a run is given: it docks by backing up in 27 s [s]."""


def beside_a_wall(side: int, **changes: Any) -> Scenario:
    """A goal 1.1 m before the end of an S, near the wall on the outside of its last bend and turned."""
    tables: dict[str, Any] = {
        "name": "beside_a_wall",
        "path": {
            "start": [4.0, -3.0, 3.0],  # headings pass pi
            "segments": [
                {"direction": 1, "curvature": side * -0.08, "length": 8.0},
                {"direction": 1, "curvature": side * 0.11, "length": 8.8},
            ],
        },
        "corridor": {"left": 3.0, "right": -3.0},
        "goal": {"offset": [-1.1, side * -1.3, side * 0.3]},
        "simulation": {"dead_time": 0.18, "cycle": 0.05, "duration": TIME},
    }
    return changed(scenario_from_dict(tables), changes)


def in_reverse() -> Scenario:
    """A goal in reverse that is too much beside its path, and turned, to be come to onward."""
    tables: dict[str, Any] = {
        "name": "in_reverse",
        "path": {
            "start": [4.0, -3.0, 3.0],
            "segments": [
                {"direction": -1, "curvature": -0.07, "length": 7.0},
                {"direction": -1, "curvature": -0.14, "length": 3.0},
            ],
        },
        "corridor": {"left": 3.0, "right": -3.0},
        "goal": {"offset": [0.5, -0.5, 0.6]},
        "simulation": {"dead_time": 0.18, "cycle": 0.05, "duration": TIME},
    }
    return scenario_from_dict(tables)


def driven(scenario: Scenario) -> tuple[bool, int, list[float]]:
    """Whether it says that it docks in time, how often it began again, and its speeds [m/s]."""
    controller = docking_controller(scenario)
    again, speeds = 0, []
    for plant, command in drive(scenario, TIME, controller=controller):
        again = max(again, controller.state.task.restarts)
        speeds.append(plant.v)
        if command.docked:
            return True, again, speeds
    return False, again, speeds


def said(result: RunResult) -> list[Status]:
    return [status for status, _ in groupby(result.cycles.status)]


@pytest.mark.parametrize("side", [1, pytest.param(-1, marks=pytest.mark.acceptance)])
def test_the_goal_is_passed_and_backed_up_into_in_one_go(side: int) -> None:
    result = simulate(beside_a_wall(side))
    figures = summary(result)
    assert figures["docked"]
    assert figures["time_to_dock_s"] < 30.0
    assert figures["direction_changes"] == 1
    assert figures["pull_outs"] == 0
    assert figures["min_clearance_m"] > 0.05
    assert said(result) == [Status.ARRIVING, Status.SETTLING, Status.DOCKED]
    assert -1.01 * CONFIG.retries.retreat_speed < result.truth.v.min() < -0.05
    pairs = zip(result.cycles.status, result.cycles.reason, strict=True)
    arriving = [reason for status, reason in pairs if status is Status.ARRIVING]
    assert set(arriving) == {Reason.DRIVES_PAST_GOAL.message}


@pytest.mark.acceptance
def test_without_that_it_stalls_first(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(schedule, "scheduled_past_goal", lambda *_: None)
    _, again, _ = driven(beside_a_wall(1))
    assert again > 0


@pytest.mark.acceptance
def test_in_reverse_too() -> None:
    docked, again, speeds = driven(in_reverse())
    assert docked
    assert again == 0
    assert 0.05 < max(speeds) < 1.01 * CONFIG.retries.retreat_speed
    moving = [speed > 0.0 for speed in speeds if abs(speed) > 0.02]
    assert [forwards for forwards, _ in groupby(moving)] == [False, True]


@pytest.mark.acceptance
def test_in_reverse_it_stalls_first_without_that(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(schedule, "scheduled_past_goal", lambda *_: None)
    _, again, _ = driven(in_reverse())
    assert again > 0


@pytest.mark.acceptance
@pytest.mark.parametrize("since", [pytest.param(8.0, marks=pytest.mark.acceptance), 20.0])
def test_a_goal_that_moves_a_little_meanwhile_is_backed_up_into_in_one_go(since: float) -> None:
    """Before it is passed, and while the vehicle is beyond it."""
    scenario = beside_a_wall(1)
    goal = scenario.goal_pose(scenario.build_path())
    assert goal is not None
    moved = goal.compose(Pose2(1.2 * CONFIG.arrival_timing.target_moved, 0.05, 0.0))
    controller = docking_controller(scenario)
    told = drive(scenario, TIME, controller=controller, goal_at=lambda now: moved if now > since else goal)
    for _, command in told:
        assert controller.state.task.restarts == 0
        if command.docked:
            break
    assert command.docked


@pytest.mark.acceptance
@pytest.mark.parametrize("seed", [1, 2])
def test_a_goal_that_is_detected_with_noise_is_backed_up_into_in_one_go(seed: int) -> None:
    result = simulate(beside_a_wall(1, **{"goal.measurement": {"visible_range": 15.0}}), seed=seed)
    figures = summary(result)
    assert figures["docked"]
    assert figures["direction_changes"] == 1
    assert said(result) == [Status.ARRIVING, Status.SETTLING, Status.DOCKED]


@pytest.mark.acceptance
@pytest.mark.parametrize("noisy", [pytest.param(False, marks=pytest.mark.acceptance), True])
def test_a_goal_that_is_come_to_onward_is_not_passed(noisy: bool) -> None:
    told = {"goal.measurement": {"visible_range": 15.0}} if noisy else {}
    result = simulate(changed(short(), told))
    figures = summary(result)
    assert figures["docked"]
    assert figures["direction_changes"] == 0
    assert not any(Reason.DRIVES_PAST_GOAL.message in reason for reason in result.cycles.reason)


# -- without time for the whole search in one cycle ------------------------------------------------------


@pytest.mark.parametrize("iterations", [pytest.param(1, marks=pytest.mark.acceptance), 2])
def test_a_search_that_is_cut_goes_on_in_the_next_cycle(iterations: int) -> None:
    """First the one onward, until it is known to miss."""
    scenario = beside_a_wall(1)
    controller = docking_controller(scenario)
    clocked = Clocked(controller, lambda now: granting(iterations))
    begun = []
    for _, command in drive(scenario, TIME, controller=clocked):
        suspended = controller.state.plans.suspended
        if suspended is not None:
            begun.append(suspended)
        if command.docked:
            break
    assert command.docked
    assert controller.state.task.pulled_out == 0
    tried = [candidate for candidate, _ in groupby(each.candidates[0] for each in begun)]
    assert tried == [Candidate.ONWARD, Candidate.BACK_INTO_GOAL]
    assert all(
        (each.candidates[0] is Candidate.BACK_INTO_GOAL) == each.segment.reverses_into_goal for each in begun
    )
    backing = [each.iterations for each in begun if each.segment.reverses_into_goal]
    assert backing == sorted(backing)


@pytest.mark.parametrize("iterations", [1, 2, 5])
def test_one_that_looks_for_it_in_vain_drives_all_the_same(
    iterations: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(search, "reaches", lambda *_: False)
    scenario = short()
    controller = Clocked(docking_controller(scenario), lambda now: granting(iterations))
    statuses = [command.status for _, command in drive(scenario, 3.0, controller=controller)]
    assert statuses[-1] is Status.ARRIVING
    assert statuses.count(Status.STARTING) < 40
