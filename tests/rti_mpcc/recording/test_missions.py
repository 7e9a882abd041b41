"""A mission is recorded and replayed as a controller is, with what told that its steps were over."""

from __future__ import annotations

from dataclasses import replace
from math import pi
from pathlib import Path

import numpy as np
import pytest

from estimation import CharucoBoard
from geometry import Area, InputError, Pose2
from rti_mpcc import ControllerConfig, DockingController
from rti_mpcc.mission import DockingMission
from rti_mpcc.recording import Recorder, read_recording, replay
from rti_mpcc.recording.steps import StepData, data_of, played_back, step_of
from rti_mpcc.simulation.plant import PlantParameters, PlantState, advance, issue
from rti_mpcc.steps import AnyStep, Approach, Dock, DockKind, DriveTo, Straight, Undock, Wait
from rti_mpcc.types import MissionResult

CONFIG = ControllerConfig(dead_time=0.1)
START = PlantState(x=0.0, y=0.0, phi=0.0)
BODY = ((-4.0, -1.0), (-2.5, -1.0), (-2.5, 1.0))
STEPS: tuple[AnyStep, ...] = (
    Dock(
        Pose2(1.0, 2.0, 0.5 * pi), name="a", kind=DockKind.CHARUCO, board=CharucoBoard(first_marker=7),
        approach=Approach(2.0, -1), tolerance=(0.04, 0.02, 0.01), body=BODY,
        contact=Straight(-1.0, speed=0.1),
        timeout=60.0, patience=9.0, retries=2, retry_from=0, then="continue",
    ),
    Wait(3.0, until=lambda: False),
    Straight(-1.5, speed=0.3, steering=0.04, tolerance=(0.03, 0.02), until=lambda: True, retries=1),
    Undock(-4.0, then="home"),
    DriveTo(Pose2(5.0, 6.0, 7.0), tolerance=(0.1, 0.2, 0.3)),
)  # fmt: skip


def begun(steps: list[AnyStep]) -> DockingMission:
    return DockingMission(DockingController.in_area(Area(), CONFIG), steps, home=Pose2(0.0, 0.0, 0.0))


def driven(recorder: Recorder, seconds: float, cancel_at: float | None = None) -> MissionResult:
    """The mission in closed loop for some seconds; what it came to."""
    plant, command = START, None
    parameters = PlantParameters.of(CONFIG.vehicle, CONFIG.limits, dead_time=CONFIG.dead_time)
    while plant.time < seconds:
        if cancel_at is not None and plant.time >= cancel_at:
            recorder.cancel()
            cancel_at = None
        command = recorder.step(plant.measured, now=plant.time)
        plant = issue(
            plant, parameters, acceleration=command.acceleration, steering_rate=command.steering_rate
        )
        plant = advance(plant, parameters, round(plant.time + CONFIG.cycle, 9))
    assert command is not None
    assert command.mission is not None
    return command.mission.result


@pytest.mark.parametrize("step", STEPS, ids=lambda step: step.word)
def test_each_step_comes_back(step: AnyStep) -> None:
    again = step_of(data_of(step))
    assert type(again) is type(step)
    for field in StepData.__dataclass_fields__:
        assert np.array_equal(getattr(data_of(again), field), getattr(data_of(step), field)), field
    assert getattr(again, "until", None) is (played_back if getattr(step, "until", None) else None)


def test_a_mission_is_replayed_to_the_bit(tmp_path: Path) -> None:
    asked: list[int] = []

    def over() -> bool:
        asked.append(0)
        return len(asked) > 20

    steps: list[AnyStep] = [Wait(until=over), Straight(1.0), Wait(0.2), Undock(-2.0)]
    with Recorder(begun(steps), tmp_path / "run.jsonl") as recorder:
        assert driven(recorder, 25.0) is MissionResult.SUCCEEDED
    report = replay(tmp_path / "run.jsonl")
    assert report.identical
    signals = [cycle.inputs.signal for cycle in read_recording(tmp_path / "run.jsonl").cycles]
    assert sum(signals) == 1
    assert len(asked) == 21  # the replay does not ask


def test_a_cancelled_mission_is_replayed(tmp_path: Path) -> None:
    with Recorder(begun([DriveTo(Pose2(12.0, 1.0, 0.0))]), tmp_path / "run.jsonl") as recorder:
        assert driven(recorder, 8.0, cancel_at=4.0) is MissionResult.CANCELLED
    assert replay(tmp_path / "run.jsonl").identical
    cycles = read_recording(tmp_path / "run.jsonl").cycles
    assert [cycle.inputs.now for cycle in cycles if cycle.inputs.cancelled] == pytest.approx([4.0], abs=0.06)


def test_what_told_that_a_step_was_over_matters(tmp_path: Path) -> None:
    file = tmp_path / "run.jsonl"
    with Recorder(begun([Wait(until=lambda: True), Straight(1.0)]), file) as recorder:
        driven(recorder, 1.0)
    cycles = read_recording(file).cycles
    told = next(cycle for cycle in cycles if cycle.inputs.signal)
    mission = read_recording(file).header.driver()
    assert isinstance(mission, DockingMission)
    for cycle in cycles[: told.number + 1]:
        inputs = replace(cycle.inputs, signal=False)
        command = mission.step(inputs.state, now=inputs.now, signal=inputs.signal)
    assert command.mission is not None
    assert command.mission.result is MissionResult.RUNNING
    assert told.command is not None
    assert told.command.mission is not None
    assert told.command.mission.result is MissionResult.SUCCEEDED


def test_a_mission_that_has_stepped_is_not_recorded(tmp_path: Path) -> None:
    mission = begun([Wait(1.0)])
    mission.step(START.measured, now=0.0)
    with pytest.raises(InputError, match="must begin with its first cycle"):
        Recorder(mission, tmp_path / "run.jsonl")
