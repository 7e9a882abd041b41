"""Rides of runs and of recordings, and the pictures of a camera."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from estimation import Camera, CharucoBoard, CharucoGoalDetector
from geometry import Pose2
from rti_mpcc.errors import InputError, RecordingError
from rti_mpcc.recording import Recorder, read_recording
from rti_mpcc.report.ride import CameraFrames, Moment, Ride, ride_of_recording, ride_of_run
from rti_mpcc.simulation import RunResult, docking_controller
from rti_mpcc.simulation.camera import BoardCamera, Optics
from rti_mpcc.simulation.sections.camera import CameraSection
from tests.rti_mpcc.recording.recordings import (
    AWAY,
    BEFORE,
    BLIND,
    EVENTFUL,
    SCENARIO,
    drive,
    eventful,
)


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A recording with obstacles that come and go, a clock that goes back, and a cycle without a position."""
    file = tmp_path_factory.mktemp("ride") / "eventful.jsonl"
    with Recorder(docking_controller(SCENARIO), file) as recorder:
        drive(recorder, range(EVENTFUL), eventful)
    return file


@pytest.fixture(scope="module")
def replayed(recorded: Path) -> Ride:
    return ride_of_recording(recorded)


def test_ride_of_a_run_has_each_cycle_at_the_true_pose(run: RunResult, ride: Ride) -> None:
    assert ride.title == "docking_full_course (default)"
    assert [moment.time for moment in ride.moments] == pytest.approx(run.cycles.times)
    rows = np.searchsorted(run.truth.times, run.cycles.times - 1e-9)
    assert np.array([moment.pose for moment in ride.moments]) == pytest.approx(run.truth.poses[rows])
    assert {tuple(moment.goal) for moment in ride.moments if moment.goal is not None} == {
        tuple(run.truth.goals[0])
    }
    assert {len(moment.obstacles) for moment in ride.moments} == {len(ride.obstacles)} == {1}


def test_at_is_the_last_cycle_not_after_a_time(ride: Ride) -> None:
    last = len(ride.moments) - 1
    assert [ride.at(time) for time in (-1.0, 0.0, 0.09, 0.1, 0.31, 99.0)] == [0, 0, 0, 1, 3, last]
    assert [ride.at(moment.time) for moment in ride.moments] == list(range(last + 1))


def test_moments_of_another_run_are_refused_and_none_are_allowed(run: RunResult, ride: Ride) -> None:
    with pytest.raises(InputError, match="must be those of the run, 33"):
        ride_of_run(run, ride.moments[1:])
    assert ride_of_run(run, title="mine").title == "mine"
    assert ride_of_run(run).moments == ()


def test_ride_of_a_recording_has_the_measured_states_and_recorded_commands(
    recorded: Path, replayed: Ride
) -> None:
    cycles = read_recording(recorded).cycles
    assert replayed.title == "eventful.jsonl"
    assert len(replayed.moments) == len(replayed.motion.times) == EVENTFUL
    for moment, cycle in zip(replayed.moments, cycles, strict=True):
        assert cycle.command is not None
        assert moment.goal is None
        assert moment.command.diagnostics.step_ms == cycle.command.diagnostics.step_ms
        if cycle.number != BLIND:
            state = cycle.inputs.state
            assert moment.pose.tolist() == [state.x, state.y, state.phi]
    assert np.isnan(replayed.moments[BLIND].pose[0])
    assert np.isnan(replayed.motion.goals).all()


def test_obstacles_come_and_go_as_recorded(replayed: Ride) -> None:
    def boxes(moment: Moment) -> list[float]:
        return [float(outline[:, 0].min()) for outline in moment.obstacles]

    assert boxes(replayed.moments[BEFORE - 1]) == []
    assert boxes(replayed.moments[BEFORE]) == pytest.approx([2.0, -3.0])
    assert boxes(replayed.moments[AWAY]) == pytest.approx([2.0, 4.0])


def test_whole_cycles_of_a_truncated_recording_are_shown(recorded: Path, tmp_path: Path) -> None:
    cut, told = tmp_path / "cut.jsonl", list[tuple[int, int]]()
    lines = recorded.read_bytes().splitlines(keepends=True)
    cut.write_bytes(b"".join(lines[:6]) + lines[6][:100])
    ride = ride_of_recording(cut, progress=lambda done, total: told.append((done, total)))
    assert ride.title == "cut.jsonl (truncated)"
    assert len(ride.moments) == 5
    assert told == [(done, 5) for done in range(1, 6)]


def test_a_recording_without_a_cycle_is_refused(tmp_path: Path) -> None:
    Recorder(docking_controller(SCENARIO), tmp_path / "none.jsonl").close()
    with pytest.raises(InputError, match=r"none\.jsonl: has no cycle to show"):
        ride_of_recording(tmp_path / "none.jsonl")
    with pytest.raises(RecordingError, match="cannot be read"):
        ride_of_recording(tmp_path / "nowhere.jsonl")


def test_camera_pictures_are_kept_small_and_show_the_detected_board() -> None:
    vehicle, dock = Pose2(2.0, 0.1, 0.02), Pose2(0.0, 0.0, 0.0)
    kept, camera, board = CameraFrames(CameraSection()), Camera(), CharucoBoard()
    picture = BoardCamera(camera, board, Optics(), np.random.default_rng(0)).expose(vehicle, dock)
    detection = CharucoGoalDetector(camera, board).detect(picture, 0.4)
    assert detection is not None
    kept(0.2, picture, None)
    kept(0.4, picture, detection)
    assert [stamp for stamp, _ in kept.frames] == [0.2, 0.4]
    coloured: list[Any] = []
    for _, jpeg in kept.frames:
        assert len(jpeg) < 100_000
        shown: Any = cv2.imdecode(np.frombuffer(jpeg, np.uint8), cv2.IMREAD_COLOR)
        assert shown.shape[1] == 560
        coloured.append(np.nonzero(shown.max(axis=2).astype(int) - shown.min(axis=2) > 60))
    assert not len(coloured[0][0])
    # Coloured axes on a grey picture.
    middle = camera.project([np.array([-vehicle.x + board.x, -vehicle.y, board.z])])[0] * 560 / camera.width
    assert np.median(coloured[1], axis=1)[::-1] == pytest.approx(middle, abs=30.0)
