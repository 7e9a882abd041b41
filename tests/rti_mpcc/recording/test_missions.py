"""A mission is recorded and replayed as a controller is, with what told that its steps were over."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from geometry import Area, Pose2
from rti_mpcc import ControllerConfig, DockingController
from rti_mpcc.mission import Approach, Dock, DockingMission, DriveTo, Step, Straight, Undock, Wait
from rti_mpcc.recording import Recorder, read_recording, replay
from rti_mpcc.simulation.plant import PlantParameters, PlantState
from rti_mpcc.types import MissionResult
from tests.rti_mpcc.docking_runs import obeyed
from tests.rti_mpcc.mission_runs import CANCELLED, RUNNING, SUCCEEDED, TIMED_OUT, results
from tests.rti_mpcc.recording.recordings import box, change

CONFIG = ControllerConfig(dead_time=0.1)
START = PlantState(x=0.0, y=0.0, phi=0.0)


def begun(steps: Sequence[Step]) -> DockingMission:
    return DockingMission(DockingController.in_area(Area(), CONFIG), steps, home=Pose2(0.0, 0.0, 0.0))


def driven(recorder: Recorder, seconds: float, cancel_at: float | None = None) -> MissionResult:
    """The mission in closed loop for some seconds, or until it is over; what it came to."""
    plant, command, mission = START, None, recorder.controller
    assert isinstance(mission, DockingMission)
    parameters = PlantParameters.of(CONFIG.vehicle, CONFIG.limits, dead_time=CONFIG.dead_time)
    while plant.time < seconds and mission.result is MissionResult.RUNNING:
        if cancel_at is not None and plant.time >= cancel_at:
            recorder.cancel()
            cancel_at = None
        command = recorder.step(plant.measured, now=plant.time)
        plant = obeyed(plant, command, parameters, round(plant.time + CONFIG.cycle, 9))
    assert command is not None
    assert command.mission is not None
    return mission.result


def after(count: int, asked: list[int]) -> bool:
    """Whether it was asked so often; keeps it in a list."""
    asked.append(0)
    return len(asked) >= count


@pytest.fixture(scope="module")
def eventful(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, DockingMission]:
    """All kinds of steps: a condition, one that is tried again, a contact, and the last one is cancelled."""
    file = tmp_path_factory.mktemp("missions") / "eventful.jsonl"
    steps: list[Step] = [
        Wait(until=partial(after, 10, [])),
        DriveTo(Pose2(9.0, 3.0, 0.0), timeout=0.6, retries=1, then="continue"),
        Dock(Pose2(3.0, 0.0, 0.0), body=box(5.0, -0.2), approach=Approach(0.5, 1), timeout=60.0),
        Straight(0.6, speed=0.3, until=partial(after, 15, [])),
        Undock(-4.0),
    ]
    mission = begun(steps)
    with Recorder(mission, file) as recorder:
        driven(recorder, 40.0, cancel_at=14.0)
    return file, mission


def test_all_kinds_of_steps_are_replayed_to_the_bit(eventful: tuple[Path, DockingMission]) -> None:
    file, mission = eventful
    assert results(mission.log) == [
        ("wait", 0, 0, SUCCEEDED),
        ("drive_to", 1, 0, TIMED_OUT),
        ("drive_to", 1, 1, TIMED_OUT),
        ("dock", 2, 0, SUCCEEDED),
        ("straight", 3, 0, SUCCEEDED),
        ("undock", 4, 0, CANCELLED),
    ]
    report = replay(file)
    assert (report.identical, report.tolerance, report.complete) == (True, 0.0, True)
    cycles = read_recording(file).cycles
    assert [cycle.number for cycle in cycles if cycle.inputs.cancelled] == [cycles[-1].number]
    assert sum(cycle.inputs.signal for cycle in cycles) == 2
    recorded_log = [cycle.command.mission for cycle in cycles if cycle.command is not None]
    assert [(each.step, each.result) for each in recorded_log if each and each.result is not RUNNING] == [
        (record.place, record.result) for record in mission.log
    ]


@pytest.mark.parametrize("field", ["signal", "cancelled"])
def test_a_changed_line_is_found(eventful: tuple[Path, DockingMission], field: str) -> None:
    file, _ = eventful
    cycles = read_recording(file).cycles
    place = next(cycle.number for cycle in cycles if getattr(cycle.inputs, field))

    def turn(data: dict[str, Any]) -> None:
        data["inputs"][field] = not data["inputs"][field]

    mismatch = replay(change(file, place, turn, checked=True)).mismatch
    assert mismatch is not None
    assert (mismatch.cycle, mismatch.changed) == (place, "")
    assert "command.mission.result" in [difference.field for difference in mismatch.fields]


def test_the_mission_itself_may_be_cancelled(tmp_path: Path) -> None:
    """Before the recording begins, or past the recorder: it is recorded all the same."""
    mission = begun([Wait(1.0)])
    mission.cancel()
    with Recorder(mission, tmp_path / "run.jsonl") as recorder:
        assert driven(recorder, 1.0) is CANCELLED
    assert [cycle.inputs.cancelled for cycle in read_recording(tmp_path / "run.jsonl").cycles] == [True]
    assert replay(tmp_path / "run.jsonl").identical


@pytest.mark.parametrize("said", [np.array([1.0, 2.0]), "yes", np.False_], ids=["array", "text", "numpy"])
def test_whatever_a_condition_says_is_recorded_as_true_or_false(said: Any, tmp_path: Path) -> None:
    mission = begun([Wait(until=lambda: said, timeout=0.3)])
    with Recorder(mission, tmp_path / "run.jsonl") as recorder:
        driven(recorder, 2.0)
    assert mission.result is (SUCCEEDED if isinstance(said, str) else TIMED_OUT)
    assert replay(tmp_path / "run.jsonl").identical
    cycles = read_recording(tmp_path / "run.jsonl").cycles
    assert any(cycle.inputs.signal for cycle in cycles) == (mission.result is SUCCEEDED)
