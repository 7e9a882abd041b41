"""The recorder: the same controller, written down, whatever happens to the file."""

from __future__ import annotations

import io
import logging
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rti_mpcc.docking import DockingController
from rti_mpcc.errors import InputError
from rti_mpcc.recording import Recorder, read_recording, replay
from rti_mpcc.simulation import docking_controller
from rti_mpcc.types import Command, Reason, VehicleState
from tests.rti_mpcc.docking_runs import drive as drive_bare
from tests.rti_mpcc.recording.recordings import CYCLE, GOAL, SCENARIO, controller, drive, measurement, record

REST = VehicleState(x=1.0, y=2.0, phi=1.0, v=0.0, delta=0.0)


def test_commands_are_those_of_the_controller_alone(tmp_path: Path) -> None:
    with Recorder(docking_controller(SCENARIO), tmp_path / "run.jsonl") as recorder:
        recorded = drive(recorder, range(20))
    alone = [command for _, command in drive_bare(SCENARIO, 20 * CYCLE)]
    assert [command.acceleration for command in recorded] == [command.acceleration for command in alone]
    assert [command.steering_rate for command in recorded] == [command.steering_rate for command in alone]


def test_a_controller_that_has_stepped_is_refused(tmp_path: Path) -> None:
    controller = docking_controller(SCENARIO)
    controller.step(REST, now=0.0)
    with pytest.raises(InputError, match="has stepped before"):
        Recorder(controller, tmp_path / "run.jsonl")
    assert not (tmp_path / "run.jsonl").exists()


def test_a_goal_cleared_before_the_first_step_is_no_step(tmp_path: Path) -> None:
    controller = docking_controller(SCENARIO)
    controller.clear_goal()
    Recorder(controller, tmp_path / "run.jsonl").close()
    assert read_recording(tmp_path / "run.jsonl").cycles == ()
    assert replay(tmp_path / "run.jsonl").identical


def test_a_file_that_cannot_be_made_is_refused(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError):
        Recorder(docking_controller(SCENARIO), tmp_path / "nowhere" / "run.jsonl")


def test_every_cycle_is_on_its_way_to_the_disk_when_its_command_is_there(tmp_path: Path) -> None:
    file = tmp_path / "run.jsonl"
    recorder = Recorder(docking_controller(SCENARIO), file)
    for cycle in range(3):
        recorder.step(REST, now=cycle * CYCLE, goal=GOAL)
        assert len(read_recording(file, allow_truncated=True).cycles) == cycle + 1
    recorder.close()
    assert read_recording(file).complete


def test_numbers_of_other_types_and_what_is_none(tmp_path: Path) -> None:
    with Recorder(docking_controller(SCENARIO), tmp_path / "run.jsonl") as recorder:
        odd = VehicleState(x=1, y=np.float32(2.1), phi=None, v="fast", delta=10**400)  # type: ignore[arg-type]
        recorder.step(odd, now=np.float64(0.5), obstacles=5)  # type: ignore[arg-type]
        recorder.step(REST, now=1, obstacles=[[[9, 9], [10, 9], [10, 10]]])
    first, second = (cycle.inputs for cycle in read_recording(tmp_path / "run.jsonl").cycles)
    assert (first.state.x, first.state.y, first.now) == (1.0, float(np.float32(2.1)), 0.5)
    assert np.isnan([first.state.phi, first.state.v, first.state.delta]).all()
    assert second.obstacles is not None
    assert second.obstacles[0].tolist() == [[9.0, 9.0], [10.0, 9.0], [10.0, 10.0]]
    assert replay(tmp_path / "run.jsonl").identical


class Trap:
    """Raises something else whenever it is looked at."""

    def __getattr__(self, name: str) -> Any:
        raise RuntimeError(name)

    def __iter__(self) -> Any:
        raise LookupError("nothing here")


UNREADABLE: dict[str, list[Any]] = {
    "goal": [(1, 2, 3), "x", Trap()],
    "state": [None, (1.0, 2.0, 1.0, 0.0, 0.0), Trap()],
    "measurements": [
        [(1, 2, 3)],
        [None],
        [Trap()],
        Trap(),
        5,
        [measurement(0, REST, vehicle=5)],
        [measurement(0, REST, frame=5)],
    ],
    "obstacles": [5, Trap(), [[[10**400, 0.0]]]],
    "now": [None, "noon"],
}


@pytest.mark.parametrize(
    ("name", "place"), [(name, place) for name, given in UNREADABLE.items() for place in range(len(given))]
)
def test_what_is_no_input_at_all_is_recorded_as_nan_and_said(name: str, place: int, tmp_path: Path) -> None:
    with Recorder(docking_controller(SCENARIO), tmp_path / "run.jsonl") as recorder:
        arguments: dict[str, Any] = {"state": REST, "now": 0.0, "goal": GOAL} | {
            name: UNREADABLE[name][place]
        }
        command = recorder.step(arguments.pop("state"), **arguments)
    told = command.diagnostics
    said = [told.reason, *(judgement.reason for judgement in told.detections)]
    assert any("nan" in reason or "not finite" in reason for reason in said), said
    assert told.cause is not Reason.MISTAKE
    assert len(read_recording(tmp_path / "run.jsonl").cycles) == 1
    assert replay(tmp_path / "run.jsonl").identical


def test_no_measurements_may_be_none(tmp_path: Path) -> None:
    missing: Any = None
    with Recorder(docking_controller(SCENARIO), tmp_path / "run.jsonl") as recorder:
        assert recorder.step(REST, now=0.0, goal=GOAL, measurements=missing).diagnostics.reason == ""


class FullDisk(io.BytesIO):
    def flush(self) -> None:
        raise OSError(28, "No space left on device")


def test_a_full_disk_ends_the_recording_and_not_the_drive(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    recorder = Recorder(docking_controller(SCENARIO), tmp_path / "run.jsonl")
    assert recorder._file is not None
    recorder._file.close()
    recorder._file = FullDisk()
    with caplog.at_level(logging.ERROR), recorder:
        assert len(drive(recorder, range(3))) == 3
    (message,) = caplog.messages
    assert message.startswith("recording has ended, its file cannot be written: [Errno 28]")


class Unwritable(DockingController):
    """Raises what UTF-8 cannot write."""

    def step(self, *arguments: Any, **named: Any) -> Command:
        raise RuntimeError("\udcff")


def test_text_that_cannot_be_written_ends_the_recording_alone(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    with Recorder(controller(Unwritable), tmp_path / "run.jsonl") as recorder:
        with pytest.raises(RuntimeError, match="\udcff"):
            recorder.step(REST, now=0.0)
        with pytest.raises(RuntimeError, match="\udcff"):
            recorder.step(REST, now=1.0)
    (message,) = caplog.messages
    assert message.startswith("recording has ended, its file cannot be written: ")
    assert read_recording(tmp_path / "run.jsonl", allow_truncated=True).cycles == ()


def test_cycles_after_the_end_are_driven_and_not_recorded(tmp_path: Path) -> None:
    with Recorder(docking_controller(SCENARIO), tmp_path / "run.jsonl") as recorder:
        drive(recorder, range(2))
    recorder.close()
    recorder.step(REST, now=1.0)
    assert len(read_recording(tmp_path / "run.jsonl").cycles) == 2


def test_the_same_run_makes_the_same_recording_but_for_times(tmp_path: Path) -> None:
    first, second = (
        read_recording(record(tmp_path / name, 5)).cycles for name in ("first.jsonl", "second.jsonl")
    )
    for one, other in zip(first, second, strict=True):
        assert one.inputs == other.inputs
        assert one.decisions == other.decisions
        assert one.command is not None
        assert other.command is not None
        np.testing.assert_array_equal(one.command.trajectory.states, other.command.trajectory.states)
