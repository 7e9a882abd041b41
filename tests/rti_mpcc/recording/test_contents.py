"""Everything that a recording holds comes back from its file, the same to the bit."""

from __future__ import annotations

import json
import platform
from collections.abc import Sequence
from dataclasses import fields
from math import nan, pi
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from estimation import CharucoBoard
from geometry import Area, Corridor, Narrowing, PathPart, Pose2, ReferencePath
from rti_mpcc import ControllerConfig, DockingController
from rti_mpcc.config import SolverSettings, Vehicle
from rti_mpcc.mission import Approach, Dock, DockingMission, DockKind, DriveTo, Step, Straight, Undock, Wait
from rti_mpcc.model.footprint import body_of
from rti_mpcc.paper import with_method
from rti_mpcc.recording import Header, Machine, Recorder, read_recording
from rti_mpcc.recording.contents import Driver, core_of
from rti_mpcc.types import Source, Status, VehicleState
from tests.geometry.sides import contacts_of
from tests.rti_mpcc.recording.recordings import (
    DETECTED,
    EVENTFUL,
    GOAL,
    SCENARIO,
    box,
    controller,
    drive,
    measurement,
)

ROUTE = ReferencePath.from_segments(
    Pose2(0.1, 0.2, pi / 3), [(1, 0.05, 8.0), (-1, -0.2, 10.0), (-1, 0.1, 7.0)]
)

STRAIGHT = ReferencePath.from_segments(Pose2(2.0, 0.0, 0.0), [(1, 0.0, 16.0)])
WIDE = Corridor.from_offsets(ROUTE, left=3.0, right=-3.0)
OBSTACLES: list[Any] = [[(30.0, 30.0), (31.0, 30.0), (31.5, 31.0)], box(40.0, 0.0)]
YARD = np.array([(-8.0, -8.0), (22.0, -8.0), (20.0 + 1 / 3, 8.0), (-8.0, 8.0)])
COMMON: dict[str, Any] = {
    "timeout": 60.0, "patience": 9.0, "retries": 2, "retry_from": 0, "then": "continue"
}  # fmt: skip
STEPS: tuple[Step, ...] = (
    Dock(
        Pose2(1.0, 2.0, 0.5 * pi), name="ä", kind=DockKind.CHARUCO,
        board=CharucoBoard(first_marker=7, x=-1 / 3), approach=Approach(2.0, -1),
        tolerance=(0.04, 0.02, 0.01), body=((-4, -1), (-2.5, -1), (-2.5, 1.1)), uncertainty=(0.8, 1 / 9),
        contact=Straight(
            -1.0, speed=0.1, steering=1 / 30, tolerance=(0.01, 0.02), until=lambda: True, **COMMON
        ),
        **COMMON,
    ),
    Wait(1 / 3, until=lambda: False, **COMMON),
    Straight(-1.5, speed=0.3, steering=0.04, tolerance=(0.03, 0.02), until=lambda: True, **COMMON),
    Undock(-4.0, **COMMON),
    DriveTo(Pose2(5.0, 6.0, 1 / 7), tolerance=(0.1, 0.2, 0.3), **COMMON),
)  # fmt: skip
"""One of each kind, with nothing left as it is where it is not said."""


def back(driver: Driver, folder: Path) -> Header:
    """The header of a recording of a controller or mission, read from its file."""
    Recorder(driver, folder / "run.jsonl").close()
    return read_recording(folder / "run.jsonl").header


def assert_same(one: Any, other: Any) -> None:
    """The same values in all fields, and the same bits in all arrays."""
    if isinstance(one, np.ndarray):
        np.testing.assert_array_equal(one, other, strict=True)
        assert not other.flags.writeable
    elif isinstance(one, Step | PathPart):
        assert type(other) is type(one)
        for field in fields(one):
            value, again = getattr(one, field.name), getattr(other, field.name)
            if field.name == "until":  # a recording holds that there is one
                assert callable(again) == callable(value)
            elif field.name == "body" and value is not None:
                assert_same(np.asarray(value, dtype=np.float64), again)
            else:
                assert_same(value, again)
    else:
        assert repr(other) == repr(one)


@pytest.mark.parametrize(
    "path",
    [
        ROUTE,
        ReferencePath.from_poses([Pose2(0, 0, 0), Pose2(6, 1, 0.3), Pose2(12, 3, 0.3)], 1),
        ReferencePath.from_waypoints([(0, 0), (5, 0.4), (11, 1.1), (17, 1.3)], -1),
    ],
)
def test_path(path: ReferencePath, tmp_path: Path) -> None:
    corridor = Corridor.from_offsets(path, left=3.0, right=-3.0)
    again = back(DockingController(path, corridor, ControllerConfig(recovery=None)), tmp_path).path
    for part, other in zip(path.parts, again.parts, strict=True):
        assert_same(part, other)


@pytest.mark.parametrize(
    ("path", "corridor"),
    [
        (ROUTE, Corridor.from_offsets(ROUTE, left=3, right=-3, narrowings=[Narrowing(12, 13, left=1.4)])),
        (ROUTE, WIDE.with_obstacles(OBSTACLES)),
        (STRAIGHT, Corridor.from_polygon(STRAIGHT, [(0, -3), (20, -3), (20, 2.5), (0, 2.5)])),
    ],
)
def test_corridor(path: ReferencePath, corridor: Corridor, tmp_path: Path) -> None:
    again = back(DockingController(path, corridor), tmp_path).corridor
    poses = np.random.default_rng(0).uniform(-5.0, 25.0, (200, 3))
    for part in range(len(path.parts)):
        one, two = (
            contacts_of(each, part, body_of(Vehicle(), 2), poses, 5.0, 0.02).values
            for each in (corridor, again)
        )
        assert one.tobytes() == two.tobytes()
    assert again.narrowest() == corridor.narrowest()
    assert all(map(np.array_equal, again.obstacles, corridor.obstacles))


@pytest.mark.parametrize("shift", [0.0, 123_456.7])
@pytest.mark.parametrize("boundary", [None, YARD])
def test_area(boundary: Any, shift: float, tmp_path: Path) -> None:
    obstacles = [np.asarray(each) + shift for each in OBSTACLES]
    area = Area(boundary=None if boundary is None else boundary + shift, obstacles=obstacles)
    header = back(DockingController.in_area(area), tmp_path)
    assert (header.steps, header.home) == (None, None)
    again = header.corridor.area
    assert again is not None
    assert repr(again.boundary) == repr(area.boundary)
    assert all(map(np.array_equal, again.obstacles, area.obstacles))
    assert again.grid.corners.tobytes() == area.grid.corners.tobytes()
    assert core_of(header.driver()).path is None


@pytest.mark.parametrize(
    "config",
    [
        ControllerConfig(),
        ControllerConfig.paper(cycle=0.07),
        ControllerConfig.paper_printed(),
        ControllerConfig(deadline=0.1 + 0.2),
        with_method(ControllerConfig(), "separated"),
        ControllerConfig(solver=SolverSettings(tolerance=1 / 3e5)),
    ],
)
def test_config(config: ControllerConfig, tmp_path: Path) -> None:
    assert back(DockingController(ROUTE, WIDE, config), tmp_path).config == config


@pytest.mark.parametrize(
    "steps", [STEPS, [Dock(), Wait(0), Wait(until=lambda: True), Straight(1), Undock(5e-324), STEPS[-1]]]
)
def test_every_field_of_every_step_of_a_mission(steps: Sequence[Step], tmp_path: Path) -> None:
    home = DriveTo(Pose2(1.0, 2.0, 3.0), tolerance=(0.1, 0.2, 0.3), timeout=5.0)
    mission = DockingMission(DockingController.in_area(Area()), steps, home=home)
    again = back(mission, tmp_path).driver()
    assert isinstance(again, DockingMission)
    for one, other in zip((*mission.steps, home), (*again.steps, again.home), strict=True):
        assert_same(one, other)


def test_cycles_come_back_typed(recording: Path) -> None:
    read = read_recording(recording)
    assert read.complete
    assert read.header.config == SCENARIO.controller_config()
    assert read.header.machine == Machine.here()
    cycle = read.cycles[DETECTED]
    assert cycle.inputs.goal == GOAL
    assert cycle.inputs.measurements[0].vehicle is not None
    assert cycle.command is not None
    assert cycle.command.source is Source.SOLUTION
    assert cycle.command.status in (Status.ARRIVING, Status.FOLLOWING)


def test_the_commands_of_the_file_are_those_that_were_given(tmp_path: Path) -> None:
    with Recorder(controller(), tmp_path / "run.jsonl") as recorder:
        given = drive(recorder, range(3))
    for command, cycle in zip(given, read_recording(tmp_path / "run.jsonl").cycles, strict=True):
        assert cycle.command is not None
        for field in ("times", "states", "controls"):
            assert_same(getattr(command.trajectory, field), getattr(cycle.command.trajectory, field))
        assert repr(cycle.command.diagnostics) == repr(command.diagnostics)


def test_any_numbers_keep_their_bits(tmp_path: Path) -> None:
    numbers = np.frombuffer(np.random.default_rng(0).bytes(8_000))
    numbers = np.concatenate([[5e-324, -0.0, 0.1 + 0.2, np.inf, nan], numbers[np.isfinite(numbers)]])
    state = VehicleState(x=1.0, y=2.0, phi=1.0, v=0.0, delta=0.0)
    with Recorder(controller(), tmp_path / "run.jsonl") as recorder:
        seen = measurement(0, state, x=nan, covariance=numbers[:9].reshape(3, 3))
        recorder.step(state, now=0.0, measurements=[seen], obstacles=[numbers, np.empty((0, 2))])
    inputs = read_recording(tmp_path / "run.jsonl").cycles[0].inputs
    assert inputs.obstacles is not None
    assert_same(numbers, inputs.obstacles[0])
    assert_same(np.empty((0, 2)), inputs.obstacles[1])
    assert_same(numbers[:9].reshape(3, 3), inputs.measurements[0].covariance)
    assert repr(inputs.measurements[0].x) == "nan"


def test_every_line_is_json_and_names_no_host_user_or_folder(recording: Path) -> None:
    lines = [json.loads(line) for line in recording.read_text(encoding="utf-8").splitlines()]
    assert lines[0]["format"] == "rti-mpcc recording"
    assert [line["number"] for line in lines[1:-1]] == list(range(EVENTFUL))
    assert lines[-1]["end"] == EVENTFUL
    assert set(Machine.here().versions) >= {"python", "numpy", "scipy", "osqp", "shapely", "filterpy"}
    for private in (platform.node(), str(Path.home()), str(recording.parent)):
        assert len(private) < 3 or private not in json.dumps(lines[0])
