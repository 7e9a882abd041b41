"""A controller that plans its way is recorded and replayed as any other, on polygons and on a map."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from geometry import Area, Corridor, Pose2
from rti_mpcc import ControllerConfig, DockingController
from rti_mpcc.planning.clock import CycleClock
from rti_mpcc.recording import Header, Recorder, ReplayReport, read_recording, replay
from rti_mpcc.recording.codec import structured
from rti_mpcc.recording.lines import from_line, to_line
from rti_mpcc.simulation import Controller, Scenario, changed, docking_controller, load_scenario, simulate
from rti_mpcc.types import Command, Status, VehicleState
from tests.rti_mpcc.recording.recordings import Moody

FAR = 123_456.7
YARD = np.array([(-8.0, -8.0), (22.0, -8.0), (20.0 + 1 / 3, 8.0), (-8.0, 8.0)])
OBSTACLES = [np.array([(7.0, 1.5), (8.0, 1.5), (8.1, 7.0)]), np.array([(1.0, 3.0), (2.0, 3.0), (2.0, 4.0)])]
AREAS: dict[str, Area] = {
    "outline": Area(boundary=YARD),
    "outline and obstacles": Area(boundary=YARD, obstacles=OBSTACLES),
    "obstacles": Area(obstacles=OBSTACLES),
    "far away": Area(boundary=YARD + FAR, obstacles=[each + FAR for each in OBSTACLES]),
}


def recorded(scenario: Scenario, file: Path, *, moody: bool = False) -> Path:
    """A run of a scenario."""
    with Recorder(docking_controller(scenario), file) as recorder:
        controller: Controller = Whimsical(recorder) if moody else recorder
        simulate(scenario, controller=controller)
    return file


class Whimsical:
    """A controller whose clock decides by chance."""

    def __init__(self, controller: Recorder) -> None:
        self.controller = controller
        self._random = np.random.default_rng(3)

    def step(
        self,
        state: VehicleState,
        *,
        now: float,
        goal: Pose2 | None = None,
        measurements: Sequence[Any] = (),
        obstacles: Sequence[Any] | None = None,
        clock: CycleClock | None = None,
    ) -> Command:
        return self.controller.step(
            state,
            now=now,
            goal=goal,
            measurements=measurements,
            obstacles=obstacles,
            clock=Moody(self._random),
        )


def begun(scenario: str, seconds: float, **changes: Any) -> Scenario:
    """The first seconds of a built-in scenario."""
    return changed(load_scenario(scenario), {"simulation.duration": seconds, **changes})


def assert_identical(report: ReplayReport) -> None:
    assert report.mismatch is None
    assert (report.tolerance, report.complete) == (0.0, True)


@pytest.mark.parametrize("name", AREAS)
def test_an_area_comes_back_to_the_last_bit(name: str) -> None:
    area = AREAS[name]
    header = Header.of(DockingController.in_area(area, ControllerConfig(deadline=0.02)))
    again = structured(from_line(to_line(header).rstrip())[0], Header)
    found = Corridor.from_lines(again.corridor).area
    assert found is not None
    assert (found.boundary is None) == (area.boundary is None)
    if area.boundary is not None and found.boundary is not None:
        assert np.array_equal(found.boundary, area.boundary)
    assert len(found.obstacles) == len(area.obstacles)
    assert all(map(np.array_equal, found.obstacles, area.obstacles))
    assert again.config == header.config
    controller = again.controller()
    assert controller.path is None
    assert Header.of(controller).corridor.area is not None


@pytest.mark.parametrize("deadline", [None, 0.1])
@pytest.mark.parametrize("scenario", ["bay_perpendicular", "aisle_dock"])
def test_planning_and_the_first_metres_replay_bit_for_bit(
    tmp_path: Path, scenario: str, deadline: float | None
) -> None:
    """One area is of polygons, the other one a map."""
    file = recorded(begun(scenario, 6.0, **{"controller.deadline": deadline}), tmp_path / "run.jsonl")
    cycles = read_recording(file).cycles
    said = [cycle.command.status for cycle in cycles if cycle.command]
    assert said[0] is Status.PLANNING
    assert Status.ARRIVING in said
    assert_identical(replay(file))


def test_slices_that_had_no_time_have_none_again(tmp_path: Path) -> None:
    """Another controller would have its way sooner, and drive it from elsewhere."""
    scenario = begun("bay_perpendicular", 2.0)
    late = read_recording(recorded(scenario, tmp_path / "late.jsonl", moody=True))
    soon = read_recording(recorded(scenario, tmp_path / "soon.jsonl"))
    planning = [
        sum(cycle.command is not None and cycle.command.status is Status.PLANNING for cycle in each.cycles)
        for each in (late, soon)
    ]
    assert planning[0] > planning[1]
    assert_identical(replay(tmp_path / "late.jsonl"))


def test_what_was_told_on_the_way_is_told_again(tmp_path: Path) -> None:
    """Something fills the way, and another one is planned, with detections of the goal."""
    faults = [{"kind": "blocked", "from": 1.5, "to": 3.0, "size": 3.0}]
    scenario = begun("obstacle_appears", 4.0, **{"faults": faults, "goal.measurement": {}})
    file = recorded(scenario, tmp_path / "run.jsonl")
    assert any(cycle.inputs.obstacles for cycle in read_recording(file).cycles)
    assert_identical(replay(file))


@pytest.mark.acceptance
@pytest.mark.parametrize("deadline", [None, 0.02, 0.006])
@pytest.mark.parametrize("scenario", ["aisle_dock", "obstacle_appears", "slot_parallel", "yard_dead_end"])
def test_a_whole_docking_replays_bit_for_bit(tmp_path: Path, scenario: str, deadline: float | None) -> None:
    whole = changed(load_scenario(scenario), {"controller.deadline": deadline})
    file = recorded(whole, tmp_path / "run.jsonl")
    last = read_recording(file).cycles[-1].command
    assert last is not None
    assert last.docked
    assert_identical(replay(file))
