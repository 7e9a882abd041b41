"""Films of runs and of recordings."""

from __future__ import annotations

import logging
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from geometry import Area, Pose2
from rti_mpcc.config import ControllerConfig
from rti_mpcc.docking import DockingController
from rti_mpcc.errors import InputError, RecordingError
from rti_mpcc.mission import DockingMission
from rti_mpcc.recording import Recorder, read_recording
from rti_mpcc.report.film import Film, film_of_recording, film_of_run
from rti_mpcc.report.views import ObservedCycle, Observer
from rti_mpcc.simulation import RunResult, changed, docking_controller, load_scenario, simulate
from rti_mpcc.steps import AnyStep, DriveTo, Wait
from rti_mpcc.types import Status, VehicleState
from tests.rti_mpcc.recording.recordings import (
    AWAY,
    BACK,
    BEFORE,
    BLIND,
    CYCLE,
    EVENTFUL,
    SCENARIO,
    change,
    drive,
    eventful,
)


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[ObservedCycle]]:
    """An eventful recording, and what was seen while it was made."""
    file = tmp_path_factory.mktemp("film") / "eventful.jsonl"
    with Recorder(docking_controller(SCENARIO), file) as recorder:
        observer: Any = Observer(recorder)
        drive(observer, range(EVENTFUL), eventful)
    return file, observer.observed


@pytest.fixture(scope="module")
def replayed(recorded: tuple[Path, list[ObservedCycle]]) -> Film:
    return film_of_recording(recorded[0])


def test_film_of_a_run_has_each_cycle_where_the_vehicle_truly_was(run: RunResult, film: Film) -> None:
    assert film.label == "docking_full_course (default)"
    assert film.times == pytest.approx(run.cycles.times)
    assert film.config is run.config
    rows = np.searchsorted(run.truth.times, run.cycles.times - 1e-9)
    assert np.array([view.pose for view in film.views]) == pytest.approx(run.truth.poses[rows])
    assert all(
        view.goal is not None and view.goal.tolist() == run.truth.goals[0].tolist() for view in film.views
    )
    assert [len(view.obstacles) for view in film.views] == [1] * len(film.views)


def test_at_is_the_last_cycle_not_after_a_time(film: Film) -> None:
    assert [film.at(time) for time in (-1.0, 0.0, 0.09, 0.1, 0.31, 99.0)] == [
        0,
        0,
        0,
        1,
        3,
        len(film.views) - 1,
    ]
    assert [film.at(float(time)) for time in film.times] == list(range(len(film.views)))


def test_what_was_seen_of_another_run_is_refused(looked_at: tuple[RunResult, list[ObservedCycle]]) -> None:
    run, observed = looked_at
    with pytest.raises(InputError, match="must be those of the run, 33"):
        film_of_run(run, observed[1:])


def test_label_can_be_given(looked_at: tuple[RunResult, list[ObservedCycle]]) -> None:
    assert film_of_run(*looked_at, label="mine").label == "mine"


def test_film_of_a_recording_shows_what_was_measured_and_recorded(
    recorded: tuple[Path, list[ObservedCycle]], replayed: Film
) -> None:
    cycles = read_recording(recorded[0]).cycles
    assert replayed.label == "eventful.jsonl"
    assert len(replayed.views) == EVENTFUL
    for view, cycle in zip(replayed.views, cycles, strict=True):
        assert cycle.command is not None
        assert view.goal is None
        assert view.observed.state == cycle.inputs.state or cycle.number == BLIND
        assert view.observed.command.status is cycle.command.status
        assert view.observed.command.diagnostics.step_ms == cycle.command.diagnostics.step_ms
        if cycle.number != BLIND:
            assert view.pose.tolist() == [cycle.inputs.state.x, cycle.inputs.state.y, cycle.inputs.state.phi]
    assert np.isnan(replayed.views[BLIND].pose[0])


def test_driven_along_a_controller_gives_what_a_recording_does_not_hold(
    recorded: tuple[Path, list[ObservedCycle]], replayed: Film, caplog: pytest.LogCaptureFixture
) -> None:
    insides = 0
    for view, live in zip(replayed.views, recorded[1], strict=True):
        inside = view.observed.inside
        assert (inside is None) == (live.inside is None)
        if inside is not None and live.inside is not None:
            insides += 1
            assert inside.slack == pytest.approx(live.inside.slack, abs=1e-9)
            assert inside.weights.acceleration == pytest.approx(live.inside.weights.acceleration)
    assert insides > EVENTFUL // 2
    assert caplog.records == []


def test_obstacles_come_and_go_as_they_were_told(replayed: Film) -> None:
    boxes = [[outline[:, 0].min() for outline in view.obstacles] for view in replayed.views]
    assert boxes[BEFORE - 1] == []
    assert boxes[BEFORE] == pytest.approx([2.0, -3.0])
    assert boxes[AWAY] == pytest.approx([2.0, 4.0])


def test_time_of_a_film_never_goes_back(replayed: Film) -> None:
    assert (np.diff(replayed.times) >= 0.0).all()
    assert replayed.times[BACK] == replayed.times[BACK - 1] == pytest.approx((BACK - 1) * CYCLE)


def test_whole_cycles_of_a_truncated_recording_are_shown(
    recorded: tuple[Path, list[ObservedCycle]], tmp_path: Path
) -> None:
    cut = tmp_path / "cut.jsonl"
    lines = recorded[0].read_bytes().splitlines(keepends=True)
    cut.write_bytes(b"".join(lines[:6]) + lines[6][:100])
    told: list[tuple[int, int]] = []
    film = film_of_recording(cut, progress=lambda done, total: told.append((done, total)))
    assert film.label == "cut.jsonl (truncated)"
    assert len(film.views) == 5
    assert told == [(done, 5) for done in range(1, 6)]


def test_film_of_a_recorded_mission_shows_its_ways(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    """What told that a step was over, and that it was cancelled, are those of the recording."""
    steps: list[AnyStep] = [Wait(until=lambda: False), DriveTo(Pose2(5.0, 0.0, 0.0))]
    mission = DockingMission(DockingController.in_area(Area(), ControllerConfig()), steps)
    rest = VehicleState(x=0.0, y=0.0, phi=0.0, v=0.0, delta=0.0)
    with Recorder(mission, tmp_path / "mission.jsonl") as recorder:
        observer = Observer(recorder)
        for cycle in range(12):
            if cycle == 10:
                recorder.cancel()
            observer.step(rest, now=cycle * CYCLE, signal=cycle == 1)
    film = film_of_recording(tmp_path / "mission.jsonl")
    assert (film.path, film.area is None) == (None, False)
    insides = 0
    for view, live in zip(film.views, observer.observed, strict=True):
        assert view.observed.command.mission == live.command.mission
        assert (view.observed.planned is None) == (live.planned is None)
        assert (view.observed.inside is None) == (live.inside is None)
        insides += live.inside is not None
    assert insides > 3
    assert film.views[-1].observed.command.status is Status.WAITING
    assert caplog.records == []


def test_a_recording_without_a_cycle_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "none.jsonl"
    Recorder(docking_controller(SCENARIO), file).close()
    with pytest.raises(InputError, match=r"none\.jsonl: has no cycle to show"):
        film_of_recording(file)
    with pytest.raises(RecordingError, match="cannot be read"):
        film_of_recording(tmp_path / "nowhere.jsonl")


def test_from_where_the_replay_differs_stages_are_left_out_and_that_is_told(
    recorded: tuple[Path, list[ObservedCycle]], caplog: pytest.LogCaptureFixture
) -> None:
    """As on another machine, or with another version: here by another input."""

    def aside(data: dict[str, Any]) -> None:
        data["inputs"]["state"]["y"] += 0.02

    with caplog.at_level(logging.WARNING, logger="rti_mpcc.report.film"):
        film = film_of_recording(change(recorded[0], 5, aside, checked=True))
    insides = [view.observed.inside is not None for view in film.views]
    assert insides[:5] == [observed.inside is not None for observed in recorded[1][:5]]
    assert any(insides[:5])
    assert not any(insides[5:])
    (message,) = [record.getMessage() for record in caplog.records if "replayed" in record.getMessage()]
    assert message.startswith("cycle 5 is not replayed as it was recorded")


def test_a_recording_in_an_area_shows_it_and_the_way_that_is_driven(tmp_path: Path) -> None:
    scenario = changed(load_scenario("bay_perpendicular"), {"simulation.duration": 2.0})
    with Recorder(docking_controller(scenario), tmp_path / "bay.jsonl") as recorder:
        simulate(scenario, controller=recorder)
    film = film_of_recording(tmp_path / "bay.jsonl")
    assert (film.path, film.corridor) == (None, None)
    assert film.area is not None
    assert film.area.boundary is not None
    assert np.array_equal(film.area.boundary, np.array(scenario.build_area().boundary))
    first, last = film.views[0].observed, film.views[-1].observed
    assert first.path is None
    assert last.path is not None
    assert last.path.start.x == pytest.approx(scenario.start_pose().x)
    assert last.corridor is not None
    assert last.inside is not None
