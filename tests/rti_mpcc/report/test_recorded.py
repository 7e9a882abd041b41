"""Figures of a recording are those of the run that it was made of, where its measurements were exact."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from rti_mpcc.recording import Recorder
from rti_mpcc.report.recorded import recorded_summary
from rti_mpcc.report.ride import ride_of_recording
from rti_mpcc.simulation import changed, docking_controller, load_scenario, simulate, summary
from tests.rti_mpcc.recording.recordings import EVENTFUL, eventful_recording


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


def test_odd_measurements_and_clocks_count_for_no_motion(tmp_path: Path) -> None:
    figures = recorded_summary(ride_of_recording(eventful_recording(tmp_path / "eventful.jsonl")))
    assert figures["cycles"] == EVENTFUL
    assert figures["docked"] is False
    assert figures["time_to_dock_s"] is None
    assert 0.0 <= figures["distance_m"] < 1.0
    assert figures["peak"]["acceleration"] < 1.0
