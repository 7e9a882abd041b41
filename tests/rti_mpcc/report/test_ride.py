"""Rides of runs and of recordings, and the pictures of a camera."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rti_mpcc.errors import InputError, RecordingError
from rti_mpcc.recording import Recorder, read_recording
from rti_mpcc.report.recorded import recorded_summary
from rti_mpcc.report.ride import Ride, ride_of_recording
from rti_mpcc.simulation import RunResult, changed, docking_controller, load_scenario, simulate, summary
from tests.rti_mpcc.recording.recordings import BLIND, EVENTFUL, SCENARIO, eventful_recording


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A recording with obstacles that come and go, a clock that goes back, and a cycle without a position."""
    return eventful_recording(tmp_path_factory.mktemp("ride") / "eventful.jsonl")


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


# -- figures of a recording are those of the run that it was made of, where its measurements were exact -----


@pytest.fixture(scope="module")
def both(tmp_path_factory: pytest.TempPathFactory) -> tuple[dict[str, Any], dict[str, Any]]:
    """Figures of a run until shortly after it has docked, and of its recording."""
    file = tmp_path_factory.mktemp("recorded") / "near.jsonl"
    changes = {"simulation.dead_time": 0.0, "simulation.plant_step": 0.01}
    scenario = changed(load_scenario("docking_inside"), changes)
    with Recorder(docking_controller(scenario), file) as recorder:
        result = simulate(scenario, controller=recorder)
    return summary(result), recorded_summary(ride_of_recording(file))


def test_they_agree_with_those_of_the_run(both: tuple[dict[str, Any], dict[str, Any]]) -> None:
    run, recorded = both
    for name in ("docked", "direction_changes", "comfort", "hard_braking", "solver", "deadline_misses"):
        assert recorded[name] == run[name], name
    # The controller says so once the vehicle has stood for a moment.
    assert 0.0 <= recorded["time_to_dock_s"] - run["time_to_dock_s"] < 1.5
    for name in ("distance_m", "max_steering_rad", "min_clearance_m"):
        assert recorded[name] == pytest.approx(run[name], rel=0.01, abs=0.002), name
    for name, value in run["peak"].items():
        assert recorded["peak"][name] == pytest.approx(value, rel=0.02), name
    for name, value in run["energy_to_dock"].items():
        assert recorded["energy"][name] == pytest.approx(value, rel=0.03), name
    assert recorded["final_error"] == pytest.approx(run["final_error"], abs=1e-3)


def test_the_time_in_each_status_is_the_whole_time(both: tuple[dict[str, Any], dict[str, Any]]) -> None:
    spent = both[1]["statuses"]
    assert {"arriving", "settling", "docked"} <= set(spent)
    assert sum(spent.values()) == pytest.approx(both[1]["duration_s"])


def test_odd_measurements_and_clocks_count_for_no_motion(replayed: Ride) -> None:
    figures = recorded_summary(replayed)
    assert figures["cycles"] == EVENTFUL
    assert figures["docked"] is False
    assert figures["time_to_dock_s"] is None
    assert 0.0 <= figures["distance_m"] < 1.0
    assert figures["peak"]["acceleration"] < 1.0
