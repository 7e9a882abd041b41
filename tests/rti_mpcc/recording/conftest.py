"""One eventful recording for all tests that only read it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from rti_mpcc.recording import Recorder
from rti_mpcc.simulation import docking_controller
from rti_mpcc.types import VehicleState
from tests.rti_mpcc.recording.recordings import AWAY, EVENTFUL, SCENARIO, drive, eventful


@pytest.fixture(scope="session")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Detections, obstacles that come and go, a cleared goal, faults: everything that may happen."""
    file = tmp_path_factory.mktemp("recording") / "eventful.jsonl"
    with Recorder(docking_controller(SCENARIO), file) as recorder:

        def given(cycle: int, state: VehicleState) -> dict[str, Any]:
            if cycle == AWAY:
                recorder.clear_goal()
            return eventful(cycle, state)

        drive(recorder, range(EVENTFUL), given)
    return file
