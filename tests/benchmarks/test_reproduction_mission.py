"""The docking mission in the reproduction: what is measured of it, its sentences, tables and pictures."""

from __future__ import annotations

import json
from dataclasses import replace
from math import radians
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from benchmarks.reproduction.content import Picture, Table
from benchmarks.reproduction.mission import (
    Motion,
    lowering,
    mission_section,
    motion_figure,
    motion_of,
    verdicts,
)
from benchmarks.reproduction.verdicts import CAME, MISSED, UNSAID
from rti_mpcc.simulation import RunResult
from rti_mpcc.simulation.batch import Case, DrivenCase, drive_all
from tests.rti_mpcc.short_missions import short

WELL = Motion(changes=1, stood=(18.0, 20.0), stops=0, first_seen=18.5, connecting=(0.2, 0.05))


def step(kind: str, begin: float, end: float | None, **changes: Any) -> dict[str, Any]:
    error = {"longitudinal_m": 0.02, "lateral_m": 0.001, "heading_rad": radians(0.1)}
    usual = {"step": 0, "kind": kind, "attempt": 0, "begin_s": begin, "end_s": end, "reason": ""}
    return {**usual, "result": "SUCCEEDED", "final_error": None if kind == "wait" else error, **changes}


def figures(*steps: dict[str, Any], at_goal: float | None = 30.0) -> dict[str, Any]:
    usual = (step("dock", 0.0, 31.0), step("wait", 31.0, 41.0), step("straight", 41.0, 47.0))
    return {"time_to_tolerance_s": at_goal, "mission": list(steps or usual)}


def words(told: list[str]) -> list[str]:
    """What each sentence comes to."""
    return [next(word for word in (MISSED, UNSAID, CAME) if word in each) for each in told]


@pytest.fixture(scope="module")
def outcome() -> DrivenCase:
    return drive_all([Case(scenario=short())], jobs=1)[0]


@pytest.fixture(scope="module")
def result(outcome: DrivenCase) -> RunResult:
    return outcome.result


def test_all_comes_out_of_a_mission_like_the_papers() -> None:
    told = verdicts(figures(), WELL)
    assert words(told) == [CAME] * 6
    assert told[0].endswith("(30.0 s here, about 50 s in the paper's yard).")
    assert "stands there from 18.0 to 20.0 s, first detection at 18.5 s" in told[1]
    assert told[3].endswith("(10.0 s here, about 10 s in the paper).")
    assert told[5].endswith("(1.0 mm and 0.10° off its axis, asked for are 20 mm and 0.5°).")


@pytest.mark.parametrize(
    ("changes", "place", "word"),
    [
        ({"first_seen": 17.0}, 1, MISSED),
        ({"first_seen": 21.0}, 1, MISSED),
        ({"first_seen": None}, 1, MISSED),
        ({"stood": None}, 1, UNSAID),
        ({"changes": 2}, 2, MISSED),
        ({"stops": 1}, 2, MISSED),
        ({"stops": None}, 2, UNSAID),
        ({"connecting": (0.3, 0.05)}, 4, MISSED),
        ({"connecting": (0.2, 0.08)}, 4, MISSED),
    ],
)
def test_what_went_otherwise_is_said(changes: dict[str, Any], place: int, word: str) -> None:
    told = words(verdicts(figures(), replace(WELL, **changes)))
    assert told[place] == word
    assert told[:place] + told[place + 1 :] == [CAME] * 5


def test_a_short_lowering_and_a_crooked_contact_do_not_come_out() -> None:
    crooked = {"longitudinal_m": 0.0, "lateral_m": 0.0, "heading_rad": radians(-0.6)}
    steps = step("wait", 31.0, 36.0), step("straight", 41.0, 47.0, final_error=crooked)
    assert words(verdicts(figures(*steps), WELL))[3:] == [MISSED, CAME, MISSED]
    failed = step("wait", 31.0, 41.0), step("straight", 41.0, 47.0, result="BLOCKED")
    assert words(verdicts(figures(*failed), WELL))[3:] == [CAME, CAME, MISSED]


def test_a_mission_that_never_came_there() -> None:
    nothing = Motion(changes=None, stood=None, stops=None, first_seen=None, connecting=None)
    early = figures(step("dock", 0.0, None, result="RUNNING", final_error=None), at_goal=None)
    told = verdicts(early, nothing)
    assert words(told) == [MISSED, UNSAID, UNSAID, MISSED, MISSED]
    assert told[-1] == f"It connects: {MISSED}."
    assert lowering(early) is None


def drive(*pieces: tuple[float, float], first_seen: float | None = None) -> tuple[Any, dict[str, Any]]:
    """Seconds and speed of each piece, one after the other; the goal is reached at the end."""
    v = np.concatenate([np.full(round(100 * seconds), speed) for seconds, speed in pieces])
    times = 0.01 * np.arange(len(v))
    truth = SimpleNamespace(times=times, v=v, delta=np.full(len(v), 0.1))
    told = {"time_to_tolerance_s": float(times[-1]), "goal": {"first_seen_s": first_seen}}
    return SimpleNamespace(truth=truth, mission=()), told


def test_the_change_of_direction_and_further_stops_are_found() -> None:
    run, told = drive((1.0, 0.0), (3.0, 1.0), (2.0, 0.0), (3.0, -1.0), first_seen=4.5)
    motion = motion_of(run, told)
    assert motion.stood == pytest.approx((4.0, 5.99))
    assert (motion.changes, motion.stops, motion.first_seen) == (1, 0, 4.5)
    assert motion.connecting is None
    halting, told = drive((3.0, 1.0), (2.0, 0.0), (1.0, -1.0), (1.0, 0.0), (2.0, -1.0))
    assert motion_of(halting, told).stops == 1
    brief, told = drive((3.0, 1.0), (2.0, 0.0), (1.0, -1.0), (0.2, 0.0), (2.0, -1.0))
    assert motion_of(brief, told).stops == 0


def test_a_drive_without_a_change_of_direction_has_no_stop_at_it() -> None:
    run, told = drive((3.0, 1.0))
    motion = motion_of(run, {**told, "goal": None})
    assert (motion.changes, motion.stood, motion.stops, motion.first_seen) == (0, None, None, None)
    never = motion_of(run, {"time_to_tolerance_s": None, "goal": None})
    assert never.changes is None


def test_speed_and_steering_while_it_connects_are_those_of_the_run(result: RunResult) -> None:
    motion = motion_of(result, {"time_to_tolerance_s": None, "goal": None})
    assert motion.connecting is not None
    speed, steering = motion.connecting
    assert speed == pytest.approx(0.2, abs=0.005)
    assert steering <= 0.051
    waiting = replace(result, mission=(replace(result.mission[2], begin=1e3, end=None),))
    assert motion_of(waiting, {"time_to_tolerance_s": None, "goal": None}).connecting is None


def test_the_picture_over_time(outcome: DrivenCase) -> None:
    figure = motion_figure(outcome.result, outcome.figures)
    labels = figure.axes[0].get_legend_handles_labels()[1]
    assert list(dict.fromkeys(labels)) == ["true", "step, succeeded", "end of the lowering", "T_goal"]
    assert [axes.get_ylabel() for axes in figure.axes] == ["speed v [m/s]", "steering δ [rad]"]
    assert [text.get_text() for text in figure.axes[0].texts] == ["dock", "wait", "straight"]
    never = motion_figure(outcome.result, {**outcome.figures, "time_to_tolerance_s": None})
    assert "T_goal" not in never.axes[0].get_legend_handles_labels()[1]


def test_the_whole_section(outcome: DrivenCase) -> None:
    section = mission_section(outcome)
    assert [block.name for block in section.blocks if isinstance(block, Picture)] == [
        "mission_over_time",
        "mission_plane",
    ]
    beside, steps = (block for block in section.blocks if isinstance(block, Table))
    here = {row[0]: row[1:] for row in beside.rows}
    assert here["T_goal [s]"] == ["about 50", f"{outcome.figures['time_to_tolerance_s']:.1f}"]
    assert here["lowering [s]"] == ["about 10", "1.0"]
    assert [row[0] for row in steps.rows] == ["dock", "wait", "straight"]
    assert steps.rows[1][4:] == ["", "", ""]
    measured = json.loads(json.dumps(section.figures, allow_nan=False))
    assert measured["motion"]["connecting"][0] == pytest.approx(0.2, abs=0.005)
    assert len(measured["steps"]) == 3
