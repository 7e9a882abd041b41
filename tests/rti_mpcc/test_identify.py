"""`rti-mpcc identify`: dead times and lags of a foreign vehicle from a recording of its drive."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchmarks.foreign import Car, Interface, drive, exact
from rti_mpcc import ControllerConfig, DockingController, VehicleState
from rti_mpcc.cli import main
from rti_mpcc.recording import Recorder
from rti_mpcc.simulation import load_scenario
from tests.lists import acceptance

TRUE = {"drive_dead_time": 0.12, "drive_lag": 0.33, "steering_dead_time": 0.07, "steering_lag": 0.21}


def recorded(file: Path, interface: Interface, seconds: float = 20.0, *, noisy: bool = True) -> None:
    scenario, config = load_scenario("docking_behind"), ControllerConfig()
    path = scenario.build_path()
    controller = DockingController(path, scenario.build_corridor(path), config)
    noise = np.array((0.01, 0.01, 0.002, 0.01, 0.002))

    def sensor(history: Any, rng: np.random.Generator) -> VehicleState:
        x, y, phi, v, delta = (history[-1, 1:] + noise * rng.standard_normal(5)).tolist()
        return VehicleState(x=x, y=y, phi=phi, v=v, delta=delta)

    car = Car.of(config.vehicle, interface=interface, **TRUE)
    with Recorder(controller, file) as recorder:
        sensed = sensor if noisy else exact
        drive(recorder.step, car, path.start, cycle=config.cycle, seconds=seconds, sensor=sensed)


@pytest.mark.parametrize("interface", ["rates", acceptance("setpoints")])
def test_the_fit_of_a_noisy_drive_is_that_of_the_vehicle(
    interface: Interface, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    recorded(tmp_path / "drive.jsonl", interface)
    assert main(["identify", str(tmp_path / "drive.jsonl"), "--out", str(tmp_path)]) == 0
    assert "ControllerConfig(actuators=ActuatorModel(dead_time=" in capsys.readouterr().out
    found = json.loads((tmp_path / "identified.json").read_text())
    for name in ("drive", "steering"):
        fit = found[name]
        total = TRUE[f"{name}_dead_time"] + TRUE[f"{name}_lag"]
        assert fit["dead_time_s"] + fit["lag_s"] == pytest.approx(total, abs=0.06)
        assert fit["dead_time_s"] == pytest.approx(TRUE[f"{name}_dead_time"], abs=0.08)
        assert fit["rms"] < fit["rms_without_dead_time_and_lag"]
        assert fit["gain"] == pytest.approx(1.0, abs=0.05)
    assert (tmp_path / "identified.png").stat().st_size > 10_000
    ControllerConfig(actuators=found["actuators"])


def test_a_drive_without_motion_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    recorded(tmp_path / "still.jsonl", "rates", seconds=0.3)
    assert main(["identify", str(tmp_path / "still.jsonl"), "--out", str(tmp_path)]) == 2
    assert "change too little" in capsys.readouterr().err
