"""An objective from outside the package, that of docs/tutorials/compare.md: recordings hold it."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from rti_mpcc import ConfigError, ControllerConfig, DockingController
from rti_mpcc.objectives import DockingObjective
from rti_mpcc.recording import Recorder, read_recording, replay
from rti_mpcc.simulation import changed, load_scenario, simulate
from tests.rti_mpcc.own_code import shown_class

SCENARIO = changed(load_scenario("docking_behind"), {"simulation.duration": 1.0})


@pytest.fixture
def kind() -> Iterator[Any]:
    """The class that the page shows, as typed in a module of its own."""
    with shown_class("tutorials/compare.md", "Blended", DockingObjective.KINDS, "Blended") as shown:
        yield shown


def commands(config: ControllerConfig, file: Path) -> list[float]:
    """Accelerations of the first second, which goes to a recording."""
    path = SCENARIO.build_path()
    controller: Any = DockingController(path, SCENARIO.build_corridor(path), config)
    with Recorder(controller, file) as recorder:
        accelerations = simulate(SCENARIO, controller=recorder).cycles.acceleration
    return list(map(float, accelerations))


def test_it_drives_otherwise_and_a_recording_holds_it(kind: Any, tmp_path: Path) -> None:
    usual, own = SCENARIO.controller_config(), tmp_path / "own.jsonl"
    config = usual.changed(objective=kind())
    assert commands(config, own) != commands(usual, tmp_path / "usual.jsonl")
    assert replay(own).identical
    assert read_recording(own).header.config.objective == kind()


def test_an_unknown_one_is_refused() -> None:
    unknown: Any = {"kind": "Blended"}
    with pytest.raises(ConfigError, match="kind = 'Blended': must be one of DockingObjective, "):
        ControllerConfig(objective=unknown)
