"""What is seen of a cycle, and which half-planes are said to hold its plan."""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from geometry import Area, Corridor, Pose2, ReferencePath
from rti_mpcc.config import ControllerConfig
from rti_mpcc.docking import DockingController
from rti_mpcc.mission import DockingMission
from rti_mpcc.model.footprint import PIECES
from rti_mpcc.recording import Recorder
from rti_mpcc.report.views import TIGHT, ObservedCycle, Observer, held_by
from rti_mpcc.simulation import RunResult, docking_controller
from rti_mpcc.steps import DriveTo, Wait
from rti_mpcc.types import Array, Command, Source, VehicleState
from tests.rti_mpcc.docking_runs import short

REST = VehicleState(x=0.0, y=0.0, phi=0.0, v=0.0, delta=0.0)
CONFIG = ControllerConfig()
MARGIN = CONFIG.clearance.wanted
HALF_WIDTH = 0.5 * CONFIG.vehicle.width
LEFT, RIGHT = 3.0, -4.0


class Deaf:
    """A controller that does nothing but remember what it was told."""

    def __init__(self, command: Command) -> None:
        self.told: list[dict[str, Any]] = []
        self._command = command

    def step(self, state: VehicleState, *, now: float, **told: Any) -> Command:
        self.told.append({"state": state, "now": now} | told)
        return self._command


def straight(*, obstacles: tuple[Array, ...] = ()) -> Corridor:
    path = ReferencePath.from_segments(start=Pose2(0.0, 0.0, 0.0), segments=[(1, 0.0, 60.0)])
    return Corridor.from_offsets(path, left=LEFT, right=RIGHT, obstacles=obstacles)


@pytest.fixture
def command(looked_at: tuple[RunResult, list[ObservedCycle]]) -> Command:
    """Of a cycle whose plan came from a QP."""
    return looked_at[1][-1].command


def along(command: Command, sideways: float | Array) -> Command:
    """The same with a plan along x from 10 to 20 m, so far to the left of the path [m]."""
    states = np.zeros_like(command.trajectory.states)
    states[:, 0] = np.linspace(10.0, 20.0, len(states))
    states[:, 1] = sideways
    return replace(command, trajectory=replace(command.trajectory, states=states))


def test_onlooker_tells_the_controller_all_and_keeps_what_it_says(command: Command) -> None:
    deaf = Deaf(command)
    observer = Observer(deaf)
    goal = Pose2(1.0, 2.0, 3.0)
    assert observer.step(REST, now=0.5, goal=goal, obstacles=[]) is command
    assert deaf.told == [{"state": REST, "now": 0.5, "goal": goal, "measurements": (), "obstacles": []}]
    observer.step(REST, now=0.6, clock="its own")
    assert deaf.told[1]["clock"] == "its own"
    observer.step(REST, now=0.7, signal=True)
    assert deaf.told[2]["signal"] is True
    assert observer.observed == [ObservedCycle(state=REST, command=command, inside=None)] * 3


@pytest.mark.parametrize("recorded", [False, True])
def test_inside_is_that_of_the_cycles_own_qp(recorded: bool, tmp_path: Path) -> None:
    core = docking_controller(short())
    start = short().build_path().start
    state = VehicleState(x=start.x, y=start.y, phi=start.phi, v=0.0, delta=0.0)
    with ExitStack() as stack:
        recorder = stack.enter_context(Recorder(core, tmp_path / "run.jsonl")) if recorded else None
        observer = Observer(recorder or core)
        observer.step(state, now=0.0)
        solution = core.state.plans.solution
        # No QP is solved with such a state, though there is one to go on from.
        observer.step(replace(state, x=np.nan), now=0.05)
        assert core.state.plans.solution is not None
    inside, none = (observed.inside for observed in observer.observed)
    assert none is None
    assert inside is not None
    assert solution is not None
    assert inside.slack is solution.slack
    assert inside.times is solution.trajectory.times
    assert inside.weights is solution.weights


@pytest.mark.parametrize("recorded", [False, True])
def test_the_controller_of_a_mission_is_seen_and_signals_get_through(recorded: bool, tmp_path: Path) -> None:
    mission = DockingMission(
        DockingController.in_area(Area(), CONFIG), [Wait(until=lambda: False), DriveTo(Pose2(5.0, 0.0, 0.0))]
    )
    with ExitStack() as stack:
        recorder = stack.enter_context(Recorder(mission, tmp_path / "run.jsonl")) if recorded else None
        observer = Observer(recorder or mission)
        for cycle in range(8):
            observer.step(REST, now=cycle * CONFIG.cycle, signal=cycle == 1)
    assert [record.kind for record in mission.log] == ["wait", "drive_to"]
    assert observer.observed[0].path is None  # it has no way yet
    assert observer.observed[-1].inside is not None
    assert observer.observed[-1].planned is mission.controller.path


@pytest.mark.parametrize(
    ("room", "active", "lack"),
    [(MARGIN + 2.0 * TIGHT, False, 0.0), (MARGIN + 0.5 * TIGHT, True, 0.0), (MARGIN - 0.02, True, 0.02)],
)
def test_half_plane_is_active_where_the_body_has_hardly_more_than_the_margin(
    command: Command, room: float, active: bool, lack: float
) -> None:
    planes, lacking = held_by(along(command, LEFT - HALF_WIDTH - room), straight(), CONFIG)
    assert lacking == pytest.approx(np.full(CONFIG.stages, lack), abs=1e-6)
    assert len(planes.points) == (CONFIG.stages * PIECES if active else 0)
    assert planes.points[:, 1] == pytest.approx(np.full(len(planes.points), LEFT), abs=1e-9)
    assert planes.normals == pytest.approx(np.tile([0.0, -1.0], (len(planes.points), 1)), abs=1e-6)


def test_stages_are_told_apart(command: Command) -> None:
    sideways = np.zeros(CONFIG.stages + 1)
    sideways[7] = RIGHT + HALF_WIDTH + MARGIN - 0.03
    planes, lacking = held_by(along(command, sideways), straight(), CONFIG)
    assert np.flatnonzero(lacking).tolist() == [6]
    assert len(planes.points) == PIECES
    assert planes.normals[:, 1] == pytest.approx(np.ones(PIECES))


def test_obstacles_hold_a_plan_too(command: Command) -> None:
    block = np.array([[14.0, 1.1], [15.0, 1.1], [15.0, 2.0], [14.0, 2.0]])
    assert len(held_by(along(command, 0.0), straight(), CONFIG)[0].points) == 0
    planes, _ = held_by(along(command, 0.0), straight(obstacles=(block,)), CONFIG)
    assert len(planes.points) > 0
    assert planes.points[:, 1] == pytest.approx(np.full(len(planes.points), 1.1), abs=1e-9)


def test_a_wall_ahead_holds_a_plan_where_the_body_comes_near_it(command: Command) -> None:
    """The plan ends at 20 m."""
    vehicle = CONFIG.vehicle
    for room, lack in ((MARGIN + 0.01, 0.0), (MARGIN - 0.04, 0.04)):
        near = 20.0 + vehicle.front + room
        block = np.array([[near, -1.5], [near + 0.3, -1.5], [near + 0.3, 1.5], [near, 1.5]])
        planes, lacking = held_by(along(command, 0.0), straight(obstacles=(block,)), CONFIG)
        assert lacking.max() == pytest.approx(lack, abs=1e-6)
        assert len(planes.points) == (1 if lack else 0)


@pytest.mark.parametrize("source", [Source.BRAKING, Source.STANDSTILL])
def test_a_motion_that_is_no_solution_is_held_by_none(command: Command, source: Source) -> None:
    beside = replace(along(command, LEFT), source=source)
    planes, lacking = held_by(beside, straight(), CONFIG)
    assert not len(planes.points)
    assert not lacking.any()


def test_arrays_are_read_only(film: Any) -> None:
    view = film.views[-1]
    for array in (view.pose, view.goal, view.aim, view.lack, view.planes.points, view.planes.normals):
        assert not array.flags.writeable
