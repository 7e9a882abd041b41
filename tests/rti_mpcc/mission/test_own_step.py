"""A step from outside the package, that of docs/contributing.md: in Python, in a file, in a recording."""

from __future__ import annotations

import re
from collections.abc import Iterator
from math import pi
from pathlib import Path
from typing import Any

import pytest

from geometry import InputError, Pose2
from rti_mpcc import Dock, DockingController, DockingMission, MissionResult
from rti_mpcc.errors import ScenarioError
from rti_mpcc.mission import Step
from rti_mpcc.mission.step import STEPS
from rti_mpcc.recording import Recorder, read_recording, replay
from rti_mpcc.simulation import driver_of, load_scenario, save_scenario, scenario_from_dict, simulate
from tests.processes import fresh
from tests.rti_mpcc.own_code import shown_class
from tests.rti_mpcc.simulation.conftest import area_tables
from tests.rti_mpcc.yards import BRISK, YARD


@pytest.fixture(scope="module")
def turn_around() -> Iterator[type[Step]]:
    """The class that the page shows, as typed in a module of its own."""
    with shown_class("contributing.md", "TurnAround", STEPS, "turn_around") as step:
        yield step


def tables(**step: Any) -> dict[str, Any]:
    mission, run = [{"kind": "turn_around", **step}], {"cycle": 0.1, "duration": 90.0}
    return area_tables() | {"mission": mission, "simulation": run}


def test_a_file_gives_its_keys_and_it_is_driven(turn_around: type[Step], tmp_path: Path) -> None:
    scenario = scenario_from_dict(tables(ahead=1.0, timeout=80.0))
    assert load_scenario(save_scenario(scenario, tmp_path / "saved")) == scenario
    file = tmp_path / "own.jsonl"
    with Recorder(driver_of(scenario), file) as recorder:
        result = simulate(scenario, controller=recorder)
    assert result.mission_result is MissionResult.SUCCEEDED
    start, end = scenario.start_pose(), Pose2(*result.truth.poses[-1].tolist())
    assert end.relative_to(start.compose(Pose2(1.0, 0.0, pi))).within((0.06, 0.06, 0.04))
    (record,) = result.mission
    assert record.kind == "turn_around"
    assert replay(file).identical
    (step,) = read_recording(file).header.steps or ()
    assert isinstance(step, turn_around)
    assert step == turn_around(ahead=1.0, timeout=80.0)  # type: ignore[call-arg]


def test_a_recording_of_a_step_that_is_not_there_says_which(turn_around: type[Step], tmp_path: Path) -> None:
    file = tmp_path / "own.jsonl"
    Recorder(DockingMission(DockingController.in_area(YARD, BRISK), [turn_around()]), file).close()
    done = fresh("-c", f"from rti_mpcc.recording import read_recording; read_recording({str(file)!r})")
    assert "RecordingError" in done.stderr
    assert "step 'turn_around' is not known: import the module that defines it" in done.stderr


def test_wrong_keys_of_its_table_are_named(turn_around: type[Step]) -> None:
    for step, message in (
        ({"ahead": "far"}, "mission[0].ahead = 'far': must be a number"),
        ({"ahaed": 1.0}, "unknown key for kind = 'turn_around'"),
        ({"timeout": -1.0}, "mission[0].timeout = -1.0: must be > 0"),
    ):
        with pytest.raises(ScenarioError, match=re.escape(message)):
            scenario_from_dict(tables(**step))


def test_a_word_has_one_meaning() -> None:
    with pytest.raises(InputError, match=r"Other.word = 'dock': is the word of Dock"):
        type("Other", (Step,), {"word": "dock"})
    assert STEPS["dock"] is Dock


def test_what_is_no_step_is_refused() -> None:
    with pytest.raises(InputError, match=r"steps\[0\]"):
        DockingMission(DockingController.in_area(YARD, BRISK), [Step()])
