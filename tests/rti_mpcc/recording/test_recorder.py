"""The recorder: the same controller, written down, whatever it is given and whatever happens to the file."""

from __future__ import annotations

import logging
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from geometry import Pose2
from rti_mpcc.errors import InputError
from rti_mpcc.recording import Recorder, load_problem, read_recording, replay
from rti_mpcc.types import Obstacle, Reason, VehicleState
from tests.rti_mpcc.docking_runs import drive as drive_bare
from tests.rti_mpcc.recording.recordings import (
    CYCLE,
    FAILED,
    GOAL,
    SCENARIO,
    controller,
    drive,
    eventful,
    measurement,
)

REST = VehicleState(x=1.0, y=2.0, phi=1.0, v=0.0, delta=0.0)


def test_commands_are_those_of_the_controller_alone(tmp_path: Path) -> None:
    with Recorder(controller(), tmp_path / "run.jsonl") as recorder:
        recorded = drive(recorder, range(20))
    alone = [command for _, command in drive_bare(SCENARIO, 20 * CYCLE)]
    assert [(each.acceleration, each.steering_rate) for each in recorded] == [
        (each.acceleration, each.steering_rate) for each in alone
    ]


def test_a_controller_that_has_stepped_and_a_file_that_cannot_be_made_are_refused(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError):
        Recorder(controller(), tmp_path / "nowhere" / "run.jsonl")
    stepped = controller()
    stepped.step(REST, now=0.0)
    with pytest.raises(InputError, match="has stepped before"):
        Recorder(stepped, tmp_path / "run.jsonl")
    assert not (tmp_path / "run.jsonl").exists()


def test_every_cycle_is_on_its_way_to_the_disk_when_its_command_is_there(tmp_path: Path) -> None:
    file = tmp_path / "run.jsonl"
    recorder = Recorder(controller(), file)
    for cycle in range(3):
        recorder.step(REST, now=cycle * CYCLE, goal=GOAL)
        assert len(read_recording(file, allow_truncated=True).cycles) == cycle + 1
    recorder.close()
    recorder.close()
    recorder.step(REST, now=1.0)  # driven, and not recorded
    assert read_recording(file).complete
    assert len(read_recording(file).cycles) == 3


def test_numbers_of_other_types(tmp_path: Path) -> None:
    with Recorder(controller(), tmp_path / "run.jsonl") as recorder:
        odd = VehicleState(x=1, y=np.float32(2.1), phi=np.int64(1), v=0, delta=0)  # type: ignore[arg-type]
        recorder.step(odd, now=np.float64(0.5))
        recorder.step(REST, now=1, obstacles=[[[9, 9], [10, 9], [10, 10]]])
    first, second = (cycle.inputs for cycle in read_recording(tmp_path / "run.jsonl").cycles)
    assert repr(first.state) == f"VehicleState(x=1.0, y={float(np.float32(2.1))}, phi=1.0, v=0.0, delta=0.0)"
    assert (first.now, repr(second.now)) == (0.5, "1.0")
    assert second.obstacles is not None
    assert np.asarray(second.obstacles[0]).tolist() == [[9.0, 9.0], [10.0, 9.0], [10.0, 10.0]]
    assert replay(tmp_path / "run.jsonl").identical


def test_obstacles_that_say_how_they_move_are_played_back(tmp_path: Path) -> None:
    corners = [[9.0, 9.0], [10.0, 9.0], [10.0, 10.0]]
    given: list[Any] = [Obstacle(corners, (0.5, -0.1), 0.2, "cart"), Obstacle(corners), corners]
    with Recorder(controller(), tmp_path / "run.jsonl") as recorder:
        for k in range(3):
            recorder.step(REST, now=0.05 * k, obstacles=given)
    (*_, last) = (cycle.inputs for cycle in read_recording(tmp_path / "run.jsonl").cycles)
    assert last.obstacles is not None
    moving, named, bare = last.obstacles
    assert isinstance(moving, Obstacle)
    assert (moving.velocity, moving.turn_rate, moving.name) == ((0.5, -0.1), 0.2, "cart")
    assert isinstance(named, Obstacle)
    assert named.velocity is None
    assert [np.asarray(each).tolist() for each in (moving, named, bare)] == 3 * [corners]
    assert replay(tmp_path / "run.jsonl").identical


class Trap:
    """Raises something else whenever it is looked at."""

    def __getattr__(self, name: str) -> Any:
        raise RuntimeError(name)

    def __iter__(self) -> Any:
        raise LookupError("nothing here")


@pytest.mark.parametrize(
    ("name", "given"),
    [
        *(("goal", each) for each in [(1, 2, 3), "x", Trap()]),
        *(("state", each) for each in [None, Trap(), VehicleState(1, 2, 3, None, 10**400)]),  # type: ignore[arg-type]
        *(("measurements", each) for each in [[(1, 2, 3)], [None], Trap(), 5]),
        ("measurements", [measurement(0, REST, vehicle=5)]),
        *(("obstacles", each) for each in [5, Trap(), [[[10**400, 0.0]]]]),
        *(("now", each) for each in [None, "noon"]),
    ],
    ids=lambda given: given if isinstance(given, str) else type(given).__name__,
)
def test_what_is_no_input_at_all_is_recorded_as_nan_and_said(name: str, given: Any, tmp_path: Path) -> None:
    with Recorder(controller(), tmp_path / "run.jsonl") as recorder:
        arguments: dict[str, Any] = {"state": REST, "now": 0.0, "goal": GOAL} | {name: given}
        command = recorder.step(arguments.pop("state"), **arguments)
    diagnostics = command.diagnostics
    said = [diagnostics.reason, *(judgement.reason for judgement in diagnostics.detections)]
    assert any("nan" in reason or "not finite" in reason for reason in said), said
    assert diagnostics.cause is not Reason.INTERNAL_ERROR
    assert len(read_recording(tmp_path / "run.jsonl").cycles) == 1
    assert replay(tmp_path / "run.jsonl").identical


def test_no_measurements_may_be_none_and_a_pose_need_not_be_finite(tmp_path: Path) -> None:
    missing: Any = None
    goal = Pose2(0.0, 0.0, 0.0)
    object.__setattr__(goal, "x", np.nan)
    with Recorder(controller(), tmp_path / "run.jsonl") as recorder:
        assert recorder.step(REST, now=0.0, goal=GOAL, measurements=missing).diagnostics.reason == ""
        recorder.step(REST, now=CYCLE, goal=goal)
    assert repr(read_recording(tmp_path / "run.jsonl").cycles[1].inputs.goal) == repr(goal)
    assert replay(tmp_path / "run.jsonl").identical


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="there is no full disk")
def test_a_full_disk_ends_the_recording_and_not_the_drive(caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.ERROR), Recorder(controller(), "/dev/full") as recorder:
        assert len(drive(recorder, range(3))) == 3
    (message,) = caplog.messages
    assert message.startswith("recording has ended, its file cannot be written: [Errno 28]")
    assert recorder.problem == "[Errno 28] No space left on device"


# -- QPs of failed cycles -------------------------------------------------------------------------------

FILES = [f"qp_{cycle:06d}.npz" for cycle in FAILED]


def names(folder: Path) -> list[str]:
    return sorted(file.name for file in folder.iterdir())


def test_the_qps_of_failed_cycles_are_written_when_driven_and_when_replayed(tmp_path: Path) -> None:
    recorded = controller()
    with Recorder(recorded, tmp_path / "run.jsonl", dump_failed=tmp_path / "qp") as recorder:
        commands = drive(recorder, range(FAILED.stop), eventful)
    assert replay(tmp_path / "run.jsonl", dump_failed=tmp_path / "again").identical
    assert names(tmp_path / "qp") == names(tmp_path / "again") == FILES
    problem = recorded.problem()
    for folder in ("qp", "again"):
        loaded = load_problem(tmp_path / folder / FILES[-1])
        for name in ("gradient", "lower", "upper", "primal", "dual"):
            np.testing.assert_array_equal(getattr(loaded, name), getattr(problem, name))
        for name in ("cost", "constraints"):
            np.testing.assert_array_equal(getattr(loaded, name).toarray(), getattr(problem, name).toarray())
        with np.load(tmp_path / folder / FILES[0]) as content:
            assert int(content["cycle"]) == FAILED[0]
            assert str(content["status"]) == commands[FAILED[0]].diagnostics.solver_status


def test_a_folder_that_is_gone_does_not_stop_the_drive(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    with Recorder(controller(), tmp_path / "run.jsonl", dump_failed=tmp_path / "qp") as recorder:
        shutil.rmtree(tmp_path / "qp")
        assert len(drive(recorder, range(FAILED.stop), eventful)) == FAILED.stop
    assert sum("was not written" in message for message in caplog.messages) == len(FAILED)
